//! Bootstrap intervals of means.
//!
//! In: numbers, and a seed. Out: an interval that would hold the mean over all plants in 95 of 100 experiments. The idea:
//! the sample stands for the population, and is drawn from anew, with replacement, again and again.
//!
//! # References
//! Efron and Tibshirani 1993, *An Introduction to the Bootstrap*, chapter 13 (percentile interval).

use serde::{Deserialize, Serialize};
use tropism::math::statistics::{mean, quantile_linear};
use tropism::random::{NoiseStream, Purpose};

/// Number of resamples: the most that Efron and Tibshirani advise for percentile intervals (1000 to 2000).
const RESAMPLES: u32 = 2000;

/// The ends of a 95 % interval as shares of the sorted means.
const INTERVAL: [f64; 2] = [0.025, 0.975];

/// How one controller does against another on the same plants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairedDifference {
    /// Mean of the differences.
    pub mean: f64,
    /// 95 % interval of the mean, by bootstrap over the plants.
    pub interval: [f64; 2],
    /// Share of the plants with a difference above zero, 0 to 1.
    pub share_above: f64,
}

/// The resamples of a bootstrap: which values each of them draws.
///
/// All samples of one size are resampled alike: two controllers on the same plants are compared on the same resamples.
pub(crate) struct Bootstrap {
    size: usize,
    picks: Vec<u32>,
}

impl Bootstrap {
    /// Resamples of `size` values, at least one. Draws are named by seed, size, resample and place (Philox, counter-based).
    pub(crate) fn new(seed: u64, size: usize) -> Self {
        let stream = NoiseStream::new(seed, Purpose::Bootstrap, [size as u32, 0, 0]);
        let picks = (0..RESAMPLES).flat_map(|resample| {
            let mut draws = stream.at(resample);
            (0..size).map(move |_| (draws.uniform() * size as f64) as u32)
        });
        Self { size, picks: picks.collect() }
    }

    /// The 95 % interval of the mean of `values`.
    ///
    /// # Panics
    /// Unless there are as many values as the resamples are for.
    pub(crate) fn interval_of_mean(&self, values: &[f64]) -> [f64; 2] {
        assert_eq!(values.len(), self.size, "as many values as the resamples are for");
        let resampled = |picks: &[u32]| mean(picks.iter().map(|&pick| values[pick as usize]));
        let means: Vec<f64> = self.picks.chunks_exact(self.size).map(resampled).collect();
        INTERVAL.map(|share| quantile_linear(&means, share))
    }

    /// Compares `ours` with `theirs`, value by value.
    ///
    /// # Panics
    /// Unless there are as many values as the resamples are for.
    pub(crate) fn compare(&self, ours: &[f64], theirs: &[f64]) -> PairedDifference {
        let differences: Vec<f64> = ours.iter().zip(theirs).map(|(our, their)| our - their).collect();
        PairedDifference {
            mean: mean(differences.iter().copied()),
            interval: self.interval_of_mean(&differences),
            share_above: mean(differences.iter().map(|&difference| f64::from(u8::from(difference > 0.0)))),
        }
    }
}

/// The 95 % interval of the mean of `values` of each replicate on each plant: replicates and plants are both drawn anew,
/// the same plants for all replicates.
///
/// # Panics
/// Without replicates or plants, or if the replicates have not as many plants as each other.
pub(crate) fn interval_over_replicates(values: &[Vec<f64>], seed: u64) -> [f64; 2] {
    let plants = values[0].len();
    assert!(values.iter().all(|values| values.len() == plants), "the same plants in each replicate");
    let (of_replicates, of_plants) = (Bootstrap::new(seed, values.len()), Bootstrap::new(seed, plants));
    let means: Vec<f64> = of_replicates
        .picks
        .chunks_exact(values.len())
        .zip(of_plants.picks.chunks_exact(plants))
        .map(|(replicates, plants)| {
            let replicates = replicates.iter().map(|&replicate| &values[replicate as usize]);
            mean(replicates.map(|values| mean(plants.iter().map(|&plant| values[plant as usize]))))
        })
        .collect();
    INTERVAL.map(|share| quantile_linear(&means, share))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sample of `size` standard normal draws around 3.
    fn sample(number: u32, size: u32) -> Vec<f64> {
        let noise = NoiseStream::new(1, Purpose::Trial, [number, 0, 0]);
        (0..size).map(|place| 3.0 + noise.normal(place)).collect()
    }

    #[test]
    fn intervals_cover_the_mean_of_a_normal_distribution() {
        let (samples, size) = (400, 40);
        let bootstrap = Bootstrap::new(7, size as usize);
        let is_covered = |number| {
            let [low, high] = bootstrap.interval_of_mean(&sample(number, size));
            low <= 3.0 && 3.0 <= high
        };
        let covered = (0..samples).filter(|&number| is_covered(number)).count();
        // A percentile interval of 40 values covers some 94 %; the standard error of 400 samples is 1.1 %.
        assert!((363..=391).contains(&covered), "{covered} of {samples}");
    }

    #[test]
    fn equal_controllers_differ_by_exactly_nothing() {
        let scores = sample(3, 30);
        let same = Bootstrap::new(1, 30).compare(&scores, &scores);
        assert_eq!(same, PairedDifference { mean: 0.0, interval: [0.0; 2], share_above: 0.0 });
    }

    #[test]
    fn pairs_see_a_difference_that_plants_hide() {
        let plants: Vec<f64> = sample(4, 30).iter().map(|score| 5.0 * score).collect();
        let better: Vec<f64> =
            plants.iter().zip(sample(5, 30)).map(|(score, noise)| score + 0.2 * noise).collect();
        let bootstrap = Bootstrap::new(1, 30);
        let difference = bootstrap.compare(&better, &plants);
        assert!(difference.interval[0] > 0.0 && difference.share_above == 1.0, "{difference:?}");
        let [apart, together] = [&better, &plants].map(|scores| bootstrap.interval_of_mean(scores));
        assert!(apart[0] < together[1], "intervals of the means overlap");
    }

    #[test]
    fn replicates_that_differ_widen_the_interval() {
        let plants = sample(8, 60);
        let replicate = |shift: f64| plants.iter().map(|score| score + shift).collect::<Vec<f64>>();
        let alike = interval_over_replicates(&[replicate(0.0), replicate(0.0), replicate(0.0)], 1);
        let apart = interval_over_replicates(&[replicate(-2.0), replicate(0.0), replicate(2.0)], 1);
        let width = |[low, high]: [f64; 2]| high - low;
        assert_eq!(alike, Bootstrap::new(1, 60).interval_of_mean(&plants));
        assert!(width(apart) > 3.0 * width(alike), "{apart:?} {alike:?}");
    }

    #[test]
    fn the_seed_names_the_interval() {
        let scores = sample(6, 20);
        let interval = |seed| Bootstrap::new(seed, 20).interval_of_mean(&scores);
        assert_eq!(interval(1), interval(1));
        assert_ne!(interval(1), interval(2));
        assert_eq!(Bootstrap::new(1, 1).interval_of_mean(&[4.0]), [4.0; 2]);
    }
}
