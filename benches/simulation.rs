//! What a step of plant and network costs, in elements of one step: with few and with many data points in the model, and
//! with networks of few and of many links.
//!
//! `cargo bench --manifest-path benches/Cargo.toml --bench simulation`

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use tropism::control::{NetworkController, Sensors};
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::observation::Quality;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::{BatchModel, Episode, fitness_of};
use tropism::task::{Reading, Task};
use tropism::track::{Sample, Track};
use tropism_neat::{Config, Genome, Neat, random_genome};

/// Steps of each plant, however high it grows.
const STEPS: u32 = 300;

/// A model of so many steps of a made-up plant that leans towards the light, over and over from 4 to 24 cm.
fn model(steps: u32) -> TipModel {
    let samples = (0..steps).map(|step| {
        let (age, phase) = (step % 700, step % 80);
        let lean = if phase < 40 { phase } else { 80 - phase };
        // No two plants are quite alike.
        let own = 0.3 * f64::from(step / 700 % 10);
        Sample {
            step,
            time_s: 300.0 * f64::from(step),
            tip: Point::new(0.2 * f64::from(lean) - 5.0 + own, 4.0 + 0.03 * f64::from(age)),
            stem: None,
            depth: None,
            light: Some(if phase < 40 { Light::RIGHT } else { Light::LEFT }),
            levels: None,
            quality: Quality::Measured,
        }
    });
    let track = Track::of(samples.collect());
    TipModel::fit([&track], TipModelConfig::default()).expect("a track with steps in it")
}

fn task() -> Task {
    Task { end_height_cm: f64::INFINITY, max_steps: STEPS, ..Task::default() }
}

/// A population with so many links on average, bred for fitness and, until they are there, for links.
fn population(links: f64, model: &TipModel, task: &Task) -> Vec<Genome> {
    let config = Config { population: 150, ..Config::wahby2016() };
    let mut neat = Neat::new(config, 2, 1, 1).expect("the paper's parameters");
    loop {
        let fitness = evaluate(model, task, neat.ask());
        let scores = neat.ask().iter().zip(fitness);
        let scores: Vec<f64> =
            scores.map(|(genome, fitness)| fitness + genome.links().len() as f64).collect();
        if neat.tell(&scores).expect("finite scores").links_mean >= links {
            return neat.ask().to_vec();
        }
    }
}

fn noise(plant: usize) -> NoiseStream {
    NoiseStream::new(1, Purpose::Growth, [0, plant as u32, 0])
}

fn evaluate(model: &TipModel, task: &Task, genomes: &[Genome]) -> Vec<f64> {
    let episodes = genomes.iter().enumerate();
    let episodes = episodes.map(|(plant, genome)| Episode { controller: genome, noise: noise(plant) });
    model.score(task, (&Sensors::default()).into(), episodes)
}

/// The look-up does not depend on the number of data points.
fn data(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step, by data points");
    let task = task();
    let genomes: Vec<Genome> =
        (0..1000).map(|index| random_genome(&Config::wahby2016(), 2, 1, 1, index)).collect();
    group.throughput(Throughput::Elements(u64::from(STEPS) * genomes.len() as u64));
    for points in [10_000, 100_000, 1_000_000] {
        let model = model(points);
        group.bench_function(BenchmarkId::from_parameter(points), |bencher| {
            bencher.iter(|| evaluate(&model, &task, &genomes));
        });
    }
    group.finish();
}

/// Making the network is part of it; the plain path beside it.
fn links(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step, by links");
    let (model, task) = (model(10_000), task());
    for links in [10, 20, 40, 80, 160] {
        let genomes = population(f64::from(links), &model, &task);
        group.throughput(Throughput::Elements(u64::from(STEPS) * genomes.len() as u64));
        group.bench_function(BenchmarkId::new("lanes", links), |bencher| {
            bencher.iter(|| evaluate(&model, &task, &genomes));
        });
        group.bench_function(BenchmarkId::new("plain", links), |bencher| {
            bencher.iter(|| -> f64 {
                let fitness = |(plant, genome)| {
                    let mut controller =
                        NetworkController::of_tip(genome).expect("two inputs and one output");
                    fitness_of(&model, &mut controller, &task, noise(plant))
                };
                genomes.iter().enumerate().map(fitness).sum()
            });
        });
    }
    group.finish();
}

/// Whole evaluations of the paper's preset by each reading of eq. (9), in evaluations.
fn scores(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("evaluation, by score");
    let model = model(10_000);
    let genomes = population(20.0, &model, &task());
    group.throughput(Throughput::Elements(genomes.len() as u64));
    for score in [Reading::Letter, Reading::Approach, Reading::Arrival] {
        let task = Task { score, ..task() };
        group.bench_function(BenchmarkId::from_parameter(format!("{score:?}")), |bencher| {
            bencher.iter(|| evaluate(&model, &task, &genomes));
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = data, links, scores
}
criterion_main!(benches);
