//! Champions and their files.

use super::leaning;
use tropism::control::{NetworkController, Sensor, Sensors};
use tropism::evolve::{Champion, Choice, Evolution, EvolutionConfig, Trial, trial, trial_of_genome};
use tropism::task::Task;
use tropism_neat::{Config, random_genome};

#[test]
fn a_genome_is_tried_as_its_controller_is() {
    let (model, task) = (leaning(), Task::default());
    let evolution = Evolution::new(&model, &task, EvolutionConfig::default(), 3).unwrap();
    let mut run = evolution.begin(0).unwrap();
    for _ in 0..60 {
        evolution.advance(&mut run);
    }
    let (genome, _) = run.champion().unwrap();
    let models = [model.clone(), model.clone()];
    let controller = NetworkController::of_tip(genome).unwrap();
    let plain = trial(&models, &task, || controller.clone(), 4, 50);
    assert_eq!(trial_of_genome(&models, &task, (&Sensors::default()).into(), genome, 4, 50), plain);
}

#[test]
fn the_highest_mean_is_chosen_and_of_equals_the_first() {
    let trial = |mean| Trial { mean, sd: 1.0, plants: 3 };
    assert_eq!(Choice::of([2.0, 5.0, 5.0, 1.0].map(trial).to_vec()).run, 1);
}

#[test]
fn a_champion_file_comes_back_with_task_and_sensors() {
    let sensors = Sensors::new(vec![Sensor::Tip, Sensor::LastShift]).unwrap();
    let genome = random_genome(&Config::wahby2016(), 4, 1, 1, 0);
    let champion = Champion {
        task: Some(Task::default()),
        is_virtual: Some(true),
        expected: Some(Trial { mean: 9.1, sd: 2.5, plants: 1200 }),
        ..Champion::of_model(genome.clone(), (&sensors).into(), &leaning(), "{}")
    };
    assert_eq!(Champion::from_json(&champion.to_json()).unwrap(), champion);
    let error = Champion::of_genome(genome).check().unwrap_err().to_string();
    assert!(error.contains("4 inputs"), "{error}");
}

#[test]
fn a_network_alone_is_a_champion_without_task() {
    let genome = random_genome(&Config::wahby2016(), 2, 1, 1, 0);
    assert_eq!(Champion::from_json(&genome.to_json()).unwrap(), Champion::of_genome(genome));
    let error = |text| Champion::from_json(text).unwrap_err().to_string();
    assert!(error(r#"{"schema":"tropism.model/2"}"#).contains("wanted \"tropism.champion/1\""));
    assert!(!error("{").is_empty());
}
