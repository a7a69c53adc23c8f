//! Wind round a pole: the stem is to go round an upright axis as often as it can.
//!
//! The paper names plants that grow round objects as an aim (section 5). The turns of a stem about the pole are counted on the
//! stem in space, so that two cameras or a virtual plant are needed.

use super::{Past, Score, Task};
use crate::check::{OutOfRange, ensure};
use crate::geometry::space::SpacePoint;
use crate::math::atan2;
use crate::math::vector::{dot, sub};
use crate::observation::Observation;
use crate::obstacle::{Bar, Pole};
use crate::track::Track;

/// A pole round which the stem is to wind.
#[derive(Clone, Copy, Debug)]
pub struct Spiral;

impl Task {
    /// A pole of 2 cm right beside the plant, and one turn.
    #[must_use]
    pub fn spiral() -> Self {
        let pole = Pole { at: [1.3, 0.0], radius_cm: 1.0, height_cm: 40.0 };
        Self { pole: Some(pole), end_height_cm: 30.0, ..Self::new(Spiral) }
    }
}

impl Pole {
    /// Turns of a stem (cm, from the base up) round the pole's axis: above 0 counter-clockwise, seen from above. Between two
    /// points of the stem less than half a turn is taken for granted.
    ///
    /// ```
    /// use tropism::obstacle::Pole;
    /// let pole = Pole { at: [1.3, 0.0], radius_cm: 1.0, height_cm: 40.0 };
    /// let stem = [[0.0, 0.0, 0.0], [1.3, 5.0, 1.3], [2.6, 10.0, 0.0]]; // from the left, in front, to the right
    /// assert!((pole.turns_of(&stem) - 0.5).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn turns_of(&self, stem: &[SpacePoint]) -> f64 {
        let [x, z] = self.at;
        // Seen from above, x points right and z down.
        turns_by(stem.iter().map(|point| atan2(z - point[2], point[0] - x)))
    }
}

impl Bar {
    /// Turns of a stem (cm, from the base up) round the bar's axis: above 0 counter-clockwise, seen from its second end. Between
    /// two points of the stem less than half a turn is taken for granted.
    ///
    /// ```
    /// use tropism::obstacle::Bar;
    /// let bar = Bar { ends: [[1.3, 0.0, 0.0], [1.3, 40.0, 0.0]], radius_cm: 1.0 };
    /// let stem = [[0.0, 0.0, 0.0], [1.3, 5.0, 1.3], [2.6, 10.0, 0.0]]; // from the left, in front, to the right
    /// assert!((bar.turns_of(&stem) - 0.5).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn turns_of(&self, stem: &[SpacePoint]) -> f64 {
        let across = self.across();
        turns_by(stem.iter().map(|point| {
            let [first, second] = across.map(|direction| dot(sub(*point, self.ends[0]), direction));
            atan2(second, first)
        }))
    }
}

/// Turns from angle to angle, in rad, each less than half a turn.
fn turns_by(angles: impl Iterator<Item = f64>) -> f64 {
    let mut turned = 0.0;
    let mut last = None;
    for angle in angles {
        let change: f64 = angle - last.unwrap_or(angle);
        turned += change - core::f64::consts::TAU * (change / core::f64::consts::TAU).round();
        last = Some(angle);
    }
    turned / core::f64::consts::TAU
}

/// Turns in either direction of what is seen; 0 where no stem is seen in space.
fn turns_seen(task: &Task, seen: &Observation) -> f64 {
    let (pole, stem) = (task.pole, seen.stem_in_space());
    pole.zip(stem).map_or(0.0, |(pole, stem)| pole.turns_of(&stem).abs())
}

impl Score for Spiral {
    /// Turns that the step adds. Over an experiment: the turns of the grown stem less those of the seedling.
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        turns_seen(task, after) - turns_seen(task, &past.latest)
    }

    /// `None` for a track without stems in space.
    fn is_done(&self, task: &Task, track: &Track) -> Option<bool> {
        let mut latest = track.samples.iter().rev();
        let last = latest.find_map(|sample| sample.observation().stem_in_space())?;
        Some(task.pole?.turns_of(&last).abs() >= task.turns)
    }

    fn unit(&self) -> &'static str {
        "turns"
    }

    fn title(&self, task: &Task) -> String {
        let thickness_cm = task.pole.map_or(0.0, |pole| 2.0 * pole.radius_cm);
        format!("winding round a pole of {thickness_cm} cm")
    }

    fn name(&self) -> &'static str {
        "spiral"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["start", "pole", "turns", "end_height_cm", "max_steps"]
    }

    fn check(&self, task: &Task) -> Result<(), OutOfRange> {
        ensure(task.pole.is_some(), "pole", "none", "a pole")
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::{Point, Polyline};
    use crate::lamps::Light;
    use crate::math::{cos, sin};
    use crate::observation::Depth;
    use crate::track::Sample;

    fn pole() -> Pole {
        Task::spiral().pole.expect("a pole")
    }

    fn helix(turns: f64, radius: f64) -> Vec<SpacePoint> {
        let [x, z] = pole().at;
        (0..10)
            .map(|i| f64::from(i) / 9.0)
            .map(|share| {
                let angle = core::f64::consts::PI + turns * core::f64::consts::TAU * share;
                [x + radius * cos(angle), 20.0 * share, z - radius * sin(angle)]
            })
            .collect()
    }

    #[test]
    fn a_stem_beside_the_pole_has_no_turn() {
        let upright: Vec<SpacePoint> = (0..10).map(|i| [0.0, f64::from(i), 0.0]).collect();
        assert_eq!(pole().turns_of(&upright), 0.0);
    }

    #[test]
    fn a_stem_that_is_not_seen_at_the_end_stays_wound() {
        let seen = |turns: f64| {
            let stem = helix(turns, 1.5);
            let plane = Polyline(stem.iter().map(|point| Point::new(point[0], point[1])).collect());
            let depth = Depth { tip_cm: stem[9][2], stem_cm: stem.iter().map(|point| point[2]).collect() };
            Observation {
                stem: Some(plane),
                depth: Some(depth),
                ..Observation::simulated(Point::new(0.0, 5.0))
            }
        };
        let depth = Some(Depth { tip_cm: 0.0, stem_cm: Vec::new() });
        let hidden = Observation { depth, ..Observation::simulated(Point::new(0.0, 6.0)) };
        let samples = (0..).zip([seen(0.1), seen(0.8), hidden]);
        let samples =
            samples.map(|(step, seen)| Sample::of(seen, step, 300.0 * f64::from(step), Light::LEFT));
        let fitness = Task::spiral().fitness(&Track::of(samples.collect()));
        assert!((fitness - 0.7).abs() < 1e-9, "{fitness}");
    }

    proptest! {
        #[test]
        fn turns_are_counted_in_both_directions(turns in -3.0..3.0, radius in 1.1..4.0) {
            prop_assert!((pole().turns_of(&helix(turns, radius)) - turns).abs() < 1e-9);
        }
    }
}
