//! What a generation costs beside its evaluations: `Neat::tell` with the paper's parameters, early and with large networks.
//!
//! `cargo bench -p tropism-neat`

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use tropism_neat::{Config, Generation, Genome, Neat, Network, random_genome};

/// Generations that a state is run on for before it is taken afresh: its networks hardly grow in so few.
const STRETCH: u64 = 10;

/// Scores without a meaning, but the same in every run: fractions of a scrambled count.
fn noise(neat: &Neat) -> impl Iterator<Item = f64> {
    let first = u64::from(neat.generation()) << 20;
    (first..).map(|n| ((n.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64) / 1e7)
}

fn step(neat: &mut Neat, worth_of_a_link: f64) -> Generation {
    let scores = neat.ask().iter().zip(noise(neat));
    let scores: Vec<f64> =
        scores.map(|(genome, noise)| noise + worth_of_a_link * genome.links().len() as f64).collect();
    neat.tell(&scores).expect("finite scores")
}

/// A run whose networks have so many links: fast in growing as long as links are worth something, then left to chance.
fn run_with(population: usize, links: f64) -> Neat {
    let config = Config { population, ..Config::paper() };
    let mut neat = Neat::new(config, 2, 1, 1).expect("the paper's parameters");
    while step(&mut neat, 0.1).links_mean < links {}
    for _ in 0..30 {
        step(&mut neat, 0.0);
    }
    neat
}

fn bookkeeping(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("generation");
    group.sample_size(20);
    for population in [50, 150, 1000] {
        for links in [8.0, 140.0] {
            let start = run_with(population, links);
            group.bench_function(BenchmarkId::new(format!("{links} links"), population), |bencher| {
                bencher.iter_custom(|generations| {
                    let mut spent = Duration::ZERO;
                    let (mut neat, mut scores) = (start.clone(), Vec::new());
                    for generation in 0..generations {
                        if generation % STRETCH == 0 {
                            neat = start.clone();
                        }
                        scores.clear();
                        scores.extend(noise(&neat).take(neat.ask().len()));
                        let clock = Instant::now();
                        black_box(neat.tell(&scores).expect("finite scores"));
                        spent += clock.elapsed();
                    }
                    spent
                });
            });
        }
    }
    group.finish();
}

fn phenotype(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("network");
    let of_size = |links| run_with(50, links).champion().expect("has been told").genome.clone();
    let genomes: [(&str, Genome); 2] =
        [("3 links", random_genome(&Config::paper(), 2, 1, 1, 0)), ("140 links", of_size(140.0))];
    for (name, genome) in &genomes {
        group.bench_function(BenchmarkId::new("new", name), |b| b.iter(|| Network::new(black_box(genome))));
        let mut network = Network::new(genome);
        group.bench_function(BenchmarkId::new("activate", name), |b| {
            b.iter(|| network.activate(black_box(&[1.0, 4.0]))[0]);
        });
    }
    group.bench_function("random_genome", |b| {
        let config = Config::paper();
        let mut index = 0;
        b.iter(|| {
            index += 1;
            random_genome(&config, 2, 1, 1, index)
        });
    });
    group.finish();
}

criterion_group!(benches, bookkeeping, phenotype);
criterion_main!(benches);
