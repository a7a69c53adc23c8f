//! What programs and benchmarks share.

use tropism::task::Task;

/// The tasks with obstacles that come with the program.
pub fn tasks() -> [(&'static str, Task); 3] {
    let parsed = |text: &str| toml::from_str(text).expect("a task file");
    [
        ("disc", parsed(include_str!("../../tasks/disc.toml"))),
        ("gap", parsed(include_str!("../../tasks/gap.toml"))),
        ("bar", parsed(include_str!("../../tasks/bar.toml"))),
    ]
}
