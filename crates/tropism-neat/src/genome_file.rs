//! Genome files: readable JSON in which every gene is checked on reading.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use thiserror::Error;

use crate::genome::{Genome, Link, Neuron, NeuronKind};
use crate::limits::{ID_LIMIT, SIZE_LIMIT, WEIGHT_LIMIT};

/// Schema of genome files.
const SCHEMA: &str = "tropism.genome/1";

impl Genome {
    /// Checks that the genes describe a network that can be run and bred.
    ///
    /// # Errors
    ///
    /// [`GenomeError`] names the first wrong gene.
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
            if id <= last || id >= ID_LIMIT || (index < fixed && id as usize != index + 1) {
                return Err(GenomeError::NeuronId { id, last });
            }
            if neuron.kind != kind {
                return Err(GenomeError::NeuronKind { id, found: neuron.kind, wanted: kind });
            }
            if !depths.contains(&neuron.depth) {
                return Err(GenomeError::Depth { id, depth: neuron.depth });
            }
            for value in [neuron.a, neuron.b] {
                if !is_in_range(value) {
                    return Err(GenomeError::Parameter { id, value });
                }
            }
            last = id;
        }
        Ok(())
    }

    fn check_links(&self) -> Result<(), GenomeError> {
        let is_sorted = |genes: &[Link]| genes.is_sorted_by_key(|link| link.innovation);
        let are_sorted = is_sorted(&self.links) && is_sorted(&self.disabled);
        let genes = self.genes();
        let mut last = 0;
        for &Link { innovation, from, to, weight, .. } in &*genes {
            if innovation <= last || innovation >= ID_LIMIT || !are_sorted {
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
            if !is_in_range(weight) {
                return Err(GenomeError::Weight { innovation, weight });
            }
        }
        let mut pairs: Vec<_> = genes.iter().map(|link| (link.from, link.to)).collect();
        pairs.sort_unstable();
        match pairs.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(GenomeError::DuplicateLink { from: pair[0].0, to: pair[0].1 }),
            None => Ok(()),
        }
    }

    /// Writes the genome as JSON of schema `tropism.genome/1`, one gene per line.
    ///
    /// [`from_json`](Self::from_json) restores it bit for bit.
    #[must_use]
    pub fn to_json(&self) -> String {
        fn lines<T: Serialize>(genes: &[T]) -> String {
            let line =
                |gene| serde_json::to_string(gene).expect("a gene has no maps and no unwritable values");
            genes.iter().map(|gene| format!("\n    {}", line(gene))).collect::<Vec<_>>().join(",")
        }
        let disabled = match &self.disabled[..] {
            [] => String::new(),
            genes => format!(",\n  \"disabled\": [{}\n  ]", lines(genes)),
        };
        format!(
            "{{\n  \"schema\": \"{SCHEMA}\",\n  \"inputs\": {},\n  \"outputs\": {},\n  \"neurons\": [{}\n  ],\n  \"links\": [{}\n  ]{disabled}\n}}\n",
            self.inputs,
            self.outputs,
            lines(&self.neurons),
            lines(&self.links),
        )
    }

    /// Reads a genome from JSON and checks every gene.
    ///
    /// # Errors
    ///
    /// [`GenomeError`]: invalid JSON, another schema, or the first wrong gene.
    pub fn from_json(json: &str) -> Result<Self, GenomeError> {
        #[derive(Deserialize)]
        struct Head {
            schema: String,
        }
        // The schema is read first, so that a file of another schema is reported as such and not for its unknown fields.
        let head: Head = serde_json::from_str(json)?;
        if head.schema != SCHEMA {
            return Err(GenomeError::Schema { found: head.schema });
        }
        serde_json::from_str::<File>(json)?.try_into()
    }
}

/// Checks the numbers of inputs and outputs of a network.
pub(crate) fn check_shape(inputs: usize, outputs: usize) -> Result<(), GenomeError> {
    let fits = |n: usize| (1..=SIZE_LIMIT).contains(&n);
    if fits(inputs) && fits(outputs) && (inputs + 1) * outputs <= SIZE_LIMIT {
        Ok(())
    } else {
        Err(GenomeError::Shape { inputs, outputs })
    }
}

/// Whether a weight, slope or shift is a number within [`WEIGHT_LIMIT`].
fn is_in_range(value: f64) -> bool {
    (-WEIGHT_LIMIT..=WEIGHT_LIMIT).contains(&value)
}

impl Serialize for Genome {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct File<'a> {
            schema: &'static str,
            inputs: usize,
            outputs: usize,
            neurons: &'a [Neuron],
            links: &'a [Link],
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            disabled: &'a [Link],
        }
        let Self { inputs, outputs, neurons, links, disabled } = self;
        File { schema: SCHEMA, inputs: *inputs, outputs: *outputs, neurons, links, disabled }
            .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Genome {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        File::deserialize(deserializer)?.try_into().map_err(D::Error::custom)
    }
}

/// Contents of a genome file, not yet checked.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    inputs: usize,
    outputs: usize,
    neurons: Vec<Neuron>,
    links: Vec<Link>,
    #[serde(default)]
    disabled: Vec<Link>,
}

impl TryFrom<File> for Genome {
    type Error = GenomeError;

    fn try_from(file: File) -> Result<Self, GenomeError> {
        let File { schema, inputs, outputs, neurons, links, disabled } = file;
        if schema != SCHEMA {
            return Err(GenomeError::Schema { found: schema });
        }
        let genome = Self { inputs, outputs, neurons, links, disabled };
        genome.check()?;
        Ok(genome)
    }
}

/// A genome that cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GenomeError {
    /// Invalid JSON, or JSON of another structure.
    #[error("not a genome file: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("found schema \"{found}\", wanted \"{SCHEMA}\"")]
    Schema {
        /// Schema found.
        found: String,
    },
    /// Too few or too many inputs or outputs.
    #[error(
        "found {inputs} inputs and {outputs} outputs, wanted at least 1 of each and at most {SIZE_LIMIT} links between them"
    )]
    Shape {
        /// Number of inputs, without the bias.
        inputs: usize,
        /// Number of outputs.
        outputs: usize,
    },
    /// Fewer neurons than inputs, bias and outputs.
    #[error("found {found} neurons, wanted at least {wanted} for inputs, bias and outputs")]
    TooFewNeurons {
        /// Number of neurons found.
        found: usize,
        /// Number of inputs and outputs, and one for the bias.
        wanted: usize,
    },
    /// A neuron id is duplicate, out of order, or not consecutive among inputs, bias and outputs.
    #[error(
        "found neuron id {id} after {last}, wanted inputs, bias and outputs numbered from 1, then hidden neurons ascending"
    )]
    NeuronId {
        /// Id found.
        id: u32,
        /// Id of the neuron before it; 0 at the start.
        last: u32,
    },
    /// A neuron has the wrong kind for its position.
    #[error("found neuron {id} of kind {found}, wanted {wanted}")]
    NeuronKind {
        /// Id of the neuron.
        id: u32,
        /// Kind found.
        found: NeuronKind,
        /// Kind that its position requires.
        wanted: NeuronKind,
    },
    /// A neuron's depth is out of range.
    #[error(
        "found neuron {id} at depth {depth}, wanted 0 for inputs and bias, 1 for outputs, 0 to 1 for hidden neurons"
    )]
    Depth {
        /// Id of the neuron.
        id: u32,
        /// Depth found.
        depth: f64,
    },
    /// A neuron's slope or shift is not finite or too large.
    #[error("found neuron {id} with slope or shift {value}, wanted a magnitude of at most {WEIGHT_LIMIT}")]
    Parameter {
        /// Id of the neuron.
        id: u32,
        /// Value found.
        value: f64,
    },
    /// The number of weights differs from the number of links.
    #[error("found {found} weights, wanted {wanted}, one for each link")]
    WeightCount {
        /// Number of weights.
        found: usize,
        /// Number of links.
        wanted: usize,
    },
    /// An innovation number is duplicate or out of order.
    #[error("found innovation {innovation} after {last}, wanted ascending numbers from 1, each once")]
    Innovation {
        /// Innovation number found.
        innovation: u32,
        /// Innovation number before it; 0 at the start.
        last: u32,
    },
    /// A link's source or target is not in the genome.
    #[error("found link {innovation} from or to neuron {id}, wanted a neuron of the genome")]
    DanglingLink {
        /// Innovation number of the link.
        innovation: u32,
        /// Id of the missing neuron.
        id: u32,
    },
    /// A link leads to an input or the bias.
    #[error("found link {innovation} to neuron {id}, wanted an output or a hidden neuron as its target")]
    LinkIntoInput {
        /// Innovation number of the link.
        innovation: u32,
        /// Id of its target.
        id: u32,
    },
    /// A weight is not finite or too large.
    #[error("found link {innovation} with weight {weight}, wanted a magnitude of at most {WEIGHT_LIMIT}")]
    Weight {
        /// Innovation number of the link.
        innovation: u32,
        /// Weight found.
        weight: f64,
    },
    /// Two links have the same source and the same target.
    #[error("two links lead from neuron {from} to neuron {to}")]
    DuplicateLink {
        /// Id of the source.
        from: u32,
        /// Id of the target.
        to: u32,
    },
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Config;
    use crate::testing::{genome, mutants};

    fn refusal(change: impl FnOnce(&mut Genome)) -> String {
        let mut genome = genome(2, 1, &[(5, 0.5)], &[(1, 5, 1.0), (5, 4, 1.0), (2, 4, -2.0)]);
        change(&mut genome);
        Genome::from_json(&genome.to_json()).unwrap_err().to_string()
    }

    #[test]
    fn every_wrong_gene_is_refused_by_name() {
        let table = [
            (
                refusal(|g| g.links[1].from = 9),
                "found link 2 from or to neuron 9, wanted a neuron of the genome",
            ),
            (
                refusal(|g| g.links[1].to = 0),
                "found link 2 from or to neuron 0, wanted a neuron of the genome",
            ),
            (refusal(|g| g.links[1].to = 3), "found link 2 to neuron 3, wanted an output or a hidden neuron"),
            (
                refusal(|g| g.links[1].innovation = 1),
                "found innovation 1 after 1, wanted ascending numbers from 1, each once",
            ),
            (refusal(|g| g.links[2].from = 5), "two links lead from neuron 5 to neuron 4"),
            (refusal(|g| g.links[0].weight = 1e308), "found link 1 with weight 1"),
            (refusal(|g| g.neurons[4].id = 4), "found neuron id 4 after 4, wanted inputs"),
            (refusal(|g| g.neurons.swap(0, 1)), "found neuron id 2 after 0, wanted inputs"),
            (refusal(|g| g.neurons[4].id = u32::MAX), "found neuron id 4294967295 after 4, wanted inputs"),
            (
                refusal(|g| g.neurons[4].kind = NeuronKind::Input),
                "found neuron 5 of kind input, wanted hidden",
            ),
            (refusal(|g| g.neurons[4].depth = 1.5), "found neuron 5 at depth 1.5, wanted 0"),
            (refusal(|g| g.neurons[4].a = -1e7), "found neuron 5 with slope or shift -10000000, wanted"),
            (refusal(|g| g.inputs = 0), "found 0 inputs and 1 outputs, wanted at least 1 of each"),
            (refusal(|g| g.inputs = usize::MAX), "inputs and 1 outputs, wanted at least 1 of each"),
            (refusal(|g| g.outputs = 5), "found 5 neurons, wanted at least 8 for inputs, bias and outputs"),
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
        assert_eq!(refusal(&other), "found schema \"tropism.genome/9\", wanted \"tropism.genome/1\"");
    }

    #[test]
    fn a_file_has_one_gene_per_line() {
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
        fn json_restores_a_genome_bit_for_bit(seed in 0_u64..1000) {
            let genome = mutants(&Config::wahby2016(), seed, 60).pop().unwrap();
            prop_assert_eq!(&Genome::from_json(&genome.to_json()).unwrap(), &genome);
            let through_serde: Genome = serde_json::from_str(&serde_json::to_string(&genome).unwrap()).unwrap();
            prop_assert_eq!(through_serde, genome);
        }

        #[test]
        fn a_damaged_file_is_refused_or_a_valid_genome(index in 0_usize..2000, byte in 32_u8..127) {
            let mut json = mutants(&Config::wahby2016(), 1, 20).pop().unwrap().to_json().into_bytes();
            let index = index % json.len();
            json[index] = byte;
            if let Ok(genome) = Genome::from_json(&String::from_utf8(json).unwrap()) {
                prop_assert!(genome.check().is_ok());
                crate::Network::new(&genome).activate(&vec![1.0; genome.inputs()]);
            }
        }
    }
}
