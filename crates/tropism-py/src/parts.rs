//! Parts of the loop that are written in Python: plant models, tasks, controllers and devices.
//!
//! The traits of the core cannot fail, Python can: the first exception is kept in a [`Trouble`], which ends the loop and is
//! raised at its end.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tropism::control::Controller;
use tropism::geometry::{Point, Polyline};
use tropism::lamps::{Layout, Light};
use tropism::observation::Observation;
use tropism::photo::Photo;
use tropism::plant::PlantModel;
use tropism::random::StepNoise;
use tropism::rig::{Camera, Clock, Flash, Lamps, RigError};
use tropism::simulation::BatchModel;
use tropism::task::{Past, Score, Task};

use crate::error::refused;
use crate::tent::task_of;

/// The first exception of Python parts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trouble(Arc<Mutex<Option<PyErr>>>);

impl Trouble {
    pub(crate) fn keep(&self, error: PyErr) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    /// The value; of an exception, which is kept, the one instead.
    fn value_or<T>(&self, value: PyResult<T>, instead: T) -> T {
        value.unwrap_or_else(|error| {
            self.keep(error);
            instead
        })
    }

    pub(crate) fn is_there(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// The kept exception, once.
    pub(crate) fn take(&self) -> PyResult<()> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
    }

    /// Breaks off at an exception, or at a signal.
    pub(crate) fn flow(&self, py: Python<'_>) -> ControlFlow<()> {
        if let Err(error) = py.check_signals() {
            self.keep(error);
        }
        if self.is_there() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// What is seen of a plant at one step.
#[pyclass(frozen, name = "Observation", module = "tropism.loop")]
pub(crate) struct PyObservation(pub(crate) Observation);

#[pymethods]
impl PyObservation {
    #[getter]
    fn x(&self) -> f64 {
        self.0.tip.x
    }

    #[getter]
    fn y(&self) -> f64 {
        self.0.tip.y
    }

    #[getter]
    fn tip(&self) -> (f64, f64) {
        (self.0.tip.x, self.0.tip.y)
    }

    #[getter]
    fn stem<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(stem) = &self.0.stem else { return Ok(None) };
        let points: Vec<Vec<f64>> = stem.0.iter().map(|point| vec![point.x, point.y]).collect();
        PyArray2::from_vec2(py, &points).map(Some).map_err(refused)
    }

    #[getter]
    fn z(&self) -> Option<f64> {
        self.0.depth.as_ref().map(|depth| depth.tip_cm)
    }

    #[getter]
    fn stem_in_space<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(stem) = self.0.stem_in_space() else { return Ok(None) };
        let points: Vec<Vec<f64>> = stem.iter().map(|point| point.to_vec()).collect();
        PyArray2::from_vec2(py, &points).map(Some).map_err(refused)
    }

    #[getter]
    fn quality(&self) -> &'static str {
        self.0.quality.name()
    }

    fn __repr__(&self) -> String {
        format!(
            "Observation(x={:.3}, y={:.3}, quality={:?})",
            self.0.tip.x,
            self.0.tip.y,
            self.0.quality.name()
        )
    }
}

/// Standard normal and uniform draws of one step of one plant.
#[pyclass(module = "tropism.loop")]
pub(crate) struct Noise(StepNoise);

#[pymethods]
impl Noise {
    fn normal(&mut self) -> f64 {
        self.0.normal()
    }

    fn uniform(&mut self) -> f64 {
        self.0.uniform()
    }
}

/// Checks the minutes from one step to the next.
pub(crate) fn check_period(period_min: f64) -> PyResult<()> {
    if (0.01..=1440.0).contains(&period_min) {
        return Ok(());
    }
    Err(refused(format!("found period_min {period_min}, wanted 0.01 to 1440")))
}

/// An observation in Python's words, in finite numbers: (x, y), or (x, y, stem) with a stem of points from the base up, in cm.
fn observation_of(value: &Bound<'_, PyAny>) -> PyResult<Observation> {
    let seen = any_observation(value)?;
    let points = seen.stem.iter().flat_map(|stem| &stem.0);
    if points.chain([&seen.tip]).all(|point| point.x.is_finite() && point.y.is_finite()) {
        return Ok(seen);
    }
    Err(refused(format!(
        "found an observation with a tip at {}, {} cm, wanted finite numbers",
        seen.tip.x, seen.tip.y
    )))
}

fn any_observation(value: &Bound<'_, PyAny>) -> PyResult<Observation> {
    if let Ok(seen) = value.cast::<PyObservation>() {
        return Ok(seen.get().0.clone());
    }
    if let Ok((x, y)) = value.extract::<(f64, f64)>() {
        return Ok(Observation::simulated(Point::new(x, y)));
    }
    let wanted = |_| refused("an observation is (x, y) or (x, y, stem), in cm");
    let (x, y, stem) = value.extract::<(f64, f64, Vec<(f64, f64)>)>().map_err(wanted)?;
    let stem = Polyline(stem.into_iter().map(|(x, y)| Point::new(x, y)).collect());
    Ok(Observation { stem: Some(stem), ..Observation::simulated(Point::new(x, y)) })
}

/// The lamp that Python names by its number or its name.
pub(crate) fn light_of(value: &Bound<'_, PyAny>, layout: &Layout) -> PyResult<Light> {
    if let Ok(name) = value.extract::<String>() {
        return layout
            .parse(&name)
            .map_err(refused)?
            .ok_or_else(|| refused("found light dark, wanted a lamp"));
    }
    let number: usize = value.extract()?;
    Light::new(number).filter(|light| layout.contains(*light)).ok_or_else(|| {
        refused(format!("found light {number}, wanted 0 to {}, the number of a lamp", layout.len() - 1))
    })
}

/// A task: of the JSON of a task file, or a subclass of `tropism.loop.Task`.
pub(crate) fn any_task(value: &Bound<'_, PyAny>, trouble: &Trouble) -> PyResult<Task> {
    if let Ok(json) = value.extract::<String>() {
        return task_of(&json);
    }
    let point = |(x, y): (f64, f64)| Point::new(x, y);
    let score = PythonScore { object: value.clone().unbind(), trouble: trouble.clone() };
    Ok(Task {
        start: point(value.getattr("start")?.extract()?),
        targets: value.getattr("targets")?.extract::<Vec<(f64, f64)>>()?.into_iter().map(point).collect(),
        ..Task::new(score)
    })
}

/// The score of a task in Python.
#[derive(Debug)]
struct PythonScore {
    object: Py<PyAny>,
    trouble: Trouble,
}

impl Score for PythonScore {
    fn is_over(&self, _task: &Task, step: u32, seen: &Observation) -> bool {
        if self.trouble.is_there() {
            return true;
        }
        Python::attach(|py| {
            let call = || {
                self.object.bind(py).call_method1("is_over", (step, PyObservation(seen.clone())))?.is_truthy()
            };
            self.trouble.value_or(call(), true)
        })
    }

    fn step_fitness(&self, _task: &Task, past: &Past, after: &Observation) -> f64 {
        if self.trouble.is_there() {
            return 0.0;
        }
        Python::attach(|py| {
            let seen = |seen: &Observation| PyObservation(seen.clone());
            let call = || {
                let seen = (seen(&past.first), seen(&past.latest), seen(after));
                let value = self.object.bind(py).call_method1("step_fitness", seen)?.extract::<f64>()?;
                let refusal = || refused(format!("found a step_fitness of {value}, wanted a finite number"));
                Some(value).filter(|value| value.is_finite()).ok_or_else(refusal)
            };
            self.trouble.value_or(call(), 0.0)
        })
    }
}

/// A plant model in Python: a subclass of `tropism.loop.PlantModel`.
pub(crate) struct PythonModel {
    object: Py<PyAny>,
    layout: Layout,
    period_min: f64,
    trouble: Trouble,
}

impl PythonModel {
    pub(crate) fn of(value: &Bound<'_, PyAny>, layout: Layout, trouble: &Trouble) -> PyResult<Self> {
        let period_min = value.getattr("period_min")?.extract()?;
        Ok(Self { object: value.clone().unbind(), layout, period_min, trouble: trouble.clone() })
    }
}

impl PlantModel for PythonModel {
    type Plant = Arc<Py<PyAny>>;

    fn seedling(&self, start: Point, noise: &mut StepNoise) -> Self::Plant {
        Python::attach(|py| {
            let arguments = ((start.x, start.y), Noise(noise.clone()));
            let plant = self.object.bind(py).call_method1("seedling", arguments).map(Bound::unbind);
            Arc::new(self.trouble.value_or(plant, py.None()))
        })
    }

    fn step(&self, plant: &mut Self::Plant, light: Light, noise: &mut StepNoise) {
        if self.trouble.is_there() {
            return;
        }
        Python::attach(|py| {
            let arguments = (plant.bind(py), light.index(), Noise(noise.clone()));
            let call = || {
                let next = self.object.bind(py).call_method1("step", arguments)?;
                if next.is_none() {
                    return Err(refused("step returned None, and not the plant after the step"));
                }
                Ok(Arc::new(next.unbind()))
            };
            *plant = self.trouble.value_or(call(), plant.clone());
        });
    }

    fn observe(&self, plant: &Self::Plant) -> Observation {
        let nothing = Observation::simulated(Point::new(0.0, 0.0));
        if self.trouble.is_there() {
            return nothing;
        }
        Python::attach(|py| {
            let call = || observation_of(&self.object.bind(py).call_method1("observe", (plant.bind(py),))?);
            self.trouble.value_or(call(), nothing)
        })
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn period_min(&self) -> f64 {
        self.period_min
    }
}

impl BatchModel for PythonModel {}

/// A controller in Python: a subclass of `tropism.loop.Controller`.
pub(crate) struct PythonController {
    object: Py<PyAny>,
    layout: Layout,
    trouble: Trouble,
}

impl PythonController {
    pub(crate) fn of(value: &Bound<'_, PyAny>, layout: &Layout, trouble: &Trouble) -> Self {
        Self { object: value.clone().unbind(), layout: layout.clone(), trouble: trouble.clone() }
    }
}

impl Controller for PythonController {
    fn decide(&mut self, seen: &Observation) -> Light {
        if self.trouble.is_there() {
            return Light::LEFT;
        }
        Python::attach(|py| {
            let call = || {
                let light = self.object.bind(py).call_method1("decide", (PyObservation(seen.clone()),))?;
                light_of(&light, &self.layout)
            };
            self.trouble.value_or(call(), Light::LEFT)
        })
    }

    fn miss(&mut self, steps: u32) {
        Python::attach(|py| {
            let answer = self.object.bind(py).call_method1("miss", (steps,)).map(|_| ());
            self.trouble.value_or(answer, ());
        });
    }
}

/// A device in Python; its methods are those of the base class in `tropism.loop`.
pub(crate) struct Device {
    pub(crate) object: Py<PyAny>,
    pub(crate) layout: Rc<Layout>,
    pub(crate) trouble: Trouble,
    /// The time at which the clock stands, in s.
    pub(crate) now_s: Rc<RefCell<f64>>,
}

impl Device {
    fn failed(&self, what: &str, error: PyErr) -> RigError {
        let problem = error.to_string();
        self.trouble.keep(error);
        RigError::Device { device: what.to_owned(), problem }
    }
}

impl Camera for Device {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let call = |py: Python<'_>| {
            let bytes = self.object.bind(py).call_method0("photograph")?;
            bytes.cast::<PyBytes>().map(|bytes| bytes.as_bytes().to_vec()).map_err(PyErr::from)
        };
        let bytes = Python::attach(call).map_err(|error| self.failed("camera", error))?;
        Ok(Photo { name: String::new(), bytes, time_s: *self.now_s.borrow() })
    }

    fn can_repeat(&self) -> bool {
        let call = |py: Python<'_>| self.object.bind(py).call_method0("can_repeat")?.is_truthy();
        self.trouble.value_or(Python::attach(call), false)
    }
}

impl Lamps for Device {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        let name = light.map(|light| self.layout.name(Some(light)));
        let call = |py: Python<'_>| self.object.bind(py).call_method1("light", (name,)).map(|_| ());
        Python::attach(call).map_err(|error| self.failed("lamps", error))
    }
}

impl Flash for Device {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        let call = |py: Python<'_>| self.object.bind(py).call_method1("flash", (is_on,)).map(|_| ());
        Python::attach(call).map_err(|error| self.failed("flash", error))
    }
}

impl Clock for Device {
    fn wait_until(
        &mut self,
        since_start: Duration,
        _meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        *self.now_s.borrow_mut() = since_start.as_secs_f64();
        Python::attach(|py| {
            let answer = self.object.bind(py).call_method1("wait_until", (since_start.as_secs_f64(),));
            self.trouble.value_or(answer.map(|_| ()), ());
            self.trouble.flow(py)
        })
    }
}

/// The rows of a stem, or NaN where there is none: (rows, 2 points).
pub(crate) fn stems<'py>(
    py: Python<'py>,
    stems: &[Option<&Polyline>],
    points: usize,
) -> Bound<'py, numpy::PyArray3<f64>> {
    let mut array = numpy::ndarray::Array3::from_elem((stems.len(), points, 2), f64::NAN);
    for (row, stem) in stems.iter().enumerate() {
        for (place, point) in stem.iter().flat_map(|stem| &stem.0).take(points).enumerate() {
            array[[row, place, 0]] = point.x;
            array[[row, place, 1]] = point.y;
        }
    }
    array.into_pyarray(py)
}
