//! A run, live: its steps and events as they are recorded, read from the journal without disturbing it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use serde_json::{Value, json};
use tropism::geometry::{Pixel, Point};
use tropism::lamps::Layout;
use tropism::observation::{Observation, Quality};
use tropism::rig::Event;
use tropism::task::Task;
use tropism::track::Track;
use tropism::vision::Calibration;
use tropism_lab::ControllerSpec;
use tropism_lab::files::shell_word;
use tropism_lab::run::speed_of;
use tropism_lab::status::{self, RunState, RunStatus};
use tropism_lab::{RunConfig, StepRecord, holder, simulate};
use tropism_page::thinned;

use crate::error::Refusal;
use crate::items::state_word;
use crate::stream::{Listened, Message};
use crate::tail::{self, SHOWN_DIGITS, Tail};
use crate::{unix_of, words};

/// How often a run is looked at.
pub(crate) const PAUSE: Duration = Duration::from_millis(500);

/// A run that goes on is read again at least so often: what is overdue changes by itself.
const REREAD: Duration = Duration::from_secs(3);

/// Simulated plants of a prediction.
const PREDICTED: u32 = 200;

/// Steps that they go on at most: three days and a half.
const LOOKS_AHEAD: u32 = 1000;

/// What tells a run from another that lies or lay in the same folder: its settings are written once.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Identity {
    written: SystemTime,
    inode: u64,
}

impl Identity {
    /// That of the run in `folder`; `None` if there is none.
    pub(crate) fn of(folder: &Path) -> Option<Self> {
        let data = folder.join("run.toml").metadata().ok()?;
        #[cfg(unix)]
        let inode = std::os::unix::fs::MetadataExt::ino(&data);
        #[cfg(not(unix))]
        let inode = 0;
        Some(Self { written: data.modified().ok()?, inode })
    }

    /// It in one word.
    fn word(self) -> String {
        format!("{:x}-{:x}", (1e6 * unix_of(self.written)) as u64, self.inode)
    }
}

/// A run at a time.
pub(crate) struct RunView {
    version: u64,
    /// One row of JSON a step; the last one may still change.
    rows: Vec<Arc<str>>,
    /// Rows that do not change any more.
    settled: usize,
    events: Vec<Arc<str>>,
    /// JSON.
    status: String,
}

impl Listened for RunView {
    fn since(&self, id: Option<&str>) -> Vec<Message> {
        let known: Vec<u64> =
            id.into_iter().flat_map(|id| id.split('.')).map_while(|part| part.parse().ok()).collect();
        let (mut rows, mut events) = (0, 0);
        if let [steps, seen, version] = known[..] {
            if version == self.version {
                return Vec::new();
            }
            // Of a run that is longer than this one nothing is kept: it is another run.
            if steps as usize <= self.rows.len() && seen as usize <= self.events.len() {
                (rows, events) = (steps as usize, seen as usize);
            }
        }
        let id = format!("{}.{}.{}", self.settled, self.events.len(), self.version);
        let data = format!(
            "{{\"from\":{rows},\"rows\":[{}],\"events_from\":{events},\"events\":[{}],\"status\":{},\"now\":{}}}",
            joined(&self.rows[rows..]),
            joined(&self.events[events..]),
            self.status,
            crate::unix_s()
        );
        vec![Message { id, event: "run", data }]
    }
}

fn joined(texts: &[Arc<str>]) -> String {
    let mut all = String::with_capacity(texts.iter().map(|text| text.len() + 1).sum());
    for (place, text) in texts.iter().enumerate() {
        all += if place > 0 { "," } else { "" };
        all += text;
    }
    all
}

/// Reads a run again and again.
pub(crate) struct RunReader {
    folder: PathBuf,
    /// Those of one run do not change.
    identity: Option<Identity>,
    config: Option<RunConfig>,
    tail: Tail,
    stamp: Option<Stamp>,
    read: Instant,
    /// How long it took.
    cost: Duration,
}

#[derive(Clone, PartialEq)]
struct Stamp {
    files: [Option<(u64, SystemTime)>; 4],
    holder: Option<u32>,
    identity: Option<Identity>,
}

impl Stamp {
    fn of(folder: &Path) -> Self {
        let files = ["journal.sqlite", "journal.sqlite-wal", "track.csv", "watchdog.log"].map(|name| {
            let data = folder.join(name).metadata().ok()?;
            Some((data.len(), data.modified().ok()?))
        });
        Self { files, holder: holder(folder).unwrap_or_default(), identity: Identity::of(folder) }
    }
}

impl RunReader {
    pub(crate) fn new(folder: PathBuf) -> Self {
        let (identity, config, tail) = (Identity::of(&folder), None, Tail::default());
        Self { folder, identity, config, tail, stamp: None, read: Instant::now(), cost: Duration::ZERO }
    }

    /// The run after `before`; `None` if nothing changed, or nothing can be read just now.
    pub(crate) fn read(&mut self, before: Option<&Arc<RunView>>) -> Option<RunView> {
        let stamp = Stamp::of(&self.folder);
        let is_due = stamp.holder.is_some() && self.read.elapsed() >= REREAD;
        if self.stamp.as_ref() == Some(&stamp) && !is_due {
            return None;
        }
        let is_same_holder = self.stamp.as_ref().is_some_and(|known| known.holder == stamp.holder);
        if is_same_holder && self.read.elapsed() < crate::REST * self.cost {
            return None;
        }
        let began = Instant::now();
        let view = match stamp.identity {
            Some(identity) => {
                if self.identity != Some(identity) {
                    // Another run in the same folder.
                    (self.identity, self.config, self.tail) = (Some(identity), None, Tail::default());
                }
                self.view(before)?
            }
            None => gone(before)?,
        };
        self.stamp = Some(stamp);
        self.read = Instant::now();
        self.cost = began.elapsed();
        let is_same = before.is_some_and(|before| {
            before.status == view.status && before.rows == view.rows && before.events == view.events
        });
        (!is_same).then_some(view)
    }

    fn view(&mut self, before: Option<&Arc<RunView>>) -> Option<RunView> {
        let folder = &self.folder;
        let config = match &mut self.config {
            Some(config) => config,
            none => none.insert(RunConfig::follow(folder).ok()?),
        };
        let events_before = self.tail.events.len();
        let same = self.tail.read(folder)?;
        let Tail { steps, events } = &self.tail;
        let status = status::of_run(folder, config, steps, events, holder(folder).ok()?);
        let (layout, calibration) = (config.rig.layout().ok()?, config.calibration());
        let settled = match steps.last() {
            Some(last) if last.decided.is_none() || !last.is_confirmed => steps.len() - 1,
            _ => steps.len(),
        };
        // What is as it was has its text already.
        let known = |before: &[Arc<str>], count: usize| before[..count.min(before.len())].to_vec();
        let mut rows = before.map(|before| known(&before.rows, same)).unwrap_or_default();
        rows.extend(
            steps[rows.len()..]
                .iter()
                .map(|step| row(step, &layout, calibration.as_ref()).to_string().into()),
        );
        let same_events = if same > 0 { events_before } else { 0 };
        let mut printed = before.map(|before| known(&before.events, same_events)).unwrap_or_default();
        printed.extend(events[printed.len()..].iter().map(|event| event_row(event).to_string().into()));
        Some(RunView {
            version: before.map_or(1, |before| before.version + 1),
            rows,
            settled,
            events: printed,
            status: {
                let mut sent = status_json(folder, config, steps, &status);
                sent["identity"] = self.identity.map(Identity::word).into();
                sent.to_string()
            },
        })
    }
}

/// A run whose folder was deleted or renamed while pages looked at it, after `before`.
fn gone(before: Option<&Arc<RunView>>) -> Option<RunView> {
    let before = before?;
    Some(RunView {
        version: before.version + 1,
        rows: before.rows.clone(),
        settled: before.settled,
        events: before.events.clone(),
        status: json!({ "state": "gone" }).to_string(),
    })
}

fn rounded(value: f64, digits: i32) -> f64 {
    let factor = 10_f64.powi(digits);
    (value * factor).round() / factor
}

/// Step, hours, tip in cm, length of the stem, lamp, whether it confirmed, whether the tip was carried forward, what the photograph
/// shows, confidence, time, photograph, the tip in the photograph, the begin of the photograph's digest, and whether a programme
/// let the controller steer.
fn row(step: &StepRecord, layout: &Layout, calibration: Option<&Calibration>) -> Value {
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

fn event_row(event: &Event) -> Value {
    let kind = event.kind.name();
    let (says, todo) = words::of_event(kind);
    json!({
        "step": event.step, "kind": kind, "says": says, "todo": todo, "text": words::clean(&event.text),
        "unix": event.at.map(|at| at.unix_s.round()), "is_warning": words::is_warning(kind),
    })
}

fn status_json(folder: &Path, config: &RunConfig, steps: &[StepRecord], status: &RunStatus) -> Value {
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

/// The words that go on with the run in `folder`, which lies at `at`: a virtual plant as fast as it grew before.
pub(crate) fn resume_words(folder: &Path, at: &str) -> Vec<String> {
    let out = if at.is_empty() { "." } else { at };
    let mut words = ["run", "--out", out, "--resume"].map(str::to_owned).to_vec();
    if let Some(speed) = speed_of(folder) {
        words.extend(["--speed".to_owned(), speed.to_string()]);
    }
    words
}

/// The file name of the latest photograph of the run in `folder`, without a look into its journal.
pub(crate) fn latest_photo(folder: &Path) -> Option<String> {
    let entries = std::fs::read_dir(folder.join("photographs")).ok()?;
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| name.ends_with(".jpg") && !name.starts_with('.')).max()
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

/// What is expected of runs, for all who ask within a minute: many plants are simulated for it.
#[derive(Default)]
pub(crate) struct Predictions(Mutex<BTreeMap<String, Arc<Mutex<Kept>>>>);

/// What was expected of a run, and when.
type Kept = Option<(Instant, Value)>;

/// How long it is good enough.
const PREDICTION_LASTS: Duration = Duration::from_secs(55);

/// Runs whose predictions are kept.
const PREDICTIONS: usize = 64;

impl Predictions {
    /// What is expected of the run that lies `at` below the folder of the studio. Those who ask at once wait for one answer.
    pub(crate) fn of(
        &self,
        at: &str,
        predict: impl FnOnce() -> Result<Value, Refusal>,
    ) -> Result<Value, Refusal> {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() >= PREDICTIONS && !all.contains_key(at) {
            all.clear();
        }
        let kept = all.entry(at.to_owned()).or_default().clone();
        drop(all);
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, value)) = kept.as_ref().filter(|(made, _)| made.elapsed() < PREDICTION_LASTS) {
            return Ok(value.clone());
        }
        let value = predict()?;
        *kept = Some((Instant::now(), value.clone()));
        Ok(value)
    }
}

/// Why nothing is predicted of a run with `config`, whatever models there are; `None` if it can be.
pub(crate) fn reason_not_to_predict(config: &RunConfig) -> Option<&'static str> {
    match &config.task {
        task if !task.has_goal() => Some("this task has nothing to reach"),
        _ if matches!(config.controller, ControllerSpec::Plan(_)) => {
            Some("its controller plans by simulations of its own, which takes too long for many plants")
        }
        task if task.is_in_space() => {
            Some("this task is in space, and what is predicted here is in the plane of the front camera")
        }
        _ => None,
    }
}

/// What is expected of the run in `folder`: plants that go on in `model` from what was observed, under the run's controller.
/// For each target that is left, when its height is crossed and how far beside it; for a form of the stem, when it counts
/// and how far the stem is from it then.
pub(crate) fn prediction(folder: &Path, config: &RunConfig, model: &Path) -> Result<Value, Refusal> {
    let mut tail = Tail::default();
    tail.read(folder).ok_or_else(|| Refusal::missing("the journal cannot be read just now"))?;
    let tips = tail.steps.iter().rev();
    let tip = tips.filter_map(StepRecord::observation).map(|seen| seen.tip).next();
    let tip = tip.ok_or_else(|| Refusal::missing("there is no photograph yet"))?;
    let left: Vec<Point> = config.task.targets.iter().copied().filter(|target| target.y > tip.y).collect();
    let is_form = config.task.has_form();
    if left.is_empty() && !is_form {
        return Err(Refusal::missing("the tip is above all targets"));
    }
    let tracks = simulate::continued(model, config, &tail.steps, PREDICTED, LOOKS_AHEAD)?;
    let period_min = config.rig.period_min;
    let rows: Vec<Value> = left.iter().map(|target| predicted(target, &tracks, period_min)).collect();
    let fan: Vec<Vec<[f64; 2]>> = tracks.iter().take(12).map(|track| thinned(track).0).collect();
    Ok(json!({
        "from": <[f64; 2]>::from(tip), "plants": PREDICTED, "targets": rows, "paths": fan,
        "form": is_form.then(|| predicted_form(&config.task, &tracks, period_min)),
        // Nothing holds a stem of a model back.
        "goes_through": !config.task.obstacles.is_empty(),
    }))
}

/// Hours from the first sample of a track to `step`.
fn hours_to(track: &Track, step: u32, period_min: f64) -> f64 {
    f64::from(step - track.samples[0].step) * period_min / 60.0
}

/// The range that holds eight of ten values.
fn eight_in_ten(mut values: Vec<f64>) -> Option<[f64; 2]> {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| rounded(values[((values.len() - 1) as f64 * share).round() as usize], 2);
    (!values.is_empty()).then(|| [at(0.1), at(0.9)])
}

/// Of those plants that reach the height of a target.
fn predicted(target: &Point, tracks: &[Track], period_min: f64) -> Value {
    let crossed = tracks.iter().filter_map(|track| {
        let sample = track.samples.iter().find(|sample| sample.tip.y >= target.y)?;
        Some((hours_to(track, sample.step, period_min), (sample.tip.x - target.x).abs()))
    });
    let (hours, beside): (Vec<f64>, Vec<f64>) = crossed.unzip();
    json!({
        "x": target.x, "y": target.y, "reached": hours.len(),
        "hours": eight_in_ten(hours), "beside": eight_in_ten(beside),
    })
}

/// Of those plants that reach the height at which the form of the stem counts.
fn predicted_form(task: &Task, tracks: &[Track], period_min: f64) -> Value {
    let reached = tracks.iter().filter_map(|track| {
        let end = task.crossings(track).into_iter().next()??;
        Some((hours_to(track, end.step, period_min), end.distance_cm))
    });
    let (hours, off): (Vec<f64>, Vec<f64>) = reached.unzip();
    let done = tracks.iter().filter(|track| task.is_done(track) == Some(true)).count();
    json!({ "reached": hours.len(), "done": done, "hours": eight_in_ten(hours), "off": eight_in_ten(off) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view_of(rows: usize, settled: usize, version: u64) -> RunView {
        let row = |number: usize| format!("[{number}]").into();
        RunView {
            version,
            rows: (0..rows).map(row).collect(),
            settled,
            events: vec!["{}".into()],
            status: "{}".to_owned(),
        }
    }

    fn only(view: &RunView, id: Option<&str>) -> (String, Value) {
        let mut messages = view.since(id);
        assert_eq!(messages.len(), 1);
        let Message { id, data, .. } = messages.remove(0);
        (id, serde_json::from_str(&data).unwrap())
    }

    #[test]
    fn a_virtual_run_goes_on_as_fast_as_it_did() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(resume_words(folder.path(), "bean"), ["run", "--out", "bean", "--resume"]);
        let mut config = RunConfig::default();
        config.task.max_steps = 2;
        let (out, speed) = (folder.path().join("bean"), Some(1e6));
        let plan = tropism_lab::RunPlan { out: out.clone(), speed, config, ..Default::default() };
        tropism_lab::Workflow::execute(&plan, &tropism_lab::Silent).unwrap();
        assert_eq!(resume_words(&out, "bean"), ["run", "--out", "bean", "--resume", "--speed", "1000000"]);
    }

    #[test]
    fn nothing_is_predicted_where_no_model_knows_anything() {
        use tropism::task::Task;

        let reason = |task: Task| {
            let mut config = RunConfig::default();
            config.task = task;
            reason_not_to_predict(&config)
        };
        assert!(reason(Task::open_loop(1000)).is_some_and(|why| why.contains("nothing to reach")));
        assert!(reason(Task::spiral()).is_some_and(|why| why.contains("in space")));
        let bow = Task { radius_cm: Some(7.0), ..Task::shape() };
        assert_eq!([reason(Task::default()), reason(bow)], [None, None]);
    }

    #[test]
    fn predictions_are_made_once_for_all_who_ask() {
        let predictions = Predictions::default();
        let made = std::cell::Cell::new(0);
        let predict = || {
            made.set(made.get() + 1);
            Ok(json!(made.get()))
        };
        assert!(predictions.of("a", || Err(Refusal::missing("none yet"))).is_err());
        for _ in 0..3 {
            assert_eq!(predictions.of("a", predict).unwrap(), json!(1));
        }
        assert_eq!(predictions.of("b", predict).unwrap(), json!(2));
    }

    #[test]
    fn a_page_that_comes_back_gets_what_it_missed() {
        let (id, all) = only(&view_of(5, 4, 7), None);
        assert_eq!((id.as_str(), all["rows"].as_array().unwrap().len()), ("4.1.7", 5));
        let later = view_of(8, 8, 9);
        let (_, missed) = only(&later, Some(&id));
        // The last step may have changed since.
        assert_eq!((&missed["from"], missed["rows"].as_array().unwrap().len()), (&json!(4), 4));
        assert!(missed["events"].as_array().unwrap().is_empty());
        assert!(later.since(Some("8.1.9")).is_empty());
        // Another run in the same folder, and nonsense.
        for id in ["900.1.3", "x", "4.1", ""] {
            assert_eq!(only(&later, Some(id)).1["from"], json!(0), "{id}");
        }
    }
}
