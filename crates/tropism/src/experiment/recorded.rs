//! A rig whose every step is written down, and taken up again after an interruption.

use super::event::{Event, EventKind, Watcher};
use super::files::{self, FileError};
use super::folder::{FolderError, RunFolder};
use super::journal::{JournalError, Row};
use crate::environment::Environment;
use crate::light::Light;
use crate::observation::Observation;
use crate::rig::{Camera, Clock, Flash, Lamps, Rig, RigError, Shot};

/// A rig with a run folder.
///
/// Each step is recorded in the order in which it happens: the photograph is kept and what was seen is committed, then
/// the decision, then that the lamp was lit. Steps that the folder holds already are played back: the loop and its
/// controller go through them as they did before, without touching the plant, and then go on.
pub struct Recorded<C, L: Lamps, F, K> {
    rig: Rig<C, L, F, K>,
    folder: RunFolder,
    past: Vec<Row>,
    step: usize,
    watcher: Box<dyn Watcher>,
}

/// Why a recorded run cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A photograph that cannot be kept.
    #[error(transparent)]
    File(#[from] FileError),
    /// A step that cannot be written down.
    #[error("journal.sqlite: {0}")]
    Journal(#[from] JournalError),
    /// A watcher asked for an end. The run can be gone on with.
    #[error("the run was asked to end")]
    Stopped,
    /// The controller decides otherwise than it did.
    #[error(
        "step {step}: found the decision {found} in the journal, wanted {wanted}, which the controller decides now"
    )]
    Diverged {
        /// Step.
        step: usize,
        /// The recorded light.
        found: Light,
        /// What the controller says now.
        wanted: Light,
    },
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Recorded<C, L, F, K> {
    /// Records `rig` in `folder`, after playing back what is recorded there. `watcher` hears of all that happens.
    ///
    /// # Errors
    /// [`RecordError::Folder`] if the journal cannot be read.
    pub fn new(
        rig: Rig<C, L, F, K>,
        folder: RunFolder,
        watcher: Box<dyn Watcher>,
    ) -> Result<Self, RecordError> {
        let past = folder.rows()?;
        let mut recorded = Self { rig, folder, past, step: 0, watcher };
        let (kind, text) = match recorded.past.len() {
            0 => (EventKind::Started, "the run begins".to_owned()),
            steps => (EventKind::Resumed, format!("found {steps} steps, going on with the next")),
        };
        recorded.tell(kind, text)?;
        Ok(recorded)
    }

    /// Writes down that something happened, and tells the watcher.
    ///
    /// # Errors
    /// [`RecordError::Journal`] if it cannot be written down; the watcher has been told all the same.
    pub fn tell(&mut self, kind: EventKind, text: String) -> Result<(), RecordError> {
        let step = self.step.max(self.past.len().saturating_sub(1)) as u32;
        let event = Event { step, kind, text, unix_s: None };
        let written = self.folder.journal().happened(&event);
        self.watcher.event(&event);
        Ok(written?)
    }

    /// The run folder.
    pub const fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// How many steps were in the folder before.
    pub const fn resumed_from(&self) -> usize {
        self.past.len()
    }

    fn record(&self, shot: &Shot) -> Result<(), RecordError> {
        let Shot { photo, seen } = shot;
        self.folder.keep_photo(&photo.name, &photo.bytes)?;
        let row = Row {
            step: self.step as u32,
            time_s: photo.time_s,
            photo: photo.name.clone(),
            photo_bytes: photo.bytes.len() as u64,
            photo_sha256: files::sha256(&photo.bytes),
            seen: seen.clone(),
            decided: None,
            is_done: false,
        };
        Ok(self.folder.journal().saw(&row)?)
    }
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Environment for Recorded<C, L, F, K> {
    type Error = RecordError;

    fn observe(&mut self) -> Result<Observation, RecordError> {
        if let Some(observation) = self.past.get(self.step).and_then(|row| row.seen.observation.clone()) {
            return Ok(observation);
        }
        if self.watcher.beat().is_break() {
            self.tell(EventKind::Stopped, "asked to end".to_owned())?;
            return Err(RecordError::Stopped);
        }
        let observation = self.rig.observe()?;
        self.record(self.rig.shot().expect("an observed rig has a shot"))?;
        Ok(observation)
    }

    fn step(&mut self, light: Light) -> Result<(), RecordError> {
        let step = self.step;
        self.step += 1;
        let Some(row) = self.past.get(step) else {
            return self.act(step, light);
        };
        if let Some(found) = row.decided.filter(|&found| found != light) {
            return Err(RecordError::Diverged { step, found, wanted: light });
        }
        let shot = Shot { photo: self.folder.photo(row)?, seen: row.seen.clone() };
        if step + 1 < self.past.len() {
            self.rig.relive(&shot, light);
            return Ok(());
        }
        // The last recorded step: its photograph stands, its decision stands or is the same now, and whether or not the
        // lamp was lit, it is to be lit again: nobody knows what happened to it since.
        self.rig.recall(&shot);
        self.act(step, light)
    }

    fn period_min(&self) -> f64 {
        self.rig.period_min()
    }
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Recorded<C, L, F, K> {
    fn act(&mut self, step: usize, light: Light) -> Result<(), RecordError> {
        self.folder.journal().decided(step as u32, light)?;
        self.rig.step(light)?;
        Ok(self.folder.journal().done(step as u32)?)
    }
}
