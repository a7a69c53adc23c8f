//! Mutation: one kind at a time, drawn in proportion to the configured weights and redrawn until it succeeds.

use crate::config::Config;
use crate::genome::{Genome, Link, Neuron, NeuronKind};
use crate::innovation::Innovations;
use crate::random::Rng;

/// Attempts at a mutation before a genome is left unchanged. MultiNEAT has no limit; 100 was chosen without tuning.
const MAX_ATTEMPTS: usize = 100;

/// Kinds of mutation.
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

    /// Draws a kind in proportion to the weights in `config`.
    fn draw(config: &Config, rng: &mut Rng) -> Self {
        let weight = |kind| match kind {
            Self::AddNeuron => config.mutate_add_neuron_prob,
            Self::AddLink => config.mutate_add_link_prob,
            Self::RemoveNeuron => config.mutate_rem_neuron_prob,
            Self::RemoveLink => config.mutate_rem_link_prob,
            Self::Weights => config.mutate_weights_prob,
        };
        Self::ALL[rng
            .roulette(Self::ALL.into_iter().map(weight))
            .expect("mutate_weights_prob is positive in a checked config")]
    }
}

/// Mutates `genome` once and returns the kind of the mutation; `None` if every attempt failed.
pub(crate) fn mutate(
    genome: &mut Genome,
    config: &Config,
    innovations: &mut Innovations,
    rng: &mut Rng,
) -> Option<Mutation> {
    (0..MAX_ATTEMPTS).find_map(|_| {
        let kind = Mutation::draw(config, rng);
        let is_mutated = match kind {
            Mutation::AddNeuron => add_neuron(genome, config, innovations, rng),
            Mutation::AddLink => add_link(genome, config, innovations, rng),
            Mutation::RemoveNeuron => remove_neuron(genome, config, innovations, rng),
            Mutation::RemoveLink => remove_link(genome, rng),
            Mutation::Weights => change_weights(genome, config, rng),
        };
        is_mutated.then_some(kind)
    })
}

/// Perturbs, replaces or keeps the weight of each link; `false` if there are no links.
///
/// The shares of perturbed and replaced weights are MultiNEAT's.
fn change_weights(genome: &mut Genome, config: &Config, rng: &mut Rng) -> bool {
    let severe = rng.bernoulli(config.mutate_weights_severe_prob);
    // Weights of the newest 5 % of the links always change, in genomes with more than 20 links.
    let last_old = (genome.links.len() as f64 * 0.95) as usize;
    for (index, link) in genome.links.iter_mut().enumerate() {
        // A draw above the first bound perturbs the weight, one above the second replaces it, any other keeps it.
        let (perturb, replace) = if severe {
            (0.3, 0.1)
        } else if index > last_old {
            (0.8, 0.0)
        } else {
            let keep = 1.0 - config.weight_mutation_rate;
            (keep, if rng.coin() { keep - 0.1 } else { keep })
        };
        let draw = rng.uniform();
        if draw > perturb {
            link.weight += rng.triangular() * config.weight_mutation_max_power;
        } else if draw > replace {
            link.weight = rng.triangular() * config.weight_replacement_max_power;
        }
        link.weight = link.weight.clamp(-config.max_weight, config.max_weight);
    }
    !genome.links.is_empty()
}

/// Splits a link: a new neuron takes its place, with a link of weight 1 into it and a link of the old weight out of it. The
/// old link is removed, or disabled with [`Config::disable_split_links`].
///
/// `false` if no attempt finds a link that may be split. Links from the bias may not.
fn add_neuron(genome: &mut Genome, config: &Config, innovations: &mut Innovations, rng: &mut Rng) -> bool {
    if genome.links.is_empty() {
        return false;
    }
    let bias = genome.inputs as u32 + 1;
    let may_split = |link: &Link| {
        link.from != bias
            && (config.split_recurrent || !link.recurrent)
            && (config.split_looped_recurrent || link.from != link.to)
    };
    let mut candidates = (1..config.link_tries).map(|_| rng.below(genome.links.len()));
    let Some(index) = candidates.find(|&index| may_split(&genome.links[index])) else {
        return false;
    };
    let old = genome.links[index];
    let (from, to) = (depth_of(genome, old.from), depth_of(genome, old.to));
    let depth = f64::midpoint(from, to);
    // After some fifty consecutive splits, rounding leaves no depth between the two.
    if config.feed_forward && !(from < depth && depth < to) {
        return false;
    }
    genome.links.remove(index);
    if config.disable_split_links {
        insert(&mut genome.disabled, old);
    }
    let split = innovations.number_split(old.from, old.to, genome);
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
    insert(&mut genome.links, Link { innovation: split.inward, to: split.neuron, weight: 1.0, ..old });
    insert(&mut genome.links, Link { innovation: split.outward, from: split.neuron, ..old });
    true
}

/// Adds a link between two unlinked neurons: a forward link, a recurrent link, or a loop on one neuron.
///
/// `false` if no attempt finds such a pair.
fn add_link(genome: &mut Genome, config: &Config, innovations: &mut Innovations, rng: &mut Rng) -> bool {
    let recurrent = !config.feed_forward && rng.bernoulli(config.recurrent_prob);
    let is_loop = recurrent && rng.bernoulli(config.recurrent_loop_prob);
    let neuron_count = genome.neurons.len();
    let first_target = genome.inputs + 1;
    let target = |rng: &mut Rng| first_target + rng.below(neuron_count - first_target);
    for _ in 1..config.link_tries {
        let (from, to) = match (recurrent, is_loop) {
            (false, _) => (rng.below(neuron_count), target(rng)),
            (true, false) => (target(rng), target(rng)),
            (true, true) => {
                let neuron = target(rng);
                (neuron, neuron)
            }
        };
        let (from, to) = (&genome.neurons[from], &genome.neurons[to]);
        let is_allowed = match (recurrent, is_loop) {
            (false, _) => {
                let is_forward =
                    if config.feed_forward { from.depth < to.depth } else { from.depth <= to.depth };
                from.kind != NeuronKind::Output && from.id != to.id && is_forward
            }
            (true, false) => from.depth > to.depth,
            (true, true) => true,
        };
        let (from, to) = (from.id, to.id);
        if is_allowed && !genome.has_link(from, to) {
            let weight = rng.triangular() * config.weight_replacement_max_power;
            let weight = weight.clamp(-config.max_weight, config.max_weight);
            let innovation = innovations.number_link(from, to);
            insert(&mut genome.links, Link { innovation, from, to, weight, recurrent });
            return true;
        }
    }
    false
}

/// Removes a random link, and all hidden neurons that are dead without it; `false` if there is only one link.
fn remove_link(genome: &mut Genome, rng: &mut Rng) -> bool {
    if genome.links.len() < 2 {
        return false;
    }
    genome.links.remove(rng.below(genome.links.len()));
    while let Some(dead) = genome.find_dead_hidden() {
        remove_hidden(genome, dead);
    }
    true
}

/// Replaces a hidden neuron with one incoming and one outgoing link by one link: the inverse of a split.
///
/// `false` if there is no such neuron.
fn remove_neuron(genome: &mut Genome, config: &Config, innovations: &mut Innovations, rng: &mut Rng) -> bool {
    let simple_links = |neuron: &Neuron| {
        let mut incoming = genome.links.iter().filter(|link| link.to == neuron.id);
        let mut outgoing = genome.links.iter().filter(|link| link.from == neuron.id);
        match (incoming.next(), incoming.next(), outgoing.next(), outgoing.next()) {
            (Some(inward), None, Some(outward), None) if inward.from != neuron.id => {
                Some((*inward, *outward))
            }
            _ => None,
        }
    };
    let hidden = genome.neurons.iter().filter(|neuron| neuron.kind == NeuronKind::Hidden);
    let candidates: Vec<_> = hidden.filter_map(simple_links).collect();
    if candidates.is_empty() {
        return false;
    }
    let (inward, outward) = candidates[rng.below(candidates.len())];
    remove_hidden(genome, inward.to);
    let (from, to) = (inward.from, outward.to);
    genome.disabled.retain(|link| (link.from, link.to) != (from, to));
    if !genome.has_link(from, to) {
        let weight = (inward.weight * outward.weight).clamp(-config.max_weight, config.max_weight);
        let recurrent = inward.recurrent || outward.recurrent;
        insert(
            &mut genome.links,
            Link { innovation: innovations.number_link(from, to), from, to, weight, recurrent },
        );
    }
    true
}

/// Removes a hidden neuron and all its links.
fn remove_hidden(genome: &mut Genome, id: u32) {
    genome.neurons.retain(|neuron| neuron.id != id);
    for genes in [&mut genome.links, &mut genome.disabled] {
        genes.retain(|link| link.from != id && link.to != id);
    }
}

fn depth_of(genome: &Genome, id: u32) -> f64 {
    genome.neurons[genome.position(id).expect("a genome's links join its own neurons")].depth
}

/// Inserts a neuron gene at its place in the order of ids.
fn insert_neuron(genome: &mut Genome, neuron: Neuron) {
    let index = genome.neurons.partition_point(|other| other.id < neuron.id);
    genome.neurons.insert(index, neuron);
}

/// Inserts a link gene at its place in the order of innovation numbers.
fn insert(genes: &mut Vec<Link>, link: Link) {
    let index = genes.partition_point(|other| other.innovation < link.innovation);
    genes.insert(index, link);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{genome, mutants, rng};

    /// A genome with one input and `links` outputs, linked with this weight.
    fn fan(links: usize, weight: f64) -> Genome {
        let links: Vec<_> = (0..links as u32).map(|n| (1, n + 3, weight)).collect();
        genome(1, links.len(), &[], &links)
    }

    /// What a weight mutation did to one weight.
    #[derive(PartialEq)]
    enum WeightChange {
        Kept,
        Perturbed,
        Replaced,
    }

    /// Shares of kept, perturbed and replaced weights over many weight mutations of a genome with `count` links.
    ///
    /// Only links whose index satisfies `is_counted` count. Weights start at 6: a perturbation of at most 0.5 leaves them
    /// above 5, and a replacement puts them below 5.
    fn change_shares(config: &Config, count: usize, is_counted: impl Fn(usize) -> bool) -> [f64; 3] {
        let config = Config { weight_mutation_max_power: 0.5, ..config.clone() };
        let mut rng = rng(1);
        let mut all = Vec::new();
        for _ in 0..600_000 / count {
            let mut genome = fan(count, 6.0);
            assert!(change_weights(&mut genome, &config, &mut rng));
            all.extend(genome.links.iter().enumerate().filter(|&(index, _)| is_counted(index)).map(
                |(_, link)| match link.weight {
                    6.0 => WeightChange::Kept,
                    w if w > 5.0 => WeightChange::Perturbed,
                    _ => WeightChange::Replaced,
                },
            ));
        }
        let share = |change| all.iter().filter(|&c| *c == change).count() as f64 / all.len() as f64;
        [share(WeightChange::Kept), share(WeightChange::Perturbed), share(WeightChange::Replaced)]
    }

    fn assert_shares(found: [f64; 3], wanted: [f64; 3]) {
        let is_close = found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 0.01);
        assert!(is_close, "kept, perturbed, replaced: {found:?}, wanted {wanted:?}");
    }

    #[test]
    fn a_split_link_is_disabled_and_comes_back_by_crossover_in_a_quarter_of_the_children() {
        let config = Config { disable_split_links: true, ..Config::wahby2016() };
        let whole = genome(1, 1, &[], &[(1, 3, 1.5), (2, 3, 1.0)]);
        let mut split = whole.clone();
        let mut innovations = Innovations::new(&Genome::minimal(&config, 1, 1));
        assert!(add_neuron(&mut split, &config, &mut innovations, &mut rng(1)));
        assert_eq!((split.disabled(), split.links().len()), (&whole.links()[..1], 3));
        assert_eq!(split.check().map_err(|error| error.to_string()), Ok(()));
        assert_eq!(Genome::from_json(&split.to_json()).unwrap(), split);
        // Two genes more than its parent; a removed one would be a third.
        let distance = |a: &Genome, b: &Genome| {
            crate::species::compatibility_distance(
                a,
                b,
                &Config { weight_diff_coeff: 0.0, ..config.clone() },
                9.0,
            )
        };
        assert_eq!(distance(&whole, &split), 2.0);
        let kind = crate::crossover::CrossoverKind { is_averaging: true, keeps_all: false };
        let mut child = whole.clone();
        let mut enabled = 0;
        for seed in 0..4000 {
            crate::crossover::crossover((&whole, 0.0), (&split, 1.0), &kind, &mut rng(seed), &mut child);
            assert_eq!(child.genes().len(), 4);
            enabled += usize::from(child.disabled().is_empty());
        }
        assert!((900..1100).contains(&enabled), "{enabled} of 4000");
    }

    #[test]
    fn mild_weight_mutation_perturbs_three_quarters_and_replaces_a_twentieth() {
        let mild = Config { mutate_weights_severe_prob: 0.0, ..Config::wahby2016() };
        assert_shares(change_shares(&mild, 10, |_| true), [0.20, 0.75, 0.05]);
    }

    #[test]
    fn severe_weight_mutation_perturbs_seven_tenths_and_replaces_a_fifth() {
        let severe = Config { mutate_weights_severe_prob: 1.0, ..Config::wahby2016() };
        assert_shares(change_shares(&severe, 10, |_| true), [0.1, 0.7, 0.2]);
        // Three quarters of the weight mutations are mild, one quarter severe.
        assert_shares(change_shares(&Config::wahby2016(), 10, |_| true), [0.175, 0.7375, 0.0875]);
    }

    #[test]
    fn weights_of_the_newest_twentieth_of_more_than_twenty_links_are_mostly_replaced() {
        let mild = Config { mutate_weights_severe_prob: 0.0, ..Config::wahby2016() };
        assert_shares(change_shares(&mild, 20, |index| index == 19), [0.20, 0.75, 0.05]);
        assert_shares(change_shares(&mild, 21, |index| index == 20), [0.0, 0.2, 0.8]);
        assert_shares(change_shares(&mild, 21, |index| index == 19), [0.20, 0.75, 0.05]);
        assert_shares(change_shares(&mild, 100, |index| index > 95), [0.0, 0.2, 0.8]);
    }

    #[test]
    fn weight_changes_are_triangular_scaled_and_clamped() {
        let change = |config: Config, weight| {
            let mut rng = rng(2);
            let mut changed: Vec<f64> = Vec::new();
            for _ in 0..2000 {
                let mut genome = fan(20, weight);
                change_weights(&mut genome, &config, &mut rng);
                changed.extend(genome.links.iter().map(|link| link.weight).filter(|&w| w != weight));
            }
            changed
        };
        let deviation = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
        let perturbs =
            Config { weight_mutation_rate: 1.0, mutate_weights_severe_prob: 0.0, ..Config::wahby2016() };
        let perturbed = change(perturbs, 0.0);
        assert!((deviation(&perturbed) - 0.408).abs() < 0.01, "{}", deviation(&perturbed));
        // With a perturbation power of 0, every changed weight was replaced.
        let replaces = Config { weight_mutation_max_power: 0.0, ..Config::wahby2016() };
        let replaced = change(replaces, 7.0);
        assert!((deviation(&replaced) - 5.0 * 0.408).abs() < 0.05, "{}", deviation(&replaced));
        assert!(replaced.iter().all(|w| w.abs() < 5.0));
        assert!(change(Config::wahby2016(), 7.9).contains(&8.0));
        assert!(change(Config::wahby2016(), 7.9).iter().all(|&w| w <= 8.0));
    }

    #[test]
    fn kinds_of_mutation_are_drawn_in_proportion_to_their_weights() {
        let mut rng = rng(3);
        let drawn: Vec<_> = (0..100_000).map(|_| Mutation::draw(&Config::wahby2016(), &mut rng)).collect();
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

    /// A copy of `genome` after a mutation of this kind; `None` if the mutation failed.
    fn mutated(genome: &Genome, config: &Config, seed: u64, kind: Mutation) -> Option<Genome> {
        let mut innovations = Innovations::new(genome);
        let (mut genome, mut rng) = (genome.clone(), rng(seed));
        let is_mutated = match kind {
            Mutation::AddNeuron => add_neuron(&mut genome, config, &mut innovations, &mut rng),
            Mutation::AddLink => add_link(&mut genome, config, &mut innovations, &mut rng),
            Mutation::RemoveNeuron => remove_neuron(&mut genome, config, &mut innovations, &mut rng),
            Mutation::RemoveLink => remove_link(&mut genome, &mut rng),
            Mutation::Weights => change_weights(&mut genome, config, &mut rng),
        };
        is_mutated.then_some(genome)
    }

    #[test]
    fn a_new_neuron_replaces_the_split_link_and_passes_on_its_weight() {
        let mut before = genome(2, 1, &[(5, 0.5)], &[(1, 5, 3.0), (5, 4, 2.0)]);
        before.links[1].recurrent = true;
        let after = mutated(&before, &Config::wahby2016(), 4, Mutation::AddNeuron).unwrap();
        let split = before.links.iter().find(|link| !after.has_link(link.from, link.to)).unwrap();
        let find = |from, to| after.links.iter().find(|link| (link.from, link.to) == (from, to)).unwrap();
        let (inward, outward) = (find(split.from, 6), find(6, split.to));
        assert_eq!((inward.weight, outward.weight), (1.0, split.weight));
        assert_eq!((inward.recurrent, outward.recurrent), (split.recurrent, split.recurrent));
        let depth = |id| before.neurons[before.position(id).unwrap()].depth;
        assert_eq!(after.neurons[5].depth, (depth(split.from) + depth(split.to)) / 2.0);
        assert_eq!(after.links.len(), 3);
    }

    #[test]
    fn links_from_the_bias_and_excluded_links_are_never_split() {
        let from_bias = genome(1, 1, &[], &[(2, 3, 1.0)]);
        let mut with_loop = genome(1, 1, &[], &[(3, 3, 1.0)]);
        with_loop.links[0].recurrent = true;
        for seed in 0..50 {
            let splits =
                |genome, config: &Config| mutated(genome, config, seed, Mutation::AddNeuron).is_some();
            assert!(!splits(&from_bias, &Config::wahby2016()));
            assert!(splits(&with_loop, &Config::wahby2016()));
            assert!(!splits(&with_loop, &Config { split_recurrent: false, ..Config::wahby2016() }));
            assert!(!splits(&with_loop, &Config { split_looped_recurrent: false, ..Config::wahby2016() }));
        }
    }

    #[test]
    fn a_minimal_genome_can_only_gain_a_loop_on_its_output() {
        let minimal = Genome::minimal(&Config::wahby2016(), 2, 1);
        let mutated: Vec<_> = (0..4000)
            .filter_map(|seed| mutated(&minimal, &Config::wahby2016(), seed, Mutation::AddLink))
            .collect();
        assert!(mutated.iter().all(|genome| genome.links[3].from == 4 && genome.links[3].to == 4));
        assert!(mutated.iter().all(|genome| genome.links[3].recurrent && genome.links[3].weight.abs() < 5.0));
        let squares = mutated.iter().map(|genome| genome.links[3].weight.powi(2)).sum::<f64>();
        let deviation = (squares / mutated.len() as f64).sqrt();
        assert!((deviation - 5.0 * 0.408).abs() < 0.3, "{deviation}");
        // An added link is recurrent with probability 0.25, and a recurrent one is a loop with probability 0.25.
        let share = mutated.len() as f64 / 4000.0;
        assert!((share - 0.0625).abs() < 0.012, "{share}");
    }

    #[test]
    fn a_quarter_of_the_added_links_are_recurrent_and_a_quarter_of_those_are_loops() {
        let before = genome(2, 1, &[(5, 0.3), (6, 0.6)], &[(1, 5, 1.0), (5, 6, 1.0), (6, 4, 1.0)]);
        let depth = |id| before.neurons[before.position(id).unwrap()].depth;
        let mut counts = [0.0_f64; 3];
        for seed in 0..4000 {
            let after = mutated(&before, &Config::wahby2016(), seed, Mutation::AddLink).unwrap();
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
    fn link_tries_allow_one_attempt_fewer() {
        let one_link = fan(1, 1.0);
        let tries = |link_tries| Config { link_tries, ..Config::wahby2016() };
        assert!(mutated(&one_link, &tries(1), 1, Mutation::AddNeuron).is_none());
        assert!(mutated(&one_link, &tries(2), 1, Mutation::AddNeuron).is_some());
    }

    #[test]
    fn forward_links_may_join_equal_depths_unless_networks_are_feed_forward() {
        let pair = genome(1, 1, &[(4, 0.5), (5, 0.5)], &[(1, 4, 1.0), (1, 5, 1.0), (4, 3, 1.0), (5, 3, 1.0)]);
        let makes_cycle = |config: &Config| {
            let mutated = (0..500).filter_map(|seed| mutated(&pair, config, seed, Mutation::AddLink));
            mutated.into_iter().any(|genome| genome.has_link(4, 5))
        };
        assert!(makes_cycle(&Config { recurrent_prob: 0.0, ..Config::wahby2016() }));
        assert!(!makes_cycle(&Config { feed_forward: true, ..Config::wahby2016() }));
    }

    #[test]
    fn removing_a_neuron_undoes_a_split() {
        let random = Genome::random(&Config::wahby2016(), 2, 1, 1, 0);
        let mut innovations = Innovations::new(&random);
        let (mut genome, mut rng) = (random.clone(), rng(1));
        assert!(add_neuron(&mut genome, &Config::wahby2016(), &mut innovations, &mut rng));
        assert!(remove_neuron(&mut genome, &Config::wahby2016(), &mut innovations, &mut rng));
        assert_eq!(genome, random);
        assert!(!remove_neuron(&mut genome, &Config::wahby2016(), &mut innovations, &mut rng));
    }

    #[test]
    fn removing_a_link_removes_the_neurons_that_are_dead_without_it() {
        // A chain from the first input, and a direct link from the second. Removing a link of the chain removes all of it.
        let chain = [(1, 5, 1.0), (5, 6, 1.0), (6, 4, 1.0), (2, 4, 1.0)];
        let before = genome(2, 1, &[(5, 0.3), (6, 0.6)], &chain);
        let after: Vec<_> = (0..100)
            .map(|seed| mutated(&before, &Config::wahby2016(), seed, Mutation::RemoveLink).unwrap())
            .collect();
        assert!(after.iter().all(|genome| [1, 3].contains(&genome.links.len()) && !genome.has_dead_ends()));
        assert!(after.iter().any(|genome| genome.links.len() == 1 && genome.neurons.len() == 4));
        assert!(
            mutated(&fan(1, 1.0), &Config::wahby2016(), 1, Mutation::RemoveLink).is_none(),
            "the last link stays"
        );
    }

    proptest! {
        #[test]
        fn mutated_genomes_stay_valid(seed in 0_u64..10_000, feed_forward: bool, removes: bool) {
            let remove = if removes { 0.2 } else { 0.0 };
            let config = Config {
                feed_forward,
                mutate_rem_link_prob: remove,
                mutate_rem_neuron_prob: remove,
                ..Config::ball_keeper()
            };
            for genome in mutants(&config, seed, 80) {
                prop_assert!(genome.check().is_ok(), "{:?}", genome.check());
                prop_assert!(removes || !genome.has_dead_ends());
                prop_assert!(genome.links.iter().all(|link| link.weight.abs() <= config.max_weight));
                let depth = |id| genome.neurons[genome.position(id).unwrap()].depth;
                prop_assert!(!feed_forward || genome.links.iter().all(|link| depth(link.from) < depth(link.to)));
            }
        }
    }
}
