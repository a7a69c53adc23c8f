//! A genome: the genes of one network.
//!
//! Neuron genes stand in order of their ids: inputs `1..=n`, the bias `n + 1`, the outputs, then hidden neurons. Link genes
//! stand in order of their innovation numbers. A link that is split is gone: there is no enabled bit.

use serde::{Deserialize, Serialize};

use crate::genome_file::File;
use crate::random_search::random_weights;
use crate::{Activation, Config};

/// Largest size of a weight, slope or shift that a genome may hold.
pub const WEIGHT_LIMIT: f64 = 1e6;
/// Largest number of inputs or outputs, and of links of the smallest genome.
pub const SIZE_LIMIT: usize = 100_000;
/// Ids and innovation numbers stay below this, so that counting on from them never overflows.
pub(crate) const NUMBER_LIMIT: u32 = 1 << 31;

/// Where a neuron stands in its network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NeuronKind {
    /// Holds an input.
    Input,
    /// Holds 1.
    Bias,
    /// Is read as an output.
    Output,
    /// Neither.
    Hidden,
}

/// A neuron gene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Neuron {
    /// Number of this neuron, the same in all genomes of a run.
    pub id: u32,
    /// Where it stands.
    pub kind: NeuronKind,
    /// How far it stands from the inputs (0) towards the outputs (1); a new neuron lies midway between the two that it
    /// joins (`splitY`).
    pub depth: f64,
    /// Its activation function; without effect for inputs and bias.
    pub activation: Activation,
    /// Slope of the activation function.
    pub a: f64,
    /// Shift of the activation function.
    pub b: f64,
}

/// A link gene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Innovation number: the same for links between the same two neurons in all genomes of a run.
    pub innovation: u32,
    /// Id of the neuron that it leaves.
    pub from: u32,
    /// Id of the neuron that it enters.
    pub to: u32,
    /// What it multiplies by.
    pub weight: f64,
    /// Whether it was made as a recurrent link, or by splitting one.
    pub recurrent: bool,
}

/// The genes of one network.
///
/// Serialises as, and is checked like, the file of [`to_json`](Self::to_json).
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "File", try_from = "File")]
pub struct Genome {
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    pub(crate) neurons: Vec<Neuron>,
    pub(crate) links: Vec<Link>,
}

impl Clone for Genome {
    fn clone(&self) -> Self {
        let (neurons, links) = (self.neurons.clone(), self.links.clone());
        Self { inputs: self.inputs, outputs: self.outputs, neurons, links }
    }

    /// Reuses the room that this genome has: a generation is written over the one before the last.
    fn clone_from(&mut self, other: &Self) {
        self.inputs = other.inputs;
        self.outputs = other.outputs;
        self.neurons.clone_from(&other.neurons);
        self.links.clone_from(&other.links);
    }
}

impl Genome {
    /// The smallest genome: every input and the bias linked to every output with weight 0, innovations numbered from 1.
    pub(crate) fn seed(config: &Config, inputs: usize, outputs: usize) -> Self {
        let mut genome = Self { inputs, outputs, neurons: Vec::new(), links: Vec::new() };
        for index in 0..inputs + 1 + outputs {
            let (kind, depth, activation) = match index {
                i if i < inputs => (NeuronKind::Input, 0.0, Activation::Linear),
                i if i == inputs => (NeuronKind::Bias, 0.0, Activation::Linear),
                _ => (NeuronKind::Output, 1.0, config.output_activation),
            };
            let (a, b) = (config.activation_a, config.activation_b);
            genome.neurons.push(Neuron { id: index as u32 + 1, kind, depth, activation, a, b });
        }
        for to in inputs + 2..inputs + 2 + outputs {
            for from in 1..=inputs + 1 {
                let innovation = genome.links.len() as u32 + 1;
                let (from, to) = (from as u32, to as u32);
                genome.links.push(Link { innovation, from, to, weight: 0.0, recurrent: false });
            }
        }
        genome
    }

    /// The smallest genome with random weights, number `index` of an initial population.
    pub(crate) fn random(config: &Config, inputs: usize, outputs: usize, seed: u64, index: u64) -> Self {
        let mut genome = Self::seed(config, inputs, outputs);
        let weights = random_weights(config, inputs, outputs, seed, index);
        for (link, weight) in genome.links.iter_mut().zip(weights) {
            link.weight = weight;
        }
        genome
    }

    /// Number of inputs, without the bias.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.outputs
    }

    /// Neuron genes in order of ids: inputs, bias, outputs, hidden.
    #[must_use]
    pub fn neurons(&self) -> &[Neuron] {
        &self.neurons
    }

    /// Link genes in order of innovation numbers.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Place of the neuron `id` in [`neurons`](Self::neurons), if there is one.
    #[must_use]
    pub fn position(&self, id: u32) -> Option<usize> {
        // All but the hidden neurons are numbered from 1 without a gap.
        let fixed = self.inputs + 1 + self.outputs;
        let index = id.wrapping_sub(1) as usize;
        if index < fixed {
            return Some(index);
        }
        self.neurons[fixed..].binary_search_by_key(&id, |neuron| neuron.id).ok().map(|place| place + fixed)
    }

    /// Whether a link leads from neuron `from` to neuron `to`.
    pub(crate) fn has_link(&self, from: u32, to: u32) -> bool {
        self.links.iter().any(|link| link.from == from && link.to == to)
    }

    /// The id of a hidden neuron that no neuron but the bias and itself feeds, or that feeds none but itself.
    pub(crate) fn dead_hidden(&self) -> Option<u32> {
        let bias = self.inputs as u32 + 1;
        let (mut is_fed, mut feeds) = (vec![false; self.neurons.len()], vec![false; self.neurons.len()]);
        let place = |id| self.position(id).expect("a genome's links join its own neurons");
        for link in self.links.iter().filter(|link| link.from != link.to) {
            is_fed[place(link.to)] |= link.from != bias;
            feeds[place(link.from)] = true;
        }
        let mut hidden = self.inputs + 1 + self.outputs..self.neurons.len();
        hidden.find(|&place| !is_fed[place] || !feeds[place]).map(|place| self.neurons[place].id)
    }

    /// Whether some neuron leads nowhere: a dead hidden neuron, an output with exactly one link in and one out, or an only
    /// output with no link at all.
    pub(crate) fn has_dead_ends(&self) -> bool {
        let outputs = self.neurons.iter().filter(|neuron| neuron.kind == NeuronKind::Output);
        let is_dead = |output: &Neuron| {
            let entering = self.links.iter().filter(|link| link.to == output.id).count();
            let leaving = self.links.iter().filter(|link| link.from == output.id).count();
            (entering, leaving) == (1, 1) || (self.outputs == 1 && (entering, leaving) == (0, 0))
        };
        outputs.into_iter().any(is_dead) || self.dead_hidden().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::genome;

    #[test]
    fn the_seed_links_x_y_and_bias_to_the_output_with_weight_zero() {
        let seed = Genome::seed(&Config::paper(), 2, 1);
        let links: Vec<_> = seed.links().iter().map(|l| (l.innovation, l.from, l.to, l.weight)).collect();
        assert_eq!(links, [(1, 1, 4, 0.0), (2, 2, 4, 0.0), (3, 3, 4, 0.0)]);
        let kinds: Vec<_> = seed.neurons().iter().map(|n| n.kind).collect();
        assert_eq!(kinds, [NeuronKind::Input, NeuronKind::Input, NeuronKind::Bias, NeuronKind::Output]);
        assert_eq!(seed.check().map_err(|e| e.to_string()), Ok(()));
    }

    #[test]
    fn initial_weights_are_triangular_and_not_scaled_by_the_replacement_power() {
        let config = Config::paper();
        let genomes = (0..20_000).map(|index| Genome::random(&config, 2, 1, 3, index));
        let weights: Vec<f64> = genomes.flat_map(|g| g.links.into_iter().map(|link| link.weight)).collect();
        assert!(weights.iter().all(|w| w.abs() < 1.0));
        let deviation = (weights.iter().map(|w| w * w).sum::<f64>() / weights.len() as f64).sqrt();
        assert!((deviation - 0.408).abs() < 0.005, "{deviation}");
    }

    #[test]
    fn dead_ends_are_found() {
        let is_dead =
            |hidden: &[(u32, f64)], links: &[(u32, u32, f64)]| genome(1, 1, hidden, links).has_dead_ends();
        assert!(!is_dead(&[(4, 0.5)], &[(1, 4, 1.0), (4, 3, 1.0), (2, 3, 1.0)]));
        assert!(is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (4, 3, 1.0)]), "nothing enters");
        assert!(is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (2, 4, 1.0), (4, 3, 1.0)]), "only the bias enters");
        assert!(is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (4, 4, 1.0), (4, 3, 1.0)]), "only itself enters");
        assert!(is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (1, 4, 1.0)]), "nothing leaves");
        assert!(is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (1, 4, 1.0), (4, 4, 1.0)]), "only a loop leaves");
        assert!(is_dead(&[], &[(3, 3, 1.0)]), "an output with one link in and one out");
        assert!(is_dead(&[], &[]), "an only output without a link");
        assert!(!is_dead(&[], &[(1, 3, 1.0), (3, 3, 1.0)]));
    }
}
