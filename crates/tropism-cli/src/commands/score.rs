//! `tropism score`: the fitness of tracks.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::score::{ScorePlan, TrackScore};

use crate::options::TaskOption;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Score tracks by the paper's fitness, eq. (9)
///
/// Also prints the distance of the tip to each target when it first reached the target's height.
#[derive(Args)]
#[command(after_help = "Example:\n  tropism score reality/*/track.csv")]
pub(crate) struct Score {
    /// Tracks (CSV with tip_x_cm, tip_y_cm and light)
    #[arg(required = true, value_name = "TRACK.csv")]
    tracks: Vec<PathBuf>,

    #[command(flatten)]
    task: TaskOption,
}

impl Score {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = ScorePlan { task: self.task.load()?, tracks: self.tracks };
        execute_and_print(&plan, shell, |scores| text(&plan, scores))
    }
}

fn text(plan: &ScorePlan, scores: &[TrackScore]) -> String {
    let mut text = String::from("fitness  steps  distance to each target at its height (cm)  track\n");
    for TrackScore { track, fitness, steps, targets } in scores {
        let distance = |crossing: &Option<_>| {
            crossing.map_or("-".to_owned(), |tropism::task::Crossing { distance_cm, .. }| {
                format!("{distance_cm:.2}")
            })
        };
        let distances = targets.iter().map(distance).collect::<Vec<_>>().join("  ");
        text += &format!("{fitness:7.2}  {steps:5}  {distances:<44}  {}\n", track.display());
    }
    let mean = scores.iter().map(|score| score.fitness).sum::<f64>() / scores.len() as f64;
    text + &format!("mean of {}: {mean:.2} cm of at most {:.2}", scores.len(), plan.task.best())
}
