//! The paper's task: the tip visits targets, scored by eq. (9) (section 2.3.1), of which there are two readings.

use std::sync::Arc;

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

/// The paper's targets, scored by the other reading of eq. (9): a step is worth by how much closer to the next target the tip
/// came.
///
/// To the letter of eq. (9) the sign of a step follows from where it ends, so that a step across a target costs its whole
/// length. The paper's prose ("the theoretical best fitness value is the total distance on the x-axis", section 2.3.2) fits
/// this reading as well, in which only what is beyond the target counts against.
#[derive(Clone, Copy, Debug)]
pub struct Approaches;

impl Task {
    /// The paper's targets, scored by approaches.
    #[must_use]
    pub fn approaches() -> Self {
        Self { score: Arc::new(Approaches), ..Self::default() }
    }
}

/// A reading of eq. (9).
#[derive(Clone, Copy)]
pub(crate) enum Reading {
    /// Of [`Targets`].
    Letter,
    /// Of [`Approaches`].
    Prose,
}

impl Reading {
    /// The reading by which a task is scored; `None` for another score.
    pub(crate) fn of(task: &Task) -> Option<Self> {
        let is_letter = task.has_score::<Targets>().then_some(Self::Letter);
        is_letter.or_else(|| task.has_score::<Approaches>().then_some(Self::Prose))
    }

    /// The discrete fitness f of one step, in cm, eq. (9), of as many plants as a number has lanes.
    ///
    /// The next target is the lowest one above `highest_cm`, the greatest height that the tip has had so far. In the paper,
    /// whose tips rise, that is the set T_i of eq. (9); a tip that sinks below a target's height again is not paid for the
    /// same way twice. Above the last target no step counts.
    #[inline(always)]
    pub(crate) fn step_fitness<R: Real>(self, targets: &[Point], highest_cm: R, from_x: R, to_x: R) -> R {
        // Not a number where there is no next target: then no comparison holds.
        let mut next = R::splat(f64::NAN);
        for target in targets.iter().rev() {
            next = R::select(highest_cm.lt(R::splat(target.y)), R::splat(target.x), next);
        }
        let nothing = R::splat(0.0);
        match self {
            Self::Letter => {
                let shift = to_x - from_x;
                let on_target = R::select(to_x.eq(next), shift.abs(), nothing);
                let beyond = R::select(to_x.gt(next), -shift, on_target);
                R::select(to_x.lt(next), shift, beyond)
            }
            Self::Prose => {
                let closer = (from_x - next).abs() - (to_x - next).abs();
                R::select(next.eq(next), closer, nothing)
            }
        }
    }

    fn of_step(self, task: &Task, past: &Past, after: &Observation) -> f64 {
        let highest_cm = past.highest_cm.max(after.tip.y);
        self.step_fitness(&task.targets, highest_cm, past.latest.tip.x, after.tip.x)
    }
}

impl Score for Approaches {
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        Reading::Prose.of_step(task, past, after)
    }

    fn best(&self, task: &Task, first: &Observation) -> Option<f64> {
        Targets.best(task, first)
    }

    fn kind(&self) -> &'static str {
        "approaches"
    }

    fn keys(&self) -> &'static [&'static str] {
        Targets.keys()
    }
}

impl Score for Targets {
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        Reading::Letter.of_step(task, past, after)
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
    fn an_approach_across_a_target_costs_what_is_beyond_it() {
        // 2.9 towards the first target at 3, then as far beyond it as it was before.
        let across = track(&[(0.0, 4.0), (2.9, 5.0), (3.1, 5.1)]);
        assert!((Task::approaches().fitness(&across) - 2.9).abs() < 1e-12);
        let short = track(&[(0.0, 4.0), (2.0, 5.0), (1.5, 5.1)]);
        assert_eq!(Task::approaches().fitness(&short), Task::default().fitness(&short));
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
