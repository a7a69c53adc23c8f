//! Physiological experiments on one bean, for comparison with published kinematics.
//!
//! In: an individual, and the length of its stem at the start. Out: the time course of the apex. The plant is noise-free and
//! grows upright in the dark. Experiments on tropisms run without circumnutation, which would mask small angles.

use core::f64::consts::TAU;

use tropism::math;
use tropism::math::statistics::mean;
use tropism::math::vector::Vec3;

use super::{Bean, Individual};

/// Powers of the paper's two lamps: both dark, and the right one lit.
const DARK: [f64; 2] = [0.0, 0.0];
const RIGHT: [f64; 2] = [0.0, 1.0];
/// Time between two looks at a plant that grows to a length in the dark, in min. Chosen by hand: it grows 0.03 cm.
const WAITING_MIN: f64 = 5.0;
/// Minutes between two readings. Chosen: a tenth of the shortest lag that was published.
const READING_MIN: f64 = 1.0;
/// Interval over which the set point is averaged, in h since the change. Chosen by hand: after the overshoot.
const SETTLED_H: [f64; 2] = [10.0, 14.0];
/// Rotation of the apex that ends the lag, in degrees. Chosen by hand.
const BEGUN_DEG: f64 = 2.0;
/// Deviation from the set point that counts as a swing, in degrees. Chosen by hand.
const SWING_DEG: f64 = 15.0;

/// Angle of the apex after a stimulus: readings a minute apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Angle of the apex to the vertical, towards positive x, in degrees; the first reading is from before the change.
    pub degrees: Vec<f64>,
}

impl Response {
    /// Time of a reading, in h since the change.
    #[must_use]
    pub fn hours(&self, reading: usize) -> f64 {
        reading as f64 * READING_MIN / 60.0
    }

    /// Time until the apex has turned by two degrees, in min; infinite if it never does.
    #[must_use]
    pub fn lag_min(&self) -> f64 {
        let begun = self.degrees.iter().position(|degrees| (degrees - self.degrees[0]).abs() > BEGUN_DEG);
        begun.map_or(f64::INFINITY, |reading| reading as f64 * READING_MIN)
    }

    /// Maximum rotation rate over a quarter of an hour, in degrees per hour.
    #[must_use]
    pub fn max_rate_deg_h(&self) -> f64 {
        self.degrees.windows(16).map(|turn| (turn[15] - turn[0]).abs() * 4.0).fold(0.0, f64::max)
    }

    /// Set point: mean angle from 10 to 14 hours after the stimulus, in degrees.
    #[must_use]
    pub fn set_point_deg(&self) -> f64 {
        let [from, to] = SETTLED_H.map(|hours| (hours * 60.0 / READING_MIN) as usize);
        let settled = &self.degrees[from.min(self.degrees.len() - 1)..to.min(self.degrees.len())];
        mean(settled.iter().copied())
    }

    /// Maximum overshoot beyond the set point, in degrees.
    #[must_use]
    pub fn overshoot_deg(&self) -> f64 {
        let set_point = self.set_point_deg();
        let sign = (set_point - self.degrees[0]).signum();
        self.degrees.iter().map(|degrees| sign * (degrees - set_point)).fold(0.0, f64::max)
    }

    /// The reading with the largest angle towards positive x, and that angle, in degrees.
    #[must_use]
    pub fn peak(&self) -> (usize, f64) {
        let first = (0, f64::NEG_INFINITY);
        self.degrees
            .iter()
            .copied()
            .enumerate()
            .fold(first, |best, now| if now.1 > best.1 { now } else { best })
    }

    /// Relaxation time: the angle falls to 1/e of its first value, in h; infinite if it never does.
    #[must_use]
    pub fn relaxation_h(&self) -> f64 {
        let rest = self.degrees[0].abs() / core::f64::consts::E;
        let fallen = self.degrees.iter().position(|degrees| degrees.abs() <= rest);
        fallen.map_or(f64::INFINITY, |reading| self.hours(reading))
    }

    /// How often the apex left its set point by more than 15 degrees once it had reached it.
    #[must_use]
    pub fn swings(&self) -> usize {
        let set_point = self.set_point_deg();
        let sign = (set_point - self.degrees[0]).signum();
        let reached = self.degrees.iter().position(|degrees| sign * (degrees - set_point) >= 0.0);
        let after = &self.degrees[reached.unwrap_or(self.degrees.len())..];
        let is_out = |degrees: &f64| (degrees - set_point).abs() > SWING_DEG;
        after.windows(2).filter(|pair| is_out(&pair[1]) && !is_out(&pair[0])).count()
    }

    /// Settling time: the apex stays within 15 degrees of its set point, in h.
    #[must_use]
    pub fn settling_h(&self) -> f64 {
        let set_point = self.set_point_deg();
        let last_out = self.degrees.iter().rposition(|degrees| (degrees - set_point).abs() > SWING_DEG);
        last_out.map_or(0.0, |reading| self.hours(reading + 1))
    }
}

/// Phototropism: the right lamp is lit for `hours`.
#[must_use]
pub fn phototropic_step(individual: &Individual, length: f64, hours: f64) -> Response {
    respond(upright(&still(individual), length), |_| RIGHT, hours)
}

/// Phototropic pulse: the right lamp is lit for `minutes`, then dark; `hours` in all.
#[must_use]
pub fn light_pulse(individual: &Individual, length: f64, minutes: f64, hours: f64) -> Response {
    let lamps = |minute| if minute < minutes { RIGHT } else { DARK };
    respond(upright(&still(individual), length), lamps, hours)
}

/// Gravitropism: the pot is tipped by `degrees` towards positive x, in the dark, for `hours`.
#[must_use]
pub fn gravitropic_step(individual: &Individual, length: f64, degrees: f64, hours: f64) -> Response {
    let mut bean = upright(&still(individual), length);
    bean.tip_over(degrees * TAU / 360.0);
    respond(bean, |_| DARK, hours)
}

/// Autotropic straightening: the plant bends under the right lamp for `bending_h`, then straightens in the dark on a
/// clinostat for `hours`.
///
/// A clinostat rotates the plant, so that it perceives no direction of gravity; its weight still acts.
#[must_use]
pub fn straightening(individual: &Individual, length: f64, bending_h: f64, hours: f64) -> Response {
    let mut bean = upright(&still(individual), length);
    bean.advance(&RIGHT, bending_h * 60.0);
    let tropism = &mut bean.plant.tropism;
    // gamma depends on both sensitivities: the balance number compensates for the removed one.
    tropism.balance *= tropism.light / (tropism.light + tropism.gravity);
    tropism.gravity = 0.0;
    respond(bean, |_| DARK, hours)
}

/// Circumnutation of the apex in the dark.
#[derive(Clone, Debug, PartialEq)]
pub struct Circumnutation {
    /// The apex every minute, in cm.
    pub path: Vec<Vec3>,
    /// Mean time of a turn, in min.
    pub period_min: f64,
    /// Half the way from side to side in x, mean of all turns, in cm.
    pub amplitude: f64,
}

/// Measures circumnutation in the dark for `hours`.
#[must_use]
pub fn circumnutation(individual: &Individual, length: f64, hours: f64) -> Circumnutation {
    let mut bean = upright(individual, length);
    let path: Vec<Vec3> = (0..(hours * 60.0 / READING_MIN) as usize)
        .map(|_| {
            bean.advance(&DARK, READING_MIN);
            bean.apex()
        })
        .collect();
    let window = (individual.nutation.period_h * 60.0 / READING_MIN) as usize;
    let sway: Vec<f64> = path
        .windows(window)
        .map(|turn| turn[window / 2][0] - mean(turn.iter().map(|apex| apex[0])))
        .collect();
    let crossings: Vec<f64> = sway
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| pair[0] < 0.0 && pair[1] >= 0.0)
        .map(|(reading, pair)| reading as f64 + pair[0] / (pair[0] - pair[1]))
        .collect();
    let turns = crossings.len().saturating_sub(1) as f64;
    let (first, last) = (crossings.first().copied(), crossings.last().copied());
    let period_min = (last.unwrap_or(f64::NAN) - first.unwrap_or(f64::NAN)) / turns * READING_MIN;
    // The mean of |sin| is 2 over pi.
    let swing = mean(sway.iter().map(|x| x.abs()));
    Circumnutation { path, period_min, amplitude: swing * TAU / 4.0 }
}

/// The individual without circumnutation.
fn still(individual: &Individual) -> Individual {
    let mut still = individual.clone();
    still.nutation.curvature = 0.0;
    still
}

/// A noise-free plant that grew to `length` in the dark.
fn upright(individual: &Individual, length: f64) -> Bean {
    let mut bean = Bean::noise_free(individual.clone());
    while bean.length() < length && bean.age_h() < 1000.0 {
        bean.advance(&DARK, WAITING_MIN);
    }
    bean
}

fn respond(mut bean: Bean, lamps: impl Fn(f64) -> [f64; 2], hours: f64) -> Response {
    let angle = |bean: &Bean| {
        let heading = bean.pose().heading;
        math::atan2(heading[0], heading[1]) * 360.0 / TAU
    };
    let mut degrees = vec![angle(&bean)];
    for reading in 0..(hours * 60.0 / READING_MIN) as u32 {
        bean.advance(&lamps(f64::from(reading) * READING_MIN), READING_MIN);
        degrees.push(angle(&bean));
    }
    Response { degrees }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_response_is_read_off_its_course() {
        let rise = |minute: f64| if minute < 30.0 { 0.0 } else { (minute - 30.0) / 60.0 * 40.0 };
        let course = (0..900).map(|minute| rise(f64::from(minute)).min(45.0));
        let response = Response { degrees: course.collect() };
        assert_eq!(response.lag_min(), 34.0);
        assert!((response.max_rate_deg_h() - 40.0).abs() < 1e-9);
        assert!((response.set_point_deg() - 45.0).abs() < 1e-9);
        assert_eq!(response.swings(), 0);
        assert!(response.overshoot_deg() < 1e-9);
        assert!((response.settling_h() - 75.0 / 60.0).abs() < 0.05);
    }

    #[test]
    fn gravity_rights_a_tipped_plant() {
        let response = gravitropic_step(&Individual::default(), 10.0, 60.0, 12.0);
        assert!((response.degrees[0] - 60.0).abs() < 3.0, "{}", response.degrees[0]);
        assert!(response.degrees.last().unwrap().abs() < 30.0);
    }

    #[test]
    fn a_bent_plant_straightens_within_hours() {
        let response = straightening(&Individual::default(), 10.0, 6.0, 24.0);
        assert!(response.degrees[0] > 30.0, "{}", response.degrees[0]);
        assert!((1.0..10.0).contains(&response.relaxation_h()), "{} h", response.relaxation_h());
    }

    #[test]
    fn a_longer_pulse_bends_farther() {
        let plant = Individual::default();
        let farthest =
            |minutes| light_pulse(&plant, 10.0, minutes, 4.0).degrees.into_iter().fold(0.0, f64::max);
        assert!(farthest(40.0) > 1.5 * farthest(20.0) && farthest(20.0) > 1.0);
    }
}
