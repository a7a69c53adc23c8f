//! Minimal genomes with random or given weights: the members of initial populations, and networks for random baselines.

use crate::config::Config;
use crate::genome::Genome;
use crate::genome_file::{GenomeError, check_shape};
use crate::random::Rng;

/// Random genome number `index` of a seed: a minimal genome with random weights.
///
/// For the same seed, the first genomes are the initial population of [`Neat::new`](crate::Neat::new).
///
/// # Panics
///
/// If there are no inputs or no outputs, or more than [`SIZE_LIMIT`](crate::SIZE_LIMIT).
///
/// ```
/// use tropism_neat::{Config, Neat, random_genome};
/// let config = Config::multineat();
/// let neat = Neat::new(config.clone(), 2, 1, 7).unwrap();
/// assert_eq!(neat.ask()[3], random_genome(&config, 2, 1, 7, 3));
/// ```
#[must_use]
pub fn random_genome(config: &Config, inputs: usize, outputs: usize, seed: u64, index: u64) -> Genome {
    check_shape(inputs, outputs).expect("at least one input and one output, and not too many");
    Genome::random(config, inputs, outputs, seed, index)
}

impl Genome {
    /// The minimal genome for `inputs` inputs with these weights: for each output those of the inputs, then that of the bias.
    ///
    /// # Errors
    ///
    /// [`GenomeError`] if there is no input, if the weights are not those of whole outputs, or if one is out of range.
    pub fn linear(config: &Config, inputs: usize, weights: &[f64]) -> Result<Self, GenomeError> {
        let outputs = weights.len() / (inputs + 1);
        check_shape(inputs, outputs)?;
        Self::minimal(config, inputs, outputs).with_weights(weights)
    }

    /// This genome with other weights, in the order of its links.
    ///
    /// # Errors
    ///
    /// [`GenomeError`] if there is not one weight for each link, or if one is out of range.
    pub fn with_weights(&self, weights: &[f64]) -> Result<Self, GenomeError> {
        if weights.len() != self.links.len() {
            return Err(GenomeError::WeightCount { found: weights.len(), wanted: self.links.len() });
        }
        let mut genome = self.clone();
        for (link, &weight) in genome.links.iter_mut().zip(weights) {
            link.weight = weight;
        }
        genome.check()?;
        Ok(genome)
    }

    /// [`random_genome`] without the check of its shape.
    pub(crate) fn random(config: &Config, inputs: usize, outputs: usize, seed: u64, index: u64) -> Self {
        let mut genome = Self::minimal(config, inputs, outputs);
        let mut rng = Rng::for_initial_weights(seed, u128::from(index) * genome.links.len() as u128);
        for link in &mut genome.links {
            link.weight = rng.triangular() * config.initial_weight_range;
        }
        genome
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn initial_weights_are_triangular_and_not_scaled_by_the_replacement_power() {
        let config = Config::wahby2016();
        let genomes = (0..20_000).map(|index| Genome::random(&config, 2, 1, 3, index));
        let weights: Vec<f64> = genomes.flat_map(|g| g.links.into_iter().map(|link| link.weight)).collect();
        assert!(weights.iter().all(|w| w.abs() < 1.0));
        let deviation = (weights.iter().map(|w| w * w).sum::<f64>() / weights.len() as f64).sqrt();
        assert!((deviation - 0.408).abs() < 0.005, "{deviation}");
    }
}
