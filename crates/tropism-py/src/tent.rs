//! The virtual tent: its devices one by one, and episodes seen through photographs.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use numpy::ndarray::{Array1, Array2, Array3, Array4};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArray4};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tropism::lamps::Light;
use tropism::observation::{Observation, Quality};
use tropism::photo::{Image, Photo};
use tropism::rig::{Camera, Clock, Flash, Lamps, Rig, RigError};
use tropism::task::{Past, Task};
use tropism::vision::VisionConfig;
use tropism_bean::tent::{Greenhouse, TentHandle};
use tropism_bean::view::CAMERA;

use crate::error::{TropismError, parsed, refused};
use crate::parts::{check_period, light_of};
use crate::threads::check_fork;

/// The pixels of an image: (height, width, 3).
pub(crate) fn pixels(py: Python<'_>, image: Image) -> PyResult<Bound<'_, PyArray3<u8>>> {
    let shape = (image.height, image.width, 3);
    Ok(Array3::from_shape_vec(shape, image.rgb).map_err(refused)?.into_pyarray(py))
}

/// The pixels of a JPEG, PNG or TIFF picture: (height, width, 3), upright.
#[pyfunction]
pub(crate) fn decode<'py>(py: Python<'py>, picture: &[u8]) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let photo = Photo { name: String::new(), bytes: picture.to_vec(), time_s: 0.0 };
    let image = py.detach(|| photo.decode()).map_err(refused)?;
    pixels(py, image)
}

/// The settings (JSON) of a greenhouse with what a task (JSON) needs: its obstacles, and in space four lamps and two cameras.
#[pyfunction]
pub(crate) fn greenhouse_for(task: &str, greenhouse: &str) -> PyResult<String> {
    serde_json::to_string(&opened_for(&task_of(task)?, greenhouse)?).map_err(refused)
}

/// A checked task of its JSON.
pub(crate) fn task_of(json: &str) -> PyResult<Task> {
    let task: Task = parsed("task", json)?;
    task.check().map_err(refused)?;
    if task.is_to_draw() {
        return Err(refused("these targets are still to be drawn; `tropism.transfer` draws them"));
    }
    Ok(task)
}

/// A checked greenhouse of its JSON, with what a task needs.
pub(crate) fn opened_for(task: &Task, greenhouse: &str) -> PyResult<Greenhouse> {
    let greenhouse: Greenhouse = parsed("greenhouse", greenhouse)?;
    let greenhouse = greenhouse.for_task(task).among(&task.solids());
    greenhouse.check().map_err(refused)?;
    Ok(greenhouse)
}

fn broken(error: RigError) -> PyErr {
    TropismError::new_err(error.to_string())
}

/// The camera, lamps, flash and clock of a virtual tent with one bean.
#[pyclass(module = "tropism.loop")]
pub(crate) struct Tent {
    handle: TentHandle,
    greenhouse: Greenhouse,
}

#[pymethods]
impl Tent {
    /// `greenhouse` and `task` are JSON, `seed` selects the plant. The tent has what the task needs: obstacles, lamps, a camera at
    /// the side.
    #[new]
    #[pyo3(signature = (greenhouse, seed, period_min, task="{}"))]
    fn new(greenhouse: &str, seed: u64, period_min: f64, task: &str) -> PyResult<Self> {
        check_period(period_min)?;
        let greenhouse = opened_for(&task_of(task)?, greenhouse)?;
        let (handle, _) = greenhouse.open(seed, period_min, &VisionConfig::default()).map_err(refused)?;
        Ok(Self { handle, greenhouse })
    }

    /// A photograph of the present moment (JPEG); empty if the camera drops it.
    fn photograph<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.handle.photograph().map_err(broken)?.bytes))
    }

    /// A photograph of this step by the camera at the side, with flash (JPEG); empty if it drops it. `None` without this camera.
    fn side_photograph<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        self.handle.side_photograph().map(|(_, bytes)| PyBytes::new(py, &bytes))
    }

    fn can_repeat(&self) -> bool {
        self.handle.can_repeat()
    }

    /// Whether all obstacles of a task (JSON) stand in it.
    fn has_solids_of(&self, task: &str) -> PyResult<bool> {
        let task: Task = parsed("task", task)?;
        Ok(task.solids().iter().all(|solid| self.greenhouse.solids.contains(solid)))
    }

    /// Lights a lamp by its name or number; None darkens all.
    fn light(&mut self, light: Option<Bound<'_, PyAny>>) -> PyResult<()> {
        let light = light.map(|light| light_of(&light, &self.greenhouse.layout)).transpose()?;
        self.handle.light(light).map_err(broken)
    }

    fn flash(&mut self, is_on: bool) -> PyResult<()> {
        self.handle.flash(is_on).map_err(broken)
    }

    /// Lets the plant grow until a time since the start, in s.
    fn wait_until(&mut self, since_start_s: f64) -> PyResult<()> {
        let until = Duration::try_from_secs_f64(since_start_s).map_err(refused)?;
        let _ = self.handle.wait_until(until, &mut || ControlFlow::Continue(()));
        Ok(())
    }

    /// Ground truth so far, as CSV. Never read by vision.
    fn truth_csv(&self) -> PyResult<String> {
        String::from_utf8(self.handle.truth_csv()).map_err(refused)
    }

    /// How its photographs map to centimetres, as JSON.
    fn calibration(&self) -> PyResult<String> {
        serde_json::to_string(&self.greenhouse.calibration()).map_err(refused)
    }

    /// How its photographs are read, as JSON: with its region of interest, and its obstacles.
    fn vision(&self) -> PyResult<String> {
        serde_json::to_string(&self.greenhouse.vision(&VisionConfig::default())).map_err(refused)
    }

    /// Distance of its cameras from the plant, in cm.
    #[getter]
    fn camera_distance_cm(&self) -> f64 {
        CAMERA[2]
    }

    #[getter]
    fn lamps(&self) -> Vec<String> {
        self.greenhouse.layout.lamps().iter().map(|lamp| lamp.name.clone()).collect()
    }

    #[getter]
    fn layout(&self) -> PyResult<String> {
        serde_json::to_string(&self.greenhouse.layout).map_err(refused)
    }
}

type TentRig = Rig<TentHandle, TentHandle, TentHandle, TentHandle>;

/// Waits for the next step of a tent, and looks at its photograph. Where no plant was ever seen, `instead` is carried forward.
fn look(rig: &mut TentRig, instead: &Observation) -> Result<(Observation, Photo), RigError> {
    let step = rig.next_step();
    let _ = rig.wait_until(rig.due(step), &mut || ControlFlow::Continue(()));
    let frame = rig.photograph()?;
    let photo = frame.photo().clone();
    match rig.see(&frame) {
        Ok(seen) => Ok((seen, photo)),
        Err(RigError::NeverSeen { .. }) => {
            rig.skip_to(step + 1);
            Ok((Observation { quality: Quality::CarriedForward, ..instead.clone() }, photo))
        }
        Err(error) => Err(error),
    }
}

/// What all episodes of a batch of tents share.
struct Tents {
    greenhouse: Greenhouse,
    task: Task,
    vision: VisionConfig,
    period_min: f64,
}

impl Tents {
    /// Opens the tent with the plant of `seed`.
    fn begin(&self, seed: u64) -> Result<(Episode, Report), String> {
        let text = |error: &dyn std::fmt::Display| error.to_string();
        let opened = self.greenhouse.open(seed, self.period_min, &self.vision);
        let (handle, tracker) = opened.map_err(|error| text(&error))?;
        let period = Duration::try_from_secs_f64(self.period_min * 60.0).map_err(|error| text(&error))?;
        let hand = || handle.clone();
        let layout = self.greenhouse.layout.clone();
        let mut rig = Rig::new(hand(), hand(), hand(), hand(), tracker, period).with_layout(layout);
        let start = Observation::simulated(self.task.start);
        let (seen, photo) = look(&mut rig, &start).map_err(|error| text(&error))?;
        let report = self.report(&seen, &photo, 0.0, false, false);
        Ok((Episode { rig, past: Past::new(seen), step: 0 }, report))
    }

    /// Lights a lamp for one step.
    fn step(&self, episode: &mut Episode, light: Light) -> Result<Report, String> {
        let text = |error: RigError| error.to_string();
        episode.rig.light(Some(light)).map_err(text)?;
        let (after, photo) = look(&mut episode.rig, &episode.past.latest).map_err(text)?;
        let reward = self.task.step_fitness(&episode.past, &after);
        episode.step += 1;
        let terminated = self.task.is_over(0, &after);
        let truncated = !terminated && episode.step >= self.task.max_steps;
        episode.past.push(after);
        Ok(self.report(&episode.past.latest, &photo, reward, terminated, truncated))
    }

    fn report(
        &self,
        seen: &Observation,
        photo: &Photo,
        reward: f64,
        terminated: bool,
        truncated: bool,
    ) -> Report {
        let scene = &self.greenhouse.scene;
        let (width, height) = (scene.width as usize, scene.height as usize);
        let image = photo.decode().ok().filter(|image| (image.width, image.height) == (width, height));
        // Black if the camera dropped it.
        let rgb = image.map_or_else(|| vec![0; 3 * width * height], |image| image.rgb);
        Report { seen: (seen.tip.x, seen.tip.y, seen.quality.name()), reward, terminated, truncated, rgb }
    }
}

/// One episode.
struct Episode {
    rig: TentRig,
    past: Past,
    step: u32,
}

/// What a step of an episode gave.
struct Report {
    seen: (f64, f64, &'static str),
    reward: f64,
    terminated: bool,
    truncated: bool,
    /// Pixels of the photograph.
    rgb: Vec<u8>,
}

/// What a worker is to do with the tent at a place.
#[derive(Clone, Copy)]
enum Order {
    Begin(u64),
    Step(Light),
}

/// What tents reported, each with its number.
type Reports = Vec<(usize, Result<Report, String>)>;

/// A thread with some of the tents: a rig stays on the thread on which it was opened.
struct Worker {
    orders: Sender<Vec<(usize, Order)>>,
    reports: Mutex<Receiver<Reports>>,
}

impl Worker {
    fn new(tents: Arc<Tents>) -> Self {
        let (orders, to_do) = channel::<Vec<(usize, Order)>>();
        let (done, reports) = channel();
        std::thread::spawn(move || {
            let mut episodes: BTreeMap<usize, Episode> = BTreeMap::new();
            let mut work = |(place, order): (usize, Order)| {
                let report = match order {
                    Order::Begin(seed) => tents.begin(seed).map(|(episode, report)| {
                        episodes.insert(place, episode);
                        report
                    }),
                    Order::Step(light) => match episodes.get_mut(&place) {
                        Some(episode) => tents.step(episode, light),
                        None => Err(format!("tent {place}: no episode has begun: call reset before step")),
                    },
                };
                (place, report)
            };
            // It ends with the batch, whose end of the channel is then gone.
            for orders in to_do {
                let _ = done.send(orders.into_iter().map(&mut work).collect());
            }
        });
        Self { orders, reports: Mutex::new(reports) }
    }
}

/// Arrays of some tents: pictures, tips, qualities, rewards, terminated, truncated.
type TentSteps<'py> = (
    Bound<'py, PyArray4<u8>>,
    Bound<'py, PyArray2<f64>>,
    Vec<&'static str>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
);

/// Episodes in virtual tents side by side: each step is a photograph in which the tracker finds the tip.
#[pyclass(module = "tropism._core")]
pub(crate) struct TentBatch {
    tents: Arc<Tents>,
    workers: Vec<Worker>,
    count: usize,
}

impl TentBatch {
    /// Gives the orders to the workers that have these tents, and waits for all.
    fn work<'py>(&mut self, py: Python<'py>, orders: &[(usize, Order)]) -> PyResult<TentSteps<'py>> {
        check_fork()?;
        if self.workers.is_empty() {
            let threads = std::thread::available_parallelism().map_or(1, NonZero::get).min(self.count);
            self.workers.extend((0..threads).map(|_| Worker::new(Arc::clone(&self.tents))));
        }
        let count = self.workers.len();
        let mut reports: BTreeMap<usize, Result<Report, String>> = BTreeMap::new();
        let gone = || TropismError::new_err("a thread with virtual tents ended: a fault of tropism");
        let is_done = py.detach(|| {
            let shares = (0..count).map(|worker| {
                orders.iter().filter(|(place, _)| place % count == worker).copied().collect::<Vec<_>>()
            });
            let sent =
                self.workers.iter().zip(shares).map(|(worker, share)| worker.orders.send(share).is_ok());
            let is_sent = sent.filter(|is_sent| !is_sent).count() == 0;
            is_sent
                && self.workers.iter_mut().all(|worker| {
                    let receiver = worker.reports.get_mut().unwrap_or_else(PoisonError::into_inner);
                    receiver.recv().map(|share| reports.extend(share)).is_ok()
                })
        });
        if !is_done {
            return Err(gone());
        }
        let scene = &self.tents.greenhouse.scene;
        let shape = (orders.len(), scene.height as usize, scene.width as usize, 3);
        let mut rgb = Vec::with_capacity(shape.0 * shape.1 * shape.2 * 3);
        let (mut tips, mut qualities, mut rewards) = (Vec::new(), Vec::new(), Vec::new());
        let (mut terminated, mut truncated) = (Vec::new(), Vec::new());
        for report in reports.into_values() {
            let report = report.map_err(refused)?;
            rgb.extend(report.rgb);
            tips.extend([report.seen.0, report.seen.1]);
            qualities.push(report.seen.2);
            rewards.push(report.reward);
            terminated.push(report.terminated);
            truncated.push(report.truncated);
        }
        Ok((
            Array4::from_shape_vec(shape, rgb).map_err(refused)?.into_pyarray(py),
            Array2::from_shape_vec((orders.len(), 2), tips).map_err(refused)?.into_pyarray(py),
            qualities,
            Array1::from_vec(rewards).into_pyarray(py),
            Array1::from_vec(terminated).into_pyarray(py),
            Array1::from_vec(truncated).into_pyarray(py),
        ))
    }

    fn check_place(&self, place: usize) -> PyResult<()> {
        if place < self.count {
            return Ok(());
        }
        Err(refused(format!("found tent {place}, wanted 0 to {}", self.count - 1)))
    }
}

#[pymethods]
impl TentBatch {
    #[new]
    #[pyo3(signature = (greenhouse, task, vision, period_min, count=1))]
    fn new(greenhouse: &str, task: &str, vision: &str, period_min: f64, count: usize) -> PyResult<Self> {
        if count == 0 {
            return Err(refused("there are no tents"));
        }
        let task = task_of(task)?;
        if task.is_in_space() {
            return Err(refused("task: a task in space needs a second camera"));
        }
        let greenhouse = opened_for(&task, greenhouse)?;
        let vision = parsed("vision", vision)?;
        greenhouse.open(0, period_min, &vision).map_err(refused)?;
        let tents = Arc::new(Tents { greenhouse, task, vision, period_min });
        Ok(Self { tents, workers: Vec::new(), count })
    }

    fn __len__(&self) -> usize {
        self.count
    }

    /// Opens tents, each with the plant of its seed; what their first photographs show, in the order of the places.
    fn begin<'py>(
        &mut self,
        py: Python<'py>,
        places: Vec<usize>,
        seeds: Vec<u64>,
    ) -> PyResult<TentSteps<'py>> {
        if seeds.len() != places.len() {
            return Err(refused(format!("found {} seeds, wanted {}", seeds.len(), places.len())));
        }
        places.iter().try_for_each(|&place| self.check_place(place))?;
        let orders: Vec<_> = places.into_iter().zip(seeds.into_iter().map(Order::Begin)).collect();
        self.work(py, &orders)
    }

    /// Lights a lamp in each of the tents at `places`, for one step.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        places: Vec<usize>,
        actions: Vec<i64>,
    ) -> PyResult<TentSteps<'py>> {
        if actions.len() != places.len() {
            return Err(refused(format!("found {} actions, wanted {}", actions.len(), places.len())));
        }
        places.iter().try_for_each(|&place| self.check_place(place))?;
        let layout = &self.tents.greenhouse.layout;
        let light = |action: i64| {
            let light =
                usize::try_from(action).ok().and_then(Light::new).filter(|light| layout.contains(*light));
            let most = layout.len() - 1;
            light.ok_or_else(|| refused(format!("found action {action}, wanted 0 to {most}: a lamp")))
        };
        let lights = actions.into_iter().map(light).collect::<PyResult<Vec<_>>>()?;
        let orders: Vec<_> = places.into_iter().zip(lights.into_iter().map(Order::Step)).collect();
        self.work(py, &orders)
    }

    #[getter]
    fn lamps(&self) -> Vec<String> {
        self.tents.greenhouse.layout.lamps().iter().map(|lamp| lamp.name.clone()).collect()
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.tents.greenhouse.scene.width, self.tents.greenhouse.scene.height)
    }

    /// The task with all its keys, as JSON.
    #[getter]
    fn task(&self) -> PyResult<String> {
        serde_json::to_string(&self.tents.task).map_err(refused)
    }

    /// The lamps with their places, as JSON.
    #[getter]
    fn layout(&self) -> PyResult<String> {
        serde_json::to_string(&self.tents.greenhouse.layout).map_err(refused)
    }

    #[getter]
    fn best_fitness(&self) -> Option<f64> {
        self.tents.task.best_fitness()
    }
}
