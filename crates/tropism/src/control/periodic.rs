//! The open-loop controller of the preliminary experiments (section 2.2.1).

use super::Controller;
use crate::lamps::{Layout, Light};
use crate::observation::Observation;

/// Lights each lamp of a layout in turn for a fixed number of steps, whatever the plant does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Periodic {
    lights: Vec<Light>,
    steps_each: u32,
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
        assert!(steps_each > 0, "a lamp is lit for at least one step");
        Self { lights: layout.lights().collect(), steps_each, step: 0 }
    }

    /// The same turns, beginning with the lamp `first`.
    #[must_use]
    pub fn starting_with(mut self, first: Light) -> Self {
        let place = self.lights.iter().position(|&light| light == first).unwrap_or(0);
        self.lights.rotate_left(place);
        self
    }
}

impl Controller for Periodic {
    fn decide(&mut self, _seen: &Observation) -> Light {
        let turn = (self.step / self.steps_each) as usize;
        self.step += 1;
        self.lights[turn % self.lights.len()]
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
    fn four_lamps_take_turns() {
        let lights = lights(&Layout::four_sides());
        let turns: Vec<Light> = lights.iter().copied().step_by(72).take(5).collect();
        assert_eq!(turns, [Light::LEFT, Light::RIGHT, Light::FRONT, Light::BACK, Light::LEFT]);
    }
}
