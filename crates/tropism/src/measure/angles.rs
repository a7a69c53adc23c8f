//! Plants of which only angles are known: that of the tip over time, perhaps that of the base of the zone, too.
//!
//! In: an [`AngleRecord`], such as protractor readings or published series. Out: how far, how fast and when the tip turned; with a
//! base also the constants of gravitropism in growth units. The model is that of Porat, Rivière and Meroz for a root with apical
//! sensing, whose curvature is uniform in the zone:
//!
//! `dA_tip/dt = -(G/R) beta~ sin(A_seen - A_P) - E (gamma~ - 1)(A_tip - A_base)`, `dA_base/dt = E (A_tip - A_base)`
//!
//! where A_seen follows A_tip with the time constant tau_g (memory of gravity), and A_P is the set point.
//!
//! # References
//! Porat, Rivière and Meroz 2024, Journal of Experimental Botany 75:620. Chauvet et al. 2016, doi:10.1038/srep35431.

use serde::{Deserialize, Serialize};

use super::estimate::{Estimate, Status};
use super::forcing::minimised;
use crate::math::statistics::{mean, robust_deviation};
use crate::math::{exp, ln, sin};

/// Angles of one plant over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AngleRecord {
    /// Times since the start, in h.
    pub times_h: Vec<f64>,
    /// Angle of the tip to the direction in which the organ grows at rest, in rad.
    pub tip: Vec<f64>,
    /// Angle at the base of the zone that bends, in rad; empty if it is not known.
    pub base: Vec<f64>,
    /// Elongation rate, in cm/h.
    pub growth_cm_h: Option<f64>,
    /// Radius, in cm.
    pub radius_cm: Option<f64>,
    /// Length of the zone that bends, in cm.
    pub zone_cm: Option<f64>,
}

/// Share of the record over which the fastest turning is a line. Chosen: half an hour of three, which averages readings by hand.
const RATE_SHARE: f64 = 1.0 / 6.0;
/// Readings that the fit of both angles uses; more are thinned. Chosen: one in two minutes and a half of three hours.
const FIT_READINGS: usize = 75;
/// Deviation of the fit of both angles that is usual, in rad: what the model leaves of published roots. It weighs them against the
/// prior.
const MISFIT_RAD: f64 = 0.03;
/// Longest step of the integration, as a share of the record.
const STEP_SHARE: f64 = 1.0 / 400.0;

impl AngleRecord {
    /// The constants of the plant.
    #[must_use]
    pub fn estimates(&self) -> Vec<Estimate> {
        let mut all = self.turning();
        if !self.base.is_empty() {
            all.extend(self.gravitropism());
        }
        all
    }

    /// The first `hours` of the record.
    #[must_use]
    pub fn until(&self, hours: f64) -> Self {
        let count = self.times_h.iter().take_while(|time| **time <= hours + 1e-9).count();
        let first = |values: &[f64]| values[..count.min(values.len())].to_vec();
        Self { times_h: first(&self.times_h), tip: first(&self.tip), base: first(&self.base), ..self.clone() }
    }

    /// Net turn, fastest turning, and the time at which the tangent of the fastest turning leaves the first angle.
    fn turning(&self) -> Vec<Estimate> {
        let degrees: Vec<f64> = self.tip.iter().map(|angle| angle.to_degrees()).collect();
        let count = degrees.len();
        // White noise has six times its variance in second differences.
        let second: Vec<f64> =
            degrees.windows(3).map(|three| (three[0] - 2.0 * three[1] + three[2]).abs()).collect();
        let noise = robust_deviation(&second) / 6_f64.sqrt();
        let ends = (count / 12).clamp(1, 6);
        let (first, last) =
            (mean(degrees[..ends].iter().copied()), mean(degrees[count - ends..].iter().copied()));
        let turn = last - first;
        let half = 1.645 * noise * (2.0 / ends as f64).sqrt();
        let window = ((count as f64 * RATE_SHARE).round() as usize).clamp(3, count);
        let lines = (0..=count - window).map(|start| {
            let (times, angles) = (&self.times_h[start..start + window], &degrees[start..start + window]);
            let (middle, level) = (mean(times.iter().copied()), mean(angles.iter().copied()));
            let over: f64 =
                times.iter().zip(angles).map(|(time, angle)| (time - middle) * (angle - level)).sum();
            let spread: f64 = times.iter().map(|time| (time - middle).powi(2)).sum();
            (over / spread, middle, level, spread)
        });
        let fastest =
            lines.max_by(|one, other| (one.0 * turn.signum()).total_cmp(&(other.0 * turn.signum())));
        let (rate, middle, level, spread) = fastest.unwrap_or((0.0, 0.0, 0.0, 1.0));
        let of_rate = 1.645 * noise / spread.sqrt();
        let estimate = |symbol: &str, value: f64, half: f64| Estimate {
            symbol: symbol.to_owned(),
            value,
            interval: [value - half, value + half],
            status: Status::Measured,
            reason: String::new(),
        };
        let is_turned = turn.abs() > 3.0 * half && rate.abs() > of_rate;
        let lag = middle - (level - first) / rate;
        let lag = if is_turned {
            estimate("lag", lag, crate::math::hypot(half / rate.abs(), (middle - lag) * of_rate / rate.abs()))
        } else {
            Estimate::not_identified("lag", "the tip hardly turns")
        };
        vec![estimate("turn", turn, half), estimate("v_max", rate, of_rate), lag]
    }

    /// The constants in growth units, of the tip and the base.
    ///
    /// Published series are smoothed, so that their residuals say nothing of errors: only groups have intervals.
    fn gravitropism(&self) -> Vec<Estimate> {
        const SYMBOLS: [&str; 7] = ["E", "Lc", "B", "beta~", "gamma~", "tau_g", "A_P"];
        let (Some(growth), Some(radius)) = (self.growth_cm_h, self.radius_cm) else {
            let reason = "no elongation rate or no radius is given";
            return SYMBOLS.map(|symbol| Estimate::not_identified(symbol, reason)).to_vec();
        };
        let is_known =
            growth > 0.0 && radius > 0.0 && self.tip.iter().chain(&self.base).all(|angle| angle.is_finite());
        if !is_known {
            let reason = "elongation rate, radius or angles are missing";
            return SYMBOLS.map(|symbol| Estimate::not_identified(symbol, reason)).to_vec();
        }
        let duration = self.times_h.last().copied().unwrap_or(0.0);
        // Wide: two thirds within a factor of 4 of a plant that turns within a sixth of the record.
        let start =
            [ln(6.0 / duration * radius / growth), ln(3.0), ln(6.0 / duration), ln(duration / 15.0), 0.0];
        let widths = [1.4, 1.0, 1.4, 1.0, 0.3];
        let cost = |numbers: [f64; 5]| {
            let prior: f64 = (0..5).map(|at| ((numbers[at] - start[at]) / widths[at]).powi(2)).sum();
            self.misfit(numbers, growth / radius) / (MISFIT_RAD * MISFIT_RAD) + prior
        };
        // A second search from where the first ended leaves its collapsed simplex.
        let best = minimised(start, 0.5, 500, cost);
        let [beta, gamma, rate, memory, set_point] = minimised(best, 0.3, 500, cost);
        let convergence = radius * exp(gamma - beta);
        let estimate = |symbol: &str, value: f64| Estimate {
            symbol: symbol.to_owned(),
            value,
            interval: [f64::NAN; 2],
            status: Status::Provisional,
            reason: "an interval needs a group: residuals of smoothed angles say nothing of errors"
                .to_owned(),
        };
        let balance = match self.zone_cm.filter(|zone| *zone > 0.0) {
            Some(zone) => estimate("B", zone / convergence),
            None => Estimate::not_identified("B", "no length of the zone is given"),
        };
        vec![
            estimate("E", exp(rate)),
            estimate("Lc", convergence),
            balance,
            estimate("beta~", exp(beta)),
            estimate("gamma~", exp(gamma)),
            estimate("tau_g", exp(memory)),
            estimate("A_P", set_point.to_degrees()),
        ]
    }

    /// Mean square of the deviations of both angles times [`FIT_READINGS`].
    fn misfit(&self, [beta, gamma, rate, memory, set_point]: [f64; 5], growth_per_radius: f64) -> f64 {
        let [beta, gamma, rate, memory] = [beta, gamma, rate, memory].map(exp);
        let duration = self.times_h.last().copied().unwrap_or(0.0);
        let every = self.times_h.len().div_ceil(FIT_READINGS);
        let (mut tip, mut base, mut seen) = (self.tip[0], self.base[0], 0.0);
        let (mut sum, mut count, mut now) = (0.0, 0.0, self.times_h[0]);
        let slopes = |[tip, base, seen]: [f64; 3]| {
            [
                -growth_per_radius * beta * sin(seen) - rate * (gamma - 1.0) * (tip - base),
                rate * (tip - base),
                // What is seen before the stimulus is the set point.
                (tip - set_point - seen) / memory,
            ]
        };
        for (number, time) in self.times_h.iter().enumerate().step_by(every) {
            let steps = ((time - now) / (duration * STEP_SHARE)).ceil().max(0.0) as usize;
            let dt = (time - now) / steps.max(1) as f64;
            for _ in 0..steps {
                let state = [tip, base, seen];
                let first = slopes(state);
                let second = slopes(core::array::from_fn(|at| state[at] + dt * first[at]));
                [tip, base, seen] =
                    core::array::from_fn(|at| state[at] + 0.5 * dt * (first[at] + second[at]));
            }
            now = *time;
            sum += (tip - self.tip[number]).powi(2) + (base - self.base[number]).powi(2);
            count += 2.0;
        }
        // Unstable numbers are no fit.
        let mean = sum / count;
        if mean.is_finite() { mean * FIT_READINGS as f64 } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_has_its_size_its_rate_and_its_lag() {
        let times_h: Vec<f64> = (0..37).map(|k| f64::from(k) / 12.0).collect();
        // 60 degrees an hour from 1 h on, for 45 minutes.
        let tip = times_h.iter().map(|time| (60.0 * (time - 1.0).clamp(0.0, 0.75)).to_radians()).collect();
        let found = AngleRecord { times_h, tip, ..AngleRecord::default() }.estimates();
        for (estimate, wanted) in found.iter().zip([45.0, 60.0, 1.0]) {
            assert!((estimate.value - wanted).abs() < 0.5, "{estimate:?}");
        }
    }

    #[test]
    fn a_root_of_the_model_is_recovered() {
        let truth = [0.25, 2.5, 0.25, 1.0, 0.1];
        let (growth, radius) = (0.0129, 0.0065);
        let times_h: Vec<f64> = (0..150).map(|k| f64::from(k) / 6.0).collect();
        let mut state = [1.5, 1.5, 0.0];
        let (mut tip, mut base) = (Vec::new(), Vec::new());
        for _ in &times_h {
            tip.push(state[0]);
            base.push(state[1]);
            for _ in 0..100 {
                let [a, b, seen] = state;
                let rate = [
                    -growth / radius * truth[0] * sin(seen) - truth[2] * (truth[1] - 1.0) * (a - b),
                    truth[2] * (a - b),
                    (a - truth[4] - seen) / truth[3],
                ];
                state = core::array::from_fn(|at| state[at] + rate[at] / 600.0);
            }
        }
        let (growth_cm_h, radius_cm) = (Some(growth), Some(radius));
        let record = AngleRecord { times_h, tip, base, growth_cm_h, radius_cm, zone_cm: Some(0.06) };
        let found = record.estimates();
        let value = |symbol: &str| found.iter().find(|estimate| estimate.symbol == symbol).unwrap().value;
        assert!((value("E") / 0.25 - 1.0).abs() < 0.05, "{found:?}");
        assert!((value("Lc") / 0.065 - 1.0).abs() < 0.05, "{found:?}");
        assert!((value("B") / 0.923 - 1.0).abs() < 0.05, "{found:?}");
    }
}
