//! Whole runs: the population scored over all cores, or one run a core.

use std::ops::Range;

use rayon::prelude::*;

use crate::{Config, Generation, Genome, Neat, NeatError};

/// Which evaluation this is: what a task with chance in it should key its random numbers by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trial {
    /// Seed of the run.
    pub seed: u64,
    /// Number of the generation.
    pub generation: u32,
    /// Place of the individual in the population.
    pub individual: usize,
}

impl Neat {
    /// Runs the population over all cores of rayon's pool. In order, what came of each individual: mostly the scores to
    /// [`tell`](Self::tell), but a [`Novelty`](crate::Novelty) wants behaviours.
    ///
    /// Whatever the number of threads, the result is the same, as long as `score` depends on nothing but its arguments.
    ///
    /// ```
    /// use tropism_neat::{Config, Neat};
    /// let mut neat = Neat::new(Config::paper(), 2, 1, 42)?;
    /// let scores = neat.evaluate(|genome, _trial| genome.links().iter().map(|link| link.weight).sum());
    /// neat.tell(&scores)?;
    /// # Ok::<(), tropism_neat::NeatError>(())
    /// ```
    pub fn evaluate<T: Send>(&self, score: impl Fn(&Genome, Trial) -> T + Sync) -> Vec<T> {
        let (seed, generation) = (self.seed(), self.generation());
        let individuals = self.ask().par_iter().enumerate();
        individuals
            .map(|(individual, genome)| score(genome, Trial { seed, generation, individual }))
            .collect()
    }
}

/// Several runs over all cores of rayon's pool, one for each seed, in order of the seeds.
///
/// Each goes on for `generations`, or until `is_solved`, which is asked after each of them.
///
/// # Errors
///
/// As for [`Neat::new`] and [`Neat::tell`].
///
/// ```
/// use tropism_neat::{Config, Network, evolve};
/// let runs = evolve(
///     &Config::paper(),
///     (2, 1),
///     0..3,
///     20,
///     |genome, _trial| Network::new(genome).activate(&[1.0, -1.0])[0],
///     |_neat, generation| generation.best == 1.0,
/// )?;
/// assert!(runs.iter().all(|run| run.champion().unwrap().fitness == 1.0));
/// # Ok::<(), tropism_neat::NeatError>(())
/// ```
pub fn evolve(
    config: &Config,
    (inputs, outputs): (usize, usize),
    seeds: Range<u64>,
    generations: u32,
    score: impl Fn(&Genome, Trial) -> f64 + Sync,
    is_solved: impl Fn(&Neat, &Generation) -> bool + Sync,
) -> Result<Vec<Neat>, NeatError> {
    let seeds = seeds.into_par_iter();
    seeds
        .map(|seed| {
            let mut neat = Neat::new(config.clone(), inputs, outputs, seed)?;
            for generation in 0..generations {
                let trial = |individual| Trial { seed, generation, individual };
                let individuals = neat.ask().iter().enumerate();
                let scores: Vec<f64> =
                    individuals.map(|(place, genome)| score(genome, trial(place))).collect();
                let report = neat.tell(&scores)?;
                if is_solved(&neat, &report) {
                    break;
                }
            }
            Ok(neat)
        })
        .collect()
}
