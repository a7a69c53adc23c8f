//! The preliminary experiments: no target, a fixed number of steps.

use super::{Past, Score, Task};
use crate::observation::Observation;

/// Grow for a number of steps, whatever the height: the open-loop experiments of section 2.2.1, of 1000 steps (83.3 hours).
#[derive(Clone, Copy, Debug)]
pub struct OpenLoop;

impl Task {
    /// Grow for `max_steps` steps.
    #[must_use]
    pub fn open_loop(max_steps: u32) -> Self {
        Self { max_steps, ..Self::new(OpenLoop) }
    }
}

impl Score for OpenLoop {
    /// 0: nothing is to be reached.
    fn step_fitness(&self, _task: &Task, _past: &Past, _after: &Observation) -> f64 {
        0.0
    }

    fn best(&self, _task: &Task, _first: &Observation) -> Option<f64> {
        Some(0.0)
    }

    fn name(&self) -> &'static str {
        "open_loop"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["start", "max_steps"]
    }
}
