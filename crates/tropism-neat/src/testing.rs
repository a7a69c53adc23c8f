//! What several tests need: genomes of any form, and grown ones.

use crate::innovation::Innovations;
use crate::mutate::mutate;
use crate::random::{Dice, Purpose};
use crate::{Activation, Config, Genome, Link, Neuron, NeuronKind};

/// Dice for a test.
pub(crate) fn dice(seed: u64) -> Dice {
    Dice::new(seed, Purpose::Birth, 0)
}

/// A linear genome with hidden neurons `(id, depth)` and links `(from, to, weight)`, numbered from 1.
pub(crate) fn genome(
    inputs: usize,
    outputs: usize,
    hidden: &[(u32, f64)],
    links: &[(u32, u32, f64)],
) -> Genome {
    let config = Config {
        output_activation: Activation::Linear,
        hidden_activation: Activation::Linear,
        ..Config::paper()
    };
    let mut genome = Genome::seed(&config, inputs, outputs);
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

/// The paper's parameters with sigmoids everywhere.
pub(crate) fn sigmoids() -> Config {
    Config {
        output_activation: Activation::UnsignedSigmoid,
        hidden_activation: Activation::UnsignedSigmoid,
        ..Config::paper()
    }
}

/// Genomes of two inputs and one output, each the mutated copy of the one before, with much growth.
pub(crate) fn grown(config: &Config, seed: u64, count: usize) -> Vec<Genome> {
    let config = Config {
        mutate_add_neuron_prob: 0.2,
        mutate_add_link_prob: 0.3,
        mutate_weights_prob: 0.5,
        ..config.clone()
    };
    let mut innovations = Innovations::new(&Genome::seed(&config, 2, 1));
    let mut genome = Genome::random(&config, 2, 1, seed, 0);
    let mut dice = dice(seed);
    let next = |_| {
        mutate(&mut genome, &config, &mut innovations, &mut dice);
        genome.clone()
    };
    (0..count).map(next).collect()
}
