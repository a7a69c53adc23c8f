//! Workflows of tropism, and what they keep on the disk.
//!
//! A workflow is a plan that is executed ([`Workflow`]): data go in, results come out, and a [`Monitor`] hears of progress and
//! may ask for an end. A command, a page and a notebook that do the same thing execute the same plan.
//!
//! | plan | results |
//! |---|---|
//! | [`RunPlan`] | an experiment in a real or virtual tent, in a run folder |
//! | [`CalibrateCameraPlan`](calibrate_camera::CalibrateCameraPlan) | the calibration of a camera |
//! | [`TrackPlan`](track::TrackPlan), [`DepthPlan`](depth::DepthPlan) | tracks of photographs, in the plane and in space |
//! | [`FitPlan`](fit::FitPlan) | the tip-motion model of tracks |
//! | [`EvolvePlan`](evolve::EvolvePlan), [`BaselinePlan`](baseline::BaselinePlan) | champions, and the fitness of random controllers |
//! | [`SimulatePlan`](simulate::SimulatePlan), [`ScorePlan`](score::ScorePlan), [`ShowPlan`](show::ShowPlan) | a controller on the model, the fitness of tracks, a network and its decisions |
//! | [`GrowPlan`](grow::GrowPlan), [`CalibratePlan`](calibrate::CalibratePlan) | virtual beans, and their parameters from tracks |
//! | [`StudyPlan`](study::StudyPlan), [`ReportPlan`](report::ReportPlan) | the whole paper, and pages of figures |
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
mod statistics;
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
mod finished_run;
mod figures;
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
