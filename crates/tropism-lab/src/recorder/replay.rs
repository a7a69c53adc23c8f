//! The replay of recorded steps, until the run is where the interruption left it.

use tropism::lighting::Lighting;
use tropism::photo::Photo;
use tropism::rig::{Camera, Clock, EventKind, Flash, Lamps, OnFault, Shot, SideShot};
use tropism::vision::{FrameStatus, TipTracker, TrackedFrame};

use super::lamps::Command;
use super::{RecordError, Recorder};
use crate::files::FileError;
use crate::journal::StepRecord;

/// The recorded steps of a run, and how far the loop has come.
#[derive(Debug)]
pub(super) struct Replay {
    steps: Vec<StepRecord>,
    /// How many steps were replayed or observed since.
    position: usize,
    /// Photographs that the tip tracker of each camera needs.
    front: Needed,
    side: Needed,
}

/// Photographs that a tip tracker needs to go on: those up to the step `references` for its reference picture, and those from
/// `memory` on, the latest in which the plant was detected.
#[derive(Debug)]
struct Needed {
    references: usize,
    memory: usize,
}

impl Needed {
    /// Of a tracker that remembers `memory_frames` photographs and has `seen` these.
    fn of(seen: &[Option<&TrackedFrame>], memory_frames: usize) -> Self {
        let is_picture = |seen: &TrackedFrame| {
            ![FrameStatus::Corrupt, FrameStatus::Foreign, FrameStatus::Repeated].contains(&seen.status)
        };
        let mut pictures = (0..seen.len()).filter(|&index| seen[index].is_some_and(is_picture));
        let references = pictures.nth(TipTracker::REFERENCE_FRAMES - 1).unwrap_or(seen.len());
        let mut measured =
            (0..seen.len()).rev().filter(|&index| seen[index].is_some_and(TrackedFrame::is_measured));
        let memory = measured.nth(memory_frames - 1).unwrap_or(0);
        Self { references, memory }
    }

    const fn has(&self, index: usize) -> bool {
        index <= self.references || index >= self.memory
    }
}

impl Replay {
    pub(super) fn new(steps: Vec<StepRecord>, memory_frames: usize) -> Self {
        let front: Vec<_> = steps.iter().map(|step| Some(&step.seen)).collect();
        let side: Vec<_> = steps.iter().map(|step| step.side.as_deref().map(|side| &side.seen)).collect();
        let (front, side) = (Needed::of(&front, memory_frames), Needed::of(&side, memory_frames));
        Self { steps, position: 0, front, side }
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
    /// Replays the latest step with its recorded decision. Returns false if the lamps must be printed, as the step is the last
    /// recorded one or was not recorded before.
    ///
    /// # Errors
    /// [`RecordError::Diverged`] if `lighting`, which the controller decides now, is not the recorded decision.
    pub(super) fn replay_decided(&mut self, lighting: Lighting) -> Result<bool, RecordError> {
        let Some((index, record)) = self.replay.latest() else { return Ok(false) };
        let (step, decided, commanded) = (record.step, record.decided, record.commanded());
        if let Some(found) = decided.filter(|&found| found != lighting) {
            return Err(RecordError::Diverged { step, found, wanted: lighting });
        }
        let shot = self.recorded_shot(index)?;
        let Some(next) = self.replay.next().map(|next| next.step) else {
            // Whether or not its lamp was lit: what happened to the lamps since is unknown, so they are switched again.
            self.rig.restore(step, &shot);
            return Ok(false);
        };
        let command = Command { step, decided: lighting, lighting: commanded.unwrap_or(lighting) };
        self.command = Some(command);
        self.rig.replay(step, &shot, command.lighting, next);
        Ok(true)
    }

    /// Replays the latest step, at which nothing was decided.
    pub(super) fn replay_undecided(&mut self) -> Result<(), RecordError> {
        let Some((index, &StepRecord { step, programme, .. })) = self.replay.latest() else { return Ok(()) };
        let shot = self.recorded_shot(index)?;
        let Some(next) = self.replay.next().map(|next| next.step) else {
            self.rig.restore(step, &shot);
            return self.rest();
        };
        if self.supervision.policy.on_fault == OnFault::Dark {
            self.command = None;
        }
        if let Some((command, programme)) = self.command.as_mut().zip(programme) {
            command.lighting = programme.commanded;
        }
        let lighting = self.command.map_or(Lighting::DARK, |command| command.lighting);
        self.rig.replay(step, &shot, lighting, next);
        Ok(())
    }

    /// What was seen at a recorded step, with the photograph if the tip tracker needs it.
    fn recorded_shot(&mut self, index: usize) -> Result<Shot, RecordError> {
        let record = self.replay.steps[index].clone();
        let empty = Photo { name: record.photo.clone(), bytes: Vec::new(), time_s: record.time_s };
        let front = self.replay.front.has(index).then(|| self.folder.read_photo(&record));
        let side = self.replay.side.has(index).then(|| self.folder.read_side_photo(&record));
        let mut or_empty = |photo: Option<Result<Photo, FileError>>| -> Result<Photo, RecordError> {
            match photo {
                None => Ok(empty.clone()),
                Some(Ok(photo)) => Ok(photo),
                Some(Err(error)) => {
                    self.report(EventKind::Damaged, format!("{error}; going on without it"))?;
                    Ok(empty.clone())
                }
            }
        };
        let front = or_empty(front)?;
        let side_photo = or_empty(side)?;
        let side = record.side.map(|side| SideShot {
            photo: side_photo,
            seen: side.seen,
            observation: side.observation,
        });
        Ok(Shot { photo: front, seen: record.seen, side })
    }
}
