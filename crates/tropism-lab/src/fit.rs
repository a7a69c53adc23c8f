//! Models of tracks: the tip-motion model, eqs. (1)-(3), and the linear model of the stem, in the plane and in space.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::lighting::Lighting;
use tropism::math::statistics::range;
use tropism::observation::Quality;
use tropism::plant::PlantModel;
use tropism::plant::tip::TipModelConfig;
use tropism::text::plural;
use tropism::track::{Sample, Track};

pub use crate::model::ModelKind;
use crate::run::RunConfig;
use crate::track::{is_virtual, warnings_of};
use crate::{Error, Monitor, Workflow, files};

/// Fits a model to tracks and writes it to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitPlan {
    /// Track files (CSV), and folders of runs or of track files.
    pub tracks: Vec<PathBuf>,
    /// Which model.
    pub kind: ModelKind,
    /// Window, growth and grid of a tip-motion model. The others have no such settings.
    pub model: TipModelConfig,
    /// Whether to take uncertain tracks too, of which [`warnings_of`] lists the reasons.
    pub anyway: bool,
    /// File for the model.
    pub out: PathBuf,
    /// Whether a file that is there is replaced.
    pub replace: bool,
}

impl Default for FitPlan {
    fn default() -> Self {
        Self {
            tracks: Vec::new(),
            kind: ModelKind::default(),
            model: TipModelConfig::default(),
            anyway: false,
            out: "model.json".into(),
            replace: false,
        }
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
    /// Number of shifts that the model is made of, without their mirror images.
    pub shifts: usize,
    /// Whether it is made of their mirror images, too: each lamp that steers has one of its colour in the layout.
    pub is_mirrored: bool,
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
            return Err(Error::Plan("`tracks` is empty: name at least one".to_owned()));
        }
        if !self.kind.has_settings() && self.model != TipModelConfig::default() {
            let kind = self.kind.name();
            return Err(Error::Plan(format!(
                "these are settings of a tip-motion model: `kind` {kind} has none"
            )));
        }
        let tracks = files::track_files(&self.tracks)?;
        // What `track` knows of a track stands beside it.
        let beside = tracks.iter().map(|track| track.with_extension("json")).filter(|file| file.exists());
        let inputs: Vec<PathBuf> = tracks.iter().cloned().chain(beside).collect();
        files::check_outputs(std::slice::from_ref(&self.out), &inputs)?;
        files::check_free(&self.out, self.replace || self.out.is_dir())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<FitResults, Error> {
        let paths = files::track_files(&self.tracks)?;
        let mut tracks: Vec<Track> =
            paths.iter().map(|path| files::read_track(path)).collect::<Result<_, _>>()?;
        for (path, track) in paths.iter().zip(&mut tracks) {
            let left_out = |count: usize, why: &str| {
                if count > 0 {
                    monitor.note(&format!("{}: left out {}: {why}", path.display(), plural(count, "step")));
                }
            };
            left_out(darken_unconfirmed(track), "`done` says that their lamp was never confirmed");
            let is_of_levels = |sample: &&Sample| sample.lighting().bending(&track.layout).is_none();
            let of_levels = track.samples.iter().filter(is_of_levels).count();
            left_out(
                of_levels,
                "models are of one lamp at full power, these are of several lamps or of levels",
            );
        }
        if !self.anyway {
            refuse_uncertain(&paths, &tracks)?;
        }
        let is_virtual = paths.iter().zip(&tracks).any(|(path, track)| is_of_virtual_plant(path, track));
        let model = self.kind.fit(&tracks.iter().collect::<Vec<_>>(), &self.model, is_virtual)?;
        let tips = model.tips();
        files::write(&self.out, model.to_json().as_bytes())?;
        Ok(FitResults {
            model: self.out.clone(),
            tracks: tracks.len(),
            is_virtual,
            shifts: model.steps(),
            is_mirrored: model.layout().is_symmetric(),
            x_cm: range(tips.iter().map(|tip| tip.x)),
            y_cm: range(tips.iter().map(|tip| tip.y)),
        })
    }
}

/// Takes the light of the steps that the column `done` of an export calls unconfirmed, and counts them.
fn darken_unconfirmed(track: &mut Track) -> usize {
    let Some(done) = track.numbers("done") else { return 0 };
    let is_unconfirmed = |(sample, done): &(&mut Sample, f64)| !sample.is_dark() && *done == 0.0;
    let unconfirmed = track.samples.iter_mut().zip(done).filter(is_unconfirmed);
    unconfirmed.map(|(sample, _)| sample.set_lighting(Lighting::DARK)).count()
}

/// An error that names each uncertain track and what speaks against it.
fn refuse_uncertain(paths: &[PathBuf], tracks: &[Track]) -> Result<(), Error> {
    let mut lines = Vec::new();
    for (path, track) in paths.iter().zip(tracks) {
        lines.extend(
            warnings_of(path, track).iter().map(|warning| format!("{}: {}", path.display(), warning.advice)),
        );
    }
    match lines.as_slice() {
        [] => Ok(()),
        warnings => Err(Error::Plan(format!(
            "{}; wanted tracks without warnings, or `anyway` to fit a model to them all the same",
            warnings.join("; ")
        ))),
    }
}

/// Whether a track is of a virtual plant: it was simulated, or its run folder or the file beside it says so.
pub(crate) fn is_of_virtual_plant(path: &Path, track: &Track) -> bool {
    let is_simulated = track.samples.iter().any(|sample| sample.quality == Quality::Simulated);
    is_simulated
        || is_virtual(path)
        || path.parent().is_some_and(|folder| RunConfig::read(folder).is_ok_and(|run| run.is_virtual()))
}
