//! The open-loop controller of the preliminary experiments (section 2.2.1).

use super::Controller;
use crate::light::Light;
use crate::observation::Observation;

/// Switches between the lamps at regular intervals, whatever the plant does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Periodic {
    period: u32,
    first: Light,
    step: u32,
}

impl Periodic {
    /// Each lamp in turn for `period` steps, beginning with `first`. Paper: 72 steps (six hours); it does not say which
    /// lamp came first.
    ///
    /// # Panics
    /// If `period` is 0.
    #[must_use]
    pub fn new(period: u32, first: Light) -> Self {
        assert!(period > 0, "a lamp is lit for at least one step");
        Self { period, first, step: 0 }
    }
}

impl Controller for Periodic {
    fn decide(&mut self, _seen: &Observation) -> Light {
        let is_first = (self.step / self.period).is_multiple_of(2);
        self.step += 1;
        if is_first { self.first } else { self.first.mirrored() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn six_hours_are_72_steps() {
        let mut controller = Periodic::new(72, Light::Left);
        let seen = Observation::simulated(Point::default());
        let lights: Vec<Light> = (0..1000).map(|_| controller.decide(&seen)).collect();
        assert!(lights[..72].iter().all(|&light| light == Light::Left));
        assert!(lights[72..144].iter().all(|&light| light == Light::Right));
        assert_eq!(lights[144], Light::Left);
    }
}
