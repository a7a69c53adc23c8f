//! A run as pages show it, as JSON: its steps and events, and how it is.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use tropism::geometry::{Pixel, Point};
use tropism::lamps::Layout;
use tropism::observation::{Observation, Quality};
use tropism::rig::Event;
use tropism::task::Task;
use tropism::vision::Calibration;
use tropism_lab::status::{RunState, RunStatus};
use tropism_lab::{RunConfig, StepRecord};

use crate::error::Refusal;
use crate::items::WorkState;
use crate::tail::{self, SHOWN_DIGITS};
use crate::{unix_of, words};

pub(super) fn rounded(value: f64, digits: i32) -> f64 {
    let factor = 10_f64.powi(digits);
    (value * factor).round() / factor
}

/// A step of a run, as short as it can be: a run has thousands.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct Row(
    /// step
    u32,
    /// hours
    f64,
    /// x: of the tip, in cm
    Option<f64>,
    /// y: of the tip, in cm
    Option<f64>,
    /// stem: its length, in cm
    Option<f64>,
    /// lamp
    Option<String>,
    /// is_confirmed: 0 or 1
    u8,
    /// is_carried_forward: 0 or 1
    u8,
    /// status: what the photograph shows
    &'static str,
    /// confidence
    f64,
    /// unix
    Option<f64>,
    /// photo: its name, or nothing
    String,
    /// column: of the tip in the photograph
    Option<f64>,
    /// row: of the tip in the photograph
    Option<f64>,
    /// digest: its begin, of the photograph
    String,
    /// is_steered: whether a programme let the controller steer
    Option<u8>,
);

pub(super) fn row(step: &StepRecord, layout: &Layout, calibration: Option<&Calibration>) -> Row {
    let seen = step.seen.observation.as_ref();
    let number = |value: Option<f64>, digits| value.map(|value| rounded(value, digits));
    let pixel = step.seen.tip_px.or_else(|| Some(calibration?.pixel(seen?.tip)));
    Row(
        step.step,
        rounded(step.time_s / 3600.0, 3),
        number(seen.map(|seen| seen.tip.x), 2),
        number(seen.map(|seen| seen.tip.y), 2),
        number(seen.and_then(|seen| Some(seen.stem.as_ref()?.length())), 2),
        step.commanded().map(|lighting| lighting.word(layout)),
        u8::from(step.is_confirmed),
        u8::from(seen.is_none_or(|seen| seen.quality == Quality::CarriedForward)),
        step.seen.status.name(),
        rounded(step.seen.confidence, 2),
        number(step.begun.map(|begun| begun.unix_s), 0),
        if step.photo_bytes > 0 { step.photo.clone() } else { String::new() },
        number(pixel.map(|pixel| pixel.x), 1),
        number(pixel.map(|pixel| pixel.y), 1),
        step.photo_sha256.get(..SHOWN_DIGITS).unwrap_or_default().to_owned(),
        step.programme.map(|programme| u8::from(programme.acting.is_steered)),
    )
}

/// An event of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct ShownEvent {
    /// The latest step then.
    step: u32,
    kind: &'static str,
    /// What it means.
    says: &'static str,
    /// What a person should do.
    todo: Option<&'static str>,
    /// What was found and what was done about it.
    text: String,
    /// Seconds since 1970; of real plants.
    unix: Option<f64>,
    is_warning: bool,
}

pub(super) fn event_row(event: &Event) -> ShownEvent {
    let kind = event.kind.name();
    let (says, todo) = words::of_event(kind);
    ShownEvent {
        step: event.step,
        kind,
        says,
        todo,
        text: words::clean(&event.text),
        unix: event.at.map(|at| at.unix_s.round()),
        is_warning: words::is_warning(kind),
    }
}

/// How a run is, or that its folder was deleted or renamed.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub(super) enum RunNow {
    Here(Box<ShownStatus>),
    Gone { state: Gone },
}

/// That a run is not here any more.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(super) enum Gone {
    Gone,
}

/// How a run is.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(super) struct ShownStatus {
    state: WorkState,
    /// Number of the process that works on it.
    process: Option<u32>,
    /// `good`, or what to look at first.
    health: String,
    /// What acts of the programme of its rig.
    programme: Option<String>,
    /// The lamps that may still be lit though no program works on it.
    still_lit: Option<String>,
    /// When the latest photograph was written, in seconds since 1970.
    photo_unix: Option<f64>,
    /// When the next one is due, in seconds since 1970.
    next_unix: Option<f64>,
    period_s: Option<f64>,
    /// Photographs without a detected plant.
    carried_forward: usize,
    /// Those in a row up to the latest one.
    carried_forward_now: usize,
    /// Decisions that no lamp confirmed.
    unconfirmed: usize,
    /// Size of all photographs.
    bytes: u64,
    disk_gb: Option<u64>,
    /// Days until the disk is full.
    disk_days: Option<f64>,
    /// How many events of each kind there are.
    counts: BTreeMap<&'static str, usize>,
    /// For each target, where the tip first reached its height.
    crossings: Vec<Option<ShownCrossing>>,
    /// Of a task with a form of the stem.
    off: Option<Off>,
    /// Of a run that is over.
    fitness: Option<f64>,
    /// Distinguishes it from another run that lies or lay in the same folder.
    identity: Option<String>,
}

/// Where the tip first reached the height of a target.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ShownCrossing {
    step: u32,
    hours: f64,
    /// Distance from the target, in cm.
    beside: f64,
}

/// How far a stem is from the form that it is to have, in cm.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct Off {
    /// When it was last seen.
    now: Option<f64>,
    end: Option<OffAtEnd>,
}

/// How far a stem was from the form at the step at which it counts.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct OffAtEnd {
    step: u32,
    hours: f64,
    /// In cm.
    off: Option<f64>,
}

pub(super) fn status_of(
    folder: &Path,
    config: &RunConfig,
    steps: &[StepRecord],
    status: &RunStatus,
    identity: Option<String>,
) -> ShownStatus {
    let written = |step: &StepRecord| {
        let photo = folder.join("photographs").join(&step.photo);
        photo.metadata().ok()?.modified().ok().map(unix_of)
    };
    let latest = steps.iter().rev().find(|step| step.photo_bytes > 0);
    let photo_unix = latest.and_then(written);
    let is_at_work = status.process.is_some();
    // A virtual plant is as fast as it was at the last step.
    let pace = || {
        Some(photo_unix? - steps.iter().rev().filter(|step| step.photo_bytes > 0).nth(1).and_then(written)?)
    };
    let period_s = if config.is_virtual() { pace() } else { Some(60.0 * config.rig.period_min) };
    let next = photo_unix.zip(period_s).filter(|(_, period)| is_at_work && *period >= 1.0);
    ShownStatus {
        state: status.state.into(),
        process: status.process,
        health: words::health(status),
        programme: status.programme.as_ref().map(ToString::to_string),
        still_lit: status.still_lit.clone(),
        photo_unix,
        next_unix: next.map(|(photo, period)| rounded(photo + period, 1)),
        period_s,
        carried_forward: status.carried_forward,
        carried_forward_now: status.carried_forward_now,
        unconfirmed: status.unconfirmed,
        bytes: status.photographs_bytes,
        // To the gigabyte and the day: they are not news.
        disk_gb: status.disk_free_bytes.map(|bytes| bytes / 1_000_000_000),
        disk_days: status.disk_lasts_days.map(f64::round),
        counts: status.event_counts.clone(),
        crossings: crossings(&config.task, steps),
        off: off(&config.task, steps),
        fitness: fitness(config, folder, status.state),
        identity,
    }
}

/// How far the stem was last seen from the form that it is to have, and that of the step at which it counts, in cm; `None` for
/// another task.
fn off(task: &Task, steps: &[StepRecord]) -> Option<Off> {
    if !task.has_form() {
        return None;
    }
    let seen = || steps.iter().filter_map(|step| Some((step, step.observation()?)));
    let off = |seen: &Observation| Some(rounded(task.form_difference_cm(seen.stem.as_ref()?), 2));
    let end = seen().find(|(_, seen)| seen.tip.y >= task.end_height_cm);
    let end = end.map(|(step, seen)| OffAtEnd {
        step: step.step,
        hours: rounded(step.time_s / 3600.0, 2),
        off: off(seen),
    });
    Some(Off { now: seen().filter_map(|(_, seen)| off(seen)).next_back(), end })
}

/// For each target, the step at which the tip first reached its height and how far beside it.
fn crossings(task: &Task, steps: &[StepRecord]) -> Vec<Option<ShownCrossing>> {
    let crossing = |target: &Point| {
        let tips = steps.iter().filter_map(|step| Some((step, step.seen.observation.as_ref()?.tip)));
        let (step, tip) = tips.into_iter().find(|(_, tip)| tip.y >= target.y)?;
        let hours = rounded(step.time_s / 3600.0, 2);
        Some(ShownCrossing { step: step.step, hours, beside: rounded((tip.x - target.x).abs(), 2) })
    };
    task.targets.iter().map(crossing).collect()
}

fn fitness(config: &RunConfig, folder: &Path, state: RunState) -> Option<f64> {
    let has_targets = config.task.has_goal();
    let track = (state == RunState::Over && has_targets).then(|| folder.join("track.csv"))?;
    Some(config.task.fitness(&tropism_lab::files::read_track(&track).ok()?))
}

/// The stem in a photograph.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct StemSeen {
    /// Its points, in pixels; `None` if it was not seen.
    stem: Option<Vec<[f64; 2]>>,
}

/// The stem in the photograph of the step `number`.
pub(crate) fn stem(folder: &Path, number: u32) -> Result<StemSeen, Refusal> {
    let config = RunConfig::follow(folder)?;
    let step = tail::step(folder, number);
    let stem = step.as_ref().and_then(|step| Some((step, step.seen.observation.as_ref()?.stem.as_ref()?)));
    let points = stem.zip(config.calibration()).map(|((step, stem), calibration)| {
        let shift = step.seen.camera_shift.unwrap_or(Pixel::new(0.0, 0.0));
        let shifted = |point: &Point| {
            let pixel = calibration.pixel(*point);
            [rounded(pixel.x + shift.x, 1), rounded(pixel.y + shift.y, 1)]
        };
        stem.0.iter().map(shifted).collect::<Vec<_>>()
    });
    Ok(StemSeen { stem: points })
}
