//! Evolves XOR, the smallest task that requires a hidden neuron.
//!
//! `cargo run --release -p tropism-neat --example xor -- --seeds 100 [--preset wahby2016]`
//!
//! The fitness is the square of 4 minus the sum of the four errors. A network solves the task if all four outputs are on the
//! right side of one half. Stanley and Miikkulainen (2002, section 4.2) report 4755 evaluations in 32 generations, with 2.35
//! hidden neurons and 7.48 links, and no failure in 100 runs. `docs/validation/neat-classics.md` has our figures.

mod common;

use common::{Arguments, RunResult, arguments, report};
use tropism_neat::{Evaluation, Genome, Neat, NeatError, Network, evolve};

const CASES: [([f64; 2], f64); 4] =
    [([0.0, 0.0], 0.0), ([0.0, 1.0], 1.0), ([1.0, 0.0], 1.0), ([1.0, 1.0], 0.0)];

fn outputs(genome: &Genome) -> [f64; 4] {
    let mut network = Network::new(genome);
    CASES.map(|(inputs, _)| network.run(&inputs)[0])
}

fn score(genome: &Genome, _: Evaluation) -> f64 {
    let errors = outputs(genome).into_iter().zip(CASES).map(|(output, (_, target))| (output - target).abs());
    (4.0 - errors.sum::<f64>()).powi(2)
}

fn is_solved(neat: &Neat) -> bool {
    let champion = &neat.champion().expect("at least one generation").genome;
    outputs(champion).into_iter().zip(CASES).all(|(output, (_, target))| (output > 0.5) == (target > 0.5))
}

fn main() -> Result<(), NeatError> {
    let Arguments { seeds, config, .. } = arguments(10, &[]);
    let runs = evolve(&config, (2, 1), 0..seeds, 300, score, |neat, _| is_solved(neat))?;
    let results: Vec<_> = runs
        .iter()
        .map(|neat| {
            let champion = &neat.champion().expect("at least one generation").genome;
            RunResult {
                is_solved: is_solved(neat),
                evaluations: neat.evaluations(),
                generations: neat.generation(),
                hidden: champion.hidden(),
                links: champion.links().len(),
            }
        })
        .collect();
    report(&results);
    Ok(())
}
