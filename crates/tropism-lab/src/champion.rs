//! Champions: the genome of an evolved network as a file, and as the controller of a simulated plant.

use std::path::Path;

use tropism::control::network::{NetworkController, ShapeError};
use tropism::plant::tip::TipModel;
use tropism::task::Task;
use tropism::track::Track;
use tropism_neat::Genome;

use crate::files::{self, FileError};
use crate::model;

/// Reads the champion in `path`.
///
/// # Errors
/// [`FileError`] if the file cannot be read or holds no genome.
pub(crate) fn read(path: &Path) -> Result<Genome, FileError> {
    files::read_as(path, Genome::from_json)
}

/// Writes `champion` to `path`.
///
/// # Errors
/// [`FileError::Disk`].
pub(crate) fn write(path: &Path, champion: &Genome) -> Result<(), FileError> {
    files::write(path, champion.to_json().as_bytes())
}

/// Simulates one plant of `model` that `champion` steers: the first plant of the trials under `seed`.
///
/// # Errors
/// [`ShapeError`] if the genome is no controller.
pub(crate) fn simulate(
    champion: &Genome,
    model: &TipModel,
    task: &Task,
    seed: u64,
) -> Result<Track, ShapeError> {
    Ok(model::simulate(model, &mut NetworkController::new(champion)?, task, seed, 0))
}
