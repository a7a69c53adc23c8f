//! Statistics of a generation.

use serde::{Deserialize, Serialize};

use crate::genome::Genome;

/// Statistics of one generation, returned by [`Neat::tell`](crate::Neat::tell).
///
/// Scores are as the caller gave them: without the fitness floor and the complexity penalty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Generation {
    /// Number of the generation; the initial population is 0.
    pub generation: u32,
    /// Best score.
    pub best: f64,
    /// Mean score.
    pub mean: f64,
    /// Median score.
    pub median: f64,
    /// Best score of the run so far.
    pub best_ever: f64,
    /// Number of species.
    pub species: usize,
    /// Number of individuals.
    pub population: usize,
    /// Mean number of links.
    pub links_mean: f64,
    /// Mean number of hidden neurons.
    pub hidden_mean: f64,
    /// Number of links of this generation's best individual; of equals, the first counts.
    pub champion_links: usize,
    /// Compatibility threshold by which the individuals were assigned to species.
    pub threshold: f64,
    /// Number of evaluations of the run so far, including this generation.
    pub evaluations: u64,
}

/// Mean of at least one number, summed in order.
pub(crate) fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// Median of at least one number; of an even count, the mean of the middle two.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[middle] } else { f64::midpoint(sorted[middle - 1], sorted[middle]) }
}

/// Index of the largest of at least one number; of equals, the first.
pub(crate) fn index_of_best(values: &[f64]) -> usize {
    (1..values.len()).fold(0, |best, index| if values[index] > values[best] { index } else { best })
}

/// Mean number of links and mean number of hidden neurons.
pub(crate) fn mean_size(population: &[Genome]) -> (f64, f64) {
    let links = population.iter().map(|genome| genome.links.len() as f64);
    let hidden = population.iter().map(|genome| genome.hidden() as f64);
    (mean(links), mean(hidden))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_odd_and_even_counts() {
        assert_eq!(median(&[3.0, -1.0, 2.0]), 2.0);
        assert_eq!(median(&[3.0, -1.0, 2.0, 0.0]), 1.0);
    }

    #[test]
    fn the_first_of_equal_maxima_is_the_best() {
        assert_eq!(index_of_best(&[1.0, 3.0, 3.0, 2.0]), 1);
    }
}
