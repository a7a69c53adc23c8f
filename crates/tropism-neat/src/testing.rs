//! Fixtures of the unit tests: random streams, handmade genomes and mutated ones.

use crate::activation::Activation;
use crate::config::Config;
use crate::genome::{Genome, Link, Neuron, NeuronKind};
use crate::innovation::Innovations;
use crate::mutate::mutate;
use crate::random::{Purpose, Rng};

/// A random stream for a test.
pub(crate) fn rng(seed: u64) -> Rng {
    Rng::new(seed, Purpose::Offspring, 0)
}

/// A genome of linear neurons: hidden neurons are `(id, depth)`, links `(from, to, weight)` with innovation numbers from 1.
pub(crate) fn genome(
    inputs: usize,
    outputs: usize,
    hidden: &[(u32, f64)],
    links: &[(u32, u32, f64)],
) -> Genome {
    let config = Config {
        output_activation: Activation::Linear,
        hidden_activation: Activation::Linear,
        ..Config::wahby2016()
    };
    let mut genome = Genome::minimal(&config, inputs, outputs);
    genome.neurons.extend(hidden.iter().map(|&(id, depth)| Neuron {
        id,
        kind: NeuronKind::Hidden,
        depth,
        activation: Activation::Linear,
        a: 1.0,
        b: 0.0,
    }));
    let link = |(innovation, &(from, to, weight))| Link { innovation, from, to, weight, recurrent: false };
    genome.links = (1..).zip(links).map(link).collect();
    genome.check().unwrap();
    genome
}

/// Parameters with sigmoid neurons.
pub(crate) fn sigmoid_config() -> Config {
    Config {
        output_activation: Activation::UnsignedSigmoid,
        hidden_activation: Activation::UnsignedSigmoid,
        ..Config::wahby2016()
    }
}

/// A chain of `count` genomes with two inputs and one output, each a mutated copy of the one before it.
///
/// Structural mutations are frequent, so that genomes become large.
pub(crate) fn mutants(config: &Config, seed: u64, count: usize) -> Vec<Genome> {
    let config = Config {
        mutate_add_neuron_prob: 0.2,
        mutate_add_link_prob: 0.3,
        mutate_weights_prob: 0.5,
        ..config.clone()
    };
    let mut innovations = Innovations::new(&Genome::minimal(&config, 2, 1));
    let mut genome = Genome::random(&config, 2, 1, seed, 0);
    let mut rng = rng(seed);
    let next = |_| {
        mutate(&mut genome, &config, &mut innovations, &mut rng);
        genome.clone()
    };
    (0..count).map(next).collect()
}
