//! The closed loop with parts of the core or of Python, and evolution on any of them.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::rc::Rc;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use tropism::control::Controller;
use tropism::environment;
use tropism::evolve::{Evolution, EvolutionConfig};
use tropism::geometry::{Point, Polyline};
use tropism::lamps::Layout;
use tropism::observation::{Depth, Observation};
use tropism::plant::PlantModel;
use tropism::random::{NoiseStream, Purpose};
use tropism::rig::{Rig, SideView};
use tropism::simulation::{BatchModel, Simulation};
use tropism::task::Task;
use tropism::track::Sample;
use tropism::vision::camera::stereo::{CameraPose, Side, StereoPair};
use tropism::vision::{Calibration, TipTracker, VisionConfig};
use tropism_bean::tent::Greenhouse;
use tropism_lab::ControllerSpec;

use crate::error::{TropismError, parsed, refused};
use crate::model::Model;
use crate::neat::Genome;
use crate::parts::{Device, PythonController, PythonModel, Trouble, any_task, check_period};
use crate::threads::check_fork;
use crate::track::Track;

/// Time between two looks at signals.
const LOOK: Duration = Duration::from_millis(10);

/// The controller that `value` is: the JSON of a plan's controller, or an object.
fn controller_of(
    value: &Bound<'_, PyAny>,
    task: &Task,
    layout: &Layout,
    period_min: f64,
    trouble: &Trouble,
) -> PyResult<Box<dyn Controller>> {
    let Ok(json) = value.extract::<String>() else {
        return Ok(Box::new(PythonController::of(value, layout, trouble)));
    };
    let spec: ControllerSpec = parsed("controller", &json)?;
    spec.check(layout, period_min).map_err(refused)?;
    Ok(spec.build(task, layout, period_min))
}

/// A controller of the core, decided by hand: greedy, periodic, an evolved network or a tuned rule.
#[pyclass(module = "tropism.loop")]
pub(crate) struct Decider(Mutex<Box<dyn Controller + Send>>);

#[pymethods]
impl Decider {
    /// `controller`, `task` and `layout` are JSON.
    #[new]
    fn new(controller: &str, task: &str, layout: &str, period_min: f64) -> PyResult<Self> {
        let spec: ControllerSpec = parsed("controller", controller)?;
        let layout: Layout = parsed("layout", layout)?;
        spec.check(&layout, period_min).map_err(refused)?;
        if spec.champion().is_some_and(|champion| !champion.dimming.is_switch()) {
            return Err(refused(
                "found a network that dims lamps, wanted one that lights one lamp at full power",
            ));
        }
        Ok(Self(Mutex::new(spec.build(&parsed::<Task>("task", task)?, &layout, period_min))))
    }

    /// The lamp for what is seen now. Called once a step, in order: a controller may remember.
    #[pyo3(signature = (x, y, stem=None, z=None))]
    fn decide(&mut self, x: f64, y: f64, stem: Option<Vec<[f64; 2]>>, z: Option<f64>) -> usize {
        let points = |stem: Vec<[f64; 2]>| Polyline(stem.into_iter().map(Point::from).collect());
        let depth = z.map(|tip_cm| Depth { tip_cm, stem_cm: Vec::new() });
        let seen = Observation { stem: stem.map(points), depth, ..Observation::simulated(Point::new(x, y)) };
        let controller = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        controller.decide(&seen).index()
    }
}

/// What a loop made: its track and its fitness.
fn finished(track: tropism::track::Track, task: &Task, trouble: &Trouble) -> PyResult<(Track, f64)> {
    trouble.take()?;
    let fitness = task.fitness(&track);
    trouble.take()?;
    Ok((Track(track), fitness))
}

/// The model that `value` is: an object of Python, under the lamps of `layout` (JSON).
fn python_model(value: &Bound<'_, PyAny>, layout: &str, trouble: &Trouble) -> PyResult<PythonModel> {
    PythonModel::of(value, parsed("layout", layout)?, trouble)
}

/// Steers plant number `episode` of a model under `seed`; returns the track and the fitness.
#[pyfunction]
pub(crate) fn simulate_loop(
    py: Python<'_>,
    model: &Bound<'_, PyAny>,
    controller: &Bound<'_, PyAny>,
    task: &Bound<'_, PyAny>,
    layout: &str,
    seed: u64,
    episode: u32,
) -> PyResult<(Track, f64)> {
    let trouble = Trouble::default();
    let task = any_task(task, &trouble)?;
    let noise = NoiseStream::new(seed, Purpose::Trial, [episode, 0, 0]);
    match model.cast::<Model>() {
        Ok(model) => simulated(py, &model.get().0, controller, &task, noise, &trouble),
        Err(_) => {
            let model = python_model(model, layout, &trouble)?;
            simulated(py, &model, controller, &task, noise, &trouble)
        }
    }
}

/// The track and the fitness of a plant of `model`.
fn simulated<M: PlantModel>(
    py: Python<'_>,
    model: &M,
    controller: &Bound<'_, PyAny>,
    task: &Task,
    noise: NoiseStream,
    trouble: &Trouble,
) -> PyResult<(Track, f64)> {
    let mut controller = controller_of(controller, task, model.layout(), model.period_min(), trouble)?;
    let mut world = Simulation::new(model, task, noise);
    let watch = &mut |_: &Sample| trouble.flow(py);
    let Ok(track) = environment::run(&mut world, &mut *controller, task, watch);
    finished(track, task, trouble)
}

/// Steers the virtual bean of `seed` without photographs; returns the track and the fitness.
#[pyfunction]
pub(crate) fn grow_loop(
    py: Python<'_>,
    greenhouse: &str,
    controller: &Bound<'_, PyAny>,
    task: &Bound<'_, PyAny>,
    seed: u64,
    period_min: f64,
) -> PyResult<(Track, f64)> {
    let trouble = Trouble::default();
    let task = any_task(task, &trouble)?;
    check_period(period_min)?;
    let greenhouse: Greenhouse = parsed("greenhouse", greenhouse)?;
    let greenhouse = greenhouse.for_task(&task).among(&task.solids());
    greenhouse.check().map_err(refused)?;
    let mut controller = controller_of(controller, &task, &greenhouse.layout, period_min, &trouble)?;
    let trial = greenhouse.trial(period_min);
    let track = trial.grow(seed, &mut *controller, &task, &mut |_| trouble.flow(py));
    finished(track, &task, &trouble)
}

/// A second camera at the side of the plant.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SideCamera<'py> {
    camera: Bound<'py, PyAny>,
    /// JSON.
    calibration: String,
    /// JSON.
    vision: String,
    /// Distances of the front camera and of this one from the plant, in cm.
    distances_cm: (f64, f64),
    /// left or right.
    stands: String,
}

/// Closes the loop over devices of Python; returns the track and the fitness.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn rig_loop<'py>(
    py: Python<'py>,
    camera: Bound<'py, PyAny>,
    lamps: Bound<'py, PyAny>,
    flash: Bound<'py, PyAny>,
    clock: Bound<'py, PyAny>,
    calibration: &str,
    vision: &str,
    layout: &str,
    period_min: f64,
    controller: &Bound<'py, PyAny>,
    task: &Bound<'py, PyAny>,
    side: Option<SideCamera<'py>>,
) -> PyResult<(Track, f64)> {
    let trouble = Trouble::default();
    let task = any_task(task, &trouble)?;
    check_period(period_min)?;
    if task.is_in_space() && side.is_none() {
        return Err(refused("a task in space needs a second camera (`side`)"));
    }
    let layout: Layout = parsed("layout", layout)?;
    let calibration: Calibration = parsed("calibration", calibration)?;
    let vision: VisionConfig = parsed("vision", vision)?;
    let front = calibration;
    let tracker = TipTracker::new(calibration, vision).map_err(refused)?.with_period(period_min);
    let mut controller = controller_of(controller, &task, &layout, period_min, &trouble)?;
    let period = Duration::try_from_secs_f64(period_min * 60.0).map_err(refused)?;
    let (names, now_s) = (Rc::new(layout.clone()), Rc::new(RefCell::new(0.0)));
    let device = |object: Bound<'py, PyAny>| Device {
        object: object.unbind(),
        layout: Rc::clone(&names),
        trouble: trouble.clone(),
        now_s: Rc::clone(&now_s),
    };
    let side = side.map(|side| -> PyResult<SideView> {
        let calibration: Calibration = parsed("side.calibration", &side.calibration)?;
        let vision: VisionConfig = parsed("side.vision", &side.vision)?;
        let views = StereoPair {
            front: CameraPose::new(&front, side.distances_cm.0),
            side: CameraPose::new(&calibration, side.distances_cm.1),
            side_from: match side.stands.as_str() {
                "left" => Side::Left,
                "right" => Side::Right,
                other => return Err(refused(format!("side.stands: found {other:?}, wanted left or right"))),
            },
        };
        let tracker = TipTracker::new(calibration, vision).map_err(refused)?.with_period(period_min);
        Ok(SideView::new(Box::new(device(side.camera)), tracker, views))
    });
    let side = side.transpose()?;
    let (camera, lamps, flash, clock) = (device(camera), device(lamps), device(flash), device(clock));
    let mut rig = Rig::new(camera, lamps, flash, clock, tracker, period).with_layout(layout).with_side(side);
    let track = environment::run(&mut rig, &mut *controller, &task, &mut |_| trouble.flow(py));
    let closed = rig.close();
    trouble.take()?;
    let track = track.map_err(|error| TropismError::new_err(error.to_string()))?;
    closed.map_err(|error| TropismError::new_err(error.to_string()))?;
    finished(track, &task, &trouble)
}

/// The best genome of a run, its fitness and the statistics of its generations (JSON).
type EvolvedRun = (Genome, f64, String);

/// Evolves networks for a task on a model, either of which may be of Python.
#[pyfunction]
pub(crate) fn evolve_loop(
    py: Python<'_>,
    model: &Bound<'_, PyAny>,
    task: &Bound<'_, PyAny>,
    config: &str,
    layout: &str,
    seed: u64,
) -> PyResult<Vec<EvolvedRun>> {
    check_fork()?;
    let trouble = Trouble::default();
    let task = any_task(task, &trouble)?;
    let config: EvolutionConfig = parsed("config", config)?;
    match model.cast::<Model>() {
        Ok(model) => evolved(py, &model.get().0, &task, config, seed, &trouble),
        Err(_) => evolved(py, &python_model(model, layout, &trouble)?, &task, config, seed, &trouble),
    }
}

/// The runs of an evolution on `model`.
fn evolved<M: BatchModel>(
    py: Python<'_>,
    model: &M,
    task: &Task,
    config: EvolutionConfig,
    seed: u64,
    trouble: &Trouble,
) -> PyResult<Vec<EvolvedRun>> {
    let evolution = Evolution::new(model, task, config, seed).map_err(refused)?;
    let watch = |_, _: &_| {
        if trouble.is_there() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let runs = std::thread::scope(|scope| {
        let worker = scope.spawn(|| evolution.evolve(&watch));
        // Signals reach the thread that called, and only while it holds the lock.
        while !worker.is_finished() {
            let _ = trouble.flow(py);
            py.detach(|| std::thread::sleep(LOOK));
        }
        worker.join()
    });
    let runs = runs.unwrap_or_else(|panic| std::panic::resume_unwind(panic)).map_err(refused)?;
    trouble.take()?;
    let runs = runs.ok_or_else(|| refused("found an evolution that was broken off"))?;
    runs.into_iter()
        .map(|run| {
            let (genome, fitness) = run.champion().ok_or_else(|| refused("found no generation"))?;
            let history = serde_json::to_string(&run.history).map_err(refused)?;
            Ok((Genome(genome.clone()), fitness, history))
        })
        .collect()
}
