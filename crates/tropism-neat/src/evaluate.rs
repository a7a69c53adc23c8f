//! Evaluation of populations, and whole runs, on all cores.

use std::ops::Range;

use crate::config::Config;
use crate::error::NeatError;
use crate::generation::Generation;
use crate::genome::Genome;
use crate::neat::Neat;
use crate::parallel;

/// Identifies one evaluation of a genome.
///
/// A task with randomness derives its seeds from it, so that results do not depend on the order of evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Evaluation {
    /// Seed of the run.
    pub seed: u64,
    /// Number of the generation.
    pub generation: u32,
    /// Index of the individual in the population.
    pub individual: usize,
}

impl Neat {
    /// Applies `score` to every individual, on all cores with the feature `rayon`, and returns the results in order.
    ///
    /// Results are usually the scores for [`tell`](Self::tell); for [`Novelty`](crate::Novelty) they are behaviours. They
    /// do not depend on the number of threads, provided that `score` depends on its arguments only.
    ///
    /// ```
    /// use tropism_neat::{Config, Neat};
    /// let mut neat = Neat::new(Config::multineat(), 2, 1, 42)?;
    /// let scores = neat.evaluate(|genome, _| genome.links().iter().map(|link| link.weight).sum());
    /// neat.tell(&scores)?;
    /// # Ok::<(), tropism_neat::NeatError>(())
    /// ```
    pub fn evaluate<T: Send>(&self, score: impl Fn(&Genome, Evaluation) -> T + Sync) -> Vec<T> {
        let (seed, generation) = (self.seed(), self.generation());
        let genomes = self.ask();
        parallel::map(genomes.len(), |individual| {
            score(&genomes[individual], Evaluation { seed, generation, individual })
        })
    }
}

/// Evolves one run per seed, on all cores with the feature `rayon`, and returns the runs in the order of the seeds.
///
/// Each run lasts `generations` generations, or until `is_solved` returns true; it is called after each generation.
///
/// # Errors
///
/// As [`Neat::new`] and [`Neat::tell`].
///
/// ```
/// use tropism_neat::{Config, Network, evolve};
/// let runs = evolve(
///     &Config::multineat(),
///     (2, 1),
///     0..3,
///     20,
///     |genome, _| Network::new(genome).activate(&[1.0, -1.0])[0],
///     |_, generation| generation.best > 0.9,
/// )?;
/// assert!(runs.iter().all(|run| run.champion().unwrap().fitness > 0.9));
/// # Ok::<(), tropism_neat::NeatError>(())
/// ```
pub fn evolve(
    config: &Config,
    (inputs, outputs): (usize, usize),
    seeds: Range<u64>,
    generations: u32,
    score: impl Fn(&Genome, Evaluation) -> f64 + Sync,
    is_solved: impl Fn(&Neat, &Generation) -> bool + Sync,
) -> Result<Vec<Neat>, NeatError> {
    let seeds: Vec<u64> = seeds.collect();
    parallel::try_map(seeds.len(), |run| {
        let seed = seeds[run];
        let mut neat = Neat::new(config.clone(), inputs, outputs, seed)?;
        for generation in 0..generations {
            let evaluation = |individual| Evaluation { seed, generation, individual };
            let individuals = neat.ask().iter().enumerate();
            let scores: Vec<f64> =
                individuals.map(|(index, genome)| score(genome, evaluation(index))).collect();
            let report = neat.tell(&scores)?;
            if is_solved(&neat, &report) {
                break;
            }
        }
        Ok(neat)
    })
}
