//! Champions: an evolved network as a file, and as the controller of a simulated plant.

use std::path::Path;

use tropism::environment::unwatched;
use tropism::evolve::Champion;
use tropism::plant::PlantModel;
use tropism::task::Task;
use tropism::track::Track;

use crate::error::Error;
use crate::files::{self, FileError};
use crate::model;

/// Reads the champion in `path`, or a network alone.
///
/// # Errors
/// [`FileError`] if the file cannot be read or holds no champion.
pub(crate) fn read(path: &Path) -> Result<Champion, FileError> {
    files::read_as(path, Champion::from_json)
}

/// Writes `champion` to `path`.
///
/// # Errors
/// [`FileError::Disk`].
pub(crate) fn write(path: &Path, champion: &Champion) -> Result<(), FileError> {
    files::write(path, champion.to_json().as_bytes())
}

/// Simulates one plant of `model` that `champion` steers: the first plant of the trials under `seed`.
///
/// # Errors
/// [`Error::Plan`] if the network does not fit its sensors and lamps, or dims lamps and the model knows one alone.
pub(crate) fn simulate(
    champion: &Champion,
    model: &impl PlantModel,
    task: &Task,
    seed: u64,
) -> Result<Track, Error> {
    champion.dimming.check(model).map_err(|error| Error::Plan(error.to_string()))?;
    let mut controller = champion.controller(task).map_err(|error| Error::Plan(error.to_string()))?;
    Ok(model::simulate(model, &mut controller, task, seed, 0, &mut unwatched))
}
