//! The virtual tent: its devices one by one, and episodes seen through photographs.

use std::ops::ControlFlow;
use std::time::Duration;

use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use tropism::lamps::{Layout, Light};
use tropism::observation::{Observation, Quality};
use tropism::photo::{Image, Photo};
use tropism::rig::{Camera, Clock, Flash, Lamps, Rig, RigError};
use tropism::task::{Past, Task};
use tropism::vision::VisionConfig;
use tropism_bean::tent::{Greenhouse, TentHandle};
use tropism_bean::view::CAMERA;

use crate::error::{TropismError, parsed, refused};
use crate::parts::light_of;

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
        return Err(refused(
            "found targets that are still to be drawn, wanted drawn ones; `tropism.transfer` draws them",
        ));
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
#[pyclass(unsendable, module = "tropism.loop")]
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

/// One episode.
struct Episode {
    rig: TentRig,
    past: Past,
    step: u32,
    photo: Photo,
}

/// Episodes in the virtual tent: each step is a photograph in which the tracker finds the tip.
#[pyclass(unsendable, module = "tropism._core")]
pub(crate) struct TentEpisodes {
    greenhouse: Greenhouse,
    task: Task,
    vision: VisionConfig,
    period_min: f64,
    episode: Option<Episode>,
}

impl TentEpisodes {
    fn layout(&self) -> &Layout {
        &self.greenhouse.layout
    }
}

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

#[pymethods]
impl TentEpisodes {
    #[new]
    fn new(greenhouse: &str, task: &str, vision: &str, period_min: f64) -> PyResult<Self> {
        let task = task_of(task)?;
        if task.is_in_space() {
            return Err(refused("task: found a task in space, wanted one for the front camera alone"));
        }
        let greenhouse = opened_for(&task, greenhouse)?;
        let vision = parsed("vision", vision)?;
        greenhouse.open(0, period_min, &vision).map_err(refused)?;
        Ok(Self { greenhouse, task, vision, period_min, episode: None })
    }

    /// Opens the tent with the plant of `seed`; returns (tip x, tip y, quality) of the first photograph.
    fn reset(&mut self, seed: u64) -> PyResult<(f64, f64, &'static str)> {
        let (handle, tracker) = self.greenhouse.open(seed, self.period_min, &self.vision).map_err(refused)?;
        let period = Duration::try_from_secs_f64(self.period_min * 60.0).map_err(refused)?;
        let hand = || handle.clone();
        let mut rig =
            Rig::new(hand(), hand(), hand(), hand(), tracker, period).with_layout(self.layout().clone());
        let start = Observation::simulated(self.task.start);
        let (seen, photo) = look(&mut rig, &start).map_err(broken)?;
        let found = (seen.tip.x, seen.tip.y, seen.quality.name());
        self.episode = Some(Episode { rig, past: Past::new(seen), step: 0, photo });
        Ok(found)
    }

    /// Lights a lamp for one step; returns (tip x, tip y, quality, reward, terminated, truncated).
    fn step(&mut self, action: usize) -> PyResult<(f64, f64, &'static str, f64, bool, bool)> {
        let light = Light::new(action).filter(|light| self.layout().contains(*light));
        let wanted =
            || refused(format!("found action {action}, wanted 0 to {}: a lamp", self.layout().len() - 1));
        let light = light.ok_or_else(wanted)?;
        let Some(episode) = &mut self.episode else {
            return Err(refused("found no episode, wanted `reset` first"));
        };
        episode.rig.light(Some(light)).map_err(broken)?;
        let (after, photo) = look(&mut episode.rig, &episode.past.latest).map_err(broken)?;
        let reward = self.task.step_fitness(&episode.past, &after);
        episode.step += 1;
        let terminated = self.task.is_over(0, &after);
        let truncated = !terminated && episode.step >= self.task.max_steps;
        episode.past.push(after);
        episode.photo = photo;
        let seen = &episode.past.latest;
        Ok((seen.tip.x, seen.tip.y, seen.quality.name(), reward, terminated, truncated))
    }

    /// The pixels of the last photograph: (height, width, 3); black if the camera dropped it.
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let Some(episode) = &self.episode else {
            return Err(refused("found no episode, wanted `reset` first"));
        };
        let scene = &self.greenhouse.scene;
        let (width, height) = (scene.width as usize, scene.height as usize);
        let black = || Image { width, height, rgb: vec![0; 3 * width * height] };
        let image =
            episode.photo.decode().ok().filter(|image| (image.width, image.height) == (width, height));
        pixels(py, image.unwrap_or_else(black))
    }

    #[getter]
    fn lamps(&self) -> Vec<String> {
        self.layout().lamps().iter().map(|lamp| lamp.name.clone()).collect()
    }

    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.greenhouse.scene.width, self.greenhouse.scene.height)
    }

    #[getter]
    fn best_fitness(&self) -> Option<f64> {
        self.task.best_fitness()
    }
}
