//! What is kept of an experiment: the only module that touches the disk.
//!
//! A run folder holds `run.toml` (configuration, seed and version), `journal.sqlite` (one row a step, one an event),
//! `photographs/`, and `track.csv` when the run is over. [`Recorded`] wraps a rig so that the loop itself need not know: it
//! writes down each step in the order photograph, decision, action, bears what goes wrong as far as [`Patience`] goes,
//! tells a [`Watcher`] of it, and after an interruption plays the journal back to the controller before the loop goes on.

mod checkpoint;
mod copy;
mod event;
pub mod files;
mod folder;
mod gap;
mod journal;
mod patience;
mod recorded;

pub use checkpoint::{Checkpoint, Loaded};
pub use event::{Event, EventKind, Trouble, Unwatched, Watcher};
pub use folder::{FolderError, RunFolder, holder, lock};
pub use gap::Gap;
pub use journal::{Durability, Journal, JournalError, Row};
pub use patience::{LampsInView, OnFault, OnGap, Patience};
pub use recorded::{Care, RecordError, Recorded};
