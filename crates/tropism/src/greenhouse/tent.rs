//! The virtual tent as a rig: one bean, one camera, two lamps, a flash and a clock that jumps.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::rc::Rc;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::bean::{Bean, Species, Watcher};
use super::fault::{self, Fault, Faults, Happening, suffers};
use super::render::{Renderer, Truth};
use super::scene::Scene;
use super::view::{Frame, View};
use crate::check;
use crate::control::Controller;
use crate::environment::{Environment, run};
use crate::geometry::{Point, Region};
use crate::lamps::{Layout, Light};
use crate::observation::Observation;
use crate::photo::Photo;
use crate::rig::{Camera, Clock, Flash, Lamps, RigError};
use crate::task::Task;
use crate::track::{PAPER_PERIOD_MIN, Sample, Track};
use crate::vision::{Calibration, TipTracker, VisionConfig, VisionError};

/// A virtual tent and the plant in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Greenhouse {
    /// Individual variation: 0 for the average bean, 1 as between real plants, 2 for twice that.
    pub scale: f64,
    /// The kind of plant.
    pub bean: Species,
    /// The tent and its camera.
    pub scene: Scene,
    /// What goes wrong with its photographs, and how often.
    pub faults: Faults,
}

impl Default for Greenhouse {
    fn default() -> Self {
        Self { scale: 1.0, bean: Species::default(), scene: Scene::default(), faults: Faults::default() }
    }
}

/// How far to the side and how high a bean can reach within the picture and between the lamps, in cm.
const GROWS_TO: Point = Point::new(24.0, 40.0);

/// Where the plant begins to be looked for, in cm: above the rim and the soil.
const ABOVE_SOIL: f64 = 0.6;

/// What is true at a step, beside its photographs. Never read by vision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Witness {
    /// Number of the step, and of its photographs.
    pub step: u64,
    /// The lamp that burns while the photograph is taken.
    pub lit: Option<Light>,
    /// What goes wrong with the front camera's photograph.
    pub faults: Vec<Fault>,
    /// What goes wrong with the side camera's, where there is one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub side_faults: Vec<Fault>,
    /// The plant as the front camera sees it.
    pub front: Truth,
    /// The plant as the side camera sees it, where there is one: x is the distance behind the stem's foot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<Truth>,
}

struct Tent {
    seed: u64,
    faults: Faults,
    bean: Bean,
    renderer: Renderer,
    /// The camera at the side, where there is one.
    side: Option<Renderer>,
    lit: Option<Light>,
    has_flash: bool,
    now_min: f64,
    /// What is true at each step, by its number.
    truths: BTreeMap<u64, Witness>,
    /// The photographs of this step, in the order of [`View::BOTH`], where the next one will repeat them.
    last: [Option<Vec<u8>>; 2],
}

impl Tent {
    /// Lets the bean live until `minutes`, and notes what is true then: the times that are asked for are those of steps.
    fn advance_to(&mut self, minutes: f64) {
        if minutes > self.now_min {
            // Taken now, whether or not this step is one that is lived through again: a resumed run repeats it too.
            self.last = View::BOTH.map(|view| {
                let is_repeated = suffers(&self.happenings(view, 1), Fault::Repeated);
                if is_repeated { self.photograph(view) } else { None }
            });
            let has_failed = suffers(&self.happenings(View::Front, 0), Fault::LampFails);
            let power = |light| if self.lit == Some(light) && !has_failed { 1.0 } else { 0.0 };
            self.bean.advance(Light::BOTH.map(power), minutes - self.now_min);
            self.now_min = minutes;
        }
        self.note_truth();
    }

    fn note_truth(&mut self) {
        let (pose, step, happenings) = (self.bean.pose(), self.frame(), self.happenings(View::Front, 0));
        let faults = |happenings: &[Happening]| happenings.iter().map(|happening| happening.fault).collect();
        let side = self.side.as_ref().map(|_| self.happenings(View::Side, 0));
        let witness = Witness {
            step,
            lit: self.lit.filter(|_| !suffers(&happenings, Fault::LampFails)),
            faults: faults(&happenings),
            side_faults: side.as_deref().map_or_else(Vec::new, faults),
            front: self.renderer.truth(&pose),
            side: self.side.as_ref().map(|side| side.truth(&pose)),
        };
        self.truths.insert(step, witness);
    }

    /// Number of the photograph of this step. Its noise and its faults are named by it, so a resumed run takes the
    /// photograph that it would have taken.
    fn frame(&self) -> u64 {
        (self.now_min / PAPER_PERIOD_MIN).round() as u64
    }

    /// What goes wrong with a camera's photograph so many steps from now.
    fn happenings(&self, view: View, ahead: u64) -> Vec<Happening> {
        self.faults.before(view, self.seed, self.frame() + ahead)
    }

    /// A camera's photograph of this step with its flash; `None` where the camera gives none, or there is no such camera.
    fn photograph(&mut self, view: View) -> Option<Vec<u8>> {
        let (happenings, pose, frame) = (self.happenings(view, 0), self.bean.pose(), self.frame());
        let renderer = match view {
            View::Front => &mut self.renderer,
            View::Side => self.side.as_mut()?,
        };
        let last = self.last[view as usize].as_deref();
        fault::photograph(renderer, &happenings, &pose, self.lit, frame, last)
    }
}

/// A hand on the virtual tent: camera, lamps, flash and clock are all the same tent.
#[derive(Clone)]
pub struct Device(Rc<RefCell<Tent>>);

impl Greenhouse {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// A line that names the key, its value and its range.
    pub fn check(&self) -> Result<(), String> {
        check::within("greenhouse.scale", self.scale, 0.0..=2.0).map_err(|error| error.to_string())?;
        self.bean.check().map_err(|error| format!("greenhouse.bean: {error}"))?;
        self.scene.check().map_err(|error| format!("greenhouse.scene: {error}"))?;
        self.faults.check().map_err(|error| format!("greenhouse.faults: {error}"))
    }

    /// How this tent's photographs map to centimetres: the same for both cameras, whose centimetres are those of the plane
    /// through the plant's foot that each of them faces.
    #[must_use]
    pub fn calibration(&self) -> Calibration {
        let frame = Frame::new(self.scene.width, self.scene.height);
        let (width, height) = (self.scene.width as usize, self.scene.height as usize);
        Calibration::from_scale(frame.pixel(Point::new(0.0, 0.0)), frame.px_per_cm, width, height)
    }

    /// The part of the photographs in which the plant may be: above the pot, between the lamps.
    #[must_use]
    pub fn crop(&self) -> Region {
        let calibration = self.calibration();
        let corner = |x, y| calibration.pixel(Point::new(x, y));
        let (top, bottom) = (corner(-GROWS_TO.x, GROWS_TO.y), corner(GROWS_TO.x, ABOVE_SOIL));
        let whole = |value: f64, most: usize| (value.max(0.0) as usize).min(most);
        let (x, y) = (whole(top.x, calibration.width), whole(top.y, calibration.height));
        Region {
            x,
            y,
            width: whole(bottom.x, calibration.width) - x,
            height: whole(bottom.y, calibration.height) - y,
        }
    }

    /// The tent with the plant of `seed`: a hand on it, and a tracker for its photographs. Where `vision` has no crop it is
    /// given [`Self::crop`].
    ///
    /// # Errors
    /// [`VisionError`] if `vision` is out of range for this tent's photographs.
    pub fn open(&self, seed: u64, vision: &VisionConfig) -> Result<(Device, TipTracker), VisionError> {
        let vision = VisionConfig { crop: vision.crop.or_else(|| Some(self.crop())), ..vision.clone() };
        Ok((self.device(seed), TipTracker::new(self.calibration(), vision)?))
    }

    /// A hand on the tent with the plant of `seed`.
    fn device(&self, seed: u64) -> Device {
        let mut tent = Tent {
            seed,
            faults: self.faults.clone(),
            bean: Bean::new(self.bean.draw(seed, self.scale), seed),
            renderer: Renderer::new(&self.scene, seed),
            side: (self.scene.cameras > 1).then(|| Renderer::at(View::Side, &self.scene, seed)),
            lit: None,
            has_flash: false,
            now_min: 0.0,
            truths: BTreeMap::new(),
            last: [None, None],
        };
        // The first step is one even if a resumed run does not photograph it again.
        tent.note_truth();
        Device(Rc::new(RefCell::new(tent)))
    }

    /// Grows the plant of `seed` under `controller` until `task` is over or `watch` breaks off: [`grow`](super::bean::grow) in a
    /// tent with cameras. Its tip is placed as there, by the paper's detector without a photograph, and where no lamp fails
    /// its track is the same. `watch` sees each sample, and may have the photographs of its step taken by the hand on the
    /// tent.
    pub fn grow(
        &self,
        seed: u64,
        controller: &mut (impl Controller + ?Sized),
        task: &(impl Task + ?Sized),
        watch: &mut dyn FnMut(&Sample, &Device) -> ControlFlow<()>,
    ) -> Track {
        let device = self.device(seed);
        let mut growing = Growing {
            layout: Layout::default(),
            device: device.clone(),
            watcher: Watcher::of(seed),
            step: 0,
        };
        let Ok(track) = run(&mut growing, controller, task, &mut |sample| watch(sample, &device));
        growing.watcher.complete(track)
    }
}

/// A plant that is watched without photographs.
struct Growing {
    layout: Layout,
    device: Device,
    watcher: Watcher,
    step: u32,
}

impl Environment for Growing {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        let tent = &mut *self.device.0.borrow_mut();
        tent.advance_to(f64::from(self.step) * PAPER_PERIOD_MIN);
        Ok(self.watcher.observe(&tent.bean))
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        self.device.0.borrow_mut().lit = Some(light);
        self.step += 1;
        Ok(())
    }

    fn period_min(&self) -> f64 {
        PAPER_PERIOD_MIN
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }
}

impl Device {
    /// What was true at each step so far, as CSV with one row a step. Never read by vision.
    #[must_use]
    pub fn truth_csv(&self) -> Vec<u8> {
        let mut text = "step,top_x_cm,top_y_cm,apex_x_cm,apex_y_cm\n".to_owned();
        for Witness { step, front: Truth { top, apex, .. }, .. } in self.0.borrow().truths.values() {
            text += &format!("{step},{:.4},{:.4},{:.4},{:.4}\n", top.x, top.y, apex.x, apex.y);
        }
        text.into_bytes()
    }

    /// All that was true at each step so far, as JSON with one [`Witness`] a line. Never read by vision.
    ///
    /// # Panics
    /// Never: a witness is plain data.
    #[must_use]
    pub fn truth_json(&self) -> Vec<u8> {
        let mut text = String::new();
        for witness in self.0.borrow().truths.values() {
            text += &serde_json::to_string(witness).expect("plain data");
            text.push('\n');
        }
        text.into_bytes()
    }

    /// The bytes of this step's photograph from the front, with the flash: none where the camera gives none.
    #[must_use]
    pub fn front_photograph(&self) -> Vec<u8> {
        self.0.borrow_mut().photograph(View::Front).unwrap_or_default()
    }

    /// Number and bytes of this step's photograph from the side, where there is a camera: with the flash, and with the
    /// faults of that camera. No bytes where it gives none.
    #[must_use]
    pub fn side_photograph(&self) -> Option<(u64, Vec<u8>)> {
        let tent = &mut *self.0.borrow_mut();
        tent.side.is_some().then(|| (tent.frame(), tent.photograph(View::Side).unwrap_or_default()))
    }
}

impl Camera for Device {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let tent = &mut *self.0.borrow_mut();
        let bytes = if tent.has_flash {
            // No photograph at all is a file without bytes.
            tent.photograph(View::Front).unwrap_or_default()
        } else {
            let frame = tent.frame();
            tent.renderer.photograph(&tent.bean.pose(), tent.lit, false, frame)
        };
        Ok(Photo { name: String::new(), bytes, time_s: tent.now_min * 60.0 })
    }

    fn can_repeat(&self) -> bool {
        // What goes wrong does so by the step.
        false
    }
}

impl Lamps for Device {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        self.0.borrow_mut().lit = light;
        Ok(())
    }
}

impl Flash for Device {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        self.0.borrow_mut().has_flash = is_on;
        Ok(())
    }
}

impl Clock for Device {
    fn wait_until(
        &mut self,
        since_start: Duration,
        _meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.0.borrow_mut().advance_to(since_start.as_secs_f64() / 60.0);
        ControlFlow::Continue(())
    }

    fn relive(&mut self, light: Option<Light>, until: Duration) {
        let mut tent = self.0.borrow_mut();
        tent.lit = light;
        tent.advance_to(until.as_secs_f64() / 60.0);
    }
}
