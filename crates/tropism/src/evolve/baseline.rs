//! The paper's random baseline: networks as NEAT's initial population makes them (section 3.1).

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

/// Tries `count` random networks, on all threads.
///
/// `tick` gets the number of further networks that were tried; `false` from it breaks off, without a result.
///
/// # Panics
/// If `count` is 0.
pub fn baseline<M: BatchModel>(
    model: &M,
    task: &Task,
    sensors: &Sensors,
    neat: &Config,
    seed: u64,
    count: u64,
    tick: impl Fn(u64) -> bool + Send + Sync,
) -> Option<Baseline> {
    /// Controllers of one unit of parallel work. Chosen: a tenth of a second, and some megabytes of genomes.
    const CHUNK: u64 = 10_000;
    assert!(count > 0, "at least one controller");
    let (inputs, outputs) = (sensors.inputs(), outputs(model.layout()));
    let chunks = parallel::try_map(count.div_ceil(CHUNK) as usize, |chunk| {
        let first = chunk as u64 * CHUNK;
        let indices = first..count.min(first + CHUNK);
        let noise =
            |index: u64| NoiseStream::new(seed, Purpose::Growth, [(index >> 32) as u32, index as u32, 0]);
        let genomes: Vec<Genome> =
            indices.clone().map(|index| random_genome(neat, inputs, outputs, seed, index)).collect();
        let episodes = genomes
            .iter()
            .zip(indices)
            .map(|(genome, index)| Episode { controller: genome, noise: noise(index) });
        let scores = model.score(task, sensors, episodes);
        if tick(scores.len() as u64) { Ok(scores) } else { Err(()) }
    });
    let scores = chunks.ok()?.concat();
    let best = statistics::index_of_greatest(&scores);
    let (index, fitness) = (best as u64, scores[best]);
    let champion = random_genome(neat, inputs, outputs, seed, index);
    Some(Baseline { count, best: fitness, median: statistics::median(&scores), champion })
}
