//! Tasks as data: what stands in a task file, a run folder or a champion.

use serde::{Deserialize, Deserializer, Serialize};

use super::{Obstacles, OpenLoop, Targets, Task};
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::observation::Observation;
use crate::obstacle::Obstacle;
use crate::track::Track;

/// Any task of this library, as it stands in files.
///
/// A file without `kind` is a [`Targets`] task.
///
/// ```
/// use tropism::task::{OpenLoop, Targets, Task, TaskSpec};
/// let paper: TaskSpec = serde_json::from_str("{}")?;
/// assert_eq!(paper, TaskSpec::Targets(Targets::default()));
/// let open: TaskSpec = serde_json::from_str(r#"{"kind": "open_loop", "max_steps": 50}"#)?;
/// assert_eq!(open, TaskSpec::OpenLoop(OpenLoop { steps: 50, ..OpenLoop::default() }));
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys", into = "Keys")]
pub enum TaskSpec {
    /// Visit targets, eq. (9).
    Targets(Targets),
    /// Visit targets, and touch no obstacle with the stem.
    Obstacles(Obstacles),
    /// Grow for a number of steps.
    OpenLoop(OpenLoop),
}

/// The word for the kind of a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    #[default]
    Targets,
    Obstacles,
    OpenLoop,
}

impl Kind {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Self::Targets
    }
}

/// The keys of all kinds: one flat table, so that errors in a file keep their line.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default, skip_serializing_if = "Kind::is_default")]
    kind: Kind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    targets: Option<Vec<Point>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    obstacles: Option<Vec<Obstacle>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    way_points: Option<Vec<Point>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reach_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stem_radius_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "height")]
    end_height_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_steps: Option<u32>,
}

/// A height, which may be infinite: `inf` in TOML, and `null` in JSON, which has no infinity.
fn height<'de, D: Deserializer<'de>>(value: D) -> Result<Option<f64>, D::Error> {
    Ok(Some(Option::deserialize(value)?.unwrap_or(f64::INFINITY)))
}

impl Keys {
    /// Refuses the keys of obstacles in a task of another kind.
    fn without_obstacles(&self) -> Result<(), OutOfRange> {
        let found = [
            ("obstacles", self.obstacles.is_some()),
            ("way_points", self.way_points.is_some()),
            ("reach_cm", self.reach_cm.is_some()),
            ("stem_radius_cm", self.stem_radius_cm.is_some()),
        ];
        found.into_iter().try_for_each(|(key, is_there)| {
            ensure(!is_there, key, "a value", "this key only beside kind = \"obstacles\"")
        })
    }
}

impl TryFrom<Keys> for TaskSpec {
    type Error = OutOfRange;

    fn try_from(keys: Keys) -> Result<Self, OutOfRange> {
        match keys.kind {
            Kind::Obstacles => {
                let usual = Obstacles::default();
                let targets = keys.targets.unwrap_or(usual.targets);
                let highest = targets.last().map_or(usual.end_height_cm, |target| target.y);
                Ok(Self::Obstacles(Obstacles {
                    start: keys.start.unwrap_or(usual.start),
                    obstacles: keys.obstacles.unwrap_or(usual.obstacles),
                    way_points: keys.way_points.unwrap_or(usual.way_points),
                    reach_cm: keys.reach_cm.unwrap_or(usual.reach_cm),
                    stem_radius_cm: keys.stem_radius_cm.unwrap_or(usual.stem_radius_cm),
                    end_height_cm: keys.end_height_cm.unwrap_or(highest),
                    max_steps: keys.max_steps.unwrap_or(usual.max_steps),
                    targets,
                }))
            }
            Kind::Targets => {
                keys.without_obstacles()?;
                let paper = Targets::default();
                Ok(Self::Targets(Targets {
                    start: keys.start.unwrap_or(paper.start),
                    targets: keys.targets.unwrap_or(paper.targets),
                    end_height_cm: keys.end_height_cm.unwrap_or(paper.end_height_cm),
                    max_steps: keys.max_steps.unwrap_or(paper.max_steps),
                }))
            }
            Kind::OpenLoop => {
                keys.without_obstacles()?;
                let wanted = "only start and max_steps beside kind = \"open_loop\"";
                if let Some(targets) = keys.targets {
                    return Err(OutOfRange::new("targets", format!("{targets:?}"), wanted));
                }
                if let Some(height) = keys.end_height_cm {
                    return Err(OutOfRange::new("end_height_cm", height.to_string(), wanted));
                }
                let paper = OpenLoop::default();
                let (start, steps) =
                    (keys.start.unwrap_or(paper.start), keys.max_steps.unwrap_or(paper.steps));
                Ok(Self::OpenLoop(OpenLoop { start, steps }))
            }
        }
    }
}

impl From<TaskSpec> for Keys {
    fn from(spec: TaskSpec) -> Self {
        match spec {
            TaskSpec::Targets(task) => Self {
                kind: Kind::Targets,
                start: Some(task.start),
                targets: Some(task.targets),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
                ..Self::default()
            },
            TaskSpec::Obstacles(task) => Self {
                kind: Kind::Obstacles,
                start: Some(task.start),
                targets: Some(task.targets),
                obstacles: Some(task.obstacles),
                way_points: Some(task.way_points),
                reach_cm: Some(task.reach_cm),
                stem_radius_cm: Some(task.stem_radius_cm),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
            },
            TaskSpec::OpenLoop(task) => Self {
                kind: Kind::OpenLoop,
                start: Some(task.start),
                max_steps: Some(task.steps),
                ..Self::default()
            },
        }
    }
}

impl Default for TaskSpec {
    /// The paper's three targets.
    fn default() -> Self {
        Self::Targets(Targets::default())
    }
}

impl From<Targets> for TaskSpec {
    fn from(task: Targets) -> Self {
        Self::Targets(task)
    }
}

impl From<Obstacles> for TaskSpec {
    fn from(task: Obstacles) -> Self {
        Self::Obstacles(task)
    }
}

impl From<OpenLoop> for TaskSpec {
    fn from(task: OpenLoop) -> Self {
        Self::OpenLoop(task)
    }
}

impl TaskSpec {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Targets(task) => task.check(),
            Self::Obstacles(task) => task.check(),
            Self::OpenLoop(OpenLoop { start, steps }) => {
                Targets { start: *start, max_steps: *steps, ..Targets::open_loop(1) }.check()
            }
        }
    }

    /// The best fitness there can be: that of eq. (9) in cm for targets, 0 where nothing is to be reached.
    #[must_use]
    pub fn best(&self) -> f64 {
        self.task().best_fitness().unwrap_or(0.0)
    }

    /// Steps after which the experiment ends at the latest.
    #[must_use]
    pub const fn max_steps(&self) -> u32 {
        match self {
            Self::Targets(task) => task.max_steps,
            Self::Obstacles(task) => task.max_steps,
            Self::OpenLoop(task) => task.steps,
        }
    }

    /// The same task that ends after `steps` steps at the latest.
    #[must_use]
    pub fn with_max_steps(mut self, steps: u32) -> Self {
        match &mut self {
            Self::Targets(task) => task.max_steps = steps,
            Self::Obstacles(task) => task.max_steps = steps,
            Self::OpenLoop(task) => task.steps = steps,
        }
        self
    }

    fn task(&self) -> &dyn Task {
        match self {
            Self::Targets(task) => task,
            Self::Obstacles(task) => task,
            Self::OpenLoop(task) => task,
        }
    }
}

impl Task for TaskSpec {
    fn is_over(&self, step: u32, seen: &Observation) -> bool {
        self.task().is_over(step, seen)
    }

    fn step_fitness(&self, first: &Observation, before: &Observation, after: &Observation) -> f64 {
        self.task().step_fitness(first, before, after)
    }

    fn start(&self) -> Point {
        self.task().start()
    }

    fn targets(&self) -> &[Point] {
        self.task().targets()
    }

    fn way(&self) -> Vec<Point> {
        self.task().way()
    }

    fn obstacles(&self) -> &[Obstacle] {
        self.task().obstacles()
    }

    fn is_done(&self, track: &Track) -> Option<bool> {
        self.task().is_done(track)
    }

    fn best_fitness(&self) -> Option<f64> {
        self.task().best_fitness()
    }

    fn as_targets(&self) -> Option<&Targets> {
        self.task().as_targets()
    }

    fn fitness(&self, track: &Track) -> f64 {
        self.task().fitness(track)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_comes_back() {
        let endless = Targets { end_height_cm: f64::INFINITY, ..Targets::default() };
        let round = Obstacles { way_points: vec![Point::new(3.0, 10.0)], ..Obstacles::default() };
        let short = OpenLoop { steps: 7, ..OpenLoop::default() };
        for spec in [TaskSpec::default(), endless.into(), round.into(), short.into()] {
            let text = toml::to_string(&spec).unwrap();
            assert_eq!(toml::from_str::<TaskSpec>(&text).unwrap(), spec, "{text}");
            let text = serde_json::to_string(&spec).unwrap();
            assert_eq!(serde_json::from_str::<TaskSpec>(&text).unwrap(), spec, "{text}");
            spec.check().unwrap();
        }
    }

    #[test]
    fn keys_of_another_kind_are_refused_by_name() {
        let error =
            toml::from_str::<TaskSpec>("kind = \"open_loop\"\ntargets = [[1, 6]]").unwrap_err().to_string();
        assert!(error.contains("found targets"), "{error}");
        let error = toml::from_str::<TaskSpec>("reach_cm = 1.0").unwrap_err().to_string();
        assert!(error.contains("reach_cm") && error.contains("obstacles"), "{error}");
        let error = toml::from_str::<TaskSpec>("goals = []").unwrap_err().to_string();
        assert!(error.contains("goals") && error.contains("line 1"), "{error}");
    }
}
