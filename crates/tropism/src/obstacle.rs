//! Obstacles: discs, boxes and lines in the plane of the plant, and poles in space.
//!
//! A task has obstacles in its plane, which a stem must not touch. The virtual tent also has poles, on which a stem leans.
//! Distances are signed: above 0 outside, below 0 inside.
//!
//! # References
//! Hart 1996, doi:10.1007/s003710050084 (signed distances; how far a line can be followed without meeting anything).

pub(crate) mod lanes;

use serde::{Deserialize, Serialize};

use crate::check::{OutOfRange, ensure};
use crate::geometry::space::SpacePoint;
use crate::geometry::{Point, Polyline, path};
use crate::math;

/// Distance of the points of a stem that are compared with a box, in cm. Chosen: the error is at most half of it, and that
/// of a measured tip is 0.05 cm.
const SPACING_CM: f64 = 0.1;

/// One obstacle.
///
/// ```
/// use tropism::geometry::Point;
/// use tropism::obstacle::Obstacle;
/// let disc: Obstacle = serde_json::from_str(r#"{"disc": [0, 8], "radius_cm": 1}"#)?;
/// assert_eq!(disc.distance(Point::new(3.0, 8.0)), 2.0);
/// let bar: Obstacle = serde_json::from_str(r#"{"line": [[0, 6.5], [8, 6.5]]}"#)?;
/// assert_eq!(bar.distance(Point::new(4.0, 5.0)), 1.5);
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys", into = "Keys")]
pub enum Obstacle {
    /// A disc, such as a rod seen from its end.
    Disc {
        /// Its centre, in cm.
        centre: Point,
        /// Its radius, in cm.
        radius_cm: f64,
    },
    /// A box with sides along x and y.
    Box {
        /// Two opposite corners, in cm.
        corners: [Point; 2],
    },
    /// A thin straight bar.
    Line {
        /// Its ends, in cm.
        ends: [Point; 2],
    },
}

/// An upright round pole that stands in the soil.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pole {
    /// Its axis: x to the right, z towards the camera, from the base of the plant, in cm.
    pub at: [f64; 2],
    /// Its radius, in cm.
    pub radius_cm: f64,
    /// Its height above the soil, in cm; infinite for a pole that leaves the tent.
    pub height_cm: f64,
}

/// A solid thing in the tent, through which no stem passes.
///
/// ```
/// use tropism::obstacle::{Pole, Solid};
/// let pole: Solid = serde_json::from_str(r#"{"pole": [2, 0], "radius_cm": 0.4, "height_cm": 30}"#)?;
/// assert_eq!(pole, Solid::Pole(Pole { at: [2.0, 0.0], radius_cm: 0.4, height_cm: 30.0 }));
/// let disc: Solid = serde_json::from_str(r#"{"disc": [0, 8], "radius_cm": 1}"#)?;
/// assert!(matches!(disc, Solid::Plane(_)));
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Keys", into = "Keys")]
pub enum Solid {
    /// An obstacle of the plane: a rod or a sheet that points at the front camera, so that the camera sees its end.
    Plane(Obstacle),
    /// A pole.
    Pole(Pole),
}

/// The keys of all kinds, so that an error names a wrong one.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    disc: Option<Point>,
    /// x and z of a pole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pole: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius_cm: Option<f64>,
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    corners: Option<[Point; 2]>,
    #[serde(default, rename = "line", skip_serializing_if = "Option::is_none")]
    ends: Option<[Point; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    height_cm: Option<f64>,
}

impl TryFrom<Keys> for Obstacle {
    type Error = &'static str;

    fn try_from(keys: Keys) -> Result<Self, &'static str> {
        match keys {
            Keys { pole: Some(_), .. } | Keys { height_cm: Some(_), .. } => {
                Err("an obstacle of a task lies in its plane, and a pole does not: wanted disc, box or line")
            }
            Keys { disc: Some(centre), radius_cm: Some(radius_cm), corners: None, ends: None, .. } => {
                Ok(Self::Disc { centre, radius_cm })
            }
            Keys { disc: None, radius_cm: None, corners: Some(corners), ends: None, .. } => {
                Ok(Self::Box { corners })
            }
            Keys { disc: None, radius_cm: None, corners: None, ends: Some(ends), .. } => {
                Ok(Self::Line { ends })
            }
            _ => Err("an obstacle is { disc = [x, y], radius_cm = r }, { box = [[x, y], [x, y]] } or \
                      { line = [[x, y], [x, y]] }"),
        }
    }
}

impl TryFrom<Keys> for Solid {
    type Error = &'static str;

    fn try_from(keys: Keys) -> Result<Self, &'static str> {
        let Some(at) = keys.pole else { return Obstacle::try_from(keys).map(Self::Plane) };
        match keys {
            Keys { radius_cm: Some(radius_cm), height_cm, disc: None, corners: None, ends: None, .. } => {
                Ok(Self::Pole(Pole { at, radius_cm, height_cm: height_cm.unwrap_or(f64::INFINITY) }))
            }
            _ => Err(
                "a pole is { pole = [x, z], radius_cm = r, height_cm = h }; without a height it leaves the tent",
            ),
        }
    }
}

impl From<Solid> for Keys {
    fn from(solid: Solid) -> Self {
        match solid {
            Solid::Plane(obstacle) => obstacle.into(),
            Solid::Pole(Pole { at, radius_cm, height_cm }) => Self {
                pole: Some(at),
                radius_cm: Some(radius_cm),
                height_cm: Some(height_cm).filter(|height| height.is_finite()),
                ..Self::default()
            },
        }
    }
}

impl From<Obstacle> for Solid {
    fn from(obstacle: Obstacle) -> Self {
        Self::Plane(obstacle)
    }
}

impl From<Pole> for Solid {
    fn from(pole: Pole) -> Self {
        Self::Pole(pole)
    }
}

impl Pole {
    /// Horizontal distance of a point from the pole's surface, in cm; below 0 inside. The pole's height does not count.
    #[must_use]
    pub fn distance(&self, point: SpacePoint) -> f64 {
        math::hypot(point[0] - self.at[0], point[2] - self.at[1]) - self.radius_cm
    }

    /// Checks that values are finite and in range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { at, radius_cm, height_cm } = *self;
        ensure(at.iter().all(|axis| axis.is_finite()), "pole", format!("{at:?}"), "finite numbers of cm")?;
        ensure(radius_cm > 0.0 && radius_cm.is_finite(), "radius_cm", radius_cm, "cm above 0")?;
        ensure(height_cm > 0.0, "height_cm", height_cm, "cm above 0")
    }
}

impl Solid {
    /// Checks that values are finite and in range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Plane(obstacle) => obstacle.check(),
            Self::Pole(pole) => pole.check(),
        }
    }

    /// The same solid in a mirror: x changes sign.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Plane(obstacle) => Self::Plane(obstacle.mirrored()),
            Self::Pole(Pole { at: [x, z], radius_cm, height_cm }) => {
                Self::Pole(Pole { at: [-x, z], radius_cm, height_cm })
            }
        }
    }
}

impl From<Obstacle> for Keys {
    fn from(obstacle: Obstacle) -> Self {
        let none = Self::default();
        match obstacle {
            Obstacle::Disc { centre, radius_cm } => {
                Self { disc: Some(centre), radius_cm: Some(radius_cm), ..none }
            }
            Obstacle::Box { corners } => Self { corners: Some(corners), ..none },
            Obstacle::Line { ends } => Self { ends: Some(ends), ..none },
        }
    }
}

/// Where a stem is nearest to obstacles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Distance from the midline of the stem to the obstacle, in cm; below 0 if it passes through.
    pub distance_cm: f64,
    /// The point of the stem, in cm.
    pub stem: Point,
    /// The point of the obstacle that it keeps away from, in cm: of a disc the centre, of a box or a line the nearest one.
    pub obstacle: Point,
}

impl Obstacle {
    /// Checks that values are finite and in range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let are_finite = |key, points: [Point; 2]| {
            let found = format!("{:?}", points.map(<[f64; 2]>::from));
            ensure(points.iter().all(|point| point.is_finite()), key, found, "finite numbers of cm")
        };
        match *self {
            Self::Disc { centre, radius_cm } => {
                are_finite("disc", [centre; 2])?;
                ensure(radius_cm > 0.0 && radius_cm.is_finite(), "radius_cm", radius_cm, "cm above 0")
            }
            Self::Box { corners } => are_finite("box", corners),
            Self::Line { ends } => are_finite("line", ends),
        }
    }

    /// The lower left and the upper right corner of the rectangle that holds it, in cm.
    #[must_use]
    pub fn extent(&self) -> (Point, Point) {
        let (points, by) = match *self {
            Self::Disc { centre, radius_cm } => ([centre; 2], radius_cm),
            Self::Box { corners: points } | Self::Line { ends: points } => (points, 0.0),
        };
        let [one, other] = points;
        (
            Point::new(one.x.min(other.x) - by, one.y.min(other.y) - by),
            Point::new(one.x.max(other.x) + by, one.y.max(other.y) + by),
        )
    }

    /// The same obstacle in a mirror: x changes sign.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Disc { centre, radius_cm } => Self::Disc { centre: centre.mirrored(), radius_cm },
            Self::Box { corners } => Self::Box { corners: corners.map(Point::mirrored) },
            Self::Line { ends } => Self::Line { ends: ends.map(Point::mirrored) },
        }
    }

    /// Distance from `point` to the obstacle, in cm; below 0 inside.
    #[must_use]
    pub fn distance(&self, point: Point) -> f64 {
        match *self {
            Self::Disc { centre, radius_cm } => point.distance(centre) - radius_cm,
            Self::Line { .. } => point.distance(self.nearest(point)),
            Self::Box { corners: [one, other] } => {
                // How far outside of each pair of sides; below 0 between them.
                let outside = |value: f64, a: f64, b: f64| (a.min(b) - value).max(value - a.max(b));
                let (x, y) = (outside(point.x, one.x, other.x), outside(point.y, one.y, other.y));
                if x.max(y) < 0.0 { x.max(y) } else { point.distance(self.nearest(point)) }
            }
        }
    }

    /// Distance from `point` to the obstacle, as [`Self::distance`] to 1e-12 cm, and the direction in which it grows.
    #[must_use]
    pub fn distance_and_normal(&self, point: Point) -> (f64, [f64; 2]) {
        if let Self::Box { corners: [one, other] } = *self {
            // Inside, the nearest side decides.
            let outside = |value: f64, a: f64, b: f64| {
                let (low, high) = (a.min(b) - value, value - a.max(b));
                if low > high { (low, -1.0) } else { (high, 1.0) }
            };
            let ((x, left), (y, down)) = (outside(point.x, one.x, other.x), outside(point.y, one.y, other.y));
            if x.max(y) < 0.0 {
                return if x > y { (x, [left, 0.0]) } else { (y, [0.0, down]) };
            }
        }
        let (from, radius) = match *self {
            Self::Disc { centre, radius_cm } => (centre, radius_cm),
            _ => (self.nearest(point), 0.0),
        };
        let away = [point.x - from.x, point.y - from.y];
        let length = math::vector::norm(away);
        let normal = if length > 0.0 {
            away.map(|axis| axis / length)
        } else if let Self::Line { ends: [from, to] } = *self {
            // On the line itself either side will do.
            math::vector::normalize_or([to.y - from.y, from.x - to.x], [0.0, 1.0])
        } else {
            [0.0, 1.0]
        };
        (length - radius, normal)
    }

    /// The point from which a stem at `point` keeps away: see [`Clearance::obstacle`].
    fn nearest(&self, point: Point) -> Point {
        match *self {
            Self::Disc { centre, .. } => centre,
            Self::Box { corners: [one, other] } => Point::new(
                point.x.clamp(one.x.min(other.x), one.x.max(other.x)),
                point.y.clamp(one.y.min(other.y), one.y.max(other.y)),
            ),
            Self::Line { ends: [from, to] } => from.lerp(to, share_nearest(from, to, point)),
        }
    }

    /// Calls `look` with points of the segment from `from` to `to`, the nearest to the obstacle among them; of a box, to half
    /// of [`SPACING_CM`].
    fn for_nearest_of(&self, [from, to]: [Point; 2], mut look: impl FnMut(Point)) {
        match *self {
            Self::Disc { centre, .. } => look(from.lerp(to, share_nearest(from, to, centre))),
            Self::Line { ends } => {
                // Two straight lines are nearest to each other at an end of one of them, or where they cross.
                let crossing = share_crossing([from, to], ends).map(|share| share.clamp(0.0, 1.0));
                let [first, last] = ends.map(|end| share_nearest(from, to, end));
                [0.0, 1.0, first, last]
                    .into_iter()
                    .chain(crossing)
                    .for_each(|share| look(from.lerp(to, share)));
            }
            Self::Box { .. } => {
                let count = (from.distance(to) / SPACING_CM).ceil().max(1.0);
                (0..=count as u32).for_each(|step| look(from.lerp(to, f64::from(step) / count)));
            }
        }
    }
}

/// [`path::share_nearest`] in the plane.
fn share_nearest(from: Point, to: Point, point: Point) -> f64 {
    path::share_nearest(from.into(), to.into(), point.into())
}

/// At which share of the way from `from` to `to` it crosses the straight line through `ends`: on the way or beyond it. `None`
/// if they are parallel.
pub(crate) fn share_crossing([from, to]: [Point; 2], ends: [Point; 2]) -> Option<f64> {
    let side = |point: Point| {
        (ends[1].x - ends[0].x) * (point.y - ends[0].y) - (ends[1].y - ends[0].y) * (point.x - ends[0].x)
    };
    let (before, after) = (side(from), side(to));
    (before != after).then(|| before / (before - after))
}

/// Bound of the rounding error of a distance, in cm. Chosen: far above the spacing of `f64` at 100 cm, 1.4e-14.
const ROUNDING_CM: f64 = 1e-9;

/// Where `stem` is nearest to any of `obstacles`; `None` without obstacles, or without a stem of two points.
#[must_use]
pub fn clearance(obstacles: &[Obstacle], stem: &Polyline) -> Option<Clearance> {
    clearance_within(f64::INFINITY, obstacles, stem)
}

/// As [`clearance`]; `None`, too, where no part of the stem is nearer than `limit_cm`, which is found sooner.
pub(crate) fn clearance_within(limit_cm: f64, obstacles: &[Obstacle], stem: &Polyline) -> Option<Clearance> {
    let mut nearest: Option<Clearance> = None;
    let mut bound = limit_cm + ROUNDING_CM;
    for pair in stem.0.windows(2) {
        let (middle, half) = (pair[0].lerp(pair[1], 0.5), 0.5 * pair[0].distance(pair[1]));
        for obstacle in obstacles {
            // No point of the segment is nearer than its middle by more than half its length.
            if obstacle.distance(middle) - half > bound {
                continue;
            }
            obstacle.for_nearest_of([pair[0], pair[1]], |point| {
                let distance_cm = obstacle.distance(point);
                if nearest.is_none_or(|nearest| distance_cm < nearest.distance_cm) {
                    nearest = Some(Clearance { distance_cm, stem: point, obstacle: obstacle.nearest(point) });
                    bound = bound.min(distance_cm + ROUNDING_CM);
                }
            });
        }
    }
    nearest.filter(|nearest| nearest.distance_cm < limit_cm)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Point> {
        (-8.0..8.0, 0.0..15.0).prop_map(|(x, y)| Point::new(x, y))
    }

    fn obstacle() -> impl Strategy<Value = Obstacle> {
        prop_oneof![
            (point(), 0.1..3.0).prop_map(|(centre, radius_cm)| Obstacle::Disc { centre, radius_cm }),
            [point(), point()].prop_map(|corners| Obstacle::Box { corners }),
            [point(), point()].prop_map(|ends| Obstacle::Line { ends }),
        ]
    }

    #[test]
    fn inside_of_a_box_the_distance_is_negative() {
        let shape = Obstacle::Box { corners: [Point::new(2.0, 7.0), Point::new(0.0, 6.0)] };
        assert_eq!(shape.distance(Point::new(1.0, 6.25)), -0.25);
        assert_eq!(shape.distance(Point::new(5.0, 11.0)), 5.0);
        shape.check().unwrap();
    }

    #[test]
    fn flat_obstacles_are_refused() {
        let pole = Pole { at: [1.0, -2.0], radius_cm: 0.3, height_cm: 0.0 };
        let error = Solid::Pole(pole).check().unwrap_err().to_string();
        assert_eq!(error, "found height_cm = 0, wanted cm above 0");
        let flat = Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: 0.0 };
        assert_eq!(flat.check().unwrap_err().to_string(), "found radius_cm = 0, wanted cm above 0");
    }

    proptest! {
        #[test]
        fn the_distance_grows_along_the_normal(obstacle in obstacle(), point in point()) {
            let (distance, [x, y]) = obstacle.distance_and_normal(point);
            prop_assert!((distance - obstacle.distance(point)).abs() < 1e-12);
            prop_assert!((math::hypot(x, y) - 1.0).abs() < 1e-12);
            let ahead = Point::new(point.x + 1e-6 * x, point.y + 1e-6 * y);
            prop_assert!((obstacle.distance(ahead) - distance - 1e-6).abs() < 1e-9);
        }

        #[test]
        fn the_distance_grows_no_faster_than_one_moves(
            obstacle in obstacle(), from in point(), to in point(),
        ) {
            let change = (obstacle.distance(from) - obstacle.distance(to)).abs();
            prop_assert!(change <= from.distance(to) + 1e-9);
            prop_assert_eq!(obstacle.mirrored().distance(from.mirrored()), obstacle.distance(from));
        }

        #[test]
        fn the_clearance_is_the_least_distance(
            obstacles in prop::collection::vec(obstacle(), 1..4),
            stem in prop::collection::vec(point(), 2..8),
        ) {
            let found = clearance(&obstacles, &Polyline(stem.clone())).unwrap();
            for pair in stem.windows(2) {
                for share in 0..=1000 {
                    let point = pair[0].lerp(pair[1], f64::from(share) / 1000.0);
                    for obstacle in &obstacles {
                        let is_box = matches!(obstacle, Obstacle::Box { .. });
                        let error = if is_box { SPACING_CM / 2.0 } else { 1e-9 };
                        prop_assert!(obstacle.distance(point) > found.distance_cm - error);
                    }
                }
            }
        }

        #[test]
        fn a_limit_changes_no_nearer_clearance(
            obstacles in prop::collection::vec(obstacle(), 1..4),
            stem in prop::collection::vec(point(), 2..8),
            limit_cm in -1.0..6.0,
        ) {
            let stem = Polyline(stem);
            let wanted = clearance(&obstacles, &stem).filter(|nearest| nearest.distance_cm < limit_cm);
            prop_assert_eq!(clearance_within(limit_cm, &obstacles, &stem), wanted);
        }
    }
}
