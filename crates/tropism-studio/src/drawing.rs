//! What a page draws, and the task that it is.

use serde::{Deserialize, Serialize};
use tropism::geometry::Point;
use tropism::obstacle::Obstacle;
use tropism::task::{Obstacles, Targets, Task, TaskSpec};

use crate::error::Refusal;

/// Targets of a drawing, at most.
const MOST_TARGETS: usize = 8;

/// How far off anything may be drawn, in cm.
const MOST_CM: f64 = 50.0;

/// How far above the last target the experiment ends, in cm. Paper: 0.3 (section 2.3.1).
const ABOVE_CM: f64 = 0.3;

/// What was drawn. Shapes and whatever else a task wants have their place beside the targets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Drawing {
    /// In cm.
    pub(crate) targets: Vec<[f64; 2]>,
    /// What the stem must not touch.
    #[serde(default)]
    pub(crate) obstacles: Vec<Obstacle>,
    /// Points to steer by on the way, in cm.
    #[serde(default)]
    pub(crate) way_points: Vec<[f64; 2]>,
}

impl Drawing {
    /// Targets alone.
    pub(crate) fn of_targets(targets: &[[f64; 2]]) -> Self {
        Self { targets: targets.to_vec(), ..Self::default() }
    }

    /// The drawing of a task.
    pub(crate) fn of(task: &TaskSpec) -> Self {
        let pairs = |points: &[Point]| points.iter().map(|&point| point.into()).collect();
        let way_points = match task {
            TaskSpec::Obstacles(task) => pairs(&task.way_points),
            _ => Vec::new(),
        };
        Self { targets: pairs(&task.targets()), obstacles: task.obstacles().to_vec(), way_points }
    }

    /// Reads the JSON of an address.
    pub(crate) fn read(text: &str) -> Result<Self, Refusal> {
        serde_json::from_str(text).map_err(|error| Refusal::bad(format!("drawing: {error}")))
    }

    /// Whether the task looks at the whole stem.
    pub(crate) fn has_stem(&self) -> bool {
        !self.obstacles.is_empty() || !self.way_points.is_empty()
    }

    /// The task: targets and way points from the lowest to the highest.
    ///
    /// # Errors
    /// [`Refusal`] names what is wrong.
    pub(crate) fn task(&self) -> Result<TaskSpec, Refusal> {
        let Self { targets, obstacles, way_points } = self;
        if targets.is_empty() || targets.len() > MOST_TARGETS {
            let count = targets.len();
            return Err(Refusal::bad(format!("found {count} targets, wanted 1 to {MOST_TARGETS}")));
        }
        for (what, count) in [("obstacles", obstacles.len()), ("way points", way_points.len())] {
            if count > MOST_TARGETS {
                return Err(Refusal::bad(format!("found {count} {what}, wanted {MOST_TARGETS} at most")));
            }
        }
        let sorted = |points: &[[f64; 2]]| {
            let mut points: Vec<Point> = points.iter().map(|&point| Point::from(point)).collect();
            points.sort_by(|one, other| one.y.total_cmp(&other.y));
            points
        };
        let (targets, way_points) = (sorted(targets), sorted(way_points));
        let corners = obstacles.iter().flat_map(|obstacle| match *obstacle {
            Obstacle::Disc { centre, radius_cm } => [centre, Point::new(radius_cm, 0.0)],
            Obstacle::Box { corners: points } | Obstacle::Line { ends: points } => points,
        });
        let is_far = |point: Point| !point.is_finite() || point.x.abs().max(point.y.abs()) > MOST_CM;
        if targets.iter().chain(&way_points).copied().chain(corners).any(is_far) {
            return Err(Refusal::bad(format!("found something beyond {MOST_CM} cm, wanted it nearer")));
        }
        let highest = targets[targets.len() - 1].y;
        let task = if self.has_stem() {
            let obstacles = obstacles.clone();
            TaskSpec::from(Obstacles {
                targets,
                obstacles,
                way_points,
                end_height_cm: highest,
                ..Obstacles::default()
            })
        } else {
            TaskSpec::from(Targets {
                targets,
                end_height_cm: round_to_mm(highest + ABOVE_CM),
                ..Targets::default()
            })
        };
        task.check().map_err(|error| Refusal::bad(error.to_string()))?;
        Ok(task)
    }

    /// The text of the task file.
    ///
    /// # Errors
    /// As [`Self::task`].
    pub(crate) fn to_toml(&self) -> Result<String, Refusal> {
        toml::to_string(&self.task()?).map_err(|error| Refusal::bad(error.to_string()))
    }
}

/// To the millimetre, in cm.
pub(crate) fn round_to_mm(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_sorted_and_checked() {
        let text = Drawing::of_targets(&[[-5.0, 9.0], [3.0, 6.0]]).to_toml().unwrap();
        let task: TaskSpec = toml::from_str(&text).unwrap();
        assert_eq!(task.targets(), [Point::new(3.0, 6.0), Point::new(-5.0, 9.0)]);
        assert_eq!(task.as_targets().unwrap().end_height_cm, 9.3);
        for targets in [
            &[][..],
            &[[f64::NAN, 6.0]],
            &[[0.0, 2.0]],
            &[[0.0, 1e9]],
            &[[1.0, 6.0], [2.0, 6.0]],
            &[[0.0, 5.0]; 9],
        ] {
            assert!(Drawing::of_targets(targets).task().is_err(), "{targets:?}");
        }
    }

    #[test]
    fn obstacles_and_way_points_make_a_task_of_their_own() {
        let text = r#"{"targets": [[0, 13]], "way_points": [[-3, 10], [-1, 7]],
            "obstacles": [{"disc": [0, 8], "radius_cm": 1}, {"box": [[2, 5], [4, 6]]}, {"line": [[-8, 4], [-5, 4]]}]}"#;
        let drawing = Drawing::read(text).unwrap();
        let task = drawing.task().unwrap();
        assert_eq!(task.obstacles().len(), 3);
        assert_eq!(task.way(), [[-1.0, 7.0], [-3.0, 10.0], [0.0, 13.0]].map(Point::from));
        assert_eq!(toml::from_str::<TaskSpec>(&drawing.to_toml().unwrap()).unwrap(), task);
        assert!(drawing.has_stem());
        // It comes back from a task with its way points in order.
        assert_eq!(Drawing::of(&task).task().unwrap(), task);
        for (from, to) in [
            ("\"radius_cm\": 1", "\"radius_cm\": 0"),
            ("[2, 5]", "[2, 500]"),
            ("\"radius_cm\": 1", "\"radius_cm\": 1e9"),
            ("[-1, 7]", "[-1, 10]"),
            ("[[0, 13]]", "[]"),
        ] {
            assert!(Drawing::read(&text.replace(from, to)).unwrap().task().is_err(), "{to}");
        }
        assert!(Drawing::read(&text.replace("disc", "star")).is_err());
        let many = Drawing { obstacles: vec![task.obstacles()[0]; 9], ..drawing };
        assert!(many.task().is_err());
    }
}
