//! Models of a plant: what the paper makes of its photographs, section 2.2.3.
//!
//! Tracks go in; out comes something that can be stepped: given where the tip is and which lamp is lit, where is it five
//! minutes later? [`tip`] is the model in use, with a look-up of constant cost; [`window`] is the same model written
//! straight from the equations, its reference.
//!
//! # References
//! Wahby et al. 2016, section 2.2.3, eqs. (1)-(8).

pub mod shifts;
pub(crate) mod table;
pub mod tip;
pub mod window;

use crate::geometry::Point;
use crate::light::Light;
use crate::math;
use crate::observation::Observation;

/// A model of a plant: the model is fixed, the plant is a value.
pub trait PlantModel: Sync {
    /// The state of one plant.
    type Plant: Clone;

    /// The plant of `tip` at the start of an experiment.
    fn seedling(&self, tip: Point) -> Self::Plant;

    /// The plant one step (five minutes) later, under `light`.
    ///
    /// `luck` is one standard normal draw: how much more or less than the mean the plant grows in this step, eq. (4).
    fn step(&self, plant: &Self::Plant, light: Light, luck: f64) -> Self::Plant;

    /// What a camera would see of the plant.
    fn observe(&self, plant: &Self::Plant) -> Observation;
}

/// The state of the tip-motion model: the system configuration (x, L) of section 2.2.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shoot {
    /// Tip, in cm.
    pub tip: Point,
    /// Length L from the base to the tip, in cm.
    pub length: f64,
}

impl Shoot {
    /// A shoot whose straight line from the base ends at `tip`.
    #[must_use]
    pub fn upright(tip: Point) -> Self {
        Self { tip, length: math::hypot(tip.x, tip.y) }
    }

    /// Eqs. (4)-(8): the shoot grows by `growth` cm, its tip is shifted sideways by `shift` cm, and what was a shift
    /// becomes a turn about the base.
    ///
    /// A tip that the temporary position puts on the base itself points up.
    #[must_use]
    pub fn turned(&self, shift: f64, growth: f64) -> Self {
        let length = self.length + growth; // eq. (4)
        let x = self.tip.x + shift; // eq. (5)
        let y = self.tip.y + growth; // eq. (6)
        // eqs. (7) and (8): with alpha = atan2(y, x), cos(alpha) is x / hypot(x, y) and sin(alpha) is y / hypot(x, y).
        let reach = (x * x + y * y).sqrt();
        if reach == 0.0 {
            return Self { tip: Point::new(0.0, length), length };
        }
        Self { tip: Point::new(length * (x / reach), length * (y / reach)), length }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn turning_is_the_cosine_and_sine_of_eqs_7_and_8(
            x in -20.0..20.0, y in 0.5..25.0, shift in -2.0..2.0, growth in -0.01..0.08,
        ) {
            let shoot = Shoot::upright(Point::new(x, y));
            let turned = shoot.turned(shift, growth);
            let alpha = math::atan2(y + growth, x + shift);
            prop_assert!((turned.tip.x - turned.length * math::cos(alpha)).abs() < 1e-9);
            prop_assert!((turned.tip.y - turned.length * math::sin(alpha)).abs() < 1e-9);
            prop_assert!((turned.length - shoot.length - growth).abs() < 1e-12);
        }
    }
}
