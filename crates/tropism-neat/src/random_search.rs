//! The paper's baseline: controllers "obtained from the initialization process of NEAT", tried at random.

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
