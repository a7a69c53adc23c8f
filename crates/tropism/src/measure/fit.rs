//! The fit of the rod to all points of all frames, its forcing marginalised.
//!
//! The plant forces itself: it circumnutates and drifts. Least squares that take this for noise of the camera give constants that
//! are far too certain. Here the forcing is a Gaussian process that is estimated with the constants (a smoother in batch form): each
//! Gauss-Newton step solves for the numbers of the rod and for the forcing at its knots together. Amplitudes and times of the
//! forcing, and the noise of the points, are those of the greatest restricted likelihood (REML). The posterior covariance of the
//! rod's numbers then allows for what the forcing could have done.
//!
//! Points are compared across the stem only: an error of the length shifts all points along it.
//!
//! # References
//! Tarantola 2005, *Inverse Problem Theory*, section 3.2. Patterson and Thompson 1971, doi:10.1093/biomet/58.3.545 (REML).

use super::forcing::{COHERENCE, DRIFT, DRIFT_H, Forcing, NOISE, PERIOD, SWING, minimised};
use super::record::StemRecord;
use super::rod::{
    BASE, CURVATURE, FREE_POINTS, LN_BETA, LN_EDGE, LN_GAMMA, LN_RISE, LN_TAU, LN_ZONE, Law, NU, Rod,
};
use crate::geometry::Point;
use crate::math::cholesky::Cholesky;
use crate::math::statistics::{mean, median, robust_deviation};
use crate::math::{atan2, exp, ln};

/// Most knots of the forcing. Chosen: six a period of circumnutation for 12 such periods.
const MAX_KNOTS: usize = 72;
/// Gauss-Newton steps without and with the forcing, and rounds of both with new amplitudes of the forcing. Chosen: a further
/// round moves no constant by a tenth of its interval.
const FIRST_STEPS: usize = 4;
const STEPS: [usize; ROUNDS] = [5, 5, 15];
const ROUNDS: usize = 3;
/// Calls of the likelihood in the first and in each later round. Chosen by hand, for time: what more calls gain was not measured.
const LIKELIHOOD_CALLS: [usize; 2] = [160, 60];
/// Depth over which the sensitivity of an even zone rises, over the length of the zone: far less than a segment.
pub(super) const NO_RISE: f64 = 1e-3;
/// Step of the finite differences.
const DIFFERENCE: f64 = 1e-5;

/// What is held in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hypothesis {
    /// The plant responds.
    Response,
    /// It does, with a zone that is even from the apex on.
    EvenZone,
    /// It does not: beta, gamma and nu are 0.
    NoResponse,
}

/// A rod fitted to a record.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) rod: Rod,
    /// The numbers of the rod, then the forcing at its knots.
    pub(super) unknowns: Vec<f64>,
    /// Covariance of the numbers of the rod, row by row.
    pub(super) covariance: Vec<f64>,
    pub(super) forcing: Forcing,
    /// Twice the negative logarithm of the likelihood, the forcing marginalised.
    pub(super) deviance: f64,
    /// Root mean square of the distances across the stem, the forcing included and left out, in cm.
    pub(super) rms_cm: [f64; 2],
    /// How many times the variance of white residuals that of the residuals' means over blocks has; at least 1.
    pub(super) misfit: f64,
}

/// The measured points, and the directions across the stem there.
struct Data {
    /// Frame by frame: x and y of the free points.
    places: Vec<f64>,
    across: Vec<Point>,
}

impl Data {
    fn of(record: &StemRecord) -> Self {
        let (mut places, mut across) = (Vec::new(), Vec::new());
        for stem in &record.stems {
            for k in 1..=FREE_POINTS {
                let (below, above) = (stem[k - 1], stem[(k + 1).min(FREE_POINTS)]);
                let (x, y) = (above.x - below.x, above.y - below.y);
                let length = (x * x + y * y).sqrt().max(1e-9);
                places.extend([stem[k].x, stem[k].y]);
                across.push(Point::new(y / length, -x / length));
            }
        }
        Self { places, across }
    }

    /// Components across the stem.
    fn across_of(&self, places: &[f64]) -> Vec<f64> {
        let pairs = places.chunks_exact(2).zip(&self.across);
        pairs.map(|(place, across)| across.x * place[0] + across.y * place[1]).collect()
    }

    /// Distances of the measured points from those of the rod, across the stem.
    fn residuals(&self, places: &[f64]) -> Vec<f64> {
        let pairs = self.places.chunks_exact(2).zip(places.chunks_exact(2)).zip(&self.across);
        pairs
            .map(|((seen, rod), across)| across.x * (seen[0] - rod[0]) + across.y * (seen[1] - rod[1]))
            .collect()
    }
}

/// Means and precisions of the wide normal priors of the rod's numbers.
struct Prior {
    mean: Vec<f64>,
    precision: Vec<f64>,
}

impl Prior {
    fn cost(&self, unknowns: &[f64]) -> f64 {
        let apart = self.mean.iter().zip(&self.precision).zip(unknowns);
        apart.map(|((mean, precision), value)| precision * (value - mean).powi(2)).sum()
    }
}

/// The fit linearised: normal equations of the residuals.
struct Linear {
    residuals: Vec<f64>,
    /// Products of the columns of the Jacobian, row by row.
    products: Vec<f64>,
    /// Products of the columns and the residuals.
    right: Vec<f64>,
}

impl Fit {
    /// Fits the rod to a record; with `is_lit` also the response to the lamps.
    pub(super) fn of(record: &StemRecord, law: Law, is_lit: bool, hypothesis: Hypothesis) -> Self {
        let rod = Rod::new(record, law, is_lit, knots(record));
        let data = Data::of(record);
        let mut fitting = Fitting::new(record, &rod, &data, hypothesis);
        fitting.begin(record);
        (0..ROUNDS).for_each(|round| fitting.round(record, round));
        fitting.finish()
    }

    /// The same fit with a zone that is even from the apex on.
    pub(super) fn with_even_zone(&self, record: &StemRecord) -> Self {
        let data = Data::of(record);
        let mut fitting = Fitting::new(record, &self.rod, &data, Hypothesis::EvenZone);
        fitting.unknowns.clone_from(&self.unknowns);
        fitting.unknowns[LN_RISE] = fitting.prior.mean[LN_RISE];
        fitting.take_forcing(self.forcing);
        fitting.round(record, ROUNDS - 1);
        fitting.finish()
    }
}

/// Knots of the forcing of a record.
pub(super) fn knots(record: &StemRecord) -> usize {
    MAX_KNOTS.min(record.times_h.len() - 1)
}

struct Fitting<'a> {
    rod: &'a Rod,
    data: &'a Data,
    prior: Prior,
    unknowns: Vec<f64>,
    forcing: Forcing,
    /// The inverse of the covariance of the forcing.
    forcing_precision: Vec<f64>,
}

impl<'a> Fitting<'a> {
    fn new(record: &StemRecord, rod: &'a Rod, data: &'a Data, hypothesis: Hypothesis) -> Self {
        let length = median(&record.length_cm);
        let duration = record.duration_h();
        let lowest: Vec<f64> = record.stems.iter().map(|stem| atan2(stem[1].x, stem[1].y)).collect();
        let base = median(&lowest);
        let tips = record.tip_angles();
        let start = mean(tips[..3].iter().copied());
        // Angles may have been counted past a half turn.
        let curvature = (start - base).clamp(-3.0, 3.0) / length;
        let mut mean = vec![0.0; rod.rod_unknowns()];
        // Two thirds of the prior lie within a factor of 12 for the rates, 3 for the zone, 2.7 for its edge.
        let mut sd = vec![2.5; rod.rod_unknowns()];
        mean[LN_GAMMA] = ln(6.0 / duration);
        mean[LN_BETA] = ln(6.0 / duration / (0.25 * length));
        mean[LN_ZONE] = ln(0.6 * length);
        sd[LN_ZONE] = 1.1;
        mean[LN_EDGE] = ln(0.15);
        sd[LN_EDGE] = 1.0;
        mean[LN_RISE] = ln(0.1);
        sd[LN_RISE] = 1.2;
        mean[BASE] = base;
        sd[BASE] = 1.0;
        mean[CURVATURE] = curvature;
        sd[CURVATURE] = 1.0 / length;
        if mean.len() > LN_TAU {
            sd[NU] = 3.0 * 6.0 / duration / (0.25 * length);
            mean[LN_TAU] = ln(duration / 40.0);
            sd[LN_TAU] = 1.5;
        }
        if hypothesis == Hypothesis::EvenZone {
            (mean[LN_RISE], sd[LN_RISE]) = (ln(NO_RISE), 1e-3);
        }
        if hypothesis == Hypothesis::NoResponse {
            for rate in [LN_BETA, LN_GAMMA] {
                mean[rate] -= 9.0;
                sd[rate] = 1e-3;
            }
            if mean.len() > LN_TAU {
                sd[NU] = 1e-6;
            }
        }
        let noise = 0.003 * length;
        let drift = 0.05 / (duration / 6.0) / (0.25 * length);
        let forcing = Forcing([drift, duration / 12.0, drift, duration / 8.0, duration / 3.0, noise].map(ln));
        let mut unknowns = mean.clone();
        unknowns.resize(rod.unknowns(), 0.0);
        let precision = sd.into_iter().map(|sd| 1.0 / (sd * sd)).collect();
        let forcing_precision = vec![0.0; rod.knots * rod.knots];
        Self { rod, data, prior: Prior { mean, precision }, unknowns, forcing, forcing_precision }
    }

    /// Starts from the best of a grid of rates and zones, then fits the rod without forcing.
    fn begin(&mut self, record: &StemRecord) {
        let (length, duration) = (median(&record.length_cm), record.duration_h());
        let is_free = self.prior.precision[LN_BETA] < 1.0;
        if is_free {
            let mut starts = Vec::new();
            for times in [0.6, 1.5, 4.0, 10.0, 25.0, 60.0] {
                for convergence in [0.08, 0.16, 0.32, 0.64, 1.3] {
                    for zone in [0.3, 0.55, 0.9] {
                        let mut start = self.unknowns.clone();
                        start[LN_GAMMA] = ln(times / duration);
                        start[LN_BETA] = ln(times / duration / (convergence * length));
                        start[LN_ZONE] = ln(zone * length);
                        starts.push(start);
                    }
                }
            }
            let places = self.rod.places_of_all(&starts);
            let squares = |places: &Vec<f64>| self.data.residuals(places).iter().map(|r| r * r).sum::<f64>();
            let costs: Vec<f64> = places.iter().map(squares).collect();
            let best = (0..starts.len()).min_by(|&one, &other| costs[one].total_cmp(&costs[other]));
            self.unknowns = starts.swap_remove(best.unwrap_or(0));
        }
        for _ in 0..FIRST_STEPS {
            // Without forcing, its movement is noise.
            let squares: f64 = self.residuals(&self.unknowns).iter().map(|r| r * r).sum();
            self.forcing.0[NOISE] = 0.5 * ln((squares / self.data.across.len() as f64).max(1e-10));
            if !self.step(self.rod.rod_unknowns()) {
                break;
            }
        }
    }

    /// The forcing anew, and then the steps of a round.
    fn round(&mut self, record: &StemRecord, round: usize) {
        let free = self.rod.unknowns();
        let linear = self.linearised(free);
        self.choose_forcing(&linear, record.duration_h(), LIKELIHOOD_CALLS[round.min(1)]);
        for _ in 0..STEPS[round] {
            if !self.step(free) {
                break;
            }
        }
    }

    fn residuals(&self, unknowns: &[f64]) -> Vec<f64> {
        self.data.residuals(&self.rod.places(unknowns))
    }

    /// Residuals and Jacobian of the first `free` unknowns.
    fn linearised(&self, free: usize) -> Linear {
        let own = self.rod.rod_unknowns();
        let mut all = vec![self.unknowns.clone()];
        for at in 0..own {
            let mut moved = self.unknowns.clone();
            moved[at] += DIFFERENCE;
            all.push(moved);
        }
        let places = self.rod.places_of_all(&all);
        let residuals = self.data.residuals(&places[0]);
        let column = |moved: &Vec<f64>| {
            let moved = self.data.residuals(moved);
            moved.iter().zip(&residuals).map(|(moved, here)| (here - moved) / DIFFERENCE).collect()
        };
        let mut columns: Vec<Vec<f64>> = places[1..].iter().map(column).collect();
        if free > own {
            let derivatives = self.rod.forcing_derivatives(&self.unknowns);
            columns.extend(derivatives.iter().map(|places| self.data.across_of(places)));
        }
        let dot = |a: &[f64], b: &[f64]| crate::math::vector::dot_slices(a, b);
        let mut products = vec![0.0; free * free];
        for row in 0..free {
            for column in 0..=row {
                let product = dot(&columns[row], &columns[column]);
                products[row * free + column] = product;
                products[column * free + row] = product;
            }
        }
        let right = columns.iter().map(|column| dot(column, &residuals)).collect();
        Linear { residuals, products, right }
    }

    /// The posterior precision of the first `free` unknowns.
    fn precision(
        &self,
        products: &[f64],
        forcing: &Forcing,
        forcing_precision: &[f64],
        free: usize,
    ) -> Vec<f64> {
        let weight = exp(-2.0 * forcing.0[NOISE]);
        let (own, knots) = (self.rod.rod_unknowns(), self.rod.knots);
        let mut matrix: Vec<f64> = products.iter().map(|product| product * weight).collect();
        for at in 0..own {
            matrix[at * free + at] += self.prior.precision[at];
        }
        if free > own {
            for row in 0..knots {
                for column in 0..knots {
                    matrix[(own + row) * free + own + column] += forcing_precision[row * knots + column];
                }
            }
        }
        matrix
    }

    /// Twice the negative logarithm of the posterior density, up to a constant.
    fn cost(&self, unknowns: &[f64], residuals: &[f64]) -> f64 {
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        let (own, knots) = (self.rod.rod_unknowns(), self.rod.knots);
        let values = &unknowns[own..];
        let rows = self.forcing_precision.chunks_exact(knots).zip(values);
        let forced: f64 = rows.map(|(row, value)| value * crate::math::vector::dot_slices(row, values)).sum();
        squares * exp(-2.0 * self.forcing.0[NOISE]) + self.prior.cost(unknowns) + forced
    }

    /// One Gauss-Newton step of the first `free` unknowns, as long as the cost falls. Whether it moved.
    fn step(&mut self, free: usize) -> bool {
        let linear = self.linearised(free);
        let (own, knots) = (self.rod.rod_unknowns(), self.rod.knots);
        let weight = exp(-2.0 * self.forcing.0[NOISE]);
        let mut right: Vec<f64> = linear.right.iter().map(|value| value * weight).collect();
        for (at, right) in right.iter_mut().enumerate().take(own) {
            *right -= self.prior.precision[at] * (self.unknowns[at] - self.prior.mean[at]);
        }
        if free > own {
            let values = &self.unknowns[own..];
            for (row, right) in self.forcing_precision.chunks_exact(knots).zip(&mut right[own..]) {
                *right -= crate::math::vector::dot_slices(row, values);
            }
        }
        let matrix = self.precision(&linear.products, &self.forcing, &self.forcing_precision, free);
        let Some(factor) = Cholesky::of(matrix, free) else { return false };
        let direction = factor.solve(&right);
        // No logarithm moves by more than 1 in a step.
        let largest =
            direction[..own.min(LN_RISE + 1)].iter().fold(1.0_f64, |most, step| most.max(step.abs()));
        let moved = |share: f64| {
            let mut moved = self.unknowns.clone();
            moved.iter_mut().zip(&direction).for_each(|(value, step)| *value += share / largest * step);
            moved
        };
        let candidates = [1.0, 0.7, 0.5, 0.3, 0.15, 0.07, 0.03, 0.01].map(moved);
        let places = self.rod.places_of_all(&candidates);
        let before = self.cost(&self.unknowns, &linear.residuals);
        let costs: Vec<f64> = candidates
            .iter()
            .zip(&places)
            .map(|(unknowns, places)| self.cost(unknowns, &self.data.residuals(places)))
            .collect();
        let best = (0..costs.len()).min_by(|&one, &other| costs[one].total_cmp(&costs[other])).unwrap_or(0);
        // Not a number is no descent.
        if costs[best].is_nan() || costs[best] >= before - 1e-3 {
            return false;
        }
        self.unknowns.clone_from(&candidates[best]);
        true
    }

    /// Twice the negative logarithm of the restricted likelihood of a forcing, up to a constant; with `is_restricted` false of the
    /// likelihood at the present numbers of the rod.
    fn deviance(&self, linear: &Linear, forcing: &Forcing, is_restricted: bool) -> Option<f64> {
        let (own, knots, free) = (self.rod.rod_unknowns(), self.rod.knots, self.rod.unknowns());
        let (precision, ln_determinant) = forcing.precision(knots, self.rod.knot_h)?;
        let weight = exp(-2.0 * forcing.0[NOISE]);
        // Residuals as they would be without forcing, and their products with the columns.
        let values = &self.unknowns[own..];
        let product = |row: usize| {
            crate::math::vector::dot_slices(&linear.products[row * free + own..(row + 1) * free], values)
        };
        let mut right: Vec<f64> = (0..free).map(|row| linear.right[row] + product(row)).collect();
        let squares: f64 = linear.residuals.iter().map(|r| r * r).sum();
        let twice: f64 =
            values.iter().zip(&linear.right[own..]).map(|(value, right)| 2.0 * value * right).sum();
        let forced: f64 = values.iter().zip(own..).map(|(value, row)| value * product(row)).sum();
        let squares = squares + twice + forced;
        let count = linear.residuals.len() as f64;
        let matrix = self.precision(&linear.products, forcing, &precision, free);
        let (matrix, size) = if is_restricted {
            for (at, right) in right.iter_mut().enumerate().take(own) {
                // The prior's pull, in the units of the data.
                *right -= self.prior.precision[at] * (self.unknowns[at] - self.prior.mean[at]) / weight;
            }
            (matrix, free)
        } else {
            right.drain(..own);
            let rows = (own..free).flat_map(|row| matrix[row * free + own..(row + 1) * free].to_vec());
            (rows.collect(), knots)
        };
        let posterior = Cholesky::of(matrix, size)?;
        let explained: f64 = posterior.solve_lower(&right).iter().map(|value| value * value).sum();
        Some(
            2.0 * forcing.0[NOISE] * count + ln_determinant + posterior.ln_determinant() + squares * weight
                - explained * weight * weight,
        )
    }

    /// Takes the forcing of the greatest restricted likelihood.
    fn choose_forcing(&mut self, linear: &Linear, duration_h: f64, calls: usize) {
        let function = |forcing: &Forcing| {
            let deviance = self.deviance(linear, forcing, true)?;
            Some(deviance + forcing.penalty(duration_h))
        };
        let mut start = self.forcing;
        if calls == LIKELIHOOD_CALLS[0] {
            // The likelihood has several maxima over the period.
            let noise = (self.typical_scatter() * 0.5).max(1e-4);
            let mut best = f64::INFINITY;
            for period in [24.0, 16.0, 11.0, 7.5, 5.0, 3.4, 2.3] {
                for scale in [0.5, 2.0] {
                    let mut forcing = self.forcing;
                    forcing.0[PERIOD] = ln(duration_h / period);
                    forcing.0[COHERENCE] = forcing.0[PERIOD] + ln(3.0);
                    forcing.0[DRIFT] += ln(scale);
                    forcing.0[SWING] += ln(scale);
                    forcing.0[NOISE] = ln(noise);
                    let value = function(&forcing).unwrap_or(f64::INFINITY);
                    if value < best {
                        (best, start) = (value, forcing);
                    }
                }
            }
        }
        let step = if calls == LIKELIHOOD_CALLS[0] { 0.6 } else { 0.2 };
        let found =
            minimised(start.0, step, calls, |numbers| function(&Forcing(numbers)).unwrap_or(f64::INFINITY));
        self.take_forcing(Forcing(found));
    }

    fn take_forcing(&mut self, forcing: Forcing) {
        self.forcing = forcing;
        if let Some((precision, _)) = forcing.precision(self.rod.knots, self.rod.knot_h) {
            self.forcing_precision = precision;
        }
    }

    /// Standard deviation of the points' noise as their second differences over time show it, in cm.
    fn typical_scatter(&self) -> f64 {
        let across = |frame: usize, k: usize| {
            let at = (frame * FREE_POINTS + k) * 2;
            let n = self.data.across[frame * FREE_POINTS + k];
            (n, self.data.places[at], self.data.places[at + 1])
        };
        let frames = self.data.across.len() / FREE_POINTS;
        let mut apart = Vec::new();
        for frame in 1..frames - 1 {
            for k in 0..FREE_POINTS {
                let (n, x, y) = across(frame, k);
                let ((_, x0, y0), (_, x1, y1)) = (across(frame - 1, k), across(frame + 1, k));
                apart.push((n.x * (x0 - 2.0 * x + x1) + n.y * (y0 - 2.0 * y + y1)).abs());
            }
        }
        // A second difference of white noise has six times its variance.
        robust_deviation(&apart) / 6_f64.sqrt()
    }

    fn finish(self) -> Fit {
        let (own, free) = (self.rod.rod_unknowns(), self.rod.unknowns());
        let linear = self.linearised(free);
        let misfit = misfit(&linear.residuals);
        // Correlated residuals count as fewer independent ones.
        let mut weighted = self.forcing;
        weighted.0[NOISE] += 0.5 * ln(misfit);
        let matrix = self.precision(&linear.products, &weighted, &self.forcing_precision, free);
        let covariance = match Cholesky::of(matrix, free) {
            Some(factor) => {
                let inverse = factor.inverse();
                (0..own).flat_map(|row| inverse[row * free..row * free + own].to_vec()).collect()
            }
            // A fit that broke down knows nothing.
            None => (0..own * own).map(|at| if at % (own + 1) == 0 { 1e6 } else { 0.0 }).collect(),
        };
        let deviance = self.deviance(&linear, &self.forcing, false).unwrap_or(f64::INFINITY)
            + self.prior.cost(&self.unknowns);
        let rms = |residuals: &[f64]| {
            (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt()
        };
        let mut unforced = self.unknowns.clone();
        unforced[own..].fill(0.0);
        let rms_cm = [rms(&linear.residuals), rms(&self.residuals(&unforced))];
        let rod = self.rod.clone();
        Fit { rod, unknowns: self.unknowns, covariance, forcing: self.forcing, deviance, rms_cm, misfit }
    }
}

/// Blocks of a record, and free points in a block of the stem, over which residuals are averaged. Chosen: an hour of half a day, a
/// third of the stem, over which noise averages out and a misfit does not.
const BLOCKS: usize = 12;
const POINTS_A_BLOCK: usize = 3;

/// Mean square of the sums of residuals over blocks of time and stem, over that of independent residuals; at least 1.
fn misfit(residuals: &[f64]) -> f64 {
    let frames = residuals.len() / FREE_POINTS;
    let square = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
    let block = frames.div_ceil(BLOCKS).max(2);
    let mut ratios = Vec::new();
    for rows in residuals.chunks(block * FREE_POINTS) {
        for first in (0..FREE_POINTS).step_by(POINTS_A_BLOCK) {
            let near = rows.chunks(FREE_POINTS).flat_map(|row| &row[first..first + POINTS_A_BLOCK]);
            let (sum, count) = near.fold((0.0, 0.0), |(sum, count), r| (sum + r, count + 1.0));
            ratios.push(sum * sum / (count * square));
        }
    }
    mean(ratios).max(1.0)
}

impl Forcing {
    /// The times of the forcing in h: correlation of the drift, period, coherence.
    pub(super) fn times_h(&self) -> [f64; 3] {
        [DRIFT_H, PERIOD, COHERENCE].map(|at| exp(self.0[at]))
    }
}
