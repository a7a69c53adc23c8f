//! The tip-motion model straight from the equations: every step reads every shift. The reference of [`super::tip`].

use super::PlantModel;
use super::config::Growth;
use super::shifts::{self, Shift, Window};
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::math;
use crate::observation::Observation;
use crate::random::StepNoise;

/// Eqs. (1)-(8) as they are printed: exact windows, no grid, and no sideways movement where a window is empty.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowModel {
    /// The lamps.
    pub layout: Layout,
    /// Minutes of a step.
    pub period_min: f64,
    /// Observed shifts, mirror images included.
    pub shifts: Vec<Shift>,
    /// The sliding window, eq. (1).
    pub window: Window,
    /// Growth of a step, eq. (4).
    pub growth: Growth,
}

/// The state of one plant in double precision: the system configuration (x, L) of section 2.2.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipState {
    /// Tip, in cm.
    pub tip: Point,
    /// Length L from the base to the tip, in cm.
    pub length: f64,
}

impl TipState {
    /// A plant whose straight line from the base ends at `tip`.
    #[must_use]
    pub fn upright(tip: Point) -> Self {
        Self { tip, length: math::hypot(tip.x, tip.y) }
    }

    /// Eqs. (4)-(8): the plant grows by `growth` cm, its tip is shifted sideways by `shift` cm, and the shift becomes a
    /// rotation about the base.
    ///
    /// A tip that the temporary position puts on the base itself points up.
    #[must_use]
    pub fn stepped(&self, shift: f64, growth: f64) -> Self {
        let length = self.length + growth; // eq. (4)
        let x = self.tip.x + shift; // eq. (5)
        let y = self.tip.y + growth; // eq. (6)
        // eqs. (7) and (8): with alpha = atan2(y, x), cos(alpha) is x / hypot(x, y) and sin(alpha) is y / hypot(x, y).
        let radius = (x * x + y * y).sqrt();
        if radius == 0.0 {
            return Self { tip: Point::new(0.0, length), length };
        }
        Self { tip: Point::new(length * (x / radius), length * (y / radius)), length }
    }
}

impl PlantModel for WindowModel {
    type Plant = TipState;

    fn seedling(&self, start: Point, _noise: &mut StepNoise) -> TipState {
        TipState::upright(start)
    }

    fn step(&self, plant: &mut TipState, light: Light, noise: &mut StepNoise) {
        let shift = shifts::window_mean(&self.shifts, self.window, plant.tip, light).unwrap_or(0.0);
        *plant = plant.stepped(shift, self.growth.with_noise(noise.normal()));
    }

    fn observe(&self, plant: &TipState) -> Observation {
        Observation::simulated(plant.tip)
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn period_min(&self) -> f64 {
        self.period_min
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_step_is_the_cosine_and_sine_of_eqs_7_and_8(
            x in -20.0..20.0, y in 0.5..25.0, shift in -2.0..2.0, growth in -0.01..0.08,
        ) {
            let plant = TipState::upright(Point::new(x, y));
            let stepped = plant.stepped(shift, growth);
            let alpha = math::atan2(y + growth, x + shift);
            prop_assert!((stepped.tip.x - stepped.length * math::cos(alpha)).abs() < 1e-9);
            prop_assert!((stepped.tip.y - stepped.length * math::sin(alpha)).abs() < 1e-9);
            prop_assert!((stepped.length - plant.length - growth).abs() < 1e-12);
        }
    }
}
