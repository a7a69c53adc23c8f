//! One plant under one controller: the unit of work, kept as a track file.
//!
//! In: a controller and the seed of a plant. Out: the track as its file holds it, so that an interruption changes nothing.
//! Without photographs the tip is that of `grow`: the detector's grid and noise. With them the tracker sees what the virtual
//! camera takes, as in `run --rig greenhouse`, and the true highest point stands in further columns; so do the turns of the
//! true stem where it is to wind round a pole.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use serde::Serialize;
use tropism::environment;
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism::vision::VisionConfig;
use tropism_bean::Trial;
use tropism_bean::tent::{Greenhouse, GroundTruth};
use tropism_rig::file::RigFile;

use super::TransferPlan;
use crate::controller::ControllerSpec;
use crate::files::{self, FileError};
use crate::{Error, Monitor};

/// Columns of the highest point of the plant as the camera sees it, in cm.
pub(super) const TOP_COLUMNS: [&str; 2] = ["top_x_cm", "top_y_cm"];

/// Column of the turns of the true stem round the pole, counter-clockwise as seen from above.
pub(super) const TURNS_COLUMN: &str = "true_turns";

/// The file beside a track of photographs. `fit` and `report` read there that the plant is virtual, which the measured tips
/// of the track itself do not tell.
#[derive(Serialize)]
struct TrackProvenance {
    is_virtual: bool,
    seed: u64,
}

/// Decimals of these columns: those of the tip.
const DECIMALS: usize = 5;

impl TransferPlan {
    /// Steers the plant of `seed`, and writes its track to `path`.
    pub(super) fn steer(
        &self,
        controller: &ControllerSpec,
        seed: u64,
        task: &Task,
        path: &Path,
        monitor: &dyn Monitor,
    ) -> Result<(), Error> {
        let mut is_whole = true;
        let mut watch = |sample: &Sample| {
            is_whole = sample.is_dark() || monitor.may_go_on();
            if is_whole { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let mut controller = controller.build(task, &self.greenhouse.layout, self.period_min);
        let track = if self.photographs {
            let mut open = self.rig().open(seed, Duration::ZERO).map_err(Error::at("rig"))?;
            let track = environment::run(&mut open.rig, &mut *controller, task, &mut watch)
                .map_err(Error::at(format!("the plant of seed {seed}")))?;
            let truth = open.truth.map_or_else(Vec::new, |tent| tent.truth_json());
            let mut track = with_truth(track, &truth, task).map_err(Error::at(path.display()))?;
            track.add_stem_columns();
            track
        } else {
            self.trial().grow(seed, &mut *controller, task, &mut watch)
        };
        if !is_whole {
            return Err(Error::Interrupted { folder: self.out.clone() });
        }
        // Before the track, with which the plant counts as done.
        if self.photographs {
            files::write_json(&path.with_extension("json"), &TrackProvenance { is_virtual: true, seed })?;
        }
        Ok(files::write_track(path, &track)?)
    }

    /// The track of a plant, as its file holds it.
    pub(super) fn read_track(&self, path: &Path) -> Result<Track, Error> {
        let bytes = files::read(path)?;
        let track = Track::read_csv_of(bytes.as_slice(), &self.greenhouse.layout);
        Ok(track.map_err(|error| FileError::content(path, error.to_string()))?)
    }

    /// The tent with the solids of the task.
    pub(super) fn tent(&self) -> Greenhouse {
        self.greenhouse.clone().among(&self.task.solids())
    }

    /// The plants without photographs.
    pub(super) fn trial(&self) -> Trial<'_> {
        Trial { solids: self.tent().solids, ..self.greenhouse.trial(self.period_min) }
    }

    /// The virtual tent as a rig.
    pub(super) fn rig(&self) -> RigFile {
        RigFile { period_min: self.period_min, ..RigFile::greenhouse(self.tent(), VisionConfig::default()) }
    }
}

/// `track` with the true highest points of `truth`, one [`GroundTruth`] a line, in further columns; and with the turns of the
/// true stem where `task` counts them.
fn with_truth(mut track: Track, truth: &[u8], task: &Task) -> Result<Track, serde_json::Error> {
    let lines: Vec<GroundTruth> =
        serde_json::Deserializer::from_slice(truth).into_iter().collect::<Result<_, _>>()?;
    let find = |sample: &Sample| lines.iter().find(|line| line.step == u64::from(sample.step));
    let truths: Vec<Option<&GroundTruth>> = track.samples.iter().map(find).collect();
    let top = |truth: &Option<&GroundTruth>| truth.map_or([f64::NAN; 2], |truth| truth.front.top.into());
    let tops: Vec<[f64; 2]> = truths.iter().map(top).collect();
    for (axis, name) in TOP_COLUMNS.into_iter().enumerate() {
        track.add_numbers(name, DECIMALS, tops.iter().map(|top| top[axis]));
    }
    if let Some(pole) = task.pole {
        let turns = |truth: &Option<&GroundTruth>| {
            truth.map_or(f64::NAN, |truth| pole.turns_of(&truth.stem_in_space))
        };
        track.add_numbers(TURNS_COLUMN, DECIMALS, truths.iter().map(turns).collect::<Vec<f64>>());
    }
    Ok(track)
}
