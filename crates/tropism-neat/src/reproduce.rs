//! Reproduction: how a child is made from the parents of one species.

use crate::crossover::{Mating, crossover};
use crate::innovation::Innovations;
use crate::mutate::{Mutation, mutate};
use crate::random::Dice;
use crate::species::round;
use crate::{Config, Genome};

/// Times that a second parent is drawn again because it is the first one.
const REDRAWS: usize = 3;

/// A generation that is about to have children.
pub(crate) struct Parents<'a> {
    pub(crate) config: &'a Config,
    pub(crate) genomes: &'a [Genome],
    /// Who is who: copies made to fill up a generation share a number.
    pub(crate) ids: &'a [u64],
    pub(crate) fitness: &'a [f64],
    /// Places of the members of each species, best first.
    pub(crate) species: &'a [Vec<u32>],
}

impl Parents<'_> {
    /// The members of a species that are copied unchanged when it has `offspring` children: its best, at least one.
    pub(crate) fn elite(&self, species: usize, offspring: usize) -> &[u32] {
        let members = &self.species[species];
        let count = round(self.config.elite_fraction * members.len() as f64).max(1);
        &members[..count.min(offspring)]
    }

    /// Writes a new child of a species over `child`.
    pub(crate) fn breed(
        &self,
        species: usize,
        innovations: &mut Innovations,
        dice: &mut Dice,
        child: &mut Genome,
    ) {
        let is_mated = self.species[species].len() > 1 && self.mate(species, dice, child);
        if self.species[species].len() == 1 {
            child.clone_from(&self.genomes[self.species[species][0] as usize]);
        }
        if is_mated && !dice.chance(self.config.overall_mutation_rate) {
            return;
        }
        let mutation = mutate(child, self.config, innovations, dice);
        // Weights alone cannot cut anything off, and no parent has a dead end.
        if mutation != Some(Mutation::Weights) && (child.links.is_empty() || child.has_dead_ends()) {
            child.clone_from(&self.genomes[self.select(species, dice)]);
        }
    }

    /// Writes a child of two parents, or a copy of one, over `child`; true if there were two.
    fn mate(&self, species: usize, dice: &mut Dice, child: &mut Genome) -> bool {
        let config = self.config;
        let mom = self.select(species, dice);
        if !dice.chance(config.crossover_rate) {
            child.clone_from(&self.genomes[mom]);
            return false;
        }
        let is_foreign = dice.chance(config.interspecies_crossover_rate);
        let home = if is_foreign { dice.below(self.species.len()) } else { species };
        let mut dad = self.select(home, dice);
        for _ in 0..REDRAWS {
            if self.ids[dad] != self.ids[mom] {
                break;
            }
            dad = self.select(home, dice);
        }
        if self.ids[dad] == self.ids[mom] {
            child.clone_from(&self.genomes[mom]);
            return true;
        }
        let mating =
            Mating { averages: !dice.chance(config.multipoint_crossover_rate), keeps_all: is_foreign };
        let parent = |place: usize| (&self.genomes[place], self.fitness[place]);
        crossover(parent(mom), parent(dad), &mating, dice, child);
        // A child of one species has its fitter parent's links, none of them dead; of two species it has its own.
        if is_foreign && child.has_dead_ends() {
            child.clone_from(&self.genomes[mom]);
        }
        true
    }

    /// NoiseStream a parent from a species: the best of a tournament among its better members, or by roulette.
    pub(crate) fn select(&self, species: usize, dice: &mut Dice) -> usize {
        let members = &self.species[species];
        let fitness = |place: usize| self.fitness[members[place] as usize];
        let place = match members.len() {
            1 => 0,
            2 => usize::from(dice.coin()),
            n if self.config.roulette_wheel_selection => {
                dice.roulette((0..n).map(fitness)).unwrap_or_else(|| dice.below(n))
            }
            n => {
                let candidates = ((self.config.survival_rate * n as f64 + 1.0) as usize + 1).min(n);
                (0..self.config.tournament_size).fold(dice.below(candidates), |best, _| {
                    let rival = dice.below(candidates);
                    if fitness(rival) > fitness(best) { rival } else { best }
                })
            }
        };
        members[place] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{dice, genome};

    /// A species of `count` different genomes, best first, and no other.
    struct Village {
        config: Config,
        genomes: Vec<Genome>,
        ids: Vec<u64>,
        fitness: Vec<f64>,
        species: Vec<Vec<u32>>,
    }

    impl Village {
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

        /// How often each member becomes a parent, as shares.
        fn ranks(&self) -> Vec<f64> {
            let (mut dice, mut drawn) = (dice(1), vec![0.0; self.genomes.len()]);
            for _ in 0..50_000 {
                drawn[self.parents().select(0, &mut dice)] += 1.0 / 50_000.0;
            }
            drawn
        }

        /// The share of children that are like one of their parents' genomes.
        fn share_of_copies(&self) -> f64 {
            let mut innovations = Innovations::new(&self.genomes[0]);
            let mut child = self.genomes[0].clone();
            let mut copies = 0;
            for seed in 0..4000 {
                self.parents().breed(0, &mut innovations, &mut dice(seed), &mut child);
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
    fn a_parent_is_the_best_of_five_among_eight_of_ten() {
        let beyond = |rank: i32| f64::from(8 - rank).max(0.0) / 8.0;
        let wanted: Vec<f64> = (0..10).map(|rank| beyond(rank).powi(5) - beyond(rank + 1).powi(5)).collect();
        let found = Village::new(10, Config::paper()).ranks();
        assert_close(&found, &wanted);
        assert_eq!(found[8..], [0.0, 0.0]);
    }

    #[test]
    fn parents_of_small_species() {
        assert_close(&Village::new(1, Config::paper()).ranks(), &[1.0]);
        assert_close(&Village::new(2, Config::paper()).ranks(), &[0.5, 0.5]);
        // Of three, 0.6 x 3 + 1 gives the places 0 to 2.
        let best_of_five = [1.0 - 2_f64.powi(5) / 243.0, 31.0 / 243.0, 1.0 / 243.0];
        assert_close(&Village::new(3, Config::paper()).ranks(), &best_of_five);
        let everyone = Config { survival_rate: 1.0, tournament_size: 0, ..Config::paper() };
        assert_close(&Village::new(4, everyone).ranks(), &[0.25; 4]);
    }

    #[test]
    fn a_tournament_among_equals_has_no_favourite() {
        let mut village = Village::new(4, Config { survival_rate: 1.0, ..Config::paper() });
        village.fitness.fill(-3.0);
        assert_close(&village.ranks(), &[0.25; 4]);
    }

    #[test]
    fn roulette_draws_parents_in_proportion_to_fitness() {
        let village = Village::new(4, Config::ball_keeper());
        assert_close(&village.ranks(), &[0.4, 0.3, 0.2, 0.1]);
        let worthless = Village { fitness: vec![0.0; 4], ..village };
        assert_close(&worthless.ranks(), &[0.25; 4]);
    }

    #[test]
    fn the_elite_is_a_tenth_and_at_least_one_but_never_more_than_the_children() {
        let elite = |size, children| Village::new(size, Config::paper()).parents().elite(0, children).len();
        assert_eq!([elite(1, 3), elite(14, 9), elite(15, 9), elite(30, 9)], [1, 1, 2, 3]);
        assert_eq!([elite(30, 2), elite(30, 0)], [2, 0]);
    }

    #[test]
    fn an_only_child_is_always_mutated() {
        // A mutation that keeps all three weights leaves a copy: 0.2^3 of the mild and 0.1^3 of the severe ones, of 92.8 %.
        let share = Village::new(1, Config::paper()).share_of_copies();
        assert!((share - 0.0058).abs() < 0.005, "{share}");
    }

    #[test]
    fn half_of_the_mated_children_are_not_mutated() {
        let mut village = Village::new(6, Config { crossover_rate: 1.0, ..Config::paper() });
        let twin = village.genomes[0].clone();
        village.genomes.fill(twin);
        let share = village.share_of_copies();
        assert!((share - 0.503).abs() < 0.025, "{share}");
    }

    #[test]
    fn who_only_meets_itself_counts_as_mated() {
        let mut village = Village::new(6, Config { crossover_rate: 1.0, ..Config::paper() });
        village.ids.fill(1);
        // No crossover takes place: what is not mutated is a copy.
        let share = village.share_of_copies();
        assert!((share - 0.503).abs() < 0.025, "{share}");
    }

    #[test]
    fn a_second_parent_is_sought_four_times() {
        let config = Config { crossover_rate: 1.0, overall_mutation_rate: 0.0, ..Config::paper() };
        // Of two, the other is missed four times in a row in one case of sixteen; the rest differ from both, but for the
        // one in four whose three coins all fall alike, among the three quarters that are not averaged.
        let share = Village::new(2, config).share_of_copies();
        let wanted = 1.0 / 16.0 + 15.0 / 16.0 * 0.75 * 0.25;
        assert!((share - wanted).abs() < 0.02, "{share}, wanted {wanted}");
    }

    #[test]
    fn a_child_with_dead_ends_is_replaced_by_a_copy() {
        // Every child loses one of its two links, y's to the output or the output's to itself. The latter cannot be alone.
        let config = Config {
            crossover_rate: 0.0,
            mutate_weights_prob: 1e-6,
            mutate_rem_link_prob: 1.0,
            ..Config::paper()
        };
        let looped = genome(2, 1, &[], &[(2, 4, 1.0), (4, 4, 1.0)]);
        let village = Village { genomes: vec![looped.clone(); 3], ..Village::new(3, config) };
        let share = village.share_of_copies();
        assert!((share - 0.5).abs() < 0.03, "{share}");
    }
}
