//! Workflows of tropism and what they keep on the disk.
//!
//! A run folder holds `run.toml` (configuration, seed and version), `journal.sqlite` (one row a step, one an event),
//! `photographs/`, and `track.csv` when the run is over. [`Recorded`] wraps a rig so that the loop itself need not know: it
//! writes down each step in the order photograph, decision, action, bears what goes wrong as far as [`FaultPolicy`] goes,
//! tells a [`RunMonitor`] of it, and after an interruption plays the journal back to the controller before the loop goes on.
//!
//! [`FaultPolicy`]: tropism::rig::FaultPolicy
//! [`RunMonitor`]: tropism::rig::RunMonitor

pub mod files;
mod checkpoint;
mod copy;
mod journal;
mod folder;
mod gap;
mod recorded;
mod error;
pub mod monitor;
pub mod workflow;
pub mod controller;
pub mod run;
pub mod calibrate_camera;
pub mod track;
pub mod depth;
mod stopwatch;
mod model;
mod champion;
pub mod fit;
pub mod evolve;
pub mod baseline;
pub mod simulate;
pub mod score;
pub mod show;
pub mod grow;
pub mod calibrate;
pub mod study;
pub mod report;

pub use controller::ControllerSpec;
pub use error::Error;
pub use monitor::{Monitor, Part, Silent};
pub use run::{RunConfig, RunPlan, RunResults};
pub use workflow::Workflow;

pub use checkpoint::{Checkpoint, Loaded};
pub use folder::{FolderError, RunFolder, holder, lock};
pub use gap::Gap;
pub use journal::{Journal, JournalError, Row};
pub use recorded::{RecordError, Recorded, Supervision};
