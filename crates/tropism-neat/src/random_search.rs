//! The paper's baseline: controllers "obtained from the initialization process of NEAT", tried at random.

use crate::random::Dice;
use crate::{Config, Genome};

/// Number `index` of the random genomes of `seed`: distributed like, and for the same seed equal to, the members of the
/// initial population of [`Neat::new`](crate::Neat::new).
///
/// # Panics
///
/// If there are no inputs or no outputs, or too many.
///
/// ```
/// use tropism_neat::{Config, Neat, random_genome};
/// let config = Config::paper();
/// let neat = Neat::new(config.clone(), 2, 1, 7).unwrap();
/// assert_eq!(neat.ask()[3], random_genome(&config, 2, 1, 7, 3));
/// ```
#[must_use]
pub fn random_genome(config: &Config, inputs: usize, outputs: usize, seed: u64, index: u64) -> Genome {
    crate::genome_file::check_shape(inputs, outputs)
        .expect("at least one input and one output, and not too many");
    Genome::random(config, inputs, outputs, seed, index)
}

/// The weights of [`random_genome`], in order of its links (for each output those of the inputs and of the bias), then
/// those of the next index, and so on without end.
///
/// That is all that tells such genomes apart, and much cheaper than to make one.
pub fn random_weights(
    config: &Config,
    inputs: usize,
    outputs: usize,
    seed: u64,
    index: u64,
) -> impl Iterator<Item = f64> {
    let range = config.initial_weight_range;
    let links = (inputs + 1) * outputs;
    let mut dice = Dice::of_origin(seed, u128::from(index) * links as u128);
    std::iter::repeat_with(move || dice.signed() * range)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_genome() {
        let config = Config { initial_weight_range: 3.0, ..Config::paper() };
        let mut of_all = random_weights(&config, 3, 2, 9, 0);
        for index in 0..20 {
            let genome = random_genome(&config, 3, 2, 9, index);
            let weights: Vec<f64> = genome.links().iter().map(|link| link.weight).collect();
            assert_eq!(weights, random_weights(&config, 3, 2, 9, index).take(8).collect::<Vec<_>>());
            assert_eq!(weights, of_all.by_ref().take(8).collect::<Vec<_>>());
        }
    }
}
