//! `tropism baseline`: the fitness of random controllers.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::Work;
use tropism_lab::baseline::{BaselinePlan, BaselineResults};

use crate::options::{SeedOption, TaskOption};
use crate::progress::{check_outputs, for_user};
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Evaluate random controllers: the paper's baseline (section 3.1)
///
/// Each is a network like those of NEAT's initial population. The paper evaluated two million. With --out,
/// Ctrl-C saves each whole million; --resume continues with the same results as without an interruption.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism baseline --model model.json --count 200000 --out random\n  tropism baseline --out random --resume"
)]
pub(crate) struct Baseline {
    /// Model, from `tropism fit`
    #[arg(long, value_name = "model.json", required_unless_present = "resume")]
    model: Option<PathBuf>,

    /// Number of controllers
    #[arg(long, default_value_t = 2_000_000, value_name = "N", requires = "model", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: u64,

    /// Folder for the fitness of all, and for the best of them, champion.json; none by default
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Continue the baseline in DIR; it needs no other option
    #[arg(long, requires = "out")]
    resume: bool,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,

    #[command(flatten)]
    units: UnitsOption,
}

impl Baseline {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = match (self.model, &self.out) {
            (None, Some(out)) => {
                shell.check_resumes_alone(out, &[])?;
                BaselinePlan::of_folder(out).map_err(for_user)?
            }
            (model, _) => BaselinePlan {
                model: model.unwrap_or_default(),
                task: self.task.load()?,
                count: self.count,
                seed: self.seed.seed,
                resume: self.resume,
                out: self.out,
                ..BaselinePlan::default()
            },
        };
        check_outputs(&plan.outputs(), [self.task.task.as_ref()])?;
        self.units.execute(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &BaselinePlan, results: &BaselineResults) -> String {
    let BaselineResults { count, best, median } = results;
    let mut text = format!(
        "best of {count} random controllers: {}; median {median:.2} {}",
        plan.task.fitness_in_words(*best),
        plan.task.kind.unit(),
    );
    if let Some(out) = &plan.out {
        text += &format!("\nwrote {}", out.join("champion.json").display());
    }
    text
}
