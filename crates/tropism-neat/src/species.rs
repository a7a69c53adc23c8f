//! Species: genomes close to a representative, which share their fitness and breed among themselves.

use serde::{Deserialize, Serialize};

use crate::{Config, Genome};

/// Fitness that is zero or negative is shared as this much.
const LEAST_FITNESS: f64 = 1e-4;
/// Factor on the fitness of a species that has not improved for too long.
const STAGNATION_PENALTY: f64 = 1e-7;

/// A species.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Species {
    pub(crate) id: u32,
    pub(crate) age: u32,
    pub(crate) stagnation: u32,
    pub(crate) best: f64,
    /// Whether it holds the record of the run, which shields it from the penalty for stagnation.
    pub(crate) leads: bool,
    pub(crate) representative: Genome,
    pub(crate) members: Vec<u32>,
}

impl Species {
    /// A new species of one member, its representative. It is born leading: see [`grow_older`].
    fn found(id: u32, representative: Genome, member: u32) -> Self {
        Self { id, age: 0, stagnation: 0, best: 0.0, leads: true, representative, members: vec![member] }
    }

    /// Number of this species, counted over the run.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.id
    }

    /// Generations since it was founded.
    #[must_use]
    pub fn age(&self) -> u32 {
        self.age
    }

    /// Generations since it last improved.
    #[must_use]
    pub fn stagnation(&self) -> u32 {
        self.stagnation
    }

    /// Best fitness that a member ever had, at least 0 and as selection saw it.
    #[must_use]
    pub fn best(&self) -> f64 {
        self.best
    }

    /// Places of its members in the population.
    #[must_use]
    pub fn members(&self) -> &[u32] {
        &self.members
    }
}

/// Puts a genome, number `index` of its population, into the first species that it is compatible with, or founds one.
pub(crate) fn settle(
    species: &mut Vec<Species>,
    genome: &Genome,
    index: u32,
    config: &Config,
    threshold: f64,
    next_id: &mut u32,
) {
    match species.iter_mut().find(|s| is_compatible(genome, &s.representative, config, threshold)) {
        Some(home) => home.members.push(index),
        None => {
            species.push(Species::found(*next_id, genome.clone(), index));
            *next_id += 1;
        }
    }
}

/// Sorts the members of each species by fitness and the species by the best they had before this generation.
pub(crate) fn rank(species: &mut [Species], fitness: &[f64]) {
    for s in &mut *species {
        s.members.sort_by(|&a, &b| fitness[b as usize].total_cmp(&fitness[a as usize]));
    }
    species.sort_by(|a, b| b.best.total_cmp(&a.best));
}

/// Ages every species by a generation and passes the lead to the first one that equals the `record` of the run, as it was
/// before this generation.
///
/// A species that loses the lead is young again. As species are born leading and the last leading one in the list counts as
/// the old leader, that is mostly a newborn, to which it does nothing. So it is in MultiNEAT.
pub(crate) fn grow_older(species: &mut [Species], record: f64) {
    let old = species.iter().rposition(|s| s.leads);
    let new = species.iter().position(|s| s.best >= record);
    for (index, s) in species.iter_mut().enumerate() {
        s.age += 1;
        s.stagnation += 1;
        s.leads = Some(index) == new;
    }
    if let Some(old) = old.filter(|_| old != new) {
        (species[old].age, species[old].stagnation) = (0, 0);
    }
}

/// The number of children that each species may have, by its share of the shared fitness. Notes new bests on the way.
///
/// Each number is rounded by itself, and their sum is not corrected: populations drift up by a few.
pub(crate) fn allot(species: &mut [Species], fitness: &[f64], config: &Config) -> Vec<usize> {
    let shared: Vec<f64> = species
        .iter_mut()
        .flat_map(|s| {
            let members = s.members.clone();
            members.into_iter().map(|member| s.share(fitness[member as usize], config)).collect::<Vec<_>>()
        })
        .collect();
    let per_child = shared.iter().sum::<f64>() / config.population as f64;
    let mut shared = shared.into_iter();
    let sizes = species.iter().map(|s| s.members.len());
    sizes.map(|size| round(shared.by_ref().take(size).map(|f| f / per_child).sum())).collect()
}

impl Species {
    /// Shared fitness of a member with this fitness.
    fn share(&mut self, fitness: f64, config: &Config) -> f64 {
        let mut f = if fitness <= 0.0 { LEAST_FITNESS } else { fitness };
        if f > self.best {
            (self.best, self.stagnation) = (f, 0);
        }
        if self.age < config.young_age_threshold {
            f *= config.young_age_fitness_boost;
        }
        if self.age > config.old_age_threshold {
            f *= config.old_age_penalty;
        }
        if self.stagnation > config.species_max_stagnation && !self.leads {
            f *= STAGNATION_PENALTY;
        }
        f / self.members.len() as f64
    }
}

/// The whole number nearest to a number that is not negative, halves up.
pub(crate) fn round(value: f64) -> usize {
    (value + 0.5) as usize
}

/// The threshold after a look at the number of species.
pub(crate) fn next_threshold(threshold: f64, species: usize, config: &Config) -> f64 {
    if !config.dynamic_compatibility {
        threshold
    } else if species > config.max_species {
        threshold + config.compat_threshold_modifier
    } else if species < config.min_species {
        (threshold - config.compat_threshold_modifier).max(config.min_compat_threshold)
    } else {
        threshold
    }
}

/// Whether two genomes lie within `threshold` of each other.
pub(crate) fn is_compatible(a: &Genome, b: &Genome, config: &Config, threshold: f64) -> bool {
    distance(a, b, config, threshold) <= threshold
}

/// The distance between two genomes: unmatched links, and half the mean difference of the matching weights.
///
/// Counting stops once the unmatched links alone exceed `limit`: what comes back then exceeds it as well, and so does the
/// distance.
pub(crate) fn distance(a: &Genome, b: &Genome, config: &Config, limit: f64) -> f64 {
    let size =
        if config.normalize_genome_size { a.links.len().max(b.links.len()).max(1) as f64 } else { 1.0 };
    let (excess_coeff, disjoint_coeff) = (config.excess_coeff / size, config.disjoint_coeff / size);
    let (mut disjoint, mut matching, mut difference) = (0_u32, 0_u32, 0.0);
    let (mut a, mut b) = (&a.links[..], &b.links[..]);
    while let ([first_a, rest_a @ ..], [first_b, rest_b @ ..]) = (a, b) {
        if first_a.innovation == first_b.innovation {
            matching += 1;
            difference += (first_a.weight - first_b.weight).abs();
            (a, b) = (rest_a, rest_b);
            continue;
        }
        disjoint += 1;
        if f64::from(disjoint) * disjoint_coeff > limit {
            return f64::INFINITY;
        }
        if first_a.innovation < first_b.innovation {
            a = rest_a;
        } else {
            b = rest_b;
        }
    }
    let excess = (a.len() + b.len()) as f64;
    let mean_difference = if matching == 0 { 0.0 } else { difference / f64::from(matching) };
    excess_coeff * excess + disjoint_coeff * f64::from(disjoint) + config.weight_diff_coeff * mean_difference
}
