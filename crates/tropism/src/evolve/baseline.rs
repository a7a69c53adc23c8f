//! The paper's random baseline: networks as NEAT's initial population makes them (section 3.1).

use std::ops::Range;

use serde::Serialize;
use tropism_neat::{Config, Genome, random_genome};

use crate::control::{Sensors, outputs};
use crate::math::statistics;
use crate::parallel;
use crate::random::{NoiseStream, Purpose};
use crate::simulation::{BatchModel, Episode};
use crate::task::Task;

/// Fitness of random controllers (section 3.1).
#[derive(Clone, Debug, Serialize)]
pub struct Baseline {
    /// How many were tried.
    pub count: u64,
    /// Best fitness, in cm.
    pub best: f64,
    /// Median fitness, in cm.
    pub median: f64,
    /// The best genome.
    #[serde(skip)]
    pub champion: Genome,
}

impl Baseline {
    /// The baseline of the networks with the fitness `scores`, from the first on, which [`random_scores`] tried with the same
    /// `neat` and `seed`.
    ///
    /// # Panics
    /// If there are none.
    pub fn of<M: BatchModel>(scores: &[f64], model: &M, sensors: &Sensors, neat: &Config, seed: u64) -> Self {
        assert!(!scores.is_empty(), "at least one controller");
        let best = statistics::index_of_greatest(scores);
        let champion = random_genome(neat, sensors.inputs(), outputs(model.layout()), seed, best as u64);
        Self { count: scores.len() as u64, best: scores[best], median: statistics::median(scores), champion }
    }
}

/// The fitness of the random networks of `indices`, in order, tried on all threads.
///
/// `tick` gets the number of further networks that were tried; `false` from it breaks off, without a result.
pub fn random_scores<M: BatchModel>(
    model: &M,
    task: &Task,
    sensors: &Sensors,
    neat: &Config,
    seed: u64,
    indices: Range<u64>,
    tick: impl Fn(u64) -> bool + Send + Sync,
) -> Option<Vec<f64>> {
    /// Controllers of one unit of parallel work. Chosen: a tenth of a second, and some megabytes of genomes.
    const CHUNK: u64 = 10_000;
    let (inputs, outputs) = (sensors.inputs(), outputs(model.layout()));
    let Range { start, end } = indices;
    let chunks = parallel::try_map((end - start).div_ceil(CHUNK) as usize, |chunk| {
        let first = start + chunk as u64 * CHUNK;
        let indices = first..end.min(first + CHUNK);
        let noise =
            |index: u64| NoiseStream::new(seed, Purpose::Growth, [(index >> 32) as u32, index as u32, 0]);
        let genomes: Vec<Genome> =
            indices.clone().map(|index| random_genome(neat, inputs, outputs, seed, index)).collect();
        let episodes = genomes
            .iter()
            .zip(indices)
            .map(|(genome, index)| Episode { controller: genome, noise: noise(index) });
        let scores = model.score(task, sensors.into(), episodes);
        if tick(scores.len() as u64) { Ok(scores) } else { Err(()) }
    });
    Some(chunks.ok()?.concat())
}
