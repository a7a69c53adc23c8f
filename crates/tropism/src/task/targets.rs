//! The paper's task: the tip visits targets, scored by eq. (9) (section 2.3.1).

use super::{Past, Score, Task};
use crate::geometry::Point;
use crate::math::Real;
use crate::observation::Observation;

/// Targets that the tip is to visit, from the lowest to the highest (section 2.3.1).
#[derive(Clone, Copy, Debug)]
pub struct Targets;

impl Default for Task {
    /// The paper's task: targets at (3, 6), (-5, 9) and (-1, 13.5); the experiment ends at 13.8 cm.
    fn default() -> Self {
        let targets = vec![Point::new(3.0, 6.0), Point::new(-5.0, 9.0), Point::new(-1.0, 13.5)];
        Self { targets, end_height_cm: 13.8, ..Self::new(Targets) }
    }
}

/// Eq. (9) of a step from one x of the tip to another, of as many plants as a number has lanes. `highest_cm` is the greatest height
/// of the tip so far.
#[inline(always)]
pub(crate) fn step_fitness<R: Real>(targets: &[Point], highest_cm: R, from_x: R, to_x: R) -> R {
    let shift = to_x - from_x;
    let mut fitness = R::splat(0.0);
    for target in targets.iter().rev() {
        let x = R::splat(target.x);
        let beyond = R::select(to_x.gt(x), -shift, shift.abs());
        let towards = R::select(to_x.lt(x), shift, beyond);
        fitness = R::select(highest_cm.lt(R::splat(target.y)), towards, fitness);
    }
    fitness
}

impl Score for Targets {
    /// The discrete fitness f of one step, in cm, eq. (9): movement towards the next target counts, movement away from it
    /// counts against.
    ///
    /// The next target is the lowest one above all heights that the tip has had so far. In the paper, whose tips rise, that is
    /// the set T_i of eq. (9); a tip that sinks below a target's height again is not paid for the same way twice.
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        let highest_cm = past.highest_cm.max(after.tip.y);
        step_fitness(&task.targets, highest_cm, past.latest.tip.x, after.tip.x)
    }

    /// The way in x that the tip needs to visit all targets, in cm (section 2.3.2): 15 for the paper's task.
    ///
    /// ```
    /// use tropism::task::Task;
    /// use tropism::track::Track;
    /// let straight = "tip_x_cm,tip_y_cm,light\n0,4,right\n3,5.9,left\n-5,8.9,right\n-1,13.4,dark\n";
    /// let track = Track::read_csv(straight.as_bytes())?;
    /// assert_eq!(Task::default().fitness(&track), 15.0);
    /// assert_eq!(Task::default().best_fitness(), Some(15.0));
    /// # Ok::<(), tropism::track::TrackError>(())
    /// ```
    fn best(&self, task: &Task, first: &Observation) -> Option<f64> {
        let left = task.targets.iter().filter(|target| target.y > first.tip.y);
        let stops: Vec<f64> = core::iter::once(first.tip.x).chain(left.map(|target| target.x)).collect();
        // Not `sum`: that of nothing is -0.
        Some(stops.windows(2).fold(0.0, |sum, pair| sum + (pair[1] - pair[0]).abs()))
    }

    fn kind(&self) -> &'static str {
        "targets"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["start", "targets", "end_height_cm", "max_steps"]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::task::Crossing;
    use crate::task::tests::track;

    #[test]
    fn crossing_a_target_costs_the_whole_step() {
        let task = Task::default();
        // From 2.9 over the target at 3 to 3.1: eq. (9) asks where the tip is after the step.
        assert!((task.fitness(&track(&[(0.0, 4.0), (2.9, 5.0), (3.1, 5.1)])) - 2.7).abs() < 1e-12);
        // A step that ends exactly on the target counts, whichever way it came.
        assert!((task.fitness(&track(&[(3.2, 5.0), (3.0, 5.1)])) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn each_height_is_passed_once() {
        let task = Task::default();
        assert_eq!(task.fitness(&track(&[(0.0, 13.5), (1.0, 13.6)])), 0.0, "above the last target");
        assert_eq!(task.fitness(&track(&[(0.0, 5.9), (1.0, 6.0)])), -1.0, "away from the second target");
        // Back below the first target, the second one still is the next.
        assert_eq!(task.fitness(&track(&[(3.0, 6.0), (1.0, 5.5)])), 2.0);
        // A tip that sinks below the start is on its way to the first target.
        assert_eq!(task.fitness(&track(&[(0.0, 4.0), (-9.0, 3.9), (3.0, 4.0)])), 3.0);
    }

    #[test]
    fn crossings_have_step_and_distance() {
        let crossings = Task::default().crossings(&track(&[(0.0, 4.0), (3.0, 6.0), (0.0, 9.0)]));
        assert_eq!(crossings[0], Some(Crossing { step: 1, distance_cm: 0.0 }));
        assert_eq!(crossings[1], Some(Crossing { step: 2, distance_cm: 5.0 }));
        assert_eq!(crossings[2], None);
    }

    proptest! {
        #[test]
        fn a_mirrored_track_has_the_fitness_of_the_mirrored_task(
            tips in prop::collection::vec((-10.0..10.0, 3.0..15.0), 2..40),
        ) {
            let task = Task::default();
            let targets = task.targets.iter().map(|target| target.mirrored()).collect();
            let image = Task { targets, ..Task::default() };
            let track = track(&tips);
            prop_assert_eq!(task.fitness(&track), image.fitness(&track.mirrored().unwrap()));
        }
    }
}
