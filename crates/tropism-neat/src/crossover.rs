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
