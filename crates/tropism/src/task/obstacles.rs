//! Targets behind obstacles: the tip is to come near them, and the stem must touch nothing on the way.
//!
//! The paper names obstacle avoidance as future work (section 5). Touching is judged by the seen stem and its radius. A plant
//! that leans on an obstacle touches it without going in; a model of the stem knows no contact and goes in.

use serde::{Deserialize, Serialize};

use super::{Targets, Task};
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::math;
use crate::observation::Observation;
use crate::obstacle::{Obstacle, clearance_within};
use crate::track::Track;

/// What the first contact costs; a second contact costs as much again. As much as a target is worth, so that a plant that
/// touched is worth less than one that did not move at all.
const CONTACT_COST: f64 = 2.0;

/// What each step of contact costs.
const STEP_COST: f64 = 0.02;

/// What each cm costs by which the stem is pushed deeper into an obstacle.
const DEPTH_COST_PER_CM: f64 = 3.0;

/// Gap below which a stem touches, in cm: the stem of a plant that leans on an obstacle is seen beside it, and may be thicker
/// than the task says. Chosen by measurement (docs/beyond.md).
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Obstacles {
    /// Tip of the seedling at the start of a simulated experiment, in cm, y above 0. Paper: (0, 4).
    pub start: Point,
    /// Targets in ascending height above the start, in cm; at least one.
    pub targets: Vec<Point>,
    /// What the stem must not touch.
    pub obstacles: Vec<Obstacle>,
    /// Points in ascending height, in cm, by which controllers steer on their way to the targets. They are worth nothing.
    pub way_points: Vec<Point>,
    /// Distance from a target, at its height, within which the tip has reached it, in cm above 0.
    pub reach_cm: f64,
    /// Radius of the stem, in cm above 0: its midline must keep so far from each obstacle.
    pub stem_radius_cm: f64,
    /// Height of the tip at which the experiment ends, in cm; that of the highest target or more.
    pub end_height_cm: f64,
    /// Steps after which the experiment ends although the tip is lower, 1 to 1000000.
    pub max_steps: u32,
}

impl Default for Obstacles {
    /// A disc of 1 cm straight above the seedling, and a target above the disc.
    fn default() -> Self {
        Self {
            start: Point::new(0.0, 4.0),
            targets: vec![Point::new(0.0, 13.0)],
            obstacles: vec![Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: 1.0 }],
            way_points: Vec::new(),
            reach_cm: 1.5,
            // Chosen by hand: common beans of this age have stems of 2 to 4 mm.
            stem_radius_cm: 0.15,
            end_height_cm: 13.0,
            max_steps: 1000,
        }
    }
}

impl Obstacles {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { start, targets, end_height_cm, max_steps, .. } = self.clone();
        ensure(!targets.is_empty(), "targets", "[]", "at least one target")?;
        Targets { start, targets, end_height_cm, max_steps }.check()?;
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            obstacle.check().map_err(|error| error.in_table(&format!("obstacles[{index}]")))?;
        }
        for (index, pair) in self.way_points.windows(2).enumerate() {
            let found = format!("{:?}", <[f64; 2]>::from(pair[1]));
            let wanted = "a point higher than the one before it";
            ensure(pair[1].y > pair[0].y, format!("way_points[{}]", index + 1), found, wanted)?;
        }
        let are_finite = self.way_points.iter().all(|point| point.is_finite());
        ensure(are_finite, "way_points", "a number that is not finite", "cm")?;
        let is_length = |value: f64| value > 0.0 && value.is_finite();
        ensure(is_length(self.reach_cm), "reach_cm", self.reach_cm, "cm above 0")?;
        ensure(is_length(self.stem_radius_cm), "stem_radius_cm", self.stem_radius_cm, "cm above 0")
    }

    /// Gap between the surfaces of stem and obstacles, in cm, below 0 if the stem is in one; infinite if no stem or no obstacle
    /// is seen.
    #[must_use]
    pub fn gap(&self, seen: &Observation) -> f64 {
        self.gap_below(f64::INFINITY, seen)
    }

    /// The gap if it is below `limit_cm`, else infinite.
    fn gap_below(&self, limit_cm: f64, seen: &Observation) -> f64 {
        let limit_cm = limit_cm + self.stem_radius_cm;
        let nearest = seen.stem.as_ref().and_then(|stem| clearance_within(limit_cm, &self.obstacles, stem));
        nearest.map_or(f64::INFINITY, |nearest| nearest.distance_cm - self.stem_radius_cm)
    }

    /// What a step costs in which the midline of the stem came from one distance from the obstacles to another, in cm.
    #[inline(always)]
    pub(crate) fn cost_of_distances(&self, was_cm: f64, now_cm: f64) -> f64 {
        let gap = |distance_cm: f64| {
            let gap = distance_cm - self.stem_radius_cm;
            if distance_cm < TOUCH_CM + self.stem_radius_cm { gap } else { f64::INFINITY }
        };
        let (was, now) = (gap(was_cm), gap(now_cm));
        if now < TOUCH_CM { contact_cost(was, now) } else { 0.0 }
    }

    /// `worth`, and what a target is worth that the tip passes from `before` to `after`.
    pub(crate) fn add_target(&self, worth: f64, target: Point, [before, after]: [Point; 2]) -> f64 {
        if !(before.y < target.y && after.y >= target.y) {
            return worth;
        }
        let distance = after.distance(target);
        worth - (distance - FREE_SHARE * self.reach_cm).max(0.0)
            + if distance <= self.reach_cm { TARGET_WORTH } else { 0.0 }
    }

    /// Whether the stem touches an obstacle: with a gap below 0.05 cm.
    #[must_use]
    pub fn touches(&self, seen: &Observation) -> bool {
        self.gap_below(TOUCH_CM, seen) < TOUCH_CM
    }

    /// Steps at which the stem of a track touches an obstacle.
    #[must_use]
    pub fn contacts(&self, track: &Track) -> usize {
        track.samples.iter().filter(|sample| self.touches(&sample.observation())).count()
    }
}

/// What a step costs at whose end the stem touches an obstacle, by the gap before it and at its end, in cm.
#[inline(always)]
fn contact_cost(was: f64, gap: f64) -> f64 {
    let onset = if was < TOUCH_CM { 0.0 } else { CONTACT_COST };
    let depth = |gap: f64| (-gap - DENT_CM).max(0.0);
    let deeper = depth(gap) - depth(was);
    onset + STEP_COST + DEPTH_COST_PER_CM * deeper.max(0.0)
}

impl Task for Obstacles {
    fn is_over(&self, step: u32, seen: &Observation) -> bool {
        seen.tip.y >= self.end_height_cm || step >= self.max_steps
    }

    /// A target within reach is worth 2; beyond that each cm costs 1. Each contact costs 2, each step of it 0.02, and each cm
    /// that the stem goes deeper into an obstacle 3, which only a model does.
    fn step_fitness(&self, _first: &Observation, before: &Observation, after: &Observation) -> f64 {
        let tips = [before.tip, after.tip];
        let worth = self.targets.iter().fold(0.0, |worth, target| self.add_target(worth, *target, tips));
        let gap = self.gap_below(TOUCH_CM, after);
        if gap < TOUCH_CM { worth - contact_cost(self.gap_below(TOUCH_CM, before), gap) } else { worth }
    }

    /// Below 0 the logarithm: a plant that failed has failed, and how far it went into an obstacle matters little. By the mean
    /// fitness a search would care for the worst plants instead of making more plants succeed.
    fn utility(&self, fitness: f64) -> f64 {
        if fitness < 0.0 { -math::ln(1.0 - fitness) } else { fitness }
    }

    fn start(&self) -> Point {
        self.start
    }

    fn targets(&self) -> Vec<Point> {
        self.targets.clone()
    }

    fn way(&self) -> Vec<Point> {
        let mut way = [self.way_points.clone(), self.targets.clone()].concat();
        way.sort_by(|one, other| one.y.total_cmp(&other.y));
        way
    }

    fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    fn best_fitness(&self) -> Option<f64> {
        Some(TARGET_WORTH * self.targets.len() as f64)
    }

    fn as_obstacles(&self) -> Option<&Obstacles> {
        Some(self)
    }

    /// `None` for a track without stems.
    fn is_done(&self, track: &Track) -> Option<bool> {
        track.samples.iter().find(|sample| sample.stem.is_some())?;
        let is_reached = |crossing: &Option<super::Crossing>| {
            crossing.is_some_and(|crossing| crossing.distance_cm <= self.reach_cm)
        };
        Some(self.contacts(track) == 0 && self.crossings(track).iter().all(is_reached))
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
                quality: Quality::Simulated,
            }
        });
        Track::of(samples.collect())
    }

    #[test]
    fn a_way_round_the_disc_is_worth_the_target() {
        let task = Obstacles::default();
        let round =
            track(&[&[(0.0, 4.0)], &[(2.0, 6.0), (2.0, 9.0)], &[(2.0, 6.0), (2.0, 10.0), (0.5, 13.0)]]);
        assert_eq!((task.fitness(&round), task.contacts(&round), task.is_done(&round)), (2.0, 0, Some(true)));
        let wide = track(&[&[(0.0, 4.0)], &[(2.0, 6.0), (2.0, 10.0), (4.0, 13.0)]]);
        assert!((task.fitness(&wide) + 4.0 - 1.2).abs() < 1e-12);
        assert_eq!(task.is_done(&wide), Some(false));
    }

    #[test]
    fn a_way_through_the_disc_costs_more_than_the_target_is_worth() {
        let task = Obstacles::default();
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
        assert_eq!(Obstacles::default().is_done(&tips), None);
    }

    #[test]
    fn controllers_steer_by_way_points_and_targets() {
        let task = Obstacles { way_points: vec![Point::new(3.0, 10.0)], ..Obstacles::default() };
        task.check().unwrap();
        assert_eq!(task.way(), [Point::new(3.0, 10.0), Point::new(0.0, 13.0)]);
        assert_eq!(task.targets(), [Point::new(0.0, 13.0)]);
    }

    #[test]
    fn mistakes_are_named() {
        let refused = |task: Obstacles, words: &str| {
            let error = task.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused(Obstacles { targets: Vec::new(), ..Obstacles::default() }, "targets = []");
        let flat = Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: -1.0 };
        refused(Obstacles { obstacles: vec![flat], ..Obstacles::default() }, "obstacles[0].radius_cm = -1");
        let down = vec![Point::new(1.0, 9.0), Point::new(1.0, 8.0)];
        refused(Obstacles { way_points: down, ..Obstacles::default() }, "way_points[1] = [1.0, 8.0]");
    }

    #[test]
    fn a_plant_that_failed_badly_is_little_worse_than_one_that_failed() {
        let utility = |fitness| Obstacles::default().utility(fitness);
        let utilities = [-30.0, -3.0, -0.1, 0.0, 1.0, 2.0].map(utility);
        assert!(utilities.is_sorted(), "{utilities:?}");
        assert_eq!(utilities[3..], [0.0, 1.0, 2.0]);
        assert!(utility(-3.0) - utility(-30.0) < utility(2.0) - utility(-0.1));
        let spec = crate::task::TaskSpec::Obstacles(Obstacles::default());
        assert_eq!(spec.utility(-3.0), utility(-3.0));
    }

    proptest! {
        #[test]
        fn the_mirror_image_is_worth_the_same(
            middles in prop::collection::vec((-3.0..3.0, 3.0..9.0), 2..20),
        ) {
            let stems: Vec<Vec<(f64, f64)>> =
                middles.iter().map(|&(x, y)| vec![(x, y), (x / 2.0, y + 5.0)]).collect();
            let track = track(&stems.iter().map(Vec::as_slice).collect::<Vec<_>>());
            let task = Obstacles { obstacles: vec![
                Obstacle::Disc { centre: Point::new(-5.2, 8.0), radius_cm: 1.0 },
                Obstacle::Line { ends: [Point::new(0.0, 6.5), Point::new(8.0, 6.5)] },
            ], ..Obstacles::default() };
            let image = Obstacles {
                obstacles: task.obstacles.iter().map(|obstacle| obstacle.mirrored()).collect(), ..task.clone()
            };
            let difference = task.fitness(&track) - image.fitness(&track.mirrored().unwrap());
            prop_assert!(difference.abs() < 1e-9);
        }
    }
}
