//! What programs and benchmarks share.

use tropism::task::{Obstacles, TaskSpec};

/// The tasks with obstacles that come with the program.
pub fn tasks() -> [(&'static str, Obstacles); 3] {
    let parsed = |text: &str| match toml::from_str(text).expect("a task file") {
        TaskSpec::Obstacles(task) => task,
        _ => panic!("wanted a task with obstacles"),
    };
    [
        ("disc", parsed(include_str!("../../tasks/disc.toml"))),
        ("gap", parsed(include_str!("../../tasks/gap.toml"))),
        ("bar", parsed(include_str!("../../tasks/bar.toml"))),
    ]
}
