//! A genome as a file: readable JSON, every gene of which is checked when it is read.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::genome::{NUMBER_LIMIT, SIZE_LIMIT, WEIGHT_LIMIT};
use crate::{Genome, Link, Neuron, NeuronKind};

/// What a genome file calls itself.
const SCHEMA: &str = "tropism.genome/1";

impl Genome {
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
pub(crate) struct File {
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
    use crate::Config;
    use crate::testing::{genome, grown};

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
