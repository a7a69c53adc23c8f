//! Decisions and the lamps: what becomes of a decision by the programme and the cap of light, commanded again until it is
//! confirmed, and lit while nothing is decided.

use std::collections::VecDeque;
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

/// The steps after which a lamp was lit.
#[derive(Debug, Default)]
pub(super) struct LightHours {
    steps: VecDeque<u32>,
    /// Whether there is no light left to give.
    is_spent: bool,
}

impl LightHours {
    /// Those of a run that is resumed: where the journal has a command, a lamp may have been lit.
    pub(super) fn of(steps: &[StepRecord]) -> Self {
        let is_lit = |step: &&StepRecord| step.commanded().is_some_and(|lighting| lighting != Lighting::DARK);
        let lit = steps.iter().filter(is_lit).map(|step| step.step);
        Self { steps: lit.collect(), is_spent: false }
    }

    pub(super) fn add(&mut self, step: u32) {
        if !self.has(step) {
            self.steps.push_back(step);
        }
    }

    /// Whether it is the latest of them: a step whose decision is repeated after an interruption counts once.
    fn has(&self, step: u32) -> bool {
        self.steps.back() == Some(&step)
    }

    /// Hours of light in the 24 hours that end with a lamp lit from `step` to the next one.
    fn within_a_day(&mut self, step: u32, period_min: f64) -> f64 {
        let is_past = |lit: &u32| f64::from(step + 1 - lit) * period_min > 24.0 * 60.0;
        while self.steps.front().is_some_and(is_past) {
            self.steps.pop_front();
        }
        (self.steps.len() + usize::from(!self.has(step))) as f64 * period_min / 60.0
    }
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
        if lighting != Lighting::DARK && self.is_light_spent(step)? {
            return self.record_programme(step, acting, Lighting::DARK);
        }
        self.record_programme(step, acting, lighting)?;
        if lighting != Lighting::DARK {
            self.light_hours.add(step);
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

    /// Whether the lamps had all the light of 24 hours; then they are dark, and the decision is not confirmed.
    fn is_light_spent(&mut self, step: u32) -> Result<bool, RecordError> {
        let Some(most_h) = self.supervision.max_light_h else { return Ok(false) };
        let is_spent = self.light_hours.within_a_day(step, self.rig.period_min()) > most_h;
        if is_spent {
            self.command = None;
            let dark = self.rig.light(None);
            if !self.light_hours.is_spent || dark.is_err() {
                let text = match dark {
                    Ok(()) => format!(
                        "{most_h} hours of light in a day: all lamps are dark until there is room again"
                    ),
                    Err(error) => {
                        format!("{most_h} hours of light in a day, and the lamps should be dark: {error}")
                    }
                };
                self.report(EventKind::Lamp, text)?;
            }
        }
        self.light_hours.is_spent = is_spent;
        Ok(is_spent)
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
                Some(Command { lighting, .. }) if lighting != Lighting::DARK => self.light_hours.add(step),
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
