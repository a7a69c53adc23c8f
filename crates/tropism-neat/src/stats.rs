//! A generation in numbers.

use serde::{Deserialize, Serialize};

use crate::Genome;

/// What a generation was like, from [`Neat::tell`](crate::Neat::tell). Scores are as they were told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Generation {
    /// Its number; the initial population is 0.
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
    /// Number of links of this generation's best individual (the first of equals).
    pub champion_links: usize,
    /// Compatibility threshold by which its species were told apart.
    pub threshold: f64,
    /// Evaluations of the run so far.
    pub evaluations: u64,
}

/// The mean of at least one number, summed in order.
pub(crate) fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// The median of at least one number; of an even count, the mean of the middle two.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[middle] } else { f64::midpoint(sorted[middle - 1], sorted[middle]) }
}

/// Place of the largest of at least one number, the first of equals.
pub(crate) fn place_of_best(values: &[f64]) -> usize {
    (1..values.len()).fold(0, |best, place| if values[place] > values[best] { place } else { best })
}

/// Mean numbers of links and of hidden neurons.
pub(crate) fn mean_size(population: &[Genome]) -> (f64, f64) {
    let links = population.iter().map(|genome| genome.links.len() as f64);
    let hidden =
        population.iter().map(|genome| (genome.neurons.len() - genome.inputs - 1 - genome.outputs) as f64);
    (mean(links), mean(hidden))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_of_odd_and_even_counts() {
        assert_eq!(median(&[3.0, -1.0, 2.0]), 2.0);
        assert_eq!(median(&[3.0, -1.0, 2.0, 0.0]), 1.0);
    }

    #[test]
    fn the_first_of_equal_bests_counts() {
        assert_eq!(place_of_best(&[1.0, 3.0, 3.0, 2.0]), 1);
    }
}
