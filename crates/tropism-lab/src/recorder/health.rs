//! The health of a run: faults that last for several steps, a moved camera, the host computer, the wall clock.

use tropism::environment::Environment;
use tropism::geometry::Pixel;
use tropism::lamps::Light;
use tropism::lighting::Lighting;
use tropism::rig::fault_policy::COLUMNS;
use tropism::rig::{Camera, Clock, Event, EventKind, FaultPolicy, Flash, Lamps, Moment};
use tropism::text::plural;
use tropism::vision::{self, Frame, FrameStatus};

use super::lamps::Command;
use super::{RecordError, Recorder};
use crate::journal::StepRecord;

/// Seconds by which the wall clock may move against the steady clock from step to step without being reported; chosen by
/// hand, above the drift of a clock in five minutes.
const WALL_CLOCK_SLEW_S: f64 = 2.0;

/// How many photographs in a row show the tip in the very same place before the camera is taken for frozen: chosen, an hour.
/// The noise of a camera moves a tip by parts of a pixel.
const FROZEN_STEPS: u32 = 12;

/// What is known of the health of a run.
#[derive(Debug)]
pub(super) struct Health {
    pub(super) streaks: Streaks,
    /// Steps without a detected plant before the last pause: its user has seen them.
    excused: u32,
    /// The latest steps with a photograph, and with a detected plant.
    last_photo: Option<u32>,
    last_plant: Option<u32>,
    camera: CameraPosition,
    /// The latest step.
    last: Option<StepRecord>,
    /// Names of the problems of the host that were reported and last.
    host_problems: Vec<&'static str>,
    /// The wall clock less the steady clock, in seconds since 1970.
    wall_offset_s: Option<f64>,
}

impl Health {
    /// The health of a run as the interruption left it.
    pub(super) fn of(steps: &[StepRecord], events: &[Event]) -> Self {
        let streaks = Streaks::of(steps, events);
        let is_paused = events.iter().rfind(|event| event.kind.is_state()).map(|event| event.kind)
            == Some(EventKind::Paused);
        let last = |is_good: fn(&&StepRecord) -> bool| steps.iter().rfind(is_good).map(|step| step.step);
        Self {
            streaks,
            excused: if is_paused { streaks.carried_forward } else { 0 },
            last_photo: last(|step| step.photo_bytes > 0),
            last_plant: last(|step| step.seen.is_measured()),
            camera: CameraPosition::of(steps, events),
            last: steps.last().cloned(),
            host_problems: Vec::new(),
            wall_offset_s: None,
        }
    }
}

/// How many steps in a row a fault has lasted.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Streaks {
    /// The camera gave no photograph.
    pub(super) camera: u32,
    /// The plant was not detected.
    pub(super) carried_forward: u32,
    /// The lamps did not obey.
    pub(super) lamp: u32,
    /// The photograph shows another light than was commanded.
    mismatch: u32,
    /// Different photographs showed the tip in the very same place.
    frozen: u32,
}

impl Streaks {
    fn of(steps: &[StepRecord], events: &[Event]) -> Self {
        // Steps that a failing camera missed are not recorded, but each has an event of its own.
        let recorded = steps.last().map_or(0, |step| step.step);
        let missed =
            events.iter().filter(|event| event.kind == EventKind::Missed && event.step > recorded).count();
        let is_frozen =
            |index: usize, step: &StepRecord| index > 0 && shows_the_same(&steps[index - 1], step);
        let last = |is_faulty: &dyn Fn(usize, &StepRecord) -> bool| {
            steps.iter().enumerate().rev().take_while(|(index, step)| is_faulty(*index, step)).count() as u32
        };
        Self {
            camera: last(&|_, step| step.photo_bytes == 0) + missed as u32,
            carried_forward: last(&|_, step| !step.seen.is_measured()) + missed as u32,
            lamp: 0,
            mismatch: last(&|index, step| {
                let before = steps[..index].iter().rev().find_map(StepRecord::commanded);
                before.is_some() && step.lit.is_some_and(|lit| before != Some(Lighting::from(lit)))
            }),
            frozen: last(&is_frozen),
        }
    }
}

/// Shift of the camera's picture against the reference picture, in pixels.
#[derive(Clone, Copy, Debug, Default)]
struct CameraPosition {
    /// In the latest photograph from which it is known.
    latest: Option<Pixel>,
    /// When a move was reported last.
    reported: Pixel,
    /// When the run was paused last: its user has looked since.
    accepted: Pixel,
}

impl CameraPosition {
    fn of(steps: &[StepRecord], events: &[Event]) -> Self {
        let at = |kind: EventKind| {
            let event = events.iter().rfind(|event| event.kind == kind)?;
            steps.iter().filter(|step| step.step <= event.step).rev().find_map(|step| step.seen.camera_shift)
        };
        Self {
            latest: steps.iter().rev().find_map(|step| step.seen.camera_shift),
            reported: at(EventKind::Moved).unwrap_or_default(),
            accepted: at(EventKind::Paused).unwrap_or_default(),
        }
    }
}

/// Whether two photographs are different files of one picture: a camera that hangs may send its last one with a new comment.
fn shows_the_same(one: &StepRecord, other: &StepRecord) -> bool {
    other.seen.is_measured() && one.seen.tip_px == other.seen.tip_px && one.photo_sha256 != other.photo_sha256
}

/// Steps without something that was there last at the step `last` and is again at `step`, missed ones included; 0 if
/// nothing was at fault.
fn steps_since(last: Option<u32>, step: u32, is_faulty: bool) -> u32 {
    last.filter(|_| is_faulty).map_or(0, |last| step - last - 1)
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Recorder<'_, C, L, F, K> {
    /// Checks everything after a step was recorded. Changes are reported as events.
    ///
    /// # Errors
    /// [`RecordError::Paused`] if a fault lasts for longer than the policy tolerates.
    pub(super) fn check_health(&mut self, record: &StepRecord) -> Result<(), RecordError> {
        self.check_wall_clock(record.begun)?;
        self.check_host()?;
        self.check_lamps(record.lit)?;
        self.check_camera(record.seen.camera_shift)?;
        self.check_frozen(record)?;
        if record.photo_bytes > 0 {
            let last = self.health.last_photo.replace(record.step);
            let is_faulty = std::mem::take(&mut self.health.streaks.camera) > 0;
            self.report_recovery(steps_since(last, record.step, is_faulty), "a photograph again")?;
        }
        if record.seen.is_measured() {
            let last = self.health.last_plant.replace(record.step);
            let is_faulty = std::mem::take(&mut self.health.streaks.carried_forward) > 0;
            self.health.excused = 0;
            return self.report_recovery(steps_since(last, record.step, is_faulty), "the plant again");
        }
        self.health.streaks.carried_forward += 1;
        if self.health.streaks.carried_forward == 1 && record.photo_bytes > 0 {
            let text = format!("{} ({}): the last detection stands in", record.photo, record.seen.status);
            self.report(EventKind::CarriedForward, text)?;
        }
        self.check_carried_forward()
    }

    /// Reports that a fault which lasted for `steps` is over, unless it was over before anyone was alerted.
    fn report_recovery(&mut self, steps: u32, what: &str) -> Result<(), RecordError> {
        if steps < self.supervision.policy.alert_steps {
            return Ok(());
        }
        self.report(EventKind::Recovered, format!("{what} after {}", plural(steps, "step")))
    }

    /// Alerts or pauses when the plant was not detected for long.
    pub(super) fn check_carried_forward(&mut self) -> Result<(), RecordError> {
        let held = self.health.streaks.carried_forward;
        if held == self.supervision.policy.alert_steps {
            self.report(EventKind::Lost, format!("no plant detected for {}", plural(held, "step")))?;
        }
        if held - self.health.excused >= self.supervision.policy.pause_steps {
            return Err(self.pause(format!("no plant detected for {}", plural(held, "step"))));
        }
        Ok(())
    }

    /// The light that a photograph shows, if it is looked for and can be seen.
    pub(super) fn lit_in(&self, frame: &Frame, status: FrameStatus) -> Option<Option<Light>> {
        let places = self.supervision.lamps_in_view.as_ref()?.places(self.rig.layout());
        // What is looked for is one lamp at full power.
        self.command.is_none_or(|command| command.lighting.single().is_some()).then_some(())?;
        if [FrameStatus::Dark, FrameStatus::Repeated].contains(&status) {
            return None;
        }
        Some(vision::lamp_state(frame.picture().ok()?, places.as_deref()))
    }

    /// Compares the light in the photograph with the command.
    fn check_lamps(&mut self, lit: Option<Option<Light>>) -> Result<(), RecordError> {
        let (Some(lit), Some(Command { lighting: commanded, .. }), true) =
            (lit, self.command, self.is_confirmed)
        else {
            return Ok(());
        };
        if Lighting::from(lit) == commanded {
            let steps = std::mem::take(&mut self.health.streaks.mismatch);
            let text = format!("{} is lit again", self.rig.layout().name(lit));
            return self.report_recovery(steps, &text);
        }
        self.health.streaks.mismatch += 1;
        let steps = self.health.streaks.mismatch;
        let layout = self.rig.layout();
        let (found, wanted) = (layout.name(lit), commanded.word(layout));
        let text = format!("found {found} lit in the photograph, wanted {wanted}, {steps} in a row");
        self.report(EventKind::Mismatch, text.clone())?;
        if steps >= self.supervision.policy.pause_steps { Err(self.pause(text)) } else { Ok(()) }
    }

    /// Reports a moved camera. Two photographs in a row must show the move: a hand before the camera passes.
    fn check_camera(&mut self, shift: Option<Pixel>) -> Result<(), RecordError> {
        let Some(shift) = shift else { return Ok(()) };
        let before = self.health.camera.latest.replace(shift);
        let scale = self.rig.tracker().calibration().width as f64 / COLUMNS;
        let has_left = |from: Pixel, limit: f64| {
            let is_far = |at: Pixel| at.distance(from) > scale * limit;
            is_far(shift) && before.is_some_and(is_far)
        };
        let FaultPolicy { moved_px, moved_pause_px, .. } = self.supervision.policy;
        let must_pause = has_left(self.health.camera.accepted, moved_pause_px);
        let text = format!(
            "the camera was moved: its picture stands {:+.1}, {:+.1} px from the first",
            shift.x, shift.y
        );
        if has_left(self.health.camera.reported, moved_px) {
            self.health.camera.reported = shift;
            self.report(EventKind::Moved, format!("{text}; what is seen is corrected"))?;
        }
        if must_pause { Err(self.pause(text)) } else { Ok(()) }
    }

    /// Reports a camera that shows one picture again and again.
    fn check_frozen(&mut self, record: &StepRecord) -> Result<(), RecordError> {
        let last = self.health.last.replace(record.clone());
        if !last.is_some_and(|last| shows_the_same(&last, record)) {
            let steps = std::mem::take(&mut self.health.streaks.frozen);
            return self.report_recovery(if steps < FROZEN_STEPS { 0 } else { steps }, "a new picture");
        }
        self.health.streaks.frozen += 1;
        let steps = self.health.streaks.frozen;
        if steps != FROZEN_STEPS.max(self.supervision.policy.alert_steps) {
            return Ok(());
        }
        let text = format!(
            "{} show the very same picture in different files: the camera may hang; start it again",
            plural(steps + 1, "photograph")
        );
        // A person should look: nothing of the plant is seen any more.
        self.report(EventKind::Lost, text)
    }

    /// Reports problems of the host computer when they begin and when they are over.
    fn check_host(&mut self) -> Result<(), RecordError> {
        let found = self.supervision.monitor.health();
        let names = found.iter().map(|problem| problem.what).collect();
        let known = std::mem::replace(&mut self.health.host_problems, names);
        for problem in found.into_iter().filter(|problem| !known.contains(&problem.what)) {
            self.report(EventKind::Computer, problem.text)?;
        }
        for what in known {
            if !self.health.host_problems.contains(&what) {
                self.report(EventKind::Recovered, format!("{what}: right again"))?;
            }
        }
        Ok(())
    }

    /// Reports a wall clock that was set.
    fn check_wall_clock(&mut self, now: Option<Moment>) -> Result<(), RecordError> {
        let Some(now) = now else { return Ok(()) };
        let offset_s = now.unix_s - now.since_start.as_secs_f64();
        let by_s = offset_s - self.health.wall_offset_s.replace(offset_s).unwrap_or(offset_s);
        if by_s.abs() <= WALL_CLOCK_SLEW_S {
            return Ok(());
        }
        let text = format!("the clock on the wall was set by {by_s:+.0} s; the schedule stays");
        self.report(EventKind::Clock, text)
    }
}
