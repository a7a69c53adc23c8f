//! The rule that a person would write by hand: light the lamp on the side of the next target.

use super::Controller;
use super::steering::Steering;
use crate::geometry::Point;
use crate::geometry::space::SpacePoint;
use crate::lamps::{Layout, Light};
use crate::math;
use crate::observation::Observation;
use crate::obstacle::Pole;
use crate::task::Task;

/// Lights the lamp towards which the tip must move to reach the next target. Greedy, without a model; the baseline of
/// evolved controllers. The command line calls it `greedy`.
///
/// Round a [pole](Task::pole) it lights the lamp in the direction of a point ahead on a circle about the pole.
///
/// The next target is the lowest one above the tip. Above all targets the last one counts. For a task in the plane it lights
/// the outermost lamp on the side of the target; for one [in space](Task::way_in_space) the lamp whose direction, seen from
/// above, is nearest to that of the target from the tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Greedy {
    way: Vec<SpacePoint>,
    pole: Option<Pole>,
    steering: Steering,
}

/// How far ahead on the circle about a pole the point lies to which it steers, in rad. Chosen by hand; the first value that was
/// tried.
pub(super) const AHEAD_RAD: f64 = 0.4;

/// Distance of that circle from the surface of the pole, in cm. Chosen: the thickness of a young stem, which then lies on the
/// pole.
pub(super) const BESIDE_POLE_CM: f64 = 0.3;

impl Greedy {
    /// Steers along the way of `task` with the lamps of `layout`.
    #[must_use]
    pub fn new(task: &Task, layout: &Layout) -> Self {
        let in_space = |way| Self { way, pole: task.pole, steering: Steering::in_space(layout) };
        match task.way_in_space() {
            Some(way) => in_space(way),
            None if task.pole.is_some() => in_space(Vec::new()),
            None => Self::towards(task.way(), layout),
        }
    }

    /// Steers towards `targets` (cm, in ascending height) with the outermost lamps of `layout`.
    #[must_use]
    pub fn towards(targets: Vec<Point>, layout: &Layout) -> Self {
        let way = targets.into_iter().map(|target| [target.x, target.y, 0.0]).collect();
        Self { way, pole: None, steering: Steering::in_plane(layout) }
    }
}

/// From a tip at (x, z) to the point that is `ahead_rad` ahead of it on the circle `beside_cm` from the surface of `pole`,
/// counter-clockwise seen from above.
pub(super) fn round(pole: Pole, [x, z]: [f64; 2], ahead_rad: f64, beside_cm: f64) -> [f64; 2] {
    // Seen from above, z points down.
    let angle = math::atan2(pole.at[1] - z, x - pole.at[0]) + ahead_rad;
    let radius = pole.radius_cm + beside_cm;
    [pole.at[0] + radius * math::cos(angle) - x, pole.at[1] - radius * math::sin(angle) - z]
}

impl Controller for Greedy {
    fn decide(&mut self, seen: &Observation) -> Light {
        if let Some(pole) = self.pole {
            let z = seen.depth.as_ref().map_or(0.0, |depth| depth.tip_cm);
            return self.steering.towards(round(pole, [seen.tip.x, z], AHEAD_RAD, BESIDE_POLE_CM));
        }
        let next = self.way.iter().find(|target| seen.tip.y < target[1]).or(self.way.last());
        let z = seen.depth.as_ref().map(|depth| depth.tip_cm);
        let towards = |target: &SpacePoint| [target[0] - seen.tip.x, z.map_or(0.0, |z| target[2] - z)];
        self.steering.towards(next.map_or([0.0; 2], towards))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observation::Depth;

    #[test]
    fn lights_the_side_of_the_next_target() {
        let task = Task { targets: vec![Point::new(3.0, 6.0), Point::new(-5.0, 9.0)], ..Task::default() };
        let mut greedy = Greedy::new(&task, &Layout::default());
        let mut decide = |x, y| greedy.decide(&Observation::simulated(Point::new(x, y)));
        assert_eq!(decide(0.0, 4.0), Light::RIGHT);
        assert_eq!(decide(4.0, 5.0), Light::LEFT);
        assert_eq!(decide(0.0, 6.0), Light::LEFT);
        assert_eq!(decide(-6.0, 12.0), Light::RIGHT);
    }

    #[test]
    fn round_a_pole_it_lights_the_lamp_ahead() {
        let task = Task::spiral();
        let mut greedy = Greedy::new(&task, &Layout::four_sides());
        let mut decide = |x, z| {
            let depth = Some(Depth { tip_cm: z, stem_cm: Vec::new() });
            greedy.decide(&Observation { depth, ..Observation::simulated(Point::new(x, 9.0)) })
        };
        // The pole stands at x = 1.3; seen from above the tip goes from its left to the front, to the right and to the back.
        assert_eq!([decide(0.0, 0.0), decide(1.3, 1.3)], [Light::FRONT, Light::RIGHT]);
        assert_eq!([decide(2.6, 0.0), decide(1.3, -1.3)], [Light::BACK, Light::LEFT]);
    }

    #[test]
    fn in_space_it_lights_the_lamp_in_the_direction_of_the_target() {
        let targets = vec![Point::new(2.0, 8.0), Point::new(0.0, 12.0)];
        let task = Task { targets, depths_cm: vec![1.0, -3.0], ..Task::space() };
        let mut greedy = Greedy::new(&task, &Layout::four_sides());
        let mut decide = |x, y, z| {
            let depth = Some(Depth { tip_cm: z, stem_cm: Vec::new() });
            greedy.decide(&Observation { depth, ..Observation::simulated(Point::new(x, y)) })
        };
        assert_eq!(decide(0.0, 4.0, 0.0), Light::RIGHT);
        assert_eq!(decide(1.8, 5.0, 0.0), Light::FRONT);
        assert_eq!(decide(0.5, 9.0, 1.0), Light::BACK);
        assert_eq!(decide(3.0, 9.0, -2.5), Light::LEFT);
    }
}
