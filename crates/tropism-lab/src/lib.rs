//! Workflows of tropism, with what they keep on the disk.
//!
//! Everything that a user does is a [`Workflow`]: a plan goes in, results come out, a [`Monitor`] listens and may ask for an
//! end. Plans and results are data, so that a command, a page and a notebook that do the same thing exchange the same JSON.
//! This library never prints and reads no arguments and no environment variables; paths stand in the plans.
//!
//! | | |
//! |---|---|
//! | [`files`], [`units`] | files in and out, with errors that name them; sizes and times as text |
//! | [`Checkpoint`] | the state of long work as two files, of which one is always whole |
//! | [`Journal`], [`RunFolder`], [`lock()`] | a run on the disk: each step and event in SQLite, its photographs, its lock |
//! | [`Recorder`] | a rig whose every step is recorded, and replayed after an interruption |
//! | [`Error`], [`Monitor`], [`Workflow`] | the shape of every workflow |
//! | [`ControllerSpec`] | a controller as data |
//! | [`run`] | an experiment: photograph, decision, lamp |
//! | [`status`], [`stop`], [`safe_state`] | looking after a run |
//! | [`export`], [`timelapse`] | a run for others: an archive, a film |
//! | [`check`] | a rig before a plant depends on it |
//! | [`calibrate_camera`], [`track`], [`depth`] | photographs to tracks |
//!
//! Modules stand in the order in which they use each other: each uses only those above it.

pub mod files;
pub mod units;
mod checkpoint;
mod journal;
mod lock;
mod folder;
mod recorder;
mod error;
pub mod monitor;
pub mod workflow;
pub mod controller;
pub mod run;
pub mod status;
pub mod stop;
pub mod safe_state;
pub mod export;
pub mod timelapse;
pub mod check;
pub mod calibrate_camera;
pub mod track;
pub mod depth;

pub use checkpoint::{Checkpoint, Loaded};
pub use controller::ControllerSpec;
pub use error::Error;
pub use folder::{FolderError, RunFolder};
pub use journal::{Downtime, Journal, JournalError, StepRecord};
pub use lock::{LockError, holder, lock};
pub use monitor::{Monitor, Part, Silent};
pub use recorder::{RecordError, Recorder, Supervision};
pub use run::{FinishedRun, RunConfig, RunPlan, RunResults};
pub use workflow::Workflow;

/// The example of the README, tested as documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
