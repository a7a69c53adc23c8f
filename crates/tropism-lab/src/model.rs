//! The tip-motion model: from its file, checked against the start of a task, and as the world of simulated plants.

use std::path::Path;

use tropism::control::Controller;
use tropism::evolve::{self, Trial};
use tropism::plant::PlantModel;
use tropism::plant::tip::TipModel;
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation;
use tropism::task::{Task, TaskSpec};
use tropism::track::Track;

use crate::controller::ControllerSpec;
use crate::files::{self, FileError};
use crate::{Error, Monitor};

/// Largest distance between the start of a task and the nearest data of a model, in cm. Simulated plants grow straight
/// over such a gap, some 70 steps at 0.03 cm a step, eq. (4).
const MAX_GAP_CM: f64 = 2.0;

/// Reads the model in `path`.
///
/// # Errors
/// [`FileError`] if the file cannot be read or holds no model.
pub(crate) fn read(path: &Path) -> Result<TipModel, FileError> {
    files::read_as(path, TipModel::from_json)
}

/// Reads the model in `path`, on which plants start where `task` says. Notes a gap between this start and the data.
///
/// # Errors
/// [`Error::File`] as [`read`] does; [`Error::Plan`] if the gap is larger than [`MAX_GAP_CM`].
pub(crate) fn read_for(path: &Path, task: &TaskSpec, monitor: &dyn Monitor) -> Result<TipModel, Error> {
    let model = read(path)?;
    let start = task.start();
    if model.layout().lights().any(|light| model.mean_shift(start, light).is_some()) {
        return Ok(model);
    }
    let tips = model.observed().iter().flat_map(|shift| [shift.tip, shift.tip.mirrored()]);
    let gap_cm = tips.map(|tip| tip.distance(start)).fold(f64::INFINITY, f64::min);
    let found = format!(
        "{}: found no data around the start of the task at {:.1}, {:.1} cm; the nearest data are {gap_cm:.1} cm away",
        path.display(),
        start.x,
        start.y
    );
    if gap_cm > MAX_GAP_CM {
        return Err(Error::Plan(format!(
            "{found}, wanted at most {MAX_GAP_CM} cm: use a `task` that starts where the model has data"
        )));
    }
    monitor.note(&format!("{found}; simulated plants grow straight over this gap"));
    Ok(model)
}

/// Simulates one plant of `model` that `controller` steers: plant number `episode` of the trials under `seed`.
pub(crate) fn simulate(
    model: &TipModel,
    controller: &mut dyn Controller,
    task: &TaskSpec,
    seed: u64,
    episode: u32,
) -> Track {
    let noise = NoiseStream::new(seed, Purpose::Trial, [episode, 0, 0]);
    simulation::simulate_with(model, controller, task, noise)
}

/// Tries `controller` on `plants` unseen plants of `model`.
pub(crate) fn trial(
    model: &TipModel,
    controller: &ControllerSpec,
    task: &TaskSpec,
    seed: u64,
    plants: u32,
) -> Trial {
    let build = || controller.build(task, model.layout(), model.period_min());
    evolve::trial(std::slice::from_ref(model), task, build, seed, plants)
}
