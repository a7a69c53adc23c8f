//! Workflows of tropism, with what they keep on the disk.
//!
//! Everything that a user does is a [`Workflow`]: a plan goes in, results come out, a [`Monitor`] listens and may ask for an
//! end. Plans and results are data, so that a command, a page and a notebook that do the same thing exchange the same JSON.
//! This library never prints and reads no arguments and no environment variables; paths stand in the plans.
//!
//! | plan | results |
//! |---|---|
//! | [`RunPlan`] | an experiment in a real or virtual tent, in a run folder |
//! | [`StatusPlan`](status::StatusPlan), [`StopPlan`](stop::StopPlan), [`SafeStatePlan`](safe_state::SafeStatePlan) | a run looked after: how it goes, its end, its light off |
//! | [`ExportPlan`](export::ExportPlan), [`TimelapsePlan`](timelapse::TimelapsePlan) | a run for others: an archive, a film |
//! | [`NotePlan`](note::NotePlan) | what a person writes down of a run |
//! | [`LampPlan`](by_hand::LampPlan), [`PhotoPlan`](by_hand::PhotoPlan) | devices by hand: a lamp for a time, a photograph now |
//! | [`CheckPlan`](check::CheckPlan) | what is wrong with a rig before a plant depends on it |
//! | [`MakeRigPlan`](make_rig::MakeRigPlan) | a rig file from what somebody has |
//! | [`CalibrateCameraPlan`](calibrate_camera::CalibrateCameraPlan) | the calibration of a camera |
//! | [`TrackPlan`](track::TrackPlan), [`DepthPlan`](depth::DepthPlan) | tracks of photographs, in the plane and in space |
//! | [`FitPlan`](fit::FitPlan) | a model of tracks |
//! | [`MeasurePlan`](measure::MeasurePlan) | the constants of plants from their stems |
//! | [`ForecastPlan`](forecast::ForecastPlan) | models compared by what they predict of plants that were left out |
//! | [`EvolvePlan`](evolve::EvolvePlan), [`BaselinePlan`](baseline::BaselinePlan) | champions, and the fitness of random controllers |
//! | [`TunePlan`](tune::TunePlan) | a rule with nine parameters for a model |
//! | [`SimulatePlan`](simulate::SimulatePlan), [`ScorePlan`](score::ScorePlan), [`ShowPlan`](show::ShowPlan) | a controller on the model, the fitness of tracks, a network and its decisions |
//! | [`GrowPlan`](grow::GrowPlan), [`CalibratePlan`](calibrate::CalibratePlan) | virtual beans, and their parameters from tracks |
//! | [`TransferPlan`](transfer::TransferPlan) | controllers compared on the same unseen virtual plants |
//! | [`WallPlan`](wall::WallPlan) | virtual plants before a wall of nodes that steer together |
//! | [`SweepPlan`](sweep::SweepPlan) | seeds times settings of evolutions or of studies of replicates, in one table |
//! | [`StudyPlan`](study::StudyPlan), [`ReportPlan`](report::ReportPlan) | the whole paper, and pages of figures |
//!
//! Below them: [`files`] and [`Checkpoint`] on the disk, the [`Journal`] of a [`RunFolder`], and the [`Recorder`], which
//! records each step of a rig and replays them after an interruption. Modules stand in the order in which they use each
//! other: each uses only those above it.

pub mod files;
pub mod units;
mod difference;
mod checkpoint;
mod journal;
mod lock;
mod folder;
mod notes;
pub mod tags;
mod light_day;
mod recorder;
mod error;
pub mod monitor;
pub mod workflow;
pub mod work;
mod reach;
pub mod model;
pub mod controller;
mod sequences;
pub mod watchdog;
pub mod run;
pub mod task;
pub mod stop;
pub mod safe_state;
pub mod note;
pub mod by_hand;
pub mod export;
pub mod timelapse;
pub mod check;
pub mod make_rig;
pub mod calibrate_camera;
pub mod track;
pub mod depth;
mod stopwatch;
mod statistics;
pub mod comparison;
mod champion;
pub mod fit;
pub mod measure;
pub mod evolve;
pub mod baseline;
pub mod tune;
pub mod simulate;
pub mod score;
pub mod show;
pub mod grow;
pub mod calibrate;
pub mod forecast;
mod finished_run;
mod figures;
pub mod transfer;
pub mod wall;
pub mod replicates;
pub mod study;
pub mod sweep;
pub mod status;
pub mod report;

pub use checkpoint::{Checkpoint, Loaded};
pub use controller::ControllerSpec;
pub use error::Error;
pub use folder::{FolderError, PhotoFolder, RunFolder, has_journal, read_journal};
pub use journal::{Downtime, Journal, JournalError, ProgrammeRecord, SideRecord, StepRecord};
pub use light_day::{LightLimits, LightOfDay};
pub use lock::{FolderLock, LockError, holder, lock};
pub use monitor::{Monitor, Part, Silent};
pub use recorder::{RecordError, Recorder, Supervision};
pub use run::{RunConfig, RunPlan, RunResults};
pub use work::Work;
pub use workflow::Workflow;

/// The example of the README, tested as documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
