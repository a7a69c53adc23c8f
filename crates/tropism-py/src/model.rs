//! Models of plants that are fitted to tracks or read from files.

use std::path::PathBuf;

use pyo3::prelude::*;
use tropism::control::Periodic;
use tropism::lamps::Layout;
use tropism::plant::PlantModel;
use tropism::plant::tip::TipModelConfig;
use tropism::random::{self, Purpose};
use tropism::simulation::{AnyModel, ModelKind};
use tropism::task::Task;
use tropism_bean::{Species, Trial};

use crate::error::{refused, with_causes};
use crate::threads::check_fork;
use crate::track::Track;

/// Steps between two switches of the lamps in the paper's open-loop experiments: six hours.
const SWITCH_STEPS: u32 = 72;

/// A model of how plants move, fitted to tracks. It does not change.
#[pyclass(frozen, module = "tropism.loop")]
pub(crate) struct Model(pub(crate) AnyModel);

impl Model {
    fn fitted(tracks: &[&tropism::track::Track], kind: &str, is_virtual: bool) -> PyResult<Self> {
        let names: Vec<&str> = ModelKind::all().map(ModelKind::name).collect();
        let refuse = || refused(format!("found kind {kind:?}, wanted {}", names.join(", ")));
        let model =
            ModelKind::named(kind).ok_or_else(refuse)?.fit(tracks, &TipModelConfig::default(), is_virtual);
        model.map(Self).map_err(refused)
    }
}

#[pymethods]
impl Model {
    /// A model of tracks: `kind` is tip (the paper's), stem or space.
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
            let (species, task) = (Species::default(), Task::open_loop(steps));
            let in_space = ModelKind::named(kind).is_some_and(ModelKind::is_in_space);
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
        AnyModel::from_json(&text).map(Self).map_err(|error| refused(format!("{}: {error}", path.display())))
    }

    /// The model as the JSON of a model file.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind().name()
    }

    #[getter]
    fn is_virtual(&self) -> bool {
        self.0.is_virtual()
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
