//! Innovation numbers: equal structural mutations get equal numbers in the whole run.
//!
//! A database of all links and all splits only ever grows, as in MultiNEAT. Look-ups use hash maps that are never iterated
//! and never saved.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use serde::{Deserialize, Serialize};

use crate::genome::{Genome, Link};
use crate::limits::ID_LIMIT;

/// A link and its innovation number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LinkInnovation {
    pub(crate) innovation: u32,
    pub(crate) from: u32,
    pub(crate) to: u32,
}

/// A split link and the numbers that it received: `from -> to` became `from -> neuron -> to`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SplitInnovation {
    pub(crate) from: u32,
    pub(crate) to: u32,
    /// Id of the new neuron.
    pub(crate) neuron: u32,
    /// Innovation number of `from -> neuron`.
    pub(crate) inward: u32,
    /// Innovation number of `neuron -> to`.
    pub(crate) outward: u32,
}

/// The innovations of a run so far, with hash maps for look-ups.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(into = "Records", from = "Records")]
pub(crate) struct Innovations {
    records: Records,
    /// Innovation numbers of links by `(from, to)`.
    links: HashMap<(u32, u32), u32, BuildHasherDefault<PairHasher>>,
    /// Indices of the recorded splits by `(from, to)` of the split link.
    splits: HashMap<(u32, u32), Vec<u32>, BuildHasherDefault<PairHasher>>,
}

/// The innovations as they are saved: lists without the hash maps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Records {
    pub(crate) next_innovation: u32,
    pub(crate) next_neuron: u32,
    pub(crate) links: Vec<LinkInnovation>,
    pub(crate) splits: Vec<SplitInnovation>,
}

impl Innovations {
    /// The innovations at the start of a run: the links of its minimal genome.
    pub(crate) fn new(minimal: &Genome) -> Self {
        let record =
            |link: &Link| LinkInnovation { innovation: link.innovation, from: link.from, to: link.to };
        Records {
            next_innovation: minimal.links.last().map_or(1, |link| link.innovation + 1),
            next_neuron: minimal.neurons.last().map_or(1, |neuron| neuron.id + 1),
            links: minimal.links.iter().map(record).collect(),
            splits: Vec::new(),
        }
        .into()
    }

    /// Returns the innovation number of the link `from -> to`, and assigns a new one to a new link.
    pub(crate) fn number_link(&mut self, from: u32, to: u32) -> u32 {
        if let Some(&innovation) = self.links.get(&(from, to)) {
            return innovation;
        }
        let innovation = self.records.next_innovation;
        self.records.next_innovation += 1;
        self.records.links.push(LinkInnovation { innovation, from, to });
        self.links.insert((from, to), innovation);
        innovation
    }

    /// Returns the numbers for splitting the link `from -> to` of a genome.
    ///
    /// The first recorded split of this link whose neuron the genome lacks is used again. Otherwise a new split is recorded.
    /// It takes three innovation numbers: for the neuron, the inward link and the outward link.
    pub(crate) fn number_split(&mut self, from: u32, to: u32, genome: &Genome) -> SplitInnovation {
        let known = self.splits.entry((from, to)).or_default();
        let recorded = known.iter().map(|&index| self.records.splits[index as usize]);
        if let Some(split) = recorded.into_iter().find(|split| genome.position(split.neuron).is_none()) {
            return split;
        }
        known.push(self.records.splits.len() as u32);
        let neuron = self.records.next_neuron;
        self.records.next_neuron += 1;
        self.records.next_innovation += 1;
        let (inward, outward) = (self.number_link(from, neuron), self.number_link(neuron, to));
        let split = SplitInnovation { from, to, neuron, inward, outward };
        self.records.splits.push(split);
        split
    }

    /// Whether the id `neuron` has been assigned.
    pub(crate) fn has_neuron(&self, neuron: u32) -> bool {
        neuron < self.records.next_neuron
    }

    /// Whether a link has the innovation number that was assigned to its source and target.
    pub(crate) fn has_link(&self, link: &Link) -> bool {
        self.links.get(&(link.from, link.to)) == Some(&link.innovation)
    }

    /// Checks that the lists are consistent; the error describes the first inconsistency.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Records { next_innovation, next_neuron, links, splits } = &self.records;
        if *next_innovation >= ID_LIMIT || *next_neuron >= ID_LIMIT {
            return Err("an innovation counter is too large".into());
        }
        if let Some(link) = links.iter().find(|link| link.innovation >= *next_innovation) {
            return Err(format!("recorded link {} is above the last number assigned", link.innovation));
        }
        // The hash map has one entry per pair, so a duplicate pair makes it smaller than the list.
        if self.links.len() != links.len() || !links.is_sorted_by(|a, b| a.innovation < b.innovation) {
            return Err("a link is recorded twice".into());
        }
        let is_consistent = |split: &&SplitInnovation| {
            split.neuron < *next_neuron
                && self.links.get(&(split.from, split.neuron)) == Some(&split.inward)
                && self.links.get(&(split.neuron, split.to)) == Some(&split.outward)
        };
        match splits.iter().find(|split| !is_consistent(split)) {
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

/// A fast multiplicative hash of two ids. The keys are assigned by this module, so no attacker chooses them.
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
    use crate::config::Config;
    use crate::genome::{Neuron, NeuronKind};

    #[test]
    fn a_link_keeps_its_number() {
        let minimal = Genome::minimal(&Config::wahby2016(), 2, 1);
        let mut innovations = Innovations::new(&minimal);
        // The links of the minimal genome: from both inputs and the bias, in this order.
        assert_eq!([1, 2, 3].map(|from| innovations.number_link(from, 4)), [1, 2, 3]);
        assert_eq!(innovations.number_link(4, 4), 4);
        assert_eq!(innovations.number_link(4, 4), 4);
    }

    #[test]
    fn a_split_takes_three_numbers_and_is_reused_by_genomes_that_lack_its_neuron() {
        let minimal = Genome::minimal(&Config::wahby2016(), 2, 1);
        let mut innovations = Innovations::new(&minimal);
        let first = innovations.number_split(1, 4, &minimal);
        // The neuron takes number 4.
        assert_eq!((first.neuron, first.inward, first.outward), (5, 5, 6));
        assert_eq!(innovations.number_split(1, 4, &minimal), first);
        let mut grown = minimal.clone();
        grown.neurons.push(Neuron { id: 5, kind: NeuronKind::Hidden, ..minimal.neurons[3] });
        let second = innovations.number_split(1, 4, &grown);
        assert_eq!((second.neuron, second.inward, second.outward), (6, 8, 9));
        assert_eq!(innovations.number_split(1, 4, &minimal), first);
        // The links of a split are numbered like any other link.
        assert_eq!(innovations.number_link(1, 5), first.inward);
    }

    #[test]
    fn restored_innovations_give_the_same_numbers() {
        let minimal = Genome::minimal(&Config::wahby2016(), 2, 1);
        let mut innovations = Innovations::new(&minimal);
        innovations.number_split(1, 4, &minimal);
        innovations.number_link(4, 4);
        let json = serde_json::to_string(&innovations).unwrap();
        let mut again: Innovations = serde_json::from_str(&json).unwrap();
        assert_eq!(again, innovations);
        assert_eq!(again.number_link(4, 4), innovations.number_link(4, 4));
        assert_eq!(again.number_split(1, 4, &minimal), innovations.number_split(1, 4, &minimal));
    }
}
