//! The workflow `run`: the loop of photograph, decision and lamp, recorded in a run folder.
//!
//! In comes a [`RunPlan`]: a run folder and its [`RunConfig`], the text of `run.toml`. Out come [`RunResults`], the track
//! and the folder. A run that was interrupted by an end, a kill or a power cut is executed again with the same plan and ends
//! with the same bits as without the interruption.

pub(crate) mod watchdog;
mod alerts;
mod config;
mod start;

use std::ops::{ControlFlow, RangeInclusive};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism::environment::{self, Environment};
use tropism::observation::Quality;
use tropism::rig::{Camera, Clock, EventKind, Flash, Lamps, RunMonitor};
use tropism::text::plural;
use tropism::track::{Sample, Track};
use tropism_bean::tent::TentHandle;

use crate::error::Error;
use crate::files;
use crate::folder::RunFolder;
use crate::journal::Journal;
use crate::light_day::LightLimits;
use crate::monitor::Monitor;
use crate::recorder::{RecordError, Recorder, Supervision};
use crate::sequences;
use crate::workflow::Workflow;
use alerts::{AlertMonitor, Alerts, HostMonitor, WatchdogMonitor, WorkflowMonitor};
use watchdog::Watchdog;

pub(crate) use config::rig_faults;
pub use config::{RunConfig, read_rig};

/// A run and where it is recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunPlan {
    /// Run folder. It is made, or holds a run of the same configuration that is resumed.
    pub out: PathBuf,
    /// Whether to resume a run that is paused, over, or was down for longer than its rig allows.
    pub resume: bool,
    /// How many times as fast as a real plant a virtual one grows, 0.001 to 1e9; as fast as the machine can if it is left
    /// out. The results do not depend on it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed: Option<f64>,
    /// The program `tropism`, which is started as the [watchdog](crate::watchdog) of a real run; without one there is none.
    #[serde(skip)]
    pub watchdog: Option<PathBuf>,
    /// The rig file whose alerts these are; the run folder keeps its path alone, for alerts hold secrets.
    #[serde(skip)]
    pub rig_file: Option<PathBuf>,
    /// Everything that decides the outcome.
    pub config: RunConfig,
}

impl Default for RunPlan {
    /// The paper's open-loop experiment in the virtual tent, recorded in the folder `run`.
    fn default() -> Self {
        Self {
            out: "run".into(),
            resume: false,
            speed: None,
            watchdog: None,
            rig_file: None,
            config: RunConfig::default(),
        }
    }
}

/// Speeds of a virtual tent that can be asked for.
const SPEEDS: RangeInclusive<f64> = 0.001..=1e9;

/// The file of the speed of a virtual tent. No result depends on it.
const SPEED: &str = "speed";

/// How many times as fast as a real plant the virtual one of the run in `folder` grew last; `None` if it grew as fast as the
/// machine could.
#[must_use]
pub fn speed_of(folder: &Path) -> Option<f64> {
    let speed: f64 = files::read_text(&folder.join(SPEED)).ok()?.trim().parse().ok()?;
    SPEEDS.contains(&speed).then_some(speed)
}

/// The file with the path of the rig file whose alerts a run has.
const ALERTS_OF: &str = "alerts-of";

/// The rig file whose alerts the run in `folder` had last; `None` if it had none.
#[must_use]
pub fn alerts_of(folder: &Path) -> Option<PathBuf> {
    Some(PathBuf::from(files::read_text(&folder.join(ALERTS_OF)).ok()?.trim_end_matches('\n')))
}

/// What a run left.
#[derive(Clone, Debug, Serialize)]
pub struct RunResults {
    /// Run folder.
    pub run: PathBuf,
    /// Whether the plant is virtual.
    pub is_virtual: bool,
    /// Number of the last step, as the track numbers it.
    pub steps: usize,
    /// Steps before it that were missed: the track lacks them.
    #[serde(default)]
    pub missed: usize,
    /// Photographs without a detected plant, for which the last tip was carried forward.
    pub carried_forward: usize,
    /// Fitness by eq. (9), in cm; `None` without targets.
    pub fitness: Option<f64>,
    /// File of the track.
    #[serde(rename = "track")]
    pub track_file: PathBuf,
    /// The track.
    #[serde(skip)]
    pub track: Track,
}

impl RunPlan {
    /// The plan that resumes or repeats the run in the folder `out` from its `run.toml` alone.
    ///
    /// # Errors
    /// Those of [`RunConfig::read`].
    pub fn of_folder(out: &Path, resume: bool) -> Result<Self, Error> {
        Ok(Self { out: out.to_owned(), resume, config: RunConfig::read(out)?, ..Self::default() })
    }

    /// Runs in `folder`, or resumes the run there, and leaves the light as it is to be on exit.
    fn record(&self, folder: RunFolder, alerts: &Alerts, monitor: &dyn Monitor) -> Result<Track, Error> {
        let (rig, out) = (&self.config.rig, &*self.out);
        if let Some(file) = self.rig_file.as_deref().filter(|_| !rig.alert.is_empty()) {
            let file = std::path::absolute(file).map_err(Error::at(file.display()))?;
            files::write(&out.join(ALERTS_OF), format!("{}\n", file.display()).as_bytes())?;
        }
        let pace = self.pace(monitor)?;
        let mut watchdog = None;
        let mut monitors: Vec<Box<dyn RunMonitor + '_>> =
            vec![Box::new(AlertMonitor(alerts)), Box::new(WorkflowMonitor(monitor))];
        let mut since_start = Duration::ZERO;
        if !rig.is_virtual() {
            monitors.push(Box::new(HostMonitor::new(rig.fault_policy().hot_c)));
            since_start = start::since_start(rig, &folder, self.resume, &mut monitors)?;
        }
        // Before the watchdog: a run that is refused has no light to put off.
        let locks = rig.lock_devices().map_err(Error::at("rig"))?;
        if let Some(program) = self.watchdog.as_deref().filter(|_| !rig.is_virtual()) {
            let started = Rc::new(Watchdog::start(program, out, rig)?);
            monitors.push(Box::new(WatchdogMonitor(Rc::clone(&started))));
            watchdog = Some(started);
        }
        let open = rig.open_locked(locks, self.config.seed, since_start).map_err(Error::at("rig"))?;
        let supervision = Supervision {
            policy: rig.fault_policy(),
            lamps_in_view: rig.lamps_in_view.clone(),
            programme: rig.programme().map_err(Error::at("rig"))?,
            light: LightLimits::of(rig),
            last_step: self.config.task.max_steps,
            monitor: Box::new(monitors),
        };
        let mut recorder = Recorder::new(open.rig, folder, supervision)?;
        let done = self.follow(&mut recorder, open.truth.as_ref(), pace, alerts, monitor);
        if let Some(error) = fault(&done) {
            recorder.record_fault(&error.with_causes());
        }
        let is_dark = recorder.close();
        if let Some(watchdog) = watchdog {
            watchdog.end(matches!(is_dark, Ok(true)));
        }
        let track = done?;
        is_dark?;
        Ok(track)
    }

    /// Steps to the end of the run, and writes the files of a run that is over.
    fn follow(
        &self,
        recorder: &mut OpenRecorder<'_>,
        tent: Option<&TentHandle>,
        mut pace: Option<Pace<'_>>,
        alerts: &Alerts,
        monitor: &dyn Monitor,
    ) -> Result<Track, Error> {
        let (rig, out) = (&self.config.rig, &*self.out);
        let mut is_over = true;
        let layout = recorder.layout().clone();
        let programme = rig.programme().map_err(Error::at("rig"))?;
        let clock: Box<dyn Clock> = match tent {
            Some(tent) => Box::new(tent.clone()),
            None => Box::new(rig.clock(Duration::ZERO).map_err(Error::at("rig"))?),
        };
        // What the programme makes of a decision.
        let acting = |sample: &Sample| {
            let mut sample = sample.clone();
            if let Some(programme) = programme.as_ref().filter(|_| !sample.is_dark()) {
                sample.set_lighting(programme.at(clock.time_of_day()).lighting(sample.lighting()));
            }
            sample
        };
        let mut watch = |sample: &Sample| {
            if let Some(pace) = &mut pace {
                pace.wait_for(sample.step);
            }
            monitor.advance(1);
            let acting = acting(sample);
            alerts.step(&acting, &layout, rig.period_min, out);
            monitor.sample(&acting);
            let may_go_on = monitor.may_go_on();
            is_over &= may_go_on || sample.is_dark();
            if may_go_on { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let mut controller =
            self.config.controller.build(&self.config.task, recorder.layout(), rig.period_min);
        let done = environment::run(recorder, &mut *controller, &self.config.task, &mut watch);
        let interrupted = || Error::Interrupted { folder: out.to_owned() };
        let track = match done {
            Err(RecordError::Stopped) => return Err(interrupted()),
            Err(RecordError::Paused(reason)) => return Err(Error::Paused { folder: out.to_owned(), reason }),
            other => other?,
        };
        if !is_over {
            recorder.report(EventKind::Stopped, "asked to end".to_owned())?;
            return Err(interrupted());
        }
        if let Some(device) = tent {
            files::write(&out.join("truth.csv"), &device.truth_csv())?;
            files::write(&out.join("truth.jsonl"), &device.truth_json())?;
        }
        self.write_calibration()?;
        let track = recorder.folder().write_track(&track)?;
        if recorder.folder().journal().state()?.is_none_or(|state| state.kind != EventKind::Finished) {
            recorder.report(EventKind::Finished, steps_text(&track))?;
        }
        Ok(track)
    }

    /// What holds the steps of a virtual tent back, if anything does. The folder keeps the speed for those who go on with it.
    fn pace<'a>(&self, monitor: &'a dyn Monitor) -> Result<Option<Pace<'a>>, Error> {
        let kept = self.out.join(SPEED);
        let Some(speed) = self.speed else {
            files::remove(&kept)?;
            return Ok(None);
        };
        files::write(&kept, format!("{speed}\n").as_bytes())?;
        let journal = self.out.join("journal.sqlite");
        let past = Journal::find(&journal)
            .and_then(|journal| journal.map_or(Ok(0), |journal| journal.step_count()))
            .map_err(Error::at(journal.display()))?;
        let per_step = Duration::from_secs_f64(60.0 * self.config.rig.period_min / speed);
        Ok(Some(Pace { monitor, per_step, past, started: None }))
    }

    fn write_calibration(&self) -> Result<(), Error> {
        let Some(calibration) = self.config.calibration() else { return Ok(()) };
        let text = toml::to_string(&calibration).map_err(Error::at("calibration.toml"))?;
        files::write(&self.out.join("calibration.toml"), text.as_bytes())?;
        let side = self.out.join("side");
        if side.exists() {
            // The cameras of a virtual tent are alike.
            let own = self.config.rig.side.as_ref().map(|side| toml::to_string(&side.calibration));
            let text = own.transpose().map_err(Error::at("calibration.toml"))?.unwrap_or(text);
            files::write(&side.join("calibration.toml"), text.as_bytes())?;
        }
        Ok(())
    }
}

impl Workflow for RunPlan {
    type Results = RunResults;
    const SCHEMA: &'static str = "tropism.run/2";

    fn check(&self) -> Result<(), Error> {
        if let Some(speed) = self.speed {
            if !SPEEDS.contains(&speed) {
                return Err(Error::Plan(format!("`speed` {speed}: wanted 0.001 to 1e9")));
            }
            if !self.config.is_virtual() {
                return Err(Error::Plan(format!(
                    "`speed` {speed}: this is a real tent, and real plants take their time"
                )));
            }
        }
        self.config.check()
    }

    fn prepare(&mut self) -> Result<(), Error> {
        let RunConfig { task, rig, seed, .. } = &mut self.config;
        let tent = rig.greenhouse.clone().unwrap_or_default();
        sequences::draw(task, &tent, rig.period_min, *seed)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<RunResults, Error> {
        let folder = self.config.open_folder(&self.out, self.resume);
        // A folder that another program or another run has is left as it is, and no alert is sent.
        if matches!(&folder, Err(Error::Folder(error)) if error.is_refusal()) {
            folder?;
            unreachable!("an error returned above");
        }
        if let Some(greenhouse) = &self.config.rig.greenhouse {
            crate::reach::note_out_of_reach(&self.config.task, &greenhouse.bean, monitor);
        }
        let max_steps = u64::from(self.config.task.max_steps);
        monitor.stage("run", max_steps);
        let alerts = Alerts::open(&self.config.rig, &self.out)?;
        let done = folder.and_then(|folder| self.record(folder, &alerts, monitor));
        if let Some(error) = fault(&done) {
            alerts.fault(error);
            monitor.status(&format!("fault: {}", error.with_causes()));
        }
        monitor.closing();
        alerts.close(monitor);
        let track = done?;
        // A task that ended early leaves the rest of the stage.
        monitor.advance(max_steps.saturating_sub(track.samples.len() as u64));
        let task = &self.config.task;
        Ok(RunResults {
            run: self.out.clone(),
            is_virtual: self.config.is_virtual(),
            steps: last_step(&track),
            missed: missed_steps(&track),
            carried_forward: track
                .samples
                .iter()
                .filter(|sample| sample.quality == Quality::CarriedForward)
                .count(),
            fitness: (task.has_goal()).then(|| task.fitness(&track)),
            track_file: self.out.join("track.csv"),
            track,
        })
    }
}

/// The error that ended a run. People heard of a pause when it happened, and an end was asked for.
fn fault(done: &Result<Track, Error>) -> Option<&Error> {
    done.as_ref().err().filter(|error| !matches!(error, Error::Paused { .. } | Error::Interrupted { .. }))
}

/// The number of the last step of a track.
fn last_step(track: &Track) -> usize {
    track.samples.last().map_or(0, |last| last.step as usize)
}

/// Steps before the last one of a track that it lacks.
fn missed_steps(track: &Track) -> usize {
    (last_step(track) + 1).saturating_sub(track.samples.len())
}

/// How long a run was, counted as its track counts.
fn steps_text(track: &Track) -> String {
    match missed_steps(track) {
        0 => plural(last_step(track), "step"),
        missed => format!("{}, of which {missed} were missed", plural(last_step(track), "step")),
    }
}

/// The recorder of whatever rig a file describes.
type OpenRecorder<'a> = Recorder<'a, Box<dyn Camera>, Box<dyn Lamps>, Box<dyn Flash>, Box<dyn Clock>>;

/// Holds the steps of a virtual tent back, so that people can watch it.
struct Pace<'a> {
    monitor: &'a dyn Monitor,
    per_step: Duration,
    /// Steps that were taken before an interruption; they are replayed at once.
    past: u32,
    started: Option<Instant>,
}

impl Pace<'_> {
    /// Returns when the step is due, or when the monitor asks for an end.
    fn wait_for(&mut self, step: u32) {
        let Some(due) = step.checked_sub(self.past) else { return };
        let started = *self.started.get_or_insert_with(Instant::now);
        while let Some(left) = (self.per_step * due).checked_sub(started.elapsed())
            && self.monitor.may_go_on()
        {
            std::thread::sleep(left.min(Duration::from_millis(50)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missed_steps_are_counted_as_the_track_numbers_them() {
        let csv = "step,tip_x_cm,tip_y_cm,light\n0,0,4,left\n1,0,4,left\n5,0,4,right\n6,0,4,dark\n";
        let track = Track::read_csv(csv.as_bytes()).unwrap();
        assert_eq!((last_step(&track), missed_steps(&track)), (6, 3));
        assert_eq!(steps_text(&track), "6 steps, of which 3 were missed");
        let whole = Track { samples: track.samples[..2].to_vec(), ..track };
        assert_eq!(steps_text(&whole), "1 step");
    }
}
