//! A run that is over, as a report reads it from its folder.

use std::path::{Path, PathBuf};

use tropism::photo::Image;
use tropism::track::Track;
use tropism_report::{LitStem, Plants};

use super::RunConfig;
use crate::error::Error;
use crate::files::{self, FileError};
use crate::journal::Journal;

/// Photographs or stems of a run that are laid over each other in a figure, at most; chosen by hand.
const MAX_OVERLAID: usize = 60;

/// A run folder whose run is over.
#[derive(Clone, Debug)]
pub struct FinishedRun {
    /// The folder.
    pub path: PathBuf,
    /// Its `run.toml`.
    pub config: RunConfig,
    /// Its `track.csv`.
    pub track: Track,
}

impl FinishedRun {
    /// Reads the run in the folder `path`.
    ///
    /// # Errors
    /// [`Error`] names the file that cannot be read, or the run that is not over.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let config = RunConfig::read(path)?;
        let file = path.join("track.csv");
        if !file.exists() {
            let problem = "found a run that is not over, wanted its track.csv; go on with it by --resume";
            return Err(FileError::content(path, problem).into());
        }
        Ok(Self { path: path.to_owned(), config, track: files::read_track(&file)? })
    }

    /// Reads the runs in the folders `1`, `2`, ... in `path`, up to the first that is missing.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_numbered(path: &Path) -> Result<Vec<Self>, Error> {
        let numbered = (1..).map(|number: u32| path.join(number.to_string()));
        numbered.take_while(|path| path.join("run.toml").exists()).map(|path| Self::read(&path)).collect()
    }

    /// The label of its plant in figures.
    #[must_use]
    pub const fn plants(&self) -> Plants {
        self.config.plants()
    }

    /// Decodes photographs at equal distances over the run, 60 at most, each with its index. Damaged ones are left out.
    ///
    /// # Errors
    /// [`Error::File`] if there are no photographs.
    pub fn photographs(&self) -> Result<impl Iterator<Item = (usize, Image)> + use<>, Error> {
        let photographs = files::photographs(&[self.path.join("photographs")])?;
        let stride = photographs.len().div_ceil(MAX_OVERLAID);
        let decoded = |(index, path): (usize, PathBuf)| {
            Some((index, files::read_photo(&path, 0.0).ok()?.decode().ok()?))
        };
        Ok(photographs.into_iter().enumerate().step_by(stride).filter_map(decoded))
    }

    /// Stems at equal distances over the run, 60 at most, each with the light that was lit. They are those of the journal.
    /// Where it holds none, as before schema 5, they are detected in the photographs.
    ///
    /// # Errors
    /// [`Error`] names the file that cannot be read.
    pub fn stems(&self) -> Result<Vec<LitStem>, Error> {
        let path = self.path.join("journal.sqlite");
        if !path.exists() {
            return self.detect_stems();
        }
        let at = || Error::at(path.display());
        let journal = Journal::open_to_read(&path).map_err(at())?;
        if !journal.has_stems() {
            return self.detect_stems();
        }
        let steps = journal.steps().map_err(at())?;
        let stride = steps.len().div_ceil(MAX_OVERLAID).max(1);
        let overlaid = steps.into_iter().step_by(stride).filter(|step| step.seen.is_measured());
        Ok(overlaid.filter_map(|step| Some((step.seen.observation?.stem?, step.decided))).collect())
    }

    /// Detects stems in the photographs, each by itself.
    fn detect_stems(&self) -> Result<Vec<LitStem>, Error> {
        let Some(eye) = self.config.eye() else { return Ok(Vec::new()) };
        let stem = |(index, image): (usize, Image)| {
            let seen = eye.clone().settle(eye.judge(Ok(&image)));
            let light = self.track.samples.get(index).and_then(|sample| sample.light);
            Some((seen.observation?.stem?, light))
        };
        Ok(self.photographs()?.filter_map(stem).collect())
    }
}
