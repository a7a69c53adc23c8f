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
        true
    }

    /// Draws a parent from a species: the best of a tournament among its better members, or by roulette.
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
