//! Exclusive or, the smallest task that asks for a hidden neuron.
//!
//! `cargo run --release -p tropism-neat --example xor -- --seeds 100`
//!
//! Fitness is (4 - the sum of the four errors), squared; solved is a network that has all four answers on the right side of
//! one half. Stanley and Miikkulainen (2002) report 4755 evaluations in 32 generations, with 2.35 hidden neurons and
//! 7.48 links, and no failure in 100 runs.

mod common;

use common::{Outcome, arguments, report};
use tropism_neat::{Activation, Config, Genome, Neat, NeatError, Network, Trial, evolve};

const CASES: [([f64; 2], f64); 4] =
    [([0.0, 0.0], 0.0), ([0.0, 1.0], 1.0), ([1.0, 0.0], 1.0), ([1.0, 1.0], 0.0)];

fn answers(genome: &Genome) -> [f64; 4] {
    let mut network = Network::new(genome);
    CASES.map(|(inputs, _)| network.activate_feed_forward(&inputs)[0])
}

fn score(genome: &Genome, _: Trial) -> f64 {
    let errors = answers(genome).into_iter().zip(CASES).map(|(answer, (_, wanted))| (answer - wanted).abs());
    (4.0 - errors.sum::<f64>()).powi(2)
}

fn is_solved(neat: &Neat) -> bool {
    let champion = &neat.champion().expect("has been told").genome;
    answers(champion).into_iter().zip(CASES).all(|(answer, (_, wanted))| (answer > 0.5) == (wanted > 0.5))
}

fn main() -> Result<(), NeatError> {
    let (seeds, _) = arguments(10, &[]);
    let config = Config {
        population: 150,
        output_activation: Activation::UnsignedSigmoid,
        hidden_activation: Activation::UnsignedSigmoid,
        activation_a: 4.9,
        feed_forward: true,
        survival_rate: 0.2,
        mutate_add_link_prob: 0.3,
        mutate_weights_prob: 0.7,
        weight_mutation_rate: 0.5,
        weight_mutation_max_power: 2.5,
        ..Config::paper()
    };
    let runs = evolve(&config, (2, 1), 0..seeds, 300, score, |neat, _| is_solved(neat))?;
    let outcomes: Vec<_> = runs
        .iter()
        .map(|neat| {
            let champion = &neat.champion().expect("has been told").genome;
            Outcome {
                solved: is_solved(neat),
                evaluations: neat.evaluations(),
                generations: neat.generation(),
                hidden: champion.neurons().len() - 4,
                links: champion.links().len(),
            }
        })
        .collect();
    report(&outcomes);
    Ok(())
}
