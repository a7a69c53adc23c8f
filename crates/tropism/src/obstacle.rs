//! Things that a stem must not touch: discs, boxes and lines in the plane of the plant.
//!
//! Distances are signed: above 0 outside, below 0 inside.
//!
//! # References
//! Hart 1996, doi:10.1007/s003710050084 (signed distances; how far a line can be followed without meeting anything).

use serde::{Deserialize, Serialize};

use crate::check::{OutOfRange, ensure};
use crate::geometry::{Point, Polyline};

/// Distance of the points at which a stem is held against an obstacle, in cm. A point between two of them is nearer by
/// 0.013 cm at most for a disc of 1 mm, less for larger ones.
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

/// The keys of all kinds, so that a wrong one is told by name.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    disc: Option<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius_cm: Option<f64>,
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    corners: Option<[Point; 2]>,
    #[serde(default, rename = "line", skip_serializing_if = "Option::is_none")]
    ends: Option<[Point; 2]>,
}

impl TryFrom<Keys> for Obstacle {
    type Error = &'static str;

    fn try_from(keys: Keys) -> Result<Self, &'static str> {
        match keys {
            Keys { disc: Some(centre), radius_cm: Some(radius_cm), corners: None, ends: None } => {
                Ok(Self::Disc { centre, radius_cm })
            }
            Keys { disc: None, radius_cm: None, corners: Some(corners), ends: None } => {
                Ok(Self::Box { corners })
            }
            Keys { disc: None, radius_cm: None, corners: None, ends: Some(ends) } => Ok(Self::Line { ends }),
            _ => Err("an obstacle is { disc = [x, y], radius_cm = r }, { box = [[x, y], [x, y]] } or \
                      { line = [[x, y], [x, y]] }"),
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
    /// Checks what a file may have got wrong.
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

    /// The point from which a stem at `point` keeps away: see [`Clearance::obstacle`].
    fn nearest(&self, point: Point) -> Point {
        match *self {
            Self::Disc { centre, .. } => centre,
            Self::Box { corners: [one, other] } => Point::new(
                point.x.clamp(one.x.min(other.x), one.x.max(other.x)),
                point.y.clamp(one.y.min(other.y), one.y.max(other.y)),
            ),
            Self::Line { ends: [from, to] } => {
                let (dx, dy) = (to.x - from.x, to.y - from.y);
                let square = dx * dx + dy * dy;
                let along = (point.x - from.x) * dx + (point.y - from.y) * dy;
                let share = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
                from.lerp(to, share)
            }
        }
    }
}

/// Where `stem` is nearest to any of `obstacles`; `None` without obstacles, or without a stem of two points.
#[must_use]
pub fn clearance(obstacles: &[Obstacle], stem: &Polyline) -> Option<Clearance> {
    let mut nearest: Option<Clearance> = None;
    for pair in stem.0.windows(2) {
        let length = pair[0].distance(pair[1]);
        for obstacle in obstacles {
            // No point of the segment is nearer than its middle by more than half its length.
            let least = obstacle.distance(pair[0].lerp(pair[1], 0.5)) - 0.5 * length;
            if nearest.is_some_and(|nearest| least >= nearest.distance_cm) {
                continue;
            }
            let count = (length / SPACING_CM).ceil().max(1.0);
            for step in 0..=count as u32 {
                let point = pair[0].lerp(pair[1], f64::from(step) / count);
                let distance_cm = obstacle.distance(point);
                if nearest.is_none_or(|nearest| distance_cm < nearest.distance_cm) {
                    nearest = Some(Clearance { distance_cm, stem: point, obstacle: obstacle.nearest(point) });
                }
            }
        }
    }
    nearest
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
    fn what_is_no_obstacle_is_refused() {
        let error = |text| toml::from_str::<Obstacle>(text).unwrap_err().to_string();
        assert!(error("disc = [0, 8]").contains("radius_cm = r"));
        assert!(error("disk = [0, 8]").contains("disk"));
        let flat = Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: 0.0 };
        assert_eq!(flat.check().unwrap_err().to_string(), "found radius_cm = 0, wanted cm above 0");
    }

    proptest! {
        #[test]
        fn obstacles_come_back_from_files(obstacle in obstacle()) {
            let text = toml::to_string(&obstacle).unwrap();
            prop_assert_eq!(toml::from_str::<Obstacle>(&text).unwrap(), obstacle);
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
                        prop_assert!(obstacle.distance(point) > found.distance_cm - SPACING_CM / 2.0);
                    }
                }
            }
        }
    }
}
