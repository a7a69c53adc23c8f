//! Steers living plants with light: the whole loop of Wahby et al. 2016 as a library.
//!
//! A bean stands between two lamps and a camera. Photographs give the path of its tip ([`vision`], [`track`]); paths give
//! a model of how the tip moves ([`plant`]); evolution on the model ([`evolve`]) gives a small network that decides which
//! lamp is lit ([`control`]); the network steers a plant through targets ([`task`]) that it never met, in a tent
//! ([`rig`]) or in the virtual one ([`greenhouse`]).
//!
//! The modules stand in the order in which data flows, and each uses only those above it. The library never prints,
//! reads no clock and no environment, and draws every random number from a seed; [`experiment`] alone touches the disk.
//!
//! ```
//! use tropism::control::chase::Chase;
//! use tropism::plant::tip::{TipModel, TipModelConfig};
//! use tropism::random::{Draws, Purpose};
//! use tropism::simulation::simulate;
//! use tropism::task::Task;
//! use tropism::track::Track;
//!
//! let measured = "tip_x_cm,tip_y_cm,light\n0,4,left\n-0.1,4.03,right\n0,4.06,right\n0.1,4.1,dark\n";
//! let track = Track::read_csv(measured.as_bytes())?;
//! let model = TipModel::fit([&track], TipModelConfig::default())?;
//! let task = Task { max_steps: 20, ..Task::default() };
//! let mut controller = Chase::new(task.targets.clone());
//! let simulated = simulate(&model, &mut controller, &task, Draws::new(1, Purpose::Trial, [0; 3]));
//! assert!(task.fitness(&simulated) > 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # References
//! Wahby, Hofstadler, Heinrich, Zahadat and Hamann 2016: *An Evolutionary Robotics Approach to the Control of Plant Growth
//! and Motion*, doi:10.1109/SASO.2016.8. `docs/paper.md` maps its equations, table and figures to this code.

pub mod check;
pub mod math;
pub mod random;
mod wide;

pub mod light;
pub mod geometry;
pub mod photo;
pub mod observation;
pub mod track;
pub mod vision;
pub mod plant;
pub mod task;
pub mod control;
pub mod environment;
pub mod simulation;
pub mod rig;
pub mod greenhouse;
pub mod evolve;
pub mod experiment;
pub mod report;
