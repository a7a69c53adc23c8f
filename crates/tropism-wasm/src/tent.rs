//! The virtual tent: one bean before its camera, photograph by photograph, and the tip that vision finds in each.

use std::ops::ControlFlow;
use std::time::Duration;

use serde_json::{Value, json};
use tropism::control::Controller;
use tropism::lamps::Light;
use tropism::rig::{Camera, Clock, Flash, Lamps, RigError};
use tropism::task::Task;
use tropism::track::PAPER_PERIOD_MIN;
use tropism::vision::{Frame, TipTracker, VisionConfig};
use tropism_bean::tent::{Greenhouse, TentHandle};

use crate::SessionError;

/// An open tent with who steers in it.
pub(crate) struct Tent {
    handle: TentHandle,
    tracker: TipTracker,
    task: Task,
    /// `None` while a person lights the lamps.
    controller: Option<Box<dyn Controller>>,
    step: u32,
    lit: Option<Light>,
}

impl Tent {
    /// The tent with the plant of `seed` and the solids of `task`, all dark.
    pub(crate) fn open(
        seed: u64,
        task: Task,
        controller: Option<Box<dyn Controller>>,
    ) -> Result<Self, SessionError> {
        let greenhouse = Greenhouse::default().among(&task.solids());
        let (handle, tracker) = greenhouse.open(seed, PAPER_PERIOD_MIN, &VisionConfig::default())?;
        Ok(Self { handle, tracker, task, controller, step: 0, lit: None })
    }

    /// Photographs the plant with flash, finds its tip, lights the lamp that the controller decides or `own`, and lets a step
    /// pass. The bytes are those of the photograph, a JPEG file.
    pub(crate) fn step(&mut self, own: Option<Light>) -> Result<(Value, Vec<u8>), RigError> {
        self.handle.flash(true)?;
        let photo = self.handle.photograph()?;
        self.handle.flash(false)?;
        let bytes = photo.bytes.clone();
        let seen = self.tracker.observe(&Frame::new(photo));
        let observation = seen.observation.as_ref();
        let is_over = observation.is_some_and(|seen| self.task.is_over(self.step, seen));
        let decided = match (&mut self.controller, observation) {
            (None, _) => own,
            (Some(controller), Some(seen)) => Some(controller.decide(seen)),
            // Nothing was seen so far: the lamp stays as it is.
            (Some(_), None) => self.lit,
        };
        let answer = json!({
            "step": self.step,
            "tip": observation.map(|seen| seen.tip),
            "tip_px": seen.tip_px,
            "class": seen.status.to_string(),
            "is_measured": seen.is_measured(),
            "photographed": self.lit.map(|light| light.to_string()),
            "light": decided.map(|light| light.to_string()),
            "is_over": is_over,
        });
        self.handle.light(decided)?;
        self.lit = decided;
        self.step += 1;
        let until = Duration::from_secs_f64(60.0 * PAPER_PERIOD_MIN * f64::from(self.step));
        let _ = self.handle.wait_until(until, &mut || ControlFlow::Continue(()));
        Ok((answer, bytes))
    }
}
