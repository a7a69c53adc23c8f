//! Mutation: exactly one kind at a time, drawn by weight, and drawn again until it succeeds.

use crate::innovation::Innovations;
use crate::random::Dice;
use crate::{Config, Genome, Link, Neuron, NeuronKind};

/// NoiseStream of a kind before a genome that nothing can be done to is left as it is.
const DRAWS: usize = 100;

/// What a mutation does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mutation {
    AddNeuron,
    AddLink,
    RemoveNeuron,
    RemoveLink,
    Weights,
}

impl Mutation {
    const ALL: [Self; 5] =
        [Self::AddNeuron, Self::AddLink, Self::RemoveNeuron, Self::RemoveLink, Self::Weights];

    fn draw(config: &Config, dice: &mut Dice) -> Self {
        let weight = |kind| match kind {
            Self::AddNeuron => config.mutate_add_neuron_prob,
            Self::AddLink => config.mutate_add_link_prob,
            Self::RemoveNeuron => config.mutate_rem_neuron_prob,
            Self::RemoveLink => config.mutate_rem_link_prob,
            Self::Weights => config.mutate_weights_prob,
        };
        Self::ALL[dice.roulette(Self::ALL.into_iter().map(weight)).expect("a checked config mutates weights")]
    }
}

/// Mutates `genome` once; `None` if nothing could be done to it.
pub(crate) fn mutate(
    genome: &mut Genome,
    config: &Config,
    innovations: &mut Innovations,
    dice: &mut Dice,
) -> Option<Mutation> {
    (0..DRAWS).find_map(|_| {
        let kind = Mutation::draw(config, dice);
        let succeeds = match kind {
            Mutation::AddNeuron => add_neuron(genome, config, innovations, dice),
            Mutation::AddLink => add_link(genome, config, innovations, dice),
            Mutation::RemoveNeuron => remove_neuron(genome, config, innovations, dice),
            Mutation::RemoveLink => remove_link(genome, dice),
            Mutation::Weights => change_weights(genome, config, dice),
        };
        succeeds.then_some(kind)
    })
}

/// Perturbs or replaces weights, link by link.
fn change_weights(genome: &mut Genome, config: &Config, dice: &mut Dice) -> bool {
    let severe = dice.chance(config.mutate_weights_severe_prob);
    // The youngest twentieth of a genome with more than 20 links is never left alone.
    let settled = (genome.links.len() as f64 * 0.95) as usize;
    for (index, link) in genome.links.iter_mut().enumerate() {
        // A draw above the first number perturbs, one above the second replaces, any other keeps.
        let (perturb, replace) = if severe {
            (0.3, 0.1)
        } else if index > settled {
            (0.8, 0.0)
        } else {
            let keep = 1.0 - config.weight_mutation_rate;
            (keep, if dice.coin() { keep - 0.1 } else { keep })
        };
        let draw = dice.uniform();
        if draw > perturb {
            link.weight += dice.signed() * config.weight_mutation_max_power;
        } else if draw > replace {
            link.weight = dice.signed() * config.weight_replacement_max_power;
        }
        link.weight = link.weight.clamp(-config.max_weight, config.max_weight);
    }
    !genome.links.is_empty()
}

/// Replaces a link by a new neuron with a link of weight 1 into it and one of the old weight out of it.
fn add_neuron(genome: &mut Genome, config: &Config, innovations: &mut Innovations, dice: &mut Dice) -> bool {
    if genome.links.is_empty() {
        return false;
    }
    let bias = genome.inputs as u32 + 1;
    let may_split = |link: &Link| {
        link.from != bias
            && (config.split_recurrent || !link.recurrent)
            && (config.split_looped_recurrent || link.from != link.to)
    };
    let mut picks = (1..config.link_tries).map(|_| dice.below(genome.links.len()));
    let Some(place) = picks.find(|&place| may_split(&genome.links[place])) else {
        return false;
    };
    let old = genome.links[place];
    let (from, to) = (depth_of(genome, old.from), depth_of(genome, old.to));
    let depth = f64::midpoint(from, to);
    // After some fifty splits in a row there is no number left between the two.
    if config.feed_forward && !(from < depth && depth < to) {
        return false;
    }
    genome.links.remove(place);
    let split = innovations.split(old.from, old.to, genome);
    insert_neuron(
        genome,
        Neuron {
            id: split.neuron,
            kind: NeuronKind::Hidden,
            depth,
            activation: config.hidden_activation,
            a: config.activation_a,
            b: config.activation_b,
        },
    );
    insert_link(genome, Link { innovation: split.inward, to: split.neuron, weight: 1.0, ..old });
    insert_link(genome, Link { innovation: split.outward, from: split.neuron, ..old });
    true
}

/// Links two neurons that were not linked: forward, recurrent, or a neuron to itself.
fn add_link(genome: &mut Genome, config: &Config, innovations: &mut Innovations, dice: &mut Dice) -> bool {
    let recurrent = !config.feed_forward && dice.chance(config.recurrent_prob);
    let looped = recurrent && dice.chance(config.recurrent_loop_prob);
    let everywhere = genome.neurons.len();
    let first_target = genome.inputs + 1;
    let target = |dice: &mut Dice| first_target + dice.below(everywhere - first_target);
    for _ in 1..config.link_tries {
        let (from, to) = match (recurrent, looped) {
            (false, _) => (dice.below(everywhere), target(dice)),
            (true, false) => (target(dice), target(dice)),
            (true, true) => {
                let neuron = target(dice);
                (neuron, neuron)
            }
        };
        let (from, to) = (&genome.neurons[from], &genome.neurons[to]);
        let fits = match (recurrent, looped) {
            (false, _) => {
                let is_forward =
                    if config.feed_forward { from.depth < to.depth } else { from.depth <= to.depth };
                from.kind != NeuronKind::Output && from.id != to.id && is_forward
            }
            (true, false) => from.depth > to.depth,
            (true, true) => true,
        };
        let (from, to) = (from.id, to.id);
        if fits && !genome.has_link(from, to) {
            let weight = dice.signed() * config.weight_replacement_max_power;
            let weight = weight.clamp(-config.max_weight, config.max_weight);
            let innovation = innovations.link(from, to);
            insert_link(genome, Link { innovation, from, to, weight, recurrent });
            return true;
        }
    }
    false
}

/// Removes a link, and with it every hidden neuron that then leads nowhere.
fn remove_link(genome: &mut Genome, dice: &mut Dice) -> bool {
    if genome.links.len() < 2 {
        return false;
    }
    genome.links.remove(dice.below(genome.links.len()));
    while let Some(dead) = genome.dead_hidden() {
        remove_hidden(genome, dead);
    }
    true
}

/// Replaces a hidden neuron that has one link in and one out by one link, the inverse of a split.
fn remove_neuron(
    genome: &mut Genome,
    config: &Config,
    innovations: &mut Innovations,
    dice: &mut Dice,
) -> bool {
    let joint = |neuron: &Neuron| {
        let mut entering = genome.links.iter().filter(|link| link.to == neuron.id);
        let mut leaving = genome.links.iter().filter(|link| link.from == neuron.id);
        match (entering.next(), entering.next(), leaving.next(), leaving.next()) {
            (Some(inward), None, Some(outward), None) if inward.from != neuron.id => {
                Some((*inward, *outward))
            }
            _ => None,
        }
    };
    let hidden = genome.neurons.iter().filter(|neuron| neuron.kind == NeuronKind::Hidden);
    let joints: Vec<_> = hidden.filter_map(joint).collect();
    if joints.is_empty() {
        return false;
    }
    let (inward, outward) = joints[dice.below(joints.len())];
    remove_hidden(genome, inward.to);
    let (from, to) = (inward.from, outward.to);
    if !genome.has_link(from, to) {
        let weight = (inward.weight * outward.weight).clamp(-config.max_weight, config.max_weight);
        let recurrent = inward.recurrent || outward.recurrent;
        insert_link(genome, Link { innovation: innovations.link(from, to), from, to, weight, recurrent });
    }
    true
}

fn remove_hidden(genome: &mut Genome, id: u32) {
    genome.neurons.retain(|neuron| neuron.id != id);
    genome.links.retain(|link| link.from != id && link.to != id);
}

fn depth_of(genome: &Genome, id: u32) -> f64 {
    genome.neurons[genome.position(id).expect("a genome's links join its own neurons")].depth
}

fn insert_neuron(genome: &mut Genome, neuron: Neuron) {
    let place = genome.neurons.partition_point(|other| other.id < neuron.id);
    genome.neurons.insert(place, neuron);
}

fn insert_link(genome: &mut Genome, link: Link) {
    let place = genome.links.partition_point(|other| other.innovation < link.innovation);
    genome.links.insert(place, link);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{dice, genome, grown};

    /// A genome of `links` links of this weight, into as many outputs from one input.
    fn fan(links: usize, weight: f64) -> Genome {
        let links: Vec<_> = (0..links as u32).map(|n| (1, n + 3, weight)).collect();
        genome(1, links.len(), &[], &links)
    }

    /// How a weight fared.
    #[derive(PartialEq)]
    enum Fate {
        Kept,
        Perturbed,
        Replaced,
    }

    /// Shares of fates of the links `which`, of `count` in all, over many weight mutations.
    ///
    /// Weights of 6 perturbed by at most 0.5 stay above the 5 below which all replaced ones lie.
    fn fates(config: &Config, count: usize, which: impl Fn(usize) -> bool) -> [f64; 3] {
        let config = Config { weight_mutation_max_power: 0.5, ..config.clone() };
        let mut dice = dice(1);
        let mut all = Vec::new();
        for _ in 0..600_000 / count {
            let mut genome = fan(count, 6.0);
            assert!(change_weights(&mut genome, &config, &mut dice));
            all.extend(genome.links.iter().enumerate().filter(|&(place, _)| which(place)).map(
                |(_, link)| match link.weight {
                    6.0 => Fate::Kept,
                    w if w > 5.0 => Fate::Perturbed,
                    _ => Fate::Replaced,
                },
            ));
        }
        let share = |fate| all.iter().filter(|&f| *f == fate).count() as f64 / all.len() as f64;
        [share(Fate::Kept), share(Fate::Perturbed), share(Fate::Replaced)]
    }

    fn assert_shares(found: [f64; 3], wanted: [f64; 3]) {
        let is_close = found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 0.01);
        assert!(is_close, "kept, perturbed, replaced: {found:?}, wanted {wanted:?}");
    }

    #[test]
    fn mild_weight_mutation_perturbs_three_quarters_and_replaces_a_twentieth() {
        let mild = Config { mutate_weights_severe_prob: 0.0, ..Config::paper() };
        assert_shares(fates(&mild, 10, |_| true), [0.20, 0.75, 0.05]);
    }

    #[test]
    fn severe_weight_mutation_perturbs_seven_tenths_and_replaces_a_fifth() {
        let severe = Config { mutate_weights_severe_prob: 1.0, ..Config::paper() };
        assert_shares(fates(&severe, 10, |_| true), [0.1, 0.7, 0.2]);
        // The paper's mixture: three quarters mild, one quarter severe.
        assert_shares(fates(&Config::paper(), 10, |_| true), [0.175, 0.7375, 0.0875]);
    }

    #[test]
    fn the_youngest_twentieth_of_more_than_twenty_links_is_mostly_replaced() {
        let mild = Config { mutate_weights_severe_prob: 0.0, ..Config::paper() };
        assert_shares(fates(&mild, 20, |place| place == 19), [0.20, 0.75, 0.05]);
        assert_shares(fates(&mild, 21, |place| place == 20), [0.0, 0.2, 0.8]);
        assert_shares(fates(&mild, 21, |place| place == 19), [0.20, 0.75, 0.05]);
        assert_shares(fates(&mild, 100, |place| place > 95), [0.0, 0.2, 0.8]);
    }

    #[test]
    fn changes_are_triangular_with_their_powers_and_clamped() {
        let change = |config: Config, weight| {
            let mut dice = dice(2);
            let mut changed: Vec<f64> = Vec::new();
            for _ in 0..2000 {
                let mut genome = fan(20, weight);
                change_weights(&mut genome, &config, &mut dice);
                changed.extend(genome.links.iter().map(|link| link.weight).filter(|&w| w != weight));
            }
            changed
        };
        let deviation = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
        let perturbs =
            Config { weight_mutation_rate: 1.0, mutate_weights_severe_prob: 0.0, ..Config::paper() };
        let perturbed = change(perturbs, 0.0);
        assert!((deviation(&perturbed) - 0.408).abs() < 0.01, "{}", deviation(&perturbed));
        // With no power to perturb, all that changes was replaced.
        let replaces = Config { weight_mutation_max_power: 0.0, ..Config::paper() };
        let replaced = change(replaces, 7.0);
        assert!((deviation(&replaced) - 5.0 * 0.408).abs() < 0.05, "{}", deviation(&replaced));
        assert!(replaced.iter().all(|w| w.abs() < 5.0));
        assert!(change(Config::paper(), 7.9).contains(&8.0));
        assert!(change(Config::paper(), 7.9).iter().all(|&w| w <= 8.0));
    }

    #[test]
    fn the_kinds_of_the_paper_come_in_the_shares_of_their_weights() {
        let mut dice = dice(3);
        let drawn: Vec<_> = (0..100_000).map(|_| Mutation::draw(&Config::paper(), &mut dice)).collect();
        let share = |kind| drawn.iter().filter(|&&k| k == kind).count() as f64 / drawn.len() as f64;
        for (kind, wanted) in [
            (Mutation::AddNeuron, 0.041),
            (Mutation::AddLink, 0.031),
            (Mutation::RemoveNeuron, 0.0),
            (Mutation::RemoveLink, 0.0),
            (Mutation::Weights, 0.928),
        ] {
            assert!((share(kind) - wanted).abs() < 0.003, "{kind:?}: {}, wanted {wanted}", share(kind));
        }
    }

    /// Does what `kind` says to `genome`, with the innovations of a run that began with its form.
    fn mutated(genome: &Genome, config: &Config, seed: u64, kind: Mutation) -> Option<Genome> {
        let mut innovations = Innovations::new(genome);
        let (mut genome, mut dice) = (genome.clone(), dice(seed));
        let done = match kind {
            Mutation::AddNeuron => add_neuron(&mut genome, config, &mut innovations, &mut dice),
            Mutation::AddLink => add_link(&mut genome, config, &mut innovations, &mut dice),
            Mutation::RemoveNeuron => remove_neuron(&mut genome, config, &mut innovations, &mut dice),
            Mutation::RemoveLink => remove_link(&mut genome, &mut dice),
            Mutation::Weights => change_weights(&mut genome, config, &mut dice),
        };
        done.then_some(genome)
    }

    #[test]
    fn a_new_neuron_replaces_its_link_and_hands_on_its_weight() {
        let mut before = genome(2, 1, &[(5, 0.5)], &[(1, 5, 3.0), (5, 4, 2.0)]);
        before.links[1].recurrent = true;
        let after = mutated(&before, &Config::paper(), 4, Mutation::AddNeuron).unwrap();
        let gone = before.links.iter().find(|link| !after.has_link(link.from, link.to)).unwrap();
        let find = |from, to| after.links.iter().find(|link| (link.from, link.to) == (from, to)).unwrap();
        let (inward, outward) = (find(gone.from, 6), find(6, gone.to));
        assert_eq!((inward.weight, outward.weight), (1.0, gone.weight));
        assert_eq!((inward.recurrent, outward.recurrent), (gone.recurrent, gone.recurrent));
        let depth = |id| before.neurons[before.position(id).unwrap()].depth;
        assert_eq!(after.neurons[5].depth, (depth(gone.from) + depth(gone.to)) / 2.0);
        assert_eq!(after.links.len(), 3);
    }

    #[test]
    fn links_from_the_bias_and_unwanted_ones_are_never_split() {
        let from_bias = genome(1, 1, &[], &[(2, 3, 1.0)]);
        let mut looped = genome(1, 1, &[], &[(3, 3, 1.0)]);
        looped.links[0].recurrent = true;
        for seed in 0..50 {
            let grow = |genome, config: &Config| mutated(genome, config, seed, Mutation::AddNeuron).is_some();
            assert!(!grow(&from_bias, &Config::paper()));
            assert!(grow(&looped, &Config::paper()));
            assert!(!grow(&looped, &Config { split_recurrent: false, ..Config::paper() }));
            assert!(!grow(&looped, &Config { split_looped_recurrent: false, ..Config::paper() }));
        }
    }

    #[test]
    fn a_seed_genome_can_only_gain_a_loop_on_its_output() {
        let seed = Genome::seed(&Config::paper(), 2, 1);
        let grown: Vec<_> =
            (0..4000).filter_map(|n| mutated(&seed, &Config::paper(), n, Mutation::AddLink)).collect();
        assert!(grown.iter().all(|genome| genome.links[3].from == 4 && genome.links[3].to == 4));
        assert!(grown.iter().all(|genome| genome.links[3].recurrent && genome.links[3].weight.abs() < 5.0));
        let squares = grown.iter().map(|genome| genome.links[3].weight.powi(2)).sum::<f64>();
        let deviation = (squares / grown.len() as f64).sqrt();
        assert!((deviation - 5.0 * 0.408).abs() < 0.3, "{deviation}");
        // Recurrent with probability 0.25, and then looped with 0.25.
        let share = grown.len() as f64 / 4000.0;
        assert!((share - 0.0625).abs() < 0.012, "{share}");
    }

    #[test]
    fn a_quarter_of_the_added_links_lead_back_and_a_quarter_of_those_are_loops() {
        let before = genome(2, 1, &[(5, 0.3), (6, 0.6)], &[(1, 5, 1.0), (5, 6, 1.0), (6, 4, 1.0)]);
        let depth = |id| before.neurons[before.position(id).unwrap()].depth;
        let mut counts = [0.0_f64; 3];
        for seed in 0..4000 {
            let after = mutated(&before, &Config::paper(), seed, Mutation::AddLink).unwrap();
            let link = after.links[3];
            let kind = match depth(link.from).total_cmp(&depth(link.to)) {
                _ if link.from == link.to => 2,
                std::cmp::Ordering::Greater => 1,
                _ => 0,
            };
            assert_eq!(link.recurrent, kind > 0);
            counts[kind] += 1.0 / 4000.0;
        }
        for (found, wanted) in counts.into_iter().zip([0.75, 0.1875, 0.0625]) {
            assert!((found - wanted).abs() < 0.02, "{counts:?}");
        }
    }

    #[test]
    fn link_tries_allow_one_pick_fewer() {
        let seed = fan(1, 1.0);
        let tries = |link_tries| Config { link_tries, ..Config::paper() };
        assert!(mutated(&seed, &tries(1), 1, Mutation::AddNeuron).is_none());
        assert!(mutated(&seed, &tries(2), 1, Mutation::AddNeuron).is_some());
    }

    #[test]
    fn forward_links_may_join_equal_depths_unless_all_is_feed_forward() {
        let pair = genome(1, 1, &[(4, 0.5), (5, 0.5)], &[(1, 4, 1.0), (1, 5, 1.0), (4, 3, 1.0), (5, 3, 1.0)]);
        let makes_cycle = |config: &Config| {
            let grown = (0..500).filter_map(|seed| mutated(&pair, config, seed, Mutation::AddLink));
            grown.into_iter().any(|genome| genome.has_link(4, 5))
        };
        assert!(makes_cycle(&Config { recurrent_prob: 0.0, ..Config::paper() }));
        assert!(!makes_cycle(&Config { feed_forward: true, ..Config::paper() }));
    }

    #[test]
    fn removing_a_neuron_undoes_a_split() {
        let seed = Genome::random(&Config::paper(), 2, 1, 1, 0);
        let mut innovations = Innovations::new(&seed);
        let (mut genome, mut dice) = (seed.clone(), dice(1));
        assert!(add_neuron(&mut genome, &Config::paper(), &mut innovations, &mut dice));
        assert!(remove_neuron(&mut genome, &Config::paper(), &mut innovations, &mut dice));
        assert_eq!(genome, seed);
        assert!(!remove_neuron(&mut genome, &Config::paper(), &mut innovations, &mut dice));
    }

    #[test]
    fn removing_a_link_takes_the_neurons_that_die_of_it() {
        // A chain from x, and a direct link from y: whichever link of the chain goes, all of it does.
        let chain = [(1, 5, 1.0), (5, 6, 1.0), (6, 4, 1.0), (2, 4, 1.0)];
        let before = genome(2, 1, &[(5, 0.3), (6, 0.6)], &chain);
        let after: Vec<_> = (0..100)
            .map(|seed| mutated(&before, &Config::paper(), seed, Mutation::RemoveLink).unwrap())
            .collect();
        assert!(after.iter().all(|genome| [1, 3].contains(&genome.links.len()) && !genome.has_dead_ends()));
        assert!(after.iter().any(|genome| genome.links.len() == 1 && genome.neurons.len() == 4));
        assert!(
            mutated(&fan(1, 1.0), &Config::paper(), 1, Mutation::RemoveLink).is_none(),
            "the last one stays"
        );
    }

    proptest! {
        #[test]
        fn mutated_genomes_stay_sound(seed in 0_u64..10_000, feed_forward: bool, removes: bool) {
            let remove = if removes { 0.2 } else { 0.0 };
            let config = Config {
                feed_forward,
                mutate_rem_link_prob: remove,
                mutate_rem_neuron_prob: remove,
                ..Config::ball_keeper()
            };
            for genome in grown(&config, seed, 80) {
                prop_assert!(genome.check().is_ok(), "{:?}", genome.check());
                prop_assert!(removes || !genome.has_dead_ends());
                prop_assert!(genome.links.iter().all(|link| link.weight.abs() <= config.max_weight));
                let depth = |id| genome.neurons[genome.position(id).unwrap()].depth;
                prop_assert!(!feed_forward || genome.links.iter().all(|link| depth(link.from) < depth(link.to)));
            }
        }
    }
}
