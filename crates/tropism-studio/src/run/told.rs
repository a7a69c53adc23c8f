//! What pages are told of a run, as JSON: its steps and events, how it is, and what does not change.

use std::path::Path;

use serde_json::{Value, json};
use tropism::geometry::{Pixel, Point};
use tropism::lamps::Layout;
use tropism::observation::{Observation, Quality};
use tropism::rig::Event;
use tropism::task::Task;
use tropism::vision::Calibration;
use tropism_lab::files::shell_word;
use tropism_lab::status::{RunState, RunStatus};
use tropism_lab::{RunConfig, StepRecord};

use super::resume_words;
use crate::error::Refusal;
use crate::items::state_word;
use crate::tail::{self, SHOWN_DIGITS};
use crate::{unix_of, words};

pub(super) fn rounded(value: f64, digits: i32) -> f64 {
    let factor = 10_f64.powi(digits);
    (value * factor).round() / factor
}

/// Step, hours, tip in cm, length of the stem, lamp, whether it confirmed, whether the tip was carried forward, what the photograph
/// shows, confidence, time, photograph, the tip in the photograph, the begin of the photograph's digest, and whether a programme
/// let the controller steer.
pub(super) fn row(step: &StepRecord, layout: &Layout, calibration: Option<&Calibration>) -> Value {
    let seen = step.seen.observation.as_ref();
    let number = |value: Option<f64>, digits| value.map(|value| rounded(value, digits));
    let pixel = step.seen.tip_px.or_else(|| Some(calibration?.pixel(seen?.tip)));
    json!([
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
        if step.photo_bytes > 0 { step.photo.as_str() } else { "" },
        number(pixel.map(|pixel| pixel.x), 1),
        number(pixel.map(|pixel| pixel.y), 1),
        step.photo_sha256.get(..SHOWN_DIGITS).unwrap_or_default(),
        step.programme.map(|programme| u8::from(programme.acting.is_steered)),
    ])
}

pub(super) fn event_row(event: &Event) -> Value {
    let kind = event.kind.name();
    let (says, todo) = words::of_event(kind);
    json!({
        "step": event.step, "kind": kind, "says": says, "todo": todo, "text": words::clean(&event.text),
        "unix": event.at.map(|at| at.unix_s.round()), "is_warning": words::is_warning(kind),
    })
}

pub(super) fn status_json(
    folder: &Path,
    config: &RunConfig,
    steps: &[StepRecord],
    status: &RunStatus,
) -> Value {
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
    json!({
        "state": state_word(status.state),
        "process": status.process,
        "health": words::health(status),
        "programme": status.programme.as_ref().map(ToString::to_string),
        "still_lit": status.still_lit,
        "photo_unix": photo_unix,
        "next_unix": next.map(|(photo, period)| rounded(photo + period, 1)),
        "period_s": period_s,
        "carried_forward": status.carried_forward,
        "carried_forward_now": status.carried_forward_now,
        "unconfirmed": status.unconfirmed,
        "bytes": status.photographs_bytes,
        // To the gigabyte and the day: they are not news.
        "disk_gb": status.disk_free_bytes.map(|bytes| bytes / 1_000_000_000),
        "disk_days": status.disk_lasts_days.map(f64::round),
        "counts": status.event_counts,
        "crossings": crossings(&config.task, steps),
        "off": off(&config.task, steps),
        "fitness": fitness(config, folder, status.state),
    })
}

/// How far the stem was last seen from the form that it is to have, and that of the step at which it counts, in cm; `None` for
/// another task.
fn off(task: &Task, steps: &[StepRecord]) -> Option<Value> {
    if !task.has_form() {
        return None;
    }
    let seen = || steps.iter().filter_map(|step| Some((step, step.observation()?)));
    let off = |seen: &Observation| Some(rounded(task.form_difference_cm(seen.stem.as_ref()?), 2));
    let end = seen().find(|(_, seen)| seen.tip.y >= task.end_height_cm);
    let end = end.map(|(step, seen)| {
        json!({ "step": step.step, "hours": rounded(step.time_s / 3600.0, 2), "off": off(seen) })
    });
    Some(json!({ "now": seen().filter_map(|(_, seen)| off(seen)).next_back(), "end": end }))
}

/// For each target, the step at which the tip first reached its height and how far beside it.
fn crossings(task: &Task, steps: &[StepRecord]) -> Vec<Value> {
    let crossing = |target: &Point| {
        let tips = steps.iter().filter_map(|step| Some((step, step.seen.observation.as_ref()?.tip)));
        let (step, tip) = tips.into_iter().find(|(_, tip)| tip.y >= target.y)?;
        let hours = rounded(step.time_s / 3600.0, 2);
        Some(json!({ "step": step.step, "hours": hours, "beside": rounded((tip.x - target.x).abs(), 2) }))
    };
    task.targets.iter().map(|target| crossing(target).unwrap_or(Value::Null)).collect()
}

fn fitness(config: &RunConfig, folder: &Path, state: RunState) -> Option<f64> {
    let has_targets = config.task.has_goal();
    let track = (state == RunState::Over && has_targets).then(|| folder.join("track.csv"))?;
    Some(config.task.fitness(&tropism_lab::files::read_track(&track).ok()?))
}

/// What does not change in the run in `folder`, which lies `at` below the folder of the studio.
pub(crate) fn about(folder: &Path, at: &str) -> Result<Value, Refusal> {
    let config = RunConfig::follow(folder)?;
    let calibration = config.calibration();
    let pair = |pixel: Pixel| [pixel.x, pixel.y];
    let pixel = |point: &Point| calibration.map(|calibration| pair(calibration.pixel(*point)));
    let targets: Vec<Value> = (config.task.targets.iter())
        .map(|target| json!({ "x": target.x, "y": target.y, "px": pixel(target) }))
        .collect();
    let crop = config.rig.vision.crop.or_else(|| config.rig.greenhouse.as_ref().map(|tent| tent.crop()));
    let word = shell_word(Path::new(if at.is_empty() { "." } else { at }));
    Ok(json!({
        "is_virtual": config.is_virtual(),
        "controller": config.controller_description(),
        "period_min": config.rig.period_min,
        "max_steps": config.task.max_steps,
        "targets": targets,
        "obstacles": config.task.obstacles,
        "line": config.task.line.iter().map(|point| json!({ "x": point.x, "y": point.y, "px": pixel(point) })).collect::<Vec<_>>(),
        "within": config.task.has_form().then_some(config.task.within_cm),
        "end_height": Some(config.task.end_height_cm).filter(|height| height.is_finite()),
        "best": config.task.best_fitness().filter(|_| config.task.has_goal()),
        "unit": config.task.kind.unit(),
        "lamps": config.rig.layout().map_or_else(|_| Vec::new(), |layout| {
            layout.lights().map(|light| json!({ "name": layout.name(Some(light)), "side": layout.side(light) })).collect()
        }),
        "width": calibration.map(|calibration| calibration.width),
        "height": calibration.map(|calibration| calibration.height),
        "px_per_cm": calibration.map(|calibration| calibration.px_per_cm),
        "base": calibration.map(|calibration| pair(calibration.base)),
        "crop": crop.map(|crop| [crop.x, crop.y, crop.width, crop.height]),
        "commands": {
            "status": format!("tropism status {word}"),
            "stop": format!("tropism stop {word}"),
            "safe_state": format!("tropism safe-state {word}"),
            "resume": crate::jobs::line(&resume_words(folder, at)),
        },
        "seed": config.seed,
    }))
}

/// The stem in the photograph of `step`, in pixels.
pub(crate) fn stem(folder: &Path, number: u32) -> Result<Value, Refusal> {
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
    Ok(json!({ "stem": points }))
}
