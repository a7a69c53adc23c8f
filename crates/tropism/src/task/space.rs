//! Targets in space, for plants that are seen by two cameras and lit from all sides.
//!
//! The paper names targets in space as future work (section 5). The fitness is that of eq. (9) with horizontal distances.

use serde::{Deserialize, Serialize};

use super::{Crossing, Targets, Task};
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::geometry::space::SpacePoint;
use crate::math::hypot;
use crate::math::vector::distance;
use crate::observation::Observation;
use crate::track::Track;

/// Targets in space that the tip is to visit, from the lowest to the highest.
///
/// A plant of which the depth is not known counts as standing in the plane of the front camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Space {
    /// Tip of the seedling at the start of a simulated experiment, in cm, y above 0.
    pub start: Point,
    /// Targets in ascending height above the start, in cm: x, y, z. At least one.
    pub targets: Vec<SpacePoint>,
    /// Height of the tip at which the experiment ends, in cm; that of the highest target or more.
    pub end_height_cm: f64,
    /// Steps after which the experiment ends although the tip is lower, 1 to 1000000.
    pub max_steps: u32,
}

impl Default for Space {
    /// Three targets around the vertical through the root, at the heights of the paper's.
    fn default() -> Self {
        let Targets { start, end_height_cm, max_steps, .. } = Targets::default();
        let targets = vec![[2.0, 6.5, 1.5], [-2.0, 10.0, 2.0], [1.0, 13.5, -1.5]];
        Self { start, targets, end_height_cm, max_steps }
    }
}

impl Space {
    /// The same task without the depth of its targets.
    #[must_use]
    pub fn in_front(&self) -> Targets {
        let targets = self.targets.iter().map(|&[x, y, _]| Point::new(x, y)).collect();
        Targets { start: self.start, targets, end_height_cm: self.end_height_cm, max_steps: self.max_steps }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        ensure(!self.targets.is_empty(), "targets", "[]", "at least one target")?;
        for (index, target) in self.targets.iter().enumerate() {
            let is_place = target[2].is_finite();
            ensure(is_place, format!("targets[{index}]"), format!("{target:?}"), "[x, y, z] in cm")?;
        }
        self.in_front().check()
    }

    /// The horizontal way that the tip needs to visit all targets, in cm.
    #[must_use]
    pub fn best(&self) -> f64 {
        let start = [self.start.x, self.start.y, 0.0];
        let stops: Vec<SpacePoint> = core::iter::once(start).chain(self.targets.iter().copied()).collect();
        stops.windows(2).map(|pair| apart(pair[0], pair[1])).sum()
    }
}

/// The tip in space; in the plane of the front camera if its depth is not known.
fn tip(seen: &Observation) -> SpacePoint {
    seen.tip_in_space().unwrap_or([seen.tip.x, seen.tip.y, 0.0])
}

/// Horizontal distance, in cm.
fn apart(one: SpacePoint, other: SpacePoint) -> f64 {
    hypot(one[0] - other[0], one[2] - other[2])
}

impl Task for Space {
    fn is_over(&self, step: u32, seen: &Observation) -> bool {
        seen.tip.y >= self.end_height_cm || step >= self.max_steps
    }

    /// By how much the step brings the tip nearer to the next target, seen from above, in cm. In a plane this is eq. (9), but
    /// for the step that passes a target: here it counts by how near it ends.
    fn step_fitness(&self, first: &Observation, before: &Observation, after: &Observation) -> f64 {
        if after.tip.y < first.tip.y {
            return 0.0;
        }
        let next = self.targets.iter().find(|target| after.tip.y < target[1]);
        next.map_or(0.0, |target| apart(tip(before), *target) - apart(tip(after), *target))
    }

    fn start(&self) -> Point {
        self.start
    }

    fn targets(&self) -> Vec<Point> {
        self.in_front().targets
    }

    fn in_front(&self) -> Option<Targets> {
        Some(self.in_front())
    }

    fn way_in_space(&self) -> Option<Vec<SpacePoint>> {
        Some(self.targets.clone())
    }

    /// Distances are those in space.
    fn crossings(&self, track: &Track) -> Vec<Option<Crossing>> {
        let crossing = |target: &SpacePoint| {
            let sample = track.samples.iter().find(|sample| sample.tip.y >= target[1])?;
            Some(Crossing { step: sample.step, distance_cm: distance(tip(&sample.observation()), *target) })
        };
        self.targets.iter().map(crossing).collect()
    }

    fn best_fitness(&self) -> Option<f64> {
        Some(self.best())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observation::{Depth, Quality};
    use crate::track::Sample;

    fn track(tips: &[SpacePoint]) -> Track {
        let sample = |(step, &[x, y, z]): (usize, &SpacePoint)| Sample {
            step: step as u32,
            time_s: 0.0,
            tip: Point::new(x, y),
            stem: None,
            depth: Some(Depth { tip_cm: z, stem_cm: Vec::new() }),
            light: None,
            quality: Quality::Simulated,
        };
        Track::of(tips.iter().enumerate().map(sample).collect())
    }

    #[test]
    fn a_straight_way_is_worth_the_best() {
        let task = Space { targets: vec![[3.0, 6.0, 4.0], [3.0, 10.0, 0.0]], ..Space::default() };
        let straight = track(&[[0.0, 4.0, 0.0], [3.0, 5.9, 4.0], [3.0, 9.9, 0.0], [3.0, 10.0, 0.0]]);
        assert_eq!((task.best(), task.fitness(&straight)), (9.0, 9.0));
        let crossings = task.crossings(&straight);
        assert_eq!(crossings[1], Some(Crossing { step: 3, distance_cm: 0.0 }));
        assert_eq!(crossings[0].unwrap().step, 2);
    }

    #[test]
    fn in_the_plane_it_is_the_papers_task() {
        let plane = Targets::default();
        let targets = plane.targets.iter().map(|point| [point.x, point.y, 0.0]).collect();
        let space = Space { targets, ..Space::default() };
        let tips = [(0.0, 4.0), (1.5, 4.8), (2.9, 5.9), (-1.0, 7.0), (-4.9, 8.9), (-2.0, 13.4)];
        let track = track(&tips.map(|(x, y)| [x, y, 0.0]));
        assert!((space.fitness(&track) - plane.fitness(&track)).abs() < 1e-12);
        assert_eq!(space.best(), plane.best());
        assert_eq!(space.crossings(&track), plane.crossings(&track));
    }

    #[test]
    fn mistakes_are_named() {
        Space::default().check().unwrap();
        let refused = |targets, words: &str| {
            let error = Space { targets, ..Space::default() }.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused(vec![[0.0, 6.0, f64::NAN]], "targets[0]");
        refused(vec![[0.0, 9.0, 1.0], [0.0, 8.0, 1.0]], "targets[1]");
        refused(Vec::new(), "targets = []");
    }
}
