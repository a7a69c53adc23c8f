//! Reproduction: selection of parents in a species, and the making of one child.

use crate::config::Config;
use crate::crossover::{CrossoverKind, crossover};
use crate::genome::Genome;
use crate::innovation::Innovations;
use crate::mutate::{Mutation, mutate};
use crate::random::Rng;
use crate::species::round;

/// Redraws of a second parent that is the same individual as the first. MultiNEAT's number.
const MAX_REDRAWS: usize = 3;

/// The generation from which parents are selected.
pub(crate) struct Parents<'a> {
    pub(crate) config: &'a Config,
    pub(crate) genomes: &'a [Genome],
    /// Ids of the individuals. Copies that filled up the generation have the same id.
    pub(crate) ids: &'a [u64],
    pub(crate) fitness: &'a [f64],
    /// Indices of the members of each species, best first.
    pub(crate) species: &'a [Vec<u32>],
}

impl Parents<'_> {
    /// The elite of a species: its best members, at least one and at most `offspring`. They are copied unchanged.
    pub(crate) fn elite(&self, species: usize, offspring: usize) -> &[u32] {
        let members = &self.species[species];
        let count = round(self.config.elite_fraction * members.len() as f64).max(1);
        &members[..count.min(offspring)]
    }

    /// Overwrites `child` with a new child of a species.
    pub(crate) fn breed(
        &self,
        species: usize,
        innovations: &mut Innovations,
        rng: &mut Rng,
        child: &mut Genome,
    ) {
        let is_mated = self.species[species].len() > 1 && self.mate(species, rng, child);
        if self.species[species].len() == 1 {
            child.clone_from(&self.genomes[self.species[species][0] as usize]);
        }
        if is_mated && !rng.bernoulli(self.config.overall_mutation_rate) {
            return;
        }
        let mutation = mutate(child, self.config, innovations, rng);
        // A weight mutation cannot cause dead ends, and no parent has any.
        if mutation != Some(Mutation::Weights) && (child.links.is_empty() || child.has_dead_ends()) {
            child.clone_from(&self.genomes[self.select(species, rng)]);
        }
    }

    /// Overwrites `child` with a child of two parents or a copy of one; returns whether there were two.
    ///
    /// As in MultiNEAT, a copy counts as a child of two if every draw of the second parent gave the first one.
    fn mate(&self, species: usize, rng: &mut Rng, child: &mut Genome) -> bool {
        let config = self.config;
        let mom = self.select(species, rng);
        if !rng.bernoulli(config.crossover_rate) {
            child.clone_from(&self.genomes[mom]);
            return false;
        }
        let is_interspecies = rng.bernoulli(config.interspecies_crossover_rate);
        let dad_species = if is_interspecies { rng.below(self.species.len()) } else { species };
        let mut dad = self.select(dad_species, rng);
        for _ in 0..MAX_REDRAWS {
            if self.ids[dad] != self.ids[mom] {
                break;
            }
            dad = self.select(dad_species, rng);
        }
        if self.ids[dad] == self.ids[mom] {
            child.clone_from(&self.genomes[mom]);
            return true;
        }
        let kind = CrossoverKind {
            is_averaging: !rng.bernoulli(config.multipoint_crossover_rate),
            keeps_all: is_interspecies,
        };
        let parent = |index: usize| (&self.genomes[index], self.fitness[index]);
        crossover(parent(mom), parent(dad), &kind, rng, child);
        // Within a species the child has the genes of its better parent, which has no dead ends; disabled genes of the
        // other parent may make some.
        let may_die = is_interspecies || !child.disabled.is_empty();
        if may_die && (child.links.is_empty() || child.has_dead_ends()) {
            child.clone_from(&self.genomes[mom]);
        }
        true
    }

    /// Selects a parent from a species, by tournament among its best members or by roulette wheel; returns its index.
    pub(crate) fn select(&self, species: usize, rng: &mut Rng) -> usize {
        let members = &self.species[species];
        let fitness = |rank: usize| self.fitness[members[rank] as usize];
        let rank = match members.len() {
            1 => 0,
            2 => usize::from(rng.coin()),
            n if self.config.roulette_wheel_selection => {
                rng.roulette((0..n).map(fitness)).unwrap_or_else(|| rng.below(n))
            }
            n => {
                let candidates = ((self.config.survival_rate * n as f64 + 1.0) as usize + 1).min(n);
                (0..self.config.tournament_size).fold(rng.below(candidates), |best, _| {
                    let rival = rng.below(candidates);
                    if fitness(rival) > fitness(best) { rival } else { best }
                })
            }
        };
        members[rank] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{genome, rng};

    /// A generation with one species of `count` different genomes, best first.
    struct OneSpecies {
        config: Config,
        genomes: Vec<Genome>,
        ids: Vec<u64>,
        fitness: Vec<f64>,
        species: Vec<Vec<u32>>,
    }

    impl OneSpecies {
        fn new(count: usize, config: Config) -> Self {
            Self {
                genomes: (0..count as u64).map(|n| Genome::random(&config, 2, 1, 1, n)).collect(),
                ids: (0..count as u64).collect(),
                fitness: (0..count).map(|n| (count - n) as f64).collect(),
                species: vec![(0..count as u32).collect()],
                config,
            }
        }

        fn parents(&self) -> Parents<'_> {
            let Self { config, genomes, ids, fitness, species } = self;
            Parents { config, genomes, ids, fitness, species }
        }

        /// Share of the selections that each member wins.
        fn selection_shares(&self) -> Vec<f64> {
            let (mut rng, mut drawn) = (rng(1), vec![0.0; self.genomes.len()]);
            for _ in 0..50_000 {
                drawn[self.parents().select(0, &mut rng)] += 1.0 / 50_000.0;
            }
            drawn
        }

        /// Share of the children that equal a genome of the parents' generation.
        fn share_of_copies(&self) -> f64 {
            let mut innovations = Innovations::new(&self.genomes[0]);
            let mut child = self.genomes[0].clone();
            let mut copies = 0;
            for seed in 0..4000 {
                self.parents().breed(0, &mut innovations, &mut rng(seed), &mut child);
                copies += usize::from(self.genomes.contains(&child));
            }
            copies as f64 / 4000.0
        }
    }

    fn assert_close(found: &[f64], wanted: &[f64]) {
        let is_close = found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 0.01);
        assert!(is_close && found.len() == wanted.len(), "{found:.3?}, wanted {wanted:.3?}");
    }

    #[test]
    fn a_parent_is_the_best_of_five_among_the_best_eight_of_ten() {
        let share_below = |rank: i32| f64::from(8 - rank).max(0.0) / 8.0;
        let wanted: Vec<f64> =
            (0..10).map(|rank| share_below(rank).powi(5) - share_below(rank + 1).powi(5)).collect();
        let found = OneSpecies::new(10, Config::wahby2016()).selection_shares();
        assert_close(&found, &wanted);
        assert_eq!(found[8..], [0.0, 0.0]);
    }

    #[test]
    fn selection_in_small_species() {
        assert_close(&OneSpecies::new(1, Config::wahby2016()).selection_shares(), &[1.0]);
        assert_close(&OneSpecies::new(2, Config::wahby2016()).selection_shares(), &[0.5, 0.5]);
        // Of three, ranks 0 to floor(0.6 x 3 + 1) = 2 are candidates.
        let best_of_five = [1.0 - 2_f64.powi(5) / 243.0, 31.0 / 243.0, 1.0 / 243.0];
        assert_close(&OneSpecies::new(3, Config::wahby2016()).selection_shares(), &best_of_five);
        let uniform = Config { survival_rate: 1.0, tournament_size: 0, ..Config::wahby2016() };
        assert_close(&OneSpecies::new(4, uniform).selection_shares(), &[0.25; 4]);
    }

    #[test]
    fn a_tournament_among_equals_is_uniform() {
        let mut generation = OneSpecies::new(4, Config { survival_rate: 1.0, ..Config::wahby2016() });
        generation.fitness.fill(-3.0);
        assert_close(&generation.selection_shares(), &[0.25; 4]);
    }

    #[test]
    fn roulette_draws_parents_in_proportion_to_fitness() {
        let generation = OneSpecies::new(4, Config::ball_keeper());
        assert_close(&generation.selection_shares(), &[0.4, 0.3, 0.2, 0.1]);
        let without_fitness = OneSpecies { fitness: vec![0.0; 4], ..generation };
        assert_close(&without_fitness.selection_shares(), &[0.25; 4]);
    }

    #[test]
    fn the_elite_is_a_tenth_but_at_least_one_and_at_most_the_offspring() {
        let elite =
            |size, offspring| OneSpecies::new(size, Config::wahby2016()).parents().elite(0, offspring).len();
        assert_eq!([elite(1, 3), elite(14, 9), elite(15, 9), elite(30, 9)], [1, 1, 2, 3]);
        assert_eq!([elite(30, 2), elite(30, 0)], [2, 0]);
    }

    #[test]
    fn a_child_of_a_single_member_is_always_mutated() {
        // 92.8 % are weight mutations. All three weights are kept in 0.2^3 of the mild and 0.1^3 of the severe ones.
        let share = OneSpecies::new(1, Config::wahby2016()).share_of_copies();
        assert!((share - 0.0058).abs() < 0.005, "{share}");
    }

    #[test]
    fn half_of_the_children_of_two_parents_are_not_mutated() {
        let mut generation = OneSpecies::new(6, Config { crossover_rate: 1.0, ..Config::wahby2016() });
        let twin = generation.genomes[0].clone();
        generation.genomes.fill(twin);
        let share = generation.share_of_copies();
        assert!((share - 0.503).abs() < 0.025, "{share}");
    }

    #[test]
    fn a_copy_for_want_of_a_second_parent_counts_as_a_child_of_two() {
        let mut generation = OneSpecies::new(6, Config { crossover_rate: 1.0, ..Config::wahby2016() });
        generation.ids.fill(1);
        // All ids are equal, so no crossover takes place: a child that is not mutated is a copy.
        let share = generation.share_of_copies();
        assert!((share - 0.503).abs() < 0.025, "{share}");
    }

    #[test]
    fn a_second_parent_is_drawn_up_to_four_times() {
        let config = Config { crossover_rate: 1.0, overall_mutation_rate: 0.0, ..Config::wahby2016() };
        // Of two members, four draws all give the first parent in 1 of 16 cases. Otherwise three quarters are multipoint
        // crossovers, and in a quarter of these all three coin flips agree and the child equals a parent.
        let share = OneSpecies::new(2, config).share_of_copies();
        let wanted = 1.0 / 16.0 + 15.0 / 16.0 * 0.75 * 0.25;
        assert!((share - wanted).abs() < 0.02, "{share}, wanted {wanted}");
    }

    #[test]
    fn a_child_with_dead_ends_is_replaced_by_a_copy() {
        // Every child loses one of its two links. Without the link from the input, the loop that remains is a dead end.
        let config = Config {
            crossover_rate: 0.0,
            mutate_weights_prob: 1e-6,
            mutate_rem_link_prob: 1.0,
            ..Config::wahby2016()
        };
        let with_loop = genome(2, 1, &[], &[(2, 4, 1.0), (4, 4, 1.0)]);
        let generation = OneSpecies { genomes: vec![with_loop.clone(); 3], ..OneSpecies::new(3, config) };
        let share = generation.share_of_copies();
        assert!((share - 0.5).abs() < 0.03, "{share}");
    }
}
