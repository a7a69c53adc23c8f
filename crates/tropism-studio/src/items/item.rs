//! One piece of work as the overview shows it.

use std::path::Path;

use serde::Serialize;
use tropism_lab::evolve::EvolutionRecord;
use tropism_lab::status::{RunState, RunStatus, StatusPlan, StatusResults};
use tropism_lab::work::{PartStatus, WorkStatus};
use tropism_lab::{ControllerSpec, RunConfig, Silent, Workflow, files, tags};

use super::{Followed, Stamp};
use crate::found::{Found, Kind, search_of};
use crate::tail::Tail;
use crate::{unix_of, words};

/// A piece of work as a row of the overview.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Item {
    /// Its place below the folder.
    at: String,
    name: String,
    tags: Vec<String>,
    pub(super) kind: Option<Kind>,
    state: WorkState,
    is_virtual: Option<bool>,
    /// Seconds since 1970.
    began: Option<f64>,
    /// When it last wrote something, in seconds since 1970.
    changed: Option<f64>,
    /// A fitness, in cm, to sort by.
    value: Option<f64>,
    /// Best or last, in words.
    text: String,
    /// `good`, or what to look at first.
    health: String,
    step: Option<u32>,
    /// When the latest photograph was written, in seconds since 1970.
    photo: Option<f64>,
    photo_name: Option<String>,
    /// Begin of the digest of the photograph of a run that goes on.
    photo_v: Option<String>,
    /// When the next one is due, in seconds since 1970.
    next: Option<f64>,
    lamp: Option<String>,
    /// Tip of a run, in cm.
    tip: Option<(f64, f64)>,
    done: Option<u64>,
    total: Option<u64>,
}

/// How a piece of work is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum WorkState {
    /// A program works on it.
    Live,
    /// A program works on it, and its next step was due more than a period ago.
    Overdue,
    /// It was asked to end, and is not over.
    Stopped,
    /// An error ended it, it was killed, or the computer went down.
    Died,
    /// It waits for its user.
    Paused,
    Over,
    /// It cannot be read.
    #[default]
    Broken,
}

impl WorkState {
    /// That of work on which `process` works.
    pub(crate) const fn of(process: Option<u32>, is_over: bool) -> Self {
        match (process, is_over) {
            (_, true) => Self::Over,
            (Some(_), false) => Self::Live,
            (None, false) => Self::Stopped,
        }
    }
}

impl From<RunState> for WorkState {
    fn from(state: RunState) -> Self {
        match state {
            RunState::Running => Self::Live,
            RunState::Overdue => Self::Overdue,
            RunState::Stopped => Self::Stopped,
            RunState::Died => Self::Died,
            RunState::Paused => Self::Paused,
            RunState::Over => Self::Over,
        }
    }
}

/// A number of one run.
pub(crate) struct Sample {
    /// Name after `tropism_run_`, for programs.
    pub(crate) name: &'static str,
    /// A further label and its value.
    pub(crate) label: Option<(&'static str, String)>,
    pub(crate) value: f64,
}

/// The name of what lies `at` below `root`.
pub(crate) fn name_of(root: &Path, at: &str) -> String {
    if !at.is_empty() {
        return at.to_owned();
    }
    root.file_name().map_or_else(|| "run".to_owned(), |name| name.to_string_lossy().into_owned())
}

impl Item {
    pub(super) fn of(root: &Path, found: &Found, stamp: &Stamp, followed: &mut Option<Followed>) -> Self {
        let begins = match found.kind {
            Kind::Rule if found.path.exists() => found.path.clone(),
            Kind::Rule => search_of(&found.path),
            kind => found.path.join(kind.file()),
        };
        let began = begins.metadata().and_then(|data| data.modified());
        let base = Self {
            at: found.at.clone(),
            name: name_of(root, &found.at),
            tags: tags::read(&found.path),
            kind: Some(found.kind),
            began: began.ok().map(unix_of),
            changed: stamp.changed(),
            health: "good".to_owned(),
            ..Self::default()
        };
        let folder = &found.path;
        if stamp.holder.is_none() || found.kind != Kind::Run {
            *followed = None;
        } else if followed.is_none() {
            *followed = Followed::new(folder, Tail::default());
        }
        let mut ended = None;
        if stamp.holder.is_none() && found.kind == Kind::Run {
            ended = Tail::end_of(folder).and_then(|tail| Followed::new(folder, tail));
        }
        let known = match (&mut *followed, &ended) {
            (Some(live), _) => live.read(folder).then(|| live.status(folder, stamp.holder)),
            (None, ended) => ended.as_ref().map(|ended| ended.status(folder, None)),
        };
        let status =
            known.map_or_else(|| (StatusPlan { folder: folder.clone(), model: None }).execute(&Silent), Ok);
        let config = ended.map(|ended| ended.config);
        let latest = followed.as_ref().and_then(Followed::photo_v);
        match status {
            Ok(status) => Self { photo_v: latest, ..base.with(folder, status, config) },
            Err(error) => {
                let text = words::clean(&error.to_string());
                Self { state: WorkState::Broken, text: "cannot be read".to_owned(), health: text, ..base }
            }
        }
    }

    /// The numbers of a run.
    pub(super) fn samples(&self) -> Vec<Sample> {
        let is_up = matches!(self.state, WorkState::Live | WorkState::Overdue);
        let one = |name, value: Option<f64>| value.map(|value| Sample { name, label: None, value });
        let known = [
            one("up", Some(f64::from(u8::from(is_up)))),
            one("healthy", Some(f64::from(u8::from(self.health == "good")))),
            one("step", self.step.map(f64::from)),
            one("tip_x_cm", self.tip.map(|(x, _)| x)),
            one("tip_height_cm", self.tip.map(|(_, y)| y)),
            one("photograph_timestamp_seconds", self.photo),
            one("next_photograph_timestamp_seconds", self.next.filter(|_| is_up)),
        ];
        let lamps = ["left", "right"].map(|lamp| {
            let is_lit = is_up && self.lamp.as_deref() == Some(lamp);
            let label = Some(("lamp", lamp.to_owned()));
            Some(Sample { name: "lamp_lit", label, value: f64::from(u8::from(is_lit)) })
        });
        known.into_iter().chain(lamps).flatten().collect()
    }

    /// `config` is that of a run that is over, if it is known.
    fn with(self, path: &Path, status: StatusResults, config: Option<RunConfig>) -> Self {
        match status {
            StatusResults::Run(run) => self.with_run(path, &run, config),
            StatusResults::Work(search) if search.work == "tune" => self.with_rule(path, &search),
            StatusResults::Work(work) => {
                let (done, total, unit) = work.progress();
                let base = Self {
                    state: WorkState::of(work.process, work.is_over),
                    is_virtual: work.is_virtual,
                    done: Some(done),
                    total: Some(total),
                    ..self
                };
                if let Some(record) = EvolutionRecord::read(path).ok().filter(|_| work.work == "evolve") {
                    let (best, possible) = (work.best(), record.task.best_fitness());
                    return Self { value: best, text: of_possible(best, possible), ..base };
                }
                let now = work.parts.iter().find(|part| !part.is_done());
                let text = match now {
                    Some(part) if unit == "stages" => {
                        format!("{}: {} of {} {}", part.name, part.done, part.total, part.unit)
                    }
                    _ if work.is_over && work.work == "study" => "report is written".to_owned(),
                    _ => format!("{done} of {total} {unit}"),
                };
                Self { text, ..base }
            }
        }
    }

    fn with_rule(self, path: &Path, search: &WorkStatus) -> Self {
        let Some(&PartStatus { done, total, best, .. }) = search.parts.first() else {
            let rule = ControllerSpec::read(path).ok();
            let expected = rule.as_ref().and_then(|rule| rule.expected()).map(|trial| trial.mean);
            let possible = rule.as_ref().and_then(|rule| rule.own_task()?.best_fitness());
            let is_virtual = rule.as_ref().and_then(|rule| match rule {
                ControllerSpec::Rule { tuned } => Some(tuned.is_virtual),
                _ => None,
            });
            let text = expected.map_or_else(|| "a rule".to_owned(), |_| of_possible(expected, possible));
            return Self { state: WorkState::Over, is_virtual, value: expected, text, ..self };
        };
        let shown = best.map(|best| format!(", best {best:.2}")).unwrap_or_default();
        Self {
            state: if is_at_work(search) { WorkState::Live } else { WorkState::Stopped },
            value: best,
            text: format!("generation {done} of {total}{shown}"),
            done: Some(done),
            total: Some(total),
            ..self
        }
    }

    fn with_run(self, path: &Path, run: &RunStatus, config: Option<RunConfig>) -> Self {
        let fitness = fitness_of(path, run.state, config);
        let text = match (fitness, run.tip_x_cm.zip(run.tip_y_cm)) {
            (Some((fitness, best)), _) => of_possible(Some(fitness), best),
            (None, Some((x, y))) => format!("tip {}, {y:.1} cm", number(x, 1)),
            (None, None) => "no photograph yet".to_owned(),
        };
        let photo =
            run.photograph.as_deref().and_then(|photo| photo.metadata().ok()?.modified().ok()).map(unix_of);
        let period = run.next_step_in_s.zip(run.photograph_age_s).map(|(left, age)| left + age);
        Self {
            state: run.state.into(),
            is_virtual: Some(run.is_virtual),
            value: fitness.map(|(fitness, _)| fitness),
            text,
            health: words::health(run),
            step: run.step,
            photo_name: run
                .photograph
                .as_ref()
                .filter(|_| photo.is_some())
                .and_then(|photo| Some(photo.file_name()?.to_string_lossy().into_owned())),
            photo,
            // To the second: it is reckoned from ages that are read one after the other.
            next: photo.zip(period).map(|(photo, period)| (photo + period).round()),
            lamp: run.lamp.clone(),
            tip: run.tip_x_cm.zip(run.tip_y_cm),
            done: run.step.map(u64::from),
            total: Some(u64::from(run.max_steps)),
            ..self
        }
    }
}

/// Whether a program works on a search: nobody holds its file, but each generation is saved.
pub(crate) fn is_at_work(search: &WorkStatus) -> bool {
    !search.is_over && search.saved_ago_s.is_some_and(|ago| ago < SEARCH_SILENCE_S)
}

/// A search that saved nothing for so long has ended: a generation takes some seconds.
const SEARCH_SILENCE_S: f64 = 60.0;

/// Fitness and greatest possible fitness of a run that is over and has targets.
fn fitness_of(path: &Path, state: RunState, config: Option<RunConfig>) -> Option<(f64, Option<f64>)> {
    if state != RunState::Over {
        return None;
    }
    let task = config.or_else(|| RunConfig::follow(path).ok())?.task;
    (task.has_goal() && task.best_fitness().is_some()).then_some(())?;
    let track = files::read_track(&path.join("track.csv")).ok()?;
    Some((task.fitness(&track), task.best_fitness_of(&track)))
}

/// A number with a true minus, which a zero has not.
fn number(value: f64, digits: usize) -> String {
    let text = format!("{:.digits$}", value.abs());
    let is_zero = text.bytes().all(|letter| matches!(letter, b'0' | b'.'));
    if value < 0.0 && !is_zero { format!("\u{2212}{text}") } else { text }
}

fn of_possible(value: Option<f64>, possible: Option<f64>) -> String {
    match (value, possible) {
        (Some(value), Some(possible)) => {
            let digits = usize::from((possible - possible.round()).abs() >= 0.05);
            format!("{} of {possible:.digits$} cm", number(value, 2))
        }
        (Some(value), None) => format!("{} cm", number(value, 2)),
        (None, _) => "just begun".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        assert_eq!(
            [-0.04, -0.06, 0.04, 12.34].map(|value| number(value, 1)),
            ["0.0", "\u{2212}0.1", "0.0", "12.3"]
        );
        // Rounded to a whole number, the best there can be would be less than what was reached.
        assert_eq!(of_possible(Some(10.13), Some(10.2)), "10.13 of 10.2 cm");
        assert_eq!(of_possible(Some(14.5), Some(15.0)), "14.50 of 15 cm");
        assert_eq!(of_possible(Some(-0.001), Some(15.0)), "0.00 of 15 cm");
    }
}
