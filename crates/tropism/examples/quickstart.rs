//! Tracks become a model, evolution makes a controller, and the controller steers a simulated plant.
//!
//! `cargo run --release -p tropism --example quickstart`
//!
//! The plants are virtual: two beans under lamps that switch every six hours, without photographs.

use std::error::Error;
use std::ops::ControlFlow;

use tropism::prelude::*;
use tropism_bean::{Species, grow};

fn main() -> Result<(), Box<dyn Error>> {
    // Fit: open-loop experiments (section 2.2.1) give tracks, tracks give the tip-motion model (section 2.2.3).
    let open_loop = Task::open_loop(600);
    let tracks = [1, 2].map(|seed| {
        let mut controller = Periodic::new(72, &Layout::default());
        grow(&Species::default(), seed, 1.0, &mut controller, &open_loop, &mut unwatched)
    });
    let model = TipModel::fit(&tracks, TipModelConfig::default())?;

    // Evolve: NEAT with Table 1, for the paper's three targets and eq. (9).
    let task = Task::default();
    let config = EvolutionConfig { runs: 2, generations: 60, ..EvolutionConfig::default() };
    let evolution = Evolution::new(&model, &task, config, 1)?;
    let runs = evolution.evolve(&|_run, _generation| ControlFlow::Continue(()))?.expect("never broken off");
    let choice = evolution.choose(&runs, &model.of_each_plant(40)?, 50);
    let (genome, fitness) = runs[choice.run].champion().expect("a run of 60 generations");
    println!("best fitness in evolution: {}", task.fitness_in_words(fitness));
    println!("expected on unseen plants: {:.2} cm", choice.trials[choice.run].mean);

    // Simulate: the champion steers a plant of the model.
    let track = simulate(&model, &mut NetworkController::of_tip(genome)?, &task, 7);
    println!(
        "on a fresh simulated plant: {:.2} cm in {} steps",
        task.fitness(&track),
        track.samples.len() - 1
    );
    for (target, crossing) in task.targets.iter().zip(task.crossings(&track)) {
        let passed =
            crossing.map_or("not reached".to_owned(), |at| format!("passed at {:.1} cm", at.distance_cm));
        println!("target ({}, {}): {passed}", target.x, target.y);
    }
    Ok(())
}
