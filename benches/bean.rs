//! What beans cost without photographs: one plant, and plants side by side in vector lanes, in steps of five minutes.

use std::ops::ControlFlow;
use std::time::Duration;

use cpu_time::ThreadTime;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use tropism::control::{Greedy, Periodic};
use tropism::environment::unwatched;
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::obstacle::{Obstacle, Solid};
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism_bean::{Bean, Population, Species, Trial, acceptance, lamp_powers};

// As in the program `tropism`.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Steps of a whole experiment, and plants.
const STEPS: u32 = 1000;
const PLANTS: u64 = 32;

fn bean(criterion: &mut Criterion) {
    let species = Species::default();
    criterion.bench_function("bean, 1000 steps", |bencher| {
        bencher.iter(|| {
            let mut bean = Bean::new(species.draw(1, 1.0), 1);
            for step in 0..STEPS {
                bean.advance(&lamp_powers(Some(acceptance::alternating(step))), 5.0);
            }
            bean.apex()
        });
    });
    criterion.bench_function("bean, 1000 steps, tracked", |bencher| {
        bencher.iter(|| acceptance::open_loop_experiment(&species, 1));
    });
}

/// Processor time of this thread, which other programs do not change.
fn time<R>(rounds: u64, mut work: impl FnMut() -> R) -> Duration {
    let start = ThreadTime::now();
    for _ in 0..rounds {
        std::hint::black_box(work());
    }
    start.elapsed()
}

fn population(criterion: &mut Criterion) {
    let species = Species::default();
    let seeds: Vec<u64> = (0..PLANTS).collect();
    let seedling = |&seed: &u64| Bean::new(species.draw(seed, 1.0), seed);
    let powers = |step| lamp_powers(Some(acceptance::alternating(step)));
    let mut group = criterion.benchmark_group("32 beans, 1000 steps");
    group.throughput(Throughput::Elements(PLANTS * u64::from(STEPS))).sample_size(10);
    group.bench_function("plain", |bencher| {
        bencher.iter_custom(|rounds| {
            time(rounds, || {
                let mut beans: Vec<Bean> = seeds.iter().map(seedling).collect();
                for bean in &mut beans {
                    (0..STEPS).for_each(|step| bean.advance(&powers(step), 5.0));
                }
                beans
            })
        });
    });
    group.bench_function("lanes", |bencher| {
        bencher.iter_custom(|rounds| {
            time(rounds, || {
                let mut population = Population::new(seeds.iter().map(seedling).collect());
                (0..STEPS).for_each(|step| population.advance(&[powers(step); PLANTS as usize], 5.0));
                population.beans
            })
        });
    });
    let trial = Trial::new(&species);
    let task = Task::open_loop(STEPS);
    let periodic = || Periodic::new(acceptance::SWITCH_STEPS, &trial.layout).starting_with(Light::RIGHT);
    group.bench_function("tracked, plain", |bencher| {
        bencher.iter_custom(|rounds| {
            let grow = |&seed: &u64| trial.grow(seed, &mut periodic(), &task, &mut unwatched);
            time(rounds, || seeds.iter().map(grow).collect::<Vec<_>>())
        });
    });
    group.bench_function("tracked, lanes", |bencher| {
        bencher.iter_custom(|rounds| {
            let watch = &mut |_: usize, _: &Sample| ControlFlow::Continue(());
            time(rounds, || trial.grow_all(&seeds, |_| periodic(), &task, watch))
        });
    });
}

/// Whole experiments of the paper under greedy: plants one by one, and side by side in vector lanes, as `tropism grow` grows them.
fn paper(criterion: &mut Criterion) {
    let species = Species::default();
    let (trial, task) = (Trial::new(&species), Task::default());
    let seeds: Vec<u64> = (0..2 * PLANTS).collect();
    let greedy = || Greedy::new(&task, &trial.layout);
    let grow = || -> Vec<Track> {
        seeds.iter().map(|&seed| trial.grow(seed, &mut greedy(), &task, &mut unwatched)).collect()
    };
    let steps = grow().iter().map(|track| track.samples.len() as u64 - 1).sum();
    let mut group = criterion.benchmark_group("64 beans under greedy, task of the paper");
    group.throughput(Throughput::Elements(steps)).sample_size(10);
    group.bench_function("tracked, plain", |bencher| {
        bencher.iter_custom(|rounds| time(rounds, grow));
    });
    group.bench_function("tracked, lanes", |bencher| {
        bencher.iter_custom(|rounds| {
            let watch = &mut |_: usize, _: &Sample| ControlFlow::Continue(());
            time(rounds, || trial.grow_all(&seeds, |_| greedy(), &task, watch))
        });
    });
}

/// Beans that lean on an obstacle for most of the time, beside the same without: what contact costs at most.
fn contact(criterion: &mut Criterion) {
    let species = Species::default();
    let scenes: [(&str, Vec<Solid>); 3] = [
        ("without", vec![]),
        ("disc", vec![Obstacle::Disc { centre: Point::new(4.0, 8.0), radius_cm: 1.0 }.into()]),
        ("line", vec![Obstacle::Line { ends: [Point::new(1.0, 8.0), Point::new(8.0, 8.0)] }.into()]),
    ];
    let mut group = criterion.benchmark_group("8 beans towards the right lamp, 500 steps");
    group.sample_size(10);
    for (name, solids) in scenes {
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|rounds| {
                time(rounds, || {
                    let mut beans: Vec<_> =
                        (0..8).map(|seed| Bean::new(species.draw(seed, 1.0), seed).among(&solids)).collect();
                    for bean in &mut beans {
                        (0..500).for_each(|_| bean.advance(&lamp_powers(Some(Light::RIGHT)), 5.0));
                    }
                    beans
                })
            });
        });
    }
}

/// Beans that greedy steers in the scenes of `tasks/`, one by one as `tropism transfer` grows them, and the same without contact.
fn greedy(criterion: &mut Criterion) {
    let species = Species::default();
    let mut group = criterion.benchmark_group("16 beans under greedy");
    group.sample_size(10);
    for (name, task) in tropism_benches::tasks() {
        for (with, solids) in [("without contact", vec![]), ("with contact", task.solids())] {
            let trial = Trial { solids, ..Trial::new(&species) };
            group.bench_function(format!("{name}, {with}"), |bencher| {
                bencher.iter_custom(|rounds| time(rounds, || grow_under_greedy(&trial, &task)));
            });
        }
    }
}

fn grow_under_greedy(trial: &Trial<'_>, task: &Task) -> Vec<Track> {
    let grow = |seed| trial.grow(seed, &mut Greedy::new(task, &trial.layout), task, &mut unwatched);
    (77..93).map(grow).collect()
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = bean, population, paper, contact, greedy
}
criterion_main!(benches);
