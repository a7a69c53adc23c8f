//! What a page draws, and the task that it is.

use serde::{Deserialize, Serialize};
use tropism::geometry::Point;
use tropism::obstacle::Obstacle;
use tropism::task::Task;

use crate::PageError;

/// Targets of a drawing, at most.
const MOST_TARGETS: usize = 8;

/// Points of a line that the stem is to follow, at most.
const MOST_POINTS: usize = 40;

/// How far off anything may be drawn, in cm.
const MOST_CM: f64 = 50.0;

/// How far above the last target the experiment ends, in cm. Paper: 0.3 (section 2.3.1).
const ABOVE_CM: f64 = 0.3;

/// What was drawn: targets with what stands in the way, or a form of the stem.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Drawing {
    /// In cm.
    #[serde(default)]
    pub targets: Vec<[f64; 2]>,
    /// What the stem must not touch.
    #[serde(default)]
    pub obstacles: Vec<Obstacle>,
    /// Points to steer by on the way, in cm.
    #[serde(default)]
    pub way_points: Vec<[f64; 2]>,
    /// The form that the stem is to have, in place of all else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<Form>,
}

/// A form of the stem: the line that it is to follow, or what is wanted of its bow. In cm.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Form {
    /// From the root upwards; empty for none.
    #[serde(default)]
    pub line: Vec<[f64; 2]>,
    /// Where the bow is farthest to the side.
    pub apex: Option<[f64; 2]>,
    /// Radius of the bow in cm, below 0 to the left.
    pub radius_cm: Option<f64>,
    /// Where the bow changes its side.
    pub inflection: Option<[f64; 2]>,
    /// Lean of the upper third to the vertical in degrees, below 0 to the left.
    pub lean_deg: Option<f64>,
    /// Difference from the form at which it is reached, in cm.
    pub within_cm: Option<f64>,
    /// Height of the tip at which the form counts; that of the highest point of the line by default.
    pub end_height_cm: Option<f64>,
}

impl Form {
    fn of(task: &Task) -> Self {
        Self {
            line: pairs(&task.line),
            apex: task.apex.map(Into::into),
            radius_cm: task.radius_cm,
            inflection: task.inflection.map(Into::into),
            lean_deg: task.lean_deg,
            within_cm: Some(task.within_cm),
            end_height_cm: Some(task.end_height_cm),
        }
    }

    fn task(&self) -> Result<Task, PageError> {
        let count = self.line.len();
        if count > MOST_POINTS {
            return Err(PageError::new(format!(
                "found a line of {count} points, wanted {MOST_POINTS} at most"
            )));
        }
        let plain = Task::shape();
        let line: Vec<Point> = self.line.iter().map(|&point| point.into()).collect();
        let [apex, inflection] = [self.apex, self.inflection].map(|point| point.map(Point::from));
        check_near(line.iter().copied().chain(apex).chain(inflection))?;
        let highest = line.iter().map(|point| point.y).reduce(f64::max);
        let task = Task {
            line,
            apex,
            radius_cm: self.radius_cm,
            inflection,
            lean_deg: self.lean_deg,
            within_cm: self.within_cm.unwrap_or(plain.within_cm),
            end_height_cm: self.end_height_cm.or(highest).unwrap_or(plain.end_height_cm),
            ..plain
        };
        task.check().map_err(|error| PageError::new(error.to_string()))?;
        Ok(task)
    }
}

fn pairs(points: &[Point]) -> Vec<[f64; 2]> {
    points.iter().map(|&point| point.into()).collect()
}

/// Refuses points that are too far off to be meant.
fn check_near(mut points: impl Iterator<Item = Point>) -> Result<(), PageError> {
    let is_far = |point: Point| !point.is_finite() || point.x.abs().max(point.y.abs()) > MOST_CM;
    if points.any(is_far) {
        return Err(PageError::new(format!("everything must lie within {MOST_CM} cm")));
    }
    Ok(())
}

impl Drawing {
    /// Targets alone, in cm.
    #[must_use]
    pub fn of_targets(targets: &[[f64; 2]]) -> Self {
        Self { targets: targets.to_vec(), ..Self::default() }
    }

    /// The drawing of a task.
    #[must_use]
    pub fn of(task: &Task) -> Self {
        Self {
            targets: pairs(&task.targets),
            obstacles: task.obstacles.clone(),
            way_points: pairs(&task.way_points),
            form: task.has_form().then(|| Form::of(task)),
        }
    }

    /// Reads the JSON of an address.
    ///
    /// # Errors
    /// [`PageError`] says what is no drawing.
    pub fn read(text: &str) -> Result<Self, PageError> {
        serde_json::from_str(text).map_err(|error| PageError::new(format!("drawing: {error}")))
    }

    /// Whether the task looks at the whole stem.
    #[must_use]
    pub fn has_stem(&self) -> bool {
        self.form.is_some() || !self.obstacles.is_empty() || !self.way_points.is_empty()
    }

    /// The best fitness that there can be, in cm. For a form: by how much an upright seedling differs from it.
    ///
    /// # Errors
    /// As [`Self::task`].
    pub fn best(&self) -> Result<Option<f64>, PageError> {
        Ok(self.task()?.best_fitness())
    }

    /// The task: targets and way points from the lowest to the highest.
    ///
    /// # Errors
    /// [`PageError`] names what is wrong.
    pub fn task(&self) -> Result<Task, PageError> {
        let Self { targets, obstacles, way_points, form } = self;
        if let Some(form) = form {
            if targets.is_empty() && obstacles.is_empty() && way_points.is_empty() {
                return form.task();
            }
            return Err(PageError::new("a drawing has either a form of the stem, or targets and obstacles"));
        }
        if targets.is_empty() || targets.len() > MOST_TARGETS {
            let count = targets.len();
            return Err(PageError::new(format!("found {count} targets, wanted 1 to {MOST_TARGETS}")));
        }
        for (what, count) in [("obstacles", obstacles.len()), ("way points", way_points.len())] {
            if count > MOST_TARGETS {
                return Err(PageError::new(format!("found {count} {what}, wanted {MOST_TARGETS} at most")));
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
        check_near(targets.iter().chain(&way_points).copied().chain(corners))?;
        let highest = targets[targets.len() - 1].y;
        let task = if self.has_stem() {
            let obstacles = obstacles.clone();
            Task { targets, obstacles, way_points, end_height_cm: highest, ..Task::obstacles() }
        } else {
            Task { targets, end_height_cm: round_to_mm(highest + ABOVE_CM), ..Task::default() }
        };
        task.check().map_err(|error| PageError::new(error.to_string()))?;
        Ok(task)
    }

    /// The text of the task file.
    ///
    /// # Errors
    /// As [`Self::task`].
    pub fn to_toml(&self) -> Result<String, PageError> {
        toml::to_string(&self.task()?).map_err(|error| PageError::new(error.to_string()))
    }
}

/// To the millimetre, in cm.
fn round_to_mm(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_sorted_and_checked() {
        let text = Drawing::of_targets(&[[-5.0, 9.0], [3.0, 6.0]]).to_toml().unwrap();
        let task: Task = toml::from_str(&text).unwrap();
        assert_eq!(task.targets, [Point::new(3.0, 6.0), Point::new(-5.0, 9.0)]);
        assert_eq!(task.end_height_cm, 9.3);
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
        assert_eq!(task.obstacles.len(), 3);
        assert_eq!(task.way(), [[-1.0, 7.0], [-3.0, 10.0], [0.0, 13.0]].map(Point::from));
        assert_eq!(toml::from_str::<Task>(&drawing.to_toml().unwrap()).unwrap(), task);
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
        let many = Drawing { obstacles: vec![task.obstacles[0]; 9], ..drawing };
        assert!(many.task().is_err());
    }

    #[test]
    fn a_form_of_the_stem_is_a_task_of_its_own() {
        let line = "[[0, 0], [0.5, 3], [2, 6], [2.5, 9]]";
        let read = |text: &str| Drawing::read(&format!("{{\"form\": {{{text}}}}}")).unwrap();
        let drawing = read(&format!("\"line\": {line}, \"lean_deg\": 10"));
        let task = drawing.task().unwrap();
        assert!(drawing.has_stem() && drawing.to_toml().unwrap().contains("kind = \"shape\""));
        assert!(task.has_form(), "{task:?}");
        assert_eq!((task.end_height_cm, task.lean_deg, task.apex), (9.0, Some(10.0), None));
        assert_eq!(toml::from_str::<Task>(&drawing.to_toml().unwrap()).unwrap(), task);
        // It comes back from its task.
        assert_eq!(Drawing::of(&task).task().unwrap(), task);
        // A seedling that is the line cannot come nearer to it.
        assert_eq!(read("\"line\": [[0, 0], [0, 4]]").best().unwrap(), Some(0.0));
        assert!(drawing.best().unwrap().is_some_and(|best| best > 1.0));
        // The tip of a bow without a line has to get somewhere, too.
        assert!(read("\"apex\": [2, 7], \"radius_cm\": 12, \"end_height_cm\": 14").task().is_ok());
        let many = "[0, 1], ".repeat(MOST_POINTS);
        for text in [
            "",
            "\"line\": [[0, 0]]",
            "\"line\": [[0, 0], [0, 500]]",
            "\"apex\": [200, 7]",
            "\"radius_cm\": 0",
            "\"lean_deg\": 100",
            "\"lean_deg\": 10, \"within_cm\": 0",
            "\"lean_deg\": 10, \"end_height_cm\": 3",
            &format!("\"line\": [{many} [0, 2]]"),
        ] {
            assert!(read(text).task().is_err(), "{text}");
        }
        let both = Drawing { targets: vec![[0.0, 6.0]], ..drawing };
        assert!(both.task().is_err());
    }
}
