//! A task of one's own: implement [`Task`], and evolution, simulation and figures take it.
//!
//! `cargo run --release -p tropism --example own_task`
//!
//! The task here is to keep the tip within 1 cm of the vertical until it is 10 cm high.

use std::error::Error;
use std::ops::ControlFlow;

use tropism::prelude::*;
use tropism_bean::{Species, grow};

/// Grow upright: each step beyond 1 cm from the vertical costs the distance beyond it, in cm.
struct Upright;

impl Task for Upright {
    fn is_over(&self, step: u32, seen: &Observation) -> bool {
        step >= 600 || seen.tip.y >= 10.0
    }

    fn step_fitness(&self, _first: &Observation, _before: &Observation, after: &Observation) -> f64 {
        -(after.tip.x.abs() - 1.0).max(0.0)
    }

    fn best_fitness(&self) -> Option<f64> {
        Some(0.0)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut periodic = Periodic::new(72, &Layout::default());
    let open_loop = OpenLoop { steps: 600, ..OpenLoop::default() };
    let track = grow(&Species::default(), 1, 1.0, &mut periodic, &open_loop, &mut unwatched); // a virtual bean
    let model = TipModel::fit([&track], TipModelConfig::default())?;

    let config = EvolutionConfig { runs: 2, generations: 40, ..EvolutionConfig::default() };
    let evolution = Evolution::new(&model, &Upright, config, 1)?;
    let runs = evolution.evolve(&|_run, _generation| ControlFlow::Continue(()))?.expect("never broken off");
    let (genome, fitness) = runs[0].champion().expect("a run of 40 generations");
    println!("best fitness: {fitness:.2} of at most 0");
    let track = simulate(&model, &mut NetworkController::of_tip(genome)?, &Upright, 3);
    let farthest = track.samples.iter().map(|sample| sample.tip.x.abs()).fold(0.0, f64::max);
    println!("farthest from the vertical on a fresh simulated plant: {farthest:.2} cm");
    Ok(())
}
