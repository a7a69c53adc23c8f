//! The virtual tent as a rig: one bean, one or two cameras, the lamps of a layout, a flash, and a clock that jumps.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::check::{self, OutOfRange};
use tropism::control::Controller;
use tropism::environment::{Environment, run};
use tropism::geometry::space::SpacePoint;
use tropism::geometry::{Point, Region};
use tropism::lamps::{Layout, Light};
use tropism::lighting::{Allowed, Lighting};
use tropism::observation::Observation;
use tropism::obstacle::{Pole, Solid};
use tropism::photo::Photo;
use tropism::programme::TimeOfDay;
use tropism::rig::{Camera, Clock, Flash, Lamps, RigError, SideView};
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism::vision::config::{Direction, Mode};
use tropism::vision::{Calibration, TipTracker, VisionConfig, VisionError};

use super::detector;
use super::fault::{self, Fault, FaultEvent, Faults, has_fault};
use super::grow::Observer;
use super::render::{Renderer, Truth};
use super::scene::Scene;
use super::solid::covers_base;
use super::view::{self, CAMERA, Frame, View};
use super::{Bean, Species, Trial};

/// A virtual tent and the plant in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Greenhouse {
    /// Individual variation: 0 for the average bean, 1 as between real plants, 2 for twice that.
    pub variation: f64,
    /// The kind of plant.
    pub bean: Species,
    /// The tent and its camera.
    pub scene: Scene,
    /// The lamps. Default: the paper's two. A lamp behind the back wall stands in an opening of the cloth.
    #[serde(skip_serializing_if = "is_papers")]
    pub layout: Layout,
    /// Which lamps may be lit together. Default: one at a time, at full power.
    #[serde(skip_serializing_if = "Allowed::is_one")]
    pub allowed: Allowed,
    /// Local time of day at which an experiment begins, which a programme of the rig goes by. 08:00 if it is left out.
    #[serde(skip_serializing_if = "is_morning")]
    #[cfg_attr(feature = "schema", schemars(with = "String"))]
    pub begins: TimeOfDay,
    /// Solids through which no stem passes. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub solids: Vec<Solid>,
    /// Fault rates of its photographs.
    pub faults: Faults,
}

impl Default for Greenhouse {
    fn default() -> Self {
        Self {
            variation: 1.0,
            bean: Species::default(),
            scene: Scene::default(),
            layout: Layout::default(),
            allowed: Allowed::One,
            begins: MORNING,
            solids: Vec::new(),
            faults: Faults::default(),
        }
    }
}

/// When an experiment in the virtual tent begins. Chosen: when people begin.
const MORNING: TimeOfDay = TimeOfDay::new(8, 0);

/// Files leave out the usual beginning.
fn is_morning(time: &TimeOfDay) -> bool {
    *time == MORNING
}

/// Files leave out the paper's lamps.
fn is_papers(layout: &Layout) -> bool {
    *layout == Layout::default()
}

/// Half width and height of the region in which a plant can stand, in cm. Chosen by hand: in the picture, between the lamps.
const GROWS_TO: Point = Point::new(24.0, 40.0);

/// Height by which a pole that leaves the tent is given to vision, in cm. Chosen: far above the tent; JSON knows no infinity.
const TALLEST_CM: f64 = 1000.0;

/// Lower edge of that region, in cm. Chosen by hand: above the rim and the soil.
const ABOVE_SOIL: f64 = 0.6;

/// Ground truth at a step, for the evaluation of vision. Never read by vision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundTruth {
    /// Number of the step and of its photographs.
    pub step: u64,
    /// The lamp that is lit in the photograph, alone and at full power.
    pub lit: Option<Light>,
    /// The levels of the lamps in the photograph, where `lit` cannot say them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<Lighting>,
    /// Faults of the photograph of the front camera.
    pub faults: Vec<Fault>,
    /// Faults of the photograph of the side camera, if there is one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub side_faults: Vec<Fault>,
    /// The plant as the front camera sees it.
    pub front: Truth,
    /// The plant as the side camera sees it, if there is one: x is the distance behind the base of the stem.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<Truth>,
    /// The middle of the stem in space from the base to the apex, ten points in cm: where there is a side camera.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stem_in_space: Vec<SpacePoint>,
}

/// The state of an open tent.
struct Tent {
    seed: u64,
    layout: Layout,
    /// Minutes between steps.
    period_min: f64,
    faults: Faults,
    bean: Bean,
    renderer: Renderer,
    /// The side camera, if there is one.
    side: Option<Renderer>,
    allowed: Allowed,
    begins: TimeOfDay,
    lit: Lighting,
    has_flash: bool,
    now_min: f64,
    /// Ground truth by step.
    truths: BTreeMap<u64, GroundTruth>,
    /// Photographs of the previous step that this step repeats, in the order of [`View::BOTH`].
    last: [Option<Vec<u8>>; 2],
}

impl Tent {
    /// Grows the bean until `minutes`, the time of a step, and records its ground truth.
    fn advance_to(&mut self, minutes: f64) {
        if minutes > self.now_min {
            // Taken in replayed steps too, so that a resumed run repeats the same photograph.
            self.last = View::BOTH.map(|view| {
                let is_repeated = has_fault(&self.fault_events(view, 1), Fault::Repeated);
                if is_repeated { self.photograph(view) } else { None }
            });
            let has_failed = has_fault(&self.fault_events(View::Front, 0), Fault::LampFails);
            let lit = if has_failed { Lighting::DARK } else { self.lit.within(&self.layout) };
            self.bean.advance(&lit.powers(), minutes - self.now_min);
            self.now_min = minutes;
        }
        self.note_truth();
    }

    fn note_truth(&mut self) {
        let (pose, step, events) = (self.bean.pose(), self.frame(), self.fault_events(View::Front, 0));
        let faults = |events: &[FaultEvent]| events.iter().map(|event| event.fault).collect();
        let side = self.side.as_ref().map(|_| self.fault_events(View::Side, 0));
        let lit = if has_fault(&events, Fault::LampFails) { Lighting::DARK } else { self.lit };
        let truth = GroundTruth {
            step,
            lit: lit.single().flatten(),
            levels: lit.single().is_none().then_some(lit),
            faults: faults(&events),
            side_faults: side.as_deref().map_or_else(Vec::new, faults),
            front: self.renderer.truth(&pose),
            side: self.side.as_ref().map(|side| side.truth(&pose)),
            stem_in_space: if self.side.is_some() { detector::midline_in_space(&pose) } else { Vec::new() },
        };
        self.truths.insert(step, truth);
    }

    /// Number of the step. It selects noise and faults of the photograph, so that a resumed run takes the same one.
    fn frame(&self) -> u64 {
        (self.now_min / self.period_min).round() as u64
    }

    /// Faults of the photograph of a camera `ahead` steps from now.
    fn fault_events(&self, view: View, ahead: u64) -> Vec<FaultEvent> {
        self.faults.events_for(view, self.seed, self.frame() + ahead)
    }

    /// Photograph of this step with flash; `None` if the camera is missing or drops it.
    fn photograph(&mut self, view: View) -> Option<Vec<u8>> {
        let (events, pose, frame) = (self.fault_events(view, 0), self.bean.pose(), self.frame());
        let renderer = match view {
            View::Front => &mut self.renderer,
            View::Side => self.side.as_mut()?,
        };
        let last = self.last[view as usize].as_deref();
        fault::photograph(renderer, &events, &pose, self.lit, frame, last)
    }
}

/// A shared handle on a virtual tent: its camera, lamps, flash and clock.
#[derive(Clone)]
pub struct TentHandle(Arc<Mutex<Tent>>);

impl Greenhouse {
    /// Checks that every setting lies in its range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let of = |table: &'static str| move |error: OutOfRange| error.in_table(table);
        check::within("greenhouse.variation", self.variation, 0.0..=2.0)?;
        self.bean.check().map_err(of("greenhouse.bean"))?;
        self.scene.check().map_err(of("greenhouse.scene"))?;
        self.allowed.check().map_err(of("greenhouse.allowed"))?;
        self.check_solids().map_err(of("greenhouse"))?;
        self.faults.check().map_err(of("greenhouse.faults"))
    }

    /// The same tent with what `task` needs. For a task in space: a camera at the side, and four lamps instead of the paper's
    /// two.
    #[must_use]
    pub fn for_task(mut self, task: &Task) -> Self {
        if task.is_in_space() {
            self.scene.cameras = 2;
            if is_papers(&self.layout) {
                self.layout = Layout::four_sides();
            }
        }
        self
    }

    /// The same tent with the solids of a task beside its own; each stands there once.
    #[must_use]
    pub fn among(mut self, solids: &[Solid]) -> Self {
        for solid in solids {
            if !self.solids.contains(solid) {
                self.solids.push(*solid);
            }
        }
        self
    }

    /// Experiments on its plants without photographs; with a camera at the side, tip and stem are known in space.
    #[must_use]
    pub fn trial(&self, period_min: f64) -> Trial<'_> {
        Trial {
            scale: self.variation,
            layout: self.layout.clone(),
            period_min,
            in_space: self.scene.cameras > 1,
            solids: self.solids.clone(),
            ..Trial::new(&self.bean)
        }
    }

    fn check_solids(&self) -> Result<(), OutOfRange> {
        for (index, solid) in self.solids.iter().enumerate() {
            solid.check().map_err(|error| error.in_table(&format!("solids[{index}]")))?;
            let wanted = "a solid that leaves room for the base of the stem";
            check::ensure(!covers_base(solid), format!("solids[{index}]"), "a solid at the root", wanted)?;
        }
        Ok(())
    }

    /// Calibration of the photographs, the same for both cameras: each measures in the plane through the base of the plant that
    /// it faces.
    #[must_use]
    pub fn calibration(&self) -> Calibration {
        let frame = Frame::new(self.scene.width, self.scene.height);
        let (width, height) = (self.scene.width as usize, self.scene.height as usize);
        Calibration::from_scale(frame.pixel(Point::new(0.0, 0.0)), frame.px_per_cm, width, height)
    }

    /// Region of interest: above the pot and between the lamps.
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

    /// Opens the tent with the plant of `seed`, for steps of `period_min` minutes: a handle on the tent, and a tracker for its
    /// photographs. If `vision` has no crop, [`Self::crop`] is used; if it names no obstacles, those among the solids.
    ///
    /// # Errors
    /// [`VisionError`] if `vision` is out of range for this tent's photographs.
    pub fn open(
        &self,
        seed: u64,
        period_min: f64,
        vision: &VisionConfig,
    ) -> Result<(TentHandle, TipTracker), VisionError> {
        let vision = self.vision(vision);
        let tracker = TipTracker::new(self.calibration(), vision)?.with_period(period_min);
        Ok((self.handle(seed, period_min), tracker))
    }

    /// The camera at the side of an open tent, if it has one: its photographs are read with the same settings.
    ///
    /// # Errors
    /// [`VisionError`] if `vision` is out of range for this tent's photographs.
    pub fn open_side(
        &self,
        handle: &TentHandle,
        period_min: f64,
        vision: &VisionConfig,
    ) -> Result<Option<SideView>, VisionError> {
        if self.scene.cameras < 2 {
            return Ok(None);
        }
        let vision = self.side_vision(vision);
        let tracker = TipTracker::new(self.calibration(), vision)?.with_period(period_min);
        Ok(Some(SideView::new(Box::new(SideHandle(handle.clone())), tracker, view::STEREO)))
    }

    /// `vision` of the camera at the side. Obstacles are those of the plane that the front camera faces; poles are seen by
    /// both.
    fn side_vision(&self, vision: &VisionConfig) -> VisionConfig {
        let vision = self.vision(vision);
        let poles = vision.poles.iter().map(|pole| view::STEREO.side_from.pole_to_camera(*pole)).collect();
        VisionConfig { obstacles: Vec::new(), poles, ..vision }
    }

    /// `vision` with what it does not name and the tent knows: the crop, the obstacles and poles among the solids, and the
    /// distance of the camera.
    #[must_use]
    pub fn vision(&self, vision: &VisionConfig) -> VisionConfig {
        let mut vision = VisionConfig { crop: vision.crop.or_else(|| Some(self.crop())), ..vision.clone() };
        if vision.obstacles.is_empty() {
            vision.obstacles.extend(self.solids.iter().filter_map(|solid| match solid {
                Solid::Plane(obstacle) => Some(*obstacle),
                Solid::Pole(_) | Solid::Bar(_) => None,
            }));
        }
        let poles = self.solids.iter().filter_map(|solid| match solid {
            Solid::Pole(pole) => Some(Pole { height_cm: pole.height_cm.min(TALLEST_CM), ..*pole }),
            Solid::Plane(_) | Solid::Bar(_) => None,
        });
        if vision.poles.is_empty() && vision.mode == Mode::Robust && vision.up == Direction::Up {
            vision.poles.extend(poles);
        }
        if !vision.poles.is_empty() {
            vision.camera_cm = vision.camera_cm.or(Some(CAMERA[2]));
        }
        vision
    }

    /// A handle on the tent with the plant of `seed`, for steps of `period_min` minutes.
    fn handle(&self, seed: u64, period_min: f64) -> TentHandle {
        let mut tent = Tent {
            seed,
            layout: self.layout.clone(),
            period_min,
            faults: self.faults.clone(),
            bean: Bean::new(self.bean.draw(seed, self.variation), seed)
                .under(&self.layout)
                .among(&self.solids),
            renderer: Renderer::new(&self.scene, seed).under(&self.layout).among(&self.solids),
            side: (self.scene.cameras > 1)
                .then(|| Renderer::at(View::Side, &self.scene, seed).under(&self.layout).among(&self.solids)),
            allowed: self.allowed,
            begins: self.begins,
            lit: Lighting::DARK,
            has_flash: false,
            now_min: 0.0,
            truths: BTreeMap::new(),
            last: [None, None],
        };
        // A resumed run does not photograph the first step again, but records its ground truth.
        tent.note_truth();
        TentHandle(Arc::new(Mutex::new(tent)))
    }

    /// Grows the plant of `seed` under `controller` until `task` is over or `watch` breaks off: [`grow`](super::grow()) in a
    /// tent with cameras. Its tip is placed as there, by the paper's detector without a photograph, and where no lamp fails
    /// its track is the same. `watch` sees each sample, and may have the photographs of its step taken by the hand on the
    /// tent.
    pub fn grow(
        &self,
        seed: u64,
        period_min: f64,
        controller: &mut (impl Controller + ?Sized),
        task: &Task,
        watch: &mut dyn FnMut(&Sample, &TentHandle) -> ControlFlow<()>,
    ) -> Track {
        let handle = self.handle(seed, period_min);
        let mut growing = Growing {
            layout: self.layout.clone(),
            period_min,
            handle: handle.clone(),
            observer: Observer::of(seed, self.scene.cameras > 1),
            step: 0,
        };
        let Ok(track) = run(&mut growing, controller, task, &mut |sample| watch(sample, &handle));
        growing.observer.complete(track)
    }
}

/// The tent as an environment in which the tip is observed without photographs.
struct Growing {
    layout: Layout,
    period_min: f64,
    handle: TentHandle,
    observer: Observer,
    step: u32,
}

impl Environment for Growing {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        let tent = &mut *self.handle.tent();
        tent.advance_to(f64::from(self.step) * self.period_min);
        Ok(self.observer.observe(&tent.bean))
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        self.shine(light.into())
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), Infallible> {
        self.handle.tent().lit = lighting;
        self.step += 1;
        Ok(())
    }

    fn period_min(&self) -> f64 {
        self.period_min
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }
}

impl TentHandle {
    /// The tent, until the guard is dropped. What panicked in another thread left it as it was between two photographs.
    fn tent(&self) -> MutexGuard<'_, Tent> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ground truth of top and apex as CSV with one row a step. Never read by vision.
    #[must_use]
    pub fn truth_csv(&self) -> Vec<u8> {
        let mut text = "step,top_x_cm,top_y_cm,apex_x_cm,apex_y_cm\n".to_owned();
        for GroundTruth { step, front: Truth { top, apex, .. }, .. } in self.tent().truths.values() {
            text += &format!("{step},{:.4},{:.4},{:.4},{:.4}\n", top.x, top.y, apex.x, apex.y);
        }
        text.into_bytes()
    }

    /// Ground truth as JSON with one [`GroundTruth`] a line. Never read by vision.
    ///
    /// # Panics
    /// Never: ground truth always serialises.
    #[must_use]
    pub fn truth_json(&self) -> Vec<u8> {
        let mut text = String::new();
        for truth in self.tent().truths.values() {
            text += &serde_json::to_string(truth).expect("plain data");
            text.push('\n');
        }
        text.into_bytes()
    }

    /// Bytes of the front photograph of this step, with flash; empty if the camera drops it.
    #[must_use]
    pub fn front_photograph(&self) -> Vec<u8> {
        self.tent().photograph(View::Front).unwrap_or_default()
    }

    /// Number and bytes of the side photograph of this step, if there is a side camera: with flash and faults. No bytes if the
    /// camera drops it.
    #[must_use]
    pub fn side_photograph(&self) -> Option<(u64, Vec<u8>)> {
        let tent = &mut *self.tent();
        tent.side.is_some().then(|| (tent.frame(), tent.photograph(View::Side).unwrap_or_default()))
    }
}

impl Camera for TentHandle {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let tent = &mut *self.tent();
        let bytes = if tent.has_flash {
            // A dropped photograph is a file without bytes.
            tent.photograph(View::Front).unwrap_or_default()
        } else {
            let frame = tent.frame();
            tent.renderer.photograph(&tent.bean.pose(), tent.lit, false, frame)
        };
        Ok(Photo { name: String::new(), bytes, time_s: tent.now_min * 60.0 })
    }

    fn can_repeat(&self) -> bool {
        // Faults depend on the step alone.
        false
    }
}

/// The camera at the side.
struct SideHandle(TentHandle);

impl Camera for SideHandle {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let time_s = self.0.tent().now_min * 60.0;
        let bytes = self.0.side_photograph().map_or_else(Vec::new, |(_, bytes)| bytes);
        Ok(Photo { name: String::new(), bytes, time_s })
    }

    fn can_repeat(&self) -> bool {
        false
    }
}

impl Lamps for TentHandle {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        self.shine(light.into())
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), RigError> {
        let tent = &mut *self.tent();
        let error = |problem| RigError::Device { device: "virtual tent".to_owned(), problem };
        if let Some((light, _)) = lighting.lit().find(|(light, _)| !tent.layout.contains(*light)) {
            let lamps: Vec<&str> = tent.layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect();
            return Err(error(format!(
                "found a light for lamp {}, wanted {} or dark",
                tent.layout.name(Some(light)),
                lamps.join(", ")
            )));
        }
        tent.allowed.permit(lighting).map_err(|problem| error(problem.to_string()))?;
        tent.lit = lighting;
        Ok(())
    }
}

impl Flash for TentHandle {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        self.tent().has_flash = is_on;
        Ok(())
    }
}

impl Clock for TentHandle {
    fn wait_until(
        &mut self,
        since_start: Duration,
        _meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.tent().advance_to(since_start.as_secs_f64() / 60.0);
        ControlFlow::Continue(())
    }

    fn time_of_day(&self) -> TimeOfDay {
        let tent = self.tent();
        tent.begins.later(tent.now_min as u64)
    }

    fn replay(&mut self, lighting: Lighting, until: Duration) {
        let mut tent = self.tent();
        tent.lit = lighting;
        tent.advance_to(until.as_secs_f64() / 60.0);
    }
}
