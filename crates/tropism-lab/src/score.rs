//! Fitness of tracks: eq. (9), or that of another task.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::task::{Crossing, Task};

use crate::{Error, Monitor, Workflow, files, task};

/// Computes the fitness of tracks, and the distance of the tip to each target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScorePlan {
    /// Track files (CSV).
    pub tracks: Vec<PathBuf>,
    /// Task of the experiments; if it is left out, that of the run in whose folder a track lies, and the paper's three targets
    /// for a track elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task: Option<Task>,
}

/// Where the task of a track is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TaskSource {
    /// The plan.
    Plan,
    /// The run in whose folder the track lies.
    Run,
    /// Nothing: it is the paper's.
    Paper,
}

/// The fitness of one track.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackScore {
    /// The track file.
    pub track: PathBuf,
    /// The task by which it is scored.
    pub task: Task,
    /// Where the task is from.
    pub task_from: TaskSource,
    /// Fitness: of targets eq. (9), in cm; round a pole in turns.
    pub fitness: f64,
    /// The fitness to the letter of eq. (9) and by approach, in cm; `None` for a task with another score.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub both_readings: Option<[f64; 2]>,
    /// The best fitness there can be from where the track begins; `None` where it is not known.
    pub best: Option<f64>,
    /// Number of steps.
    pub steps: usize,
    /// Where the tip first reached the height of each target; `None` if it never did.
    pub targets: Vec<Option<Crossing>>,
    /// Whether the plant did all that the task wants; `None` for a task that only has a fitness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub is_done: Option<bool>,
}

impl Workflow for ScorePlan {
    /// One score a track, in the order of the plan.
    type Results = Vec<TrackScore>;

    const SCHEMA: &'static str = "tropism.score/1";

    fn check(&self) -> Result<(), Error> {
        self.task.iter().try_for_each(Task::check).map_err(Error::in_plan("task"))?;
        if self.task.as_ref().is_some_and(Task::is_to_draw) {
            return Err(Error::Plan(
                "`task`: its targets are still to be drawn: name those of the experiment, such as its run folder"
                    .to_owned(),
            ));
        }
        Ok(())
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<Vec<TrackScore>, Error> {
        let score = |path: &PathBuf| {
            let track = files::read_track(path)?;
            let (task, task_from) = match (&self.task, task::of_track(path)?) {
                (Some(task), _) => (task.clone(), TaskSource::Plan),
                (None, Some(task)) => (task, TaskSource::Run),
                (None, None) => (Task::default(), TaskSource::Paper),
            };
            if let Some(reason) = task.unscorable(&track) {
                return Err(Error::Plan(format!("{}: {reason}", path.display())));
            }
            let track = task.experiment(&track);
            Ok(TrackScore {
                track: path.clone(),
                fitness: task.fitness(&track),
                both_readings: task.both_readings(&track),
                best: task.best_fitness_of(&track),
                steps: track.samples.len() - 1,
                targets: task.crossings(&track),
                is_done: task.is_done(&track),
                task,
                task_from,
            })
        };
        files::track_files(&self.tracks)?.iter().map(score).collect()
    }
}
