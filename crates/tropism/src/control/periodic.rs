//! The open-loop controller of the preliminary experiments (section 2.2.1).

use super::Controller;
use crate::lamps::{Layout, Light};
use crate::observation::Observation;

/// Lights each lamp of a layout in turn for a fixed time, whatever the plant does. It goes by the clock: missed steps move
/// no switch.
///
/// ```
/// use tropism::control::Periodic;
/// use tropism::prelude::*;
/// let mut controller = Periodic::every(1.5, &Layout::default()).starting_with(Light::RIGHT);
/// let seen = Observation::simulated(Point::new(0.0, 4.0));
/// let lights: Vec<bool> = (0..6).map(|_| controller.decide(&seen) == Light::RIGHT).collect();
/// assert_eq!(lights, [true, false, false, true, false, false]); // both lamps in three steps: no drift
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Periodic {
    lights: Vec<Light>,
    steps_each: f64,
    step: u32,
}

impl Periodic {
    /// Each lamp of `layout` in turn for `steps_each` steps, in the layout's order. Paper: 72 steps (six hours); it does
    /// not say which lamp came first.
    ///
    /// # Panics
    /// If `steps_each` is 0.
    #[must_use]
    pub fn new(steps_each: u32, layout: &Layout) -> Self {
        Self::every(f64::from(steps_each), layout)
    }

    /// Each lamp of `layout` in turn for `steps_each` steps, which need not be whole: each switch is made at the step
    /// nearest to its time, so that the switches do not drift.
    ///
    /// # Panics
    /// If `steps_each` is below 1 or infinite.
    #[must_use]
    pub fn every(steps_each: f64, layout: &Layout) -> Self {
        assert!(steps_each >= 1.0 && steps_each.is_finite(), "a lamp is lit for at least one step");
        Self { lights: layout.steering().collect(), steps_each, step: 0 }
    }

    /// The same turns, beginning with the lamp `first`; unchanged if the layout has no such lamp.
    #[must_use]
    pub fn starting_with(mut self, first: Light) -> Self {
        let place = self.lights.iter().position(|&light| light == first).unwrap_or(0);
        self.lights.rotate_left(place);
        self
    }
}

impl Controller for Periodic {
    fn decide(&mut self, _seen: &Observation) -> Light {
        // The n-th switch is at the step round(n * steps_each).
        let turn = ((f64::from(self.step) + 0.5) / self.steps_each) as usize;
        self.step += 1;
        self.lights[turn % self.lights.len()]
    }

    fn miss(&mut self, steps: u32) {
        self.step += steps;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn lights(layout: &Layout) -> Vec<Light> {
        let mut controller = Periodic::new(72, layout);
        let seen = Observation::simulated(Point::default());
        (0..1000).map(|_| controller.decide(&seen)).collect()
    }

    #[test]
    fn six_hours_are_72_steps() {
        let lights = lights(&Layout::wahby2016());
        assert!(lights[..72].iter().all(|&light| light == Light::LEFT));
        assert!(lights[72..144].iter().all(|&light| light == Light::RIGHT));
        assert_eq!(lights[144], Light::LEFT);
    }

    #[test]
    fn missed_steps_move_no_switch() {
        let (mut whole, mut missing) =
            (Periodic::new(72, &Layout::default()), Periodic::new(72, &Layout::default()));
        let seen = Observation::simulated(Point::default());
        let lights: Vec<Light> = (0..400).map(|_| whole.decide(&seen)).collect();
        let mut step = 0;
        for missed in [0, 21, 1, 90, 7].into_iter().cycle().take(10) {
            missing.miss(missed);
            step += missed as usize;
            assert_eq!(missing.decide(&seen), lights[step], "step {step}");
            step += 1;
        }
    }

    #[test]
    fn a_time_that_is_no_whole_number_of_steps_does_not_drift() {
        let mut controller = Periodic::every(360.0 / 7.0, &Layout::default());
        let seen = Observation::simulated(Point::default());
        let lights: Vec<Light> = (0..2000).map(|_| controller.decide(&seen)).collect();
        let switches: Vec<f64> = (1..2000)
            .filter(|&step| lights[step] != lights[step - 1])
            .map(|step| 7.0 * step as f64)
            .collect();
        assert_eq!(switches.len(), 38);
        for (number, minutes) in (1..).zip(switches) {
            assert!((minutes - 360.0 * f64::from(number)).abs() <= 3.5, "switch {number} at {minutes} min");
        }
    }

    #[test]
    fn four_lamps_take_turns() {
        let lights = lights(&Layout::four_sides());
        let turns: Vec<Light> = lights.iter().copied().step_by(72).take(5).collect();
        assert_eq!(turns, [Light::LEFT, Light::RIGHT, Light::FRONT, Light::BACK, Light::LEFT]);
    }
}
