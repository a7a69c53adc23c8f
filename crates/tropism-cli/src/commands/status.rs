//! `tropism status`: what a run does now.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;
use tropism::lamps::Light;
use tropism::observation::Quality;
use tropism::rig::{Event, EventKind};
use tropism_lab::{Journal, Row, RunConfig, files, holder};
use tropism_rig::alert::Kind;
use tropism_rig::clock::{SystemTimes, Time};

use super::safe_state::load_rig;
use crate::shell::Shell;
use crate::units;

/// Tell what a run does now: its step, its last photograph, its lamp, what went wrong
///
/// Looks only, at a run that goes on, has stopped or is over; a run that goes on is not disturbed.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism status bean\n  \
    watch -n 60 tropism status bean\n  \
    tropism status bean --json")]
pub(crate) struct Status {
    /// Run folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Whether a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    /// A program is at it.
    Running,
    /// A program is at it, and its next step should have been long ago.
    Overdue,
    /// No program is at it, and it is not over.
    Stopped,
    /// No program is at it: it waits for its user.
    Paused,
    /// It is over.
    Over,
}

#[derive(Serialize)]
struct Outcome {
    run: PathBuf,
    state: State,
    is_virtual: bool,
    controller: String,
    process: Option<u32>,
    /// The latest step, from 0.
    step: Option<u32>,
    max_steps: u32,
    /// Where the tip was, cm.
    tip_x_cm: Option<f64>,
    tip_y_cm: Option<f64>,
    /// The lamp that was decided upon last.
    lamp: Option<Light>,
    photograph: Option<PathBuf>,
    photograph_age_s: Option<f64>,
    /// Seconds until the next step is due; below 0 if it is late. Of real plants, and only while the run goes on.
    next_step_in_s: Option<f64>,
    /// Photographs in which the plant was not seen.
    held: usize,
    /// Those in a row up to the latest one.
    held_now: usize,
    /// Decisions whose lamp never confirmed.
    unconfirmed: usize,
    /// What the photographs take on the disk.
    photographs_bytes: u64,
    disk_free_bytes: Option<u64>,
    /// Days until the disk is full.
    disk_lasts_days: Option<f64>,
    #[serde(flatten)]
    happened: Happened,
}

/// How many of the latest events are shown.
const LATEST: usize = 5;

/// What stands in the journal beside the steps.
#[derive(Serialize)]
struct Happened {
    /// Whether a pause is the latest that the run came to.
    #[serde(skip)]
    is_paused: bool,
    /// How many events there are of each kind of which there are some.
    event_counts: BTreeMap<&'static str, usize>,
    /// The latest ones of which people are told, the last one last.
    latest_events: Vec<LatestEvent>,
}

#[derive(Serialize)]
struct LatestEvent {
    step: u32,
    kind: &'static str,
    text: String,
    /// Seconds since 1970; of real plants.
    unix_s: Option<f64>,
}

impl Happened {
    fn of(events: &[Event]) -> Self {
        let mut event_counts = BTreeMap::new();
        for event in events {
            *event_counts.entry(event.kind.name()).or_default() += 1;
        }
        let told = events.iter().rev().filter(|event| Kind::from(event.kind).is_default()).take(LATEST);
        let mut latest_events: Vec<_> = told
            .map(|Event { step, kind, text, at }| LatestEvent {
                step: *step,
                kind: kind.name(),
                text: text.clone(),
                unix_s: at.map(|at| at.unix_s),
            })
            .collect();
        latest_events.reverse();
        let state = events.iter().rfind(|event| event.kind.is_state());
        let is_paused = state.is_some_and(|event| event.kind == EventKind::Paused);
        Self { is_paused, event_counts, latest_events }
    }

    /// For people, who read it `now_s` seconds after 1970.
    fn lines(&self, now_s: f64) -> Vec<(&'static str, String)> {
        let counts = self.event_counts.iter().map(|(kind, count)| format!("{count} {kind}"));
        let mut lines = vec![("events", counts.collect::<Vec<_>>().join(", "))];
        lines.extend(self.latest_events.iter().map(|LatestEvent { step, kind, text, unix_s }| {
            let ago = unix_s.map(|unix_s| format!(", {} ago", units::time((now_s - unix_s).max(0.0))));
            ("", format!("step {step}{}: {kind}: {text}", ago.unwrap_or_default()))
        }));
        lines
    }
}

impl Status {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = RunConfig::read(&self.folder)?;
        let period_s = 60.0 * load_rig(&self.folder)?.period_min;
        let file = self.folder.join("journal.sqlite");
        let (rows, events) = Journal::open_to_read(&file)
            .and_then(|journal| Ok((journal.rows()?, journal.events()?)))
            .with_context(|| file.display().to_string())?;
        let process = holder(&self.folder)?;
        let happened = Happened::of(&events);
        let outcome = Outcome::new(self.folder, &plan, period_s, &rows, happened, process);
        shell.result(&outcome.text(), &outcome)
    }
}

impl Outcome {
    fn new(
        run: PathBuf,
        plan: &RunConfig,
        period_s: f64,
        rows: &[Row],
        happened: Happened,
        process: Option<u32>,
    ) -> Self {
        let last = rows.last();
        let is_held =
            |row: &&Row| row.seen.observation.as_ref().is_none_or(|seen| seen.quality == Quality::Held);
        let photograph = last.map(|row| run.join("photographs").join(&row.photo));
        let age = photograph.as_deref().and_then(age_s);
        let is_over = run.join("track.csv").exists();
        let next_step_in_s =
            age.filter(|_| process.is_some() && !plan.is_virtual()).map(|age| period_s - age);
        let state = match process {
            Some(_) if next_step_in_s.is_some_and(|left| left < -period_s) => State::Overdue,
            Some(_) => State::Running,
            None if is_over => State::Over,
            None if happened.is_paused => State::Paused,
            None => State::Stopped,
        };
        let tip = last.and_then(|row| row.seen.observation.as_ref()).map(|seen| seen.tip);
        let photographs_bytes = rows.iter().map(|row| row.photo_bytes).sum();
        let disk_free_bytes = files::free_bytes(&run).ok();
        let per_day = 86_400.0 / period_s * photographs_bytes as f64 / rows.len().max(1) as f64;
        Self {
            state,
            is_virtual: plan.is_virtual(),
            controller: plan.controller_description(),
            process,
            step: last.map(|row| row.step),
            max_steps: plan.task.max_steps(),
            tip_x_cm: tip.map(|tip| tip.x),
            tip_y_cm: tip.map(|tip| tip.y),
            lamp: rows.iter().rev().find_map(|row| row.decided),
            photograph,
            photograph_age_s: age,
            next_step_in_s,
            held: rows.iter().filter(is_held).count(),
            held_now: rows.iter().rev().take_while(is_held).count(),
            unconfirmed: rows.iter().filter(|row| row.decided.is_some() && !row.is_done).count(),
            photographs_bytes,
            disk_free_bytes,
            happened,
            disk_lasts_days: disk_free_bytes.filter(|_| per_day > 0.0).map(|free| free as f64 / per_day),
            run,
        }
    }

    fn text(&self) -> String {
        let kind = if self.is_virtual { "a virtual plant" } else { "a plant" };
        let run = self.run.display();
        let process = self.process.map_or_else(String::new, |process| format!(" (process {process})"));
        let mut lines = vec![match self.state {
            State::Running => format!("{run}: goes on{process}, {kind}"),
            State::Overdue => format!("{run}: OVERDUE, its program hangs or waits{process}, {kind}"),
            State::Stopped => {
                format!("{run}: stopped before its end, {kind}; the same command with --resume goes on")
            }
            State::Paused => {
                format!("{run}: paused, {kind}; the same command with --resume goes on")
            }
            State::Over => format!("{run}: over, {kind}"),
        }];
        let mut say = |name: &str, text: String| lines.push(format!("{name:<12} {text}"));
        say("controller", self.controller.clone());
        match self.step {
            None => say("step", format!("none yet, of {} at most", self.max_steps)),
            Some(step) => say("step", format!("{step} of {} at most", self.max_steps)),
        }
        if let Some((x, y)) = self.tip_x_cm.zip(self.tip_y_cm) {
            let held = match self.held_now {
                0 => String::new(),
                1 => ", HELD: the latest photograph does not show it".to_owned(),
                count => format!(", HELD: the latest {count} photographs do not show it"),
            };
            say("tip", format!("{x:.1}, {y:.1} cm{held}"));
        }
        if self.process.is_some() {
            say("lamp", self.lamp.map_or_else(|| "not decided yet".to_owned(), |lamp| lamp.to_string()));
        }
        if let Some((photograph, age)) = self.photograph.as_ref().zip(self.photograph_age_s) {
            say("photograph", format!("{} ago: {}", units::time(age), photograph.display()));
        }
        match self.next_step_in_s {
            Some(left) if left >= 0.0 => say("next step", format!("in about {}", units::time(left))),
            Some(late) => say("next step", format!("about {} late", units::time(-late))),
            None => {}
        }
        say("held", format!("{} photographs without the plant", self.held));
        say("unconfirmed", format!("{} decisions whose lamp did not confirm", self.unconfirmed));
        if let Some(free) = self.disk_free_bytes {
            let lasts = match self.disk_lasts_days.filter(|_| self.process.is_some() && !self.is_virtual) {
                Some(days) if days < 1000.0 => format!(", enough for {}", units::time(86_400.0 * days)),
                _ => String::new(),
            };
            let used = units::bytes(self.photographs_bytes);
            say("disk", format!("{used} of photographs, {} left{lasts}", units::bytes(free)));
        }
        for (name, text) in self.happened.lines(SystemTimes.unix_s()) {
            say(name, text);
        }
        lines.join("\n")
    }
}

/// Seconds since a file was written; a clock that was set back meanwhile makes it 0.
fn age_s(path: &Path) -> Option<f64> {
    let written = std::fs::metadata(path).and_then(|about| about.modified()).ok()?;
    Some(SystemTime::now().duration_since(written).unwrap_or_default().as_secs_f64())
}
