//! Evolution on an outside model, task, sensors and four lamps, and its champion at work.

use std::ops::ControlFlow;

use outside::{FourWay, lean, sensors};
use tropism::evolve::EvolutionRun;
use tropism::prelude::*;

fn config() -> EvolutionConfig {
    EvolutionConfig {
        runs: 2,
        generations: 25,
        episodes: 2,
        sensors: sensors(),
        ..EvolutionConfig::default()
    }
}

fn evolved(seed: u64) -> Vec<EvolutionRun> {
    let model = FourWay::default();
    let task = lean();
    let evolution = Evolution::new(&model, &task, config(), seed).unwrap();
    evolution.evolve(&|_run, _generation| ControlFlow::Continue(())).unwrap().expect("never broken off")
}

#[test]
fn a_champion_of_an_outside_model_steers_with_four_lamps() {
    let (model, task) = (FourWay::default(), lean());
    let runs = evolved(1);
    let evolution = Evolution::new(&model, &task, config(), 1).unwrap();
    let choice = evolution.choose(&runs, std::slice::from_ref(&model), 20);
    let (genome, _) = runs[choice.run].champion().unwrap();
    let champion = Champion::of_model(genome.clone(), (&sensors()).into(), &model, "an outside model");
    let champion = Champion::from_json(&champion.to_json()).unwrap();
    assert_eq!(champion.layout.name(Some(Light::new(3).unwrap())), "south");

    let track = simulate(&model, &mut champion.controller(&task).unwrap(), &task, 5);
    assert_eq!((track.period_min, track.layout.len()), (10.0, 4));
    assert!(track.samples.iter().all(|sample| sample.stem.is_some()));
    assert!(task.fitness(&track) > 2.0, "fitness {}", task.fitness(&track));
    let again = Track::read_csv_of(track.to_csv().as_slice(), model.layout()).unwrap();
    assert_eq!(again.samples.len(), track.samples.len());
}

#[test]
fn the_same_seed_gives_the_same_bits_and_a_run_resumes() {
    let texts = |runs: &[EvolutionRun]| runs.iter().map(EvolutionRun::to_json).collect::<Vec<_>>();
    assert_eq!(texts(&evolved(3)), texts(&evolved(3)));
    let (model, task) = (FourWay::default(), lean());
    let evolution = Evolution::new(&model, &task, config(), 3).unwrap();
    let mut run = evolution.begin(1).unwrap();
    for _ in 0..10 {
        evolution.advance(&mut run);
    }
    let mut resumed = evolution.resume(1, &run.to_json()).unwrap();
    assert!(evolution.finish(&mut resumed, &mut |_| ControlFlow::Continue(())).is_continue());
    assert_eq!(resumed.to_json(), evolved(3)[1].to_json());
}

#[test]
fn mirroring_is_a_property_of_the_layout() {
    let layout = FourWay::default().layout().clone();
    assert!(layout.is_symmetric());
    assert_eq!(layout.mirrored(Light::new(0).unwrap()), Light::new(1));
    assert_eq!(layout.mirrored(Light::new(2).unwrap()), Light::new(2));
}
