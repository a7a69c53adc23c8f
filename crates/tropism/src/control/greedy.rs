//! The rule that a person would write by hand: light the lamp on the side of the next target.

use super::Controller;
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::observation::Observation;
use crate::task::Task;

/// Lights the lamp towards which the tip must move to reach the next target. Greedy, without a model; the baseline of
/// evolved controllers. The command line calls it `chase`.
///
/// The next target is the lowest one above the tip. Above all targets the last one counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Greedy {
    targets: Vec<Point>,
    left: Light,
    right: Light,
}

impl Greedy {
    /// Steers along the way of `task` with the outermost lamps of `layout`.
    #[must_use]
    pub fn new(task: &(impl Task + ?Sized), layout: &Layout) -> Self {
        Self::towards(task.way(), layout)
    }

    /// Steers towards `targets` (cm, in ascending height) with the outermost lamps of `layout`.
    #[must_use]
    pub fn towards(targets: Vec<Point>, layout: &Layout) -> Self {
        Self { targets, left: layout.towards(false), right: layout.towards(true) }
    }
}

impl Controller for Greedy {
    fn decide(&mut self, seen: &Observation) -> Light {
        let next = self.targets.iter().find(|target| seen.tip.y < target.y).or(self.targets.last());
        if next.is_some_and(|target| seen.tip.x < target.x) { self.right } else { self.left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Targets;

    #[test]
    fn lights_the_side_of_the_next_target() {
        let task =
            Targets { targets: vec![Point::new(3.0, 6.0), Point::new(-5.0, 9.0)], ..Targets::default() };
        let mut greedy = Greedy::new(&task, &Layout::default());
        let mut decide = |x, y| greedy.decide(&Observation::simulated(Point::new(x, y)));
        assert_eq!(decide(0.0, 4.0), Light::RIGHT);
        assert_eq!(decide(4.0, 5.0), Light::LEFT);
        assert_eq!(decide(0.0, 6.0), Light::LEFT);
        assert_eq!(decide(-6.0, 12.0), Light::RIGHT);
    }
}
