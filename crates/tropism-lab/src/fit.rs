//! The tip-motion model of tracks, eqs. (1)-(3).

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::observation::Quality;
use tropism::plant::shifts::Shift;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::track::Track;

use crate::run::RunConfig;
use crate::track::is_virtual;
use crate::{Error, Monitor, Workflow, files};

/// Fits the tip-motion model to tracks and writes it to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitPlan {
    /// Track files (CSV).
    pub tracks: Vec<PathBuf>,
    /// Window, growth and grid of the model.
    pub model: TipModelConfig,
    /// File for the model.
    pub out: PathBuf,
}

impl Default for FitPlan {
    fn default() -> Self {
        Self { tracks: Vec::new(), model: TipModelConfig::default(), out: "model.json".into() }
    }
}

/// The data of a fitted model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitResults {
    /// File of the model.
    pub model: PathBuf,
    /// Number of tracks.
    pub tracks: usize,
    /// Whether any of the plants is virtual.
    pub is_virtual: bool,
    /// Number of observed shifts, without their mirror images.
    pub shifts: usize,
    /// Least and greatest x of the tips, in cm.
    pub x_cm: [f64; 2],
    /// Least and greatest y of the tips, in cm.
    pub y_cm: [f64; 2],
}

impl Workflow for FitPlan {
    type Results = FitResults;

    const SCHEMA: &'static str = "tropism.fit/1";

    fn check(&self) -> Result<(), Error> {
        // The settings of the model are checked when it is fitted, which is the first thing that is done with the
        // tracks.
        if self.tracks.is_empty() {
            return Err(Error::Plan("found no `tracks`, wanted at least one".to_owned()));
        }
        Ok(())
    }

    fn execute(&self, _monitor: &dyn Monitor) -> Result<FitResults, Error> {
        self.check()?;
        let tracks: Vec<Track> =
            self.tracks.iter().map(|path| files::read_track(path)).collect::<Result<_, _>>()?;
        let is_virtual =
            self.tracks.iter().zip(&tracks).any(|(path, track)| is_of_virtual_plant(path, track));
        let model = TipModel::fit(&tracks, self.model.clone())?.of_virtual_plants(is_virtual);
        files::write(&self.out, model.to_json().as_bytes())?;
        Ok(FitResults {
            model: self.out.clone(),
            tracks: tracks.len(),
            is_virtual,
            shifts: model.observed().len(),
            x_cm: range(model.observed(), |shift| shift.tip.x),
            y_cm: range(model.observed(), |shift| shift.tip.y),
        })
    }
}

/// The least and the greatest value over `shifts`.
fn range(shifts: &[Shift], value: impl Fn(&Shift) -> f64) -> [f64; 2] {
    let wider = |[least, most]: [f64; 2], value: f64| [least.min(value), most.max(value)];
    shifts.iter().map(value).fold([f64::INFINITY, f64::NEG_INFINITY], wider)
}

/// Whether a track is of a virtual plant: it was simulated, or its run folder or the file beside it says so.
pub(crate) fn is_of_virtual_plant(path: &Path, track: &Track) -> bool {
    let is_simulated = track.samples.iter().any(|sample| sample.quality == Quality::Simulated);
    is_simulated
        || is_virtual(path)
        || path.parent().is_some_and(|folder| RunConfig::read(folder).is_ok_and(|run| run.is_virtual()))
}
