//! The paper's task: the tip visits targets, scored by eq. (9) (section 2.3.1).

use serde::{Deserialize, Serialize};

use super::Task;
use crate::check::{OutOfRange, ensure, within};
use crate::geometry::Point;
use crate::observation::Observation;

/// Targets that the tip is to visit, from the lowest to the highest (section 2.3.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Targets {
    /// Tip of the seedling at the start of a simulated experiment, in cm, y above 0. Paper: (0, 4).
    pub start: Point,
    /// Targets in ascending height above the start, in cm. Paper: (3, 6), (-5, 9), (-1, 13.5).
    pub targets: Vec<Point>,
    /// Height of the tip at which the experiment ends, in cm; that of the highest target or more. Paper: 13.8.
    pub end_height_cm: f64,
    /// Steps after which the experiment ends although the tip is lower, 1 to 1000000. The paper names no limit; its longest
    /// experiment is 1000 steps.
    pub max_steps: u32,
}

impl Default for Targets {
    fn default() -> Self {
        Self {
            start: Point::new(0.0, 4.0),
            targets: vec![Point::new(3.0, 6.0), Point::new(-5.0, 9.0), Point::new(-1.0, 13.5)],
            end_height_cm: 13.8,
            max_steps: 1000,
        }
    }
}

/// Where the tip was when it first reached a target's height.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Crossing {
    /// Step of the observation.
    pub step: u32,
    /// Distance between tip and target, in cm.
    pub distance_cm: f64,
}

impl Targets {
    /// No targets: grow for `steps` steps whatever the height, as in the open-loop experiments (section 2.2.1).
    #[must_use]
    pub fn open_loop(steps: u32) -> Self {
        Self { targets: Vec::new(), end_height_cm: f64::INFINITY, max_steps: steps, ..Self::default() }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let shown = |point: Point| format!("{:?}", <[f64; 2]>::from(point));
        let is_above_soil = self.start.is_finite() && self.start.y > 0.0;
        ensure(is_above_soil, "start", shown(self.start), "[x, y] in cm with y above 0")?;
        for (index, target) in self.targets.iter().enumerate() {
            let below = index.checked_sub(1).map_or(self.start.y, |below| self.targets[below].y);
            let is_higher = target.is_finite() && target.y > below;
            let wanted = "a target higher than the one before it";
            ensure(is_higher, format!("targets[{index}]"), shown(*target), wanted)?;
        }
        let highest = self.targets.last().map_or(self.start.y, |target| target.y);
        let is_high = self.end_height_cm >= highest;
        ensure(is_high, "end_height_cm", self.end_height_cm, "at least the highest target")?;
        within("max_steps", self.max_steps, 1..=1_000_000)
    }

    /// The way in x that the tip needs to visit all targets, in cm (section 2.3.2): 15 for the paper's task.
    ///
    /// ```
    /// use tropism::task::{Targets, Task};
    /// use tropism::track::Track;
    /// let straight = "tip_x_cm,tip_y_cm,light\n0,4,right\n3,5.9,left\n-5,8.9,right\n-1,13.4,dark\n";
    /// let track = Track::read_csv(straight.as_bytes())?;
    /// assert_eq!(Targets::default().fitness(&track), 15.0);
    /// assert_eq!(Targets::default().best(), 15.0);
    /// # Ok::<(), tropism::track::TrackError>(())
    /// ```
    #[must_use]
    pub fn best(&self) -> f64 {
        let stops = core::iter::once(self.start.x).chain(self.targets.iter().map(|target| target.x));
        let stops: Vec<f64> = stops.collect();
        // Not `sum`: that of nothing is -0.
        stops.windows(2).fold(0.0, |sum, pair| sum + (pair[1] - pair[0]).abs())
    }
}

impl Task for Targets {
    fn is_over(&self, step: u32, seen: &Observation) -> bool {
        seen.tip.y >= self.end_height_cm || step >= self.max_steps
    }

    /// The discrete fitness f of one step, in cm, eq. (9): movement towards the next target counts, movement away from it
    /// counts against. Steps below the first tip, whose height is y*_0, do not count.
    fn step_fitness(&self, first: &Observation, before: &Observation, after: &Observation) -> f64 {
        let (before, after) = (before.tip, after.tip);
        if after.y < first.tip.y {
            return 0.0;
        }
        let Some(target) = self.targets.iter().find(|target| after.y < target.y) else { return 0.0 };
        let shift = after.x - before.x;
        if after.x < target.x {
            shift
        } else if after.x > target.x {
            -shift
        } else {
            shift.abs()
        }
    }

    fn start(&self) -> Point {
        self.start
    }

    fn targets(&self) -> Vec<Point> {
        self.targets.clone()
    }

    fn best_fitness(&self) -> Option<f64> {
        Some(self.best())
    }

    fn as_targets(&self) -> Option<&Targets> {
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Light;
    use crate::observation::Quality;
    use crate::track::{Sample, Track};
    use proptest::prelude::*;

    fn track(tips: &[(f64, f64)]) -> Track {
        let samples = tips.iter().enumerate().map(|(step, &(x, y))| Sample {
            stem: None,
            depth: None,
            step: step as u32,
            time_s: 0.0,
            tip: Point::new(x, y),
            light: Some(Light::LEFT),
            quality: Quality::Simulated,
        });
        Track::of(samples.collect())
    }

    #[test]
    fn crossing_a_target_costs_the_whole_step() {
        let task = Targets::default();
        // From 2.9 over the target at 3 to 3.1: eq. (9) asks where the tip is after the step.
        assert!((task.fitness(&track(&[(2.9, 5.0), (3.1, 5.1)])) + 0.2).abs() < 1e-12);
        // A step that ends exactly on the target counts, whichever way it came.
        assert!((task.fitness(&track(&[(3.2, 5.0), (3.0, 5.1)])) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn steps_below_the_start_and_above_the_last_target_do_not_count() {
        let task = Targets::default();
        assert_eq!(task.fitness(&track(&[(0.0, 4.0), (1.0, 3.9)])), 0.0);
        assert_eq!(task.fitness(&track(&[(0.0, 13.5), (1.0, 13.6)])), 0.0);
        assert_eq!(task.fitness(&track(&[(0.0, 5.9), (1.0, 6.0)])), -1.0);
    }

    #[test]
    fn crossings_tell_step_and_distance() {
        let crossings = Targets::default().crossings(&track(&[(0.0, 4.0), (3.0, 6.0), (0.0, 9.0)]));
        assert_eq!(crossings[0], Some(Crossing { step: 1, distance_cm: 0.0 }));
        assert_eq!(crossings[1], Some(Crossing { step: 2, distance_cm: 5.0 }));
        assert_eq!(crossings[2], None);
    }

    #[test]
    fn a_file_with_mistakes_is_refused() {
        Targets::default().check().unwrap();
        Targets::open_loop(1000).check().unwrap();
        let swapped =
            Targets { targets: vec![Point::new(1.0, 9.0), Point::new(1.0, 6.0)], ..Targets::default() };
        assert!(swapped.check().unwrap_err().to_string().contains("targets[1] = [1.0, 6.0]"));
        let low = Targets { end_height_cm: 10.0, ..Targets::default() };
        assert!(low.check().unwrap_err().to_string().contains("end_height_cm"));
        let buried = Targets { start: Point::new(0.0, -1.0), ..Targets::default() };
        assert!(buried.check().is_err());
    }

    proptest! {
        #[test]
        fn a_mirrored_track_has_the_fitness_of_the_mirrored_task(
            tips in prop::collection::vec((-10.0..10.0, 3.0..15.0), 2..40),
        ) {
            let task = Targets::default();
            let image = Targets {
                targets: task.targets.iter().map(|target| target.mirrored()).collect(),
                ..Targets::default()
            };
            let track = track(&tips);
            prop_assert_eq!(task.fitness(&track), image.fitness(&track.mirrored().unwrap()));
        }

        #[test]
        fn no_rising_track_beats_the_best(xs in prop::collection::vec(-10.0..10.0, 30)) {
            // Rising from the start, as a growing plant does: each height is passed once.
            let tips: Vec<(f64, f64)> = std::iter::once((0.0, 4.0))
                .chain(xs.iter().enumerate().map(|(step, &x)| (x, 4.3 + 0.3 * step as f64)))
                .collect();
            prop_assert!(Targets::default().fitness(&track(&tips)) <= Targets::default().best() + 1e-9);
        }
    }
}
