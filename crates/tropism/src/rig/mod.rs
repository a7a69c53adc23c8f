//! A tent as the loop sees it: camera, lamps, flash and clock.
//!
//! Drivers implement four small traits; [`Rig`] makes an [`Environment`] of them and a [`TipTracker`]. The virtual tent
//! (`tropism_bean::tent`) is a rig like any other, so it exercises all of this.

pub mod event;
pub mod fault_policy;
mod side;

use std::ops::ControlFlow;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::environment::Environment;
use crate::lamps::{Layout, Light};
use crate::lighting::{Allowed, Lighting};
use crate::observation::Observation;
use crate::photo::Photo;
use crate::programme::TimeOfDay;
use crate::vision::{Frame, TipTracker, TrackedFrame};

pub use event::{Event, EventKind, HealthProblem, NoMonitor, RunMonitor};
pub use fault_policy::{Durability, FaultPolicy, LampsInView, OnDowntime, OnFault};
pub use side::{SideShot, SideView};

/// Takes photographs.
pub trait Camera {
    /// A fresh photograph.
    ///
    /// # Errors
    /// If the camera gives none.
    fn photograph(&mut self) -> Result<Photo, RigError>;

    /// Whether another photograph of the same step may come out better: not of a recording, and not of a virtual tent.
    fn can_repeat(&self) -> bool {
        true
    }

    /// Passes over a photograph that was taken before an interruption.
    ///
    /// Nothing in front of a real plant, which has grown by itself; a recording goes on by one.
    fn skip(&mut self) {}
}

/// The lamps: at most one is lit, unless they know levels.
pub trait Lamps {
    /// Lights one lamp and darkens the others; `None` darkens all, the safe state.
    ///
    /// # Errors
    /// If a lamp does not obey.
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError>;

    /// Sets the levels of all lamps. By default one lamp at full power or darkness, and any other lighting is refused.
    ///
    /// # Errors
    /// If a lamp does not obey, or the lamps do not allow this lighting; then nothing was switched.
    fn shine(&mut self, lighting: Lighting) -> Result<(), RigError> {
        Allowed::One.permit(lighting).map_err(|problem| RigError::Device {
            device: "lamps".to_owned(),
            problem: problem.to_string(),
        })?;
        self.light(lighting.single().flatten())
    }
}

/// What becomes of the lamps when a rig is closed, however that comes about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum OnExit {
    /// All go dark.
    #[default]
    Dark,
    /// They stay as they are.
    Keep,
}

/// The flash that makes the plant bright in a photograph.
pub trait Flash {
    /// Switches the flash.
    ///
    /// # Errors
    /// If the flash does not obey.
    fn flash(&mut self, is_on: bool) -> Result<(), RigError>;
}

/// No flash: the tent is bright enough, or the camera has a flash of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoFlash;

impl Flash for NoFlash {
    fn flash(&mut self, _is_on: bool) -> Result<(), RigError> {
        Ok(())
    }
}

/// A moment, as the clocks of a real tent show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Since the start of the experiment, on a clock that grows evenly, whatever is done to the one on the wall.
    pub since_start: Duration,
    /// The clock on the wall, in seconds since 1970: a label for people.
    pub unix_s: f64,
}

/// The clock that counts from the start of a computer, and where on it an experiment began.
#[derive(Clone, Debug, PartialEq)]
pub struct Boot {
    /// Names this start of the computer.
    pub id: String,
    /// The start of the experiment, in seconds on this clock; below 0 if it was before the start of the computer.
    pub start_s: f64,
    /// Whether the clock on the wall is known to be right.
    pub is_wall_set: bool,
}

/// Time since the start of an experiment: sleeps in a tent, jumps in the virtual one.
pub trait Clock {
    /// Returns when `since_start` has come; at once if it has passed. A clock that sleeps asks `meanwhile` about twice a
    /// second, and returns early with its `Break`.
    fn wait_until(
        &mut self,
        since_start: Duration,
        meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()>;

    /// What it shows; `None` of a clock that jumps.
    fn now(&self) -> Option<Moment> {
        None
    }

    /// What it counts from; `None` of a clock that jumps.
    fn boot(&self) -> Option<Boot> {
        None
    }

    /// The local time of day, which a [`Programme`](crate::programme::Programme) goes by; midnight of a clock that knows none.
    fn time_of_day(&self) -> TimeOfDay {
        TimeOfDay::MIDNIGHT
    }

    /// Replays a step that was recorded before an interruption: the lamps shine as `lighting` says until `until`.
    ///
    /// Only a simulated plant needs it: a real one has lived through that time.
    fn replay(&mut self, _lighting: Lighting, _until: Duration) {}
}

/// A clock on which no waiting takes time, for plants that are simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InstantClock;

impl Clock for InstantClock {
    fn wait_until(
        &mut self,
        _since_start: Duration,
        _meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl<T: Camera + ?Sized> Camera for Box<T> {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        (**self).photograph()
    }

    fn can_repeat(&self) -> bool {
        (**self).can_repeat()
    }

    fn skip(&mut self) {
        (**self).skip();
    }
}

impl<T: Lamps + ?Sized> Lamps for Box<T> {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        (**self).light(light)
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), RigError> {
        (**self).shine(lighting)
    }
}

impl<T: Flash + ?Sized> Flash for Box<T> {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        (**self).flash(is_on)
    }
}

impl<T: Clock + ?Sized> Clock for Box<T> {
    fn wait_until(
        &mut self,
        since_start: Duration,
        meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        (**self).wait_until(since_start, meanwhile)
    }

    fn now(&self) -> Option<Moment> {
        (**self).now()
    }

    fn boot(&self) -> Option<Boot> {
        (**self).boot()
    }

    fn time_of_day(&self) -> TimeOfDay {
        (**self).time_of_day()
    }

    fn replay(&mut self, lighting: Lighting, until: Duration) {
        (**self).replay(lighting, until);
    }
}

/// Why a rig cannot go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RigError {
    /// A device failed.
    #[error("{device}: {problem}")]
    Device {
        /// Which device, with enough of its address to find it.
        device: String,
        /// What was found, and what was wanted.
        problem: String,
    },
    /// The first photograph shows no plant: there is nothing to hold.
    #[error("{photo}: no plant is seen in the region of interest of the first photograph ({class})")]
    NeverSeen {
        /// Name of the photograph.
        photo: String,
        /// Class of the photograph.
        class: String,
    },
}

/// The latest photograph and what was seen in it.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The photograph.
    pub photo: Photo,
    /// What was seen.
    pub seen: TrackedFrame,
    /// What a second camera saw, if there is one.
    pub side: Option<SideShot>,
}

impl Shot {
    /// What the loop sees: tip and stem in space with two cameras, else those of the one; `None` where the plant was never
    /// seen.
    #[must_use]
    pub fn observation(&self) -> Option<&Observation> {
        self.side.as_ref().map(|side| &side.observation).or(self.seen.observation.as_ref())
    }
}

/// A tent: its devices and the tracker that reads its photographs.
///
/// [`close`](Self::close) or drop it: its lamps go dark, unless they are to [stay](OnExit::Keep) as they are.
#[derive(Debug)]
pub struct Rig<C, L: Lamps, F, K> {
    camera: C,
    lamps: L,
    flash: F,
    clock: K,
    tracker: TipTracker,
    side: Option<SideView>,
    layout: Layout,
    period: Duration,
    on_exit: OnExit,
    is_closed: bool,
    /// The next step.
    step: u32,
    shot: Option<Shot>,
}

/// For those who do not want to break off.
fn go_on() -> ControlFlow<()> {
    ControlFlow::Continue(())
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Rig<C, L, F, K> {
    /// A tent that is observed every `period`, beginning at the clock's start.
    pub fn new(camera: C, lamps: L, flash: F, clock: K, tracker: TipTracker, period: Duration) -> Self {
        let layout = Layout::default();
        Self {
            camera,
            lamps,
            flash,
            clock,
            tracker,
            side: None,
            layout,
            period,
            on_exit: OnExit::Dark,
            is_closed: false,
            step: 0,
            shot: None,
        }
    }

    /// The same tent with the lamps of `layout`; without it, the paper's two.
    #[must_use]
    pub fn with_layout(mut self, layout: Layout) -> Self {
        self.layout = layout;
        self
    }

    /// The same tent with a second camera at the side of the plant, or without one.
    #[must_use]
    pub fn with_side(mut self, side: Option<SideView>) -> Self {
        self.side = side;
        self
    }

    /// The second camera.
    pub const fn side(&self) -> Option<&SideView> {
        self.side.as_ref()
    }

    /// The same tent, whose lamps become what `on_exit` says when it is closed.
    #[must_use]
    pub fn with_on_exit(mut self, on_exit: OnExit) -> Self {
        self.on_exit = on_exit;
        self
    }

    /// The latest photograph, once there is one.
    pub const fn shot(&self) -> Option<&Shot> {
        self.shot.as_ref()
    }

    /// What reads its photographs.
    pub const fn tracker(&self) -> &TipTracker {
        &self.tracker
    }

    /// The clock.
    pub const fn clock(&self) -> &K {
        &self.clock
    }

    /// The next step.
    pub const fn next_step(&self) -> u32 {
        self.step
    }

    /// When `step` is due, since the start.
    pub fn due(&self, step: u32) -> Duration {
        self.period * step
    }

    /// Passes over steps that cannot be taken any more: the next one is `step`.
    pub const fn skip_to(&mut self, step: u32) {
        self.step = step;
    }

    /// Waits for a time since the start, as [`Clock::wait_until`].
    pub fn wait_until(
        &mut self,
        since_start: Duration,
        meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.clock.wait_until(since_start, meanwhile)
    }

    /// Puts the flash off, and the lamps as they are to be [on exit](OnExit).
    ///
    /// # Errors
    /// Those of a device that does not confirm; all others were switched all the same.
    pub fn close(&mut self) -> Result<(), RigError> {
        self.is_closed = true;
        let flash = self.flash.flash(false);
        let lamps = if self.on_exit == OnExit::Dark { self.lamps.light(None) } else { Ok(()) };
        flash.and(lamps)
    }

    /// The photograph of the next step, taken now.
    ///
    /// # Errors
    /// Those of camera and flash; the flash is switched off all the same.
    pub fn photograph(&mut self) -> Result<Frame, RigError> {
        let (name, time_s) = (photo_name(self.step), self.due(self.step).as_secs_f64());
        let lit = self.flash.flash(true);
        if let Some(side) = self.side.as_mut().filter(|_| lit.is_ok()) {
            side.photograph(&name, time_s);
        }
        let photo = lit.and_then(|()| self.camera.photograph());
        // Off again whether or not flash and camera obeyed.
        let off = self.flash.flash(false);
        let mut photo = photo?;
        off?;
        (photo.name, photo.time_s) = (name, time_s);
        Ok(Frame::new(photo))
    }

    /// Another photograph of the next step, if `frame` is too dark to see a plant by and another one may come out better:
    /// the flash is lit anew.
    ///
    /// # Errors
    /// As [`Self::photograph`].
    pub fn photograph_again(&mut self, frame: &Frame) -> Option<Result<Frame, RigError>> {
        (self.camera.can_repeat() && self.tracker.is_dark(frame)).then(|| self.photograph())
    }

    /// What stands for the photograph of the next step where there is none: a file without bytes.
    pub fn no_photograph(&self) -> Frame {
        let time_s = self.due(self.step).as_secs_f64();
        Frame::new(Photo { name: photo_name(self.step), bytes: Vec::new(), time_s })
    }

    /// Takes the next step with what `frame` shows of the plant.
    ///
    /// # Errors
    /// [`RigError::NeverSeen`]; then the step is still the next one.
    pub fn see(&mut self, frame: &Frame) -> Result<Observation, RigError> {
        let seen = self.tracker.observe(frame);
        let photo = frame.photo().clone();
        let Some(observation) = seen.observation.clone() else {
            return Err(RigError::NeverSeen { photo: photo.name, class: seen.status.to_string() });
        };
        let side = self.side.as_mut().map(|side| side.see(&observation, &photo.name, photo.time_s));
        self.step += 1;
        let observation = side.as_ref().map_or(observation, |side| side.observation.clone());
        self.shot = Some(Shot { photo, seen, side });
        Ok(observation)
    }

    /// Lights one lamp, or none.
    ///
    /// # Errors
    /// Those of the lamps.
    pub fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        self.lamps.light(light)
    }

    /// Sets the levels of all lamps.
    ///
    /// # Errors
    /// Those of the lamps.
    pub fn shine(&mut self, lighting: Lighting) -> Result<(), RigError> {
        self.lamps.shine(lighting)
    }

    /// Replays a recorded step: what was seen at its beginning, and how the lamps shone until the step `until`.
    pub fn replay(&mut self, step: u32, shot: &Shot, lighting: impl Into<Lighting>, until: u32) {
        self.restore(step, shot);
        self.clock.replay(lighting.into(), self.due(until));
    }

    /// Restores what was seen at the latest step, which is not over: its photograph need not be taken again.
    pub fn restore(&mut self, step: u32, shot: &Shot) {
        self.tracker.resume(&shot.photo, &shot.seen);
        self.camera.skip();
        if let Some((side, shot)) = self.side.as_mut().zip(shot.side.as_ref()) {
            side.resume(shot);
        }
        self.step = step + 1;
    }
}

/// File name of the photograph of a step, in the folder of a run.
#[must_use]
pub fn photo_name(step: u32) -> String {
    format!("{step:06}.jpg")
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Environment for Rig<C, L, F, K> {
    type Error = RigError;

    fn observe(&mut self) -> Result<Observation, RigError> {
        // This wait cannot be interrupted.
        let _ = self.wait_until(self.due(self.step), &mut go_on);
        let frame = self.photograph()?;
        self.see(&frame)
    }

    fn step(&mut self, light: Light) -> Result<(), RigError> {
        self.light(Some(light))
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), RigError> {
        self.lamps.shine(lighting)
    }

    fn period_min(&self) -> f64 {
        self.period.as_secs_f64() / 60.0
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }
}

impl<C, L: Lamps, F, K> Drop for Rig<C, L, F, K> {
    fn drop(&mut self) {
        if self.on_exit == OnExit::Dark && !self.is_closed {
            // A failure cannot be reported here; drivers keep their own last resort.
            let _ = self.lamps.light(None);
        }
    }
}
