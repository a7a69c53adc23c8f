//! `tropism baseline`: the fitness of random controllers.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::baseline::{BaselinePlan, BaselineResults};

use crate::options::{SeedOption, TaskOption};
use crate::progress::{check_outputs, execute_and_print};
use crate::shell::Shell;

/// Evaluate random controllers: the paper's baseline (section 3.1)
///
/// Each is a network like those of NEAT's initial population. The paper evaluated two million.
#[derive(Args)]
#[command(after_help = "Example:\n  tropism baseline --model model.json --count 200000 --out random.json")]
pub(crate) struct Baseline {
    /// Model, from `tropism fit`
    #[arg(long, value_name = "model.json")]
    model: PathBuf,

    /// Number of controllers
    #[arg(long, default_value_t = 2_000_000, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: u64,

    /// File to write the genome of the best controller to
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long, requires = "out")]
    force: bool,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,
}

impl Baseline {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = BaselinePlan {
            model: self.model,
            task: self.task.load()?,
            count: self.count,
            seed: self.seed.seed,
            out: self.out,
            replace: self.force,
            ..BaselinePlan::default()
        };
        check_outputs(plan.out.as_slice(), [self.task.task.as_ref()])?;
        execute_and_print(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &BaselinePlan, results: &BaselineResults) -> String {
    let BaselineResults { count, best, median, .. } = results;
    let mut text = format!(
        "best of {count} random controllers: {}; median {median:.2} {}",
        plan.task.fitness_in_words(*best),
        plan.task.kind.unit(),
    );
    if let Some(path) = &plan.out {
        text += &format!("\nwrote {}", path.display());
    }
    text
}
