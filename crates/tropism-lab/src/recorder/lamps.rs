//! Decisions and the lamps: what becomes of a decision by the programme and the cap of light, commanded again until it is
//! confirmed, and lit while nothing is decided.

use std::time::Duration;

use tropism::environment::Environment;
use tropism::lighting::Lighting;
use tropism::programme::Acting;
use tropism::rig::{Camera, Clock, EventKind, Flash, Lamps, OnFault, RigError};
use tropism::text::plural;

use super::{RecordError, Recorder};
use crate::journal::{ProgrammeRecord, StepRecord};

/// How often the lamps are switched at a step before the failure is reported; chosen by hand.
const TRIES: usize = 3;

/// How long after a failure the lamps are switched again, if the next step is not due before; chosen by hand.
pub(super) const RETRY_AFTER: Duration = Duration::from_secs(30);

/// A lighting that the lamps are to obey.
#[derive(Clone, Copy, Debug)]
pub(super) struct Command {
    /// The step from which it acts.
    pub(super) step: u32,
    /// The lighting that was decided last.
    pub(super) decided: Lighting,
    /// What the programme makes of it: the lighting of the lamps.
    pub(super) lighting: Lighting,
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Recorder<'_, C, L, F, K> {
    /// How the lamps shone when the run was interrupted, by the journal; of a real tent with what the programme has become
    /// since, but dark if they were dark.
    pub(super) fn interrupted_lighting(&self) -> Lighting {
        let steps = self.replay.steps();
        let measured = steps.iter().rfind(|step| step.seen.is_measured()).map(|step| step.step);
        let is_dark = self.supervision.policy.on_fault == OnFault::Dark
            && steps
                .last()
                .is_some_and(|last| last.decided.is_none() && self.is_carried_too_long(measured, last.step));
        let latest = steps.iter().rev().find_map(StepRecord::commanded);
        let shone = latest.filter(|_| !is_dark).unwrap_or(Lighting::DARK);
        let decided = steps.iter().rev().find_map(|step| step.decided);
        match self.acting().zip(decided) {
            Some((acting, decided)) if shone != Lighting::DARK && self.rig.clock().now().is_some() => {
                acting.lighting(decided)
            }
            _ => shone,
        }
    }

    /// What acts now of the programme, if there is one.
    fn acting(&self) -> Option<Acting> {
        Some(self.supervision.programme.as_ref()?.at(self.rig.clock().time_of_day()))
    }

    fn record_programme(
        &mut self,
        step: u32,
        acting: Option<Acting>,
        commanded: Lighting,
    ) -> Result<(), RecordError> {
        let Some(acting) = acting else { return Ok(()) };
        self.write(|journal| journal.record_programme(step, &ProgrammeRecord { acting, commanded }))
    }

    /// Records the decision, then acts on it.
    pub(super) fn decide(&mut self, decided: Lighting) -> Result<(), RecordError> {
        let step = self.step;
        self.write(|journal| journal.record_decision(step, decided))?;
        self.command_lamps(step, decided)
    }

    /// Commands what programme and cap make of `decided` from `step` on.
    fn command_lamps(&mut self, step: u32, decided: Lighting) -> Result<(), RecordError> {
        let acting = self.acting();
        let lighting = acting.map_or(decided, |acting| acting.lighting(decided));
        if lighting != Lighting::DARK && self.is_light_spent(step, lighting)? {
            return self.record_programme(step, acting, Lighting::DARK);
        }
        self.record_programme(step, acting, lighting)?;
        if lighting != Lighting::DARK {
            self.light_day.add(step, lighting);
        }
        (self.command, self.is_confirmed) = (Some(Command { step, decided, lighting }), false);
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
            format!("{error}; the command is repeated, {} in a row so far", plural(steps, "step")),
        )?;
        if steps >= self.supervision.policy.pause_steps {
            return Err(self.pause(format!("no lamp for {}: {error}", plural(steps, "step"))));
        }
        Ok(())
    }

    /// Whether the lamps would give more light than a day has; then they are dark, and the decision is not confirmed.
    fn is_light_spent(&mut self, step: u32, lighting: Lighting) -> Result<bool, RecordError> {
        let (limits, period_min) = (&self.supervision.light, self.rig.period_min());
        if !limits.is_any() {
            return Ok(false);
        }
        let exceeded = limits.exceeded_by(self.light_day.with(step, lighting, limits, period_min));
        let was_spent = std::mem::replace(&mut self.is_light_spent, exceeded.is_some());
        let Some(limit) = exceeded else { return Ok(false) };
        self.command = None;
        let dark = self.rig.light(None);
        if !was_spent || dark.is_err() {
            let text = match dark {
                Ok(()) => format!("{limit}: all lamps are dark until there is room again"),
                Err(error) => format!("{limit}, and the lamps should be dark: {error}"),
            };
            self.report(EventKind::Lamp, text)?;
        }
        Ok(true)
    }

    /// Sets the lamps as commanded and records their confirmation. Returns the failure of the lamps, if they failed.
    pub(super) fn act(&mut self) -> Result<Option<RigError>, RecordError> {
        let Some(Command { step, lighting, .. }) = self.command else { return Ok(None) };
        if let Err(error) = self.rig.shine(lighting) {
            return Ok(Some(error));
        }
        self.is_confirmed = true;
        self.write(|journal| journal.record_confirmation(step))?;
        if std::mem::take(&mut self.health.streaks.lamp) > 0 {
            let text = format!("{} obeys again", lighting.word(self.rig.layout()));
            self.report(EventKind::Recovered, text)?;
        }
        Ok(None)
    }

    /// Sets the lamps as they are to be at this step, at which nothing is decided: dark, or as the last decision wants them
    /// and the programme has it now.
    pub(super) fn rest(&mut self) -> Result<(), RecordError> {
        let step = self.rig.next_step() - 1;
        if self.supervision.policy.on_fault == OnFault::Hold {
            match self.command {
                Some(Command { decided, .. }) if self.supervision.programme.is_some() => {
                    self.command_lamps(step, decided)?;
                }
                Some(Command { lighting, .. }) if lighting != Lighting::DARK => {
                    self.light_day.add(step, lighting);
                }
                _ => {}
            }
            return Ok(());
        }
        self.record_programme(step, self.acting(), Lighting::DARK)?;
        if self.command.take().is_none() {
            return Ok(());
        }
        let text = match self.rig.light(None) {
            Ok(()) => "all lamps are dark while nothing is decided".to_owned(),
            Err(error) => format!("all lamps should be dark while nothing is decided: {error}"),
        };
        self.report(EventKind::Lamp, text)
    }
}
