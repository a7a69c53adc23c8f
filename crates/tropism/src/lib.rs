//! Steers living plants with light: the whole loop of Wahby et al. 2016 as a library.
//!
//! A bean stands between lamps and a camera. Photographs give the path of its tip ([`vision`], [`track`]). Paths give a
//! model of how the tip moves ([`plant`]). Evolution on the model ([`evolve`]) gives a small network that decides which
//! lamp is lit ([`control`]). The network steers an unseen plant through targets ([`task`]), in a real tent ([`rig`]) or
//! in the virtual one of the crate `tropism-bean`.
//!
//! # A tour
//!
//! Tracks become a model, evolution on the model makes networks, and the champion steers a simulated plant:
//!
//! ```
//! use std::ops::ControlFlow;
//! use tropism::prelude::*;
//!
//! let measured = "tip_x_cm,tip_y_cm,light\n0,4,left\n-0.1,4.03,right\n0,4.06,right\n0.1,4.1,dark\n";
//! let model = TipModel::fit([&Track::read_csv(measured.as_bytes())?], TipModelConfig::default())?;
//!
//! let task = Task { max_steps: 40, ..Task::default() }; // the paper's three targets, a short experiment
//! let config = EvolutionConfig { runs: 2, generations: 5, ..EvolutionConfig::default() };
//! let evolution = Evolution::new(&model, &task, config, 1)?; // seed 1
//! let runs = evolution.evolve(&|_run, _generation| ControlFlow::Continue(()))?.expect("never broken off");
//! let choice = evolution.choose(&runs, std::slice::from_ref(&model), 20);
//!
//! let (genome, _fitness) = runs[choice.run].champion().expect("at least one generation");
//! let mut controller = NetworkController::of_tip(genome)?;
//! let track = simulate(&model, &mut controller, &task, 7); // seed 7
//! println!("fitness {}", task.fitness_in_words(task.fitness(&track)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What to implement
//!
//! | for | implement |
//! |---|---|
//! | a plant model of your own | [`plant::PlantModel`], and [`simulation::BatchModel`] to evolve on it |
//! | a task | [`task::Score`], the score of a [`task::Task`] |
//! | a controller | [`control::Controller`] |
//! | other inputs of the network | choose from [`control::Sensors`] |
//! | a camera, lamps, a flash | the traits of [`rig`] |
//!
//! # Order
//!
//! The modules stand in the order in which data flows, and each uses only those above it. The library never prints, reads
//! no clock, no disk and no environment, and draws every random number from a seed: the same seed gives the same bits for
//! any number of threads. It builds for `wasm32-unknown-unknown` without the default feature `rayon`.
//!
//! # References
//! Wahby, Hofstadler, Heinrich, Zahadat and Hamann 2016: *An Evolutionary Robotics Approach to the Control of Plant Growth
//! and Motion*, doi:10.1109/SASO.2016.8. `docs/explanation/paper.md` maps its equations, table and figures to this code.

pub mod check;
pub mod text;
mod file;
pub mod math;
pub mod simd;
pub mod random;
mod cma_es;

pub mod lamps;
pub mod lighting;
pub mod programme;
pub mod geometry;
pub mod obstacle;
pub mod photo;
pub mod observation;
pub mod track;
pub mod vision;
pub mod plant;
pub mod task;
pub mod control;
pub mod environment;
pub mod nodes;
pub mod simulation;
pub mod rig;
pub mod measure;
pub mod evolve;
pub mod prelude;

pub use cma_es::CmaEs;
pub use control::{Controller, Sensors};
pub use environment::Environment;
pub use evolve::{Champion, Evolution};
pub use geometry::Point;
pub use lamps::{Layout, Light};
pub use lighting::Lighting;
pub use observation::Observation;
pub use plant::PlantModel;
pub use simulation::simulate;
pub use task::{Score, Task};
pub use track::Track;
pub use tropism_neat::parallel;
