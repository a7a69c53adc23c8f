//! Targets that are still to be drawn: how many, how high, and how long the experiment lasts.
//!
//! What draws them knows the plant: a sequence in its reach, another one for each seed. Here is what the draw must respect.

use super::{Past, Score, Targets, Task};
use crate::geometry::Point;
use crate::observation::Observation;

/// Targets that are drawn when an experiment begins, and again for each seed.
///
/// Before they are drawn nothing is reached, and the fitness of any track is 0.
#[derive(Clone, Copy, Debug)]
pub struct RandomTargets;

impl Task {
    /// As many targets to draw as the paper has, in the same heights.
    #[must_use]
    pub fn random_targets() -> Self {
        Self::default().to_draw().expect("the paper has targets")
    }

    /// Whether its targets are still to be drawn.
    #[must_use]
    pub const fn is_to_draw(&self) -> bool {
        self.count > 0
    }

    /// The task with as many targets to draw, and as high at most: itself if they are still to be drawn. `None` for other than
    /// targets in the plane with nothing in the way, and without targets.
    #[must_use]
    pub fn to_draw(&self) -> Option<Self> {
        if self.is_to_draw() {
            return Some(self.clone());
        }
        let highest_cm = self.targets.last().filter(|_| self.has_score::<Targets>())?.y;
        let Self { start, score, end_height_cm, max_steps, .. } = *self;
        let count = self.targets.len() as u32;
        Some(Self { start, count, highest_cm, score, end_height_cm, max_steps, ..Self::new(RandomTargets) })
    }

    /// The task with `targets` in ascending height. It ends as far above the last of them as above the highest that could be
    /// drawn.
    #[must_use]
    pub fn drawn(&self, targets: Vec<Point>) -> Self {
        let end_height_cm = self.end_above(targets.last().map(|target| target.y));
        let Self { start, score, max_steps, .. } = *self;
        Self { start, targets, score, end_height_cm, max_steps, ..Self::new(Targets) }
    }

    /// As many targets right above the start, as high at most: what stands for the task where each plant has its own.
    ///
    /// ```
    /// use tropism::task::Task;
    /// let task = Task { count: 2, highest_cm: 10.0, end_height_cm: 10.5, ..Task::random_targets() };
    /// let heights: Vec<f64> = task.straight_up().targets.iter().map(|target| target.y).collect();
    /// assert_eq!(heights, [7.0, 10.0]); // the start is at 4 cm
    /// ```
    #[must_use]
    pub fn straight_up(&self) -> Self {
        let band = (self.highest_cm - self.start.y) / f64::from(self.count);
        let below = (1..self.count).map(|number| self.start.y + band * f64::from(number));
        let heights = below.chain([self.highest_cm]);
        self.drawn(heights.map(|height| Point::new(self.start.x, height)).collect())
    }
}

impl Score for RandomTargets {
    /// 0: the targets are not drawn.
    fn step_fitness(&self, _task: &Task, _past: &Past, _after: &Observation) -> f64 {
        0.0
    }

    fn title(&self, task: &Task) -> String {
        let plural = if task.count == 1 { "" } else { "s" };
        format!("{} random target{plural} up to {} cm", task.count, task.highest_cm)
    }

    fn name(&self) -> &'static str {
        "random_targets"
    }

    fn keys(&self) -> &'static [&'static str] {
        &["start", "count", "highest_cm", "score", "end_height_cm", "max_steps"]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_has_the_same_way_to_go_on() {
        let task = Task::random_targets();
        let targets = vec![Point::new(1.0, 6.0), Point::new(-2.0, 11.5)];
        let drawn = task.drawn(targets.clone());
        assert_eq!((drawn.targets, drawn.end_height_cm), (targets, 11.5 + (13.8 - 13.5)));
        assert_eq!([Task::open_loop(5).to_draw(), Task::obstacles().to_draw()], [None, None]);
        assert_eq!(task.straight_up().to_draw(), Some(task));
    }
}
