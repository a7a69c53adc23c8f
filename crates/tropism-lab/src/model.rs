//! Models of a plant: from their files, checked against the start of a task, and as the world of simulated plants.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use tropism::control::{Controller, PredictiveRule, Sensors};
use tropism::environment::{self, Environment};
use tropism::geometry::Point;
use tropism::lamps::{Layout, Light};
use tropism::math::hypot;
use tropism::observation::Observation;
use tropism::obstacle::Solid;
use tropism::plant::PlantModel;
use tropism::plant::space::{SpaceModel, SpaceState};
use tropism::plant::stem::{StemModel, StemState};
use tropism::plant::tip::{ModelError, TipModel, TipState};
use tropism::random::{NoiseStream, Purpose, StepNoise};
use tropism::simulation::{BatchModel, Episode, Simulation};
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism_neat::Genome;

use crate::files::{self, FileError};
use crate::{Error, Monitor};

/// Largest distance between the start of a task and the nearest data of a model, in cm. Simulated plants grow straight
/// over such a gap, some 70 steps at 0.03 cm a step, eq. (4).
const MAX_GAP_CM: f64 = 2.0;

/// Distance within which data count as around a place, in cm: half the height of the paper's window, eq. (1).
const NEAR_CM: f64 = 1.0;

/// Any model that a file may hold. Clones share its data.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// The paper's tip-motion model.
    Tip(Arc<TipModel>),
    /// The linear model of the whole stem.
    Stem(Arc<StemModel>),
    /// The linear model of the whole stem in space.
    Space(Arc<SpaceModel>),
}

/// The state of one plant of a [`Model`].
#[derive(Clone, Debug)]
pub enum ModelState {
    /// Of the paper's tip-motion model.
    Tip(TipState),
    /// Of the linear model of the whole stem.
    Stem(StemState),
    /// Of the linear model of the whole stem in space.
    Space(Box<SpaceState>),
}

/// Makes each kind of model a [`Model`], and its plants plants of it.
macro_rules! kinds_of_models {
    ($($kind:ident($model:ty, $state:ty)),*) => {$(
        impl From<$model> for Model {
            fn from(model: $model) -> Self {
                Self::$kind(model.into())
            }
        }

        impl From<$state> for ModelState {
            fn from(state: $state) -> Self {
                Self::$kind(state.into())
            }
        }
    )*};
}

kinds_of_models!(Tip(TipModel, TipState), Stem(StemModel, StemState), Space(SpaceModel, SpaceState));

/// The same for a model of any kind, and for a plant of it.
macro_rules! of_any {
    ($any:expr, |$model:ident| $what:expr) => {
        match $any {
            Self::Tip($model) => $what,
            Self::Stem($model) => $what,
            Self::Space($model) => $what,
        }
    };
    ($any:expr, |$model:ident, $plant:ident| $what:expr) => {
        match ($any, $plant) {
            (Self::Tip($model), ModelState::Tip($plant)) => $what,
            (Self::Stem($model), ModelState::Stem($plant)) => $what,
            (Self::Space($model), ModelState::Space($plant)) => $what,
            _ => unreachable!("a plant of another model"),
        }
    };
}

impl Model {
    /// Reads any kind, told apart by the schema.
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        if StemModel::is_named_in(text) {
            StemModel::from_json(text).map(Self::from)
        } else if SpaceModel::is_named_in(text) {
            SpaceModel::from_json(text).map(Self::from)
        } else {
            TipModel::from_json(text).map(Self::from)
        }
    }

    /// Readable JSON with all data; see `docs/formats.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        of_any!(self, |model| model.to_json())
    }

    /// Whether it was made of virtual plants.
    #[must_use]
    pub fn is_virtual(&self) -> bool {
        of_any!(self, |model| model.is_virtual())
    }

    /// The share of the lit steps of a track, 0 to 1, that begin where the model has no data.
    pub(crate) fn share_without_data(&self, samples: &[Sample]) -> f64 {
        of_any!(self, |model| model.share_without_data(samples))
    }

    /// One model for each of `most` plants at most, made of its data alone.
    pub(crate) fn of_each_plant(&self, most: usize) -> Result<Vec<Self>, ModelError> {
        Ok(match self {
            Self::Tip(model) => model.of_each_plant(most)?.into_iter().map(Self::from).collect(),
            Self::Stem(model) => model.of_each_plant(most)?.into_iter().map(Self::from).collect(),
            Self::Space(model) => model.of_each_plant(most)?.into_iter().map(Self::from).collect(),
        })
    }

    /// Whether its plants are in space; else they are in the plane of the front camera.
    pub(crate) fn is_in_space(&self) -> bool {
        matches!(self, Self::Space(_))
    }

    /// Whether the model has data around `tip`.
    fn has_data(&self, tip: Point) -> bool {
        match self {
            Self::Tip(model) => model.layout().lights().any(|light| model.mean_shift(tip, light).is_some()),
            Self::Stem(_) | Self::Space(_) => self.gap_cm(tip) <= NEAR_CM,
        }
    }

    /// Distance from `tip` to the nearest data or their mirror image, in cm.
    fn gap_cm(&self, tip: Point) -> f64 {
        let nearer =
            |least: f64, data: Point| least.min(data.distance(tip)).min(data.mirrored().distance(tip));
        match self {
            Self::Tip(model) => model.observed().iter().map(|shift| shift.tip).fold(f64::INFINITY, nearer),
            Self::Stem(model) => model.tips().fold(f64::INFINITY, nearer),
            // Turned about the vertical, data are data.
            Self::Space(model) => {
                model.tips().map(|[x, y, z]| Point::new(hypot(x, z), y)).fold(f64::INFINITY, nearer)
            }
        }
    }
}

impl PlantModel for Model {
    type Plant = ModelState;

    fn seedling(&self, start: Point, noise: &mut StepNoise) -> ModelState {
        of_any!(self, |model| model.seedling(start, noise).into())
    }

    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> ModelState {
        of_any!(self, |model| model.resumed(past, noise).into())
    }

    fn among(&self, plant: &mut ModelState, solids: &[Solid]) {
        of_any!(self, |model, plant| model.among(plant, solids))
    }

    fn step(&self, plant: &mut ModelState, light: Light, noise: &mut StepNoise) {
        of_any!(self, |model, plant| model.step(plant, light, noise))
    }

    fn observe(&self, plant: &ModelState) -> Observation {
        of_any!(self, |model, plant| model.observe(plant))
    }

    fn is_beyond_data(&self, plant: &ModelState) -> bool {
        of_any!(self, |model, plant| model.is_beyond_data(plant))
    }

    fn layout(&self) -> &Layout {
        of_any!(self, |model| model.layout())
    }

    fn period_min(&self) -> f64 {
        of_any!(self, |model| model.period_min())
    }
}

impl BatchModel for Model {
    fn score<'g>(
        &self,
        task: &Task,
        sensors: &Sensors,
        episodes: impl Iterator<Item = Episode<&'g Genome>>,
    ) -> Vec<f64> {
        of_any!(self, |model| model.score(task, sensors, episodes))
    }

    fn score_rules(
        &self,
        task: &Task,
        beyond_cost_cm: f64,
        episodes: impl Iterator<Item = Episode<PredictiveRule>>,
    ) -> Vec<f64> {
        of_any!(self, |model| model.score_rules(task, beyond_cost_cm, episodes))
    }
}

/// Whether `text` calls itself a model of a plant.
pub(crate) fn is_named_in(text: &str) -> bool {
    StemModel::is_named_in(text) || SpaceModel::is_named_in(text) || TipModel::is_named_in(text)
}

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
    files::read_as(path, TipModel::from_json)
}

/// Reads the model in `path`, on which plants start where `task` says. Notes a gap between this start and the data.
///
/// # Errors
/// [`Error::File`] as [`read`] does; [`Error::Plan`] if the gap is larger than [`MAX_GAP_CM`], or the task needs the whole stem or
/// depth, of which the model knows nothing.
pub(crate) fn read_for(path: &Path, task: &Task, monitor: &dyn Monitor) -> Result<Model, Error> {
    let model = read(path)?;
    let noise = NoiseStream::new(0, Purpose::Trial, [0; 3]);
    let Ok(seen) = Simulation::new(&model, task, noise).observe();
    let needs = [
        (task.is_in_space() && seen.depth.is_none(), "depth", "the plane of the front camera", "space"),
        (task.is_about_stem() && seen.stem.is_none(), "the whole stem", "the tip alone", "stem"),
    ];
    if let Some((_, need, known, kind)) = needs.into_iter().find(|(is_missing, ..)| *is_missing) {
        return Err(Error::Plan(format!(
            "the task ({}) needs {need}, and {} is a model of {known}: fit one with `tropism fit --model {kind}`",
            task.title(),
            path.display(),
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
    let over_gap = match model {
        Model::Tip(_) => "simulated plants grow straight over this gap",
        Model::Stem(_) | Model::Space(_) => "simulated plants move there as at the nearest data",
    };
    monitor.note(&format!("{found}; {over_gap}"));
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

/// Share of steps without data from which on no fitness is expected; chosen by hand.
const MOST_WITHOUT_DATA: f64 = 0.5;

/// Why fitness on a model of so many plants, in which a controller meets so large a share of steps without data, is no expectation
/// for unseen plants; `None` where it is one.
pub(crate) fn reason_to_withhold(plants: usize, without_data: f64) -> Option<String> {
    if plants < 2 {
        return Some("the model is of one plant, which does not tell how plants differ".to_owned());
    }
    (without_data > MOST_WITHOUT_DATA)
        .then(|| format!("the model has no data in {:.0} % of the steps", 100.0 * without_data))
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
