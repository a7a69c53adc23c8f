//! A task of one's own: implement [`Score`], and evolution, simulation and figures take it.
//!
//! `cargo run --release -p tropism --example own_task`
//!
//! The task here is to keep the tip within 1 cm of the vertical until it is 10 cm high.

use std::error::Error;
use std::ops::ControlFlow;

use tropism::prelude::*;
use tropism_bean::{Species, grow};

/// Grow upright: each step beyond 1 cm from the vertical costs the distance beyond it, in cm.
#[derive(Debug)]
struct Upright;

impl Score for Upright {
    fn step_fitness(&self, _task: &Task, _past: &Past, after: &Observation) -> f64 {
        -(after.tip.x.abs() - 1.0).max(0.0)
    }

    fn best(&self, _task: &Task, _first: &Observation) -> Option<f64> {
        Some(0.0)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut periodic = Periodic::new(72, &Layout::default());
    let open_loop = Task::open_loop(600);
    let track = grow(&Species::default(), 1, 1.0, &mut periodic, &open_loop, &mut unwatched); // a virtual bean
    let model = TipModel::fit([&track], TipModelConfig::default())?;

    let config = EvolutionConfig { runs: 2, generations: 40, ..EvolutionConfig::default() };
    let task = Task { end_height_cm: 10.0, max_steps: 600, ..Task::new(Upright) };
    let evolution = Evolution::new(&model, &task, config, 1)?;
    let runs = evolution.evolve(&|_run, _generation| ControlFlow::Continue(()))?.expect("never broken off");
    let (genome, fitness) = runs[0].champion().expect("a run of 40 generations");
    println!("best fitness: {}", task.fitness_in_words(fitness));
    let track = simulate(&model, &mut NetworkController::of_tip(genome)?, &task, 3);
    let farthest = track.samples.iter().map(|sample| sample.tip.x.abs()).fold(0.0, f64::max);
    println!("farthest from the vertical on a fresh simulated plant: {farthest:.2} cm");
    Ok(())
}
