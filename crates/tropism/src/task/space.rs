//! Targets in space, for plants that are seen by two cameras and lit from all sides.
//!
//! The paper names targets in space as future work (section 5). The fitness is that of eq. (9) with horizontal distances.

use super::{Past, Score, Targets, Task, tip_in_space};
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::geometry::space::SpacePoint;
use crate::math::hypot;
use crate::observation::Observation;
use crate::track::Track;

/// Targets in space that the tip is to visit, from the lowest to the highest.
///
/// A plant of which the depth is not known counts as standing in the plane of the front camera.
#[derive(Clone, Copy, Debug)]
pub struct Space;

impl Task {
    /// Three targets around the vertical through the root, at the heights of the paper's.
    #[must_use]
    pub fn space() -> Self {
        let targets = vec![Point::new(2.0, 6.5), Point::new(-2.0, 10.0), Point::new(1.0, 13.5)];
        Self { targets, depths_cm: vec![1.5, 2.0, -1.5], end_height_cm: 13.8, ..Self::new(Space) }
    }

    /// A task in space without the depth of its targets: the paper's. `None` for another task.
    #[must_use]
    pub fn in_front(&self) -> Option<Self> {
        let flat = || Self { targets: self.targets.clone(), ..Self::new(super::Targets) };
        let Self { start, end_height_cm, max_steps, .. } = *self;
        self.has_score::<Space>().then(|| Self { start, end_height_cm, max_steps, ..flat() })
    }
}

/// Horizontal distance, in cm.
fn apart(one: SpacePoint, other: SpacePoint) -> f64 {
    hypot(one[0] - other[0], one[2] - other[2])
}

impl Score for Space {
    /// By how much the step brings the tip nearer to the next target, seen from above, in cm. In a plane this is eq. (9), but
    /// for the step that passes a target: here it counts by how near it ends.
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        let height = past.highest_cm.max(after.tip.y);
        let targets = task.way_in_space().unwrap_or_default();
        let Some(target) = targets.iter().find(|target| height < target[1]) else { return 0.0 };
        apart(tip_in_space(&past.latest), *target) - apart(tip_in_space(after), *target)
    }

    /// The horizontal way that the tip needs to visit all targets, in cm.
    fn best(&self, task: &Task, first: &Observation) -> Option<f64> {
        let targets = task.way_in_space().unwrap_or_default();
        let left = targets.into_iter().filter(|target| target[1] > first.tip.y);
        let stops: Vec<SpacePoint> = core::iter::once(tip_in_space(first)).chain(left).collect();
        Some(stops.windows(2).fold(0.0, |sum, pair| sum + apart(pair[0], pair[1])))
    }

    /// Whether the tip came within [`MISS_CM`](super::MISS_CM) of each target at its height.
    fn is_done(&self, task: &Task, track: &Track) -> Option<bool> {
        Targets.is_done(task, track)
    }

    fn name(&self) -> &'static str {
        "space"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["start", "targets", "depths_cm", "end_height_cm", "max_steps"]
    }

    fn check(&self, task: &Task) -> Result<(), OutOfRange> {
        ensure(!task.targets.is_empty(), "targets", "[]", "at least one target")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observation::Depth;
    use crate::task::Crossing;
    use crate::track::Track;

    fn track(tips: &[SpacePoint]) -> Track {
        let mut track = crate::task::tests::track(&tips.iter().map(|&[x, y, _]| (x, y)).collect::<Vec<_>>());
        for (sample, [_, _, z]) in track.samples.iter_mut().zip(tips) {
            sample.depth = Some(Depth { tip_cm: *z, stem_cm: Vec::new() });
        }
        track
    }

    #[test]
    fn a_straight_way_is_worth_the_best() {
        let targets = [[3.0, 6.0], [3.0, 10.0]].map(Point::from).to_vec();
        let task = Task { targets, depths_cm: vec![4.0, 0.0], ..Task::space() };
        let straight = track(&[[0.0, 4.0, 0.0], [3.0, 5.9, 4.0], [3.0, 9.9, 0.0], [3.0, 10.0, 0.0]]);
        assert_eq!((task.best_fitness(), task.fitness(&straight)), (Some(9.0), 9.0));
        let crossings = task.crossings(&straight);
        assert_eq!(crossings[1], Some(Crossing { step: 3, distance_cm: 0.0 }));
        assert_eq!(crossings[0].unwrap().step, 2);
    }

    #[test]
    fn in_the_plane_it_is_the_papers_task() {
        let plane = Task::default();
        let space = Task { targets: plane.targets.clone(), depths_cm: vec![0.0; 3], ..Task::space() };
        let tips = [(0.0, 4.0), (1.5, 4.8), (2.9, 5.9), (-1.0, 7.0), (-4.9, 8.9), (-2.0, 13.4)];
        let track = track(&tips.map(|(x, y)| [x, y, 0.0]));
        assert!((space.fitness(&track) - plane.fitness(&track)).abs() < 1e-12);
        assert_eq!(space.best_fitness(), plane.best_fitness());
        assert_eq!(space.crossings(&track), plane.crossings(&track));
        assert_eq!(space.in_front(), Some(plane));
    }
}
