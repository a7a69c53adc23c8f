//! CMA-ES on the weights of a network whose topology does not change, with restarts.

use serde::{Deserialize, Serialize};
use tropism_neat::{Generation, Genome, WEIGHT_LIMIT};

use crate::CmaEs;
use crate::math::statistics;

/// Standard deviation of each weight at first. Chosen by hand, the only value that was tried: a mutation of NEAT
/// perturbs weights by 0.41.
const START_SD: f64 = 0.4;

/// A search for the weights of one topology, by ask and tell as NEAT's: its complete state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeightSearch {
    /// The network whose weights are searched; its own are the start.
    topology: Genome,
    search: CmaEs,
    generation: u32,
    evaluations: u64,
    /// The best network so far and its score.
    best: Option<(Genome, f64)>,
    /// The centre of the search and, before it, those of the searches that were over.
    centres: Vec<Genome>,
}

impl WeightSearch {
    /// A search from the weights of `topology`, with `population` networks a generation.
    #[must_use]
    pub(super) fn new(topology: Genome, population: usize, seed: u64) -> Self {
        let start: Vec<f64> = topology.links().iter().map(|link| link.weight).collect();
        Self {
            search: CmaEs::new(&start, START_SD, population, seed),
            generation: 0,
            evaluations: 0,
            best: None,
            centres: vec![topology.clone()],
            topology,
        }
    }

    /// Whether it is a search with this population and seed, of as many weights as its topology has links.
    pub(super) fn is_of(&self, population: usize, seed: u64) -> bool {
        self.search.is_of(self.topology.links().len(), population, seed) && !self.centres.is_empty()
    }

    fn genome(&self, point: &[f64]) -> Genome {
        let weights: Vec<f64> =
            point.iter().map(|weight| weight.clamp(-WEIGHT_LIMIT, WEIGHT_LIMIT)).collect();
        self.topology.with_weights(&weights).expect("a weight in range for each link")
    }

    /// The networks of the present generation.
    #[must_use]
    pub fn ask(&self) -> Vec<Genome> {
        self.search.ask().iter().map(|point| self.genome(point)).collect()
    }

    /// Takes the score of each network, and goes on to the next generation. Larger scores are better.
    pub(super) fn tell(&mut self, scores: &[f64]) -> Generation {
        let points = self.search.ask();
        let index = statistics::index_of_greatest(scores);
        let best = scores[index];
        if self.best.as_ref().is_none_or(|(_, so_far)| best > *so_far) {
            self.best = Some((self.genome(&points[index]), best));
        }
        self.search.tell(&points, &scores.iter().map(|score| -score).collect::<Vec<f64>>());
        let centre = self.genome(self.search.mean());
        if let Some(last) = self.centres.last_mut() {
            *last = centre;
        }
        if self.search.is_over() {
            self.search = self.search.restarted();
            self.centres.push(self.topology.clone());
        }
        self.generation += 1;
        self.evaluations += scores.len() as u64;
        let links = self.topology.links().len();
        Generation {
            generation: self.generation - 1,
            best,
            mean: statistics::mean(scores.iter().copied()),
            median: statistics::median(scores),
            best_ever: self.best.as_ref().map_or(best, |(_, fitness)| *fitness),
            species: 1,
            population: scores.len(),
            links_mean: links as f64,
            hidden_mean: self.topology.hidden() as f64,
            champion_links: links,
            threshold: 0.0,
            evaluations: self.evaluations,
        }
    }

    /// Number of the present generation.
    #[must_use]
    pub const fn generation(&self) -> u32 {
        self.generation
    }

    /// Number of scores taken so far.
    #[must_use]
    pub const fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// The best network so far and its score; `None` before the first generation.
    #[must_use]
    pub fn best(&self) -> Option<(&Genome, f64)> {
        self.best.as_ref().map(|(genome, fitness)| (genome, *fitness))
    }

    /// The centre of the search and, before it, those of the searches that were over: where scores are noisy, the best estimates.
    #[must_use]
    pub fn centres(&self) -> &[Genome] {
        &self.centres
    }
}
