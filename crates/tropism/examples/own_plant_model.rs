//! A plant model of one's own, and evolution on it: implement [`PlantModel`], then `impl BatchModel for ... {}`.
//!
//! `cargo run --release -p tropism --example own_plant_model`
//!
//! The model here leans towards the lit lamp with inertia, and individuals differ in how strongly they respond.

use std::error::Error;
use std::ops::ControlFlow;

use tropism::prelude::*;

/// A tip with inertia between two lamps.
struct Inertia {
    layout: Layout,
    /// Growth of a step, in cm.
    growth_cm: f64,
}

/// One plant: what changes from step to step.
#[derive(Clone)]
struct Leaning {
    tip: Point,
    /// Speed to the right, in cm a step.
    speed: f64,
    /// How strongly this individual responds.
    gain: f64,
}

impl PlantModel for Inertia {
    type Plant = Leaning;

    fn seedling(&self, start: Point, noise: &mut StepNoise) -> Leaning {
        Leaning { tip: start, speed: 0.0, gain: 1.0 + 0.2 * noise.normal() }
    }

    fn step(&self, plant: &mut Leaning, light: Light, noise: &mut StepNoise) {
        let pull = plant.gain * self.layout.side(light) - 0.1 * plant.tip.x;
        plant.speed = 0.9 * plant.speed + 0.01 * pull + 0.005 * noise.normal();
        plant.tip.x += plant.speed;
        plant.tip.y += self.growth_cm * (1.0 + 0.3 * noise.normal());
    }

    fn observe(&self, plant: &Leaning) -> Observation {
        Observation::simulated(plant.tip)
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }
}

// Evolution scores this model one plant after the other; a faster path would override `BatchModel::score`.
impl BatchModel for Inertia {}

fn main() -> Result<(), Box<dyn Error>> {
    let model = Inertia { layout: Layout::wahby2016(), growth_cm: 0.03 };
    let task = Task {
        targets: vec![Point::new(2.0, 6.0), Point::new(-2.0, 9.0)],
        end_height_cm: 9.5,
        ..Task::default()
    };
    // The network sees where the next target is and how the tip moves, instead of the place of the tip.
    let sensors = Sensors::new(vec![Sensor::ToTarget { ahead: 0 }, Sensor::LastShift])?;
    let config =
        EvolutionConfig { runs: 2, generations: 60, episodes: 4, sensors, ..EvolutionConfig::default() };
    let evolution = Evolution::new(&model, &task, config, 1)?;
    let runs = evolution.evolve(&|_run, _generation| ControlFlow::Continue(()))?.expect("never broken off");
    let choice = evolution.choose(&runs, std::slice::from_ref(&model), 100);
    println!("evolved: {} on unseen plants", task.fitness_in_words(choice.trials[choice.run].mean));

    let mut greedy = Greedy::new(&task, model.layout());
    let fitness: Vec<f64> =
        (0..100).map(|seed| task.fitness(&simulate(&model, &mut greedy, &task, seed))).collect();
    println!("greedy:  {:.2} cm", fitness.iter().sum::<f64>() / fitness.len() as f64);
    Ok(())
}
