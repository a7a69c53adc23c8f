//! CMA-ES: an evolution strategy that learns how the variables hang together, for some dozens of real variables at most.
//!
//! `ask` gives the points of a generation, `tell` takes their costs. The strategy moves the mean of a normal
//! distribution to the better points and adapts its covariance and its step size. Points are named by seed, restart,
//! generation and place: who computes the costs, and in what order, changes nothing.
//!
//! # References
//! Hansen 2016, *The CMA Evolution Strategy: A Tutorial*, arXiv:1604.00772. Equation numbers are those of this tutorial.
//! Auger and Hansen 2005, doi:10.1109/CEC.2005.1554902 (when to restart, and
//! a population that doubles with each restart).

use serde::{Deserialize, Serialize};

use crate::math;
use crate::math::matrix::diagonalize;
use crate::random::{self, Purpose};

/// A search has converged when the greatest standard deviation is below this share of the first one (Auger and Hansen 2005,
/// `TolX`).
const TOLERANCE: f64 = 1e-12;

/// A search has gone astray when the covariance has this condition number (Auger and Hansen 2005), or the greatest standard
/// deviation has grown by the factor below (Hansen's own programs, `TolXUp`).
const MAX_CONDITION: f64 = 1e14;
const MAX_GROWTH: f64 = 1e4;

/// The numbers of a strategy that follow from its dimensions and population: Table 1 of the tutorial, without negative weights.
struct Settings {
    /// Weights of the better half, the best first; their sum is 1.
    weights: Vec<f64>,
    /// Variance-effective selection mass.
    mu_eff: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    /// Expected length of a standard normal vector.
    chi: f64,
}

impl Settings {
    fn new(dimensions: usize, population: usize) -> Self {
        let (n, lambda) = (dimensions as f64, population as f64);
        let raw: Vec<f64> =
            (1..=population / 2).map(|rank| math::ln((lambda + 1.0) / 2.0) - math::ln(rank as f64)).collect();
        let sum: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|weight| weight / sum).collect();
        let mu_eff = 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        let c_1 = 2.0 / ((n + 1.3) * (n + 1.3) + mu_eff);
        let c_mu = 2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((n + 2.0) * (n + 2.0) + mu_eff);
        Self {
            mu_eff,
            c_sigma,
            d_sigma: 1.0 + 2.0 * f64::max(0.0, ((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0) + c_sigma,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_1,
            c_mu: c_mu.min(1.0 - c_1),
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
            weights,
        }
    }
}

/// A search for the point of least cost in a space of any dimension.
///
/// ```
/// use tropism::CmaEs;
/// let mut search = CmaEs::new(&[0.0; 3], 1.0, 12, 1);
/// for _ in 0..120 {
///     let points = search.ask();
///     let cost = |point: &Vec<f64>| point.iter().map(|x| (x - 2.0) * (x - 2.0)).sum();
///     search.tell(&points, &points.iter().map(cost).collect::<Vec<f64>>());
/// }
/// assert!(search.mean().iter().all(|x| (x - 2.0).abs() < 1e-6));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CmaEs {
    population: usize,
    seed: u64,
    restart: u32,
    generation: u32,
    start: (Vec<f64>, f64),
    mean: Vec<f64>,
    /// Step size.
    sigma: f64,
    covariance: Vec<Vec<f64>>,
    /// Standard deviations along the axes of the covariance, and these axes as rows.
    deviations: Vec<f64>,
    axes: Vec<Vec<f64>>,
    /// Evolution paths of covariance and step size.
    path: Vec<f64>,
    sigma_path: Vec<f64>,
}

/// The identity.
fn identity(size: usize) -> Vec<Vec<f64>> {
    (0..size).map(|row| (0..size).map(|column| if row == column { 1.0 } else { 0.0 }).collect()).collect()
}

impl CmaEs {
    /// A search from `start` with the standard deviation `sd` in each dimension, `population` points a generation.
    ///
    /// # Panics
    /// If `population` is below 4, or `sd` is not above 0.
    #[must_use]
    pub fn new(start: &[f64], sd: f64, population: usize, seed: u64) -> Self {
        assert!(population >= 4 && sd > 0.0, "four points or more, and room to move");
        let dimensions = start.len();
        Self {
            population,
            seed,
            restart: 0,
            generation: 0,
            start: (start.to_vec(), sd),
            mean: start.to_vec(),
            sigma: sd,
            covariance: identity(dimensions),
            deviations: vec![1.0; dimensions],
            axes: identity(dimensions),
            path: vec![0.0; dimensions],
            sigma_path: vec![0.0; dimensions],
        }
    }

    /// Whether it is a search of so many dimensions with this seed, and whether `population` is the one that it began with.
    pub(crate) fn is_of(&self, dimensions: usize, population: usize, seed: u64) -> bool {
        let square =
            |rows: &[Vec<f64>]| rows.len() == dimensions && rows.iter().all(|row| row.len() == dimensions);
        let vectors = [&self.start.0, &self.mean, &self.deviations, &self.path, &self.sigma_path];
        let first = population.checked_shl(self.restart).unwrap_or(0);
        vectors.iter().all(|vector| vector.len() == dimensions)
            && square(&self.covariance)
            && square(&self.axes)
            && (self.population, self.seed) == (first, seed)
    }

    /// The search from the start with other random numbers and twice the population, which looks farther around.
    #[must_use]
    pub fn restarted(&self) -> Self {
        let (start, sd) = &self.start;
        Self { restart: self.restart + 1, ..Self::new(start, *sd, 2 * self.population, self.seed) }
    }

    /// The centre of the search: the best estimate where costs are noisy.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The greatest standard deviation in any direction.
    #[must_use]
    pub fn sd(&self) -> f64 {
        self.sigma * self.deviations.iter().copied().fold(0.0, f64::max)
    }

    /// The points of the present generation, eqs. (38) to (40).
    #[must_use]
    pub fn ask(&self) -> Vec<Vec<f64>> {
        let seed = random::derive(self.seed, Purpose::Search, self.restart.into());
        let mut rng = random::stream(seed, Purpose::Search, self.generation.into());
        let mut point = || {
            let deviations = self.deviations.iter();
            let steps: Vec<f64> = deviations.map(|deviation| deviation * random::normal(&mut rng)).collect();
            let offset =
                |at: usize| -> f64 { self.axes.iter().zip(&steps).map(|(axis, step)| axis[at] * step).sum() };
            self.mean.iter().enumerate().map(|(at, mean)| mean + self.sigma * offset(at)).collect()
        };
        (0..self.population).map(|_| point()).collect()
    }

    /// Moves on to the next generation. `points` are those of [`Self::ask`], `costs` theirs in order; NaN counts as the worst.
    ///
    /// # Panics
    /// If there are not as many points and costs as the population.
    pub fn tell(&mut self, points: &[Vec<f64>], costs: &[f64]) {
        assert!(points.len() == self.population && costs.len() == self.population, "a cost for each point");
        let mut order: Vec<usize> = (0..costs.len()).collect();
        // In the order of `total_cmp` a NaN may stand first, by its sign.
        let cost = |at: usize| if costs[at].is_nan() { f64::INFINITY } else { costs[at] };
        order.sort_by(|&one, &other| cost(one).total_cmp(&cost(other)));
        let Settings { weights, mu_eff, c_sigma, d_sigma, c_c, c_1, c_mu, chi } =
            &Settings::new(self.mean.len(), self.population);
        let best: Vec<Vec<f64>> = order[..weights.len()]
            .iter()
            .map(|&at| {
                points[at].iter().zip(&self.mean).map(|(value, mean)| (value - mean) / self.sigma).collect()
            })
            .collect();

        // Eqs. (41) and (42): the mean moves by the weighted mean of the better steps.
        let dimensions = self.mean.len();
        let step: Vec<f64> = (0..dimensions)
            .map(|axis| weights.iter().zip(&best).map(|(weight, one)| weight * one[axis]).sum())
            .collect();
        for (mean, step) in self.mean.iter_mut().zip(&step) {
            *mean += self.sigma * step;
        }

        // Eqs. (43) and (44): the path of the step size, in coordinates in which the covariance is the identity.
        let whitened: Vec<f64> = self
            .axes
            .iter()
            .zip(&self.deviations)
            .map(|(axis, deviation)| axis.iter().zip(&step).map(|(a, b)| a * b).sum::<f64>() / deviation)
            .collect();
        let gain = (c_sigma * (2.0 - c_sigma) * mu_eff).sqrt();
        for (at, path) in self.sigma_path.iter_mut().enumerate() {
            let rotated: f64 = self.axes.iter().zip(&whitened).map(|(axis, value)| axis[at] * value).sum();
            *path = (1.0 - c_sigma) * *path + gain * rotated;
        }
        let length = self.sigma_path.iter().map(|value| value * value).sum::<f64>().sqrt();

        // Eqs. (45) and (47): the covariance by its path and by the better steps. The path stalls while the step size grows.
        self.generation += 1;
        let unbiased = (1.0 - math::pow(1.0 - c_sigma, 2.0 * f64::from(self.generation))).sqrt();
        let is_steady = length / unbiased < (1.4 + 2.0 / (dimensions as f64 + 1.0)) * chi;
        let gain = if is_steady { (c_c * (2.0 - c_c) * mu_eff).sqrt() } else { 0.0 };
        for (path, step) in self.path.iter_mut().zip(&step) {
            *path = (1.0 - c_c) * *path + gain * step;
        }
        let stalled = if is_steady { 0.0 } else { c_c * (2.0 - c_c) };
        let kept = 1.0 - c_1 - c_mu + c_1 * stalled;
        for row in 0..dimensions {
            for column in 0..dimensions {
                let of_steps: f64 =
                    weights.iter().zip(&best).map(|(weight, one)| weight * one[row] * one[column]).sum();
                let value = &mut self.covariance[row][column];
                *value = kept * *value + c_1 * self.path[row] * self.path[column] + c_mu * of_steps;
            }
        }
        self.sigma *= math::exp((c_sigma / d_sigma) * (length / chi - 1.0)); // eq. (44)
        let mut values = self.covariance.clone();
        self.axes = identity(dimensions);
        diagonalize(&mut values, &mut self.axes);
        let deviation = |(at, row): (usize, &Vec<f64>)| row[at].max(f64::MIN_POSITIVE).sqrt();
        self.deviations = values.iter().enumerate().map(deviation).collect();
    }

    /// Whether the search is over: it has converged, or its distribution is degenerate. [`Self::restarted`] begins anew.
    #[must_use]
    pub fn is_over(&self) -> bool {
        let least = self.deviations.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = self.deviations.iter().copied().fold(0.0, f64::max);
        let share = self.sd() / self.start.1;
        let is_sound = greatest * greatest < MAX_CONDITION * least * least;
        !is_sound || !(TOLERANCE..MAX_GROWTH).contains(&share)
    }
}
