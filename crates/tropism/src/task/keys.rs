//! A task as data: every key of a task file, declared once.
//!
//! A declaration has the key's type, its default and its check. A kind of task lists the keys that it takes
//! ([`Score::keys`]), and its own defaults are those of its task in [`kinds`]. Reading, writing and checking come from these.
//! All kinds share one flat table, so that errors in a file keep their line.

use core::fmt;
use core::marker::PhantomData;
use std::sync::Arc;

use serde::de::{DeserializeSeed, Error as _, IgnoredAny, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{OpenLoop, Reading, Score, Targets, kinds};
use crate::check::{OutOfRange, ensure, within};
use crate::geometry::{Point, Polyline};
use crate::obstacle::{Obstacle, Pole, clearance};

macro_rules! keys {
    ($($(#[doc = $doc:literal])+ $key:ident: $type:ty = $default:expr, $check:expr;)+) => {
        /// A task: data, and a score.
        ///
        /// A file without `kind` is the paper's task; a key that is left out has the default of the kind.
        ///
        /// ```
        /// use tropism::task::Task;
        /// let paper: Task = serde_json::from_str("{}")?;
        /// assert_eq!(paper, Task::default());
        /// let open: Task = serde_json::from_str(r#"{"kind": "open_loop", "max_steps": 50}"#)?;
        /// assert_eq!(open, Task::open_loop(50));
        /// assert!(serde_json::from_str::<Task>(r#"{"kind": "open_loop", "turns": 2}"#).is_err());
        /// # Ok::<(), serde_json::Error>(())
        /// ```
        #[derive(Clone, Debug)]
        pub struct Task {
            /// What each step is worth, and when the task is done.
            pub kind: Arc<dyn Score>,
            $($(#[doc = $doc])+ pub $key: $type,)+
        }

        /// Scores of one type are equal.
        impl PartialEq for Task {
            fn eq(&self, other: &Self) -> bool {
                (*self.kind).type_id() == (*other.kind).type_id() $(&& self.$key == other.$key)+
            }
        }

        /// The names of all keys.
        pub(super) const ALL: &[&str] = &[$(stringify!($key)),+];

        /// The keys that a file has.
        #[derive(Default)]
        struct Given {
            $($key: Option<$type>,)+
        }

        impl Task {
            /// A task without anything to reach, which ends after 1000 steps.
            pub fn new(kind: impl Score) -> Self {
                Self { kind: Arc::new(kind), $($key: $default,)+ }
            }

            /// Checks each key of its kind, and that keys of other kinds were left alone.
            ///
            /// # Errors
            /// [`OutOfRange`] names the key, its value and the allowed values.
            pub fn check(&self) -> Result<(), OutOfRange> {
                let untouched = Self::new(OpenLoop);
                $(
                    if self.takes(stringify!($key)) {
                        let check: fn(&Self) -> Result<(), OutOfRange> = $check;
                        check(self)?;
                    } else if self.$key != untouched.$key {
                        return Err(self.refusal(stringify!($key)));
                    }
                )+
                self.kind.check(self)
            }
        }

        #[cfg(feature = "schema")]
        impl schemars::JsonSchema for Task {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                "Task".into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let all = kinds().map(|task| {
                    let mut keys = serde_json::Map::new();
                    keys.insert("kind".to_owned(), serde_json::json!({ "const": task.kind.name() }));
                    $(
                        if task.takes(stringify!($key)) {
                            let mut schema = generator.subschema_for::<$type>();
                            schema.insert("description".to_owned(), concat!($($doc, "\n"),+).into());
                            let default = serde_json::to_value(&task.$key).unwrap_or_default();
                            if task.$key.is_set() && !default.is_null() {
                                schema.insert("default".to_owned(), default);
                            }
                            keys.insert(stringify!($key).to_owned(), schema.into());
                        }
                    )+
                    let required: &[&str] = if task.has_score::<Targets>() { &[] } else { &["kind"] };
                    serde_json::json!({
                        "title": task.kind.name(),
                        "type": "object",
                        "properties": keys,
                        "required": required,
                        "additionalProperties": false,
                    })
                });
                schemars::json_schema!({ "oneOf": all })
            }
        }

        impl Serialize for Task {
            fn serialize<S: Serializer>(&self, file: S) -> Result<S::Ok, S::Error> {
                let mut table = file.serialize_map(None)?;
                if !self.has_score::<Targets>() {
                    table.serialize_entry("kind", self.kind.name())?;
                }
                $(
                    if self.takes(stringify!($key)) && self.$key.is_set() {
                        table.serialize_entry(stringify!($key), &self.$key)?;
                    }
                )+
                table.end()
            }
        }

        impl<'de> Visitor<'de> for Table {
            type Value = Task;

            fn expecting(&self, text: &mut fmt::Formatter<'_>) -> fmt::Result {
                text.write_str("the keys of a task")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut table: A) -> Result<Task, A::Error> {
                let (mut kind, mut given) = (None, Given::default());
                while let Some(name) = table.next_key::<String>()? {
                    if name == "kind" {
                        kind = Some(table.next_value::<Kind>()?.0);
                        continue;
                    }
                    $(
                        if name == stringify!($key) {
                            let refusal = kind.as_ref().and_then(|kind: &Task| kind.refusal_of(&name));
                            given.$key = Some(table.next_value_seed(Entry(refusal, PhantomData::<$type>))?);
                            continue;
                        }
                    )+
                    let refusal = Some(format!("unknown key `{name}`, wanted one of {}", ALL.join(", ")));
                    table.next_value_seed(Entry(refusal, PhantomData::<Unknown>))?;
                }
                let kind = kind.unwrap_or_default();
                let mut task = kind.clone();
                $(
                    if let Some(value) = given.$key {
                        if let Some(refusal) = kind.refusal_of(stringify!($key)) {
                            return Err(A::Error::custom(refusal));
                        }
                        task.$key = value;
                    }
                )+
                if given.end_height_cm.is_none() {
                    task.end_height_cm = kind.end_above(task.top());
                }
                Ok(task)
            }
        }
    };
}

keys! {
    /// Tip of the seedling at the start of a simulated experiment, in cm, y above 0. Paper: (0, 4), section 2.3.
    start: Point = Point::new(0.0, 4.0), |task| {
        let is_above_soil = is_near(task.start) && task.start.y > 0.0;
        ensure(is_above_soil, "start", shown(task.start), "[x, y] in cm with y above 0")
    };
    /// Points that the tip is to visit, as the front camera sees them, in ascending height above the start, in cm.
    targets: Vec<Point> = Vec::new(), |task| check_rising("targets", task.start.y, &task.targets);
    /// By which reading of eq. (9) a step towards the targets is scored: `letter`, `approach` or `arrival`.
    score: Reading = Reading::default(), |_| Ok(());
    /// Of targets in space, how far each lies in front of the root, towards the front camera, in cm; empty in the plane.
    depths_cm: Vec<f64> = Vec::new(), |task| {
        let are_depths = task.depths_cm.iter().all(|depth| depth.abs() <= MOST_CM);
        let are_complete = task.depths_cm.len() == task.targets.len();
        let found = format!("{:?}", task.depths_cm);
        ensure(are_depths && are_complete, "depths_cm", found, "one in cm for each target")
    };
    /// What the stem must not touch.
    obstacles: Vec<Obstacle> = Vec::new(), |task| {
        task.obstacles.iter().enumerate().try_for_each(|(index, obstacle)| {
            let key = format!("obstacles[{index}]");
            obstacle.check().map_err(|error| error.in_table(&key))?;
            // A plant in an obstacle is pushed out of it at once, and no controller is to blame for that.
            let seedling = Polyline(vec![Point::default(), task.start]);
            let distance = clearance(&[*obstacle], &seedling).map_or(f64::INFINITY, |nearest| nearest.distance_cm);
            let found = format!("{distance:.2} cm from the line from the root to the start of the tip");
            ensure(distance > task.stem_radius_cm, key, found, "more than the radius of the stem")
        })
    };
    /// Points in ascending height, in cm, by which controllers steer on their way to the targets. They are worth nothing.
    way_points: Vec<Point> = Vec::new(), |task| {
        check_rising("way_points", f64::NEG_INFINITY, &task.way_points)
    };
    /// Distance from a target, at its height, within which the tip has reached it, in cm above 0.
    reach_cm: f64 = 1.5, |task| check_length("reach_cm", task.reach_cm);
    /// Radius of the stem, in cm above 0: its midline must keep so far from each obstacle. Chosen by hand: common beans of
    /// this age have stems of 2 to 4 mm.
    stem_radius_cm: f64 = 0.15, |task| check_length("stem_radius_cm", task.stem_radius_cm);
    /// Line from the root upwards, in cm, on which the stem is to lie: two points or more. Empty for none.
    line: Vec<Point> = Vec::new(), |task| {
        let is_upwards = task.line.first().zip(task.line.last()).is_none_or(|(root, end)| end.y > root.y);
        let wanted = "two points or more, from the root upwards";
        ensure(task.line.len() != 1, "line", "one point", wanted)?;
        ensure(is_upwards, "line", "a line that ends no higher than it begins", wanted)?;
        task.line.iter().try_for_each(|point| check_point("line", Some(*point)))
    };
    /// Where the apex of the stem's curve is to be, in cm: its point farthest from the straight line between its ends.
    apex: Option<Point> = None, |task| check_point("apex", task.apex);
    /// Radius of the circle through root, apex of the curve and tip, in cm: above 0 for a bow to the right, below 0 to the left.
    radius_cm: Option<f64> = None, |task| {
        let radius = task.radius_cm.unwrap_or(1.0);
        ensure(radius.is_finite() && radius != 0.0, "radius_cm", radius, "cm, below or above 0")
    };
    /// Where the curve of the stem is to change its side, in cm.
    inflection: Option<Point> = None, |task| check_point("inflection", task.inflection);
    /// Angle of the upper third of the stem to the vertical, in degrees, -90 to 90: above 0 to the right.
    lean_deg: Option<f64> = None, |task| within("lean_deg", task.lean_deg.unwrap_or(0.0), -90.0..=90.0);
    /// Mean difference from a form of the stem, in cm above 0, within which the task is done.
    within_cm: f64 = 0.5, |task| check_length("within_cm", task.within_cm);
    /// The pole round which the stem is to wind: of finite height, with the root outside of it.
    pole: Option<Pole> = None, |task| {
        let Some(pole) = task.pole else { return Ok(()) };
        pole.check().map_err(|error| error.in_table("pole"))?;
        ensure(pole.height_cm.is_finite(), "pole.height_cm", pole.height_cm, "a finite height in cm")?;
        let is_beside = pole.distance([0.0; 3]) > 0.0;
        ensure(is_beside, "pole.at", format!("{:?}", pole.at), "a place that is not on the root")
    };
    /// Turns round the pole, in either direction, with which the task is done, 0.05 to 100.
    turns: f64 = 1.0, |task| within("turns", task.turns, 0.05..=100.0);
    /// Number of targets that are still to be drawn, 1 to 100.
    count: u32 = 0, |task| within("count", task.count, 1..=100);
    /// Height that no target that is drawn is above, in cm; itself above the start.
    highest_cm: f64 = 0.0, |task| {
        let is_high = task.highest_cm.is_finite() && task.highest_cm > task.start.y;
        ensure(is_high, "highest_cm", task.highest_cm, "a height in cm above the start")
    };
    /// Height of the tip at which the experiment ends, in cm; that of the highest target or more. Paper: 13.8, 0.3 above the
    /// last target (section 2.3.1). By default as far above the highest place of the task as in the default of its kind.
    end_height_cm: f64 = f64::INFINITY, |task| {
        let is_high = task.end_height_cm >= task.top().unwrap_or(task.start.y);
        ensure(is_high, "end_height_cm", task.end_height_cm, "at least the height of the highest target")
    };
    /// Steps after which the experiment ends although the tip is lower, 1 to 1000000. The paper names no limit; its longest
    /// experiment is 1000 steps.
    max_steps: u32 = 1000, |task| within("max_steps", task.max_steps, 1..=1_000_000);
}

/// How far from the root a place of a task may be, and how long a length, in cm. Chosen: above every plant.
const MOST_CM: f64 = 1e4;

fn is_near(point: Point) -> bool {
    point.x.abs() <= MOST_CM && point.y.abs() <= MOST_CM
}

fn shown(point: Point) -> String {
    format!("{:?}", <[f64; 2]>::from(point))
}

fn check_point(key: &str, point: Option<Point>) -> Result<(), OutOfRange> {
    let point = point.unwrap_or_default();
    ensure(is_near(point), key, shown(point), "[x, y] in cm, within 10000 cm of the root")
}

fn check_length(key: &str, length: f64) -> Result<(), OutOfRange> {
    ensure(length > 0.0 && length <= MOST_CM, key, length, "cm above 0, at most 10000")
}

/// Checks that `points` are finite and rise from above a height.
fn check_rising(key: &str, mut below: f64, points: &[Point]) -> Result<(), OutOfRange> {
    points.iter().enumerate().try_for_each(|(index, point)| {
        let is_higher = is_near(*point) && point.y > core::mem::replace(&mut below, point.y);
        let wanted = "a point higher than the one before it, within 10000 cm of the root";
        ensure(is_higher, format!("{key}[{index}]"), shown(*point), wanted)
    })
}

impl Task {
    /// Whether its kind has this key.
    fn takes(&self, key: &str) -> bool {
        self.kind.keys().contains(&key)
    }

    /// The same task with its targets scored by `reading` of eq. (9); unchanged where its kind has no targets to be scored so.
    #[must_use]
    pub fn by(&self, reading: Reading) -> Self {
        let score = if self.takes("score") { reading } else { self.score };
        Self { score, ..self.clone() }
    }

    /// What is wrong with a key of other kinds.
    fn refusal(&self, key: &str) -> OutOfRange {
        let of_key = kinds().into_iter().filter(|kind| kind.takes(key));
        let kinds: Vec<String> = of_key.map(|kind| format!("{:?}", kind.kind.name())).collect();
        let wanted = format!("this key only beside kind = {}", kinds.join(" or "));
        OutOfRange::new(key, format!("a value beside kind = {:?}", self.kind.name()), wanted)
    }

    /// What is wrong with `key` in a file of this kind.
    fn refusal_of(&self, key: &str) -> Option<String> {
        (!self.takes(key)).then(|| self.refusal(key).to_string())
    }

    /// The greatest height of what is to be reached, in cm.
    pub(super) fn top(&self) -> Option<f64> {
        let drawn = (self.count > 0).then_some(self.highest_cm);
        self.targets.iter().chain(self.line.last()).map(|point| point.y).chain(drawn).reduce(f64::max)
    }

    /// The height at which a task of this kind ends whose highest place is `top`.
    pub(super) fn end_above(&self, top: Option<f64>) -> f64 {
        match top {
            Some(top) if Some(top) != self.top() => {
                top + self.top().map_or(0.0, |own| self.end_height_cm - own)
            }
            _ => self.end_height_cm,
        }
    }
}

/// The table of a task file.
struct Table;

impl<'de> Deserialize<'de> for Task {
    fn deserialize<D: Deserializer<'de>>(file: D) -> Result<Self, D::Error> {
        file.deserialize_map(Table)
    }
}

/// The task of the kind that a file names, with the defaults of the kind.
struct Kind(Task);

impl<'de> Deserialize<'de> for Kind {
    fn deserialize<D: Deserializer<'de>>(file: D) -> Result<Self, D::Error> {
        let name = String::deserialize(file)?;
        let kind = kinds().into_iter().find(|kind| kind.kind.name() == name);
        kind.map(Self).ok_or_else(|| {
            let names = kinds().map(|kind| kind.kind.name()).join(", ");
            D::Error::custom(format!("unknown kind of task {name:?}, wanted one of {names}"))
        })
    }
}

/// The value of a key, or why the key must not be there: so that the error has the line of the value.
struct Entry<T>(Option<String>, PhantomData<T>);

impl<'de, T: Value> DeserializeSeed<'de> for Entry<T> {
    type Value = T;

    fn deserialize<D: Deserializer<'de>>(self, file: D) -> Result<T, D::Error> {
        match self.0 {
            Some(refusal) => Err(D::Error::custom(refusal)),
            None => T::read(file),
        }
    }
}

/// A type of values in task files.
trait Value: for<'de> Deserialize<'de> {
    /// Whether it is written.
    fn is_set(&self) -> bool {
        true
    }

    fn read<'de, D: Deserializer<'de>>(file: D) -> Result<Self, D::Error> {
        Self::deserialize(file)
    }
}

type Unknown = IgnoredAny;

impl Value for Unknown {}
impl Value for u32 {}
impl Value for Reading {
    fn is_set(&self) -> bool {
        *self != Self::default()
    }
}

impl Value for Point {}
impl<T: for<'de> Deserialize<'de>> Value for Vec<T> {}

impl<T: for<'de> Deserialize<'de>> Value for Option<T> {
    fn is_set(&self) -> bool {
        self.is_some()
    }
}

impl Value for f64 {
    /// JSON has no infinity and writes `null`.
    fn read<'de, D: Deserializer<'de>>(file: D) -> Result<Self, D::Error> {
        Ok(Option::deserialize(file)?.unwrap_or(Self::INFINITY))
    }
}
