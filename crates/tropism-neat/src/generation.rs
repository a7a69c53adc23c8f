//! Statistics of a generation.

use serde::{Deserialize, Serialize};

use crate::genome::Genome;
use crate::statistics::mean;

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

/// Mean number of links and mean number of hidden neurons.
pub(crate) fn mean_size(population: &[Genome]) -> (f64, f64) {
    let links = population.iter().map(|genome| genome.links.len() as f64);
    let hidden = population.iter().map(|genome| genome.hidden() as f64);
    (mean(links), mean(hidden))
}
