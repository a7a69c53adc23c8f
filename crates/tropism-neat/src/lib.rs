//! NEAT: neuroevolution of augmenting topologies (Stanley and Miikkulainen 2002), as implemented in MultiNEAT in 2016.
//!
//! In: the scores of a population's networks on any task. Out: the next population. The one idea: networks start minimal
//! and grow by mutation, and every structural mutation has an innovation number. By these numbers the genes of different
//! networks are aligned, for crossover and to divide the population into species.
//!
//! The crate knows no task and reads no clock, file or environment. One seed gives the same bits on every machine and with
//! any number of threads. Without its default feature `rayon` it uses no threads, and runs on `wasm32-unknown-unknown`.
//!
//! # A tour
//!
//! A [`Neat`] is a run. [`ask`](Neat::ask) it for the population, score each [`Genome`] by the behaviour of its [`Network`],
//! [`tell`](Neat::tell) the scores, and repeat. Larger scores are better. The example evolves XOR:
//!
//! ```
//! use tropism_neat::{Config, Genome, Neat, Network};
//!
//! let cases = [([0.0, 0.0], 0.0), ([0.0, 1.0], 1.0), ([1.0, 0.0], 1.0), ([1.0, 1.0], 0.0)];
//! let score = |genome: &Genome| -> f64 {
//!     let mut network = Network::new(genome);
//!     let error = |(inputs, target): ([f64; 2], f64)| (network.run(&inputs)[0] - target).powi(2);
//!     4.0 - cases.map(error).iter().sum::<f64>()
//! };
//!
//! let config = Config { feed_forward: true, ..Config::stanley2002() };
//! let mut neat = Neat::new(config, 2, 1, 42)?; // two inputs (the bias is added), one output, seed 42
//! for _ in 0..60 {
//!     let scores: Vec<f64> = neat.ask().iter().map(score).collect();
//!     let generation = neat.tell(&scores)?;
//!     println!("{}: {:.2}, {} species", generation.generation, generation.best, generation.species);
//! }
//! assert!(neat.champion().unwrap().fitness > 3.0);
//! # Ok::<(), tropism_neat::NeatError>(())
//! ```
//!
//! **Scoring.** `ask` returns a slice and `tell` takes a slice, so genomes may be scored one by one, in batches, or on a
//! server. [`Neat::evaluate`] applies a closure on all cores. A task with randomness derives its seeds from the
//! [`Evaluation`], and may average several episodes:
//!
//! ```
//! # use tropism_neat::{Config, Evaluation, Genome, Neat, NeatError, Network};
//! # let mut neat = Neat::new(Config::multineat(), 2, 1, 42)?;
//! /// One episode, whose start depends on the evaluation and the number of the episode.
//! fn episode(genome: &Genome, evaluation: Evaluation, episode: u32) -> f64 {
//!     let mut network = Network::new(genome);
//!     let start = (evaluation.generation + 7 * evaluation.individual as u32 + 31 * episode) % 10;
//!     network.run(&[f64::from(start), 1.0])[0]
//! }
//! let scores = neat.evaluate(|genome, evaluation| {
//!     (0..5).map(|number| episode(genome, evaluation, number)).sum::<f64>() / 5.0
//! });
//! neat.tell(&scores)?;
//! # Ok::<(), NeatError>(())
//! ```
//!
//! [`evolve`](fn@evolve) makes several runs, one per seed, on all cores.
//!
//! **Recurrent or feed-forward.** With [`Config::feed_forward`] links form no cycles. Otherwise networks may have recurrent
//! links, and a state that persists between steps. [`Network::run`] suits both: it passes the inputs through a network that
//! [is feed-forward](Network::is_feed_forward), and advances any other network by one synchronous step
//! ([`Network::activate`]). [`StepNetwork`] runs networks of step neurons much faster, to the same bits.
//!
//! **Parameters.** [`Config::wahby2016`], the default, [`Config::multineat`] and [`Config::stanley2002`] are presets with
//! sources. Extensions are off by default: a cost of links ([`Config::complexity_penalty`]), distances relative to genome
//! size ([`Config::normalize_genome_size`]) and networks without cycles ([`Config::feed_forward`]).
//!
//! **Novelty search.** [`Novelty`] turns behaviour descriptors into scores, for tasks with a deceptive objective.
//!
//! **Files.** [`Neat::to_json`] saves a whole run; restored by [`Neat::from_json`], it continues bit for bit.
//! [`Genome::to_json`] saves one network. Reading checks every gene.
//!
//! ```
//! # use tropism_neat::{Config, Neat};
//! # let mut neat = Neat::new(Config::multineat(), 2, 1, 42).unwrap();
//! let scores = neat.evaluate(|genome, _| -(genome.links().len() as f64));
//! let mut restored = Neat::from_json(&neat.to_json()).unwrap();
//! assert_eq!(neat.tell(&scores).unwrap(), restored.tell(&scores).unwrap());
//! assert_eq!(neat.ask(), restored.ask());
//! ```
//!
//! # Features
//!
//! `rayon` (default): [`Neat::evaluate`] and [`evolve`](fn@evolve) use rayon's thread pool. Without it they run on the
//! calling thread, with the same results.
//!
//! # References
//!
//! - K. O. Stanley and R. Miikkulainen, *Evolving neural networks through augmenting topologies*, Evolutionary Computation
//!   10(2), 2002, [doi:10.1162/106365602320169811](https://doi.org/10.1162/106365602320169811).
//! - P. Chervenski and S. Ryan, *MultiNEAT*, a C++ and Python library, 2012 to 2016.

mod limits;
pub mod statistics;
mod activation;
mod config;
mod genome;
mod topology;
mod genome_file;
mod random;
mod random_genome;
mod innovation;
mod mutate;
mod crossover;
mod species;
mod reproduce;
mod generation;
mod error;
mod neat;
mod checkpoint;
pub mod parallel;
mod evaluate;
mod novelty;
mod network;
mod step_network;
#[cfg(test)]
mod testing;

pub use activation::Activation;
pub use config::{Config, ConfigError};
pub use error::{CheckpointError, NeatError};
pub use evaluate::{Evaluation, evolve};
pub use generation::Generation;
pub use genome::{Genome, Link, Neuron, NeuronKind};
pub use genome_file::GenomeError;
pub use limits::{DESCRIPTOR_LIMIT, SCORE_LIMIT, SIZE_LIMIT, WEIGHT_LIMIT};
pub use neat::{Champion, Neat};
pub use network::Network;
pub use novelty::{Novelty, NoveltyConfig, NoveltyError};
pub use random::keyed_stream;
pub use random_genome::random_genome;
pub use species::Species;
pub use step_network::{LinearThreshold, StepNetwork};
pub use topology::topological_order;

/// Tests the examples of the README together with those of the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
