//! What a network sees: which parts of an observation and of the task become its inputs.
//!
//! The paper's network sees the tip, x and y (section 2.3). The other sensors are what a plant's response depends on
//! besides: where the next target is, how the tip moved, and which light the plant has had. For tasks on the whole stem (section
//! 5, future work) there are its points, its lean and curvature, where obstacles are, and how far it is from a drawn line. In
//! space there are the depth of the tip and the targets with theirs: towards the front camera, so that a mirror leaves them.

use serde::{Deserialize, Serialize};

use crate::geometry::space::SpacePoint;
use crate::geometry::{Point, Polyline, STEM_POINTS};
use crate::lamps::{Lamp, Layout};
use crate::lighting::Lighting;
use crate::math;
use crate::observation::Observation;
use crate::obstacle::{Obstacle, clearance};
use crate::task::Task;

/// Inputs of the paper's network: x and y of the tip. The bias is the network's own.
pub const TIP_INPUTS: usize = 2;

/// One sensor: one or more inputs of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// x and y of the tip, in cm. Paper (section 2.3).
    Tip,
    /// x and y from the tip to a target above it, in cm: the next one (`ahead` 0), the one after (1), and so on. Above all
    /// of them the last target counts; a task without targets gives 0.
    ToTarget {
        /// How many targets lie between, 0 to 100.
        ahead: usize,
    },
    /// Shift of the tip in the last step, x and y, in cm; 0 at the first.
    LastShift,
    /// Running mean of the side of the lit lamp (-1 left, 1 right), with weight 1 / `steps` for the last step; 0 at first.
    LightMemory {
        /// Steps of the mean, 1 to 10000.
        steps: u32,
    },
    /// `points` equidistant points of the stem from the base to the tip, x and y each, in cm; 0 where no stem was seen.
    Stem {
        /// How many points, 2 to 100. Paper: 10 (section 4).
        points: usize,
    },
    /// Angle of the upper third of the stem from the vertical, in rad, above 0 to the right; 0 where no stem was seen.
    Lean,
    /// Mean curvature of the stem, in 1/cm: by how much its upper third leans more than its lower third, a cm of its length
    /// between their middles. Above 0 it bends to the right; 0 where no stem was seen.
    Curvature,
    /// Distance from the midline of the stem to the nearest obstacle, in cm, below 0 inside; and on which side the obstacle is
    /// there, from -1 (left) to 1 (right). Farther than 10 cm, without obstacles and where no stem was seen: 10 and 0.
    Clearance,
    /// x and y from the tip to the surface of the nearest obstacle that reaches above the tip, in cm. Farther than 10 cm, and
    /// above all obstacles: 0 and 10.
    ObstacleAhead,
    /// Depth of the tip, z, in cm, above 0 towards the front camera; 0 where it is not known.
    Depth,
    /// Change of the depth of the tip in the last step, in cm; 0 at the first, and where the depth is not known.
    DepthShift,
    /// x, y and z from the tip to a target above it, in cm, as [`Sensor::ToTarget`]. In a plane task targets have a depth of 0.
    ToTargetInSpace {
        /// How many targets lie between, 0 to 100.
        ahead: usize,
    },
    /// Running mean of the lit lamp along the depth (-1 behind the plant, 1 in front of it, 0 for one that stands more to a
    /// side), with weight 1 / `steps` for the last step; 0 at first.
    FrontLightMemory {
        /// Steps of the mean, 1 to 10000.
        steps: u32,
    },
    /// How far the drawn line of a task lies to the right of the stem at the same height, in cm: at the tip, and the mean over
    /// ten points of the stem. Above the line its upper end counts, below it the lower one. 0 without a line; without a stem
    /// the tip alone counts.
    LineOffset,
}

/// Distance from which on obstacles count as far away, in cm: the height of the paper's experiments (section 2.2.3), less
/// that of the seedling.
const FAR_CM: f64 = 10.0;

impl Sensor {
    /// How many inputs it makes.
    #[must_use]
    pub const fn inputs(self) -> usize {
        match self {
            Self::Tip | Self::ToTarget { .. } | Self::LastShift | Self::Clearance | Self::ObstacleAhead => 2,
            Self::LineOffset => 2,
            Self::ToTargetInSpace { .. } => 3,
            Self::LightMemory { .. } | Self::FrontLightMemory { .. } => 1,
            Self::Lean | Self::Curvature | Self::Depth | Self::DepthShift => 1,
            Self::Stem { points } => 2 * points,
        }
    }
}

/// The sensors of a network, in the order of its inputs.
///
/// ```
/// use tropism::control::{Sensor, Sensors};
/// assert_eq!(Sensors::default().inputs(), 2); // the paper's: x and y of the tip
/// let felt = Sensors::new(vec![Sensor::ToTarget { ahead: 0 }, Sensor::LastShift, Sensor::LightMemory { steps: 7 }])?;
/// assert_eq!(felt.inputs(), 5);
/// # Ok::<(), tropism::control::SensorsError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Vec<Sensor>", into = "Vec<Sensor>")]
pub struct Sensors(Vec<Sensor>);

/// Sensors that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("sensors: found {found}, wanted {wanted}")]
pub struct SensorsError {
    /// What stands there.
    pub found: String,
    /// What should stand there.
    pub wanted: &'static str,
}

impl Sensors {
    /// These sensors, in this order.
    ///
    /// # Errors
    /// [`SensorsError`] without any sensor, or with a number out of its range.
    pub fn new(sensors: Vec<Sensor>) -> Result<Self, SensorsError> {
        let error = |found: String, wanted| Err(SensorsError { found, wanted });
        if sensors.is_empty() || sensors.len() > 100 {
            return error(format!("{} sensors", sensors.len()), "1 to 100");
        }
        for sensor in &sensors {
            let (name, key, value, range, wanted) = match *sensor {
                Sensor::ToTarget { ahead } => ("to_target", "ahead", ahead, 0..=100, "0 to 100"),
                Sensor::ToTargetInSpace { ahead } => {
                    ("to_target_in_space", "ahead", ahead, 0..=100, "0 to 100")
                }
                Sensor::LightMemory { steps } => {
                    ("light_memory", "steps", steps as usize, 1..=10_000, "1 to 10000")
                }
                Sensor::FrontLightMemory { steps } => {
                    ("front_light_memory", "steps", steps as usize, 1..=10_000, "1 to 10000")
                }
                Sensor::Stem { points } => ("stem", "points", points, 2..=100, "2 to 100"),
                _ => continue,
            };
            if !range.contains(&value) {
                return error(format!("{name} with {key} = {value}"), wanted);
            }
        }
        Ok(Self(sensors))
    }

    /// The sensors in order.
    #[must_use]
    pub fn sensors(&self) -> &[Sensor] {
        &self.0
    }

    /// How many inputs a network needs for them, without the bias.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.0.iter().map(|sensor| sensor.inputs()).sum()
    }

    /// Whether these are the paper's: the tip alone.
    #[must_use]
    pub fn is_tip(&self) -> bool {
        self.0 == [Sensor::Tip]
    }
}

impl Default for Sensors {
    /// The paper's: the tip.
    fn default() -> Self {
        Self(vec![Sensor::Tip])
    }
}

impl TryFrom<Vec<Sensor>> for Sensors {
    type Error = SensorsError;

    fn try_from(sensors: Vec<Sensor>) -> Result<Self, SensorsError> {
        Self::new(sensors)
    }
}

impl From<Sensors> for Vec<Sensor> {
    fn from(sensors: Sensors) -> Self {
        sensors.0
    }
}

/// Sensors at work on one plant: what they remember from step to step. At each step [`sense`](Self::sense) comes first, then
/// [`remember`](Self::remember) with the light that was decided upon.
///
/// ```
/// use tropism::control::{Sensor, SensorState, Sensors};
/// use tropism::prelude::*;
/// let sensors = Sensors::new(vec![Sensor::LastShift, Sensor::LightMemory { steps: 2 }])?;
/// let mut state = SensorState::new(&sensors, &Task::default(), &Layout::default());
/// let mut inputs = Vec::new();
/// state.sense(&Observation::simulated(Point::new(0.0, 4.0)), &mut inputs);
/// assert_eq!(inputs, [0.0, 0.0, 0.0]);
/// state.remember(Light::RIGHT);
/// state.sense(&Observation::simulated(Point::new(0.5, 4.25)), &mut inputs);
/// assert_eq!(inputs, [0.5, 0.25, 0.5]); // the shift in x and y, and half of the way to the right lamp
/// # Ok::<(), tropism::control::SensorsError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SensorState {
    sensors: Sensors,
    /// Those of a task in the plane have a depth of 0.
    targets: Vec<SpacePoint>,
    obstacles: Vec<Obstacle>,
    line: Vec<Point>,
    sides: Vec<f64>,
    /// For each lamp -1 behind the plant, 1 in front of it, 0 more to a side.
    fronts: Vec<f64>,
    last_tip: Option<Point>,
    last_depth: Option<f64>,
    /// One running mean for each sensor; only those of the light are used.
    memories: Vec<f64>,
}

impl SensorState {
    /// The state before the first observation. Targets and obstacles are those of `task`.
    #[must_use]
    pub fn new(sensors: &Sensors, task: &Task, layout: &Layout) -> Self {
        let in_plane = || task.way().into_iter().map(|target| [target.x, target.y, 0.0]).collect();
        let front = |lamp: &Lamp| {
            let [x, _, z] = lamp.at;
            if lamp.colour.steers() && z.abs() > x.abs() { z.signum() } else { 0.0 }
        };
        Self {
            sensors: sensors.clone(),
            targets: task.way_in_space().unwrap_or_else(in_plane),
            obstacles: task.obstacles.clone(),
            line: task.line.clone(),
            sides: layout.lights().map(|light| layout.side(light)).collect(),
            fronts: layout.lamps().iter().map(front).collect(),
            last_tip: None,
            last_depth: None,
            memories: vec![0.0; sensors.0.len()],
        }
    }

    /// Writes the inputs for what is `seen` now into `inputs`, which is cleared first: as many as [`Sensors::inputs`], in the
    /// order of the sensors.
    pub fn sense(&mut self, seen: &Observation, inputs: &mut Vec<f64>) {
        inputs.clear();
        let tip = seen.tip;
        let z = seen.depth.as_ref().map_or(0.0, |depth| depth.tip_cm);
        let stem = seen.stem.as_ref().filter(|stem| stem.0.len() > 1);
        for (place, sensor) in self.sensors.0.iter().enumerate() {
            match *sensor {
                Sensor::Tip => inputs.extend([tip.x, tip.y]),
                Sensor::ToTarget { ahead } => inputs.extend_from_slice(&self.to_target(ahead, tip, z)[..2]),
                Sensor::ToTargetInSpace { ahead } => inputs.extend(self.to_target(ahead, tip, z)),
                Sensor::Depth => inputs.push(z),
                Sensor::DepthShift => {
                    let now = seen.depth.as_ref().map(|depth| depth.tip_cm);
                    inputs.push(self.last_depth.zip(now).map_or(0.0, |(before, now)| now - before));
                }
                Sensor::LastShift => {
                    let before = self.last_tip.unwrap_or(tip);
                    inputs.extend([tip.x - before.x, tip.y - before.y]);
                }
                Sensor::LightMemory { .. } | Sensor::FrontLightMemory { .. } => {
                    inputs.push(self.memories[place]);
                }
                Sensor::Stem { points } => match stem {
                    Some(stem) => {
                        inputs.extend(stem.resampled(points).0.iter().flat_map(|point| [point.x, point.y]));
                    }
                    None => inputs.extend(std::iter::repeat_n(0.0, 2 * points)),
                },
                Sensor::Lean => inputs.push(stem.map_or(0.0, |stem| lower_and_upper_lean(stem)[1])),
                Sensor::Curvature => inputs.push(stem.map_or(0.0, |stem| {
                    let [lower, upper] = lower_and_upper_lean(stem);
                    let between = 2.0 / 3.0 * stem.length();
                    if between > 0.0 { (upper - lower) / between } else { 0.0 }
                })),
                Sensor::Clearance => inputs.extend(self.clearance(stem)),
                Sensor::ObstacleAhead => inputs.extend(self.obstacle_ahead(tip)),
                Sensor::LineOffset => inputs.extend(self.line_offset(tip, stem)),
            }
        }
        self.last_tip = Some(tip);
        self.last_depth = seen.depth.as_ref().map(|depth| depth.tip_cm);
    }

    /// The way from the tip to the target that is `ahead` of the next one; none without targets.
    fn to_target(&self, ahead: usize, tip: Point, z: f64) -> [f64; 3] {
        let next = self.targets.iter().position(|target| tip.y < target[1]);
        let last = self.targets.len().saturating_sub(1);
        let place = next.map_or(last, |next| (next + ahead).min(last));
        self.targets.get(place).map_or([0.0; 3], |target| math::vector::sub(*target, [tip.x, tip.y, z]))
    }

    /// The inputs of [`Sensor::LineOffset`].
    fn line_offset(&self, tip: Point, stem: Option<&Polyline>) -> [f64; 2] {
        let offset = |point: Point| x_at(&self.line, point.y).map_or(0.0, |x| x - point.x);
        let mean = stem.map_or(offset(tip), |stem| {
            math::statistics::mean(stem.resampled(STEM_POINTS).0.into_iter().map(offset))
        });
        [offset(tip), mean]
    }

    /// The inputs of [`Sensor::Clearance`].
    fn clearance(&self, stem: Option<&Polyline>) -> [f64; 2] {
        let nearest = stem.and_then(|stem| clearance(&self.obstacles, stem));
        let Some(nearest) = nearest.filter(|nearest| nearest.distance_cm < FAR_CM) else {
            return [FAR_CM, 0.0];
        };
        let towards =
            math::vector::normalize_or(math::vector::sub(nearest.obstacle, nearest.stem), [0.0, 1.0]);
        [nearest.distance_cm, towards[0]]
    }

    /// The inputs of [`Sensor::ObstacleAhead`].
    fn obstacle_ahead(&self, tip: Point) -> [f64; 2] {
        let ahead = self.obstacles.iter().filter(|obstacle| obstacle.extent().1.y > tip.y);
        let nearest = ahead
            .map(|obstacle| obstacle.distance_and_normal(tip))
            .min_by(|(one, _), (other, _)| one.total_cmp(other))
            .filter(|(distance, _)| *distance < FAR_CM);
        nearest.map_or([0.0, FAR_CM], |(distance, normal)| normal.map(|axis| -axis * distance))
    }

    /// Remembers the lighting that was decided upon: each lamp counts by its power.
    pub fn remember(&mut self, lighting: impl Into<Lighting>) {
        let powers = lighting.into().powers();
        let of = |values: &[f64]| values.iter().zip(powers).map(|(value, power)| value * power).sum::<f64>();
        let (side, front) = (of(&self.sides), of(&self.fronts));
        for (sensor, memory) in self.sensors.0.iter().zip(&mut self.memories) {
            match *sensor {
                Sensor::LightMemory { steps } => *memory += (side - *memory) / f64::from(steps),
                Sensor::FrontLightMemory { steps } => *memory += (front - *memory) / f64::from(steps),
                _ => {}
            }
        }
    }
}

/// x of a line where it first is at a height, in cm; above and below it that of its upper or lower end. `None` without a line.
fn x_at(line: &[Point], y: f64) -> Option<f64> {
    let (first, last) = (line.first()?, line.last()?);
    let is_there = |pair: &&[Point]| pair[0].y <= y && y <= pair[1].y;
    let Some(pair) = line.windows(2).find(is_there) else {
        return Some(if y < first.y { first.x } else { last.x });
    };
    let rise = pair[1].y - pair[0].y;
    let share = if rise > 0.0 { (y - pair[0].y) / rise } else { 0.0 };
    Some(math::interpolate::lerp(pair[0].x, pair[1].x, share))
}

/// Angles of the lower and of the upper third of a stem from the vertical, in rad, above 0 to the right.
fn lower_and_upper_lean(stem: &Polyline) -> [f64; 2] {
    // The ends of the thirds.
    let points = stem.resampled(4).0;
    let lean = |from: Point, to: Point| math::atan2(to.x - from.x, to.y - from.y);
    [lean(points[0], points[1]), lean(points[2], points[3])]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lamps::Light;
    use crate::observation::Depth;

    fn sensed(state: &mut SensorState, x: f64, y: f64) -> Vec<f64> {
        let mut inputs = Vec::new();
        state.sense(&Observation::simulated(Point::new(x, y)), &mut inputs);
        inputs
    }

    #[test]
    fn inputs_are_what_the_sensors_say() {
        let sensors = Sensors::new(vec![
            Sensor::Tip,
            Sensor::ToTarget { ahead: 0 },
            Sensor::ToTarget { ahead: 1 },
            Sensor::LastShift,
            Sensor::LightMemory { steps: 2 },
        ])
        .unwrap();
        let targets = vec![Point::new(3.0, 6.0), Point::new(-5.0, 9.0)];
        let task = Task { targets, ..Task::default() };
        let mut state = SensorState::new(&sensors, &task, &Layout::default());
        assert_eq!(sensed(&mut state, 0.0, 4.0), [0.0, 4.0, 3.0, 2.0, -5.0, 5.0, 0.0, 0.0, 0.0]);
        state.remember(Light::RIGHT);
        assert_eq!(sensed(&mut state, 1.0, 7.0), [1.0, 7.0, -6.0, 2.0, -6.0, 2.0, 1.0, 3.0, 0.5]);
        state.remember(Light::LEFT);
        assert_eq!(sensed(&mut state, 1.0, 10.0)[8], -0.25);
    }

    #[test]
    fn a_stem_is_resampled_and_absent_where_none_was_seen() {
        let sensors = Sensors::new(vec![Sensor::Stem { points: 3 }]).unwrap();
        let mut state = SensorState::new(&sensors, &Task::open_loop(1000), &Layout::default());
        let stem = Polyline(vec![Point::new(0.0, 0.0), Point::new(0.0, 4.0)]);
        let seen = Observation { stem: Some(stem), ..Observation::simulated(Point::new(0.0, 4.0)) };
        let mut inputs = Vec::new();
        state.sense(&seen, &mut inputs);
        assert_eq!(inputs, [0.0, 0.0, 0.0, 2.0, 0.0, 4.0]);
        assert_eq!(sensed(&mut state, 0.0, 4.0), [0.0; 6]);
    }

    /// What `sensors` give for a stem through `points` from the root upwards, and for the same without a stem.
    fn of_stem(sensors: &[Sensor], task: &Task, points: &[(f64, f64)]) -> [Vec<f64>; 2] {
        let sensors = Sensors::new(sensors.to_vec()).unwrap();
        let points: Vec<Point> = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
        let bare = Observation::simulated(points[points.len() - 1]);
        let seen = Observation { stem: Some(Polyline(points)), ..bare.clone() };
        [seen, bare].map(|seen| {
            let mut inputs = Vec::new();
            SensorState::new(&sensors, task, &Layout::default()).sense(&seen, &mut inputs);
            assert_eq!(inputs.len(), sensors.inputs());
            inputs
        })
    }

    #[test]
    fn lean_and_curvature_are_those_of_a_bow() {
        // A quarter of a circle of 6 cm radius, to the right.
        let angles = (0..=90).map(|degrees| f64::from(degrees).to_radians());
        let bow: Vec<(f64, f64)> =
            angles.map(|at| (6.0 - 6.0 * math::cos(at), 6.0 * math::sin(at))).collect();
        let [felt, bare] = of_stem(&[Sensor::Lean, Sensor::Curvature], &Task::obstacles(), &bow);
        assert!((felt[0] - 75.0_f64.to_radians()).abs() < 0.01, "{felt:?}");
        assert!((felt[1] - 1.0 / 6.0).abs() < 0.001, "{felt:?}");
        assert_eq!(bare, [0.0, 0.0]);
    }

    #[test]
    fn obstacles_are_felt_by_the_stem_and_seen_from_the_tip() {
        // A disc of 1 cm at (0, 8).
        let (task, sensors) = (Task::obstacles(), [Sensor::Clearance, Sensor::ObstacleAhead]);
        let [felt, bare] = of_stem(&sensors, &task, &[(0.0, 0.0), (0.0, 4.0)]);
        assert_eq!(felt, [3.0, 0.0, 0.0, 3.0], "straight above");
        assert_eq!(bare, [10.0, 0.0, 0.0, 3.0], "without a stem the tip alone is known");
        let [felt, _] = of_stem(&sensors, &task, &[(-3.0, 0.0), (-3.0, 12.0)]);
        assert_eq!(felt, [2.0, 1.0, 0.0, 10.0], "to the right of the stem, below the tip");
        let [felt, _] = of_stem(&sensors, &task, &[(30.0, 0.0), (30.0, 4.0)]);
        assert_eq!(felt, [10.0, 0.0, 0.0, 10.0], "far away");
        let none = Task { obstacles: Vec::new(), ..task };
        assert_eq!(of_stem(&sensors, &none, &[(0.0, 0.0), (0.0, 4.0)])[0], [10.0, 0.0, 0.0, 10.0]);
    }

    proptest! {
        #[test]
        fn sideways_inputs_change_their_sign_in_a_mirror(
            middles in prop::collection::vec((-4.0..4.0, 2.0..10.0), 1..6),
            centre in (-4.0..4.0, 5.0..11.0),
        ) {
            let sensors = [Sensor::Lean, Sensor::Curvature, Sensor::Clearance, Sensor::ObstacleAhead];
            let at = |sign: f64| {
                let task = Task {
                    obstacles: vec![Obstacle::Disc { centre: Point::new(sign * centre.0, centre.1), radius_cm: 1.0 }],
                    ..Task::obstacles()
                };
                let stem: Vec<(f64, f64)> =
                    std::iter::once((0.0, 0.0)).chain(middles.iter().map(|&(x, y)| (sign * x, y))).collect();
                of_stem(&sensors, &task, &stem)[0].clone()
            };
            let (seen, mirrored) = (at(1.0), at(-1.0));
            let signs = [-1.0, -1.0, 1.0, -1.0, -1.0, 1.0];
            for ((seen, mirrored), sign) in seen.iter().zip(&mirrored).zip(signs) {
                prop_assert!((seen - sign * mirrored).abs() < 1e-9, "{seen} {mirrored}");
            }
        }
    }

    #[test]
    fn depth_is_felt_and_does_not_change_in_a_mirror() {
        let sensors = Sensors::new(vec![
            Sensor::Depth,
            Sensor::DepthShift,
            Sensor::ToTargetInSpace { ahead: 0 },
            Sensor::ToTargetInSpace { ahead: 1 },
            Sensor::ToTarget { ahead: 0 },
            Sensor::FrontLightMemory { steps: 2 },
        ])
        .unwrap();
        let felt = |sign: f64| {
            let targets = vec![Point::new(2.0 * sign, 8.0), Point::new(-sign, 12.0)];
            let task = Task { targets, depths_cm: vec![1.0, -3.0], ..Task::space() };
            let layout = Layout::four_sides();
            let mut state = SensorState::new(&sensors, &task, &layout);
            let mut sense = |x: f64, z: Option<f64>, light: Light| {
                let depth = z.map(|tip_cm| Depth { tip_cm, stem_cm: Vec::new() });
                let mut inputs = Vec::new();
                state.sense(
                    &Observation { depth, ..Observation::simulated(Point::new(sign * x, 5.0)) },
                    &mut inputs,
                );
                state.remember(if sign < 0.0 { layout.mirrored(light).unwrap() } else { light });
                inputs
            };
            [
                sense(0.0, Some(0.5), Light::FRONT),
                sense(1.0, Some(0.75), Light::RIGHT),
                sense(1.0, None, Light::BACK),
            ]
        };
        let [first, second, unknown] = felt(1.0);
        assert_eq!(first, [0.5, 0.0, 2.0, 3.0, 0.5, -1.0, 7.0, -3.5, 2.0, 3.0, 0.0]);
        assert_eq!(second, [0.75, 0.25, 1.0, 3.0, 0.25, -2.0, 7.0, -3.75, 1.0, 3.0, 0.5]);
        assert_eq!(unknown, [0.0, 0.0, 1.0, 3.0, 1.0, -2.0, 7.0, -3.0, 1.0, 3.0, 0.25]);
        let signs = [1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0];
        for (one, other) in felt(1.0).iter().zip(&felt(-1.0)) {
            let mirrored: Vec<f64> = other.iter().zip(signs).map(|(value, sign)| sign * value).collect();
            assert_eq!(*one, mirrored);
        }
    }

    #[test]
    fn a_drawn_line_is_felt_from_tip_and_stem() {
        let sensors = Sensors::new(vec![Sensor::LineOffset]).unwrap();
        let felt = |sign: f64, stem: Option<[(f64, f64); 2]>| {
            let line = [(0.0, 0.0), (0.0, 4.0), (4.0, 8.0)].map(|(x, y)| Point::new(sign * x, y)).to_vec();
            let task = Task { line, ..Task::shape() };
            let stem = stem.map(|stem| Polyline(stem.map(|(x, y)| Point::new(sign * x, y)).to_vec()));
            let mut inputs = Vec::new();
            let seen = Observation { stem, ..Observation::simulated(Point::new(sign, 6.0)) };
            SensorState::new(&sensors, &task, &Layout::default()).sense(&seen, &mut inputs);
            inputs
        };
        // At 6 cm the line is at x = 2; the lower half of this stem stands on it.
        assert_eq!(felt(1.0, None), [1.0, 1.0]);
        let beside = felt(1.0, Some([(1.0, 0.0), (1.0, 4.0)]));
        assert!((beside[0] - 1.0).abs() < 1e-12 && (beside[1] + 1.0).abs() < 1e-12, "{beside:?}");
        let mirrored = felt(-1.0, Some([(1.0, 0.0), (1.0, 4.0)]));
        assert!((mirrored[0] + 1.0).abs() < 1e-12 && (mirrored[1] - 1.0).abs() < 1e-12, "{mirrored:?}");
        assert_eq!((x_at(&[], 3.0), x_at(&[Point::new(1.0, 2.0)], 9.0)), (None, Some(1.0)));
    }

    #[test]
    fn sensors_are_readable_and_checked() {
        let felt = r#"["depth","depth_shift",{"to_target_in_space":{"ahead":0}},{"front_light_memory":{"steps":7}},"line_offset"]"#;
        let sensors: Sensors = serde_json::from_str(felt).unwrap();
        assert_eq!((serde_json::to_string(&sensors).unwrap().as_str(), sensors.inputs()), (felt, 8));
        let text =
            r#"["tip",{"to_target":{"ahead":1}},{"light_memory":{"steps":7}},"clearance","obstacle_ahead"]"#;
        let sensors: Sensors = serde_json::from_str(text).unwrap();
        assert_eq!(serde_json::to_string(&sensors).unwrap(), text);
        let error = |text| serde_json::from_str::<Sensors>(text).unwrap_err().to_string();
        assert!(error("[]").contains("found 0 sensors"));
        assert!(error(r#"[{"light_memory":{"steps":0}}]"#).contains("steps = 0"));
        assert!(error(r#"[{"front_light_memory":{"steps":0}}]"#).contains("front_light_memory"));
    }
}
