//! The replay of recorded steps, until the run is where the interruption left it.

use tropism::lamps::Light;
use tropism::photo::Photo;
use tropism::rig::{Camera, Clock, EventKind, Flash, Lamps, OnFault, Shot};
use tropism::vision::{FrameStatus, TipTracker};

use super::lamps::Command;
use super::{RecordError, Recorder};
use crate::journal::StepRecord;

/// The recorded steps of a run, and how far the loop has come.
#[derive(Debug)]
pub(super) struct Replay {
    steps: Vec<StepRecord>,
    /// How many steps were replayed or observed since.
    position: usize,
    /// Steps whose photographs the tip tracker needs: those up to `references` for its reference picture, and those from
    /// `memory` on, the latest in which the plant was detected.
    references: usize,
    memory: usize,
}

impl Replay {
    pub(super) fn new(steps: Vec<StepRecord>, memory_frames: usize) -> Self {
        let is_picture = |step: &StepRecord| {
            ![FrameStatus::Corrupt, FrameStatus::Foreign, FrameStatus::Repeated].contains(&step.seen.status)
        };
        let mut pictures = (0..steps.len()).filter(|&index| is_picture(&steps[index]));
        let references = pictures.nth(TipTracker::REFERENCE_FRAMES - 1).unwrap_or(steps.len());
        let mut measured = (0..steps.len()).rev().filter(|&index| steps[index].seen.is_measured());
        let memory = measured.nth(memory_frames - 1).unwrap_or(0);
        Self { steps, position: 0, references, memory }
    }

    /// How many steps were recorded before.
    pub(super) const fn len(&self) -> usize {
        self.steps.len()
    }

    /// The steps that were recorded before.
    pub(super) fn steps(&self) -> &[StepRecord] {
        &self.steps
    }

    /// The step that is replayed next; `None` if all are replayed.
    pub(super) fn next(&self) -> Option<&StepRecord> {
        self.steps.get(self.position)
    }

    /// Counts a step that was replayed or observed.
    pub(super) const fn advance(&mut self) {
        self.position += 1;
    }

    /// Whether any step was replayed or observed.
    pub(super) const fn has_begun(&self) -> bool {
        self.position > 0
    }

    /// The step that was replayed last, with its index; `None` if it was observed.
    fn latest(&self) -> Option<(usize, &StepRecord)> {
        let index = self.position.checked_sub(1)?;
        Some((index, self.steps.get(index)?))
    }
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Recorder<'_, C, L, F, K> {
    /// Replays the latest step with its recorded decision. Returns false if the lamps must be told, as the step is the last
    /// recorded one or was not recorded before.
    ///
    /// # Errors
    /// [`RecordError::Diverged`] if `light`, which the controller decides now, is not the recorded decision.
    pub(super) fn replay_decided(&mut self, light: Light) -> Result<bool, RecordError> {
        let Some((index, &StepRecord { step, decided, .. })) = self.replay.latest() else { return Ok(false) };
        if let Some(found) = decided.filter(|&found| found != light) {
            return Err(RecordError::Diverged { step, found, wanted: light });
        }
        let shot = self.recorded_shot(index)?;
        let Some(next) = self.replay.next().map(|next| next.step) else {
            // Whether or not its lamp was lit: what happened to the lamps since is unknown, so they are told again.
            self.rig.restore(step, &shot);
            return Ok(false);
        };
        self.command = Some(Command { step, light });
        self.rig.replay(step, &shot, Some(light), next);
        Ok(true)
    }

    /// Replays the latest step, at which nothing was decided.
    pub(super) fn replay_undecided(&mut self) -> Result<(), RecordError> {
        let Some((index, &StepRecord { step, .. })) = self.replay.latest() else { return Ok(()) };
        let shot = self.recorded_shot(index)?;
        let Some(next) = self.replay.next().map(|next| next.step) else {
            self.rig.restore(step, &shot);
            return self.rest();
        };
        if self.supervision.policy.on_fault == OnFault::Dark {
            self.command = None;
        }
        self.rig.replay(step, &shot, self.command.map(|command| command.light), next);
        Ok(())
    }

    /// What was seen at a recorded step, with the photograph if the tip tracker needs it.
    fn recorded_shot(&mut self, index: usize) -> Result<Shot, RecordError> {
        let record = self.replay.steps[index].clone();
        let empty = Photo { name: record.photo.clone(), bytes: Vec::new(), time_s: record.time_s };
        let is_needed = index <= self.replay.references || index >= self.replay.memory;
        let photo = match is_needed.then(|| self.folder.read_photo(&record)) {
            None => empty,
            Some(Ok(photo)) => photo,
            Some(Err(error)) => {
                self.report(EventKind::Damaged, format!("{error}; going on without it"))?;
                empty
            }
        };
        Ok(Shot { photo, seen: record.seen })
    }
}
