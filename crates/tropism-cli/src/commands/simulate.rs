//! `tropism simulate`: a controller on simulated plants.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::simulate::{SimulatePlan, SimulateResults};
use tropism_lab::units::plural;

use crate::controller::{ControllerName, task_of_champion};
use crate::options::{SeedOption, TaskOption};
use crate::progress::{check_outputs, execute_and_print};
use crate::shell::Shell;

/// Simulate plants of a model that a controller steers
///
/// Writes the track of the first plant, and prints the mean fitness of all plants.
#[derive(Args)]
#[command(
    after_help = "Example:\n  tropism simulate --model model.json --controller evolution/champion.json --out track.csv"
)]
pub(crate) struct Simulate {
    /// Model, from `tropism fit`
    #[arg(long, value_name = "model.json")]
    model: PathBuf,

    /// periodic[:6h], greedy, or the file of an evolved network or a tuned rule
    #[arg(long, value_name = "CONTROLLER")]
    controller: ControllerName,

    /// Number of plants, each with its own random growth
    #[arg(long, alias = "episodes", default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    plants: u32,

    /// File to write the track of the first plant to
    #[arg(long, value_name = "track.csv")]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,
}

impl Simulate {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let controller = self.controller.load()?;
        let plan = SimulatePlan {
            task: task_of_champion(&controller, &self.task, shell)?,
            model: self.model,
            controller,
            episodes: self.plants,
            seed: self.seed.seed,
            out: self.out,
            replace: self.force,
        };
        check_outputs(std::slice::from_ref(&plan.out), [self.task.task.as_ref(), self.controller.file()])?;
        execute_and_print(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &SimulatePlan, results: &SimulateResults) -> String {
    let readings = results.both_readings.map_or_else(String::new, |[letter, approach]| {
        format!("\neq. (9) to the letter {letter:.2}, by approach {approach:.2}")
    });
    format!(
        "fitness {} (sd {:.2}, {}); {:.1} % of steps where the model has no data{readings}\n\
         wrote {}",
        plan.task.fitness_in_words(results.mean_fitness),
        results.sd_fitness,
        plural(results.episodes, "simulated plant"),
        100.0 * results.steps_without_data,
        results.track.display(),
    )
}
