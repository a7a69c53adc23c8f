//! NEAT, the evolution of neural networks by augmenting topologies, as MultiNEAT ran it in 2016.
//!
//! In: the scores of a population's networks on any task. Out: the next population. The one idea: networks start small,
//! grow by mutation, and every novelty carries a number by which unlike networks can be matched, mated and told apart.
//!
//! [`Neat::ask`] for genomes, run each as a [`Network`], [`Neat::tell`] the scores. This crate knows no task. It reads no
//! clock and no environment: one seed gives the same bits on any machine and any number of threads.
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
pub use random_search::random_genome;
pub use run::{Trial, evolve};
pub use species::Species;
pub use stats::Generation;
pub use step_network::{Sensor, StepNetwork};
