//! Lights that are known beforehand.

use super::Controller;
use crate::lamps::Light;
use crate::observation::Observation;

/// Plays back a list of lights, one a step, whatever the plant does; the last one stays lit. It goes by the clock: a
/// missed step takes its light with it.
///
/// ```
/// use tropism::control::Schedule;
/// use tropism::prelude::*;
/// let mut schedule = Schedule::new(vec![Light::LEFT, Light::RIGHT]);
/// let seen = Observation::simulated(Point::new(0.0, 4.0));
/// assert_eq!([0; 3].map(|_| schedule.decide(&seen)), [Light::LEFT, Light::RIGHT, Light::RIGHT]);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    lights: Vec<Light>,
    step: usize,
}

impl Schedule {
    /// The light of each step.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn new(lights: Vec<Light>) -> Self {
        assert!(!lights.is_empty(), "at least one light");
        Self { lights, step: 0 }
    }
}

impl Controller for Schedule {
    fn decide(&mut self, _seen: &Observation) -> Light {
        let light = self.lights[self.step.min(self.lights.len() - 1)];
        self.step += 1;
        light
    }

    fn miss(&mut self, steps: u32) {
        self.step += steps as usize;
    }
}
