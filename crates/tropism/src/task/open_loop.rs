//! The preliminary experiments: no target, a fixed number of steps.

use serde::{Deserialize, Serialize};

use super::Task;
use crate::geometry::Point;
use crate::observation::Observation;

/// Grow for a number of steps, whatever the height: the open-loop experiments of section 2.2.1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OpenLoop {
    /// Tip of the seedling at the start of a simulated experiment, in cm, y above 0. Paper: (0, 4).
    pub start: Point,
    /// Steps of the experiment, 1 to 1000000. Paper: 1000 (83.3 hours).
    pub steps: u32,
}

impl Default for OpenLoop {
    fn default() -> Self {
        Self { start: Point::new(0.0, 4.0), steps: 1000 }
    }
}

impl Task for OpenLoop {
    fn is_over(&self, step: u32, _seen: &Observation) -> bool {
        step >= self.steps
    }

    /// 0: nothing is to be reached.
    fn step_fitness(&self, _first: &Observation, _before: &Observation, _after: &Observation) -> f64 {
        0.0
    }

    fn best_fitness(&self) -> Option<f64> {
        Some(0.0)
    }

    fn start(&self) -> Point {
        self.start
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_number_of_steps_ends_it() {
        let high = Observation::simulated(Point::new(0.0, 80.0));
        assert!(!OpenLoop::default().is_over(999, &high));
        assert!(OpenLoop::default().is_over(1000, &high));
    }
}
