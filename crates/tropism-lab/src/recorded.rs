//! A rig whose every step is written down, and taken up again after an interruption.

use std::time::Duration;

use crate::files::{self, FileError};
use crate::folder::{FolderError, RunFolder};
use crate::journal::{Journal, JournalError, Row};
use tropism::environment::Environment;
use tropism::geometry::Pixel;
use tropism::lamps::{Layout, Light};
use tropism::observation::{Observation, Quality};
use tropism::photo::Photo;
use tropism::rig::{Camera, Clock, Flash, Lamps, Moment, Rig, RigError, Shot};
use tropism::rig::{Event, EventKind, NoMonitor, RunMonitor};
use tropism::rig::{FaultPolicy, LampsInView, OnFault, fault_policy::COLUMNS};
use tropism::vision::{self, Frame, FrameStatus, TipTracker};

/// How long after a lamp did not obey it is told again, before the next step is due.
const AGAIN: Duration = Duration::from_secs(30);

/// How often a lamp is told to do the same at a step.
const TRIES: usize = 3;

/// By how much the clock on the wall may move against the even one from step to step, in seconds.
const SLEW_S: f64 = 2.0;

/// What a full disk means.
const FULL: &str = "photographs are not kept until there is room, all else goes on";

/// Who looks after a run.
pub struct Supervision<'a> {
    /// What it bears.
    pub patience: FaultPolicy,
    /// Where photographs show the lamps; `None` if that is not looked at.
    pub lamps_in_view: Option<LampsInView>,
    /// Who hears of what happens.
    pub watcher: Box<dyn RunMonitor + 'a>,
}

impl Default for Supervision<'_> {
    /// Of a virtual plant.
    fn default() -> Self {
        Self { patience: FaultPolicy::unlimited(), lamps_in_view: None, watcher: Box::new(NoMonitor) }
    }
}

/// A rig with a run folder.
///
/// Each step is recorded in the order in which it happens: the photograph is kept and what was seen is committed, then
/// the decision, then, when the lamp has obeyed, that it was lit. Steps that the folder holds already are played back:
/// the loop and its controller go through them as they did before, without touching the plant, and then go on.
///
/// What goes wrong is borne as far as [`FaultPolicy`] goes, written down, and told to the [`RunMonitor`]. Where the plant was
/// last believed too many steps ago, or the time of a step has passed, nothing is decided: it is a gap in the track.
pub struct Recorded<'a, C, L: Lamps, F, K> {
    rig: Rig<C, L, F, K>,
    folder: RunFolder,
    care: Supervision<'a>,
    past: Vec<Row>,
    /// The last of the first recorded pictures, which the tracker compares with, and the first of the latest ones in
    /// which the plant was believed that it remembers.
    first: usize,
    believed: usize,
    /// How many recorded steps were gone through, and how many of them the loop has observed.
    taken: usize,
    observed: u32,
    /// The latest step at which the plant was believed.
    measured: Option<u32>,
    /// The step of the latest one.
    step: u32,
    /// The light that was last decided upon, at which step, and whether the lamps obeyed; `None` while they are dark
    /// because nothing is decided.
    commanded: Option<(u32, Light)>,
    is_lit: bool,
    camera: CameraPlace,
    /// What is wrong with the computer.
    troubles: Vec<&'static str>,
    streaks: Streaks,
    /// Whether photographs cannot be kept.
    is_full: bool,
    /// The clock on the wall less the even one, in seconds.
    wall_s: Option<f64>,
}

/// Where the camera's picture stood, in pixels from where it was at first.
#[derive(Clone, Copy, Debug, Default)]
struct CameraPlace {
    /// In the latest photograph that shows it.
    latest: Option<Pixel>,
    /// When that was last told.
    told: Pixel,
    /// When somebody last had to look: the run had paused.
    accepted: Pixel,
}

impl CameraPlace {
    /// As a run that was cut off has left it.
    fn of(past: &[Row], events: &[Event]) -> Self {
        let at = |kind: EventKind| {
            let event = events.iter().rfind(|event| event.kind == kind)?;
            past.iter()
                .rfind(|row| row.step <= event.step && row.seen.camera_shift.is_some())?
                .seen
                .camera_shift
        };
        Self {
            latest: past.iter().rev().find_map(|row| row.seen.camera_shift),
            told: at(EventKind::Moved).unwrap_or_default(),
            accepted: at(EventKind::Paused).unwrap_or_default(),
        }
    }
}

/// How many steps in a row something has gone wrong.
#[derive(Clone, Copy, Debug, Default)]
struct Streaks {
    /// The camera gave no photograph.
    camera: u32,
    /// No plant was seen that could be believed.
    held: u32,
    /// The lamp did not obey.
    lamp: u32,
    /// The photograph showed another lamp than was commanded.
    mismatch: u32,
}

impl Streaks {
    /// As a run that was cut off has left them.
    fn of(past: &[Row]) -> Self {
        let last = |is_so: &dyn Fn(usize, &Row) -> bool| {
            past.iter().enumerate().rev().take_while(|(index, row)| is_so(*index, row)).count() as u32
        };
        Self {
            camera: last(&|_, row| row.photo_bytes == 0),
            held: last(&|_, row| !row.seen.is_measured()),
            lamp: 0,
            mismatch: last(&|index, row| {
                let before = past[..index].iter().rev().find_map(|row| row.decided);
                before.is_some() && row.lit.is_some_and(|lit| lit != before)
            }),
        }
    }
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
    /// Something that the run must not decide. The run can be gone on with.
    #[error("paused: {0}")]
    Paused(String),
    /// The controller decides otherwise than it did.
    #[error(
        "step {step}: found the decision {found} in the journal, wanted {wanted}, which the controller decides now"
    )]
    Diverged {
        /// Step.
        step: u32,
        /// The recorded light.
        found: Light,
        /// What the controller says now.
        wanted: Light,
    },
}

impl<'a, C: Camera, L: Lamps, F: Flash, K: Clock> Recorded<'a, C, L, F, K> {
    /// Records `rig` in `folder`, after playing back what is recorded there. The lamps are at once as the journal says:
    /// the last light decided upon, or dark.
    ///
    /// # Errors
    /// [`RecordError`] if the journal cannot be read or written.
    pub fn new(rig: Rig<C, L, F, K>, folder: RunFolder, care: Supervision<'a>) -> Result<Self, RecordError> {
        let past = folder.rows()?;
        let events = folder.journal().events()?;
        let state = events.iter().rfind(|event| event.kind.is_state()).map(|event| event.kind);
        let camera = CameraPlace::of(&past, &events);
        let (streaks, step) = (Streaks::of(&past), past.last().map_or(0, |row| row.step));
        let is_picture = |row: &Row| {
            ![FrameStatus::Corrupt, FrameStatus::Foreign, FrameStatus::Repeated].contains(&row.seen.status)
        };
        let mut pictures = (0..past.len()).filter(|&index| is_picture(&past[index]));
        let first = pictures.nth(TipTracker::REFERENCE_FRAMES - 1).unwrap_or(past.len());
        let mut measured = (0..past.len()).rev().filter(|&index| past[index].seen.is_measured());
        let believed = measured.nth(TipTracker::MEMORY_FRAMES - 1).unwrap_or(0);
        let mut recorded = Self {
            rig,
            folder,
            care,
            past,
            first,
            believed,
            taken: 0,
            observed: 0,
            measured: None,
            step,
            commanded: None,
            is_lit: false,
            camera,
            troubles: Vec::new(),
            streaks,
            is_full: false,
            wall_s: None,
        };
        if state == Some(EventKind::Finished) {
            return Ok(recorded);
        }
        let lit = recorded.left_lit();
        if let Some(boot) = recorded.rig.clock().boot() {
            recorded.write(|journal| journal.taken_up(&boot))?;
        }
        match recorded.past.len() {
            0 if state.is_none() => recorded.tell(EventKind::Started, "the run begins".to_owned())?,
            steps => {
                let lamp = recorded.rig.layout().name(lit);
                let text = format!("found {steps} steps, going on; {lamp} is lit as before");
                recorded.tell(EventKind::Resumed, text)?;
            }
        }
        if let Some(what) = recorded.folder.journal().restored().map(str::to_owned) {
            recorded.tell(EventKind::Damaged, format!("journal.sqlite: {what}"))?;
        }
        recorded.make_ballast()?;
        // Of a clock that jumps the recorded steps are still to come, and their lamps with them.
        let lit_now = lit.filter(|_| recorded.rig.clock().now().is_some());
        match recorded.rig.light(lit_now) {
            Ok(()) => recorded.is_lit = true,
            Err(error) => recorded.tell(EventKind::Lamp, error.to_string())?,
        }
        Ok(recorded)
    }

    /// The light that a run that was cut off has left.
    fn left_lit(&self) -> Option<Light> {
        let measured = self.past.iter().rfind(|row| row.seen.is_measured()).map(|row| row.step);
        let is_dark = self.care.patience.on_fault == OnFault::Dark
            && self
                .past
                .last()
                .is_some_and(|row| row.decided.is_none() && self.is_too_long(measured, row.step));
        self.past.iter().rev().find_map(|row| row.decided).filter(|_| !is_dark)
    }

    /// Whether a plant that was last believed at the step `measured` can no longer be stood in for at `step`.
    fn is_too_long(&self, measured: Option<u32>, step: u32) -> bool {
        measured.is_some_and(|measured| step - measured > self.care.patience.hold_steps)
    }

    /// Whether what was seen last is too old for a decision at `step`.
    fn is_undecidable(&self, step: u32) -> bool {
        self.is_too_long(self.measured, step)
    }

    /// Takes up what was seen at a step.
    fn take(&mut self, step: u32, is_measured: bool) {
        (self.step, self.taken) = (step, self.taken + 1);
        if is_measured {
            self.measured = Some(step);
        }
    }

    /// The run folder.
    pub const fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// How many steps were in the folder before.
    pub const fn resumed_from(&self) -> usize {
        self.past.len()
    }

    /// Writes down that something happened, and tells the watcher.
    ///
    /// # Errors
    /// [`RecordError::Journal`] if it cannot be written down; the watcher has been told all the same.
    pub fn tell(&mut self, kind: EventKind, text: String) -> Result<(), RecordError> {
        let event = Event { step: self.step, kind, text, at: self.rig.clock().now() };
        let written = self.write(|journal| journal.happened(&event));
        self.care.watcher.event(&event);
        written
    }

    /// Ends the run until its user has looked.
    fn pause(&mut self, why: String) -> RecordError {
        match self.tell(EventKind::Paused, why.clone()) {
            Ok(()) => RecordError::Paused(why),
            Err(error) => error,
        }
    }

    /// Writes into the journal. A full disk gives up the ballast.
    fn write(&mut self, what: impl Fn(&Journal) -> Result<(), JournalError>) -> Result<(), RecordError> {
        match what(self.folder.journal()) {
            Err(error) if error.is_disk_full() && self.folder.drop_ballast() => {
                what(self.folder.journal())?;
                self.is_full = true;
                self.tell(EventKind::Disk, format!("journal.sqlite: {error}; {FULL}"))
            }
            done => Ok(done?),
        }
    }

    fn make_ballast(&mut self) -> Result<(), RecordError> {
        match self.folder.make_ballast(self.care.patience.ballast_mb) {
            Err(error) if error.is_disk_full() => {
                self.is_full = true;
                self.tell(EventKind::Disk, format!("{error}; {FULL}"))
            }
            done => Ok(done?),
        }
    }

    /// Waits for the next step; meanwhile a lamp that did not obey is told again.
    fn wait(&mut self) -> Result<(), RecordError> {
        let due = self.rig.due(self.rig.next_step());
        loop {
            let is_failing = self.commanded.is_some() && !self.is_lit;
            let until = match self.rig.clock().now().filter(|_| is_failing) {
                Some(now) => due.min(now.since_start + AGAIN),
                None => due,
            };
            let watcher = &mut self.care.watcher;
            if watcher.heartbeat().is_break()
                || self.rig.wait_until(until, &mut || watcher.heartbeat()).is_break()
            {
                self.tell(EventKind::Stopped, "asked to end".to_owned())?;
                return Err(RecordError::Stopped);
            }
            if until == due {
                return Ok(());
            }
            // That it fails was told at its step.
            self.act()?;
        }
    }

    /// Passes over steps whose time has passed; true if there were any.
    fn miss_what_passed(&mut self) -> Result<bool, RecordError> {
        let Some(now) = self.rig.clock().now() else { return Ok(false) };
        let (step, late_s) = (self.rig.next_step(), self.care.patience.late_s);
        let now_s = now.since_start.as_secs_f64();
        let by_s = now_s - self.rig.due(step).as_secs_f64();
        if by_s > late_s {
            let next = ((now_s - late_s) / self.rig.due(1).as_secs_f64()).ceil() as u32;
            let why = format!("step {step} would be {by_s:.0} s late, more than {late_s}");
            self.miss(next.max(step + 1), &why)?;
            return Ok(true);
        }
        if by_s > late_s / 2.0 {
            self.tell(EventKind::Late, format!("step {step} begins {by_s:.0} s late"))?;
        }
        Ok(false)
    }

    /// Passes over the steps before `next`.
    fn miss(&mut self, next: u32, why: &str) -> Result<(), RecordError> {
        let steps = next - self.rig.next_step();
        self.rig.skip_to(next);
        self.tell(EventKind::Missed, format!("{steps} without a photograph and a decision: {why}"))
    }

    /// The photograph of the next step, what stands for it if the camera has none, and when it was begun.
    fn photograph(&mut self) -> Result<(Frame, Option<Moment>), RecordError> {
        loop {
            self.wait()?;
            if self.miss_what_passed()? {
                continue;
            }
            let begun = self.rig.clock().now();
            let error = match self.rig.photograph() {
                Ok(frame) => return Ok((self.brighter(frame)?, begun)),
                // Nothing was ever seen that could stand in.
                Err(error) if self.taken == 0 => return Err(error.into()),
                Err(error) => error,
            };
            self.streaks.camera += 1;
            if !self.is_undecidable(self.rig.next_step()) {
                self.tell(EventKind::Camera, format!("{error}; the last sighting stands in"))?;
                return Ok((self.rig.no_photograph(), begun));
            }
            self.miss(self.rig.next_step() + 1, &error.to_string())?;
            self.rest()?;
            self.streaks.held += 1;
            self.look_after_held()?;
        }
    }

    /// A photograph that is not dark, if another one of the same step is not.
    fn brighter(&mut self, mut frame: Frame) -> Result<Frame, RecordError> {
        for _ in 1..self.care.patience.flash_tries {
            let again = match self.rig.photograph_again(&frame) {
                None => break,
                Some(again) => again,
            };
            let what = again.as_ref().map_or_else(ToString::to_string, |again| {
                let is_dark = self.rig.tracker().is_dark(again);
                if is_dark { "dark again: is the flash dead?".to_owned() } else { "bright".to_owned() }
            });
            let name = &frame.photo().name;
            self.tell(EventKind::Dark, format!("{name} was dark, and was taken again: {what}"))?;
            frame = again.unwrap_or(frame);
        }
        Ok(frame)
    }

    /// Leaves the lamps as they are to be while nothing is decided.
    fn rest(&mut self) -> Result<(), RecordError> {
        if self.care.patience.on_fault == OnFault::Hold || self.commanded.take().is_none() {
            return Ok(());
        }
        let done = self.rig.light(None);
        let text = done.err().map_or("both are dark while nothing is decided".to_owned(), |error| {
            format!("both should be dark while nothing is decided: {error}")
        });
        self.tell(EventKind::Lamp, text)
    }

    /// Writes down what was seen at this step.
    fn record(&mut self, frame: &Frame, begun: Option<Moment>) -> Result<(), RecordError> {
        let Some(seen) = self.rig.shot().map(|shot| shot.seen.clone()) else { return Ok(()) };
        let lit = self.lamp_in(frame, seen.status);
        let photo = frame.photo();
        self.keep(photo)?;
        let row = Row {
            step: self.step,
            time_s: photo.time_s,
            photo: photo.name.clone(),
            photo_bytes: photo.bytes.len() as u64,
            photo_sha256: files::sha256(&photo.bytes),
            seen: seen.clone(),
            decided: None,
            is_done: false,
            begun,
            lit,
        };
        self.write(|journal| journal.saw(&row))?;
        self.look_at_clock(begun)?;
        self.look_at_computer()?;
        self.look_at_lamp(lit)?;
        self.look_at_camera(seen.camera_shift)?;
        if !photo.bytes.is_empty() {
            let steps = std::mem::take(&mut self.streaks.camera);
            self.recovered(steps, "a photograph again")?;
        }
        if seen.is_measured() {
            let steps = std::mem::take(&mut self.streaks.held);
            self.recovered(steps, "the plant again")
        } else {
            self.streaks.held += 1;
            if self.streaks.held == 1 && !photo.bytes.is_empty() {
                let text = format!("{} ({}): the last sighting stands in", photo.name, seen.status);
                self.tell(EventKind::Held, text)?;
            }
            self.look_after_held()
        }
    }

    /// Tells that what was wrong for so many steps is right again, unless it passed before anybody would have come.
    fn recovered(&mut self, steps: u32, what: &str) -> Result<(), RecordError> {
        if steps < self.care.patience.alert_steps {
            return Ok(());
        }
        self.tell(EventKind::Recovered, format!("{what} after {steps} steps"))
    }

    fn look_after_held(&mut self) -> Result<(), RecordError> {
        let held = self.streaks.held;
        if held == self.care.patience.alert_steps {
            self.tell(EventKind::Lost, format!("no believed plant for {held} steps"))?;
        }
        if held >= self.care.patience.pause_steps {
            return Err(self.pause(format!("no believed plant for {held} steps")));
        }
        Ok(())
    }

    /// The lamp that a photograph shows lit, where that is looked at and can be seen.
    fn lamp_in(&self, frame: &Frame, class: FrameStatus) -> Option<Option<Light>> {
        let places = self.care.lamps_in_view.as_ref()?.places(self.rig.layout());
        if [FrameStatus::Dark, FrameStatus::Repeated].contains(&class) {
            return None;
        }
        Some(vision::lamp_state(frame.picture().ok()?, places.as_deref()))
    }

    fn look_at_lamp(&mut self, lit: Option<Option<Light>>) -> Result<(), RecordError> {
        let (Some(lit), Some((_, commanded)), true) = (lit, self.commanded, self.is_lit) else {
            return Ok(());
        };
        if lit == Some(commanded) {
            let steps = std::mem::take(&mut self.streaks.mismatch);
            let text = format!("{} is lit again", self.rig.layout().name(lit));
            return self.recovered(steps, &text);
        }
        self.streaks.mismatch += 1;
        let steps = self.streaks.mismatch;
        let layout = self.rig.layout();
        let (found, wanted) = (layout.name(lit), layout.name(Some(commanded)));
        let text = format!("found {found} lit in the photograph, wanted {wanted}, {steps} in a row");
        self.tell(EventKind::Mismatch, text.clone())?;
        if steps >= self.care.patience.pause_steps { Err(self.pause(text)) } else { Ok(()) }
    }

    /// Notes when the camera was moved. It was if two photographs in a row say so: a hand before it passes.
    fn look_at_camera(&mut self, place: Option<Pixel>) -> Result<(), RecordError> {
        let Some(place) = place else { return Ok(()) };
        let before = self.camera.latest.replace(place);
        let scale = self.rig.tracker().calibration().width as f64 / COLUMNS;
        let has_left = |from: Pixel, most: f64| {
            let is_far = |at: Pixel| at.distance(from) > scale * most;
            is_far(place) && before.is_some_and(is_far)
        };
        let FaultPolicy { moved_px, moved_pause_px, .. } = self.care.patience;
        let must_pause = has_left(self.camera.accepted, moved_pause_px);
        let text = format!(
            "the camera was moved: its picture stands {:+.1}, {:+.1} px from the first",
            place.x, place.y
        );
        if has_left(self.camera.told, moved_px) {
            self.camera.told = place;
            self.tell(EventKind::Moved, format!("{text}; what is seen is corrected"))?;
        }
        if must_pause { Err(self.pause(text)) } else { Ok(()) }
    }

    /// Notes what goes wrong with the computer, and what is right again.
    fn look_at_computer(&mut self) -> Result<(), RecordError> {
        let found = self.care.watcher.health();
        let known = std::mem::replace(&mut self.troubles, found.iter().map(|trouble| trouble.what).collect());
        for trouble in found.into_iter().filter(|trouble| !known.contains(&trouble.what)) {
            self.tell(EventKind::Computer, trouble.text)?;
        }
        for what in known.into_iter().filter(|what| !self.troubles.contains(what)).collect::<Vec<_>>() {
            self.tell(EventKind::Recovered, format!("{what}: right again"))?;
        }
        Ok(())
    }

    /// Notes when the clock on the wall was set.
    fn look_at_clock(&mut self, now: Option<Moment>) -> Result<(), RecordError> {
        let Some(now) = now else { return Ok(()) };
        let wall_s = now.unix_s - now.since_start.as_secs_f64();
        let by_s = wall_s - self.wall_s.replace(wall_s).unwrap_or(wall_s);
        if by_s.abs() <= SLEW_S {
            return Ok(());
        }
        let text = format!("the clock on the wall was set by {by_s:+.0} s; the schedule stays");
        self.tell(EventKind::Clock, text)
    }

    /// Keeps a photograph, if the disk has room for it beside what the journal needs.
    fn keep(&mut self, photo: &Photo) -> Result<(), RecordError> {
        if self.is_full {
            let needed = 8 * photo.bytes.len() as u64 + (u64::from(self.care.patience.ballast_mb) << 20);
            if self.folder.free_bytes().is_none_or(|free| free < needed) {
                return Ok(());
            }
            self.is_full = false;
            self.make_ballast()?;
        }
        match self.folder.keep_photo(&photo.name, &photo.bytes) {
            Err(error) if error.is_disk_full() => {
                self.is_full = true;
                self.folder.drop_ballast();
                self.tell(EventKind::Disk, format!("{error}; {FULL}"))
            }
            done => Ok(done?),
        }
    }

    /// Commits the decision, then acts upon it.
    fn decide(&mut self, light: Light) -> Result<(), RecordError> {
        let step = self.step;
        self.write(|journal| journal.decided(step, light))?;
        (self.commanded, self.is_lit) = (Some((step, light)), false);
        let mut failed = None;
        for _ in 0..TRIES {
            failed = self.act()?;
            if failed.is_none() {
                return Ok(());
            }
        }
        let Some(error) = failed else { return Ok(()) };
        self.streaks.lamp += 1;
        let text = format!("{error}; it is told again, {} steps in a row so far", self.streaks.lamp);
        self.tell(EventKind::Lamp, text)?;
        if self.streaks.lamp >= self.care.patience.pause_steps {
            return Err(self.pause(format!("no lamp for {} steps: {error}", self.streaks.lamp)));
        }
        Ok(())
    }

    /// Lights the lamp that was decided upon, and commits that it is lit; or why it is not.
    fn act(&mut self) -> Result<Option<RigError>, RecordError> {
        let Some((step, light)) = self.commanded else { return Ok(None) };
        if let Err(error) = self.rig.light(Some(light)) {
            return Ok(Some(error));
        }
        self.is_lit = true;
        self.write(|journal| journal.done(step))?;
        if std::mem::take(&mut self.streaks.lamp) > 0 {
            let text = format!("{} obeys again", self.rig.layout().name(Some(light)));
            self.tell(EventKind::Recovered, text)?;
        }
        Ok(None)
    }

    /// Goes through a recorded step at which nothing was decided.
    fn pass_again(&mut self, index: usize) -> Result<(), RecordError> {
        let (shot, step) = (self.remembered(index)?, self.past[index].step);
        let Some(next) = self.past.get(index + 1).map(|row| row.step) else {
            self.rig.recall(step, &shot);
            return self.rest();
        };
        if self.care.patience.on_fault == OnFault::Dark {
            self.commanded = None;
        }
        self.rig.relive(step, &shot, self.commanded.map(|(_, light)| light), next);
        Ok(())
    }

    /// What was seen at a recorded step, with the photograph if the tracker still needs it: the first ones, by which it knows
    /// what stands still, and from the latest ones on in which the plant was believed.
    fn remembered(&mut self, index: usize) -> Result<Shot, RecordError> {
        let row = self.past[index].clone();
        let nothing = Photo { name: row.photo.clone(), bytes: Vec::new(), time_s: row.time_s };
        let photo = if index <= self.first || index >= self.believed {
            match self.folder.photo(&row) {
                Ok(photo) => photo,
                Err(error) => {
                    self.tell(EventKind::Damaged, format!("{error}; going on without it"))?;
                    nothing
                }
            }
        } else {
            nothing
        };
        Ok(Shot { photo, seen: row.seen })
    }
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Environment for Recorded<'_, C, L, F, K> {
    type Error = RecordError;

    fn observe(&mut self) -> Result<Observation, RecordError> {
        while let Some(Row { step, seen, decided, .. }) = self.past.get(self.taken).cloned() {
            self.take(step, seen.is_measured());
            if decided.is_none() && self.is_undecidable(step) {
                self.pass_again(self.taken - 1)?;
                continue;
            }
            self.observed += 1;
            let wanted = "a tip: each step has one, measured or held";
            let error = JournalError::Value { step, column: "tip_x_cm", found: "none".to_owned(), wanted };
            return seen.observation.ok_or(RecordError::Journal(error));
        }
        loop {
            let (frame, begun) = self.photograph()?;
            let observation = self.rig.see(&frame)?;
            let step = self.rig.next_step() - 1;
            self.take(step, observation.quality == Quality::Measured);
            self.record(&frame, begun)?;
            if !self.is_undecidable(step) {
                self.observed += 1;
                return Ok(observation);
            }
            let steps = step - self.measured.unwrap_or_default();
            self.tell(
                EventKind::Missed,
                format!("1 without a decision: the plant was last believed {steps} steps ago"),
            )?;
            self.rest()?;
        }
    }

    fn step(&mut self, light: Light) -> Result<(), RecordError> {
        let index = self.taken - 1;
        if let Some(&Row { step, decided, .. }) = self.past.get(index) {
            if let Some(found) = decided.filter(|&found| found != light) {
                return Err(RecordError::Diverged { step, found, wanted: light });
            }
            let shot = self.remembered(index)?;
            if let Some(next) = self.past.get(index + 1) {
                self.commanded = Some((step, light));
                self.rig.relive(step, &shot, Some(light), next.step);
                return Ok(());
            }
            // The last recorded step: its photograph stands, its decision stands or is the same now, and whether or not
            // the lamp was lit, it is to be lit again: nobody knows what happened to it since.
            self.rig.recall(step, &shot);
        }
        self.decide(light)
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
