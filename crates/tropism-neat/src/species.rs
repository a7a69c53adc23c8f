//! Species: genomes close to a representative, which share their fitness and breed among themselves.

use serde::{Deserialize, Serialize};

use crate::{Config, Genome};

/// Fitness that is zero or negative is shared as this much.
const LEAST_FITNESS: f64 = 1e-4;
/// Positive fitness counts at least this much, so that shares of it never vanish.
const TINIEST_FITNESS: f64 = 1e-200;
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

/// The species of a generation as its children join them, each of them known by the sketch of its representative.
pub(crate) struct Settlement<'a> {
    species: &'a mut Vec<Species>,
    sketches: Vec<Sketch>,
    config: &'a Config,
    threshold: f64,
    next_id: &'a mut u32,
}

impl<'a> Settlement<'a> {
    /// The given species, to be joined by what lies within `threshold`; new ones are numbered from `next_id`.
    pub(crate) fn new(
        species: &'a mut Vec<Species>,
        config: &'a Config,
        threshold: f64,
        next_id: &'a mut u32,
    ) -> Self {
        let sketches = species.iter().map(|s| Sketch::of(&s.representative)).collect();
        Self { species, sketches, config, threshold, next_id }
    }

    /// Puts a genome, number `index` of its population, into the first species that it is compatible with, or founds one.
    pub(crate) fn settle(&mut self, genome: &Genome, index: u32) {
        let sketch = Sketch::of(genome);
        // No genome has fewer than that many unmatched links to the representative, at no more than this distance each.
        let size = if self.config.normalize_genome_size { f64::INFINITY } else { 1.0 };
        let least = self.config.excess_coeff.min(self.config.disjoint_coeff) / size;
        let is_far = |other: &Sketch| f64::from(sketch.unmatched(other)) * least > self.threshold;
        let home = self.species.iter_mut().zip(&self.sketches).find(|(s, other)| {
            !is_far(other) && is_compatible(genome, &s.representative, self.config, self.threshold)
        });
        if let Some((home, _)) = home {
            home.members.push(index);
        } else {
            self.species.push(Species::found(*self.next_id, genome.clone(), index));
            self.sketches.push(sketch);
            *self.next_id += 1;
        }
    }
}

/// Parities of how many links of a genome fall into each of 256 classes of innovation numbers.
///
/// Every link that only one of two genomes has changes one parity, so at least as many links are unmatched as parities
/// differ. That tells most strangers apart without a look at their genes.
#[derive(Clone, Copy)]
struct Sketch([u64; 4]);

impl Sketch {
    fn of(genome: &Genome) -> Self {
        let mut parities = [0; 4];
        for link in &genome.links {
            parities[(link.innovation >> 6 & 3) as usize] ^= 1 << (link.innovation & 63);
        }
        Self(parities)
    }

    /// The least number of links that only one of the two genomes has.
    fn unmatched(&self, other: &Self) -> u32 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a ^ b).count_ones()).sum()
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
/// Each number is rounded by itself, and their sum is not corrected: populations drift up by a few. They stay below twice
/// the aim, and so do species, which is why at least one of them always gets a child.
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
        let mut f = if fitness <= 0.0 { LEAST_FITNESS } else { fitness.max(TINIEST_FITNESS) };
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{genome, grown};

    fn weighted(weights: &[f64]) -> Genome {
        let links: Vec<_> = (3..).zip(weights).map(|(to, &weight)| (1, to, weight)).collect();
        genome(1, 9, &[], &links)
    }

    /// The distance without a limit.
    fn full(a: &Genome, b: &Genome, config: &Config) -> f64 {
        distance(a, b, config, f64::INFINITY)
    }

    #[test]
    fn distance_counts_unmatched_links_and_half_the_mean_weight_difference() {
        let config = Config::paper();
        let mut gap = weighted(&[1.0, 2.0, 3.0]);
        gap.links.remove(1);
        // Link 2 is disjoint, link 4 excess, links 1 and 3 match with differences 0 and 1.
        let other = weighted(&[1.0, 2.0, 4.0, 5.0]);
        assert_eq!(full(&gap, &other, &config), 1.0 + 1.0 + 0.5 * 0.5);
        assert_eq!(full(&other, &gap, &config), 2.25);
        let weighed = Config { excess_coeff: 10.0, disjoint_coeff: 3.0, weight_diff_coeff: 2.0, ..config };
        assert_eq!(full(&gap, &other, &weighed), 10.0 + 3.0 + 2.0 * 0.5);
    }

    #[test]
    fn size_only_counts_when_asked_to() {
        let (small, large) = (weighted(&[0.0; 2]), weighted(&[0.0; 8]));
        assert_eq!(full(&small, &large, &Config::paper()), 6.0);
        let normalized = Config { normalize_genome_size: true, ..Config::paper() };
        assert_eq!(full(&small, &large, &normalized), 6.0 / 8.0);
    }

    #[test]
    fn genomes_without_links_are_of_one_species() {
        assert!(is_compatible(&weighted(&[]), &weighted(&[]), &Config::paper(), 0.2));
    }

    #[test]
    fn the_first_compatible_species_takes_a_genome_and_a_stranger_founds_one() {
        let (config, mut species, mut next_id) = (Config::paper(), Vec::new(), 7);
        let genomes = [weighted(&[0.0]), weighted(&[0.0; 9]), weighted(&[0.0; 3]), weighted(&[0.0; 4])];
        let mut settlement = Settlement::new(&mut species, &config, 5.0, &mut next_id);
        for (index, genome) in (0..).zip(&genomes) {
            settlement.settle(genome, index);
        }
        // The last is within 5 of both.
        let found: Vec<_> = species.iter().map(|s| (s.id, s.members.clone())).collect();
        assert_eq!(found, [(7, vec![0, 2, 3]), (8, vec![1])]);
        assert_eq!(next_id, 9);
    }

    /// A species with these best fitness and members.
    fn species(best: f64, members: &[u32]) -> Species {
        Species { best, leads: false, members: members.to_vec(), ..Species::found(1, weighted(&[0.0]), 0) }
    }

    #[test]
    fn species_are_ranked_by_the_best_before_this_generation() {
        let mut all = [species(1.0, &[0, 1]), species(2.0, &[2])];
        rank(&mut all, &[5.0, 9.0, 0.0]);
        assert_eq!(all.iter().map(|s| s.members.clone()).collect::<Vec<_>>(), [vec![2], vec![1, 0]]);
    }

    #[test]
    fn the_record_holder_takes_the_lead_and_the_last_old_leader_is_young_again() {
        let aged = |best, leads| Species { age: 5, stagnation: 3, leads, ..species(best, &[0]) };
        let mut all = [aged(4.0, false), aged(4.0, false), aged(2.0, true), aged(0.0, true)];
        grow_older(&mut all, 4.0);
        assert_eq!(all.each_ref().map(|s| s.leads), [true, false, false, false]);
        // The last leading one was a newborn: to the true old leader nothing happens.
        assert_eq!(all.each_ref().map(|s| (s.age, s.stagnation)), [(6, 4), (6, 4), (6, 4), (0, 0)]);
        grow_older(&mut all, 4.0);
        assert_eq!(all.each_ref().map(|s| s.age), [7, 7, 7, 1]);
        grow_older(&mut all, 4.5);
        assert!(all.iter().all(|s| !s.leads), "the record holder has died out");
    }

    fn offspring(species: &mut [Species], fitness: &[f64]) -> Vec<usize> {
        allot(species, fitness, &Config { population: 10, ..Config::paper() })
    }

    #[test]
    fn offspring_follow_the_mean_fitness_of_a_species() {
        let mut all = [species(0.0, &[0]), species(0.0, &[1, 2, 3])];
        assert_eq!(offspring(&mut all, &[3.0, 6.0, 1.0, 2.0]), [5, 5]);
        assert_eq!([all[0].best, all[1].best], [3.0, 6.0]);
    }

    #[test]
    fn fitness_that_is_not_positive_counts_a_ten_thousandth() {
        let mut all = [species(0.0, &[0]), species(0.0, &[1]), species(0.0, &[2])];
        assert_eq!(offspring(&mut all, &[-50.0, 0.0, 1e-4]), [3, 3, 3]);
        assert!(all.iter().all(|s| s.best == 1e-4 && s.stagnation == 0));
    }

    #[test]
    fn young_old_and_stagnant_species_are_weighed() {
        let config =
            Config { population: 100, young_age_fitness_boost: 3.0, old_age_penalty: 0.5, ..Config::paper() };
        let one = |age, stagnation, leads| Species { age, stagnation, leads, ..species(9.0, &[0]) };
        let share = |mut s: Species| s.share(1.0, &config);
        assert_eq!(share(one(14, 0, false)), 3.0);
        assert_eq!(share(one(15, 0, false)), 1.0);
        assert_eq!(share(one(30, 0, false)), 1.0);
        assert_eq!(share(one(31, 0, false)), 0.5);
        assert_eq!(share(one(20, 50, false)), 1.0);
        assert_eq!(share(one(20, 51, false)), 1e-7);
        assert_eq!(share(one(20, 51, true)), 1.0);
    }

    #[test]
    fn rounding_lets_the_population_drift_upwards() {
        // Eight equal species for twelve places: 1.5 each, rounded to 2.
        let mut all: Vec<_> = (0..8).map(|n| species(0.0, &[n])).collect();
        let given = allot(&mut all, &[1.0; 8], &Config { population: 12, ..Config::paper() });
        assert_eq!(given.iter().sum::<usize>(), 16);
    }

    #[test]
    fn the_threshold_moves_by_steps_and_has_a_floor() {
        let next = |threshold, species| next_threshold(threshold, species, &Config::paper());
        assert_eq!(next(5.0, 4), 5.0 - 0.3);
        assert_eq!(next(5.0, 5), 5.0);
        assert_eq!(next(5.0, 25), 5.0);
        assert_eq!(next(5.0, 26), 5.0 + 0.3);
        assert_eq!(next(0.4, 1), 0.2);
        let fixed = Config { dynamic_compatibility: false, ..Config::paper() };
        assert_eq!(next_threshold(5.0, 1, &fixed), 5.0);
    }

    proptest! {
        #[test]
        fn a_limit_never_changes_who_is_compatible(seed in 0_u64..300, a in 0_usize..80, b in 0_usize..80, limit in 0.0..20.0) {
            let kin = grown(&Config::paper(), seed, 80);
            for normalize_genome_size in [false, true] {
                let config = Config { normalize_genome_size, ..Config::paper() };
                let exact = full(&kin[a], &kin[b], &config);
                prop_assert_eq!(exact <= limit, is_compatible(&kin[a], &kin[b], &config, limit));
                prop_assert_eq!(exact, full(&kin[b], &kin[a], &config));
                let least = f64::from(Sketch::of(&kin[a]).unmatched(&Sketch::of(&kin[b])));
                prop_assert!(normalize_genome_size || least <= exact, "{least} > {exact}");
            }
        }
    }
}
