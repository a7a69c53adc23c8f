//! Crossover: a child has the links of its better parent; weights of matching links come from both parents.
//!
//! A gene that is disabled in one or both parents is disabled in the child with probability 0.75 (Stanley and Miikkulainen
//! 2002, section 4.1); else it is as in the parent from which it comes.

use crate::genome::{Genome, Link};
use crate::random::Rng;

/// Probability that a gene which is disabled in either parent is disabled in their child: Stanley and Miikkulainen (2002),
/// section 4.1.
const STAYS_DISABLED: f64 = 0.75;

/// Variant of crossover.
pub(crate) struct CrossoverKind {
    /// Whether a matching link gets the mean of its two weights (averaging crossover) rather than one of them (multipoint).
    pub(crate) is_averaging: bool,
    /// Whether disjoint and excess genes of the other parent are inherited, too: between species they are.
    pub(crate) keeps_all: bool,
}

/// Overwrites `child` with the child of two parents, each given with its fitness.
///
/// The better parent is the fitter one; at equal fitness the one with fewer links; otherwise a coin flip decides.
pub(crate) fn crossover(
    mom: (&Genome, f64),
    dad: (&Genome, f64),
    kind: &CrossoverKind,
    rng: &mut Rng,
    child: &mut Genome,
) {
    let ((mom, mom_fitness), (dad, dad_fitness)) = (mom, dad);
    let mom_is_better = if mom_fitness == dad_fitness {
        let (mom, dad) = (mom.genes().len(), dad.genes().len());
        if mom == dad { rng.coin() } else { mom < dad }
    } else {
        mom_fitness > dad_fitness
    };
    (child.inputs, child.outputs) = (mom.inputs, mom.outputs);
    let inherits = |from: Parent| kind.keeps_all || (from == Parent::Mom) == mom_is_better;

    child.neurons.clear();
    // Neurons with the same id differ only between runs; only then is a coin flipped.
    align(
        &mom.neurons,
        &dad.neurons,
        |neuron| neuron.id,
        |genes| match genes {
            Aligned::Matching(mom, dad) => {
                child.neurons.push(if mom != dad && rng.coin() { *dad } else { *mom })
            }
            Aligned::Unmatched(neuron, parent) => child.neurons.extend(inherits(parent).then_some(*neuron)),
        },
    );
    child.links.clear();
    child.disabled.clear();
    align(
        &mom.genes(),
        &dad.genes(),
        |link| link.innovation,
        |genes| {
            let (link, is_disabled) = match genes {
                Aligned::Matching(of_mom, of_dad) => {
                    let disabled = [mom, dad].map(|parent| parent.is_disabled(of_mom.innovation));
                    let (link, is_disabled) = if kind.is_averaging {
                        let weight = f64::midpoint(of_mom.weight, of_dad.weight);
                        (Link { weight, ..*of_mom }, disabled[0])
                    } else if rng.coin() {
                        (*of_dad, disabled[1])
                    } else {
                        (*of_mom, disabled[0])
                    };
                    let stays_disabled = disabled.contains(&true) && rng.bernoulli(STAYS_DISABLED);
                    (link, is_disabled || stays_disabled)
                }
                Aligned::Unmatched(_, parent) if !inherits(parent) => return,
                Aligned::Unmatched(link, Parent::Mom) => (*link, mom.is_disabled(link.innovation)),
                Aligned::Unmatched(link, Parent::Dad) => (*link, dad.is_disabled(link.innovation)),
            };
            if is_disabled { &mut child.disabled } else { &mut child.links }.push(link);
        },
    );
}

/// The parent that a gene comes from.
#[derive(Clone, Copy, PartialEq)]
enum Parent {
    Mom,
    Dad,
}

/// A gene in the alignment of two parents.
enum Aligned<'a, T> {
    /// Both parents have the gene: the mother's and the father's.
    Matching(&'a T, &'a T),
    /// Only one parent has the gene: it is disjoint or excess.
    Unmatched(&'a T, Parent),
}

/// Visits the aligned genes of two parents in ascending order of `key`, by which both slices are sorted.
fn align<'a, T>(
    moms: &'a [T],
    dads: &'a [T],
    key: impl Fn(&T) -> u32,
    mut visit: impl FnMut(Aligned<'a, T>),
) {
    let (mut m, mut d) = (0, 0);
    loop {
        match (moms.get(m), dads.get(d)) {
            (Some(mom), Some(dad)) if key(mom) == key(dad) => {
                visit(Aligned::Matching(mom, dad));
                (m, d) = (m + 1, d + 1);
            }
            (Some(mom), dad) if dad.is_none_or(|dad| key(mom) < key(dad)) => {
                visit(Aligned::Unmatched(mom, Parent::Mom));
                m += 1;
            }
            (_, Some(dad)) => {
                visit(Aligned::Unmatched(dad, Parent::Dad));
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
    use crate::config::Config;
    use crate::testing::{genome, mutants, rng};

    const MULTIPOINT: CrossoverKind = CrossoverKind { is_averaging: false, keeps_all: false };
    const AVERAGING: CrossoverKind = CrossoverKind { is_averaging: true, keeps_all: false };

    fn child(mom: (&Genome, f64), dad: (&Genome, f64), kind: &CrossoverKind, seed: u64) -> Genome {
        // The child overwrites a genome of another shape, of which nothing may remain.
        let mut child = genome(3, 2, &[], &[(1, 5, 1.0)]);
        crossover(mom, dad, kind, &mut rng(seed), &mut child);
        child
    }

    fn innovations(genome: &Genome) -> Vec<u32> {
        genome.links.iter().map(|link| link.innovation).collect()
    }

    #[test]
    fn matching_links_come_from_either_parent_or_are_averaged() {
        let parent = |weight| genome(1, 1, &[], &[(1, 3, weight), (2, 3, weight)]);
        let (mom, dad) = (parent(1.0), parent(2.0));
        let from_dad = (0..4000)
            .flat_map(|seed| child((&mom, 9.0), (&dad, 1.0), &MULTIPOINT, seed).links)
            .filter(|link| link.weight == 2.0)
            .count();
        assert!(
            (from_dad as f64 / 8000.0 - 0.5).abs() < 0.03,
            "{from_dad} of 8000 links, although the mother is fitter"
        );
        let averaged = child((&mom, 9.0), (&dad, 1.0), &AVERAGING, 1);
        assert!(averaged.links.iter().all(|link| link.weight == 1.5));
    }

    #[test]
    fn at_equal_fitness_the_smaller_parent_is_better_and_then_a_coin_decides() {
        let small = genome(1, 1, &[], &[(1, 3, 1.0)]);
        let large = genome(1, 1, &[], &[(1, 3, 1.0), (2, 3, 1.0)]);
        for seed in 0..20 {
            assert_eq!(child((&small, 1.0), (&large, 1.0), &MULTIPOINT, seed), small);
            assert_eq!(child((&large, -1.0), (&small, -1.0), &MULTIPOINT, seed), small);
        }
        let mut other = genome(1, 1, &[], &[(1, 3, 1.0), (3, 3, 1.0)]);
        other.links[1].innovation = 3;
        let like_other =
            (0..1000).filter(|&seed| child((&large, 1.0), (&other, 1.0), &MULTIPOINT, seed) == other).count();
        assert!((450..550).contains(&like_other), "{like_other} of 1000");
    }

    proptest! {
        #[test]
        fn a_child_of_identical_parents_is_identical(seed in 0_u64..500, is_averaging: bool, keeps_all: bool) {
            let twin = mutants(&Config::wahby2016(), seed, 40).pop().unwrap();
            let kind = CrossoverKind { is_averaging, keeps_all };
            prop_assert_eq!(child((&twin, 1.0), (&twin, 1.0), &kind, seed), twin);
        }

        #[test]
        fn a_child_has_exactly_its_fitter_parents_links(seed in 0_u64..500, fitter in 0_usize..80, other in 0_usize..80) {
            let kin = mutants(&Config::wahby2016(), seed, 80);
            let (fitter, other) = (&kin[fitter], &kin[other]);
            for kind in [MULTIPOINT, AVERAGING] {
                let as_mom = child((fitter, 2.0), (other, 1.0), &kind, seed);
                let as_dad = child((other, -2.0), (fitter, -1.0), &kind, seed);
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
            let kin = mutants(&Config::wahby2016(), seed, 80);
            let kind = CrossoverKind { is_averaging: false, keeps_all: true };
            let child = child((&kin[mom], 2.0), (&kin[dad], 1.0), &kind, seed);
            let mut both = [innovations(&kin[mom]), innovations(&kin[dad])].concat();
            both.sort_unstable();
            both.dedup();
            prop_assert_eq!(innovations(&child), both);
            prop_assert!(child.check().is_ok());
        }
    }
}
