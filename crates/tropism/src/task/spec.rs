//! Tasks as data: what stands in a task file, a run folder or a champion.

use serde::{Deserialize, Deserializer, Serialize};

use super::{Crossing, Obstacles, OpenLoop, RandomTargets, Shape, Space, Spiral, Targets, Task};
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::geometry::space::SpacePoint;
use crate::observation::Observation;
use crate::obstacle::{Obstacle, Pole, Solid};
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
    /// Grow into a form.
    Shape(Shape),
    /// Visit targets in space.
    Space(Space),
    /// Wind round a pole.
    Spiral(Spiral),
    /// Visit targets that are drawn when the experiment begins.
    RandomTargets(RandomTargets),
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
    Shape,
    Space,
    Spiral,
    #[serde(rename = "random-targets", alias = "random_targets")]
    RandomTargets,
    OpenLoop,
}

impl Kind {
    const ALL: [Self; 7] = [
        Self::Targets,
        Self::Obstacles,
        Self::Shape,
        Self::Space,
        Self::Spiral,
        Self::RandomTargets,
        Self::OpenLoop,
    ];

    /// The keys that a task of this kind has beside `kind`, `start` and `max_steps`.
    const fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Targets | Self::Space => &["targets", "end_height_cm"],
            Self::Obstacles => {
                &["targets", "end_height_cm", "obstacles", "way_points", "reach_cm", "stem_radius_cm"]
            }
            Self::Shape => {
                &["end_height_cm", "line", "apex", "radius_cm", "inflection", "lean_deg", "within_cm"]
            }
            Self::Spiral => &["end_height_cm", "pole", "turns"],
            Self::RandomTargets => &["count", "highest_cm", "end_height_cm"],
            Self::OpenLoop => &[],
        }
    }

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
    targets: Option<Vec<Place>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    obstacles: Option<Vec<Obstacle>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    way_points: Option<Vec<Point>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reach_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stem_radius_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    line: Option<Vec<Point>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    apex: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    inflection: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lean_deg: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    within_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pole: Option<Pole>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    turns: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    count: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    highest_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "height")]
    end_height_cm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_steps: Option<u32>,
}

/// A target: two coordinates in the plane, or three in space.
#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct Place(Vec<f64>);

/// A height, which may be infinite: `inf` in TOML, and `null` in JSON, which has no infinity.
fn height<'de, D: Deserializer<'de>>(value: D) -> Result<Option<f64>, D::Error> {
    Ok(Some(Option::deserialize(value)?.unwrap_or(f64::INFINITY)))
}

impl Keys {
    /// Refuses keys that belong to tasks of other kinds.
    fn check(&self) -> Result<(), OutOfRange> {
        let found = [
            ("targets", self.targets.is_some()),
            ("obstacles", self.obstacles.is_some()),
            ("way_points", self.way_points.is_some()),
            ("reach_cm", self.reach_cm.is_some()),
            ("stem_radius_cm", self.stem_radius_cm.is_some()),
            ("line", self.line.is_some()),
            ("apex", self.apex.is_some()),
            ("radius_cm", self.radius_cm.is_some()),
            ("inflection", self.inflection.is_some()),
            ("lean_deg", self.lean_deg.is_some()),
            ("within_cm", self.within_cm.is_some()),
            ("pole", self.pole.is_some()),
            ("turns", self.turns.is_some()),
            ("count", self.count.is_some()),
            ("highest_cm", self.highest_cm.is_some()),
            ("end_height_cm", self.end_height_cm.is_some()),
        ];
        found.into_iter().try_for_each(|(key, is_there)| {
            let kinds = Kind::ALL.into_iter().filter(|kind| kind.keys().contains(&key));
            let kinds: Vec<String> =
                kinds.map(|kind| serde_json::to_string(&kind).unwrap_or_default()).collect();
            let is_known = !is_there || self.kind.keys().contains(&key);
            let wanted = format!("this key only beside kind = {}", kinds.join(" or "));
            ensure(is_known, key, "a value", wanted)
        })
    }
}

/// The coordinates of `targets`, `N` each.
fn places<const N: usize>(targets: Vec<Place>) -> Result<Vec<[f64; N]>, OutOfRange> {
    let place = |(index, Place(found)): (usize, Place)| {
        let shown = format!("{found:?}");
        found.try_into().map_err(|_| {
            OutOfRange::new(format!("targets[{index}]"), shown, format!("{N} coordinates in cm"))
        })
    };
    targets.into_iter().enumerate().map(place).collect()
}

/// `targets` in the plane.
fn points(targets: Vec<Place>) -> Result<Vec<Point>, OutOfRange> {
    Ok(places::<2>(targets)?.into_iter().map(Point::from).collect())
}

impl TryFrom<Keys> for TaskSpec {
    type Error = OutOfRange;

    fn try_from(keys: Keys) -> Result<Self, OutOfRange> {
        keys.check()?;
        Ok(match keys.kind {
            Kind::Targets => {
                let usual = Targets::default();
                Self::Targets(Targets {
                    start: keys.start.unwrap_or(usual.start),
                    targets: keys.targets.map_or(Ok(usual.targets), points)?,
                    end_height_cm: keys.end_height_cm.unwrap_or(usual.end_height_cm),
                    max_steps: keys.max_steps.unwrap_or(usual.max_steps),
                })
            }
            Kind::Obstacles => {
                let usual = Obstacles::default();
                let targets = keys.targets.map_or(Ok(usual.targets), points)?;
                let highest = targets.last().map_or(usual.end_height_cm, |target| target.y);
                Self::Obstacles(Obstacles {
                    start: keys.start.unwrap_or(usual.start),
                    obstacles: keys.obstacles.unwrap_or(usual.obstacles),
                    way_points: keys.way_points.unwrap_or(usual.way_points),
                    reach_cm: keys.reach_cm.unwrap_or(usual.reach_cm),
                    stem_radius_cm: keys.stem_radius_cm.unwrap_or(usual.stem_radius_cm),
                    end_height_cm: keys.end_height_cm.unwrap_or(highest),
                    max_steps: keys.max_steps.unwrap_or(usual.max_steps),
                    targets,
                })
            }
            Kind::Shape => {
                let usual = Shape::of(Targets::default().start);
                let line = keys.line.unwrap_or_default();
                let highest = line.last().map_or(usual.end_height_cm, |point| point.y);
                Self::Shape(Shape {
                    start: keys.start.unwrap_or(usual.start),
                    line,
                    apex: keys.apex,
                    radius_cm: keys.radius_cm,
                    inflection: keys.inflection,
                    lean_deg: keys.lean_deg,
                    within_cm: keys.within_cm.unwrap_or(usual.within_cm),
                    end_height_cm: keys.end_height_cm.unwrap_or(highest),
                    max_steps: keys.max_steps.unwrap_or(usual.max_steps),
                })
            }
            Kind::Space => {
                let usual = Space::default();
                let targets: Vec<SpacePoint> = keys.targets.map_or(Ok(usual.targets), places::<3>)?;
                let highest = targets.last().map_or(usual.end_height_cm, |target| target[1]);
                Self::Space(Space {
                    start: keys.start.unwrap_or(usual.start),
                    targets,
                    end_height_cm: keys.end_height_cm.unwrap_or(highest),
                    max_steps: keys.max_steps.unwrap_or(usual.max_steps),
                })
            }
            Kind::Spiral => {
                let usual = Spiral::default();
                Self::Spiral(Spiral {
                    start: keys.start.unwrap_or(usual.start),
                    pole: keys.pole.unwrap_or(usual.pole),
                    turns: keys.turns.unwrap_or(usual.turns),
                    end_height_cm: keys.end_height_cm.unwrap_or(usual.end_height_cm),
                    max_steps: keys.max_steps.unwrap_or(usual.max_steps),
                })
            }
            Kind::RandomTargets => {
                let usual = RandomTargets::default();
                let highest_cm = keys.highest_cm.unwrap_or(usual.highest_cm);
                // As far above the highest target as in the paper.
                let end_height_cm = highest_cm + (usual.end_height_cm - usual.highest_cm);
                Self::RandomTargets(RandomTargets {
                    start: keys.start.unwrap_or(usual.start),
                    count: keys.count.unwrap_or(usual.count),
                    highest_cm,
                    end_height_cm: keys.end_height_cm.unwrap_or(end_height_cm),
                    max_steps: keys.max_steps.unwrap_or(usual.max_steps),
                })
            }
            Kind::OpenLoop => {
                let usual = OpenLoop::default();
                Self::OpenLoop(OpenLoop {
                    start: keys.start.unwrap_or(usual.start),
                    steps: keys.max_steps.unwrap_or(usual.steps),
                })
            }
        })
    }
}

impl From<TaskSpec> for Keys {
    fn from(spec: TaskSpec) -> Self {
        let in_plane = |targets: Vec<Point>| {
            targets.into_iter().map(|target| Place(<[f64; 2]>::from(target).to_vec())).collect()
        };
        match spec {
            TaskSpec::Targets(task) => Self {
                kind: Kind::Targets,
                start: Some(task.start),
                targets: Some(in_plane(task.targets)),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
                ..Self::default()
            },
            TaskSpec::Obstacles(task) => Self {
                kind: Kind::Obstacles,
                start: Some(task.start),
                targets: Some(in_plane(task.targets)),
                obstacles: Some(task.obstacles),
                way_points: Some(task.way_points),
                reach_cm: Some(task.reach_cm),
                stem_radius_cm: Some(task.stem_radius_cm),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
                ..Self::default()
            },
            TaskSpec::Shape(task) => Self {
                kind: Kind::Shape,
                start: Some(task.start),
                line: Some(task.line).filter(|line| !line.is_empty()),
                apex: task.apex,
                radius_cm: task.radius_cm,
                inflection: task.inflection,
                lean_deg: task.lean_deg,
                within_cm: Some(task.within_cm),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
                ..Self::default()
            },
            TaskSpec::Space(task) => Self {
                kind: Kind::Space,
                start: Some(task.start),
                targets: Some(task.targets.into_iter().map(|target| Place(target.to_vec())).collect()),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
                ..Self::default()
            },
            TaskSpec::Spiral(task) => Self {
                kind: Kind::Spiral,
                start: Some(task.start),
                pole: Some(task.pole),
                turns: Some(task.turns),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
                ..Self::default()
            },
            TaskSpec::RandomTargets(task) => Self {
                kind: Kind::RandomTargets,
                start: Some(task.start),
                count: Some(task.count),
                highest_cm: Some(task.highest_cm),
                end_height_cm: Some(task.end_height_cm),
                max_steps: Some(task.max_steps),
                ..Self::default()
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

impl From<Shape> for TaskSpec {
    fn from(task: Shape) -> Self {
        Self::Shape(task)
    }
}

impl From<Space> for TaskSpec {
    fn from(task: Space) -> Self {
        Self::Space(task)
    }
}

impl From<Spiral> for TaskSpec {
    fn from(task: Spiral) -> Self {
        Self::Spiral(task)
    }
}

impl From<RandomTargets> for TaskSpec {
    fn from(task: RandomTargets) -> Self {
        Self::RandomTargets(task)
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
            Self::Shape(task) => task.check(),
            Self::Space(task) => task.check(),
            Self::Spiral(task) => task.check(),
            Self::RandomTargets(task) => task.check(),
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
            Self::Shape(task) => task.max_steps,
            Self::Space(task) => task.max_steps,
            Self::Spiral(task) => task.max_steps,
            Self::RandomTargets(task) => task.max_steps,
            Self::OpenLoop(task) => task.steps,
        }
    }

    /// The same task that ends after `steps` steps at the latest.
    #[must_use]
    pub fn with_max_steps(mut self, steps: u32) -> Self {
        match &mut self {
            Self::Targets(task) => task.max_steps = steps,
            Self::Obstacles(task) => task.max_steps = steps,
            Self::Shape(task) => task.max_steps = steps,
            Self::Space(task) => task.max_steps = steps,
            Self::Spiral(task) => task.max_steps = steps,
            Self::RandomTargets(task) => task.max_steps = steps,
            Self::OpenLoop(task) => task.steps = steps,
        }
        self
    }

    fn task(&self) -> &dyn Task {
        match self {
            Self::Targets(task) => task,
            Self::Obstacles(task) => task,
            Self::Shape(task) => task,
            Self::Space(task) => task,
            Self::Spiral(task) => task,
            Self::RandomTargets(task) => task,
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

    fn targets(&self) -> Vec<Point> {
        self.task().targets()
    }

    fn has_goal(&self) -> bool {
        self.task().has_goal()
    }

    fn in_front(&self) -> Option<Targets> {
        self.task().in_front()
    }

    fn is_about_stem(&self) -> bool {
        self.task().is_about_stem()
    }

    fn way(&self) -> Vec<Point> {
        self.task().way()
    }

    fn way_in_space(&self) -> Option<Vec<SpacePoint>> {
        self.task().way_in_space()
    }

    fn obstacles(&self) -> &[Obstacle] {
        self.task().obstacles()
    }

    fn shape(&self) -> &[Point] {
        self.task().shape()
    }

    fn pole(&self) -> Option<Pole> {
        self.task().pole()
    }

    fn crossings(&self, track: &Track) -> Vec<Option<Crossing>> {
        self.task().crossings(track)
    }

    fn solids(&self) -> Vec<Solid> {
        self.task().solids()
    }

    fn is_done(&self, track: &Track) -> Option<bool> {
        self.task().is_done(track)
    }

    fn utility(&self, fitness: f64) -> f64 {
        self.task().utility(fitness)
    }

    fn best_fitness(&self) -> Option<f64> {
        self.task().best_fitness()
    }

    fn as_targets(&self) -> Option<&Targets> {
        self.task().as_targets()
    }

    fn as_obstacles(&self) -> Option<&Obstacles> {
        self.task().as_obstacles()
    }

    fn fitness(&self, track: &Track) -> f64 {
        self.task().fitness(track)
    }
}
