//! Mutation: exactly one kind at a time, drawn by weight, and drawn again until it succeeds.

use crate::innovation::Innovations;
use crate::random::Dice;
use crate::{Config, Genome, Link, Neuron, NeuronKind};

/// Draws of a kind before a genome that nothing can be done to is left as it is.
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
    let picks = (1..config.link_tries).map(|_| dice.below(genome.links.len()));
    let Some(place) = picks.into_iter().find(|&place| may_split(&genome.links[place])) else {
        return false;
    };
    let old = genome.links.remove(place);
    let split = innovations.split(old.from, old.to, genome);
    let depth = f64::midpoint(depth_of(genome, old.from), depth_of(genome, old.to));
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
    let recurrent = dice.chance(config.recurrent_prob);
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
            (false, _) => from.kind != NeuronKind::Output && from.id != to.id && from.depth <= to.depth,
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
