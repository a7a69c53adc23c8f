//! Models of a plant: from their files, checked against the start of a task, and as the world of simulated plants.

use std::ops::ControlFlow;
use std::path::Path;

use tropism::control::Controller;
use tropism::environment;
pub(crate) use tropism::evolve::reason_to_withhold;
use tropism::geometry::Point;
use tropism::plant::tip::TipModel;
use tropism::plant::{FittedModel, PlantModel};
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::Simulation;
pub use tropism::simulation::{AnyModel as Model, ModelKind};
use tropism::task::Task;
use tropism::track::{Sample, Track};

use crate::files::{self, FileError};
use crate::{Error, Monitor};

/// Largest distance between the start of a task and the nearest data of a model, in cm. Simulated plants grow straight
/// over such a gap, some 70 steps at 0.03 cm a step, eq. (4).
const MAX_GAP_CM: f64 = 2.0;

/// Reads the model in `path`.
///
/// # Errors
/// [`FileError`] if the file cannot be read or holds no model.
pub(crate) fn read(path: &Path) -> Result<Model, FileError> {
    files::read_as(path, Model::from_json)
}

/// Reads the tip-motion model in `path`.
///
/// # Errors
/// [`FileError`] if the file cannot be read or holds no tip-motion model.
pub(crate) fn read_tip(path: &Path) -> Result<TipModel, FileError> {
    files::read_as(path, <TipModel as FittedModel>::from_json)
}

/// Reads the model in `path`, on which plants start where `task` says. Notes a gap between this start and the data.
///
/// # Errors
/// [`Error::File`] as [`read`] does; [`Error::Plan`] if the gap is larger than [`MAX_GAP_CM`], or the task needs the whole stem or
/// depth, of which the model knows nothing.
pub(crate) fn read_for(path: &Path, task: &Task, monitor: &dyn Monitor) -> Result<Model, Error> {
    let model = read(path)?;
    let (knows_stem, knows_depth) = (model.kind().knows_stem(), model.kind().is_in_space());
    let needs = [
        (task.is_in_space() && !knows_depth, "depth", "the plane of the front camera", ModelKind::SPACE),
        (task.is_about_stem() && !knows_stem, "the whole stem", "the tip alone", ModelKind::STEM),
    ];
    if let Some((_, need, known, kind)) = needs.into_iter().find(|(is_missing, ..)| *is_missing) {
        return Err(Error::Plan(format!(
            "the task ({}) needs {need}, and {} is a model of {known}: fit one with `tropism fit --kind {}`",
            task.title(),
            path.display(),
            kind.name()
        )));
    }
    let Some((gap_cm, found)) = gap(&model, path, "start of the task", task.start) else {
        return Ok(model);
    };
    if gap_cm > MAX_GAP_CM {
        return Err(Error::Plan(format!(
            "{found}, wanted at most {MAX_GAP_CM} cm: use a `task` that starts where the model has data"
        )));
    }
    monitor.note(&format!("{found}; {}", model.without_data()));
    Ok(model)
}

/// Reads the model in `path` for a plant whose tip is at `tip`.
///
/// # Errors
/// [`Error::File`] as [`read`] does; [`Error::Plan`] if the nearest data are farther away than [`MAX_GAP_CM`].
pub(crate) fn read_around(path: &Path, tip: Point) -> Result<Model, Error> {
    let model = read(path)?;
    match gap(&model, path, "tip", tip) {
        Some((gap_cm, found)) if gap_cm > MAX_GAP_CM => {
            Err(Error::Plan(format!("{found}, wanted at most {MAX_GAP_CM} cm")))
        }
        _ => Ok(model),
    }
}

/// How far the data of the model in `path` are from `place`, which is the plant's `what`, and this in words; `None` if it
/// has data there.
fn gap(model: &Model, path: &Path, what: &str, place: Point) -> Option<(f64, String)> {
    if model.has_data(place) {
        return None;
    }
    let gap_cm = model.gap_cm(place);
    let found = format!(
        "{}: found no data around the {what} at {:.1}, {:.1} cm; the nearest data are {gap_cm:.1} cm away",
        path.display(),
        place.x,
        place.y
    );
    Some((gap_cm, found))
}

/// Simulates one plant of `model` that `controller` steers: plant number `episode` of the trials under `seed`. `watch` sees
/// each sample and may break off.
pub(crate) fn simulate(
    model: &impl PlantModel,
    controller: &mut dyn Controller,
    task: &Task,
    seed: u64,
    episode: u32,
    watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
) -> Track {
    let noise = NoiseStream::new(seed, Purpose::Trial, [episode, 0, 0]);
    let Ok(track) = environment::run(&mut Simulation::new(model, task, noise), controller, task, watch);
    track
}
