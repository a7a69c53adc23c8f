//! What will probably become of a plant: the probability that it passes each target.
//!
//! In: what was observed so far. Out: for each target the probability that the tip passes within [`MISS_CM`](crate::task::MISS_CM) of it. A model
//! resumes the observed plant many times, each time as another of the plants that it may be, and a rule steers all of them to the
//! end. Their share that passes a target is its probability.

use serde::{Deserialize, Serialize};

use super::{Controller, PredictiveGreedy, PredictiveRule};
use crate::geometry::Point;
use crate::math::statistics::quantile_nearest;
use crate::parallel;
use crate::plant::PlantModel;
use crate::random::{NoiseStream, Purpose};
use crate::task::{Crossing, Task};
use crate::track::{Sample, Track};

/// What is known of one target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TargetOutlook {
    /// The target, in cm.
    pub target: Point,
    /// Distance between tip and target when the tip reached its height, in cm; `None` while it is lower.
    pub passed_cm: Option<f64>,
    /// Probability that the tip passes within 1 cm of the target, 0 to 1; 0 or 1 once it has passed.
    pub probability: f64,
    /// 95 % interval of the probability, from how much the measured plants of the model differ; `None` where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// Median distance at which simulated plants pass it, in cm; `None` where fewer than half of them get so high.
    pub expected_cm: Option<f64>,
}

impl TargetOutlook {
    /// Whether the target is ahead and probably out of reach: fewer than one plant in ten passes it.
    #[must_use]
    pub fn is_out_of_reach(&self) -> bool {
        self.passed_cm.is_none() && self.probability < UNREACHABLE
    }
}

/// Probability below which a target is reported as out of reach. Chosen by hand.
const UNREACHABLE: f64 = 0.1;

/// The outlook for each target of `task` of the plant whose past is `samples`, of which there is one at least, when `rule` steers it to
/// the end: on so many simulated `plants`, above 0, of `model`. The same `seed` gives the same outlook.
///
/// ```
/// use tropism::control::{PredictiveRule, outlook};
/// use tropism::plant::tip::{TipModel, TipModelConfig};
/// use tropism::prelude::*;
/// # use tropism_bean::{Species, Trial};
/// # use tropism::environment::unwatched;
/// # let species = Species::default();
/// # let trial = Trial::new(&species);
/// # let track = trial.grow(1, &mut Periodic::new(36, &trial.layout), &Task::open_loop(300), &mut unwatched);
/// let model = TipModel::fit([&track], TipModelConfig::default())?;
/// let task = Task::default();
/// let seen = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, 1);
/// let targets = outlook(&model, &task, PredictiveRule::default(), &seen.samples[..100], 20, 1);
/// assert!(targets.iter().all(|target| (0.0..=1.0).contains(&target.probability)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn outlook<M: PlantModel<Plant: Sync>>(
    model: &M,
    task: &Task,
    rule: PredictiveRule,
    samples: &[Sample],
    plants: u32,
    seed: u64,
) -> Vec<TargetOutlook> {
    let mut past_rule = PredictiveGreedy::new(rule, task, model.layout());
    let (last, before) = samples.split_last().expect("a sample");
    before.iter().for_each(|sample| {
        past_rule.decide(&sample.observation());
    });
    let noises: Vec<NoiseStream> =
        (0..plants).map(|plant| NoiseStream::new(seed, Purpose::Forecast, [plant, last.step, 1])).collect();
    let mut seedlings: Vec<_> = noises.iter().map(NoiseStream::of_seedling).collect();
    let twins = model.twins(samples, &mut seedlings);
    let solids = task.solids();
    let futures = parallel::map(noises.len(), |number| {
        let mut plant = twins[number].clone();
        model.among(&mut plant, &solids);
        let mut rule = past_rule.clone();
        let mut track = Track { period_min: model.period_min(), ..Track::default() };
        let (mut seen, mut step) = (last.observation(), last.step);
        while !task.is_over(step, &seen) {
            let light = rule.decide(&seen);
            model.step(&mut plant, light, &mut noises[number].at(step));
            (seen, step) = (model.observe(&plant), step + 1);
            track.samples.push(Sample::of(seen.clone(), step, 0.0, None));
        }
        task.crossings(&track)
    });
    let past = task.crossings(&Track { samples: samples.to_vec(), ..Track::default() });
    let of_target = |(place, (target, passed)): (usize, (&Point, &Option<Crossing>))| {
        let crossings: Vec<Option<Crossing>> =
            futures.iter().map(|future| passed.or(future.get(place).copied().flatten())).collect();
        let visits = crossings.iter().filter(|crossing| Crossing::is_visit(**crossing)).count();
        // A plant that never gets so high is farther away than all others.
        let distance = |crossing: &Option<Crossing>| crossing.map_or(f64::INFINITY, |at| at.distance_cm);
        let expected_cm = quantile_nearest(&crossings.iter().map(distance).collect::<Vec<_>>(), 0.5);
        TargetOutlook {
            target: *target,
            passed_cm: passed.map(|crossing| crossing.distance_cm),
            probability: visits as f64 / f64::from(plants),
            interval: None,
            expected_cm: Some(expected_cm).filter(|distance| distance.is_finite()),
        }
    };
    task.targets.iter().zip(&past).enumerate().map(of_target).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::{Layout, Light};
    use crate::observation::Observation;
    use crate::random::StepNoise;

    /// Grows straight up by 1 cm a step, at a distance from the vertical that is drawn at the start: -1 to 1 cm.
    struct Straight(Layout);

    impl PlantModel for Straight {
        type Plant = Point;

        fn seedling(&self, start: Point, noise: &mut StepNoise) -> Point {
            Point::new(2.0 * noise.uniform() - 1.0, start.y)
        }

        fn step(&self, tip: &mut Point, _light: Light, _noise: &mut StepNoise) {
            tip.y += 1.0;
        }

        fn observe(&self, tip: &Point) -> Observation {
            Observation::simulated(*tip)
        }

        fn layout(&self) -> &Layout {
            &self.0
        }
    }

    fn outlook_at(targets: [Point; 3], tips: &[(f64, f64)]) -> Vec<TargetOutlook> {
        let task = Task { targets: targets.into(), ..Task::default() };
        let samples: Vec<Sample> = (tips.iter().zip(0..))
            .map(|(&(x, y), step)| {
                Sample::of(Observation::simulated(Point::new(x, y)), step, 0.0, Some(Light::LEFT))
            })
            .collect();
        outlook(&Straight(Layout::default()), &task, PredictiveRule::default(), &samples, 400, 1)
    }

    #[test]
    fn probabilities_are_shares_of_simulated_plants() {
        let targets = [(0.0, 6.0), (1.0, 9.0), (7.0, 12.0)].map(|(x, y)| Point::new(x, y));
        let outlook = outlook_at(targets, &[(0.0, 4.0)]);
        assert_eq!((outlook[0].probability, outlook[2].probability), (1.0, 0.0));
        assert!((outlook[1].probability - 0.5).abs() < 0.1, "{outlook:?}");
        assert!((outlook[1].expected_cm.unwrap() - 1.0).abs() < 0.2, "{outlook:?}");
        assert_eq!([0, 1, 2].map(|target| outlook[target].is_out_of_reach()), [false, false, true]);
    }

    #[test]
    fn a_target_that_was_passed_is_known() {
        let targets = [(0.0, 5.0), (5.0, 6.0), (0.0, 20.0)].map(|(x, y)| Point::new(x, y));
        let outlook = outlook_at(targets, &[(0.0, 4.0), (0.3, 5.0), (0.0, 6.0)]);
        assert_eq!((outlook[0].passed_cm, outlook[0].probability), (Some(0.3), 1.0));
        assert_eq!((outlook[1].passed_cm, outlook[1].probability), (Some(5.0), 0.0));
        // The experiment is over before.
        assert_eq!((outlook[2].passed_cm, outlook[2].probability, outlook[2].expected_cm), (None, 0.0, None));
        assert!(!outlook[1].is_out_of_reach() && outlook[2].is_out_of_reach());
    }
}
