//! Wind round a pole: the stem is to go round an upright axis as often as it can.
//!
//! The paper names plants that grow round objects as an aim (section 5). The turns of a stem about the pole are counted on the
//! stem in space, so that two cameras or a virtual plant are needed.

use serde::{Deserialize, Serialize};

use super::{Targets, Task};
use crate::check::{OutOfRange, ensure, within};
use crate::geometry::Point;
use crate::geometry::space::SpacePoint;
use crate::math::atan2;
use crate::observation::Observation;
use crate::obstacle::Pole;
use crate::track::Track;

/// A pole round which the stem is to wind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spiral {
    /// Tip of the seedling at the start of a simulated experiment, in cm, y above 0.
    pub start: Point,
    /// The pole: of finite height, with the root outside of it.
    pub pole: Pole,
    /// Turns, in either direction, with which the task is done, 0.05 to 100.
    pub turns: f64,
    /// Height of the tip at which the experiment ends, in cm; that of the start or more.
    pub end_height_cm: f64,
    /// Steps after which the experiment ends although the tip is lower, 1 to 1000000.
    pub max_steps: u32,
}

impl Default for Spiral {
    /// A pole of 2 cm right beside the plant, and one turn.
    fn default() -> Self {
        Self {
            start: Targets::default().start,
            pole: Pole { at: [1.3, 0.0], radius_cm: 1.0, height_cm: 40.0 },
            turns: 1.0,
            end_height_cm: 30.0,
            max_steps: 1000,
        }
    }
}

impl Spiral {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { start, end_height_cm, max_steps, .. } = *self;
        Targets { start, targets: Vec::new(), end_height_cm, max_steps }.check()?;
        self.pole.check().map_err(|error| error.in_table("pole"))?;
        ensure(
            self.pole.height_cm.is_finite(),
            "pole.height_cm",
            self.pole.height_cm,
            "a finite height in cm",
        )?;
        within("turns", self.turns, 0.05..=100.0)?;
        let is_beside = self.pole.distance([0.0; 3]) > 0.0;
        ensure(is_beside, "pole.at", format!("{:?}", self.pole.at), "a place that is not on the root")
    }

    /// Turns of a stem (cm, from the base up) round the pole's axis: above 0 counter-clockwise, seen from above. Between two
    /// points of the stem less than half a turn is taken for granted.
    ///
    /// ```
    /// use tropism::task::Spiral;
    /// let task = Spiral::default(); // the axis of the pole is at x = 1.3, z = 0
    /// let stem = [[0.0, 0.0, 0.0], [1.3, 5.0, 1.3], [2.6, 10.0, 0.0]]; // from the left, in front, to the right
    /// assert!((task.turns_of(&stem) - 0.5).abs() < 1e-12);
    /// ```
    #[must_use]
    pub fn turns_of(&self, stem: &[SpacePoint]) -> f64 {
        let [x, z] = self.pole.at;
        // Seen from above, x points right and z down.
        let angles = stem.iter().map(|point| atan2(z - point[2], point[0] - x));
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
    fn turns_seen(&self, seen: &Observation) -> f64 {
        seen.stem_in_space().map_or(0.0, |stem| self.turns_of(&stem).abs())
    }
}

impl Task for Spiral {
    fn is_over(&self, step: u32, seen: &Observation) -> bool {
        seen.tip.y >= self.end_height_cm || step >= self.max_steps
    }

    /// Turns that the step adds. Over an experiment: the turns of the grown stem less those of the seedling.
    fn step_fitness(&self, _first: &Observation, before: &Observation, after: &Observation) -> f64 {
        self.turns_seen(after) - self.turns_seen(before)
    }

    fn start(&self) -> Point {
        self.start
    }

    fn has_goal(&self) -> bool {
        true
    }

    fn pole(&self) -> Option<Pole> {
        Some(self.pole)
    }

    /// `None` for a track without stems in space.
    fn is_done(&self, track: &Track) -> Option<bool> {
        let mut latest = track.samples.iter().rev();
        let last = latest.find_map(|sample| sample.observation().stem_in_space())?;
        Some(self.turns_of(&last).abs() >= self.turns)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math::{cos, sin};

    fn helix(task: &Spiral, turns: f64, radius: f64) -> Vec<SpacePoint> {
        let [x, z] = task.pole.at;
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
        let task = Spiral::default();
        task.check().unwrap();
        let upright: Vec<SpacePoint> = (0..10).map(|i| [0.0, f64::from(i), 0.0]).collect();
        assert_eq!(task.turns_of(&upright), 0.0);
    }

    #[test]
    fn a_pole_on_the_root_is_refused() {
        let mut task = Spiral::default();
        task.pole.at = [0.5, 0.0];
        assert!(task.check().unwrap_err().to_string().contains("pole.at"));
    }

    proptest! {
        #[test]
        fn turns_are_counted_in_both_directions(turns in -3.0..3.0, radius in 1.1..4.0) {
            let task = Spiral::default();
            prop_assert!((task.turns_of(&helix(&task, turns, radius)) - turns).abs() < 1e-9);
        }
    }
}
