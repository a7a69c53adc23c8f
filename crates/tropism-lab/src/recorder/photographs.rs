//! The photograph of a step: waiting for it, missing it, taking it, keeping it.

use std::time::Duration;

use tropism::photo::Photo;
use tropism::rig::{Camera, Clock, EventKind, Flash, Lamps, Moment};
use tropism::vision::Frame;

use super::lamps::RETRY_AFTER;
use super::{DISK_FULL, RecordError, Recorder};
use crate::folder::PhotoFolder;
use crate::notes;

/// How soon a run in a real tent writes a note down; chosen: who left it waits to see it.
const NOTES_PAUSE: Duration = Duration::from_secs(2);

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Recorder<'_, C, L, F, K> {
    /// Takes the photograph of the next step, and reports when it was begun. If the camera fails, an empty photograph stands
    /// in for as long as the last tip may be carried forward; then steps are missed.
    pub(super) fn photograph(&mut self) -> Result<(Frame, Option<Moment>), RecordError> {
        // The journal may hold steps after the last recorded one: they are missed once.
        if let Some(missed) = self.last_missed.take().filter(|&missed| missed >= self.rig.next_step()) {
            self.rig.skip_to(missed + 1);
        }
        loop {
            self.wait()?;
            if self.miss_overdue_steps()? {
                continue;
            }
            let begun = self.rig.clock().now();
            let step = self.rig.next_step();
            if step >= self.supervision.last_step && self.replay.has_begun() && self.overdue(step).is_some() {
                let text = "the end of the run passed meanwhile; the last detection stands in";
                self.report_at(step, EventKind::Camera, text.to_owned())?;
                return Ok((self.rig.no_photograph(), begun));
            }
            let error = match self.rig.photograph() {
                Ok(frame) => return Ok((self.retake_if_dark(frame)?, begun)),
                // At the first step there is no earlier tip that could be carried forward.
                Err(error) if !self.replay.has_begun() => return Err(error.into()),
                Err(error) => error,
            };
            self.health.streaks.camera += 1;
            if !self.is_undecidable(step) {
                self.report_at(step, EventKind::Camera, format!("{error}; the last detection stands in"))?;
                return Ok((self.rig.no_photograph(), begun));
            }
            self.miss(step + 1, &error.to_string())?;
            self.rest()?;
            self.health.streaks.carried_forward += 1;
            self.check_carried_forward()?;
        }
    }

    /// Waits until the next step is due. Lamps that failed are switched again meanwhile, and notes are written down.
    fn wait(&mut self) -> Result<(), RecordError> {
        let due = self.rig.due(self.rig.next_step());
        loop {
            self.take_notes();
            let is_failing = self.command.is_some() && !self.is_confirmed;
            let pause = if is_failing { RETRY_AFTER } else { NOTES_PAUSE };
            let until = match self.rig.clock().now() {
                Some(now) => due.min(now.since_start + pause),
                None => due,
            };
            let monitor = &mut self.supervision.monitor;
            if monitor.heartbeat().is_break()
                || self.rig.wait_until(until, &mut || monitor.heartbeat()).is_break()
            {
                self.report(EventKind::Stopped, "asked to end".to_owned())?;
                return Err(RecordError::Stopped);
            }
            if until == due {
                return Ok(());
            }
            if is_failing {
                // The failure itself was reported at its step.
                self.act()?;
            }
        }
    }

    /// Writes down the notes that people left. A disk that is full keeps them where they are.
    fn take_notes(&mut self) {
        for event in notes::take(self.folder.path(), self.folder.journal()).unwrap_or_default() {
            self.supervision.monitor.event(&event);
        }
    }

    /// Misses the steps that would begin too late. Returns whether there were any.
    fn miss_overdue_steps(&mut self) -> Result<bool, RecordError> {
        let (step, last) = (self.rig.next_step(), self.supervision.last_step);
        let late_s = self.most_late_s();
        if let Some(by_s) = self.overdue(step) {
            if step >= last {
                return Ok(false);
            }
            let next = ((self.rig.due(step).as_secs_f64() + by_s - late_s) / self.period_s()).ceil() as u32;
            let reason = format!("step {step} would be {by_s:.0} s late, more than {late_s}");
            self.miss(next.max(step + 1).min(last), &reason)?;
            return Ok(true);
        }
        let by_s = self.late_by_s(step).filter(|by_s| *by_s > late_s / 2.0);
        if let Some(by_s) = by_s {
            self.report_at(step, EventKind::Late, format!("step {step} begins {by_s:.0} s late"))?;
        }
        Ok(false)
    }

    fn period_s(&self) -> f64 {
        self.rig.due(1).as_secs_f64()
    }

    /// Seconds by which a step may begin late. At most one photograph in a period, however short it is, unless no step is ever
    /// too late.
    fn most_late_s(&self) -> f64 {
        let wanted_s = self.supervision.policy.late_s;
        if wanted_s.is_finite() { wanted_s.min(self.period_s()) } else { wanted_s }
    }

    /// Seconds by which `step` would begin late now; `None` of a tent without a clock.
    fn late_by_s(&self, step: u32) -> Option<f64> {
        Some(self.rig.clock().now()?.since_start.as_secs_f64() - self.rig.due(step).as_secs_f64())
    }

    /// The same where that is too late.
    fn overdue(&self, step: u32) -> Option<f64> {
        self.late_by_s(step).filter(|by_s| *by_s > self.most_late_s())
    }

    /// Misses the steps before `next`. The event is of the last of them: a run that is resumed goes on after it.
    fn miss(&mut self, next: u32, reason: &str) -> Result<(), RecordError> {
        let (first, last) = (self.rig.next_step(), next - 1);
        self.rig.skip_to(next);
        let steps = if first == last { format!("step {first}") } else { format!("steps {first} to {last}") };
        let text = format!("{steps} without a photograph and a decision: {reason}");
        self.report_at(last, EventKind::Missed, text)
    }

    /// Takes a dark photograph again, as often as the policy allows.
    fn retake_if_dark(&mut self, mut frame: Frame) -> Result<Frame, RecordError> {
        for _ in 1..self.supervision.policy.flash_tries {
            let Some(again) = self.rig.photograph_again(&frame) else { break };
            let outcome = match &again {
                Ok(again) if self.rig.tracker().is_dark(again) => "dark again: is the flash dead?".to_owned(),
                Ok(_) => "bright".to_owned(),
                Err(error) => error.to_string(),
            };
            let name = &frame.photo().name;
            let text = format!("{name} was dark, and was taken again: {outcome}");
            self.report_at(self.rig.next_step(), EventKind::Dark, text)?;
            frame = again.unwrap_or(frame);
        }
        Ok(frame)
    }

    /// Writes a photograph, if the disk has room for it beside what the journal needs.
    pub(super) fn keep_photo(&mut self, view: PhotoFolder, photo: &Photo) -> Result<(), RecordError> {
        if self.is_disk_full {
            // Room for eight photographs beside the reserve; chosen by hand.
            let reserve = u64::from(self.supervision.policy.reserve_mb) << 20;
            let needed = 8 * photo.bytes.len() as u64 + reserve;
            if self.folder.free_bytes().is_none_or(|free| free < needed) {
                return Ok(());
            }
            self.is_disk_full = false;
            self.fill_reserve()?;
        }
        match self.folder.write_photo(view, &photo.name, &photo.bytes) {
            Err(error) if error.is_disk_full() => {
                self.is_disk_full = true;
                self.folder.release_reserve();
                self.report(EventKind::Disk, format!("{error}; {DISK_FULL}"))
            }
            done => Ok(done?),
        }
    }
}
