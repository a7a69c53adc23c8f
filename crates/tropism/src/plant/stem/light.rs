//! The light on a plant: how strongly the lamps draw it along each axis.
//!
//! In the plane of the front camera two lamps stand as mirror images of each other, and the light is the difference of their
//! powers. In space it is the irradiance where the tip is: that of all lamps adds up as vectors, each by the inverse square of
//! its distance, so near lamps count, too. A plant answers with a power of the irradiance (power law of phototropism).
//!
//! # References
//! Bastien, Douady and Moulia 2015, doi:10.1371/journal.pcbi.1004037.

use super::shape::Place;
use super::terms::MIDDLE_LENGTH_CM;
use crate::lamps::{Layout, Light};
use crate::lighting::{FULL, Lighting};
use crate::math::statistics::mean;
use crate::math::vector::{Vec3, along, norm, sub};
use crate::math::{exp, ln};

/// Power of the irradiance with which a plant answers: half of the light draws with three quarters of the strength. Assumed, as
/// for the virtual bean: single lamps at full power, of which most tracks are, do not show it.
const RESPONSE_POWER: f64 = 0.4;

/// Least distance from a lamp that counts, in cm. Chosen: a plant that touches it has no infinite light.
const LEAST_CM: f64 = 1.0;

/// The lamps as the model knows them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lamps<const AXES: usize> {
    /// The lamps that steer: in the plane with -1 or 1 for the side, in space with the place in cm.
    steering: Vec<(Light, Vec3)>,
    /// Mean distance of the lamps that steer from the middle of the heights, in cm: there a lamp has an irradiance of 1.
    far_cm: f64,
}

impl<const AXES: usize> Lamps<AXES> {
    pub(super) fn of(layout: &Layout) -> Self {
        let place = |light: Light| layout.lamps()[light.index()].at;
        let distance = |light: Light| norm(sub(place(light), [0.0, MIDDLE_LENGTH_CM, 0.0]));
        let at = |light: Light| if AXES == 1 { [layout.side(light), 0.0, 0.0] } else { place(light) };
        let steering = layout.steering().map(|light| (light, at(light))).collect();
        Self { steering, far_cm: mean(layout.steering().map(distance)) }
    }

    /// The light on a plant with its tip at `tip`, along the axes: 1 in size for one lamp at full power that is as far as lamps
    /// are, and beside the plant.
    pub(super) fn light(&self, lighting: Lighting, tip: Place<AXES>) -> [[f64; 1]; AXES] {
        let mut irradiance = [0.0; 3];
        for (light, lamp) in &self.steering {
            let power = f64::from(lighting.level(*light)) / f64::from(FULL);
            if AXES == 1 {
                irradiance = along(irradiance, *lamp, power);
            } else {
                let towards = sub(*lamp, tip.in_space());
                let distance = norm(towards).max(LEAST_CM);
                irradiance = along(irradiance, towards, power * (self.far_cm / distance).powi(2) / distance);
            }
        }
        let strength = norm(irradiance);
        let share = if strength > 0.0 { exp((RESPONSE_POWER - 1.0) * ln(strength)) } else { 0.0 };
        Place::<AXES>::of(irradiance).aside.map(|aside| [share * aside])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Lamp;

    #[test]
    fn in_the_plane_the_powers_of_two_lamps_are_subtracted() {
        let lamps = Lamps::<1>::of(&Layout::wahby2016());
        let light = |left, right| {
            let lighting = Lighting::DARK.with(Light::LEFT, left).with(Light::RIGHT, right);
            lamps.light(lighting, Place::of([3.0, 9.0, 0.0]))[0][0]
        };
        assert_eq!([light(0, 0), light(255, 0), light(0, 255), light(99, 99)], [0.0, -1.0, 1.0, 0.0]);
        assert!((light(0, 128) - 0.76).abs() < 0.01, "half of the light draws by three quarters");
        assert!((light(128, 255) - 0.75).abs() < 0.01, "{}", light(128, 255));
        assert_eq!(light(200, 40), -light(40, 200));
    }

    #[test]
    fn in_space_near_lamps_draw_more_and_lamps_add_up() {
        let near = |x: f64| Lamp::new(if x < 0.0 { "a" } else { "b" }, [x, 9.0, 0.0]);
        let lamps = Lamps::<2>::of(&Layout::new(vec![near(-6.0), near(6.0)]).unwrap());
        let light = |lighting, x| lamps.light(lighting, Place::of([x, 9.0, 0.0]));
        let [left, right] = [Light::LEFT, Light::RIGHT].map(Lighting::only);
        assert_eq!(light(right, 0.0), [[1.0], [0.0]]);
        assert_eq!(light(left, 0.0), [[-1.0], [0.0]]);
        assert!(light(right, 3.0)[0][0] > 1.5, "four times the light at half the distance");
        let both = left.with(Light::RIGHT, 255);
        assert_eq!(light(both, 0.0), [[0.0], [0.0]]);
        assert!(light(both, 2.0)[0][0] > 0.5 && light(both, -2.0)[0][0] < -0.5, "the nearer lamp wins");
        let corner = Lighting::only(Light::RIGHT).with(Light::FRONT, 255);
        let [[x], [z]] = Lamps::<2>::of(&Layout::four_sides()).light(corner, Place::of([0.0, 9.0, 0.0]));
        assert!(x > 0.4 && z > 0.4, "between two lamps: {x}, {z}");
    }
}
