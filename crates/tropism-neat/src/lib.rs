//! NEAT, the evolution of neural networks by augmenting topologies, as MultiNEAT ran it in 2016.
//!
//! In: the scores of a population's networks on any task. Out: the next population. The one idea: networks start small,
//! grow by mutation, and every novelty carries a number by which unlike networks can be matched, mated and told apart.
//!
//! This crate knows no task. It reads no clock and no environment: one seed gives the same bits on any machine and any
//! number of threads.
//!
//! # A tour
//!
//! A [`Neat`] is a run. [`ask`](Neat::ask) it for its population, score each [`Genome`] by what the [`Network`] made of it
//! does, [`tell`](Neat::tell) the scores, larger being better, and so on. Here, exclusive or:
//!
//! ```
//! use tropism_neat::{Activation, Config, Genome, Neat, Network};
//!
//! let cases = [([0.0, 0.0], 0.0), ([0.0, 1.0], 1.0), ([1.0, 0.0], 1.0), ([1.0, 1.0], 0.0)];
//! let score = |genome: &Genome| -> f64 {
//!     let mut network = Network::new(genome);
//!     let error = |(inputs, wanted): ([f64; 2], f64)| (network.activate_feed_forward(&inputs)[0] - wanted).powi(2);
//!     4.0 - cases.map(error).iter().sum::<f64>()
//! };
//!
//! let config = Config {
//!     population: 150,
//!     output_activation: Activation::UnsignedSigmoid,
//!     hidden_activation: Activation::UnsignedSigmoid,
//!     activation_a: 4.9,
//!     feed_forward: true,
//!     ..Config::paper()
//! };
//! let mut neat = Neat::new(config, 2, 1, 42)?; // two inputs (the bias is added), one output, seed 42
//! for _ in 0..40 {
//!     let scores: Vec<f64> = neat.ask().iter().map(score).collect();
//!     let generation = neat.tell(&scores)?;
//!     println!("{}: {:.2}, {} species", generation.generation, generation.best, generation.species);
//! }
//! assert!(neat.champion().unwrap().fitness > 3.0);
//! # Ok::<(), tropism_neat::NeatError>(())
//! ```
//!
//! **Scoring is up to you.** As above, one by one; all at once, in whatever batches a simulator or a server likes, as `ask` is a plain
//! slice and `tell` takes a plain slice; or over all cores, by a closure, with [`Neat::evaluate`]. Where the task has luck
//! in it, key that by the [`Trial`], and let a genome try several times:
//!
//! ```
//! # use tropism_neat::{Config, Genome, Neat, NeatError, Network, Trial};
//! # let mut neat = Neat::new(Config::paper(), 2, 1, 42)?;
//! /// One episode, whose luck its name decides: here, where it begins.
//! fn episode(genome: &Genome, trial: Trial, episode: u32) -> f64 {
//!     let mut network = Network::new(genome);
//!     let place = f64::from((trial.generation + 7 * trial.individual as u32 + 31 * episode) % 10);
//!     network.activate(&[place, 1.0])[0]
//! }
//! let scores = neat.evaluate(|genome, trial| {
//!     (0..5).map(|number| episode(genome, trial, number)).sum::<f64>() / 5.0
//! });
//! neat.tell(&scores)?;
//! # Ok::<(), NeatError>(())
//! ```
//!
//! [`evolve`](fn@evolve) makes many such runs, one for each seed, over all cores.
//!
//! **Recurrent or feed-forward.** [`Network::activate`] is one synchronous step: a link reads what its source held before,
//! and the state is kept, so a network can remember. [`Network::activate_feed_forward`] lets a signal run through at once;
//! with [`Config::feed_forward`] no link ever leads back. [`StepNetwork`] runs networks of step neurons much faster, to
//! the same bits.
//!
//! **Parameters.** [`Config::paper`] is MultiNEAT with the paper's Table 1 and suits small, hard decisions; each field says
//! what it does and what MultiNEAT calls it. What MultiNEAT does not have is off there: a price for links
//! ([`Config::complexity_penalty`]), distances by genome size ([`Config::normalize_genome_size`]). Mutations that remove
//! links and neurons are there, too, with probability 0.
//!
//! **Searching for the new.** Where the goal misleads, a [`Novelty`] turns descriptors of behaviour into scores to tell.
//!
//! **Stopping and going on.** [`Neat::to_json`] saves a whole run and [`Neat::from_json`] goes on with it to the same bits;
//! [`Genome::to_json`] saves one network. Files are checked gene by gene when they are read.
//!
//! ```
//! # use tropism_neat::{Config, Neat};
//! # let mut neat = Neat::new(Config::paper(), 2, 1, 42).unwrap();
//! let scores = neat.evaluate(|genome, _trial| -(genome.links().len() as f64));
//! let mut again = Neat::from_json(&neat.to_json()).unwrap();
//! assert_eq!(neat.tell(&scores).unwrap(), again.tell(&scores).unwrap());
//! assert_eq!(neat.ask(), again.ask());
//! ```
//!
//! # References
//!
//! K. O. Stanley and R. Miikkulainen, *Evolving neural networks through augmenting topologies*, Evolutionary Computation
//! 10(2), 2002, [doi:10.1162/106365602320169811](https://doi.org/10.1162/106365602320169811).

mod activation;
mod checkpoint;
mod config;
mod crossover;
mod genome;
mod genome_file;
mod innovation;
mod mutate;
mod neat;
mod network;
mod novelty;
mod random;
mod random_search;
mod reproduce;
mod run;
mod species;
mod stats;
mod step_network;
#[cfg(test)]
mod testing;

pub use activation::Activation;
pub use checkpoint::CheckpointError;
pub use config::{Config, ConfigError};
pub use genome::{Genome, Link, Neuron, NeuronKind, SIZE_LIMIT, WEIGHT_LIMIT};
pub use genome_file::GenomeError;
pub use neat::{Champion, Neat, NeatError, SCORE_LIMIT};
pub use network::Network;
pub use novelty::{DESCRIPTOR_LIMIT, Novelty, NoveltyConfig, NoveltyError};
pub use random_search::{random_genome, random_weights};
pub use run::{Trial, evolve};
pub use species::Species;
pub use stats::Generation;
pub use step_network::{Sensor, StepNetwork};

/// The example of the README, which is tested with those of the documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
