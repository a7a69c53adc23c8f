//! The record of every link and every split that a run has seen, so that the same novelty gets the same number.
//!
//! Append-only, over the whole run. Look-ups go through hashed indices that are never iterated and are not saved.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use serde::{Deserialize, Serialize};

use crate::genome::NUMBER_LIMIT;
use crate::{Genome, Link};

/// A link that has been numbered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkRecord {
    pub(crate) innovation: u32,
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// A split that has been numbered: the link `from -> to` became `from -> neuron -> to`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Split {
    pub(crate) from: u32,
    pub(crate) to: u32,
    /// Id of the new neuron.
    pub(crate) neuron: u32,
    /// Innovation number of `from -> neuron`.
    pub(crate) inward: u32,
    /// Innovation number of `neuron -> to`.
    pub(crate) outward: u32,
}

/// Every innovation of a run so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(into = "Records", from = "Records")]
pub(crate) struct Innovations {
    records: Records,
    links: HashMap<(u32, u32), u32, BuildHasherDefault<PairHasher>>,
    splits: HashMap<(u32, u32), Vec<u32>, BuildHasherDefault<PairHasher>>,
}

/// What is saved of the innovations: the lists, from which the indices are made again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Records {
    pub(crate) next_innovation: u32,
    pub(crate) next_neuron: u32,
    pub(crate) links: Vec<LinkRecord>,
    pub(crate) splits: Vec<Split>,
}

impl Innovations {
    /// The record at the start of a run, with the links of its seed genome.
    pub(crate) fn new(seed: &Genome) -> Self {
        let record = |link: &Link| LinkRecord { innovation: link.innovation, from: link.from, to: link.to };
        Records {
            next_innovation: seed.links.last().map_or(1, |link| link.innovation + 1),
            next_neuron: seed.neurons.last().map_or(1, |neuron| neuron.id + 1),
            links: seed.links.iter().map(record).collect(),
            splits: Vec::new(),
        }
        .into()
    }

    /// The innovation number of the link `from -> to`, a fresh one if it was never seen.
    pub(crate) fn link(&mut self, from: u32, to: u32) -> u32 {
        if let Some(&innovation) = self.links.get(&(from, to)) {
            return innovation;
        }
        let innovation = self.records.next_innovation;
        self.records.next_innovation += 1;
        self.records.links.push(LinkRecord { innovation, from, to });
        self.links.insert((from, to), innovation);
        innovation
    }

    /// The split of the link `from -> to` for a genome: the first recorded one whose neuron the genome lacks, else a fresh
    /// one, which takes three numbers: the neuron's, the inward and the outward link's.
    pub(crate) fn split(&mut self, from: u32, to: u32, genome: &Genome) -> Split {
        let known = self.splits.entry((from, to)).or_default();
        let recorded = known.iter().map(|&index| self.records.splits[index as usize]);
        if let Some(split) = recorded.into_iter().find(|split| genome.position(split.neuron).is_none()) {
            return split;
        }
        known.push(self.records.splits.len() as u32);
        let neuron = self.records.next_neuron;
        self.records.next_neuron += 1;
        self.records.next_innovation += 1;
        let (inward, outward) = (self.link(from, neuron), self.link(neuron, to));
        let split = Split { from, to, neuron, inward, outward };
        self.records.splits.push(split);
        split
    }
}

impl Innovations {
    /// Whether a neuron of this id can be in a genome of the run.
    pub(crate) fn has_numbered(&self, neuron: u32) -> bool {
        neuron < self.records.next_neuron
    }

    /// Whether a link bears the number that the run gave it.
    pub(crate) fn knows_link(&self, link: &Link) -> bool {
        self.links.get(&(link.from, link.to)) == Some(&link.innovation)
    }

    /// Whether the lists go together; the first contradiction if they do not.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Records { next_innovation, next_neuron, links, splits } = &self.records;
        if *next_innovation >= NUMBER_LIMIT || *next_neuron >= NUMBER_LIMIT {
            return Err("a counter of innovations is too large".into());
        }
        if let Some(link) = links.iter().find(|link| link.innovation >= *next_innovation) {
            return Err(format!("recorded link {} is above the last number given", link.innovation));
        }
        // An index holds one entry for each pair, so a doubled pair makes it shorter than the list.
        if self.links.len() != links.len() || !links.is_sorted_by(|a, b| a.innovation < b.innovation) {
            return Err("a link is recorded twice".into());
        }
        let is_sound = |split: &&Split| {
            split.neuron < *next_neuron
                && self.links.get(&(split.from, split.neuron)) == Some(&split.inward)
                && self.links.get(&(split.neuron, split.to)) == Some(&split.outward)
        };
        match splits.iter().find(|split| !is_sound(split)) {
            Some(split) => {
                Err(format!("the split that made neuron {} does not match its links", split.neuron))
            }
            None => Ok(()),
        }
    }
}

impl PartialEq for Innovations {
    fn eq(&self, other: &Self) -> bool {
        self.records == other.records
    }
}

impl From<Records> for Innovations {
    fn from(records: Records) -> Self {
        let links = records.links.iter().map(|link| ((link.from, link.to), link.innovation)).collect();
        let mut splits: HashMap<_, Vec<u32>, _> = HashMap::default();
        for (index, split) in records.splits.iter().enumerate() {
            splits.entry((split.from, split.to)).or_default().push(index as u32);
        }
        Self { records, links, splits }
    }
}

impl From<Innovations> for Records {
    fn from(innovations: Innovations) -> Self {
        innovations.records
    }
}

/// Multiplies and folds: the keys are small ids of our own making, nobody's attack.
#[derive(Clone, Default)]
pub(crate) struct PairHasher(u64);

impl Hasher for PairHasher {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u32(u32::from(byte));
        }
    }

    fn write_u32(&mut self, word: u32) {
        self.0 = (self.0.rotate_left(32) ^ u64::from(word)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }

    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    #[test]
    fn the_same_link_keeps_its_number() {
        let seed = Genome::seed(&Config::paper(), 2, 1);
        let mut innovations = Innovations::new(&seed);
        // The seed's own: x, y and bias, in this order.
        assert_eq!([1, 2, 3].map(|from| innovations.link(from, 4)), [1, 2, 3]);
        assert_eq!(innovations.link(4, 4), 4);
        assert_eq!(innovations.link(4, 4), 4);
    }

    #[test]
    fn a_split_takes_three_numbers_and_is_reused_by_genomes_that_lack_its_neuron() {
        let seed = Genome::seed(&Config::paper(), 2, 1);
        let mut innovations = Innovations::new(&seed);
        let first = innovations.split(1, 4, &seed);
        // Number 4 is the neuron's own.
        assert_eq!((first.neuron, first.inward, first.outward), (5, 5, 6));
        assert_eq!(innovations.split(1, 4, &seed), first);
        let mut grown = seed.clone();
        grown.neurons.push(crate::Neuron { id: 5, kind: crate::NeuronKind::Hidden, ..seed.neurons[3] });
        let second = innovations.split(1, 4, &grown);
        assert_eq!((second.neuron, second.inward, second.outward), (6, 8, 9));
        assert_eq!(innovations.split(1, 4, &seed), first);
        // The halves of a split are links like any other.
        assert_eq!(innovations.link(1, 5), first.inward);
    }

    #[test]
    fn saved_and_read_again_it_answers_the_same() {
        let seed = Genome::seed(&Config::paper(), 2, 1);
        let mut innovations = Innovations::new(&seed);
        innovations.split(1, 4, &seed);
        innovations.link(4, 4);
        let json = serde_json::to_string(&innovations).unwrap();
        let mut again: Innovations = serde_json::from_str(&json).unwrap();
        assert_eq!(again, innovations);
        assert_eq!(again.link(4, 4), innovations.link(4, 4));
        assert_eq!(again.split(1, 4, &seed), innovations.split(1, 4, &seed));
    }
}
