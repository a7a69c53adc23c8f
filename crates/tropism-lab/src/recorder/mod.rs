//! The recorder: a rig whose every step is recorded in a run folder, and replayed after an interruption.
//!
//! In come a [`Rig`] and a [`RunFolder`]; out comes an [`Environment`] for the loop, which need not know of either. Each
//! step is recorded in the order in which it happens: the photograph is written and its detection is committed, then the
//! decision, then, when the lamps confirm it, the action. Recorded steps are replayed: the loop and its controller go
//! through them as they did before, without touching the plant, and then go on.
//!
//! Faults are tolerated as far as [`FaultPolicy`] goes, recorded as events, and passed to a [`RunMonitor`]. If the plant was
//! detected too many steps ago, or the time of a step has passed, nothing is decided: the track has a gap there.

mod lamps;
mod health;
mod photographs;
mod replay;

use tropism::environment::Environment;
use tropism::lamps::{Layout, Light};
use tropism::lighting::Lighting;
use tropism::observation::{Observation, Quality};
use tropism::programme::Programme;
use tropism::rig::{Camera, Clock, Flash, Lamps, Moment, Rig, RigError, Shot, SideView};
use tropism::rig::{Event, EventKind, FaultPolicy, LampsInView, NoMonitor, RunMonitor};
use tropism::text::plural;
use tropism::vision::Frame;
use tropism_rig::secret::shown;

use crate::files::{self, FileError};
use crate::folder::{FolderError, PhotoFolder, RunFolder};
use crate::journal::{Journal, JournalError, SideRecord, StepRecord};
use crate::light_day::{LightDay, LightLimits};
use health::Health;
use lamps::Command;
use replay::Replay;

/// What a full disk means for a run.
const DISK_FULL: &str = "photographs are not kept until there is room, all else goes on";

/// How a run is watched, and what it tolerates.
pub struct Supervision<'a> {
    /// Which faults it tolerates, and for how long.
    pub policy: FaultPolicy,
    /// Where photographs show the lamps; `None` if they are not compared with what is commanded.
    pub lamps_in_view: Option<LampsInView>,
    /// When the controller steers in the course of a day, and a base light; `None` for day and night.
    pub programme: Option<Programme>,
    /// Light at most in any 24 hours.
    pub light: LightLimits,
    /// Number of the step at which the run is over at the latest, seen or not: nothing is decided there.
    pub last_step: u32,
    /// Who hears of events, and may ask for an end.
    pub monitor: Box<dyn RunMonitor + 'a>,
}

impl Default for Supervision<'_> {
    /// For a virtual plant: everything is tolerated, and nobody is alerted.
    fn default() -> Self {
        Self {
            policy: FaultPolicy::unlimited(),
            lamps_in_view: None,
            programme: None,
            light: LightLimits::default(),
            last_step: u32::MAX,
            monitor: Box::new(NoMonitor),
        }
    }
}

/// Why a recorded run ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The rig failed.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A photograph cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The journal cannot be read or written.
    #[error("journal.sqlite: {0}")]
    Journal(#[from] JournalError),
    /// The monitor asked for an end. The run can be resumed.
    #[error("the run was asked to end")]
    Stopped,
    /// The run met a condition that its user must decide. It can be resumed.
    #[error("paused: {0}")]
    Paused(String),
    /// The controller decides otherwise than it did when the step was recorded.
    #[error(
        "step {step}: found the decision {found} in the journal, wanted {wanted}, which the controller decides now"
    )]
    Diverged {
        /// Step.
        step: u32,
        /// The recorded lighting.
        found: Lighting,
        /// The lighting that the controller decides now.
        wanted: Lighting,
    },
}

/// A rig that is recorded in a run folder.
pub struct Recorder<'a, C, L: Lamps, F, K> {
    rig: Rig<C, L, F, K>,
    folder: RunFolder,
    supervision: Supervision<'a>,
    replay: Replay,
    /// The latest step.
    step: u32,
    /// The latest step at which the plant was detected.
    last_measured: Option<u32>,
    /// The latest step of which the journal says that it was missed.
    last_missed: Option<u32>,
    /// How many steps the loop observed.
    observed: u32,
    /// The latest decision; `None` while the lamps are dark because nothing is decided.
    command: Option<Command>,
    /// Whether the lamps confirmed the last command.
    is_confirmed: bool,
    light_day: LightDay,
    /// Whether there is no light left to give.
    is_light_spent: bool,
    health: Health,
    /// Whether the disk is too full for photographs.
    is_disk_full: bool,
}

impl<'a, C: Camera, L: Lamps, F: Flash, K: Clock> Recorder<'a, C, L, F, K> {
    /// Records `rig` in `folder`, after a replay of the steps that are recorded there. The lamps are set at once as the
    /// journal says: to the latest decision, or dark.
    ///
    /// # Errors
    /// [`RecordError`] if the journal cannot be read or written.
    pub fn new(
        rig: Rig<C, L, F, K>,
        folder: RunFolder,
        supervision: Supervision<'a>,
    ) -> Result<Self, RecordError> {
        let (steps, events) = (folder.steps()?, folder.journal().events()?);
        let state = events.iter().rfind(|event| event.kind.is_state()).map(|event| event.kind);
        let memory_frames = rig.tracker().memory_frames();
        let mut recorder = Self {
            rig,
            folder,
            supervision,
            step: steps.last().map_or(0, |step| step.step),
            last_measured: None,
            last_missed: events.iter().rfind(|event| event.kind == EventKind::Missed).map(|event| event.step),
            observed: 0,
            command: None,
            is_confirmed: false,
            light_day: LightDay::of(&steps),
            is_light_spent: false,
            health: Health::of(&steps, &events),
            replay: Replay::new(steps, memory_frames),
            is_disk_full: false,
        };
        if state != Some(EventKind::Finished) {
            recorder.begin(state)?;
        }
        Ok(recorder)
    }

    /// Begins or resumes a run that is not over; `state` is the latest state in its journal.
    fn begin(&mut self, state: Option<EventKind>) -> Result<(), RecordError> {
        let lighting = self.interrupted_lighting();
        // In the virtual tent, whose clock jumps, the replay lights the lamps of the recorded steps.
        let is_real = self.rig.clock().now().is_some();
        let lit = self.rig.shine(if is_real { lighting } else { Lighting::DARK });
        self.is_confirmed = lit.is_ok();
        if let Some(boot) = self.rig.clock().boot() {
            self.write(|journal| journal.record_boot(&boot))?;
        }
        match self.replay.len() {
            0 if state.is_none() => self.report(EventKind::Started, "the run begins".to_owned())?,
            steps => {
                let lamp = (lighting != Lighting::DARK).then(|| lighting.word(self.rig.layout()));
                let lamps = match (lamp, &lit) {
                    (Some(lamp), Ok(())) => format!("; {lamp} is lit as before"),
                    (None, Ok(())) => "; all lamps are dark".to_owned(),
                    (Some(lamp), Err(_)) => format!("; {lamp} was lit before, and does not obey now"),
                    (None, Err(_)) => "; the lamps should be dark, and do not obey".to_owned(),
                };
                self.report(EventKind::Resumed, format!("found {}, going on{lamps}", plural(steps, "step")))?;
            }
        }
        if let Err(error) = lit {
            self.report(EventKind::Lamp, error.to_string())?;
        }
        for damage in self.folder.damages().to_vec() {
            self.report(EventKind::Damaged, damage)?;
        }
        self.fill_reserve()
    }

    /// Ends the recording: flash and lamps become what they are to be [on exit](tropism::rig::OnExit). Returns whether
    /// they confirmed that.
    ///
    /// # Errors
    /// [`RecordError::Journal`] if a device that does not confirm cannot be recorded.
    pub fn close(mut self) -> Result<bool, RecordError> {
        let Err(error) = self.rig.close() else { return Ok(true) };
        let text = format!("the run ends, and its light should be off: {error}");
        self.report(EventKind::Lamp, text)?;
        Ok(false)
    }

    /// The run folder.
    pub const fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// Records an event of the latest step and reports to the monitor.
    ///
    /// # Errors
    /// [`RecordError::Journal`] if it cannot be recorded; the monitor has the event all the same.
    pub fn report(&mut self, kind: EventKind, text: String) -> Result<(), RecordError> {
        self.report_at(self.step, kind, text)
    }

    /// Records an event of `step` and reports to the monitor.
    fn report_at(&mut self, step: u32, kind: EventKind, text: String) -> Result<(), RecordError> {
        // Devices and programs have a say in it.
        let event = Event { step, kind, text: shown(&text), at: self.rig.clock().now() };
        let written = self.write(|journal| journal.record_event(&event));
        self.supervision.monitor.event(&event);
        written
    }

    /// Records the error that ends the run. Whoever gets the error reports it.
    pub fn record_fault(&mut self, text: &str) {
        let event =
            Event { step: self.step, kind: EventKind::Fault, text: shown(text), at: self.rig.clock().now() };
        // The journal may be what failed.
        let _ = self.write(|journal| journal.record_event(&event));
    }

    /// Reports a pause; the error ends the run until its user has looked.
    fn pause(&mut self, reason: String) -> RecordError {
        match self.report(EventKind::Paused, reason.clone()) {
            Ok(()) => RecordError::Paused(reason),
            Err(error) => error,
        }
    }

    /// Writes into the journal. On a full disk the reserve is released first.
    fn write(&mut self, entry: impl Fn(&Journal) -> Result<(), JournalError>) -> Result<(), RecordError> {
        match entry(self.folder.journal()) {
            Err(error) if error.is_disk_full() && self.folder.release_reserve() => {
                entry(self.folder.journal())?;
                self.is_disk_full = true;
                self.report(EventKind::Disk, format!("journal.sqlite: {error}; {DISK_FULL}"))
            }
            done => Ok(done?),
        }
    }

    fn fill_reserve(&mut self) -> Result<(), RecordError> {
        match self.folder.fill_reserve(self.supervision.policy.reserve_mb) {
            Err(error) if error.is_disk_full() => {
                self.is_disk_full = true;
                self.report(EventKind::Disk, format!("{error}; {DISK_FULL}"))
            }
            done => Ok(done?),
        }
    }

    /// Counts a step that was replayed or observed.
    fn advance(&mut self, step: u32, is_measured: bool) {
        self.step = step;
        self.replay.advance();
        if is_measured {
            self.last_measured = Some(step);
        }
    }

    /// Whether the plant was detected too long ago for a decision at `step`.
    fn is_undecidable(&self, step: u32) -> bool {
        step < self.supervision.last_step && self.is_carried_too_long(self.last_measured, step)
    }

    /// Whether a tip that was measured at the step `measured` may not be carried forward at `step` any more.
    fn is_carried_too_long(&self, measured: Option<u32>, step: u32) -> bool {
        measured.is_some_and(|measured| step - measured > self.supervision.policy.hold_steps)
    }

    /// Records the photograph of this step and its detection, and checks the health of the run.
    fn record(&mut self, frame: &Frame, begun: Option<Moment>) -> Result<(), RecordError> {
        let Some(Shot { seen, side, .. }) = self.rig.shot().cloned() else { return Ok(()) };
        let lit = self.lit_in(frame, seen.status);
        let photo = frame.photo();
        // An empty one stands in for what the camera did not give.
        if !photo.bytes.is_empty() {
            self.keep_photo(PhotoFolder::Front, photo)?;
        }
        // A file without bytes says that the camera at the side gave none.
        if let Some(side) = &side {
            self.keep_photo(PhotoFolder::Side, &side.photo)?;
        }
        if let Some(problem) = self.rig.side().and_then(SideView::problem) {
            let text = format!("at the side: {problem}; the last depth stands in");
            self.report(EventKind::Camera, text)?;
        }
        let record = StepRecord {
            step: self.step,
            time_s: photo.time_s,
            photo: photo.name.clone(),
            photo_bytes: photo.bytes.len() as u64,
            photo_sha256: files::sha256(&photo.bytes),
            seen,
            side: side.map(|side| {
                Box::new(SideRecord {
                    photo_bytes: side.photo.bytes.len() as u64,
                    photo_sha256: files::sha256(&side.photo.bytes),
                    seen: side.seen,
                    observation: side.observation,
                })
            }),
            decided: None,
            programme: None,
            is_confirmed: false,
            begun,
            lit,
        };
        self.write(|journal| journal.record_observation(&record))?;
        self.check_health(&record)
    }
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Environment for Recorder<'_, C, L, F, K> {
    type Error = RecordError;

    fn observe(&mut self) -> Result<Observation, RecordError> {
        while let Some(record) = self.replay.next().cloned() {
            let StepRecord { step, decided, .. } = record;
            self.advance(step, record.seen.is_measured());
            if decided.is_none() && self.is_undecidable(step) {
                self.replay_undecided()?;
                continue;
            }
            self.observed += 1;
            let wanted = "a tip: each step has one, measured or carried forward";
            let error = JournalError::Value { step, column: "tip_x_cm", found: "none".to_owned(), wanted };
            return record.observation().cloned().ok_or(RecordError::Journal(error));
        }
        loop {
            let (frame, begun) = self.photograph()?;
            let observation = self.rig.see(&frame)?;
            let step = self.rig.next_step() - 1;
            self.advance(step, observation.quality == Quality::Measured);
            self.record(&frame, begun)?;
            if !self.is_undecidable(step) {
                self.observed += 1;
                return Ok(observation);
            }
            let steps = step - self.last_measured.unwrap_or_default();
            self.report(
                EventKind::Missed,
                format!(
                    "step {step} without a decision: the plant was last detected {} ago",
                    plural(steps, "step")
                ),
            )?;
            self.rest()?;
        }
    }

    fn step(&mut self, light: Light) -> Result<(), RecordError> {
        self.shine(light.into())
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), RecordError> {
        if self.replay_decided(lighting)? { Ok(()) } else { self.decide(lighting) }
    }

    fn missed(&self) -> u32 {
        (self.step + 1).saturating_sub(self.observed)
    }

    fn layout(&self) -> &Layout {
        self.rig.layout()
    }

    fn period_min(&self) -> f64 {
        self.rig.period_min()
    }
}
