//! Tasks as data: what stands in a task file, a run folder or a champion.

use serde::{Deserialize, Deserializer, Serialize};

use super::{OpenLoop, Targets, Task};
use crate::check::OutOfRange;
use crate::geometry::Point;
use crate::observation::Observation;
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
    /// Grow for a number of steps.
    OpenLoop(OpenLoop),
}

/// The word for the kind of a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    #[default]
    Targets,
    OpenLoop,
}

impl Kind {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Self::Targets
    }
}

/// The keys of all kinds: one flat table, so that errors in a file keep their line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default, skip_serializing_if = "Kind::is_default")]
    kind: Kind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    targets: Option<Vec<Point>>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "height")]
    end_height_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_steps: Option<u32>,
}

/// A height, which may be infinite: `inf` in TOML, and `null` in JSON, which has no infinity.
fn height<'de, D: Deserializer<'de>>(value: D) -> Result<Option<f64>, D::Error> {
    Ok(Some(Option::deserialize(value)?.unwrap_or(f64::INFINITY)))
}

impl TryFrom<Keys> for TaskSpec {
    type Error = OutOfRange;

    fn try_from(keys: Keys) -> Result<Self, OutOfRange> {
        match keys.kind {
            Kind::Targets => {
                let paper = Targets::default();
                Ok(Self::Targets(Targets {
                    start: keys.start.unwrap_or(paper.start),
                    targets: keys.targets.unwrap_or(paper.targets),
                    end_height_cm: keys.end_height_cm.unwrap_or(paper.end_height_cm),
                    max_steps: keys.max_steps.unwrap_or(paper.max_steps),
                }))
            }
            Kind::OpenLoop => {
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
            },
            TaskSpec::OpenLoop(task) => Self {
                kind: Kind::OpenLoop,
                start: Some(task.start),
                targets: None,
                end_height_cm: None,
                max_steps: Some(task.steps),
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
            Self::OpenLoop(OpenLoop { start, steps }) => {
                Targets { start: *start, max_steps: *steps, ..Targets::open_loop(1) }.check()
            }
        }
    }

    /// The best fitness there can be, in cm: eq. (9) for targets, 0 where nothing is to be reached.
    #[must_use]
    pub fn best(&self) -> f64 {
        match self {
            Self::Targets(task) => task.best(),
            Self::OpenLoop(_) => 0.0,
        }
    }

    /// Steps after which the experiment ends at the latest.
    #[must_use]
    pub const fn max_steps(&self) -> u32 {
        match self {
            Self::Targets(task) => task.max_steps,
            Self::OpenLoop(task) => task.steps,
        }
    }

    /// The same task that ends after `steps` steps at the latest.
    #[must_use]
    pub fn with_max_steps(mut self, steps: u32) -> Self {
        match &mut self {
            Self::Targets(task) => task.max_steps = steps,
            Self::OpenLoop(task) => task.steps = steps,
        }
        self
    }

    fn task(&self) -> &dyn Task {
        match self {
            Self::Targets(task) => task,
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
        for spec in [TaskSpec::default(), endless.into(), OpenLoop { steps: 7, ..OpenLoop::default() }.into()]
        {
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
        let error = toml::from_str::<TaskSpec>("goals = []").unwrap_err().to_string();
        assert!(error.contains("goals") && error.contains("line 1"), "{error}");
    }
}
