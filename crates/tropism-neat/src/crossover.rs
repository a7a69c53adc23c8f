//! Crossover: a child has its fitter parent's links, with weights from both where both have the link.

use crate::random::Dice;
use crate::{Genome, Link};

/// How two parents are mated.
pub(crate) struct Mating {
    /// Whether matching links get the mean weight rather than either parent's.
    pub(crate) averages: bool,
    /// Whether the links that only the less fit parent has are inherited too: between species.
    pub(crate) keeps_all: bool,
}

/// Writes the child of `mom` and `dad`, with their fitness beside them, over `child`.
///
/// The better parent is the fitter one, at equal fitness the one with fewer links, else a coin decides.
pub(crate) fn crossover(
    mom: (&Genome, f64),
    dad: (&Genome, f64),
    mating: &Mating,
    dice: &mut Dice,
    child: &mut Genome,
) {
    let ((mom, mom_fitness), (dad, dad_fitness)) = (mom, dad);
    let mom_is_better = if mom_fitness == dad_fitness {
        let (mom, dad) = (mom.links.len(), dad.links.len());
        if mom == dad { dice.coin() } else { mom < dad }
    } else {
        mom_fitness > dad_fitness
    };
    (child.inputs, child.outputs) = (mom.inputs, mom.outputs);
    let inherits = |from: Parent| mating.keeps_all || (from == Parent::Mom) == mom_is_better;

    child.neurons.clear();
    // Neurons of one id differ only if they come from different runs; only then does the coin matter.
    pair_up(
        &mom.neurons,
        &dad.neurons,
        |neuron| neuron.id,
        |pair| match pair {
            Pair::Both(mom, dad) => child.neurons.push(if mom != dad && dice.coin() { *dad } else { *mom }),
            Pair::One(neuron, parent) => child.neurons.extend(inherits(parent).then_some(*neuron)),
        },
    );
    child.links.clear();
    pair_up(
        &mom.links,
        &dad.links,
        |link| link.innovation,
        |pair| match pair {
            Pair::Both(mom, dad) if mating.averages => {
                child.links.push(Link { weight: f64::midpoint(mom.weight, dad.weight), ..*mom });
            }
            Pair::Both(mom, dad) => child.links.push(if dice.coin() { *dad } else { *mom }),
            Pair::One(link, parent) => child.links.extend(inherits(parent).then_some(*link)),
        },
    );
}

#[derive(Clone, Copy, PartialEq)]
enum Parent {
    Mom,
    Dad,
}

/// A gene that both parents have, or only one.
enum Pair<'a, T> {
    Both(&'a T, &'a T),
    One(&'a T, Parent),
}

/// Visits the genes of two parents, each sorted by `key`, in order of their keys.
fn pair_up<'a, T>(moms: &'a [T], dads: &'a [T], key: impl Fn(&T) -> u32, mut visit: impl FnMut(Pair<'a, T>)) {
    let (mut m, mut d) = (0, 0);
    loop {
        match (moms.get(m), dads.get(d)) {
            (Some(mom), Some(dad)) if key(mom) == key(dad) => {
                visit(Pair::Both(mom, dad));
                (m, d) = (m + 1, d + 1);
            }
            (Some(mom), dad) if dad.is_none_or(|dad| key(mom) < key(dad)) => {
                visit(Pair::One(mom, Parent::Mom));
                m += 1;
            }
            (_, Some(dad)) => {
                visit(Pair::One(dad, Parent::Dad));
                d += 1;
            }
            (_, None) => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Config;
    use crate::testing::{dice, genome, grown};

    const MULTIPOINT: Mating = Mating { averages: false, keeps_all: false };
    const AVERAGING: Mating = Mating { averages: true, keeps_all: false };

    fn child(mom: (&Genome, f64), dad: (&Genome, f64), mating: &Mating, seed: u64) -> Genome {
        // Over something quite different, of which nothing may be left.
        let mut child = genome(3, 2, &[], &[(1, 5, 1.0)]);
        crossover(mom, dad, mating, &mut dice(seed), &mut child);
        child
    }

    fn innovations(genome: &Genome) -> Vec<u32> {
        genome.links.iter().map(|link| link.innovation).collect()
    }

    #[test]
    fn matching_links_come_from_either_parent_or_are_averaged() {
        let parent = |weight| genome(1, 1, &[], &[(1, 3, weight), (2, 3, weight)]);
        let (mom, dad) = (parent(1.0), parent(2.0));
        let of_dad = (0..4000)
            .flat_map(|seed| child((&mom, 9.0), (&dad, 1.0), &MULTIPOINT, seed).links)
            .filter(|link| link.weight == 2.0)
            .count();
        assert!((of_dad as f64 / 8000.0 - 0.5).abs() < 0.03, "{of_dad} of 8000, whatever the fitness");
        let averaged = child((&mom, 9.0), (&dad, 1.0), &AVERAGING, 1);
        assert!(averaged.links.iter().all(|link| link.weight == 1.5));
    }

    #[test]
    fn at_equal_fitness_fewer_links_win_and_then_a_coin() {
        let small = genome(1, 1, &[], &[(1, 3, 1.0)]);
        let large = genome(1, 1, &[], &[(1, 3, 1.0), (2, 3, 1.0)]);
        for seed in 0..20 {
            assert_eq!(child((&small, 1.0), (&large, 1.0), &MULTIPOINT, seed), small);
            assert_eq!(child((&large, -1.0), (&small, -1.0), &MULTIPOINT, seed), small);
        }
        let mut other = genome(1, 1, &[], &[(1, 3, 1.0), (3, 3, 1.0)]);
        other.links[1].innovation = 3;
        let of_other =
            (0..1000).filter(|&seed| child((&large, 1.0), (&other, 1.0), &MULTIPOINT, seed) == other).count();
        assert!((450..550).contains(&of_other), "{of_other} of 1000");
    }

    proptest! {
        #[test]
        fn a_child_of_twins_is_a_twin(seed in 0_u64..500, averages: bool, keeps_all: bool) {
            let twin = grown(&Config::paper(), seed, 40).pop().unwrap();
            let mating = Mating { averages, keeps_all };
            prop_assert_eq!(child((&twin, 1.0), (&twin, 1.0), &mating, seed), twin);
        }

        #[test]
        fn a_child_has_exactly_its_fitter_parents_links(seed in 0_u64..500, fitter in 0_usize..80, other in 0_usize..80) {
            let kin = grown(&Config::paper(), seed, 80);
            let (fitter, other) = (&kin[fitter], &kin[other]);
            for mating in [MULTIPOINT, AVERAGING] {
                let as_mom = child((fitter, 2.0), (other, 1.0), &mating, seed);
                let as_dad = child((other, -2.0), (fitter, -1.0), &mating, seed);
                for child in [as_mom, as_dad] {
                    prop_assert!(child.check().is_ok());
                    prop_assert!(!child.has_dead_ends());
                    prop_assert_eq!(innovations(&child), innovations(fitter));
                    prop_assert_eq!(&child.neurons, &fitter.neurons);
                }
            }
        }

        #[test]
        fn between_species_a_child_has_the_links_of_both(seed in 0_u64..500, mom in 0_usize..80, dad in 0_usize..80) {
            let kin = grown(&Config::paper(), seed, 80);
            let mating = Mating { averages: false, keeps_all: true };
            let child = child((&kin[mom], 2.0), (&kin[dad], 1.0), &mating, seed);
            let mut both = [innovations(&kin[mom]), innovations(&kin[dad])].concat();
            both.sort_unstable();
            both.dedup();
            prop_assert_eq!(innovations(&child), both);
            prop_assert!(child.check().is_ok());
        }
    }
}
