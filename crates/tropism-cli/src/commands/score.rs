//! `tropism score`: the fitness of tracks.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::score::{ScorePlan, TaskSource, TrackScore};
use tropism_lab::task::is_same_but_for_steps;

use crate::options::TaskOption;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Score tracks by the paper's fitness, eq. (9), or that of another task
///
/// Also prints the distance of the tip to each target when it first reached the target's height, and of a task with obstacles
/// whether the plant did it. A track in a run folder is
/// scored by the task of its run, another by that of --task, or the paper's three targets.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism score tropism-study/reality/champion\n  tropism score track.csv --task evolution/champion.json"
)]
pub(crate) struct Score {
    /// Tracks (CSV with tip_x_cm, tip_y_cm and light), and folders of runs or of tracks
    #[arg(required = true, value_name = "TRACK.csv|DIR")]
    tracks: Vec<PathBuf>,

    #[command(flatten)]
    task: TaskOption,
}

impl Score {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = ScorePlan { task: self.task.named()?, tracks: self.tracks };
        execute_and_print(&plan, shell, |scores| text(scores))
    }
}

fn text(scores: &[TrackScore]) -> String {
    let has_readings = scores.iter().any(|score| score.both_readings.is_some());
    let readings = if has_readings { "letter  approach  " } else { "" };
    let mut text = format!("fitness  {readings}steps  distance to each target at its height (cm)  track\n");
    for TrackScore { track, fitness, steps, targets, is_done, both_readings, .. } in scores {
        let readings = match both_readings {
            Some([letter, approach]) => format!("{letter:6.2}  {approach:8.2}  "),
            None => " ".repeat(readings.len()),
        };
        let distance = |crossing: &Option<_>| {
            crossing.map_or("-".to_owned(), |tropism::task::Crossing { distance_cm, .. }| {
                format!("{distance_cm:.2}")
            })
        };
        let distances = targets.iter().map(distance).collect::<Vec<_>>().join("  ");
        let done = match is_done {
            Some(true) => "  (did the task)",
            Some(false) => "  (did not do the task)",
            None => "",
        };
        text += &format!("{fitness:7.2}  {readings}{steps:5}  {distances:<44}  {}{done}\n", track.display());
    }
    let mean = scores.iter().map(|score| score.fitness).sum::<f64>() / scores.len() as f64;
    let is_one_task = scores.iter().all(|score| is_same_but_for_steps(&score.task, &scores[0].task));
    if !is_one_task {
        let mean = format!("mean of {}: {mean:.2}", scores.len());
        return text + &mean + "; the runs had different tasks, each is scored by its own";
    }
    let source = match scores[0].task_from {
        TaskSource::Plan => "",
        TaskSource::Run => ", the task of the run",
        TaskSource::Paper => ", the paper's: no task of this track is known, --task names one",
    };
    let task = &scores[0].task;
    // Each plant has the way from where its track begins.
    let best: Option<f64> = scores.iter().map(|score| score.best).sum();
    let mean = task.fitness_of_most(mean, best.map(|best| best / scores.len() as f64));
    text + &format!("mean of {}: {mean}\nscored by {}{source}", scores.len(), task.title())
}
