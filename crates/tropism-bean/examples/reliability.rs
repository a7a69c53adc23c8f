//! Reliability diagram of the outlook: how often a target is passed of which it was said that it will be, with a probability.
//!
//! A rule steers virtual beans of which no model was made. At some heights the outlook for each target ahead is noted.
//!
//! ```sh
//! cargo run --release -p tropism-bean --example reliability -- 200 471 stem.json rule.json    # plants, seed; models and rules in turn
//! ```

use std::error::Error;
use std::fs;

use tropism::control::{Controller, PredictiveGreedy, PredictiveRule};
use tropism::environment::unwatched;
use tropism::evolve::TunedRule;
use tropism::math::statistics::{mean, wilson_interval};
use tropism::parallel;
use tropism::plant::stem::PlaneModel;
use tropism::plant::{FittedModel, PlantModel};
use tropism::random::{NoiseStream, Purpose, derive};
use tropism::simulation::go_on;
use tropism::task::{Crossing, Reading, Task, outlook};
use tropism::track::{Sample, Track};
use tropism_bean::{Species, Trial};

/// Heights of the tip at which the outlook is noted, in cm.
const HEIGHTS_CM: [f64; 6] = [0.0, 5.0, 6.5, 8.0, 10.0, 12.0];

/// Simulated plants of an outlook.
const PLANTS: usize = 200;

/// Bounds of the classes of probabilities.
const CLASSES: [f64; 6] = [0.0, 0.1, 0.3, 0.7, 0.9, 1.01];

/// Plants of the model that go on from the last sample of `past`, under the rule.
fn futures(model: &PlaneModel, rule: PredictiveRule, task: &Task, past: &[Sample], seed: u64) -> Vec<Track> {
    let mut steered = PredictiveGreedy::new(rule, task, model.layout());
    let (now, before) = past.split_last().expect("a sample");
    before.iter().for_each(|sample| {
        steered.decide(&sample.observation());
    });
    parallel::map(PLANTS, |number| {
        let noise = NoiseStream::new(seed, Purpose::Forecast, [number as u32, now.step, 1]);
        let plant = model.resumed(past, &mut noise.of_seedling());
        go_on(model, plant, &mut steered.clone(), task, now, noise, u32::MAX)
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.len() < 4 {
        println!("usage: reliability PLANTS SEED stem.json rule.json [stem.json rule.json ...]");
        return Ok(());
    }
    let (plants, seed): (u64, u64) = (arguments[0].parse()?, arguments[1].parse()?);
    let task = Task { score: Reading::Arrival, ..Task::default() };
    let (species, mut said) = (Species::default(), Vec::new());
    let trial = Trial::new(&species);
    for files in arguments[2..].chunks_exact(2) {
        let model = PlaneModel::from_json(&fs::read_to_string(&files[0])?)?;
        let rule = TunedRule::from_json(&fs::read_to_string(&files[1])?)?.rule;
        for plant in 0..plants {
            let bean = derive(seed, Purpose::Judge, plant) >> 1;
            let controller = &mut PredictiveGreedy::new(rule, &task, &trial.layout);
            let track = trial.grow(bean, controller, &task, &mut unwatched);
            let crossings = task.crossings(&track);
            for height_cm in HEIGHTS_CM {
                let Some(at) = track.samples.iter().position(|sample| sample.tip.y >= height_cm) else {
                    continue;
                };
                let past = &track.samples[..=at];
                let targets = outlook(&task, past, &futures(&model, rule, &task, past, plant));
                for (number, target) in targets.iter().enumerate().filter(|(_, one)| one.passed_cm.is_none())
                {
                    said.push((target.probability, Crossing::is_visit(crossings[number]), number, at));
                }
            }
        }
    }
    println!("said          mean   came true (95 %)        cases");
    for bounds in CLASSES.windows(2) {
        let (least, most) = (bounds[0], bounds[1]);
        let class: Vec<_> = said.iter().filter(|(said, ..)| (least..most).contains(said)).collect();
        let came = class.iter().filter(|(_, came, ..)| *came).count() as f64;
        let [low, high] = wilson_interval(came, class.len() as f64);
        println!(
            "{least:.1} to {:.1}  {:>8.2}   {:.2} ({low:.2} to {high:.2})  {:>8}",
            most.min(1.0),
            mean(class.iter().map(|(said, ..)| *said)),
            came / class.len() as f64,
            class.len()
        );
    }
    for number in 0..task.targets.len() {
        let first: Vec<_> = said.iter().filter(|(_, _, target, at)| *target == number && *at == 0).collect();
        println!(
            "target {} from the seedling: said {:.2}, came true {:.2} of {}",
            number + 1,
            mean(first.iter().map(|(said, ..)| *said)),
            mean(first.iter().map(|(_, came, ..)| f64::from(u8::from(*came)))),
            first.len()
        );
    }
    Ok(())
}
