//! The photographs of a film in order, and what is known of each.

use std::path::{Path, PathBuf};

use tropism::geometry::Region;
use tropism::lighting::Lighting;
use tropism::photo::Image;
use tropism::text::plural;
use tropism::track::Sample;
use tropism_report::{Film, FilmStep, Plants, cropped, scaled};

use super::Crop;
use crate::error::Error;
use crate::files::{self, FileError};
use crate::journal::{Journal, StepRecord};
use crate::run::RunConfig;

/// Pictures of a film if its plan does not say how many.
const MAX_PICTURES: usize = 300;

/// How many times a part of the photographs is enlarged at most.
const MAX_ENLARGEMENT: usize = 4;

/// Margin around the plant and its targets, in cm.
const PLANT_MARGIN_CM: f64 = 2.0;

/// Photographs in order, and what is known of them.
pub(super) struct Source {
    pub(super) photographs: Vec<PathBuf>,
    pub(super) film: Film,
    crop: Option<Region>,
    /// Width of the film, in pixels, at most.
    width: usize,
}

/// A photograph at the size of the film, and its width before.
pub(super) struct Shrunk {
    pub(super) image: Image,
    pub(super) photograph_width: usize,
}

impl Source {
    /// Lists the photographs of a run in the order of its journal, or those of any folder in natural order.
    pub(super) fn open(folder: &Path, width: usize) -> Result<Self, Error> {
        let mut film = Film::default();
        if !folder.join("run.toml").exists() {
            let photographs = files::photographs(&[folder.to_owned()])?;
            // The folder `photographs` of a run is of its plant; those of the virtual tent say so anywhere.
            let says_virtual =
                |path: &PathBuf| files::read_header(path).is_ok_and(|header| header.is_virtual);
            film.plants = match RunConfig::read(&folder.join("..")) {
                Ok(config) => Some(config.plants()),
                Err(_) => photographs.iter().any(says_virtual).then_some(Plants::Virtual),
            };
            return Ok(Self { photographs, film, crop: None, width });
        }
        let config = RunConfig::read(folder)?;
        film.plants = Some(config.plants());
        film.calibration = config.calibration();
        film.layout = config.rig.layout().map_err(Error::at(folder.display()))?;
        film.targets = config.task.targets.clone();
        let journal = folder.join("journal.sqlite");
        if !journal.exists() {
            // `tropism grow` writes the track of a plant without a journal.
            let photographs = files::photographs(&[folder.join("photographs")])?;
            let track = files::read_track(&folder.join("track.csv"))?;
            let step = |sample: &Sample| FilmStep {
                time_s: sample.time_s,
                tip: Some(sample.tip),
                light: sample.light,
            };
            film.steps = track.samples.iter().map(step).collect();
            film.layout = track.layout;
            return Ok(Self { photographs, film, crop: None, width });
        }
        let steps = Journal::open_to_read(&journal)
            .and_then(|journal| journal.steps())
            .map_err(Error::at(journal.display()))?;
        if steps.is_empty() {
            let problem = "the run has no steps yet";
            return Err(FileError::content(&journal, problem).into());
        }
        let photographs = steps.iter().map(|step| folder.join("photographs").join(&step.photo)).collect();
        let step = |step: &StepRecord| FilmStep {
            time_s: step.time_s,
            tip: step.seen.observation.as_ref().map(|seen| seen.tip),
            light: step.commanded().and_then(Lighting::brightest),
        };
        film.steps = steps.iter().map(step).collect();
        Ok(Self { photographs, film, crop: None, width })
    }

    /// The same photographs, of which only a part is shown.
    pub(super) fn cropped(mut self, crop: Option<Crop>, folder: &Path) -> Result<Self, Error> {
        let region = match crop {
            None => return Ok(self),
            Some(Crop::Region(region)) => region,
            Some(Crop::Plant) => self.film.region(PLANT_MARGIN_CM).ok_or_else(|| {
                let folder = folder.display();
                Error::Plan(format!("`crop` plant: {folder} has no calibration: write X,Y,W,H in pixels"))
            })?,
        };
        self.film = self.film.cropped(region);
        self.crop = Some(region);
        Ok(self)
    }

    /// Indices of each Nth photograph, or of so many that the film is not too long.
    pub(super) fn choose(&self, every: Option<u32>) -> Vec<usize> {
        let count = self.photographs.len();
        let every = every.map_or_else(|| count.div_ceil(MAX_PICTURES), |every| every as usize);
        (0..count).step_by(every).collect()
    }

    /// Reads a photograph as the film shows it; `None` if it cannot be read, or the region to be shown is not in it.
    pub(super) fn read(&self, index: usize) -> Option<Shrunk> {
        let photograph = files::read_photo(&self.photographs[index], 0.0).ok()?.decode().ok()?;
        let (photograph, max_width) = match self.crop {
            Some(region) => (cropped(&photograph, region)?, MAX_ENLARGEMENT * region.width),
            None => {
                let width = photograph.width;
                (photograph, width)
            }
        };
        let image = scaled(&photograph, self.width.min(max_width));
        Some(Shrunk { image, photograph_width: photograph.width })
    }

    /// Draws about `count` pictures from all over the film; at least one.
    ///
    /// # Errors
    /// What is wrong with the first photograph, if none can be used.
    pub(super) fn samples(&self, chosen: &[usize], count: usize) -> Result<Vec<Image>, Error> {
        let mut samples: Vec<Image> = Vec::new();
        let sample = |index: usize| {
            let Shrunk { image, photograph_width } = self.read(index)?;
            Some(self.film.frame(&image, photograph_width, index))
        };
        for &index in chosen.iter().step_by(chosen.len().div_ceil(count)) {
            let Some(sample) = sample(index) else { continue };
            let size = (sample.width, sample.height);
            if samples.first().is_none_or(|first| (first.width, first.height) == size) {
                samples.push(sample);
            }
        }
        if samples.is_empty() {
            // If none of these few can be used, another one may.
            samples.extend(chosen.iter().find_map(|&index| sample(index)));
        }
        if samples.is_empty() { Err(self.problem(chosen)) } else { Ok(samples) }
    }

    /// What is wrong with the first of the `chosen` photographs, none of which can be used.
    fn problem(&self, chosen: &[usize]) -> Error {
        let (first, count) = (&self.photographs[chosen[0]], chosen.len());
        let name = first.display();
        let image = match files::read_photo(first, 0.0) {
            Err(error) => {
                return Error::Failed(format!(
                    "{error}; none of {} is a whole photograph",
                    plural(count, "file")
                ));
            }
            Ok(photo) => photo.decode(),
        };
        match (image, self.crop) {
            (Ok(Image { width, height, .. }), Some(Region { x, y, width: w, height: h })) => {
                Error::Plan(format!(
                    "{name}: found {width} x {height} pixels, wanted the region {x},{y},{w},{h} of `crop` inside"
                ))
            }
            (Ok(_), None) => Error::Failed(format!("{name}: cannot be read any more")),
            (Err(error), _) => Error::Failed(format!(
                "{name}: {error}; none of {} is a whole photograph",
                plural(count, "file")
            )),
        }
    }
}
