//! Circumnutation: period and amplitude of the swing of the tip, and whether there is one.
//!
//! In: the angle of the tip over time, what the plant responds with taken off. Out: period and amplitude with intervals, and how many
//! cycles they rest on. The one idea: red noise swings, too; so a Gaussian process with an oscillation whose phase wanders must
//! beat one without, both on top of a straight drift.
//!
//! # References
//! Rasmussen and Williams 2006, *Gaussian Processes for Machine Learning*, sections 2.7 and 5.4.1.

use core::f64::consts::{SQRT_2, TAU};

use serde::Serialize;

use super::estimate::{Estimate, Status};
use super::forcing::{durbin, minimised};
use crate::math::cholesky::Cholesky;
use crate::math::matrix::solve;
use crate::math::statistics::{mean, standard_deviation};
use crate::math::vector::dot_slices;
use crate::math::{cos, exp, ln};

/// Gain in log likelihood over red noise from which a swing is believed. Measured on simulated red noise: the 95 % point of 40 records
/// of 9 h is 5.0.
const MIN_GAIN: f64 = 5.0;
/// Cycles from which a period is measured, and is provisional. Chosen: under two, a drift looks the same.
const CYCLES: [f64; 2] = [4.0, 2.0];
/// Frames a cycle below which a period could be an alias. Chosen: four times those of the sampling theorem.
const MIN_FRAMES_A_CYCLE: f64 = 8.0;
/// Most points of the series; more readings are averaged. Chosen: eight a cycle for twelve cycles.
const MAX_POINTS: usize = 97;
/// Rise of the deviance at the ends of the profile interval: twice the half width of a 90 % interval, four times 2.71. Measured: as
/// the phase wanders, the simple interval holds the period in 71 to 83 % of simulated records, the doubled one in 75 to 92.
const PROFILE_RISE: f64 = 10.8;
/// Calls of the likelihood in a search, and at each value of the profile. Chosen by hand, for time: what more calls gain was not measured.
const CALLS: usize = 120;
const PROFILE_CALLS: usize = 40;

/// The swing of a tip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Circumnutation {
    /// Period `T_cn`, in h.
    pub period: Estimate,
    /// Amplitude `A_cn` of the angle of the upper third of the stem, in degrees; in one plane, so that a swing across it is missed.
    pub amplitude: Estimate,
    /// Cycles in the record; 0 without a swing.
    pub cycles: f64,
    /// Gain in log likelihood over red noise.
    pub gain: f64,
}

/// The numbers of the Gaussian process, as logarithms: red noise (deviation, time), white noise, swing (deviation, period,
/// coherence).
type Numbers = [f64; 6];

/// An angle at equal times.
struct Series {
    values: Vec<f64>,
    step_h: f64,
    scale: f64,
    duration_h: f64,
}

impl Series {
    /// The means of readings around equal times; where there is none, the line between its neighbours.
    fn of(times_h: &[f64], angles: &[f64]) -> Self {
        let count = angles.len().min(MAX_POINTS);
        let start = times_h[0];
        let duration_h = times_h[times_h.len() - 1] - start;
        let step_h = duration_h / (count - 1) as f64;
        let value = |point: usize| {
            let time = start + point as f64 * step_h;
            let near = times_h.iter().zip(angles).filter(|(other, _)| (*other - time).abs() <= 0.5 * step_h);
            let (sum, found) = near.fold((0.0, 0.0), |(sum, found), (_, angle)| (sum + angle, found + 1.0));
            if found > 0.0 {
                return sum / found;
            }
            let after = times_h.partition_point(|other| *other < time).clamp(1, times_h.len() - 1);
            let share = (time - times_h[after - 1]) / (times_h[after] - times_h[after - 1]);
            angles[after - 1] + share * (angles[after] - angles[after - 1])
        };
        let values: Vec<f64> = (0..count).map(value).collect();
        let middle = mean(values.iter().copied());
        let values: Vec<f64> = values.into_iter().map(|value| value - middle).collect();
        let scale = standard_deviation(&values).max(1e-6);
        Self { values, step_h, scale, duration_h }
    }

    /// Covariances of the values at each lag.
    fn covariances(&self, numbers: &Numbers, swings: bool) -> Vec<f64> {
        let [red, red_h, white, ..] = numbers.map(exp);
        let covariance = |lag: usize| red * red * exp(-(lag as f64 * self.step_h) / red_h);
        let mut lags: Vec<f64> = (0..self.values.len()).map(covariance).collect();
        if swings {
            lags.iter_mut().zip(self.covariances_of_swing(numbers)).for_each(|(lag, swing)| *lag += swing);
        }
        lags[0] += white * white + 1e-8 * self.scale * self.scale;
        lags
    }

    /// Covariances of the swing at each lag.
    fn covariances_of_swing(&self, numbers: &Numbers) -> Vec<f64> {
        let [.., swing, period, coherence] = numbers.map(exp);
        let covariance = |lag: usize| {
            let time = lag as f64 * self.step_h;
            swing * swing * exp(-time / coherence) * cos(TAU * time / period)
        };
        (0..self.values.len()).map(covariance).collect()
    }

    /// Twice the negative logarithm of the restricted likelihood, constant and drift projected out, with a wide prior of the times.
    fn deviance(&self, numbers: &Numbers, swings: bool) -> f64 {
        let [_, red_h, _, _, period, coherence] = numbers.map(exp);
        let lags = self.covariances(numbers, swings);
        let mut whitened: [Vec<f64>; 3] = Default::default();
        let ln_determinant = durbin(&lags, |place, weights, variance| {
            let (mut value, mut one, mut time) = (0.0, 0.0, 0.0);
            for (back, weight) in weights.iter().enumerate() {
                value += weight * self.values[place - back];
                one += weight;
                time += weight * (place - back) as f64;
            }
            let sd = variance.sqrt();
            whitened.iter_mut().zip([value, one, time]).for_each(|(all, error)| all.push(error / sd));
        });
        let Some(ln_determinant) = ln_determinant else { return f64::INFINITY };
        let [y, one, time] = whitened;
        let (aa, ab, bb) = (dot_slices(&one, &one), dot_slices(&one, &time), dot_slices(&time, &time));
        let (ay, by) = (dot_slices(&one, &y), dot_slices(&time, &y));
        let determinant = aa * bb - ab * ab;
        let explained = (bb * ay * ay - 2.0 * ab * ay * by + aa * by * by) / determinant;
        let apart = |value: f64, middle: f64| ((ln(value) - ln(middle)) / ln(3.0)).powi(2);
        let prior =
            apart(red_h, self.duration_h / 12.0) + if swings { apart(coherence, 4.0 * period) } else { 0.0 };
        ln_determinant + ln(determinant) + dot_slices(&y, &y) - explained + prior
    }

    /// The standard deviation of the swing in this very record: its root mean square given the angles, by the posterior of the
    /// Gaussian process with these numbers (Rasmussen and Williams, eqs. 2.25 and 2.26). The one of the process is that of all records
    /// which could have been, and the search for it is short.
    fn swing_deviation(&self, numbers: &Numbers) -> Option<f64> {
        let count = self.values.len();
        let (all, swing) = (self.covariances(numbers, true), self.covariances_of_swing(numbers));
        let lags = (0..count * count).map(|at| (at / count).abs_diff(at % count));
        let factor = Cholesky::of(lags.map(|lag| all[lag]).collect(), count)?;
        // Constant and drift by generalised least squares.
        let [one, line] = [vec![1.0; count], (0..count).map(|row| row as f64).collect::<Vec<f64>>()];
        let [of_one, of_line, of_values] = [&one, &line, &self.values].map(|values| factor.solve(values));
        let matrix = [&one, &line].map(|row| [&of_one, &of_line].map(|column| dot_slices(row, column)));
        let [constant, slope] = solve(matrix, [&one, &line].map(|row| dot_slices(row, &of_values)))?;
        let weights: Vec<f64> =
            (0..count).map(|row| of_values[row] - constant * of_one[row] - slope * of_line[row]).collect();
        let square = |row: usize| {
            let covariance: Vec<f64> = (0..count).map(|column| swing[row.abs_diff(column)]).collect();
            let whitened = factor.solve_lower(&covariance);
            dot_slices(&covariance, &weights).powi(2) + swing[0] - dot_slices(&whitened, &whitened)
        };
        Some(mean((0..count).map(square)).sqrt())
    }
}

/// Lamps that change within a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampCycle {
    /// Twice the mean time between two changes, in h; infinite of one change.
    pub period_h: f64,
    /// Whether the response to them is taken off.
    pub is_explained: bool,
}

impl LampCycle {
    /// The cycle of lamps that are lit as `lamps` says at `times_h`; `None` if they never change.
    #[must_use]
    pub fn of<L: PartialEq>(times_h: &[f64], lamps: &[L], is_explained: bool) -> Option<Self> {
        let changes: Vec<f64> = lamps
            .windows(2)
            .zip(times_h)
            .filter(|(pair, _)| pair[0] != pair[1])
            .map(|(_, time)| *time)
            .collect();
        let (first, last) = (changes.first()?, changes.last()?);
        let intervals = (changes.len() - 1) as f64;
        let period_h = if intervals > 0.0 { 2.0 * (last - first) / intervals } else { f64::INFINITY };
        Some(Self { period_h, is_explained })
    }
}

/// Looks for circumnutation in the angle of a tip, in rad, at times in h. With `lamps` that change the record holds a response,
/// whose period is no circumnutation.
#[must_use]
pub fn circumnutation(times_h: &[f64], angles: &[f64], lamps: Option<LampCycle>) -> Circumnutation {
    let none = |reason: &str, gain: f64| Circumnutation {
        period: Estimate::not_identified("T_cn", reason),
        amplitude: Estimate::not_identified("A_cn", reason),
        cycles: 0.0,
        gain,
    };
    if angles.len() < super::record::MIN_FRAMES {
        return none("too few frames", 0.0);
    }
    let series = Series::of(times_h, angles);
    let Series { scale, duration_h, step_h, .. } = series;
    let start = [scale, duration_h / 12.0, 0.2 * scale, scale, duration_h / 4.0, duration_h].map(ln);
    let red = minimised([start[0], start[1], start[2]], 0.7, CALLS, |[red, time, white]| {
        series.deviance(&[red, time, white, 0.0, 0.0, 0.0], false)
    });
    let of_red = series.deviance(&[red[0], red[1], red[2], 0.0, 0.0, 0.0], false);
    // The likelihood has many maxima over the period: each of a grid is a start, and the best is refined.
    let shortest = 3.0 * step_h;
    let count = (ln(duration_h / shortest) / ln(1.15)).ceil().max(1.0) as usize;
    let at = |k: usize| {
        let period = ln(shortest) + k as f64 * ln(1.15);
        let numbers = [red[0] - 0.7, red[1], red[2], ln(0.7 * scale), period, period + ln(4.0)];
        (series.deviance(&numbers, true), numbers)
    };
    let grid: Vec<(f64, Numbers)> = (0..=count).map(at).collect();
    let best = grid.iter().min_by(|one, other| one.0.total_cmp(&other.0)).expect("the grid is not empty").1;
    let best = minimised(best, 0.3, 2 * CALLS, |numbers| series.deviance(&numbers, true));
    let of_best = series.deviance(&best, true);
    let gain = 0.5 * (of_red - of_best);
    let [.., ln_period, _] = best;
    let period = exp(ln_period);
    if gain < MIN_GAIN {
        return none("no swing beyond red noise", gain);
    }
    let cycles = duration_h / period;
    let profile = |direction: f64| {
        let mut numbers = best;
        let step = 0.03 * direction;
        for k in 1..=40 {
            let fixed = ln_period + step * f64::from(k);
            let others = [numbers[0], numbers[1], numbers[2], numbers[3], numbers[5]];
            let with = |[a, b, c, d, f]: [f64; 5]| [a, b, c, d, fixed, f];
            let found = minimised(others, 0.2, PROFILE_CALLS, |others| series.deviance(&with(others), true));
            numbers = with(found);
            if series.deviance(&numbers, true) - of_best > PROFILE_RISE {
                return exp(fixed);
            }
        }
        exp(ln_period + 40.0 * step)
    };
    let interval = [profile(-1.0), profile(1.0)];
    let (status, reason) = match () {
        () if period < MIN_FRAMES_A_CYCLE * step_h => {
            (Status::NotIdentified, "fewer than 8 frames a cycle: it could be an alias".to_owned())
        }
        () if cycles < CYCLES[1] => {
            (Status::NotIdentified, format!("{cycles:.1} cycles only: at least {} are wanted", CYCLES[0]))
        }
        () if cycles < CYCLES[0] => {
            (Status::Provisional, format!("{cycles:.1} cycles only: at least {} are wanted", CYCLES[0]))
        }
        () if lamps.is_some_and(|lamps| (interval[0]..=interval[1]).contains(&lamps.period_h)) => {
            (Status::NotIdentified, "the period is that of the lamps: it may be their response".to_owned())
        }
        () if lamps.is_some_and(|lamps| !lamps.is_explained) => {
            (Status::Provisional, "the lamps change within the record".to_owned())
        }
        () => (Status::Measured, String::new()),
    };
    let period =
        Estimate { symbol: "T_cn".to_owned(), value: period, interval, status, reason: reason.clone() };
    // A swing of standard deviation s has the amplitude s sqrt 2; each cycle gives it anew.
    let amplitude = series.swing_deviation(&best).unwrap_or(f64::NAN) * SQRT_2;
    let half = 1.645 / (2.0 * cycles).sqrt();
    let amplitude =
        Estimate { status, reason, ..Estimate::log_normal("A_cn", ln(amplitude.to_degrees()), half) };
    Circumnutation { period, amplitude, cycles, gain }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{self, Purpose};

    fn series(period_h: f64, amplitude: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
        let mut draws = random::stream(seed, Purpose::SegmentNoise, 0);
        let (mut red, mut phase) = (0.0, 1.0);
        let times: Vec<f64> = (0..97).map(|k| f64::from(k) / 8.0).collect();
        let angles = times.iter().map(|time| {
            red = 0.85 * red + 0.02 * random::normal(&mut draws);
            phase += TAU / 8.0 / period_h + 0.05 * random::normal(&mut draws);
            red + 0.01 * time + amplitude * cos(phase)
        });
        (times.clone(), angles.collect())
    }

    #[test]
    fn the_cycle_of_lamps_is_from_their_changes() {
        let times: Vec<f64> = (0..30).map(f64::from).collect();
        let cycle = |lamps: &[u8]| LampCycle::of(&times, lamps, false).map(|cycle| cycle.period_h);
        assert_eq!(cycle(&[0; 30]), None);
        assert_eq!(cycle(&(0..30).map(|hour| hour / 6 % 2).collect::<Vec<_>>()), Some(12.0));
        assert_eq!(cycle(&(0..30).map(|hour| hour / 20).collect::<Vec<_>>()), Some(f64::INFINITY));
    }

    #[test]
    fn a_swing_is_found_with_its_period_and_red_noise_is_none() {
        let (times, angles) = series(1.7, 0.1, 1);
        let found = circumnutation(&times, &angles, None);
        assert_eq!(found.period.status, Status::Measured, "{found:?}");
        assert!((found.period.value / 1.7 - 1.0).abs() < 0.1, "{found:?}");
        assert!((found.period.interval[0]..found.period.interval[1]).contains(&1.7), "{found:?}");
        for (amplitude, seed) in [(0.05, 4), (0.1, 1), (0.2, 5), (0.5, 6)] {
            let (times, angles) = series(1.7, amplitude, seed);
            let found = circumnutation(&times, &angles, None).amplitude.value;
            assert!((found / amplitude.to_degrees() - 1.0).abs() < 0.2, "{found} for {amplitude}");
        }
        let (times, angles) = series(1.7, 0.0, 2);
        assert_eq!(circumnutation(&times, &angles, None).period.status, Status::NotIdentified);
        // A swing with the period of lamps that change may be the response to them.
        let (times, angles) = series(1.7, 0.1, 1);
        let period = |lamps| circumnutation(&times, &angles, Some(lamps)).period.status;
        let lamps = LampCycle { period_h: 1.75, is_explained: true };
        assert_eq!(period(lamps), Status::NotIdentified);
        assert_eq!(period(LampCycle { period_h: 12.0, ..lamps }), Status::Measured);
        assert_eq!(period(LampCycle { period_h: 12.0, is_explained: false }), Status::Provisional);
        // Three cycles are provisional.
        let (times, angles) = series(4.0, 0.2, 3);
        assert_eq!(circumnutation(&times, &angles, None).period.status, Status::Provisional);
    }
}
