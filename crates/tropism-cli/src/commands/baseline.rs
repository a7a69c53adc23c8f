//! `tropism baseline`: what random controllers achieve.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;
use tropism::control::Sensors;
use tropism::evolve;
use tropism_lab::files;
use tropism_neat::Config;

use crate::options::{SeedOption, TaskOption, load_model_for};
use crate::shell::{Interrupted, Shell, cpu_seconds};

/// Try random controllers: the paper's baseline (section 3.1)
///
/// Each is a network as NEAT's initial population holds them. The paper tried two million.
#[derive(Args)]
#[command(after_help = "Example:\n  tropism baseline --model model.json --count 200000 --out random.json")]
pub(crate) struct Baseline {
    /// Tip-motion model, from `tropism fit`
    #[arg(long, value_name = "model.json")]
    model: PathBuf,

    /// Controllers to try
    #[arg(long, default_value_t = 2_000_000, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: u64,

    /// Where the best of them goes, as a genome
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,
}

#[derive(Serialize)]
struct Outcome {
    count: u64,
    best: f64,
    median: f64,
    cpu_seconds: f64,
}

impl Baseline {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let task = self.task.load()?;
        let model = load_model_for(&self.model, &task, shell)?;
        let before = cpu_seconds();
        let progress = shell.progress("random controllers", self.count);
        let tick = |count| {
            progress.add(count);
            !Shell::is_interrupted()
        };
        let found = evolve::baseline(
            &model,
            &task,
            &Sensors::default(),
            &Config::wahby2016(),
            self.seed.seed,
            self.count,
            tick,
        );
        drop(progress);
        let Some(found) = found else {
            return Err(Interrupted("nothing was written".to_owned()).into());
        };
        let mut text = format!(
            "best of {} random controllers: {:.2} cm of at most {:.2}; median {:.2} cm",
            found.count,
            found.best,
            task.best(),
            found.median
        );
        if let Some(path) = &self.out {
            files::write(path, found.champion.to_json().as_bytes())?;
            text += &format!("\nwrote {}", path.display());
        }
        let cpu_seconds = cpu_seconds() - before;
        shell.result(
            &text,
            &Outcome { count: found.count, best: found.best, median: found.median, cpu_seconds },
        )
    }
}
