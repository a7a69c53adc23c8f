//! Targets behind obstacles: the tip is to come near them, and the stem must touch nothing on the way.
//!
//! The paper names obstacle avoidance as future work (section 5). Touching is judged by the seen stem and its radius. A plant
//! that leans on an obstacle touches it without going in; a model of the stem knows no contact and goes in.

use super::{Crossing, Past, Score, Task};
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::math::{self, Mask, Real};
use crate::observation::Observation;
use crate::obstacle::{Obstacle, clearance_within};
use crate::track::Track;

/// What the first contact costs; a second contact costs as much again. As much as a target is worth, so that a plant that
/// touched is worth less than one that did not move at all.
const CONTACT_COST: f64 = 2.0;

/// What each step of contact costs. Chosen: a hundred steps cost a target.
const STEP_COST: f64 = 0.02;

/// What each cm costs by which the stem is pushed deeper into an obstacle. Chosen: a target and a half.
const DEPTH_COST_PER_CM: f64 = 3.0;

/// Gap below which a stem touches, in cm: the stem of a plant that leans on an obstacle is seen beside it, and may be thicker
/// than the task says. Chosen by measurement (docs/validation/vision-obstacles.md).
const TOUCH_CM: f64 = 0.05;

/// Depth that costs nothing, in cm. A stem that leans on an obstacle for hours is seen now a little deeper in it and now less,
/// by the noise of vision; that is no movement.
const DENT_CM: f64 = 0.15;

/// What a target is worth that the tip passes within reach.
const TARGET_WORTH: f64 = 2.0;

/// Share of the reach within which the distance from a target costs nothing. Beyond, each cm costs 1: a search then has a
/// direction also where no plant reaches the target.
const FREE_SHARE: f64 = 0.8;

/// Targets that the tip is to pass within reach, while the stem touches no obstacle.
#[derive(Clone, Copy, Debug)]
pub struct Obstacles;

impl Task {
    /// A disc of 1 cm straight above the seedling, and a target above the disc.
    #[must_use]
    pub fn obstacles() -> Self {
        Self {
            targets: vec![Point::new(0.0, 13.0)],
            obstacles: vec![Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: 1.0 }],
            end_height_cm: 13.0,
            ..Self::new(Obstacles)
        }
    }

    /// Gap between the surfaces of stem and obstacles, in cm, below 0 if the stem is in one; infinite if no stem or no obstacle
    /// is seen.
    #[must_use]
    pub fn gap_cm(&self, seen: &Observation) -> f64 {
        self.distance_within(f64::INFINITY, seen) - self.stem_radius_cm
    }

    /// Distance of the midline of the stem from the obstacles if it is below `limit_cm`, else infinite, in cm.
    fn distance_within(&self, limit_cm: f64, seen: &Observation) -> f64 {
        let nearest = seen.stem.as_ref().and_then(|stem| clearance_within(limit_cm, &self.obstacles, stem));
        nearest.map_or(f64::INFINITY, |nearest| nearest.distance_cm)
    }

    /// Distance of the midline from an obstacle below which the stem touches it, in cm.
    fn touch_cm(&self) -> f64 {
        TOUCH_CM + self.stem_radius_cm
    }

    /// What a step costs in which the midlines of stems came from one distance from the obstacles to another, in cm.
    #[inline(always)]
    pub(crate) fn contact_cost<R: Real>(&self, was_cm: R, now_cm: R) -> R {
        let [touch, nothing] = [self.touch_cm(), 0.0].map(R::splat);
        let depth = |distance_cm: R| {
            let depth = -(distance_cm - self.stem_radius_cm) - DENT_CM;
            R::select(distance_cm.lt(touch), depth.max(nothing), nothing)
        };
        let onset = R::select(was_cm.lt(touch), nothing, R::splat(CONTACT_COST));
        let deeper = (depth(now_cm) - depth(was_cm)).max(nothing);
        R::select(now_cm.lt(touch), onset + STEP_COST + deeper * DEPTH_COST_PER_CM, nothing)
    }

    /// What the targets are worth that tips pass for the first time `at` a place; they were `highest_cm` high before.
    #[inline(always)]
    pub(crate) fn worth_of_targets<R: Real>(&self, highest_cm: R, at: [R; 2]) -> R {
        let mut worth = R::splat(0.0);
        for target in &self.targets {
            let height = R::splat(target.y);
            let is_passed = highest_cm.lt(height) & at[1].ge(height);
            if !is_passed.any() {
                continue;
            }
            let distance = math::hypot(at[0] - target.x, at[1] - target.y);
            let missed = (distance - FREE_SHARE * self.reach_cm).max(R::splat(0.0));
            let is_reached = distance.le(R::splat(self.reach_cm));
            let reached = R::select(is_reached, R::splat(TARGET_WORTH), R::splat(0.0));
            worth = R::select(is_passed, worth - missed + reached, worth);
        }
        worth
    }

    /// Whether the stem touches an obstacle: with a gap below 0.05 cm.
    #[must_use]
    pub fn touches(&self, seen: &Observation) -> bool {
        self.distance_within(self.touch_cm(), seen).is_finite()
    }

    /// Steps at which the stem of a track touches an obstacle.
    #[must_use]
    pub fn contacts(&self, track: &Track) -> usize {
        track.samples.iter().filter(|sample| self.touches(&sample.observation())).count()
    }
}

impl Score for Obstacles {
    /// A target within reach is worth 2, once; beyond that each cm costs 1. Each contact costs 2, each step of it 0.02, and each
    /// cm that the stem goes deeper into an obstacle 3, which only a model does.
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        let worth = task.worth_of_targets(past.highest_cm, after.tip.into());
        let distance_cm = |seen| task.distance_within(task.touch_cm(), seen);
        let now_cm = distance_cm(after);
        // Most stems touch nothing, and then it does not matter where they were.
        let was_cm = if now_cm.is_finite() { distance_cm(&past.latest) } else { now_cm };
        worth - task.contact_cost(was_cm, now_cm)
    }

    fn best(&self, task: &Task, first: &Observation) -> Option<f64> {
        Some(TARGET_WORTH * task.targets.iter().filter(|target| target.y > first.tip.y).count() as f64)
    }

    /// Below 0 the logarithm: a plant that failed has failed, and how far it went into an obstacle matters little. By the mean
    /// fitness a search would care for the worst plants instead of making more plants succeed.
    fn utility(&self, fitness: f64) -> f64 {
        if fitness < 0.0 { -math::ln(1.0 - fitness) } else { fitness }
    }

    /// `None` for a track without stems.
    fn is_done(&self, task: &Task, track: &Track) -> Option<bool> {
        track.samples.iter().find(|sample| sample.stem.is_some())?;
        let is_reached = |crossing: &Option<Crossing>| {
            crossing.is_some_and(|crossing| crossing.distance_cm <= task.reach_cm)
        };
        Some(task.contacts(track) == 0 && task.crossings(track).iter().all(is_reached))
    }

    fn title(&self, task: &Task) -> String {
        let targets = super::Targets.title(task);
        match task.obstacles.len() {
            0 => targets,
            1 => format!("{targets} behind 1 obstacle"),
            count => format!("{targets} behind {count} obstacles"),
        }
    }

    fn name(&self) -> &'static str {
        "obstacles"
    }

    fn keys(&self) -> &'static [&'static str] {
        &[
            "start",
            "targets",
            "obstacles",
            "way_points",
            "reach_cm",
            "stem_radius_cm",
            "end_height_cm",
            "max_steps",
        ]
    }

    fn check(&self, task: &Task) -> Result<(), OutOfRange> {
        ensure(!task.targets.is_empty(), "targets", "[]", "at least one target")
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Polyline;
    use crate::observation::Quality;
    use crate::track::Sample;

    /// A track of stems, each given by its points above the root at (0, 0).
    fn track(stems: &[&[(f64, f64)]]) -> Track {
        let samples = stems.iter().enumerate().map(|(step, stem)| {
            let points: Vec<Point> = std::iter::once((0.0, 0.0))
                .chain(stem.iter().copied())
                .map(|(x, y)| Point::new(x, y))
                .collect();
            Sample {
                step: step as u32,
                time_s: 0.0,
                tip: points[points.len() - 1],
                stem: Some(Polyline(points)),
                depth: None,
                light: None,
                levels: None,
                quality: Quality::Simulated,
            }
        });
        Track::of(samples.collect())
    }

    #[test]
    fn a_way_round_the_disc_is_worth_the_target() {
        let task = Task::obstacles();
        let round =
            track(&[&[(0.0, 4.0)], &[(2.0, 6.0), (2.0, 9.0)], &[(2.0, 6.0), (2.0, 10.0), (0.5, 13.0)]]);
        assert_eq!((task.fitness(&round), task.contacts(&round), task.is_done(&round)), (2.0, 0, Some(true)));
        let wide = track(&[&[(0.0, 4.0)], &[(2.0, 6.0), (2.0, 10.0), (4.0, 13.0)]]);
        assert!((task.fitness(&wide) + 4.0 - 1.2).abs() < 1e-12);
        assert_eq!(task.is_done(&wide), Some(false));
    }

    #[test]
    fn a_way_through_the_disc_costs_more_than_the_target_is_worth() {
        let task = Task::obstacles();
        let through = track(&[&[(0.0, 4.0)], &[(0.0, 7.5)], &[(0.0, 13.0)]]);
        // 0.65 cm deep at first, then to the centre: 1.15 cm, of which 0.15 cost nothing; two steps of contact, one target.
        let expected = 2.0 - 2.0 - 2.0 * 0.02 - 3.0 * 1.0;
        assert!((task.fitness(&through) - expected).abs() < 1e-9, "{}", task.fitness(&through));
        assert_eq!((task.contacts(&through), task.is_done(&through)), (2, Some(false)));
    }

    #[test]
    fn a_track_without_stems_does_not_say_whether_the_task_was_done() {
        let mut tips = track(&[&[(0.0, 4.0)], &[(0.0, 13.0)]]);
        tips.samples.iter_mut().for_each(|sample| sample.stem = None);
        assert_eq!(Task::obstacles().is_done(&tips), None);
    }

    #[test]
    fn controllers_steer_by_way_points_and_targets() {
        let task = Task { way_points: vec![Point::new(3.0, 10.0)], ..Task::obstacles() };
        task.check().unwrap();
        assert_eq!(task.way(), [Point::new(3.0, 10.0), Point::new(0.0, 13.0)]);
        assert_eq!(task.targets, [Point::new(0.0, 13.0)]);
    }

    #[test]
    fn a_plant_that_failed_badly_is_little_worse_than_one_that_failed() {
        let utility = |fitness| Obstacles.utility(fitness);
        let utilities = [-30.0, -3.0, -0.1, 0.0, 1.0, 2.0].map(utility);
        assert!(utilities.is_sorted(), "{utilities:?}");
        assert_eq!(utilities[3..], [0.0, 1.0, 2.0]);
        assert!(utility(-3.0) - utility(-30.0) < utility(2.0) - utility(-0.1));
    }

    proptest! {
        #[test]
        fn the_mirror_image_is_worth_the_same(
            middles in prop::collection::vec((-3.0..3.0, 3.0..9.0), 2..20),
        ) {
            let stems: Vec<Vec<(f64, f64)>> =
                middles.iter().map(|&(x, y)| vec![(x, y), (x / 2.0, y + 5.0)]).collect();
            let track = track(&stems.iter().map(Vec::as_slice).collect::<Vec<_>>());
            let task = Task { obstacles: vec![
                Obstacle::Disc { centre: Point::new(-5.2, 8.0), radius_cm: 1.0 },
                Obstacle::Line { ends: [Point::new(0.0, 6.5), Point::new(8.0, 6.5)] },
            ], ..Task::obstacles() };
            let image = Task {
                obstacles: task.obstacles.iter().map(|obstacle| obstacle.mirrored()).collect(), ..task.clone()
            };
            let difference = task.fitness(&track) - image.fitness(&track.mirrored().unwrap());
            prop_assert!(difference.abs() < 1e-9);
        }
    }
}
