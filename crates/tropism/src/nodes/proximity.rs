//! A proximity sensor: the amplitude of the infrared echo of whatever is near.
//!
//! In: the surfaces before the sensor. Out: a reading in units of the natural logarithm of the echo, as receivers with
//! logarithmic gain give it. The idea: the emitter's irradiance falls with the square of the distance, and so does the light
//! that comes back. A patch of area `A` at distance `d` echoes `A w / d^4`, with the share `w` of the beam in its direction;
//! a thin stem fills the beam along its length, so its echo falls with the third power. The constant echo of wall and case
//! is 1: `reading = ln(1 + echo)`.

use core::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::sensors::{Draw, Sensors, draws};
use super::wall::NodeWall;
use crate::check::{self, OutOfRange};
use crate::lighting::Beam;
use crate::math::vector::{Vec3, dot, norm, normalize_or, sub};
use crate::math::{cos, exp, ln, sin};

/// Radius of the stem that defines the range of a sensor, in cm: that of the virtual bean near its apex.
pub const STEM_RADIUS_CM: f64 = 0.12;
/// Reading that a stem on the axis at the range gives: four standard deviations of the default noise.
pub const READING_AT_RANGE: f64 = 0.4;
/// By how much a false echo raises a reading. Chosen: five times what a stem raises it by at the range of the sensor.
const FALSE_ECHO: f64 = 2.0;
/// Least distance that counts, in cm. Chosen by hand: it bounds the inverse fourth power at the sensor's window.
const LEAST_CM: f64 = 0.5;

/// A piece of surface that echoes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Its centre, in cm.
    pub at: Vec3,
    /// Its area as seen from the sensor, in cm^2.
    pub area: f64,
}

/// A proximity sensor. All readings are in units of the natural logarithm of the echo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Proximity {
    /// Distance at which a stem of 0.12 cm radius on the axis gives a reading of 0.4 over the empty scene, in cm: 0.5 to 50.
    pub range_cm: f64,
    /// Angle to the axis at which half of the sensitivity is left, in degrees: 1 to 80.
    pub half_angle_deg: f64,
    /// Standard deviation of a reading, 0 to 10.
    pub noise: f64,
    /// Amplitude of the daily swing that all sensors of a wall share, 0 to 10: sunlight shortens the pulse.
    pub swing: f64,
    /// Amplitude of a daily swing of each sensor's own, 0 to 10: shadows differ from place to place.
    pub own_swing: f64,
    /// False echoes a day, such as insects, 0 to 288. Each raises one reading by 2.
    pub false_echoes_per_day: f64,
}

impl Default for Proximity {
    /// Chosen: the middle of the ranges that work (docs/validation/nodes.md).
    fn default() -> Self {
        Self {
            range_cm: 5.0,
            half_angle_deg: 25.0,
            noise: 0.1,
            swing: 0.1,
            own_swing: 0.0,
            false_echoes_per_day: 0.0,
        }
    }
}

impl Proximity {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        check::within("range_cm", self.range_cm, 0.5..=50.0)?;
        check::within("half_angle_deg", self.half_angle_deg, 1.0..=80.0)?;
        check::within("noise", self.noise, 0.0..=10.0)?;
        check::within("swing", self.swing, 0.0..=10.0)?;
        check::within("own_swing", self.own_swing, 0.0..=10.0)?;
        check::within("false_echoes_per_day", self.false_echoes_per_day, 0.0..=288.0)
    }

    /// The sensors of `wall`, which are read each `period_h` hours; `seed` names their noise and daylight.
    #[must_use]
    pub fn sensors(&self, wall: &NodeWall, period_h: f64, seed: u64) -> ProximitySensors {
        let optics = wall.nodes.iter().map(|node| self.optics(node.at, node.facing)).collect();
        ProximitySensors { sensor: self.clone(), optics, period_h, seed }
    }

    /// The optics of a sensor at `at` that looks along `facing`.
    #[must_use]
    pub fn optics(&self, at: Vec3, facing: Vec3) -> Optics {
        let beam = Beam { facing, half_angle_deg: self.half_angle_deg };
        Optics {
            at,
            facing: normalize_or(facing, [0.0, 0.0, 1.0]),
            exponent: beam.exponent(),
            gain: self.gain(&beam),
        }
    }

    /// The factor of the echo that makes the range true: a stem across the axis echoes `2 r / d^3` times the integral of
    /// `cos^(n + 2)` over all angles.
    fn gain(&self, beam: &Beam) -> f64 {
        // Midpoints of 2 degrees, for beams of some 10 degrees and more.
        const PARTS: u32 = 90;
        let power = beam.exponent() + 2.0;
        let width = PI / f64::from(PARTS);
        let at = |part| exp(power * ln(cos((f64::from(part) + 0.5) * width - 0.5 * PI)));
        let integral: f64 = (0..PARTS).map(at).sum::<f64>() * width;
        (exp(READING_AT_RANGE) - 1.0) * self.range_cm.powi(3) / (2.0 * STEM_RADIUS_CM * integral)
    }
}

/// The optics of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optics {
    at: Vec3,
    /// Of length 1.
    facing: Vec3,
    /// Power of the cosine to the axis.
    exponent: f64,
    gain: f64,
}

impl Optics {
    /// The reading without noise and daylight: 0 where nothing is near.
    #[must_use]
    pub fn reading(&self, patches: &[Patch]) -> f64 {
        let echo = |patch: &Patch| {
            let towards = sub(patch.at, self.at);
            let far = norm(towards);
            let ahead = dot(towards, self.facing);
            if ahead <= 0.0 {
                return 0.0;
            }
            let share = exp(self.exponent * ln((ahead / far).min(1.0)));
            let far2 = far.max(LEAST_CM).powi(2);
            patch.area * share / (far2 * far2)
        };
        ln(1.0 + self.gain * patches.iter().map(echo).sum::<f64>())
    }
}

/// The proximity sensors of all nodes of a wall, with their noise and daylight.
#[derive(Clone, Debug)]
pub struct ProximitySensors {
    sensor: Proximity,
    /// Optics of the sensor of each node.
    optics: Vec<Optics>,
    period_h: f64,
    seed: u64,
}

impl Sensors<[Patch]> for ProximitySensors {
    fn read(&mut self, node: usize, step: u32, scene: Option<&[Patch]>) -> f64 {
        let Proximity { noise, swing, own_swing, false_echoes_per_day, .. } = self.sensor;
        let echo = scene.map_or(0.0, |patches| self.optics[node].reading(patches));
        let day = |number: usize, amplitude: f64| {
            let phase = draws(self.seed, Draw::Day, number).at(0).uniform();
            amplitude * sin(TAU * (f64::from(step) * self.period_h / 24.0 + phase))
        };
        let mut random = draws(self.seed, Draw::Reading, node).at(step);
        let is_false = random.uniform() < false_echoes_per_day * self.period_h / 24.0;
        let light = day(usize::MAX, swing) + day(node, own_swing);
        echo + light + noise * random.normal() + if is_false { FALSE_ECHO } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A straight stem parallel to x at `z` before the sensor.
    fn stem(z: f64) -> Vec<Patch> {
        let part =
            |number: i32| Patch { at: [0.1 * f64::from(number), 0.0, z], area: 0.1 * 2.0 * STEM_RADIUS_CM };
        (-1000..=1000).map(part).collect()
    }

    proptest! {
        #[test]
        fn a_stem_at_the_range_reads_four_standard_deviations(range_cm in 1.0..15.0, half_angle_deg in 10.0..60.0) {
            let sensor = Proximity { range_cm, half_angle_deg, ..Proximity::default() };
            let reading = sensor.optics([0.0; 3], [0.0, 0.0, 2.0]).reading(&stem(range_cm));
            prop_assert!((reading - READING_AT_RANGE).abs() < 0.02, "{reading}");
        }

        #[test]
        fn what_is_farther_echoes_less_and_what_is_behind_not_at_all(near in 1.0..20.0, farther in 0.1..20.0) {
            let optics = Proximity::default().optics([0.0; 3], [0.0, 0.0, 1.0]);
            let reading = |z| optics.reading(&stem(z));
            prop_assert!(reading(near) > reading(near + farther) && reading(-near) == 0.0);
        }
    }
}
