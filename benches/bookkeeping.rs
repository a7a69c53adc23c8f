//! Cost of a generation without its evaluations, and of building and running a network.
//!
//! `Neat::tell` is measured with the parameters of Wahby et al. (2016), for small and large networks.
//!
//! `cargo bench --manifest-path benches/Cargo.toml --bench bookkeeping`

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use tropism_neat::{Config, Generation, Genome, Neat, Network, random_genome};

/// Generations after which a measured run is reset to its start, before its networks grow noticeably.
const RESET_INTERVAL: u64 = 10;

/// Meaningless scores, the same in every run: hashes of a counter.
fn noise(neat: &Neat) -> impl Iterator<Item = f64> {
    let first = u64::from(neat.generation()) << 20;
    (first..).map(|n| ((n.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64) / 1e7)
}

/// Advances a run by one generation with noise and a reward for links as scores.
fn step(neat: &mut Neat, score_per_link: f64) -> Generation {
    let scores = neat.ask().iter().zip(noise(neat));
    let scores: Vec<f64> =
        scores.map(|(genome, noise)| noise + score_per_link * genome.links().len() as f64).collect();
    neat.tell(&scores).expect("finite scores")
}

/// A run whose networks have about `links` links. Links are rewarded until they are reached; 30 generations of noise follow.
fn run_with(population: usize, links: f64) -> Neat {
    let config = Config { population, ..Config::wahby2016() };
    let mut neat = Neat::new(config, 2, 1, 1).expect("a valid preset");
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
                        if generation % RESET_INTERVAL == 0 {
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
    let of_size = |links| run_with(50, links).champion().expect("at least one generation").genome.clone();
    let genomes: [(&str, Genome); 2] =
        [("3 links", random_genome(&Config::wahby2016(), 2, 1, 1, 0)), ("140 links", of_size(140.0))];
    for (name, genome) in &genomes {
        group.bench_function(BenchmarkId::new("new", name), |b| b.iter(|| Network::new(black_box(genome))));
        let mut network = Network::new(genome);
        group.bench_function(BenchmarkId::new("activate", name), |b| {
            b.iter(|| network.activate(black_box(&[1.0, 4.0]))[0]);
        });
    }
    group.bench_function("random_genome", |b| {
        let config = Config::wahby2016();
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
