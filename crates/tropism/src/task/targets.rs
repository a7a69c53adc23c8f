//! The paper's task: the tip visits targets, scored by eq. (9) (section 2.3.1).

use serde::{Deserialize, Serialize};

use super::{Crossing, Past, Score, Task};
use crate::geometry::Point;
use crate::math::Real;
use crate::observation::Observation;
use crate::track::Track;

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

/// How eq. (9) is read: what a step towards the targets is worth. The next target is the lowest one above all heights that the
/// tip has had; in the paper, whose tips rise, that is the set T_i. Above the last target no step counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Reading {
    /// Eq. (9) to the letter: the sign of a step follows from where it ends, so that a step across a target costs its whole
    /// length.
    Letter,
    /// A step is worth by how much closer to the next target the tip came in x. The paper's prose ("the theoretical best
    /// fitness value is the total distance on the x-axis", section 2.3.2) fits this as well as the letter: both pay the same for
    /// a step that crosses no target. The default: by it evolution reaches what the paper reports (docs/validation/reproduction.md).
    #[default]
    Approach,
    /// Not the paper's: only where the tip crosses a target's height counts. Each target pays [`ARRIVAL_CM`] less the distance in x.
    Arrival,
}

/// What a target is worth by arrival, in cm: the distance from which a crossing is worth no more than none. Chosen by hand: twice
/// as far as the paper's targets are from the middle.
pub const ARRIVAL_CM: f64 = 10.0;

impl Reading {
    /// The discrete fitness f of one step, in cm, eq. (9), of as many plants as a number has lanes.
    ///
    /// `highest_cm` are the greatest heights that the tip has had before the step and with it.
    #[inline(always)]
    pub(crate) fn step_fitness<R: Real>(
        self,
        targets: &[Point],
        highest_cm: [R; 2],
        from_x: R,
        to_x: R,
    ) -> R {
        let nothing = R::splat(0.0);
        let [before, with] = highest_cm;
        if self == Self::Arrival {
            return targets.iter().fold(nothing, |sum, target| {
                let y = R::splat(target.y);
                let miss = (to_x - R::splat(target.x)).abs().min(R::splat(ARRIVAL_CM));
                let worth = R::select(with.lt(y), nothing, R::splat(ARRIVAL_CM) - miss);
                sum + R::select(before.lt(y), worth, nothing)
            });
        }
        // Not a number where there is no next target: then no comparison holds.
        let mut next = R::splat(f64::NAN);
        for target in targets.iter().rev() {
            next = R::select(with.lt(R::splat(target.y)), R::splat(target.x), next);
        }
        if self == Self::Approach {
            let closer = (from_x - next).abs() - (to_x - next).abs();
            return R::select(next.eq(next), closer, nothing);
        }
        let shift = to_x - from_x;
        let on_target = R::select(to_x.eq(next), shift.abs(), nothing);
        let beyond = R::select(to_x.gt(next), -shift, on_target);
        R::select(to_x.lt(next), shift, beyond)
    }
}

impl Task {
    /// How the task reads eq. (9); `None` if it has another score.
    pub(crate) fn reading(&self) -> Option<Reading> {
        self.has_score::<Targets>().then_some(self.score)
    }

    /// The fitness of `track` by both readings of eq. (9): to the letter, and by approach; `None` for a task with another score.
    #[must_use]
    pub fn both_readings(&self, track: &Track) -> Option<[f64; 2]> {
        self.reading()?;
        Some([Reading::Letter, Reading::Approach].map(|reading| self.by(reading).fitness(track)))
    }
}

impl Score for Targets {
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        let highest_cm = [past.highest_cm, past.highest_cm.max(after.tip.y)];
        task.score.step_fitness(&task.targets, highest_cm, past.latest.tip.x, after.tip.x)
    }

    /// The way in x that the tip needs to visit all targets, in cm (section 2.3.2): 15 for the paper's task. By arrival, what all
    /// targets pay.
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
        if task.score == Reading::Arrival {
            return Some(ARRIVAL_CM * left.count() as f64);
        }
        let stops: Vec<f64> = core::iter::once(first.tip.x).chain(left.map(|target| target.x)).collect();
        // Not `sum`: that of nothing is -0.
        Some(stops.windows(2).fold(0.0, |sum, pair| sum + (pair[1] - pair[0]).abs()))
    }

    /// Whether the tip came within [`MISS_CM`](super::MISS_CM) of each target at its height.
    fn is_done(&self, task: &Task, track: &Track) -> Option<bool> {
        (!task.targets.is_empty()).then(|| self.crossings(task, track).into_iter().all(Crossing::is_visit))
    }

    fn name(&self) -> &'static str {
        "targets"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["start", "targets", "score", "end_height_cm", "max_steps"]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::task::tests::track;

    #[test]
    fn crossing_a_target_costs_the_whole_step() {
        let task = Task::default().by(Reading::Letter);
        // From 2.9 over the target at 3 to 3.1: eq. (9) asks where the tip is after the step.
        assert!((task.fitness(&track(&[(0.0, 4.0), (2.9, 5.0), (3.1, 5.1)])) - 2.7).abs() < 1e-12);
        // A step that ends exactly on the target counts, whichever way it came.
        assert!((task.fitness(&track(&[(3.2, 5.0), (3.0, 5.1)])) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn an_approach_across_a_target_costs_what_is_beyond_it() {
        let by_approach = Task::default();
        // 2.9 towards the first target at 3, then as far beyond it as it was before.
        let across = track(&[(0.0, 4.0), (2.9, 5.0), (3.1, 5.1)]);
        assert!((by_approach.fitness(&across) - 2.9).abs() < 1e-12);
        let short = track(&[(0.0, 4.0), (2.0, 5.0), (1.5, 5.1)]);
        assert_eq!(by_approach.fitness(&short), by_approach.by(Reading::Letter).fitness(&short));
    }

    #[test]
    fn an_arrival_is_worth_what_the_tip_misses_by() {
        let by_arrival = Task { score: Reading::Arrival, ..Task::default() };
        assert_eq!(by_arrival.best_fitness(), Some(3.0 * ARRIVAL_CM));
        // Wherever it was before: 0.5 from the first target, 20 from the second; the third was not reached.
        let tips = track(&[(0.0, 4.0), (8.0, 5.0), (2.5, 6.0), (-25.0, 9.0), (-1.0, 13.4)]);
        assert_eq!(by_arrival.fitness(&tips), ARRIVAL_CM - 0.5);
        // Two heights in one step, and back below them.
        let leap = track(&[(0.0, 4.0), (-5.0, 9.5), (3.0, 5.0), (3.0, 6.5)]);
        assert_eq!(by_arrival.fitness(&leap), 2.0 * ARRIVAL_CM - 8.0);
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
        let visits = |last: f64| track(&[(0.0, 4.0), (3.0, 6.0), (-5.0, 9.0), (last, 13.5)]);
        assert_eq!([-0.1, 0.1].map(|last| Task::default().is_done(&visits(last))), [Some(true), Some(false)]);
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
