//! Models of plants that are fitted to tracks or read from files.

use std::path::PathBuf;

use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;
use tropism::control::Periodic;
use tropism::geometry::Point;
use tropism::lamps::{Layout, Light};
use tropism::observation::Observation;
use tropism::plant::PlantModel;
use tropism::plant::tip::TipModelConfig;
use tropism::random::{self, NoiseStream, Purpose};
use tropism::simulation::{AnyModel, ModelKind};
use tropism::task::Task;
use tropism_bean::{Species, Trial};

use crate::error::{of_file, refused};
use crate::figure::{draw_shifts, tip_model};
use crate::parts::{PyObservation, light_of};
use crate::threads::check_fork;
use crate::track::Track;

/// Steps between two switches of the lamps in the paper's open-loop experiments: six hours.
const SWITCH_STEPS: u32 = 72;

/// Observed shifts, and the number of the lit lamp of each.
type Shifts<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>);

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
        let text = tropism_lab::files::read_text(&path).map_err(|error| of_file(&error))?;
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

    /// The model in the JSON of a model file.
    #[new]
    fn new(text: &str) -> PyResult<Self> {
        AnyModel::from_json(text).map(Self).map_err(refused)
    }

    fn __getnewargs__(&self) -> (String,) {
        (self.to_json(),)
    }

    fn __eq__(&self, other: PyRef<'_, Self>) -> bool {
        self.0 == other.0
    }

    /// Measured steps that it is made of, without their mirror images.
    #[getter]
    fn steps(&self) -> usize {
        self.0.steps()
    }

    /// The lamps with their places, as JSON.
    #[getter]
    fn layout(&self) -> PyResult<String> {
        serde_json::to_string(self.0.layout()).map_err(refused)
    }

    /// The measured tips, in cm: (steps, 2).
    fn tips<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let tips = self.0.tips();
        Array2::from_shape_fn((tips.len(), 2), |(row, axis)| <[f64; 2]>::from(tips[row])[axis])
            .into_pyarray(py)
    }

    /// The observed shifts of a tip-motion model: x, y, dx and dy in cm, (shifts, 4), and the number of the lit lamp.
    fn shifts<'py>(&self, py: Python<'py>) -> PyResult<Shifts<'py>> {
        let model = tip_model(&self.0)?;
        let shifts = model.observed();
        let numbers = Array2::from_shape_fn((shifts.len(), 4), |(row, column)| {
            let shift = &shifts[row];
            [shift.tip.x, shift.tip.y, shift.dx, shift.dy][column]
        });
        let lights: Vec<i64> = shifts.iter().map(|shift| shift.light.index() as i64).collect();
        Ok((numbers.into_pyarray(py), lights.into_pyarray(py)))
    }

    /// The mean shift in x at each place (rows of x and y, in cm) under each lamp, in cm, eq. (5): (places, lamps), NaN where
    /// there are no data.
    fn mean_shifts<'py>(
        &self,
        py: Python<'py>,
        places: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let model = tip_model(&self.0)?;
        let places = places.as_array();
        if places.shape()[1] != 2 {
            return Err(refused(format!("found places of shape {:?}, wanted (rows, 2)", places.shape())));
        }
        let lamps: Vec<Light> = self.0.layout().lights().collect();
        let mean = |(row, lamp): (usize, usize)| {
            model.mean_shift(Point::new(places[[row, 0]], places[[row, 1]]), lamps[lamp]).unwrap_or(f64::NAN)
        };
        Ok(Array2::from_shape_fn((places.shape()[0], lamps.len()), mean).into_pyarray(py))
    }

    /// Settings of a tip-motion model, as JSON: window, grid, growth, and what holds where there are no data.
    fn settings(&self) -> PyResult<String> {
        serde_json::to_string(tip_model(&self.0)?.config()).map_err(refused)
    }

    /// Maps of the mean shifts (Fig. 5), as SVG.
    fn draw(&self) -> PyResult<String> {
        draw_shifts(&self.0)
    }

    /// Tips of `plants` simulated plants under lamps by number, one a step: (plants, steps + 1, 2), or 3 in space; in cm.
    ///
    /// They begin at `start`, or where `past` ends. Plant i has the noise of plant i of `tropism simulate` under `seed`.
    #[pyo3(signature = (lights, plants, seed, start, past=None))]
    fn tips_under<'py>(
        &self,
        py: Python<'py>,
        lights: Vec<usize>,
        plants: u32,
        seed: u64,
        start: (f64, f64),
        past: Option<PyRef<'py, Track>>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        check_fork()?;
        let lights =
            lights.into_iter().map(|number| lamp(self.0.layout(), number)).collect::<PyResult<Vec<_>>>()?;
        let past = past.map(|past| past.0.samples.clone());
        let (model, start) = (&self.0, Point::new(start.0, start.1));
        let width = if model.kind().is_in_space() { 3 } else { 2 };
        let rows: Vec<Vec<f64>> = py.detach(|| {
            (0..plants)
                .into_par_iter()
                .map(|number| {
                    let noise = NoiseStream::new(seed, Purpose::Trial, [number, 0, 0]);
                    let mut plant = match &past {
                        Some(past) => model.resumed(past, &mut noise.of_seedling()),
                        None => model.seedling(start, &mut noise.of_seedling()),
                    };
                    let mut row = Vec::with_capacity((lights.len() + 1) * width);
                    put_tip(&plant.observe(), width, &mut row);
                    for (light, step) in lights.iter().zip(0..) {
                        plant.step(*light, &mut noise.at(step));
                        put_tip(&plant.observe(), width, &mut row);
                    }
                    row
                })
                .collect()
        });
        let shape = (plants as usize, lights.len() + 1, width);
        Ok(Array3::from_shape_vec(shape, rows.concat()).map_err(refused)?.into_pyarray(py))
    }

    /// One plant of the model, to be stepped by hand.
    #[pyo3(signature = (start=(0.0, 4.0), seed=1, number=0, past=None))]
    fn plant(&self, start: (f64, f64), seed: u64, number: u32, past: Option<PyRef<'_, Track>>) -> Plant {
        let noise = NoiseStream::new(seed, Purpose::Trial, [number, 0, 0]);
        let plant = match &past {
            Some(past) => self.0.resumed(&past.0.samples, &mut noise.of_seedling()),
            None => self.0.seedling(Point::new(start.0, start.1), &mut noise.of_seedling()),
        };
        Plant { model: self.0.clone(), plant, noise, step: 0 }
    }
}

/// The lamp of this number.
fn lamp(layout: &Layout, number: usize) -> PyResult<Light> {
    Light::new(number).filter(|light| layout.contains(*light)).ok_or_else(|| {
        refused(format!("found lamp {number}, wanted 0 to {}: the number of a lamp", layout.len() - 1))
    })
}

/// Writes the tip: x and y, and z where `width` is 3.
fn put_tip(seen: &Observation, width: usize, row: &mut Vec<f64>) {
    row.extend([seen.tip.x, seen.tip.y]);
    if width == 3 {
        row.push(seen.depth.as_ref().map_or(0.0, |depth| depth.tip_cm));
    }
}

/// One simulated plant of a model. Copies go on by themselves, with the same noise.
#[pyclass(module = "tropism.models")]
pub(crate) struct Plant {
    model: AnyModel,
    plant: Box<dyn tropism::plant::Plant>,
    noise: NoiseStream,
    step: u32,
}

#[pymethods]
impl Plant {
    /// Lights a lamp, by its number or its name, for one step; returns what is seen then.
    fn advance(&mut self, light: &Bound<'_, PyAny>) -> PyResult<PyObservation> {
        let light = light_of(light, self.model.layout())?;
        self.plant.step(light, &mut self.noise.at(self.step));
        self.step += 1;
        Ok(self.seen())
    }

    /// What is seen now.
    #[getter]
    fn seen(&self) -> PyObservation {
        PyObservation(self.plant.observe())
    }

    /// Steps so far.
    #[getter]
    fn step(&self) -> u32 {
        self.step
    }

    /// Whether the model has no data where the plant is.
    #[getter]
    fn is_beyond_data(&self) -> bool {
        self.plant.is_beyond_data()
    }

    fn __copy__(&self) -> Self {
        Self { model: self.model.clone(), plant: self.plant.clone(), noise: self.noise, step: self.step }
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    fn __repr__(&self) -> String {
        let tip = self.plant.observe().tip;
        format!("Plant(step={}, x={:.3}, y={:.3})", self.step, tip.x, tip.y)
    }
}
