//! Fitness of tracks, eq. (9).

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::task::{Crossing, Task, TaskSpec};

use crate::{Error, Monitor, Workflow, files};

/// Computes the fitness of tracks, and the distance of the tip to each target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScorePlan {
    /// Track files (CSV).
    pub tracks: Vec<PathBuf>,
    /// Task of the experiments.
    pub task: TaskSpec,
}

/// The fitness of one track.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackScore {
    /// The track file.
    pub track: PathBuf,
    /// Fitness, eq. (9), in cm.
    pub fitness: f64,
    /// Number of steps.
    pub steps: usize,
    /// Where the tip first reached the height of each target; `None` if it never did.
    pub targets: Vec<Option<Crossing>>,
}

impl Workflow for ScorePlan {
    /// One score a track, in the order of the plan.
    type Results = Vec<TrackScore>;

    const SCHEMA: &'static str = "tropism.score/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))
    }

    fn execute(&self, _monitor: &dyn Monitor) -> Result<Vec<TrackScore>, Error> {
        self.check()?;
        let score = |path: &PathBuf| {
            let track = files::read_track(path)?;
            Ok(TrackScore {
                track: path.clone(),
                fitness: self.task.fitness(&track),
                steps: track.samples.len() - 1,
                targets: self.task.as_targets().map_or_else(Vec::new, |task| task.crossings(&track)),
            })
        };
        self.tracks.iter().map(score).collect()
    }
}
