//! Species: genomes within the compatibility threshold of a representative. They share fitness and breed among themselves.

use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::genome::Genome;

/// Shared fitness of an individual whose fitness is zero or negative. MultiNEAT's value.
const NON_POSITIVE_FITNESS: f64 = 1e-4;
/// Lower bound of positive fitness, so that no share of it underflows to zero. Chosen: far below any useful fitness.
const MIN_POSITIVE_FITNESS: f64 = 1e-200;
/// Factor on the fitness of a stagnant species. MultiNEAT's value.
const STAGNATION_PENALTY: f64 = 1e-7;

/// A species.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Species {
    pub(crate) id: u32,
    pub(crate) age: u32,
    pub(crate) stagnation: u32,
    #[serde(rename = "best")]
    pub(crate) best_fitness: f64,
    /// Whether this is the best species of the run, which is exempt from the stagnation penalty.
    #[serde(rename = "leads")]
    pub(crate) is_best: bool,
    pub(crate) representative: Genome,
    pub(crate) members: Vec<u32>,
}

impl Species {
    /// A new species with one member, its representative. New species are marked as best: see [`update_ages`].
    fn new(id: u32, representative: Genome, member: u32) -> Self {
        let (age, stagnation, best_fitness, is_best) = (0, 0, 0.0, true);
        Self { id, age, stagnation, best_fitness, is_best, representative, members: vec![member] }
    }

    /// Number of this species; species of a run are numbered from 1.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.id
    }

    /// Generations since the species was founded, or since it last lost its mark as the best one.
    #[must_use]
    pub fn age(&self) -> u32 {
        self.age
    }

    /// Generations since the best fitness last increased.
    #[must_use]
    pub fn stagnation(&self) -> u32 {
        self.stagnation
    }

    /// Best fitness of any member so far, as selection saw it; at least 0.
    #[must_use]
    pub fn best_fitness(&self) -> f64 {
        self.best_fitness
    }

    /// Indices of the members in the population.
    #[must_use]
    pub fn members(&self) -> &[u32] {
        &self.members
    }

    /// Fitness of a member after fitness sharing; also updates the best fitness of the species.
    fn share_fitness(&mut self, fitness: f64, config: &Config) -> f64 {
        let mut f = if fitness <= 0.0 { NON_POSITIVE_FITNESS } else { fitness.max(MIN_POSITIVE_FITNESS) };
        if f > self.best_fitness {
            (self.best_fitness, self.stagnation) = (f, 0);
        }
        if self.age < config.young_age_threshold {
            f *= config.young_age_fitness_boost;
        }
        if self.age > config.old_age_threshold {
            f *= config.old_age_penalty;
        }
        if self.stagnation > config.species_max_stagnation && !self.is_best {
            f *= STAGNATION_PENALTY;
        }
        f / self.members.len() as f64
    }
}

/// Speciation: assigns the genomes of a generation to species, one by one.
pub(crate) struct Speciation<'a> {
    species: &'a mut Vec<Species>,
    /// Sketches of the representatives.
    sketches: Vec<LinkSketch>,
    config: &'a Config,
    threshold: f64,
    next_id: &'a mut u32,
}

impl<'a> Speciation<'a> {
    /// Speciation with a compatibility threshold; new species are numbered from `next_id` and appended to `species`.
    pub(crate) fn new(
        species: &'a mut Vec<Species>,
        config: &'a Config,
        threshold: f64,
        next_id: &'a mut u32,
    ) -> Self {
        let sketches = species.iter().map(|s| LinkSketch::of(&s.representative)).collect();
        Self { species, sketches, config, threshold, next_id }
    }

    /// Assigns genome number `index` of the population to the first compatible species, or to a new one.
    pub(crate) fn assign(&mut self, genome: &Genome, index: u32) {
        let sketch = LinkSketch::of(genome);
        // A lower bound of the distance: the least number of unmatched links, times the smaller of their coefficients.
        let size = if self.config.normalize_genome_size { f64::INFINITY } else { 1.0 };
        let least = self.config.excess_coeff.min(self.config.disjoint_coeff) / size;
        let is_far = |other: &LinkSketch| f64::from(sketch.unmatched(other)) * least > self.threshold;
        let home = self.species.iter_mut().zip(&self.sketches).find(|(s, other)| {
            !is_far(other) && is_compatible(genome, &s.representative, self.config, self.threshold)
        });
        if let Some((home, _)) = home {
            home.members.push(index);
        } else {
            self.species.push(Species::new(*self.next_id, genome.clone(), index));
            self.sketches.push(sketch);
            *self.next_id += 1;
        }
    }
}

/// A sketch of a genome's links: the parity of their number in each of 256 classes of innovation numbers.
///
/// A link that only one of two genomes has changes one parity. The number of unequal parities is therefore a lower bound
/// of the number of unmatched links, and most incompatible genomes are recognised without a look at their genes.
#[derive(Clone, Copy)]
struct LinkSketch([u64; 4]);

impl LinkSketch {
    fn of(genome: &Genome) -> Self {
        let mut parities = [0; 4];
        for link in &*genome.genes() {
            parities[(link.innovation >> 6 & 3) as usize] ^= 1 << (link.innovation & 63);
        }
        Self(parities)
    }

    /// A lower bound of the number of links that only one of the two genomes has.
    fn unmatched(&self, other: &Self) -> u32 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a ^ b).count_ones()).sum()
    }
}

/// Sorts the members of each species by fitness, and the species by their best fitness before this generation.
pub(crate) fn sort_by_fitness(species: &mut [Species], fitness: &[f64]) {
    for s in &mut *species {
        s.members.sort_by(|&a, &b| fitness[b as usize].total_cmp(&fitness[a as usize]));
    }
    species.sort_by(|a, b| b.best_fitness.total_cmp(&a.best_fitness));
}

/// Increments the age and the stagnation of every species, and marks the best species of the run.
///
/// The best species is the first whose best fitness reaches `best_fitness`, that of the run; both exclude this generation.
/// A species that loses the mark has its age and stagnation reset. New species are marked, and of several marked species
/// the last loses the mark. The reset thus mostly hits a new species, whose age is 0 anyway. MultiNEAT does the same.
pub(crate) fn update_ages(species: &mut [Species], best_fitness: f64) {
    let old = species.iter().rposition(|s| s.is_best);
    let new = species.iter().position(|s| s.best_fitness >= best_fitness);
    for (index, s) in species.iter_mut().enumerate() {
        s.age += 1;
        s.stagnation += 1;
        s.is_best = Some(index) == new;
    }
    if let Some(old) = old.filter(|_| old != new) {
        (species[old].age, species[old].stagnation) = (0, 0);
    }
}

/// Allocates offspring to species in proportion to their shared fitness, and updates their best fitness.
///
/// Each number is rounded and the sum is not corrected, as in MultiNEAT, so populations become a few larger than
/// configured. They stay below twice that size. So does the number of species, hence at least one species has offspring.
pub(crate) fn allocate_offspring(species: &mut [Species], fitness: &[f64], config: &Config) -> Vec<usize> {
    let shared: Vec<f64> = species
        .iter_mut()
        .flat_map(|s| {
            let members = s.members.clone();
            members
                .into_iter()
                .map(|member| s.share_fitness(fitness[member as usize], config))
                .collect::<Vec<_>>()
        })
        .collect();
    let per_child = shared.iter().sum::<f64>() / config.population as f64;
    let mut shared = shared.into_iter();
    let sizes = species.iter().map(|s| s.members.len());
    sizes.map(|size| round(shared.by_ref().take(size).map(|f| f / per_child).sum())).collect()
}

/// Rounds a non-negative number to the nearest integer, halves up.
pub(crate) fn round(value: f64) -> usize {
    (value + 0.5) as usize
}

/// The next compatibility threshold, given the present one and the number of species.
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

/// Whether the compatibility distance of two genomes is at most `threshold`.
pub(crate) fn is_compatible(a: &Genome, b: &Genome, config: &Config, threshold: f64) -> bool {
    compatibility_distance(a, b, config, threshold) <= threshold
}

/// Compatibility distance of two genomes: weighted numbers of excess and disjoint links, and the weighted mean difference
/// of matching weights.
///
/// Returns infinity as soon as the disjoint links alone exceed `limit`.
pub(crate) fn compatibility_distance(a: &Genome, b: &Genome, config: &Config, limit: f64) -> f64 {
    let (a, b) = (a.genes(), b.genes());
    let size = if config.normalize_genome_size { a.len().max(b.len()).max(1) as f64 } else { 1.0 };
    let (excess_coeff, disjoint_coeff) = (config.excess_coeff / size, config.disjoint_coeff / size);
    let (mut disjoint, mut matching, mut difference) = (0_u32, 0_u32, 0.0);
    let (mut a, mut b) = (&a[..], &b[..]);
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{genome, mutants};

    /// A genome whose links have these weights.
    fn weighted(weights: &[f64]) -> Genome {
        let links: Vec<_> = (3..).zip(weights).map(|(to, &weight)| (1, to, weight)).collect();
        genome(1, 9, &[], &links)
    }

    /// The compatibility distance without a limit.
    fn full_distance(a: &Genome, b: &Genome, config: &Config) -> f64 {
        compatibility_distance(a, b, config, f64::INFINITY)
    }

    #[test]
    fn the_distance_counts_unmatched_links_and_half_the_mean_weight_difference() {
        let config = Config::wahby2016();
        let mut incomplete = weighted(&[1.0, 2.0, 3.0]);
        incomplete.links.remove(1);
        // Link 2 is disjoint and link 4 excess; links 1 and 3 match with weight differences 0 and 1.
        let other = weighted(&[1.0, 2.0, 4.0, 5.0]);
        assert_eq!(full_distance(&incomplete, &other, &config), 1.0 + 1.0 + 0.5 * 0.5);
        assert_eq!(full_distance(&other, &incomplete, &config), 2.25);
        let coefficients =
            Config { excess_coeff: 10.0, disjoint_coeff: 3.0, weight_diff_coeff: 2.0, ..config };
        assert_eq!(full_distance(&incomplete, &other, &coefficients), 10.0 + 3.0 + 2.0 * 0.5);
    }

    #[test]
    fn genome_size_counts_only_with_normalize_genome_size() {
        let (small, large) = (weighted(&[0.0; 2]), weighted(&[0.0; 8]));
        assert_eq!(full_distance(&small, &large, &Config::wahby2016()), 6.0);
        let normalized = Config { normalize_genome_size: true, ..Config::wahby2016() };
        assert_eq!(full_distance(&small, &large, &normalized), 6.0 / 8.0);
    }

    #[test]
    fn genomes_without_links_are_compatible() {
        assert!(is_compatible(&weighted(&[]), &weighted(&[]), &Config::wahby2016(), 0.2));
    }

    #[test]
    fn a_genome_joins_the_first_compatible_species_or_founds_one() {
        let (config, mut species, mut next_id) = (Config::wahby2016(), Vec::new(), 7);
        let genomes = [weighted(&[0.0]), weighted(&[0.0; 9]), weighted(&[0.0; 3]), weighted(&[0.0; 4])];
        let mut speciation = Speciation::new(&mut species, &config, 5.0, &mut next_id);
        for (index, genome) in (0..).zip(&genomes) {
            speciation.assign(genome, index);
        }
        // The last genome is compatible with both species.
        let found: Vec<_> = species.iter().map(|s| (s.id, s.members.clone())).collect();
        assert_eq!(found, [(7, vec![0, 2, 3]), (8, vec![1])]);
        assert_eq!(next_id, 9);
    }

    /// A species with this best fitness and these members.
    fn species(best_fitness: f64, members: &[u32]) -> Species {
        let members = members.to_vec();
        Species { best_fitness, is_best: false, members, ..Species::new(1, weighted(&[0.0]), 0) }
    }

    #[test]
    fn species_are_sorted_by_their_best_fitness_before_this_generation() {
        let mut all = [species(1.0, &[0, 1]), species(2.0, &[2])];
        sort_by_fitness(&mut all, &[5.0, 9.0, 0.0]);
        assert_eq!(all.iter().map(|s| s.members.clone()).collect::<Vec<_>>(), [vec![2], vec![1, 0]]);
    }

    #[test]
    fn the_best_species_is_marked_and_the_last_marked_one_is_reset() {
        let aged = |best, is_best| Species { age: 5, stagnation: 3, is_best, ..species(best, &[0]) };
        let mut all = [aged(4.0, false), aged(4.0, false), aged(2.0, true), aged(0.0, true)];
        update_ages(&mut all, 4.0);
        assert_eq!(all.each_ref().map(|s| s.is_best), [true, false, false, false]);
        // The last marked species is reset, although another one was marked as well.
        assert_eq!(all.each_ref().map(|s| (s.age, s.stagnation)), [(6, 4), (6, 4), (6, 4), (0, 0)]);
        update_ages(&mut all, 4.0);
        assert_eq!(all.each_ref().map(|s| s.age), [7, 7, 7, 1]);
        update_ages(&mut all, 4.5);
        assert!(all.iter().all(|s| !s.is_best), "the species with the best fitness of the run has died out");
    }

    fn offspring(species: &mut [Species], fitness: &[f64]) -> Vec<usize> {
        allocate_offspring(species, fitness, &Config { population: 10, ..Config::wahby2016() })
    }

    #[test]
    fn offspring_are_proportional_to_the_mean_fitness_of_a_species() {
        let mut all = [species(0.0, &[0]), species(0.0, &[1, 2, 3])];
        assert_eq!(offspring(&mut all, &[3.0, 6.0, 1.0, 2.0]), [5, 5]);
        assert_eq!([all[0].best_fitness, all[1].best_fitness], [3.0, 6.0]);
    }

    #[test]
    fn fitness_that_is_not_positive_is_shared_as_a_ten_thousandth() {
        let mut all = [species(0.0, &[0]), species(0.0, &[1]), species(0.0, &[2])];
        assert_eq!(offspring(&mut all, &[-50.0, 0.0, 1e-4]), [3, 3, 3]);
        assert!(all.iter().all(|s| s.best_fitness == 1e-4 && s.stagnation == 0));
    }

    #[test]
    fn age_and_stagnation_scale_the_shared_fitness() {
        let config = Config {
            population: 100,
            young_age_fitness_boost: 3.0,
            old_age_penalty: 0.5,
            ..Config::wahby2016()
        };
        let one = |age, stagnation, is_best| Species { age, stagnation, is_best, ..species(9.0, &[0]) };
        let share = |mut s: Species| s.share_fitness(1.0, &config);
        assert_eq!(share(one(14, 0, false)), 3.0);
        assert_eq!(share(one(15, 0, false)), 1.0);
        assert_eq!(share(one(30, 0, false)), 1.0);
        assert_eq!(share(one(31, 0, false)), 0.5);
        assert_eq!(share(one(20, 50, false)), 1.0);
        assert_eq!(share(one(20, 51, false)), 1e-7);
        assert_eq!(share(one(20, 51, true)), 1.0);
    }

    #[test]
    fn rounding_can_enlarge_the_population() {
        // Eight equal species share twelve offspring: 1.5 each, rounded to 2.
        let mut all: Vec<_> = (0..8).map(|n| species(0.0, &[n])).collect();
        let offspring =
            allocate_offspring(&mut all, &[1.0; 8], &Config { population: 12, ..Config::wahby2016() });
        assert_eq!(offspring.iter().sum::<usize>(), 16);
    }

    #[test]
    fn the_threshold_adapts_in_steps_and_has_a_minimum() {
        let next = |threshold, species| next_threshold(threshold, species, &Config::wahby2016());
        assert_eq!(next(5.0, 4), 5.0 - 0.3);
        assert_eq!(next(5.0, 5), 5.0);
        assert_eq!(next(5.0, 25), 5.0);
        assert_eq!(next(5.0, 26), 5.0 + 0.3);
        assert_eq!(next(0.4, 1), 0.2);
        let fixed = Config { dynamic_compatibility: false, ..Config::wahby2016() };
        assert_eq!(next_threshold(5.0, 1, &fixed), 5.0);
    }

    proptest! {
        #[test]
        fn neither_the_limit_nor_the_sketch_changes_compatibility(seed in 0_u64..300, a in 0_usize..80, b in 0_usize..80, limit in 0.0..20.0) {
            let kin = mutants(&Config::wahby2016(), seed, 80);
            for normalize_genome_size in [false, true] {
                let config = Config { normalize_genome_size, ..Config::wahby2016() };
                let exact = full_distance(&kin[a], &kin[b], &config);
                prop_assert_eq!(exact <= limit, is_compatible(&kin[a], &kin[b], &config, limit));
                prop_assert_eq!(exact, full_distance(&kin[b], &kin[a], &config));
                let least = f64::from(LinkSketch::of(&kin[a]).unmatched(&LinkSketch::of(&kin[b])));
                prop_assert!(normalize_genome_size || least <= exact, "{least} > {exact}");
            }
        }
    }
}
