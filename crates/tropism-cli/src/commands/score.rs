//! `tropism score`: how well a track did its task.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;
use tropism::math::statistics;
use tropism::task::Crossing;
use tropism::task::Task;
use tropism_lab::files;

use crate::options::TaskOption;
use crate::shell::Shell;

/// Score tracks by the paper's fitness, eq. (9)
///
/// Beside the fitness it tells how far the tip was from each target when it first reached the target's height.
#[derive(Args)]
#[command(after_help = "Example:\n  tropism score reality/*/track.csv")]
pub(crate) struct Score {
    /// Tracks (CSV with tip_x_cm, tip_y_cm and light)
    #[arg(required = true, value_name = "TRACK.csv")]
    tracks: Vec<PathBuf>,

    #[command(flatten)]
    task: TaskOption,
}

#[derive(Serialize)]
struct Scored {
    track: PathBuf,
    fitness: f64,
    steps: usize,
    targets: Vec<Option<Crossing>>,
}

impl Score {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let task = self.task.load()?;
        let mut scores = Vec::new();
        for path in &self.tracks {
            let track = files::read_track(path)?;
            scores.push(Scored {
                track: path.clone(),
                fitness: task.fitness(&track),
                steps: track.samples.len() - 1,
                targets: task.crossings(&track),
            });
        }
        let mut text = String::from("fitness  steps  distance to each target at its height (cm)  track");
        for score in &scores {
            let distances: Vec<String> = score
                .targets
                .iter()
                .map(|crossing| {
                    crossing.map_or("-".to_owned(), |crossing| format!("{:.2}", crossing.distance_cm))
                })
                .collect();
            write!(
                text,
                "\n{:7.2}  {:5}  {:<44}  {}",
                score.fitness,
                score.steps,
                distances.join("  "),
                score.track.display()
            )?;
        }
        let mean = statistics::mean(scores.iter().map(|score| score.fitness));
        write!(text, "\nmean of {}: {mean:.2} cm of at most {:.2}", scores.len(), task.best())?;
        shell.result(&text, &scores)
    }
}
