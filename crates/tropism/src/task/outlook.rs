//! What will probably become of a plant: the probability that it passes each target.
//!
//! In: what was observed so far, and simulated plants that [go on](crate::simulation::go_on) from there. Out: for each target the
//! probability that the tip passes within [`MISS_CM`](super::MISS_CM) of it: the share of those plants that pass it.

use serde::{Deserialize, Serialize};

use super::{Crossing, Task};
use crate::geometry::Point;
use crate::math::statistics::quantile_nearest;
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

/// The outlook for each target of `task` of the plant that was `observed` so far: by the tracks of simulated plants that go on from
/// there, at least one.
#[must_use]
pub fn outlook(task: &Task, observed: &[Sample], futures: &[Track]) -> Vec<TargetOutlook> {
    let futures: Vec<_> = futures.iter().map(|track| task.crossings(track)).collect();
    let past = task.crossings(&Track { samples: observed.to_vec(), ..Track::default() });
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
            probability: visits as f64 / futures.len() as f64,
            interval: None,
            expected_cm: Some(expected_cm).filter(|distance| distance.is_finite()),
        }
    };
    task.targets.iter().zip(&past).enumerate().map(of_target).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Light;
    use crate::observation::Observation;

    fn samples(tips: impl IntoIterator<Item = (f64, f64)>) -> Vec<Sample> {
        let sample = |((x, y), step)| {
            Sample::of(Observation::simulated(Point::new(x, y)), step, 0.0, Some(Light::LEFT))
        };
        tips.into_iter().zip(0..).map(sample).collect()
    }

    /// The outlook of a plant with these `tips` by 21 plants that grow straight up to 12 cm, at x = -1, -0.9, ... 1 cm.
    fn outlook_at(targets: [(f64, f64); 3], tips: &[(f64, f64)]) -> Vec<TargetOutlook> {
        let task = Task { targets: targets.map(|(x, y)| Point::new(x, y)).into(), ..Task::default() };
        let upward = |number| {
            let x = f64::from(number) / 10.0;
            let from = tips[tips.len() - 1].1 as i32;
            Track::of(samples((from..=12).map(|y| (x, f64::from(y)))))
        };
        let futures: Vec<Track> = (-10..=10).map(upward).collect();
        outlook(&task, &samples(tips.iter().copied()), &futures)
    }

    #[test]
    fn probabilities_are_shares_of_simulated_plants() {
        let outlook = outlook_at([(0.0, 6.0), (1.04, 9.0), (7.0, 12.0)], &[(0.0, 4.0)]);
        assert_eq!((outlook[0].probability, outlook[2].probability), (1.0, 0.0));
        assert_eq!(outlook[1].probability, 10.0 / 21.0);
        assert!((outlook[1].expected_cm.unwrap() - 1.04).abs() < 1e-12, "{outlook:?}");
        assert_eq!([0, 1, 2].map(|target| outlook[target].is_out_of_reach()), [false, false, true]);
    }

    #[test]
    fn a_target_that_was_passed_is_known() {
        let outlook =
            outlook_at([(0.0, 5.0), (5.0, 6.0), (0.0, 20.0)], &[(0.0, 4.0), (0.3, 5.0), (0.0, 6.0)]);
        assert_eq!((outlook[0].passed_cm, outlook[0].probability), (Some(0.3), 1.0));
        assert_eq!((outlook[1].passed_cm, outlook[1].probability), (Some(5.0), 0.0));
        // The experiment is over before.
        assert_eq!((outlook[2].passed_cm, outlook[2].probability, outlook[2].expected_cm), (None, 0.0, None));
        assert!(!outlook[1].is_out_of_reach() && outlook[2].is_out_of_reach());
    }
}
