//! The workflow `status`: what a run, an evolution, a study or other long work does now, read from its folder without
//! disturbing it.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::lamps::Layout;
use tropism::lighting::Lighting;
use tropism::observation::Quality;
use tropism::programme::Acting;
use tropism::rig::{Event, EventKind};
use tropism::task::{TargetOutlook, outlook};
use tropism::track::Sample;
use tropism_rig::alert::Kind;

use crate::baseline::BaselinePlan;
use crate::calibrate::CalibratePlan;
use crate::error::Error;
use crate::evolve::EvolvePlan;
use crate::files;
use crate::folder::{has_journal, read_journal};
use crate::forecast::ForecastPlan;
use crate::grow::GrowPlan;
use crate::journal::StepRecord;
use crate::light_day::LightOfDay;
use crate::lock::holder;
use crate::monitor::Monitor;
use crate::replicates::ReplicatesPlan;
use crate::run::RunConfig;
use crate::simulate;
use crate::study::StudyPlan;
use crate::sweep::SweepPlan;
use crate::transfer::TransferPlan;
use crate::tune;
use crate::wall::WallStudyPlan;
use crate::watchdog::ALL_OFF;
use crate::work::{Work, WorkStatus};
use crate::workflow::Workflow;

/// The work to look at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusPlan {
    /// Folder of a run or of long work, or the file of a rule.
    pub folder: PathBuf,
    /// Of a run: file of a model, by which it is said how probably the plant passes each target.
    #[serde(default)]
    pub model: Option<PathBuf>,
}

/// What the work in a folder does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum StatusResults {
    /// A run.
    Run(Box<RunStatus>),
    /// Long work.
    Work(WorkStatus),
}

/// Whether a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    /// A program works on it.
    Running,
    /// A program works on it, and its next step was due more than a period ago.
    Overdue,
    /// It was asked to end, and is not over.
    Stopped,
    /// No program works on it, and it is not over: an error ended it, it was killed, or the computer went down.
    Died,
    /// No program works on it: it waits for its user.
    Paused,
    /// It is over.
    Over,
}

/// What a run does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RunStatus {
    /// Run folder.
    pub run: PathBuf,
    /// Whether it goes on.
    pub state: RunState,
    /// Whether the plant is virtual.
    pub is_virtual: bool,
    /// The controller in a few words.
    pub controller: String,
    /// Number of the process that works on it.
    pub process: Option<u32>,
    /// The latest step, from 0.
    pub step: Option<u32>,
    /// The most steps of its task.
    pub max_steps: u32,
    /// The latest tip, in cm to the right of the root.
    pub tip_x_cm: Option<f64>,
    /// The latest tip, in cm above the soil.
    pub tip_y_cm: Option<f64>,
    /// The lighting that the lamps were commanded last, with their names in the rig.
    pub lamp: Option<String>,
    /// What acts of the programme of its rig; left out without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub programme: Option<ProgrammeStatus>,
    /// Light of the 24 hours up to the latest step; of real plants.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light: Option<LightOfDay>,
    /// The lamps that may still be lit though no program works on the run; of real plants.
    pub still_lit: Option<String>,
    /// File of the latest photograph.
    pub photograph: Option<PathBuf>,
    /// Its age in seconds.
    pub photograph_age_s: Option<f64>,
    /// Seconds until the next step is due, below 0 if it is late; of real plants while the run goes on.
    pub next_step_in_s: Option<f64>,
    /// How probably the plant of a run passes each target; empty without a model.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outlook: Vec<TargetOutlook>,
    /// Photographs without a detected plant.
    pub carried_forward: usize,
    /// Those in a row up to the latest one.
    pub carried_forward_now: usize,
    /// Decisions that no lamp confirmed.
    pub unconfirmed: usize,
    /// Size of all photographs.
    pub photographs_bytes: u64,
    /// Free bytes on the disk.
    pub disk_free_bytes: Option<u64>,
    /// Days until the disk is full.
    pub disk_lasts_days: Option<f64>,
    /// How many events of each kind there are; kinds without events are left out.
    pub event_counts: BTreeMap<&'static str, usize>,
    /// The latest events that people are alerted to by default, in order.
    pub latest_events: Vec<LatestEvent>,
}

/// What acted of a programme at the latest step.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ProgrammeStatus {
    /// Number of the part, from 1; 0 outside of all.
    pub part: u32,
    /// Its times, such as `06:00 to 22:00`; `night` outside of all parts.
    pub times: String,
    /// Whether what is decided is lit.
    pub is_steered: bool,
    /// The base light, with the names of the rig.
    pub base: String,
}

impl ProgrammeStatus {
    /// What acted at the latest of `steps` that has a command.
    fn of(config: &RunConfig, layout: &Layout, steps: &[StepRecord]) -> Option<Self> {
        let Acting { part, is_steered, base } = steps.iter().rev().find_map(|step| step.programme)?.acting;
        let of_file = (part as usize).checked_sub(1).and_then(|index| config.rig.programme.get(index));
        Some(Self {
            part,
            times: of_file.map_or_else(|| "night".to_owned(), ToString::to_string),
            is_steered,
            base: base.word(layout),
        })
    }
}

impl fmt::Display for ProgrammeStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let steered = if self.is_steered { "steered" } else { "not steered" };
        write!(f, "{}, {steered}, base light {}", self.times, self.base)
    }
}

/// An event of a run.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LatestEvent {
    /// The latest step then.
    pub step: u32,
    /// Kind of event.
    pub kind: &'static str,
    /// What was found and what was done about it.
    pub text: String,
    /// Seconds since 1970; of real plants.
    pub unix_s: Option<f64>,
}

/// How many of the latest events are listed.
const LATEST_EVENTS: usize = 5;

const SECONDS_PER_DAY: f64 = 86_400.0;

/// What writes folders that have a status.
const WRITERS: &str = "`run`, `evolve`, `study`, `sweep`, `transfer`, `forecast`, `calibrate`, `baseline` or `grow --photographs`";

/// The status of the work in a folder; `None` if there is none of its kind.
type StatusIn = fn(&Path) -> Option<Result<WorkStatus, Error>>;

const WORKS: [StatusIn; 10] = [
    status_in::<StudyPlan>,
    status_in::<SweepPlan>,
    status_in::<EvolvePlan>,
    status_in::<TransferPlan>,
    status_in::<ReplicatesPlan>,
    status_in::<WallStudyPlan>,
    status_in::<ForecastPlan>,
    status_in::<CalibratePlan>,
    status_in::<BaselinePlan>,
    status_in::<GrowPlan>,
];

fn status_in<W: Work>(folder: &Path) -> Option<Result<WorkStatus, Error>> {
    folder.join(W::RECORD).exists().then(|| W::status(folder))
}

impl Workflow for StatusPlan {
    type Results = StatusResults;
    const SCHEMA: &'static str = "tropism.run-status/1";

    fn check(&self) -> Result<(), Error> {
        Ok(())
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<StatusResults, Error> {
        let folder = &self.folder;
        let of_work = |work| match &self.model {
            None => Ok(StatusResults::Work(work)),
            Some(_) => Err(Error::Plan(format!(
                "{}: found long work, wanted a run: `model` says what becomes of the plant of a run",
                folder.display()
            ))),
        };
        if let Some(work) = WORKS.iter().find_map(|status| status(folder)) {
            return of_work(work?);
        }
        if !folder.is_dir() {
            return match tune::status(folder)? {
                Some(search) => of_work(search),
                None => Err(Error::Plan(format!(
                    "{}: there is no such folder or file: name a folder that {WRITERS} wrote, or the file of a rule",
                    folder.display()
                ))),
            };
        }
        if !folder.join("run.toml").exists() && !folder.join("journal.sqlite").exists() {
            return Err(Error::Plan(format!("{}: this is no folder that {WRITERS} wrote", folder.display())));
        }
        let config = RunConfig::read(&self.folder)?;
        config.rig.check().map_err(Error::at(self.folder.display()))?;
        if !has_journal(&self.folder) {
            return Err(Error::Plan(format!(
                "{}: there is no journal: exports, and plants that `grow` photographed, have none",
                self.folder.display()
            )));
        }
        let (steps, events) = read_journal(&self.folder)?;
        let process = holder(&self.folder)?;
        let run = of_run(&self.folder, &config, &steps, &events, process);
        let outlook = match &self.model {
            Some(model) => outlook_of(&config, &steps, model)?,
            None => Vec::new(),
        };
        Ok(StatusResults::Run(Box::new(RunStatus { outlook, ..run })))
    }
}

/// The status of the run in `folder` of which `steps` and `events` are known, and on which `process` works.
#[must_use]
pub fn of_run(
    folder: &Path,
    config: &RunConfig,
    steps: &[StepRecord],
    events: &[Event],
    process: Option<u32>,
) -> RunStatus {
    let period_s = 60.0 * config.rig.period_min;
    let last = steps.last();
    let is_carried_forward = |step: &&StepRecord| {
        step.seen.observation.as_ref().is_none_or(|seen| seen.quality == Quality::CarriedForward)
    };
    let photograph = last.map(|step| folder.join("photographs").join(&step.photo));
    let age = photograph.as_deref().and_then(files::age_s);
    let next_step_in_s = age.filter(|_| process.is_some() && !config.is_virtual()).map(|age| period_s - age);
    let tip = last.and_then(|step| step.observation()).map(|seen| seen.tip);
    let photographs_bytes = steps.iter().map(|step| step.photo_bytes).sum();
    let disk_free_bytes = files::free_bytes(folder).ok();
    let per_day = SECONDS_PER_DAY / period_s * photographs_bytes as f64 / steps.len().max(1) as f64;
    let state = state(folder, process, next_step_in_s.is_some_and(|left| left < -period_s), events);
    let lamp = steps.iter().rev().find_map(StepRecord::commanded);
    let may_be_lit =
        state == RunState::Died && !config.is_virtual() && !is_put_off(folder, photograph.as_deref());
    let still_lit = lamp.filter(|&lighting| may_be_lit && lighting != Lighting::DARK);
    let layout = config.rig.layout().unwrap_or_default();
    RunStatus {
        run: folder.to_owned(),
        state,
        is_virtual: config.is_virtual(),
        controller: config.controller_description(),
        process,
        step: last.map(|step| step.step),
        max_steps: config.task.max_steps,
        tip_x_cm: tip.map(|tip| tip.x),
        tip_y_cm: tip.map(|tip| tip.y),
        lamp: lamp.map(|lighting| lighting.word(&layout)),
        programme: ProgrammeStatus::of(config, &layout, steps),
        light: LightOfDay::of_run(&config.rig, steps),
        still_lit: still_lit.map(|lighting| lighting.word(&layout)),
        photograph,
        photograph_age_s: age,
        next_step_in_s,
        outlook: Vec::new(),
        carried_forward: steps.iter().filter(is_carried_forward).count(),
        carried_forward_now: steps.iter().rev().take_while(is_carried_forward).count(),
        unconfirmed: steps.iter().filter(|step| step.decided.is_some() && !step.is_confirmed).count(),
        photographs_bytes,
        disk_free_bytes,
        disk_lasts_days: disk_free_bytes.filter(|_| per_day > 0.0).map(|free| free as f64 / per_day),
        event_counts: event_counts(events),
        latest_events: latest_events(events),
    }
}

/// Simulated plants of an outlook. Chosen: the standard error of a probability is 0.035 at most.
const OUTLOOK_PLANTS: u32 = 200;

/// The probability that the plant of a run passes each target, by the model in a file: under the run's controller.
fn outlook_of(config: &RunConfig, steps: &[StepRecord], model: &Path) -> Result<Vec<TargetOutlook>, Error> {
    if config.task.targets.is_empty() {
        return Err(Error::Plan("`model`: the task of the run has no targets".to_owned()));
    }
    let futures = simulate::continued(model, config, steps, OUTLOOK_PLANTS, config.task.max_steps)?;
    let observed: Vec<Sample> = simulate::observed(steps).into_iter().map(|seen| seen.sample).collect();
    Ok(outlook(&config.task, &observed, &futures))
}

fn state(folder: &Path, process: Option<u32>, is_overdue: bool, events: &[Event]) -> RunState {
    let latest = events.iter().rfind(|event| event.kind.is_state()).map(|event| event.kind);
    match process {
        Some(_) if is_overdue => RunState::Overdue,
        Some(_) => RunState::Running,
        None if folder.join("track.csv").exists() => RunState::Over,
        None if latest == Some(EventKind::Paused) => RunState::Paused,
        None if latest == Some(EventKind::Stopped) => RunState::Stopped,
        None => RunState::Died,
    }
}

/// Whether the watchdog of a run that died has put all its light off since its latest photograph: the end of its log says so.
fn is_put_off(folder: &Path, photograph: Option<&Path>) -> bool {
    let log = folder.join("watchdog.log");
    let text = files::read_text(&log).unwrap_or_default();
    let is_later = photograph
        .and_then(files::age_s)
        .zip(files::age_s(&log))
        .is_some_and(|(photograph, log)| log <= photograph);
    is_later && text.lines().next_back() == Some(ALL_OFF)
}

fn event_counts(events: &[Event]) -> BTreeMap<&'static str, usize> {
    let mut counts = BTreeMap::new();
    for event in events {
        *counts.entry(event.kind.name()).or_default() += 1;
    }
    counts
}

fn latest_events(events: &[Event]) -> Vec<LatestEvent> {
    let latest = events.iter().rev().filter(|event| Kind::from(event.kind).is_default()).take(LATEST_EVENTS);
    let mut latest: Vec<_> = latest
        .map(|Event { step, kind, text, at }| LatestEvent {
            step: *step,
            kind: kind.name(),
            text: text.clone(),
            unix_s: at.map(|at| at.unix_s),
        })
        .collect();
    latest.reverse();
    latest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::folder::RECORDS;

    #[test]
    fn each_work_has_a_record_of_its_own_that_others_know() {
        let folder = tempfile::tempdir().unwrap();
        for record in RECORDS {
            let path = folder.path().join(record);
            std::fs::write(&path, "").unwrap();
            let works = WORKS.iter().filter(|status| status(folder.path()).is_some()).count();
            assert_eq!(works, usize::from(record != "run.toml"), "{record}");
            std::fs::remove_file(&path).unwrap();
        }
        assert_eq!(RECORDS.len(), WORKS.len() + 1);
    }
}
