//! What a generation costs beside its evaluations: CPU milliseconds of us and of radiate, and species at the end of each.
//! Scores have no meaning.

use cpu_time::ProcessTime;
use radiate::graphs::NeatDistance;
use radiate::prelude::*;
use tropism_neat::{Config, Neat};

/// Generations before the clock starts.
const FIRST: usize = 10;

/// Fraction number `count` of a sequence that looks random, the same for all.
fn score(count: u64) -> f64 {
    (count.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64 / 1e7
}

/// CPU seconds and species.
fn ours(population: usize, generations: usize) -> (f64, usize) {
    let mut neat =
        Neat::new(Config { population, ..Config::wahby2016() }, 2, 1, 1).expect("the paper's parameters");
    let (mut count, mut start) = (0, ProcessTime::now());
    for generation in 0..FIRST + generations {
        if generation == FIRST {
            start = ProcessTime::now();
        }
        let scores: Vec<f64> = neat
            .ask()
            .iter()
            .map(|_| {
                count += 1;
                score(count)
            })
            .collect();
        neat.tell(&scores).expect("finite scores");
    }
    (start.elapsed().as_secs_f64(), neat.species().len())
}

/// CPU seconds and species.
fn radiate(population: usize, generations: usize, threshold: f32) -> (f64, usize) {
    let store = vec![
        (NodeType::Input, vec![Op::var(0), Op::var(1)]),
        (NodeType::Edge, vec![Op::weight()]),
        (NodeType::Vertex, vec![Op::sigmoid()]),
        (NodeType::Output, vec![Op::sigmoid()]),
    ];
    let count = std::sync::atomic::AtomicU64::new(0);
    let engine = GeneticEngine::builder()
        .codec(GraphCodec::recurrent(2, 1, store))
        .population_size(population)
        .fitness_fn(move |_: Graph<Op<f32>>| {
            score(count.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) as f32
        })
        .diversity(NeatDistance::new(1.0, 1.0, 0.5))
        .species_threshold(threshold)
        .alter(alters!(
            GraphCrossover::new(0.5, 0.5),
            OperationMutator::new(0.75, 0.05),
            GraphMutator::new(0.04, 0.03).allow_recurrent(true)
        ))
        .build();
    let mut run = engine.iter();
    run.by_ref().take(FIRST).for_each(drop);
    let start = ProcessTime::now();
    let last = run.take(generations).last().expect("at least one generation");
    (start.elapsed().as_secs_f64(), last.species().map_or(1, <[_]>::len))
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number =
        || arguments.next().and_then(|n| n.parse::<f32>().ok()).expect("population, generations, threshold");
    let (population, generations, threshold) = (number() as usize, number() as usize, number());
    for (seconds, species) in [ours(population, generations), radiate(population, generations, threshold)] {
        print!("{:.4} {species} ", 1000.0 * seconds / generations as f64);
    }
    println!();
}
