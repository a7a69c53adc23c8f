//! What is expected of a run: many plants that go on from what was seen.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;
use tropism::geometry::Point;
use tropism::task::{TargetOutlook, Task, outlook};
use tropism::track::Track;
use tropism_lab::{RunConfig, StepRecord, simulate};
use tropism_page::thinned;

use super::view::rounded;
use crate::error::Refusal;
use crate::tail::Tail;

/// Simulated plants of a prediction.
const PREDICTED: u32 = 200;

/// Steps that they go on at most: three days and a half.
const LOOKS_AHEAD: u32 = 1000;

/// What is expected of runs, for all who ask within a minute: many plants are simulated for it.
#[derive(Default)]
pub(crate) struct Predictions(Mutex<BTreeMap<String, Arc<Mutex<Kept>>>>);

/// What was expected of a run, and when.
type Kept = Option<(Instant, Prediction)>;

/// What is expected of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Prediction {
    /// The tip from which on it is, in cm.
    from: [f64; 2],
    /// Simulated plants.
    plants: u32,
    /// Targets above the tip.
    targets: Vec<PredictedTarget>,
    /// Paths of some of the plants, in cm.
    paths: Vec<Vec<[f64; 2]>>,
    /// Of a task with a form of the stem.
    form: Option<PredictedForm>,
    /// Whether the plants go through obstacles.
    goes_through: bool,
    /// File of the model, below the folder of the studio.
    pub(crate) model: String,
}

/// What is expected at a target; ranges hold eight of ten plants that reach its height.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct PredictedTarget {
    x: f64,
    y: f64,
    /// Plants that reach its height.
    reached: usize,
    /// Hours until then.
    hours: Option<[f64; 2]>,
    /// Distance from the target then, in cm.
    beside: Option<[f64; 2]>,
    /// Share of all simulated plants that pass it within 1 cm.
    probability: f64,
}

/// What is expected of a form; ranges hold eight of ten plants that reach the height at which it counts.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct PredictedForm {
    /// Plants that reach the height.
    reached: usize,
    /// Plants that reach the form.
    done: usize,
    /// Hours until the height.
    hours: Option<[f64; 2]>,
    /// Difference from the form then, in cm.
    off: Option<[f64; 2]>,
}

/// How long it is good enough.
const PREDICTION_LASTS: Duration = Duration::from_secs(55);

/// Runs whose predictions are kept.
const PREDICTIONS: usize = 64;

impl Predictions {
    /// What is expected of the run that lies `at` below the folder of the studio. Those who ask at once wait for one answer.
    pub(crate) fn of(
        &self,
        at: &str,
        predict: impl FnOnce() -> Result<Prediction, Refusal>,
    ) -> Result<Prediction, Refusal> {
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
        task if task.is_in_space() => {
            Some("this task is in space, and what is predicted here is in the plane of the front camera")
        }
        _ => None,
    }
}

/// What is expected of the run in `folder`: plants that go on in `model` from what was observed, under the run's controller.
/// For each target that is left, when its height is crossed and how far beside it; for a form of the stem, when it counts
/// and how far the stem is from it then. `shown` is what a page calls the model.
pub(crate) fn prediction(
    folder: &Path,
    config: &RunConfig,
    model: &Path,
    shown: &str,
) -> Result<Prediction, Refusal> {
    let mut tail = Tail::default();
    tail.read(folder).ok_or_else(|| Refusal::missing("the journal cannot be read just now"))?;
    let tips = tail.steps.iter().rev();
    let tip = tips.filter_map(StepRecord::observation).map(|seen| seen.tip).next();
    let tip = tip.ok_or_else(|| Refusal::missing("there is no photograph yet"))?;
    let is_left = |target: &Point| target.y > tip.y;
    let is_form = config.task.has_form();
    if !config.task.targets.iter().any(is_left) && !is_form {
        return Err(Refusal::missing("the tip is above all targets"));
    }
    let tracks = simulate::continued(model, config, &tail.steps, PREDICTED, LOOKS_AHEAD)?;
    let period_min = config.rig.period_min;
    Ok(Prediction {
        from: tip.into(),
        plants: PREDICTED,
        targets: (outlook(&config.task, &[], &tracks).iter())
            .filter(|outlook| is_left(&outlook.target))
            .map(|outlook| predicted(outlook, &tracks, period_min))
            .collect(),
        paths: tracks.iter().take(12).map(|track| thinned(track).0).collect(),
        form: is_form.then(|| predicted_form(&config.task, &tracks, period_min)),
        // Nothing holds a stem of a model back.
        goes_through: !config.task.obstacles.is_empty(),
        model: shown.to_owned(),
    })
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

/// Of a target; hours and distance of those plants that reach its height.
fn predicted(
    TargetOutlook { target, probability, .. }: &TargetOutlook,
    tracks: &[Track],
    period_min: f64,
) -> PredictedTarget {
    let crossed = tracks.iter().filter_map(|track| {
        let sample = track.samples.iter().find(|sample| sample.tip.y >= target.y)?;
        Some((hours_to(track, sample.step, period_min), (sample.tip.x - target.x).abs()))
    });
    let (hours, beside): (Vec<f64>, Vec<f64>) = crossed.unzip();
    PredictedTarget {
        x: target.x,
        y: target.y,
        reached: hours.len(),
        hours: eight_in_ten(hours),
        beside: eight_in_ten(beside),
        probability: *probability,
    }
}

/// Of those plants that reach the height at which the form of the stem counts.
fn predicted_form(task: &Task, tracks: &[Track], period_min: f64) -> PredictedForm {
    let reached = tracks.iter().filter_map(|track| {
        let end = task.crossings(track).into_iter().next()??;
        Some((hours_to(track, end.step, period_min), end.distance_cm))
    });
    let (hours, off): (Vec<f64>, Vec<f64>) = reached.unzip();
    let done = tracks.iter().filter(|track| task.is_done(track) == Some(true)).count();
    PredictedForm { reached: hours.len(), done, hours: eight_in_ten(hours), off: eight_in_ten(off) }
}

#[cfg(test)]
mod tests {
    use tropism::observation::Observation;
    use tropism::track::Sample;

    use super::*;

    #[test]
    fn of_a_target_hours_distance_and_probability_are_told() {
        // Four plants grow straight up by 1 cm an hour, beside the target by 0.5, 1.5 and 2.5 cm; the last one stays below.
        let upright = |beside: f64, tall: u32| {
            let tip = |step: u32| Observation::simulated(Point::new(3.0 + beside, 4.0 + f64::from(step)));
            Track::of((0..=tall).map(|step| Sample::of(tip(step), step, 0.0, None)).collect())
        };
        let tracks = [upright(0.5, 3), upright(1.5, 3), upright(2.5, 3), upright(0.0, 1)];
        let outlook = outlook(&Task::default(), &[], &tracks);
        let shown = predicted(&outlook[0], &tracks, 60.0);
        assert_eq!((shown.x, shown.y, shown.reached, shown.probability), (3.0, 6.0, 3, 0.25));
        assert_eq!((shown.hours, shown.beside), (Some([2.0, 2.0]), Some([0.5, 2.5])));
    }

    #[test]
    fn nothing_is_predicted_where_no_model_knows_anything() {
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
            Ok(Prediction { plants: made.get(), ..Prediction::default() })
        };
        let plants = |at| predictions.of(at, predict).unwrap().plants;
        assert!(predictions.of("a", || Err(Refusal::missing("none yet"))).is_err());
        for _ in 0..3 {
            assert_eq!(plants("a"), 1);
        }
        assert_eq!(plants("b"), 2);
    }
}
