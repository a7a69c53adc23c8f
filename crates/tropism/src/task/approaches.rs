//! The other reading of eq. (9): a step is worth by how much closer to the next target the tip came.
//!
//! To the letter of eq. (9) the sign of a step follows from where it ends, so that a step across a target costs its whole
//! length. The paper's prose ("the theoretical best fitness value is the total distance on the x-axis", section 2.3.2) fits
//! this reading as well, in which only what is beyond the target counts against.

use std::sync::Arc;

use super::{Past, Score, Targets, Task};
use crate::observation::Observation;

/// Targets that the tip is to visit, scored by approaches.
#[derive(Clone, Copy, Debug)]
pub struct Approaches;

impl Task {
    /// The paper's targets, scored by approaches.
    #[must_use]
    pub fn approaches() -> Self {
        Self { score: Arc::new(Approaches), ..Self::default() }
    }
}

impl Score for Approaches {
    /// By how much the step brings the tip closer in x to the next target, in cm. The next target is that of [`Targets`].
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        let height = past.highest_cm.max(after.tip.y);
        let Some(target) = task.targets.iter().find(|target| height < target.y) else { return 0.0 };
        (past.latest.tip.x - target.x).abs() - (after.tip.x - target.x).abs()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::tests::track;

    #[test]
    fn a_step_across_a_target_costs_what_is_beyond_it() {
        // 2.9 towards the first target at 3, then as far beyond it as it was before.
        let across = track(&[(0.0, 4.0), (2.9, 5.0), (3.1, 5.1)]);
        assert!((Task::approaches().fitness(&across) - 2.9).abs() < 1e-12);
        assert!((Task::default().fitness(&across) - 2.7).abs() < 1e-12);
        let short = track(&[(0.0, 4.0), (2.0, 5.0), (1.5, 5.1)]);
        assert_eq!(Task::approaches().fitness(&short), Task::default().fitness(&short));
    }
}
