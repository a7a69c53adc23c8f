//! The rule that a person would write by hand: light the lamp on the side of the next target.

use super::Controller;
use crate::geometry::Point;
use crate::light::Light;
use crate::observation::Observation;

/// Lights the lamp towards which the tip must move to meet the next target: greedy, without a model.
///
/// The next target is the lowest that is higher than the tip. Above all targets the last one counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Chase {
    targets: Vec<Point>,
}

impl Chase {
    /// Chases `targets`, in cm, in ascending height.
    #[must_use]
    pub const fn new(targets: Vec<Point>) -> Self {
        Self { targets }
    }
}

impl Controller for Chase {
    fn decide(&mut self, seen: &Observation) -> Light {
        let next = self.targets.iter().find(|target| seen.tip.y < target.y).or(self.targets.last());
        if next.is_some_and(|target| seen.tip.x < target.x) { Light::Right } else { Light::Left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_the_side_of_the_next_target() {
        let mut chase = Chase::new(vec![Point::new(3.0, 6.0), Point::new(-5.0, 9.0)]);
        let mut decide = |x, y| chase.decide(&Observation::simulated(Point::new(x, y)));
        assert_eq!(decide(0.0, 4.0), Light::Right);
        assert_eq!(decide(4.0, 5.0), Light::Left);
        assert_eq!(decide(0.0, 6.0), Light::Left);
        assert_eq!(decide(-6.0, 12.0), Light::Right);
    }
}
