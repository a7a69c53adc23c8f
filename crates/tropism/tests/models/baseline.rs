//! The random baseline.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::leaning;
use tropism::control::{NetworkController, Sensors};
use tropism::evolve::{Baseline, random_scores};
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::fitness_of;
use tropism::task::Task;
use tropism_neat::{Activation, Config, random_genome};

#[test]
fn a_baseline_is_what_each_of_its_genomes_does_by_itself() {
    let (model, task, sensors) = (leaning(), Task::default(), Sensors::default());
    for output_activation in [Activation::UnsignedStep, Activation::SignedStep] {
        let neat = Config { output_activation, ..Config::wahby2016() };
        let scores: Vec<f64> = (0..1100)
            .map(|index| {
                let genome = random_genome(&neat, 2, 1, 5, index);
                let mut controller = NetworkController::of_tip(&genome).unwrap();
                let noise = NoiseStream::new(5, Purpose::Growth, [0, index as u32, 0]);
                fitness_of(&model, &mut controller, &task, noise)
            })
            .collect();
        let part = |indices| random_scores(&model, &task, &sensors, &neat, 5, indices, |_| true).unwrap();
        let found = Baseline::of(&[part(0..700), part(700..1100)].concat(), &model, &sensors, &neat, 5);
        let best = scores.iter().copied().fold(f64::MIN, f64::max);
        assert_eq!(found.best.to_bits(), best.to_bits());
        let mut sorted = scores.clone();
        sorted.sort_by(f64::total_cmp);
        assert_eq!(found.median, 0.5 * (sorted[549] + sorted[550]));
        let place = scores.iter().position(|&score| score == best).unwrap();
        assert_eq!(found.champion, random_genome(&neat, 2, 1, 5, place as u64));
    }
}

#[test]
fn a_baseline_that_is_broken_off_begins_no_further_work() {
    let (model, sensors) = (leaning(), Sensors::default());
    let task = Task { max_steps: 2, ..Task::default() };
    let parts = AtomicUsize::new(0);
    let tick = |_| {
        parts.fetch_add(1, Ordering::Relaxed);
        false
    };
    let neat = Config::wahby2016();
    assert!(random_scores(&model, &task, &sensors, &neat, 5, 0..5_000_000, tick).is_none());
    let threads = std::thread::available_parallelism().unwrap().get();
    assert!(parts.into_inner() <= threads, "each thread ends what it had begun");
}
