//! Genomes: the genes of one network.
//!
//! Neuron genes are in ascending order of ids: inputs `1..=n`, the bias `n + 1`, the outputs, then hidden neurons. Link
//! genes are in ascending order of innovation numbers. A link that is split is removed, as in MultiNEAT; with
//! [`Config::disable_split_links`] it becomes a disabled gene, as in Stanley and Miikkulainen (2002).

use std::borrow::Cow;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::activation::Activation;
use crate::config::Config;

/// Kind of a neuron.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NeuronKind {
    /// Holds an input value.
    Input,
    /// Holds 1.
    Bias,
    /// Is read as an output of the network.
    Output,
    /// Any other neuron.
    Hidden,
}

/// The word of genome files.
impl fmt::Display for NeuronKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Input => "input",
            Self::Bias => "bias",
            Self::Output => "output",
            Self::Hidden => "hidden",
        })
    }
}

/// A neuron gene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Neuron {
    /// Identifies this neuron in all genomes of a run.
    pub id: u32,
    /// Kind of the neuron.
    pub kind: NeuronKind,
    /// Depth label: 0 for inputs and bias, 1 for outputs. A new hidden neuron lies midway between the ends of the link that
    /// it splits. MultiNEAT: `splitY`.
    pub depth: f64,
    /// Activation function; unused for inputs and bias.
    pub activation: Activation,
    /// Slope of the activation function.
    pub a: f64,
    /// Shift of the activation function.
    pub b: f64,
}

/// A link gene: a weighted connection from one neuron to another, or to itself.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Link {
    /// Innovation number, the same for links between the same two neurons in all genomes of a run.
    pub innovation: u32,
    /// Id of the source neuron.
    pub from: u32,
    /// Id of the target neuron.
    pub to: u32,
    /// Factor on the activation of the source.
    pub weight: f64,
    /// Whether the link was added as a recurrent one, or by splitting one.
    pub recurrent: bool,
}

/// The genes of one network.
///
/// Serialises in the format of [`to_json`](Self::to_json); deserialising checks every gene, like
/// [`from_json`](Self::from_json).
#[derive(Debug, PartialEq)]
pub struct Genome {
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    pub(crate) neurons: Vec<Neuron>,
    pub(crate) links: Vec<Link>,
    pub(crate) disabled: Vec<Link>,
}

impl Clone for Genome {
    fn clone(&self) -> Self {
        Self {
            inputs: self.inputs,
            outputs: self.outputs,
            neurons: self.neurons.clone(),
            links: self.links.clone(),
            disabled: self.disabled.clone(),
        }
    }

    /// Reuses this genome's allocations: each generation overwrites the genomes of the one before the last.
    fn clone_from(&mut self, other: &Self) {
        self.inputs = other.inputs;
        self.outputs = other.outputs;
        self.neurons.clone_from(&other.neurons);
        self.links.clone_from(&other.links);
        self.disabled.clone_from(&other.disabled);
    }
}

impl Genome {
    /// The minimal genome: every input and the bias linked to every output, with weights 0 and innovation numbers from 1.
    pub(crate) fn minimal(config: &Config, inputs: usize, outputs: usize) -> Self {
        let mut genome =
            Self { inputs, outputs, neurons: Vec::new(), links: Vec::new(), disabled: Vec::new() };
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

    /// Number of hidden neurons.
    #[must_use]
    pub fn hidden(&self) -> usize {
        self.neurons.len() - self.inputs - 1 - self.outputs
    }

    /// Neuron genes in ascending order of ids: inputs, bias, outputs, hidden.
    #[must_use]
    pub fn neurons(&self) -> &[Neuron] {
        &self.neurons
    }

    /// Enabled link genes in ascending order of innovation numbers: the links of the network.
    #[must_use]
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Disabled link genes in ascending order of innovation numbers. They are inherited and count in the compatibility
    /// distance, but the network does not have them. Empty without [`Config::disable_split_links`].
    #[must_use]
    pub fn disabled(&self) -> &[Link] {
        &self.disabled
    }

    /// Index of neuron `id` in [`neurons`](Self::neurons); `None` if the genome lacks it.
    #[must_use]
    pub fn position(&self, id: u32) -> Option<usize> {
        // Ids of all neurons but the hidden ones are consecutive from 1.
        let fixed = self.inputs + 1 + self.outputs;
        let index = id.wrapping_sub(1) as usize;
        if index < fixed {
            return Some(index);
        }
        self.neurons[fixed..].binary_search_by_key(&id, |neuron| neuron.id).ok().map(|index| index + fixed)
    }

    /// All link genes, enabled and disabled, in ascending order of innovation numbers.
    pub(crate) fn genes(&self) -> Cow<'_, [Link]> {
        if self.disabled.is_empty() {
            return Cow::Borrowed(&self.links);
        }
        let mut genes = [&self.links[..], &self.disabled].concat();
        genes.sort_unstable_by_key(|link| link.innovation);
        Cow::Owned(genes)
    }

    /// Whether the link gene with this innovation number is disabled.
    pub(crate) fn is_disabled(&self, innovation: u32) -> bool {
        self.disabled.binary_search_by_key(&innovation, |link| link.innovation).is_ok()
    }

    /// Whether a link gene, enabled or disabled, leads from neuron `from` to neuron `to`.
    pub(crate) fn has_link(&self, from: u32, to: u32) -> bool {
        self.links.iter().chain(&self.disabled).any(|link| link.from == from && link.to == to)
    }

    /// Id of a dead hidden neuron: one without a link from any neuron but the bias and itself, or without a link to any
    /// other neuron.
    pub(crate) fn find_dead_hidden(&self) -> Option<u32> {
        let bias = self.inputs as u32 + 1;
        let (mut has_input, mut has_output) =
            (vec![false; self.neurons.len()], vec![false; self.neurons.len()]);
        let index = |id| self.position(id).expect("a genome's links join its own neurons");
        for link in self.links.iter().filter(|link| link.from != link.to) {
            has_input[index(link.to)] |= link.from != bias;
            has_output[index(link.from)] = true;
        }
        let mut hidden = self.inputs + 1 + self.outputs..self.neurons.len();
        hidden.find(|&index| !has_input[index] || !has_output[index]).map(|index| self.neurons[index].id)
    }

    /// Whether the network has dead ends, as MultiNEAT defines them: a dead hidden neuron, an output with exactly one
    /// incoming and one outgoing link, or a single output without any link.
    pub(crate) fn has_dead_ends(&self) -> bool {
        let outputs = self.neurons.iter().filter(|neuron| neuron.kind == NeuronKind::Output);
        let is_dead = |output: &Neuron| {
            let incoming = self.links.iter().filter(|link| link.to == output.id).count();
            let outgoing = self.links.iter().filter(|link| link.from == output.id).count();
            (incoming, outgoing) == (1, 1) || (self.outputs == 1 && (incoming, outgoing) == (0, 0))
        };
        outputs.into_iter().any(is_dead) || self.find_dead_hidden().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::genome;

    #[test]
    fn the_minimal_genome_links_inputs_and_bias_to_the_output_with_weight_zero() {
        let minimal = Genome::minimal(&Config::wahby2016(), 2, 1);
        let links: Vec<_> = minimal.links().iter().map(|l| (l.innovation, l.from, l.to, l.weight)).collect();
        assert_eq!(links, [(1, 1, 4, 0.0), (2, 2, 4, 0.0), (3, 3, 4, 0.0)]);
        let kinds: Vec<_> = minimal.neurons().iter().map(|n| n.kind).collect();
        assert_eq!(kinds, [NeuronKind::Input, NeuronKind::Input, NeuronKind::Bias, NeuronKind::Output]);
        assert_eq!(minimal.check().map_err(|e| e.to_string()), Ok(()));
    }

    #[test]
    fn dead_ends_are_found() {
        let is_dead =
            |hidden: &[(u32, f64)], links: &[(u32, u32, f64)]| genome(1, 1, hidden, links).has_dead_ends();
        assert!(!is_dead(&[(4, 0.5)], &[(1, 4, 1.0), (4, 3, 1.0), (2, 3, 1.0)]));
        assert!(is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (4, 3, 1.0)]), "no incoming link");
        assert!(
            is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (2, 4, 1.0), (4, 3, 1.0)]),
            "incoming links only from the bias"
        );
        assert!(
            is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (4, 4, 1.0), (4, 3, 1.0)]),
            "incoming links only from itself"
        );
        assert!(is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (1, 4, 1.0)]), "no outgoing link");
        assert!(
            is_dead(&[(4, 0.5)], &[(1, 3, 1.0), (1, 4, 1.0), (4, 4, 1.0)]),
            "outgoing links only to itself"
        );
        assert!(is_dead(&[], &[(3, 3, 1.0)]), "an output with one incoming and one outgoing link");
        assert!(is_dead(&[], &[]), "a single output without a link");
        assert!(!is_dead(&[], &[(1, 3, 1.0), (3, 3, 1.0)]));
    }
}
