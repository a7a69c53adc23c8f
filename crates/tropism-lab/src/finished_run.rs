//! The folder of a finished run: its configuration, its track and what its photographs show.

use std::path::{Path, PathBuf};

use tropism::geometry::{Pixel, Region, STEM_POINTS};
use tropism::lighting::Lighting;
use tropism::photo::Image;
use tropism::rig::{Event, EventKind};
use tropism::track::Track;
use tropism_report::{Composite, LitStem, Plants};

use crate::journal::{Journal, JournalError, StepRecord, lights_that_acted};
use crate::run::RunConfig;
use crate::{Error, files};

/// Largest number of photographs of a run in Figures 2 and 9; chosen by hand.
const MAX_PHOTOGRAPHS: usize = 60;

/// Space around a plant in Figure 2, in cm: leaves reach beyond the tip. Chosen by hand.
const PLANT_MARGIN_CM: f64 = 3.0;

/// Every how many photographs of a run figures show one.
fn stride(photographs: usize) -> usize {
    photographs.div_ceil(MAX_PHOTOGRAPHS).max(1)
}

/// Removes from the finished run in `path` what no figure and no number is made of: all photographs, but for those that
/// figures show if `has_figures`, and the stems of the ground truth.
///
/// # Errors
/// [`Error`] names the file that cannot be removed.
pub(crate) fn make_small(path: &Path, has_figures: bool) -> Result<(), Error> {
    // Chosen by step, so that a removal that was broken off goes on with the same ones.
    let stride = stride(files::read_track(&path.join("track.csv"))?.samples.len());
    for photograph in files::list(&path.join("photographs"), "jpg")? {
        let step = photograph.file_stem().and_then(|name| name.to_str()?.parse::<usize>().ok());
        if !has_figures || step.is_none_or(|step| step % stride != 0) {
            std::fs::remove_file(&photograph).map_err(Error::at(photograph.display()))?;
        }
    }
    Ok(files::remove(&path.join("truth.jsonl"))?)
}

/// A note of a run.
pub(crate) struct RunNote {
    pub(crate) step: u32,
    /// Since the start of the run.
    pub(crate) hours: f64,
    pub(crate) text: String,
}

/// A finished run.
pub(crate) struct FinishedRun {
    /// Its folder.
    pub(crate) path: PathBuf,
    pub(crate) config: RunConfig,
    pub(crate) track: Track,
}

impl FinishedRun {
    /// Reads the run in `path`.
    ///
    /// # Errors
    /// [`Error`] if the folder is none of a run, or its run is not finished.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let config = RunConfig::read(path)?;
        let file = path.join("track.csv");
        if !file.exists() {
            return Err(Error::Plan(format!(
                "{}: this run is not over and has no track.csv: go on with it by --resume",
                path.display()
            )));
        }
        let track = files::read_track(&file)?;
        Ok(Self { path: path.to_owned(), config, track })
    }

    /// Reads the runs in the folders `1`, `2` and so on of `path`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub(crate) fn read_numbered(path: &Path) -> Result<Vec<Self>, Error> {
        let numbered = (1..).map(|number: u32| path.join(number.to_string()));
        numbered.take_while(|path| path.join("run.toml").exists()).map(|path| Self::read(&path)).collect()
    }

    /// The label of its plant in figures.
    pub(crate) const fn plants(&self) -> Plants {
        self.config.plants()
    }

    /// Fitness of the run for its own task, in cm.
    pub(crate) fn fitness(&self) -> f64 {
        self.config.task.fitness(&self.track)
    }

    /// What `read` takes from its journal; `None` where it has none.
    fn of_journal<T>(
        &self,
        read: impl FnOnce(&Journal) -> Result<T, JournalError>,
    ) -> Result<Option<T>, Error> {
        let path = self.path.join("journal.sqlite");
        if !path.exists() {
            return Ok(None);
        }
        let found = Journal::open_to_read(&path).and_then(|journal| read(&journal));
        found.map(Some).map_err(Error::at(path.display()))
    }

    /// What people wrote down of it.
    pub(crate) fn notes(&self) -> Result<Vec<RunNote>, Error> {
        let events = self.of_journal(Journal::events)?.unwrap_or_default();
        let hours = |event: &Event| match event.at {
            Some(at) => at.since_start.as_secs_f64() / 3600.0,
            None => f64::from(event.step) * self.config.rig.period_min / 60.0,
        };
        let notes = events.into_iter().filter(|event| event.kind == EventKind::Note);
        Ok(notes.map(|event| RunNote { step: event.step, hours: hours(&event), text: event.text }).collect())
    }

    /// Photographs at equal distances over the run, each with its step. A damaged photograph is left out.
    fn photographs(&self) -> Result<impl Iterator<Item = (usize, Image)>, Error> {
        let photographs = files::photographs(&[self.path.join("photographs")])?;
        let read = |path: PathBuf| {
            let step = path.file_stem()?.to_str()?.parse().ok()?;
            Some((step, files::read_photo(&path, 0.0).ok()?.decode().ok()?))
        };
        let stride = stride(photographs.len());
        Ok(photographs.into_iter().step_by(stride).filter_map(read))
    }

    /// Its photographs laid over each other, for Figure 2.
    pub(crate) fn composite(&self) -> Result<Composite, Error> {
        Ok(self.photographs()?.map(|(_, image)| image).collect())
    }

    /// The part of its photographs in which the plant is: around its tips and its root. `None` if nothing says how its
    /// photographs map to centimetres.
    pub(crate) fn region_of_plant(&self) -> Option<Region> {
        let calibration = self.config.calibration()?;
        let tips = self.track.samples.iter().map(|sample| calibration.pixel(sample.tip));
        let root = calibration.base;
        let (low, high) = tips.fold((root, root), |(low, high), tip| {
            (Pixel::new(low.x.min(tip.x), low.y.min(tip.y)), Pixel::new(high.x.max(tip.x), high.y.max(tip.y)))
        });
        let margin = PLANT_MARGIN_CM * calibration.px_per_cm;
        let whole = |value: f64, most: usize| (value.max(0.0) as usize).min(most);
        let (x, y) = (whole(low.x - margin, calibration.width), whole(low.y - margin, calibration.height));
        let right = whole(high.x + margin, calibration.width);
        let bottom = whole(high.y + margin, calibration.height);
        Some(Region { x, y, width: right - x, height: bottom - y })
    }

    /// Its stems with the light at each, for Figure 9: those of the journal, or of the photographs where it has none.
    pub(crate) fn stems(&self) -> Result<Vec<LitStem>, Error> {
        let Some(steps) = self.of_journal(Journal::steps)? else { return self.detect_stems() };
        let lights = lights_that_acted(&steps);
        let stride = stride(steps.len());
        let drawn = steps.into_iter().zip(lights).step_by(stride).filter(|(step, _)| step.seen.is_measured());
        let stem = |(step, lighting): (StepRecord, Lighting)| {
            let light = lighting.single().flatten();
            Some((step.seen.observation?.stem?.resampled(STEM_POINTS), light))
        };
        Ok(drawn.filter_map(stem).collect())
    }

    /// Detects the stem in each of the photographs by itself.
    fn detect_stems(&self) -> Result<Vec<LitStem>, Error> {
        let Some(tracker) = self.config.tracker() else { return Ok(Vec::new()) };
        let stem = |(step, image): (usize, Image)| {
            let seen = tracker.clone().update_next(tracker.detect(Ok(&image)));
            let light = self.track.samples.get(step).and_then(|sample| sample.light);
            Some((seen.observation?.stem?.resampled(STEM_POINTS), light))
        };
        Ok(self.photographs()?.filter_map(stem).collect())
    }
}
