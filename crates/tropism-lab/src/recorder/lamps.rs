//! Decisions and the lamps: what is commanded, told again until it is confirmed, and lit while nothing is decided.

use std::time::Duration;

use tropism::environment::Environment;
use tropism::lamps::Light;
use tropism::rig::{Camera, Clock, EventKind, Flash, Lamps, OnFault, RigError};

use super::{RecordError, Recorder};

/// How often the lamps are told at a step before the failure is reported; chosen by hand.
const TRIES: usize = 3;

/// How long after a failure the lamps are told again, if the next step is not due before; chosen by hand.
pub(super) const RETRY_AFTER: Duration = Duration::from_secs(30);

/// A decision that the lamps are to obey.
#[derive(Clone, Copy, Debug)]
pub(super) struct Command {
    /// The step of the decision.
    pub(super) step: u32,
    /// The light that was decided.
    pub(super) light: Light,
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Recorder<'_, C, L, F, K> {
    /// The light that was lit when the run was interrupted, by the journal.
    pub(super) fn interrupted_light(&self) -> Option<Light> {
        let steps = self.replay.steps();
        let measured = steps.iter().rfind(|step| step.seen.is_measured()).map(|step| step.step);
        let is_dark = self.supervision.policy.on_fault == OnFault::Dark
            && steps
                .last()
                .is_some_and(|last| last.decided.is_none() && self.is_held_too_long(measured, last.step));
        steps.iter().rev().find_map(|step| step.decided).filter(|_| !is_dark)
    }

    /// Records the decision, then acts on it.
    pub(super) fn decide(&mut self, light: Light) -> Result<(), RecordError> {
        let step = self.step;
        self.write(|journal| journal.record_decision(step, light))?;
        (self.command, self.is_confirmed) = (Some(Command { step, light }), false);
        let mut failure = None;
        for _ in 0..TRIES {
            failure = self.act()?;
            if failure.is_none() {
                return Ok(());
            }
        }
        let Some(error) = failure else { return Ok(()) };
        self.health.streaks.lamp += 1;
        let steps = self.health.streaks.lamp;
        self.report(
            EventKind::Lamp,
            format!("{error}; the command is repeated, {steps} steps in a row so far"),
        )?;
        if steps >= self.supervision.policy.pause_steps {
            return Err(self.pause(format!("no lamp for {steps} steps: {error}")));
        }
        Ok(())
    }

    /// Lights the commanded lamp and records its confirmation. Returns the failure of the lamps, if they failed.
    pub(super) fn act(&mut self) -> Result<Option<RigError>, RecordError> {
        let Some(Command { step, light }) = self.command else { return Ok(None) };
        if let Err(error) = self.rig.light(Some(light)) {
            return Ok(Some(error));
        }
        self.is_confirmed = true;
        self.write(|journal| journal.record_confirmation(step))?;
        if std::mem::take(&mut self.health.streaks.lamp) > 0 {
            let text = format!("{} obeys again", self.rig.layout().name(Some(light)));
            self.report(EventKind::Recovered, text)?;
        }
        Ok(None)
    }

    /// Sets the lamps as they are to be while nothing is decided.
    pub(super) fn rest(&mut self) -> Result<(), RecordError> {
        if self.supervision.policy.on_fault == OnFault::Hold || self.command.take().is_none() {
            return Ok(());
        }
        let text = match self.rig.light(None) {
            Ok(()) => "all lamps are dark while nothing is decided".to_owned(),
            Err(error) => format!("all lamps should be dark while nothing is decided: {error}"),
        };
        self.report(EventKind::Lamp, text)
    }
}
