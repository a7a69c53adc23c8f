//! `tropism simulate`: a controller on the model.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;
use tropism::evolve::Trial;
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::simulate_with;
use tropism::task::Task;
use tropism::track::PAPER_PERIOD_MIN;
use tropism_lab::files;

use crate::controller::ControllerName;
use crate::options::{SeedOption, TaskOption, load_model_for};
use crate::shell::Shell;

/// Let a controller steer simulated plants of a model
///
/// Writes the track of the first episode; the fitness is that of all of them.
#[derive(Args)]
#[command(
    after_help = "Example:\n  tropism simulate --model model.json --controller evolution/champion.json --out track.csv"
)]
pub(crate) struct Simulate {
    /// Tip-motion model, from `tropism fit`
    #[arg(long, value_name = "model.json")]
    model: PathBuf,

    /// periodic[:6h], chase, or the file of an evolved network
    #[arg(long, value_name = "CONTROLLER")]
    controller: ControllerName,

    /// Plants to steer, each with its own luck in growth
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    episodes: u32,

    /// Where the track of the first plant goes
    #[arg(long, value_name = "track.csv")]
    out: PathBuf,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,
}

#[derive(Serialize)]
struct Outcome {
    track: PathBuf,
    episodes: u32,
    mean_fitness: f64,
    sd_fitness: f64,
    best: f64,
    steps_without_data: f64,
}

impl Simulate {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let task = self.task.load()?;
        let model = load_model_for(&self.model, &task, shell)?;
        let controller = self.controller.load(PAPER_PERIOD_MIN)?;
        let (mut scores, mut blind, mut first) = (Vec::new(), 0.0, None);
        for episode in 0..self.episodes {
            let draws = NoiseStream::new(self.seed.seed, Purpose::Trial, [episode, 0, 0]);
            let track = simulate_with(&model, &mut *controller.build(&task, PAPER_PERIOD_MIN), &task, draws);
            scores.push(task.fitness(&track));
            blind += model.share_without_data(&track);
            first.get_or_insert(track);
            if Shell::is_interrupted() {
                return Err(crate::shell::Interrupted("nothing was written".to_owned()).into());
            }
        }
        let trial = Trial::of(&scores);
        files::write_track(&self.out, &first.expect("at least one episode"))?;
        let outcome = Outcome {
            track: self.out.clone(),
            episodes: self.episodes,
            mean_fitness: trial.mean,
            sd_fitness: trial.sd,
            best: task.best(),
            steps_without_data: blind / f64::from(trial.plants),
        };
        let text = format!(
            "fitness {:.2} cm of at most {:.2} (sd {:.2}, {} simulated plants); {:.1} % of steps where the model has no data\n\
             wrote {}",
            trial.mean,
            task.best(),
            outcome.sd_fitness,
            self.episodes,
            100.0 * outcome.steps_without_data,
            self.out.display(),
        );
        shell.result(&text, &outcome)
    }
}
