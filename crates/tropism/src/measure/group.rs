//! Groups of plants: the mean with a t interval, and two groups compared by permutation of plants.

use rand::RngExt;
use serde::{Deserialize, Serialize};

use super::estimate::{Estimate, Status};
use crate::math::statistics::{mean, standard_deviation};
use crate::math::{exp, ln};
use crate::random::{self, Purpose};
use crate::text::plural;

/// Systematic part of the half width of a group's interval, of the logarithm. Measured: the largest bias of a case that is called
/// measured, rounded up (`cargo run --example measure_accuracy`). The scatter of plants cannot show it.
pub const SYSTEMATIC: f64 = 0.05;

/// Least number of plants of a group. Chosen: the t interval of two plants spans a factor of hundreds.
pub const MIN_PLANTS: usize = 3;

/// Permutations of a test; all, if there are no more. Chosen: a p of 0.05 has a standard error of 0.0015.
const PERMUTATIONS: usize = 20_000;

/// The mean of the values of plants: geometric where all have one sign, else arithmetic.
#[must_use]
pub fn mean_of(symbol: &str, values: &[f64]) -> Estimate {
    if values.iter().all(|value| *value > 0.0) {
        geometric_mean(symbol, values)
    } else if values.iter().all(|value| *value < 0.0) {
        // As seen in a mirror.
        let mirrored: Vec<f64> = values.iter().map(|value| -value).collect();
        let mirrored = geometric_mean(symbol, &mirrored);
        let [low, high] = mirrored.interval;
        Estimate { value: -mirrored.value, interval: [-high, -low], ..mirrored }
    } else {
        arithmetic_mean(symbol, values)
    }
}

/// The mean of positive values of plants: geometric, with a t interval over plants and the systematic part.
#[must_use]
pub fn geometric_mean(symbol: &str, values: &[f64]) -> Estimate {
    let logs: Vec<f64> = values.iter().copied().filter(|value| *value > 0.0).map(ln).collect();
    if logs.len() < MIN_PLANTS {
        let reason =
            format!("the group has {} with it; {MIN_PLANTS} are needed", plural(logs.len(), "plant"));
        return Estimate::not_identified(symbol, &reason);
    }
    let half = half_width(&logs) + SYSTEMATIC;
    Estimate::log_normal(symbol, mean(logs), half)
}

/// The mean of values of plants of any sign, with a t interval over plants.
#[must_use]
pub fn arithmetic_mean(symbol: &str, values: &[f64]) -> Estimate {
    if values.len() < MIN_PLANTS {
        let reason =
            format!("the group has {} with it; {MIN_PLANTS} are needed", plural(values.len(), "plant"));
        return Estimate::not_identified(symbol, &reason);
    }
    let (value, half) = (mean(values.iter().copied()), half_width(values));
    let (interval, reason) = ([value - half, value + half], String::new());
    Estimate { symbol: symbol.to_owned(), value, interval, status: Status::Measured, reason }
}

fn half_width(values: &[f64]) -> f64 {
    super::student_90(values.len() as f64 - 1.0) * standard_deviation(values) / (values.len() as f64).sqrt()
}

/// Two groups compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Mean of the first less that of the second.
    pub difference: f64,
    /// Probability that a plant of the first group is above one of the second (a tie counts half).
    pub auc: f64,
    /// Two-sided p value by permutation of plants.
    pub p: f64,
    /// Whether all permutations were tried.
    pub is_exact: bool,
}

/// Compares the means of two groups of plants by permutation (Fisher 1935; Phipson and Smyth 2010 for drawn permutations).
///
/// `None` if a group has no plant.
///
/// ```
/// use tropism::measure::group::compared;
/// let test = compared(&[1.0, 2.0, 3.0], &[7.0, 8.0, 9.0], 1).unwrap();
/// assert_eq!((test.difference, test.auc, test.p), (-6.0, 0.0, 0.1));
/// ```
#[must_use]
pub fn compared(first: &[f64], second: &[f64], seed: u64) -> Option<Comparison> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let mut pooled = [first, second].concat();
    let (count, all) = (first.len(), pooled.len());
    let total: f64 = pooled.iter().sum();
    let difference = |sum: f64| sum / count as f64 - (total - sum) / (all - count) as f64;
    let observed = difference(first.iter().sum());
    // Rounding must not split ties.
    let is_as_far = |sum: f64| difference(sum).abs() >= observed.abs() * (1.0 - 1e-12);
    let wins = first.iter().flat_map(|one| {
        second
            .iter()
            .map(move |other| if one > other { 1.0 } else { 0.5 * f64::from(u8::from(one == other)) })
    });
    let auc = wins.sum::<f64>() / (count * (all - count)) as f64;
    let choices = (0..count).fold(1.0, |product, k| product * (all - k) as f64 / (k + 1) as f64);
    let (p, is_exact) = if choices <= PERMUTATIONS as f64 {
        let (mut far, mut tried) = (0, 0);
        for_each_choice(&pooled, count, 0.0, &mut |sum| {
            tried += 1;
            far += usize::from(is_as_far(sum));
        });
        (far as f64 / tried as f64, true)
    } else {
        let mut draws = random::stream(seed, Purpose::Permutation, 0);
        let mut far = 0;
        for _ in 0..PERMUTATIONS {
            for at in 0..count {
                let other = draws.random_range(at..all);
                pooled.swap(at, other);
            }
            far += usize::from(is_as_far(pooled[..count].iter().sum()));
        }
        ((far + 1) as f64 / (PERMUTATIONS + 1) as f64, false)
    };
    Some(Comparison { difference: observed, auc, p, is_exact })
}

/// The sum of each choice of `count` of the values.
fn for_each_choice(values: &[f64], count: usize, sum: f64, with: &mut dyn FnMut(f64)) {
    if count == 0 {
        with(sum);
    } else if let Some((value, rest)) = values.split_first()
        && rest.len() + 1 >= count
    {
        for_each_choice(rest, count - 1, sum + value, with);
        for_each_choice(rest, count, sum, with);
    }
}

/// The ratio of geometric means, of the difference of the means of logarithms.
#[must_use]
pub fn ratio(difference_of_logs: f64) -> f64 {
    exp(difference_of_logs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_permutations_agree_with_all_of_them() {
        let one: Vec<f64> = (0..6).map(|k| f64::from(k) * 1.3 + 1.0).collect();
        let other: Vec<f64> = (0..9).map(f64::from).collect();
        let exact = compared(&one, &other, 1).unwrap();
        assert!(exact.is_exact && exact.p > 0.05 && exact.p < 1.0);
        let more = compared(&[&one[..], &[4.0; 8]].concat(), &[&other[..], &[4.0; 8]].concat(), 1).unwrap();
        assert!(!more.is_exact && more.p > 0.0 && more.p <= 1.0);
    }

    #[test]
    fn the_interval_of_a_group_is_that_of_its_logarithms() {
        let group = geometric_mean("Lc", &[1.0, 1.0, 1.0, 1.0]);
        assert!((group.value - 1.0).abs() < 1e-12 && (group.interval[1] - exp(SYSTEMATIC)).abs() < 1e-12);
        assert_eq!(geometric_mean("Lc", &[1.0, 2.0]).status, Status::NotIdentified);
        let [low, high] = arithmetic_mean("turn", &[-1.0, 0.0, 1.0]).interval;
        assert!((high - 2.92 / 3_f64.sqrt()).abs() < 0.03 && (low + high).abs() < 1e-12);
    }
}
