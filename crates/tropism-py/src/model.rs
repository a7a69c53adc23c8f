//! Plant models: those of the core, and one that is written in Python.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use tropism::control::{Periodic, PredictiveRule, Sensors};
use tropism::geometry::Point;
use tropism::greenhouse::bean::{Species, Trial};
use tropism::lamps::{Layout, Light};
use tropism::observation::Observation;
use tropism::obstacle::Solid;
use tropism::plant::PlantModel;
use tropism::plant::lstm::{LstmModel, LstmState};
use tropism::plant::memory::{MemoryModel, MemoryState};
use tropism::plant::space::{SpaceModel, SpaceState};
use tropism::plant::stem::{StemModel, StemState};
use tropism::plant::tip::{TipModel, TipModelConfig, TipState};
use tropism::random::{self, Purpose, StepNoise};
use tropism::simulation::{BatchModel, Episode, LinearController};
use tropism::task::{OpenLoop, Task};
use tropism::track::Sample;

use crate::error::{refused, with_causes};
use crate::parts::PythonModel;
use crate::threads::check_fork;
use crate::track::Track;

/// Steps between two switches of the lamps in the paper's open-loop experiments: six hours.
const SWITCH_STEPS: u32 = 72;

/// Any plant model.
pub(crate) enum AnyModel {
    Tip(Arc<TipModel>),
    Memory(Arc<MemoryModel>),
    Stem(Arc<StemModel>),
    Lstm(Arc<LstmModel>),
    Space(Arc<SpaceModel>),
    Python(PythonModel),
}

/// The state of a plant of any model.
#[derive(Clone)]
pub(crate) enum AnyState {
    Tip(TipState),
    Memory(Box<MemoryState>),
    Stem(Box<StemState>),
    Lstm(Box<LstmState>),
    Space(Box<SpaceState>),
    Python(Arc<Py<PyAny>>),
}

/// The same for a model of any kind, and for a plant of it.
macro_rules! of_any {
    ($any:expr, |$model:ident| $what:expr) => {
        match $any {
            AnyModel::Tip($model) => $what,
            AnyModel::Memory($model) => $what,
            AnyModel::Stem($model) => $what,
            AnyModel::Lstm($model) => $what,
            AnyModel::Space($model) => $what,
            AnyModel::Python($model) => $what,
        }
    };
    ($any:expr, |$model:ident, $plant:ident| $what:expr) => {
        match ($any, $plant) {
            (AnyModel::Tip($model), AnyState::Tip($plant)) => $what,
            (AnyModel::Memory($model), AnyState::Memory($plant)) => $what,
            (AnyModel::Stem($model), AnyState::Stem($plant)) => $what,
            (AnyModel::Lstm($model), AnyState::Lstm($plant)) => $what,
            (AnyModel::Space($model), AnyState::Space($plant)) => $what,
            (AnyModel::Python($model), AnyState::Python($plant)) => $what,
            _ => unreachable!("a plant of another model"),
        }
    };
}

/// Makes the plants of each kind plants of any kind.
macro_rules! kinds_of_states {
    ($($kind:ident($state:ty)),*) => {$(
        impl From<$state> for AnyState {
            fn from(state: $state) -> Self {
                Self::$kind(state.into())
            }
        }
    )*};
}

kinds_of_states!(
    Tip(TipState),
    Memory(MemoryState),
    Stem(StemState),
    Lstm(LstmState),
    Space(SpaceState),
    Python(Arc<Py<PyAny>>)
);

impl PlantModel for AnyModel {
    type Plant = AnyState;

    fn seedling(&self, start: Point, noise: &mut StepNoise) -> AnyState {
        of_any!(self, |model| model.seedling(start, noise).into())
    }

    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> AnyState {
        of_any!(self, |model| model.resumed(past, noise).into())
    }

    fn among(&self, plant: &mut AnyState, solids: &[Solid]) {
        of_any!(self, |model, plant| model.among(plant, solids));
    }

    fn step(&self, plant: &mut AnyState, light: Light, noise: &mut StepNoise) {
        of_any!(self, |model, plant| model.step(plant, light, noise));
    }

    fn observe(&self, plant: &AnyState) -> Observation {
        of_any!(self, |model, plant| model.observe(plant))
    }

    fn is_beyond_data(&self, plant: &AnyState) -> bool {
        of_any!(self, |model, plant| model.is_beyond_data(plant))
    }

    fn layout(&self) -> &Layout {
        of_any!(self, |model| model.layout())
    }

    fn period_min(&self) -> f64 {
        of_any!(self, |model| model.period_min())
    }
}

impl BatchModel for PythonModel {}

impl BatchModel for AnyModel {
    fn score<'g, T: Task + ?Sized>(
        &self,
        task: &T,
        sensors: &Sensors,
        episodes: impl Iterator<Item = Episode<&'g tropism_neat::Genome>>,
    ) -> Vec<f64> {
        of_any!(self, |model| model.score(task, sensors, episodes))
    }

    fn score_linear<T: Task + ?Sized>(
        &self,
        task: &T,
        episodes: impl Iterator<Item = Episode<LinearController>>,
    ) -> Vec<f64> {
        of_any!(self, |model| model.score_linear(task, episodes))
    }

    fn score_rules<T: Task + ?Sized>(
        &self,
        task: &T,
        beyond_cost_cm: f64,
        episodes: impl Iterator<Item = Episode<PredictiveRule>>,
    ) -> Vec<f64> {
        of_any!(self, |model| model.score_rules(task, beyond_cost_cm, episodes))
    }
}

/// A model of how plants move, fitted to tracks. It does not change.
#[pyclass(frozen, module = "tropism.loop")]
pub(crate) struct Model(pub(crate) Arc<AnyModel>);

impl Model {
    fn fitted(tracks: &[&tropism::track::Track], kind: &str, is_virtual: bool) -> PyResult<Self> {
        let tracks = || tracks.iter().copied();
        let model = match kind {
            "tip" => TipModel::fit(tracks(), TipModelConfig::default())
                .map(|model| AnyModel::Tip(Arc::new(model.of_virtual_plants(is_virtual)))),
            "memory" => MemoryModel::fit(tracks())
                .map(|model| AnyModel::Memory(Arc::new(model.of_virtual_plants(is_virtual)))),
            "stem" => StemModel::fit(tracks())
                .map(|model| AnyModel::Stem(Arc::new(model.of_virtual_plants(is_virtual)))),
            "stem-ensemble" => StemModel::fit_ensemble(tracks())
                .map(|model| AnyModel::Stem(Arc::new(model.of_virtual_plants(is_virtual)))),
            "space" => SpaceModel::fit(tracks())
                .map(|model| AnyModel::Space(Arc::new(model.of_virtual_plants(is_virtual)))),
            _ => {
                let wanted = "tip, memory, stem, stem-ensemble or space; `tropism.fit` trains an lstm";
                return Err(refused(format!("found kind {kind:?}, wanted {wanted}")));
            }
        };
        model.map(|model| Self(Arc::new(model))).map_err(refused)
    }
}

#[pymethods]
impl Model {
    /// A model of tracks: `kind` is tip (the paper's), memory, stem, stem-ensemble or space.
    #[staticmethod]
    #[pyo3(signature = (tracks, kind="tip", is_virtual=false))]
    fn fit(tracks: Vec<PyRef<'_, Track>>, kind: &str, is_virtual: bool) -> PyResult<Self> {
        let tracks: Vec<_> = tracks.iter().map(|track| &track.0).collect();
        Self::fitted(&tracks, kind, is_virtual)
    }

    /// A model of virtual beans under periodic lamps, as in the paper's open-loop experiments; of kind space with four lamps,
    /// seen by two cameras.
    #[staticmethod]
    #[pyo3(signature = (kind="tip", seed=1, plants=6, steps=1000))]
    fn of_virtual_beans(py: Python<'_>, kind: &str, seed: u64, plants: u32, steps: u32) -> PyResult<Self> {
        check_fork()?;
        py.detach(|| {
            let (species, task) = (Species::default(), OpenLoop { steps, ..OpenLoop::default() });
            let in_space = kind == "space";
            let layout = if in_space { Layout::four_sides() } else { Layout::default() };
            let trial = Trial { layout, in_space, ..Trial::new(&species) };
            // The plants of `tropism grow` with this seed.
            let seeds: Vec<u64> =
                (0..plants).map(|plant| random::derive(seed, Purpose::Plant, plant.into()) >> 1).collect();
            let periodic = |_| Periodic::new(SWITCH_STEPS, &trial.layout);
            let watch = &mut |_, _: &_| std::ops::ControlFlow::Continue(());
            let tracks = trial.grow_all(&seeds, periodic, &task, watch);
            Self::fitted(&tracks.iter().collect::<Vec<_>>(), kind, true)
        })
    }

    /// Reads a model file of any kind, from `tropism fit`.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let refuse = |error: &dyn std::error::Error| refused(with_causes(error));
        let text = tropism_lab::files::read_text(&path).map_err(|error| refuse(&error))?;
        let at = |error: tropism::plant::tip::ModelError| refused(format!("{}: {error}", path.display()));
        let model = if StemModel::is_named_in(&text) {
            AnyModel::Stem(Arc::new(StemModel::from_json(&text).map_err(at)?))
        } else if LstmModel::is_named_in(&text) {
            AnyModel::Lstm(Arc::new(LstmModel::from_json(&text).map_err(at)?))
        } else if SpaceModel::is_named_in(&text) {
            AnyModel::Space(Arc::new(SpaceModel::from_json(&text).map_err(at)?))
        } else if MemoryModel::is_named_in(&text) {
            AnyModel::Memory(Arc::new(MemoryModel::from_json(&text).map_err(at)?))
        } else {
            AnyModel::Tip(Arc::new(TipModel::from_json(&text).map_err(at)?))
        };
        Ok(Self(Arc::new(model)))
    }

    /// The model as the JSON of a model file.
    fn to_json(&self) -> PyResult<String> {
        match &*self.0 {
            AnyModel::Tip(model) => Ok(model.to_json()),
            AnyModel::Memory(model) => Ok(model.to_json()),
            AnyModel::Stem(model) => Ok(model.to_json()),
            AnyModel::Lstm(model) => Ok(model.to_json()),
            AnyModel::Space(model) => Ok(model.to_json()),
            AnyModel::Python(_) => Err(refused("found a model of Python, wanted one that files can hold")),
        }
    }

    #[getter]
    fn kind(&self) -> &'static str {
        match &*self.0 {
            AnyModel::Tip(_) => "tip",
            AnyModel::Memory(_) => "memory",
            AnyModel::Stem(model) if model.is_ensemble() => "stem-ensemble",
            AnyModel::Stem(_) => "stem",
            AnyModel::Lstm(_) => "lstm",
            AnyModel::Space(_) => "space",
            AnyModel::Python(_) => "python",
        }
    }

    #[getter]
    fn is_virtual(&self) -> bool {
        match &*self.0 {
            AnyModel::Tip(model) => model.is_virtual(),
            AnyModel::Memory(model) => model.is_virtual(),
            AnyModel::Stem(model) => model.is_virtual(),
            AnyModel::Lstm(model) => model.is_virtual(),
            AnyModel::Space(model) => model.is_virtual(),
            AnyModel::Python(_) => true,
        }
    }

    #[getter]
    fn period_min(&self) -> f64 {
        self.0.period_min()
    }

    #[getter]
    fn lamps(&self) -> Vec<String> {
        self.0.layout().lamps().iter().map(|lamp| lamp.name.clone()).collect()
    }
}
