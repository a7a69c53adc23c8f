//! Targets that are still to be drawn: how many, how high, and how long the experiment lasts.
//!
//! What draws them knows the plant: a sequence in its reach, another one for each seed. Here is what the draw must respect.

use serde::{Deserialize, Serialize};

use super::{Targets, Task};
use crate::check::{OutOfRange, ensure, within};
use crate::geometry::Point;
use crate::observation::Observation;

/// Targets that are drawn when an experiment begins, and again for each seed.
///
/// Before they are drawn nothing is reached, and the fitness of any track is 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomTargets {
    /// Tip of the seedling at the start of a simulated experiment, in cm, y above 0.
    pub start: Point,
    /// Number of targets, 1 to 100.
    pub count: u32,
    /// Height that no target is above, in cm; itself above the start.
    pub highest_cm: f64,
    /// Height of the tip at which the experiment ends if the last target is as high as can be, in cm. It ends as far above the
    /// last target that is drawn.
    pub end_height_cm: f64,
    /// Steps after which the experiment ends although the tip is lower, 1 to 1000000.
    pub max_steps: u32,
}

impl Default for RandomTargets {
    /// As many targets as the paper has, in the same heights.
    fn default() -> Self {
        Self::like(&Targets::default()).expect("the paper has targets")
    }
}

impl RandomTargets {
    /// As many targets as `task` has, and as high at most; `None` if it has none.
    #[must_use]
    pub fn like(task: &Targets) -> Option<Self> {
        let Targets { start, ref targets, end_height_cm, max_steps } = *task;
        let highest_cm = targets.last()?.y;
        Some(Self { start, count: targets.len() as u32, highest_cm, end_height_cm, max_steps })
    }

    /// The task with `targets` in ascending height, which ends as far above the last of them as is wanted.
    #[must_use]
    pub fn drawn(&self, targets: Vec<Point>) -> Targets {
        let last = targets.last().map_or(self.highest_cm, |target| target.y);
        let end_height_cm = last + (self.end_height_cm - self.highest_cm);
        Targets { start: self.start, targets, end_height_cm, max_steps: self.max_steps }
    }

    /// As many targets right above the start, as high at most: what stands for the task where each plant has its own.
    ///
    /// ```
    /// use tropism::task::RandomTargets;
    /// let heights = |task: &RandomTargets| task.straight_up().targets.iter().map(|target| target.y).collect::<Vec<_>>();
    /// let task = RandomTargets { count: 2, highest_cm: 10.0, end_height_cm: 10.5, ..RandomTargets::default() };
    /// assert_eq!(heights(&task), [7.0, 10.0]); // the start is at 4 cm
    /// ```
    #[must_use]
    pub fn straight_up(&self) -> Targets {
        let band = (self.highest_cm - self.start.y) / f64::from(self.count);
        let below = (1..self.count).map(|number| self.start.y + band * f64::from(number));
        let heights = below.chain([self.highest_cm]);
        let targets = heights.map(|height| Point::new(self.start.x, height)).collect();
        Targets { start: self.start, targets, end_height_cm: self.end_height_cm, max_steps: self.max_steps }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { start, count, highest_cm, end_height_cm, max_steps } = *self;
        within("count", count, 1..=100)?;
        let is_high = highest_cm.is_finite() && highest_cm > start.y;
        ensure(is_high, "highest_cm", highest_cm, "a height in cm above the start")?;
        ensure(end_height_cm >= highest_cm, "end_height_cm", end_height_cm, "at least highest_cm")?;
        Targets { start, targets: Vec::new(), end_height_cm, max_steps }.check()
    }
}

impl Task for RandomTargets {
    fn is_over(&self, step: u32, seen: &Observation) -> bool {
        seen.tip.y >= self.end_height_cm || step >= self.max_steps
    }

    /// 0: the targets are not drawn.
    fn step_fitness(&self, _first: &Observation, _before: &Observation, _after: &Observation) -> f64 {
        0.0
    }

    fn start(&self) -> Point {
        self.start
    }

    fn has_goal(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_has_the_same_way_to_go_on() {
        let task = RandomTargets::default();
        task.check().unwrap();
        let targets = vec![Point::new(1.0, 6.0), Point::new(-2.0, 11.5)];
        let drawn = task.drawn(targets.clone());
        assert_eq!((drawn.targets, drawn.end_height_cm), (targets, 11.5 + (13.8 - 13.5)));
        assert_eq!(RandomTargets::like(&Targets::open_loop(5)), None);
        assert_eq!(RandomTargets::like(&task.straight_up()), Some(task));
    }

    #[test]
    fn mistakes_are_named() {
        let refused = |task: RandomTargets, words: &str| {
            let error = task.check().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        };
        refused(RandomTargets { count: 0, ..RandomTargets::default() }, "count = 0");
        refused(RandomTargets { highest_cm: 3.0, ..RandomTargets::default() }, "highest_cm = 3");
        refused(RandomTargets { end_height_cm: 9.0, ..RandomTargets::default() }, "end_height_cm = 9");
    }
}
