//! A genome: the genes of one network, and the file that keeps them.
//!
//! Neuron genes stand in order of their ids: inputs `1..=n`, the bias `n + 1`, the outputs, then hidden neurons. Link genes
//! stand in order of their innovation numbers. A link that is split is gone: there is no enabled bit.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::random::{Dice, Purpose};
use crate::{Activation, Config};

/// Largest size of a weight, slope or shift that a genome may hold.
pub const WEIGHT_LIMIT: f64 = 1e6;
/// Largest number of inputs or outputs, and of links of the smallest genome.
pub const SIZE_LIMIT: usize = 100_000;
/// Ids and innovation numbers stay below this, so that counting on from them never overflows.
pub(crate) const NUMBER_LIMIT: u32 = 1 << 31;
/// First line of a genome file.
const SCHEMA: &str = "tropism.genome/1";

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
        let mut dice = Dice::new(seed, Purpose::Origin, index);
        for link in &mut genome.links {
            link.weight = dice.signed() * config.initial_weight_range;
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

    /// Whether the genes make a network that can be run and bred.
    ///
    /// # Errors
    ///
    /// The first gene that is wrong, with what was found and what was wanted.
    pub fn check(&self) -> Result<(), GenomeError> {
        check_shape(self.inputs, self.outputs)?;
        self.check_neurons()?;
        self.check_links()
    }

    fn check_neurons(&self) -> Result<(), GenomeError> {
        let fixed = self.inputs + 1 + self.outputs;
        if self.neurons.len() < fixed {
            return Err(GenomeError::TooFewNeurons { found: self.neurons.len(), wanted: fixed });
        }
        let mut last = 0;
        for (index, neuron) in self.neurons.iter().enumerate() {
            let (kind, depths) = match index {
                i if i < self.inputs => (NeuronKind::Input, 0.0..=0.0),
                i if i == self.inputs => (NeuronKind::Bias, 0.0..=0.0),
                i if i < fixed => (NeuronKind::Output, 1.0..=1.0),
                _ => (NeuronKind::Hidden, 0.0..=1.0),
            };
            let id = neuron.id;
            if id <= last || id >= NUMBER_LIMIT || (index < fixed && id as usize != index + 1) {
                return Err(GenomeError::NeuronId { id, last });
            }
            if neuron.kind != kind {
                return Err(GenomeError::NeuronKind { id, found: neuron.kind, wanted: kind });
            }
            if !depths.contains(&neuron.depth) {
                return Err(GenomeError::Depth { id, depth: neuron.depth });
            }
            for value in [neuron.a, neuron.b] {
                if !is_usable(value) {
                    return Err(GenomeError::Parameter { id, value });
                }
            }
            last = id;
        }
        Ok(())
    }

    fn check_links(&self) -> Result<(), GenomeError> {
        let mut last = 0;
        for &Link { innovation, from, to, weight, .. } in &self.links {
            if innovation <= last || innovation >= NUMBER_LIMIT {
                return Err(GenomeError::Innovation { innovation, last });
            }
            last = innovation;
            for id in [from, to] {
                if self.position(id).is_none() {
                    return Err(GenomeError::DanglingLink { innovation, id });
                }
            }
            if to as usize <= self.inputs + 1 {
                return Err(GenomeError::LinkIntoInput { innovation, id: to });
            }
            if !is_usable(weight) {
                return Err(GenomeError::Weight { innovation, weight });
            }
        }
        let mut pairs: Vec<_> = self.links.iter().map(|link| (link.from, link.to)).collect();
        pairs.sort_unstable();
        match pairs.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(GenomeError::DuplicateLink { from: pair[0].0, to: pair[0].1 }),
            None => Ok(()),
        }
    }

    /// The genome as JSON, one gene a line, with `"schema": "tropism.genome/1"`.
    ///
    /// [`from_json`](Self::from_json) gives the same genome back, to the bit.
    #[must_use]
    pub fn to_json(&self) -> String {
        fn lines<T: Serialize>(genes: &[T]) -> String {
            let line =
                |gene| serde_json::to_string(gene).expect("a gene has no maps and no unwritable values");
            genes.iter().map(|gene| format!("\n    {}", line(gene))).collect::<Vec<_>>().join(",")
        }
        format!(
            "{{\n  \"schema\": \"{SCHEMA}\",\n  \"inputs\": {},\n  \"outputs\": {},\n  \"neurons\": [{}\n  ],\n  \"links\": [{}\n  ]\n}}\n",
            self.inputs,
            self.outputs,
            lines(&self.neurons),
            lines(&self.links),
        )
    }

    /// Reads a genome from JSON and checks all of it.
    ///
    /// # Errors
    ///
    /// Broken JSON, another schema, or the first gene that is wrong.
    pub fn from_json(json: &str) -> Result<Self, GenomeError> {
        #[derive(Deserialize)]
        struct Head {
            schema: String,
        }
        // The schema is read first: a file of another one should be called that, not full of unknown fields.
        let head: Head = serde_json::from_str(json)?;
        if head.schema != SCHEMA {
            return Err(GenomeError::Schema { found: head.schema });
        }
        serde_json::from_str::<File>(json)?.try_into()
    }
}

/// Whether a network may have this many inputs and outputs.
pub(crate) fn check_shape(inputs: usize, outputs: usize) -> Result<(), GenomeError> {
    let fits = |n: usize| (1..=SIZE_LIMIT).contains(&n);
    if fits(inputs) && fits(outputs) && (inputs + 1) * outputs <= SIZE_LIMIT {
        Ok(())
    } else {
        Err(GenomeError::Shape { inputs, outputs })
    }
}

/// Whether a weight, slope or shift is a number, and not too large.
fn is_usable(value: f64) -> bool {
    (-WEIGHT_LIMIT..=WEIGHT_LIMIT).contains(&value)
}

/// A genome as it is written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    inputs: usize,
    outputs: usize,
    neurons: Vec<Neuron>,
    links: Vec<Link>,
}

impl From<Genome> for File {
    fn from(Genome { inputs, outputs, neurons, links }: Genome) -> Self {
        Self { schema: SCHEMA.into(), inputs, outputs, neurons, links }
    }
}

impl TryFrom<File> for Genome {
    type Error = GenomeError;

    fn try_from(File { schema, inputs, outputs, neurons, links }: File) -> Result<Self, GenomeError> {
        if schema != SCHEMA {
            return Err(GenomeError::Schema { found: schema });
        }
        let genome = Self { inputs, outputs, neurons, links };
        genome.check()?;
        Ok(genome)
    }
}

/// A genome that cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GenomeError {
    /// Not JSON, or not of a genome's form.
    #[error("not a genome file: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("schema is \"{found}\": wanted \"{SCHEMA}\"")]
    Schema {
        /// What was found.
        found: String,
    },
    /// Too few or too many inputs or outputs.
    #[error(
        "{inputs} inputs and {outputs} outputs: wanted at least 1 of each and at most {SIZE_LIMIT} links between them"
    )]
    Shape {
        /// Number of inputs, without the bias.
        inputs: usize,
        /// Number of outputs.
        outputs: usize,
    },
    /// Fewer neurons than inputs, bias and outputs.
    #[error("{found} neurons: wanted at least {wanted}, for inputs, bias and outputs")]
    TooFewNeurons {
        /// Neurons found.
        found: usize,
        /// Neurons wanted.
        wanted: usize,
    },
    /// A neuron id is doubled, out of order, or not the one that its place asks for.
    #[error(
        "neuron id {id} after {last}: wanted inputs, bias and outputs numbered from 1, then hidden neurons ascending"
    )]
    NeuronId {
        /// Id found.
        id: u32,
        /// Id of the neuron before it; 0 at the start.
        last: u32,
    },
    /// A neuron is not of the kind that its place asks for.
    #[error("neuron {id} is {found:?}: wanted {wanted:?}")]
    NeuronKind {
        /// Id of the neuron.
        id: u32,
        /// Kind found.
        found: NeuronKind,
        /// Kind wanted.
        wanted: NeuronKind,
    },
    /// A neuron's depth is out of range.
    #[error(
        "neuron {id} has depth {depth}: wanted 0 for inputs and bias, 1 for outputs, 0 to 1 for hidden neurons"
    )]
    Depth {
        /// Id of the neuron.
        id: u32,
        /// Depth found.
        depth: f64,
    },
    /// A neuron's slope or shift is not finite or too large.
    #[error("neuron {id} has slope or shift {value}: wanted a size of at most {WEIGHT_LIMIT}")]
    Parameter {
        /// Id of the neuron.
        id: u32,
        /// Value found.
        value: f64,
    },
    /// An innovation number is doubled or out of order.
    #[error("innovation {innovation} after {last}: wanted ascending numbers from 1, each once")]
    Innovation {
        /// Number found.
        innovation: u32,
        /// Number before it; 0 at the start.
        last: u32,
    },
    /// A link leaves or enters a neuron that is not there.
    #[error("link {innovation} joins neuron {id}, which the genome does not have")]
    DanglingLink {
        /// Innovation number of the link.
        innovation: u32,
        /// Id of the neuron.
        id: u32,
    },
    /// A link enters an input or the bias.
    #[error("link {innovation} enters neuron {id}: wanted an output or a hidden neuron")]
    LinkIntoInput {
        /// Innovation number of the link.
        innovation: u32,
        /// Id of the neuron.
        id: u32,
    },
    /// A weight is not finite or too large.
    #[error("link {innovation} has weight {weight}: wanted a size of at most {WEIGHT_LIMIT}")]
    Weight {
        /// Innovation number of the link.
        innovation: u32,
        /// Weight found.
        weight: f64,
    },
    /// Two links join the same neurons in the same direction.
    #[error("two links lead from neuron {from} to neuron {to}: wanted at most one")]
    DuplicateLink {
        /// Id of the neuron that they leave.
        from: u32,
        /// Id of the neuron that they enter.
        to: u32,
    },
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{genome, grown};

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

    fn refusal(change: impl FnOnce(&mut Genome)) -> String {
        let mut genome = genome(2, 1, &[(5, 0.5)], &[(1, 5, 1.0), (5, 4, 1.0), (2, 4, -2.0)]);
        change(&mut genome);
        Genome::from_json(&genome.to_json()).unwrap_err().to_string()
    }

    #[test]
    fn every_wrong_gene_is_refused_by_name() {
        let table = [
            (refusal(|g| g.links[1].from = 9), "link 2 joins neuron 9, which the genome does not have"),
            (refusal(|g| g.links[1].to = 0), "link 2 joins neuron 0, which the genome does not have"),
            (refusal(|g| g.links[1].to = 3), "link 2 enters neuron 3: wanted an output or a hidden neuron"),
            (
                refusal(|g| g.links[1].innovation = 1),
                "innovation 1 after 1: wanted ascending numbers from 1, each once",
            ),
            (
                refusal(|g| g.links[2].from = 5),
                "two links lead from neuron 5 to neuron 4: wanted at most one",
            ),
            (refusal(|g| g.links[0].weight = 1e308), "link 1 has weight 1"),
            (refusal(|g| g.neurons[4].id = 4), "neuron id 4 after 4: wanted inputs"),
            (refusal(|g| g.neurons.swap(0, 1)), "neuron id 2 after 0: wanted inputs"),
            (refusal(|g| g.neurons[4].id = u32::MAX), "neuron id 4294967295 after 4: wanted inputs"),
            (refusal(|g| g.neurons[4].kind = NeuronKind::Input), "neuron 5 is Input: wanted Hidden"),
            (refusal(|g| g.neurons[4].depth = 1.5), "neuron 5 has depth 1.5: wanted 0"),
            (refusal(|g| g.neurons[4].a = -1e7), "neuron 5 has slope or shift -10000000: wanted"),
            (refusal(|g| g.inputs = 0), "0 inputs and 1 outputs: wanted at least 1 of each"),
            (refusal(|g| g.inputs = usize::MAX), "inputs and 1 outputs: wanted at least 1 of each"),
            (refusal(|g| g.outputs = 5), "5 neurons: wanted at least 8, for inputs, bias and outputs"),
        ];
        for (found, wanted) in table {
            assert!(found.contains(wanted), "found: {found}\nwanted: {wanted}");
        }
    }

    #[test]
    fn files_that_are_not_genomes_are_refused() {
        let json = genome(2, 1, &[], &[(1, 4, 1.0)]).to_json();
        let refusal = |json: &str| Genome::from_json(json).unwrap_err().to_string();
        assert!(refusal("").starts_with("not a genome file: EOF"));
        assert!(refusal(&json[..json.len() / 2]).starts_with("not a genome file: EOF"));
        assert!(
            refusal(&json.replace("\"weight\":1.0", "\"weight\":null"))
                .starts_with("not a genome file: invalid type")
        );
        assert!(refusal(&json.replace("\"weight\":1.0", "\"weight\":1e999")).contains("out of range"));
        assert!(refusal(&json.replace("\"weight\"", "\"wait\"")).contains("unknown field `wait`"));
        let other = json.replace("tropism.genome/1", "tropism.genome/9");
        assert_eq!(refusal(&other), "schema is \"tropism.genome/9\": wanted \"tropism.genome/1\"");
    }

    #[test]
    fn the_file_is_readable_and_has_one_gene_a_line() {
        let json = genome(2, 1, &[], &[(1, 4, 1.5)]).to_json();
        assert!(
            json.starts_with("{\n  \"schema\": \"tropism.genome/1\",\n  \"inputs\": 2,\n  \"outputs\": 1,\n"),
            "{json}"
        );
        let link = r#"    {"innovation":1,"from":1,"to":4,"weight":1.5,"recurrent":false}"#;
        assert!(json.lines().any(|line| line == link), "{json}");
    }

    proptest! {
        #[test]
        fn a_genome_comes_back_from_json_to_the_bit(seed in 0_u64..1000) {
            let genome = grown(&Config::paper(), seed, 60).pop().unwrap();
            prop_assert_eq!(&Genome::from_json(&genome.to_json()).unwrap(), &genome);
            let through_serde: Genome = serde_json::from_str(&serde_json::to_string(&genome).unwrap()).unwrap();
            prop_assert_eq!(through_serde, genome);
        }

        #[test]
        fn whatever_is_read_is_sound_or_refused(place in 0_usize..2000, byte in 32_u8..127) {
            let mut json = grown(&Config::paper(), 1, 20).pop().unwrap().to_json().into_bytes();
            let place = place % json.len();
            json[place] = byte;
            if let Ok(genome) = Genome::from_json(&String::from_utf8(json).unwrap()) {
                prop_assert!(genome.check().is_ok());
                crate::Network::new(&genome).activate(&vec![1.0; genome.inputs()]);
            }
        }
    }
}
