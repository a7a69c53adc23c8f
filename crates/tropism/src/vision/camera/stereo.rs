//! Stereo of two cameras at a right angle: tips and midlines in space.
//!
//! In: points that a front and a side camera see at the same moment, each in cm of the calibrated plane through the
//! root. Out: points in space. The one idea: a point lies on the ray from the camera's centre through its image; two
//! rays are triangulated by their common perpendicular, and a ray of one camera is an epipolar line in the other's
//! picture, which the stem's midline crosses.
//!
//! # References
//! Hartley and Zisserman 2003, *Multiple View Geometry in Computer Vision*, chapters 9 (epipolar geometry) and 12
//! (triangulation).

use serde::{Deserialize, Serialize};

use crate::geometry::space::SpacePoint;
use crate::geometry::{Pixel, Point, Polyline};
use crate::math;
use crate::math::vector::{along, dot, sub};
use crate::obstacle::{Pole, share_crossing};
use crate::vision::camera::calibration::Calibration;

/// Pose of a camera whose optical axis is perpendicular to its calibrated plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Point of the plane that the centre of its pictures shows, in cm.
    pub principal_point: Point,
    /// Distance from that point to the centre of projection, in cm.
    pub distance_cm: f64,
}

impl CameraPose {
    /// The pose of a calibrated camera at a distance of `distance_cm` from its plane.
    #[must_use]
    pub fn new(calibration: &Calibration, distance_cm: f64) -> Self {
        let centre =
            Pixel::new((calibration.width as f64 - 1.0) / 2.0, (calibration.height as f64 - 1.0) / 2.0);
        Self { principal_point: calibration.point(centre), distance_cm }
    }

    /// Projects a point of camera coordinates onto the plane, in cm.
    fn project(&self, [x, y, z]: SpacePoint) -> Point {
        self.principal_point.lerp(Point::new(x, y), self.distance_cm / (self.distance_cm - z))
    }

    /// The point of the plane `z` cm nearer to the camera that it sees at `point` of its own plane, in cm.
    #[must_use]
    pub fn at_depth(&self, point: Point, z: f64) -> Point {
        self.principal_point.lerp(point, (self.distance_cm - z) / self.distance_cm)
    }

    /// Silhouette of an upright pole, in cm of the plane. `pole` is in camera coordinates. The edges are upright lines, because
    /// the planes through the camera that touch an upright cylinder are upright.
    #[must_use]
    pub fn silhouette(&self, pole: Pole) -> Strip {
        let ([x, z], radius) = (pole.at, pole.radius_cm);
        let (aside, ahead) = (x - self.principal_point.x, self.distance_cm - z);
        // From the camera to where the planes touch the cylinder.
        let tangent = (aside * aside + ahead * ahead - radius * radius).max(0.0).sqrt();
        let half = math::atan2(radius, tangent);
        let direction = math::atan2(aside, ahead);
        let edge = |angle: f64| self.principal_point.x + self.distance_cm * math::tan(angle);
        // The end of the pole is a circle: its front or its back is the highest point of the silhouette.
        let top = |z: f64| self.project([x, pole.height_cm, z]).y;
        Strip {
            left: edge(direction - half),
            right: edge(direction + half),
            top: top(z - radius).max(top(z + radius)),
        }
    }

    /// The centre of projection, in camera coordinates.
    const fn centre(&self) -> SpacePoint {
        [self.principal_point.x, self.principal_point.y, self.distance_cm]
    }
}

/// Silhouette of an upright pole, in cm of a camera's calibrated plane, unbounded downwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strip {
    /// x of its left edge.
    pub left: f64,
    /// x of its right edge.
    pub right: f64,
    /// y of its upper end.
    pub top: f64,
}

/// Greatest distance between two rays that may show the same point, in cm. Chosen by hand.
pub const MAX_RAY_GAP_CM: f64 = 0.3;

/// Side of the plant on which the second camera stands, as the front camera sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Left: what is nearer to the front camera lies further to the right in its picture.
    Left,
    /// Right: what is nearer to the front camera lies further to the left in its picture.
    #[default]
    Right,
}

impl Side {
    /// The same pole in the side camera's coordinates.
    #[must_use]
    pub const fn pole_to_camera(self, pole: Pole) -> Pole {
        let [x, _, z] = self.to_camera([pole.at[0], 0.0, pole.at[1]]);
        Pole { at: [x, z], ..pole }
    }

    /// Converts a point in space to the side camera's coordinates: x to its right, z towards it.
    const fn to_camera(self, [x, y, z]: SpacePoint) -> SpacePoint {
        match self {
            Self::Left => [z, y, -x],
            Self::Right => [-z, y, x],
        }
    }

    /// Converts a point of the side camera's coordinates to space.
    const fn to_space(self, [x, y, z]: SpacePoint) -> SpacePoint {
        match self {
            Self::Left => [-z, y, x],
            Self::Right => [z, y, -x],
        }
    }
}

/// Two cameras that see one plant at a right angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoPair {
    /// Pose of the camera in front.
    pub front: CameraPose,
    /// Pose of the camera at the side.
    pub side: CameraPose,
    /// Side on which it stands.
    pub side_from: Side,
}

/// A point triangulated from two rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangulation {
    /// Midpoint of the rays' common perpendicular, in cm.
    pub point: SpacePoint,
    /// Length of the common perpendicular, in cm: 0 for perfect cameras that see the same point.
    pub gap_cm: f64,
}

impl StereoPair {
    /// Projects a point in space into both cameras, in cm of their planes: front, then side.
    #[must_use]
    pub fn project(&self, point: SpacePoint) -> [Point; 2] {
        [self.front.project(point), self.side.project(self.side_from.to_camera(point))]
    }

    /// The point that the front camera sees at `point` of its plane, where its depth is `z`, in cm.
    #[must_use]
    pub fn front_at(&self, point: Point, z: f64) -> SpacePoint {
        let Point { x, y } = self.front.at_depth(point, z);
        [x, y, z]
    }

    /// The point that the side camera sees at `point` of its plane, where it is `x` to the right of the stem base, in cm.
    #[must_use]
    pub fn side_at(&self, point: Point, x: f64) -> SpacePoint {
        let towards = self.side_from.to_camera([x, 0.0, 0.0])[2];
        let Point { x, y } = self.side.at_depth(point, towards);
        self.side_from.to_space([x, y, towards])
    }

    /// Triangulates the point that the front camera sees at `front` and the side camera at `side`.
    #[must_use]
    pub fn triangulate(&self, front: Point, side: Point) -> Triangulation {
        let front_centre = self.front.centre();
        let side_centre = self.side_from.to_space(self.side.centre());
        let front_ray = sub([front.x, front.y, 0.0], front_centre);
        let side_ray = sub(self.side_from.to_space([side.x, side.y, 0.0]), side_centre);
        // The ends of the common perpendicular. The determinant is not 0: rays at about a right angle are not
        // parallel.
        let between = sub(front_centre, side_centre);
        let (a, b, c) = (dot(front_ray, front_ray), dot(front_ray, side_ray), dot(side_ray, side_ray));
        let (d, e) = (dot(front_ray, between), dot(side_ray, between));
        let determinant = a * c - b * b;
        let one = along(front_centre, front_ray, (b * e - c * d) / determinant);
        let other = along(side_centre, side_ray, (a * e - b * d) / determinant);
        let gap = sub(one, other);
        Triangulation { point: along(other, gap, 0.5), gap_cm: dot(gap, gap).sqrt() }
    }

    /// Triangulates the stem whose midline both cameras see, from the base up.
    ///
    /// Each inner vertex of `front` whose epipolar line crosses `side` gives a point. The ends are kept where their
    /// rays pass within [`MAX_RAY_GAP_CM`]: an end that a leaf hides from one camera is left out. Empty if either
    /// line has fewer than two vertices.
    #[must_use]
    pub fn triangulate_midline(&self, front: &Polyline, side: &Polyline) -> Vec<SpacePoint> {
        let ([first, inner @ .., last], [side_first, .., side_last]) =
            (front.0.as_slice(), side.0.as_slice())
        else {
            return Vec::new();
        };
        let end = |found: Triangulation| Some(found.point).filter(|_| found.gap_cm <= MAX_RAY_GAP_CM);
        let mut stem: Vec<SpacePoint> = end(self.triangulate(*first, *side_first)).into_iter().collect();
        let mut previous = 0.0;
        for &vertex in inner {
            // A bent stem may cross an epipolar line twice: take the crossing nearest to the previous one.
            let distance = |(position, _): &(f64, Point)| (position - previous).abs();
            let crossings = self.crossings(vertex, side).into_iter();
            let Some((position, point)) = crossings.min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
                continue;
            };
            previous = position;
            stem.push(self.triangulate(vertex, point).point);
        }
        stem.extend(end(self.triangulate(*last, *side_last)));
        stem
    }

    /// Crossings of the epipolar line of `front` with the side camera's midline: position (vertex number plus the
    /// fraction to the next vertex), and point.
    fn crossings(&self, front: Point, side: &Polyline) -> Vec<(f64, Point)> {
        let ray = sub([front.x, front.y, 0.0], self.front.centre());
        // The epipolar line goes through the images of two points of the ray, before and behind the plane.
        let [a, b] = [0.5, 1.5]
            .map(|share| self.side.project(self.side_from.to_camera(along(self.front.centre(), ray, share))));
        let pairs = (0..).zip(side.0.windows(2));
        let found = pairs.filter_map(|(vertex, pair)| {
            let pair = [pair[0], pair[1]];
            let share = share_crossing(pair.map(<[f64; 2]>::from), [a, b]);
            if !(0.0..=1.0).contains(&share) {
                return None;
            }
            Some((f64::from(vertex) + share, pair[0].lerp(pair[1], share)))
        });
        found.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::path::{length, resampled};
    use crate::math::vector::distance;
    use crate::math::{cos, sin};
    use proptest::prelude::*;

    fn views(from: Side) -> StereoPair {
        StereoPair {
            front: CameraPose { principal_point: Point::new(0.5, 20.0), distance_cm: 74.0 },
            side: CameraPose { principal_point: Point::new(-1.0, 18.0), distance_cm: 60.0 },
            side_from: from,
        }
    }

    fn sides() -> impl Strategy<Value = Side> {
        prop_oneof![Just(Side::Left), Just(Side::Right)]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn rays_meet_at_the_point(
            x in -12.0..12.0, y in 0.0..30.0, z in -12.0..12.0, from in sides(), error in -0.3..0.3
        ) {
            let views = views(from);
            let [front, side] = views.project([x, y, z]);
            let exact = views.triangulate(front, side);
            prop_assert!(distance(exact.point, [x, y, z]) < 1e-9 && exact.gap_cm < 1e-9, "{exact:?}");
            // An error in one camera's height is a gap of about its size, and an error of half of it in the point.
            let erroneous = views.triangulate(front, Point::new(side.x, side.y + error));
            let most = 1.35 * f64::abs(error) + 1e-9;
            prop_assert!(erroneous.gap_cm <= most && distance(erroneous.point, [x, y, z]) <= most);
        }

        #[test]
        fn the_silhouette_of_a_pole_holds_it_and_no_more(
            x in -12.0..12.0, z in -12.0..12.0, radius in 0.1..2.0, height in 5.0..40.0
        ) {
            let pose = views(Side::Right).front;
            let strip = pose.silhouette(Pole { at: [x, z], radius_cm: radius, height_cm: height });
            let around = (0..720).map(|i| core::f64::consts::PI * f64::from(i) / 360.0);
            let seen: Vec<Point> =
                around.map(|angle| pose.project([x + radius * cos(angle), height, z + radius * sin(angle)])).collect();
            let most = |value: fn(&Point) -> f64| seen.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
            prop_assert!((most(|point| point.x) - strip.right).abs() < 1e-3);
            prop_assert!((most(|point| -point.x) + strip.left).abs() < 1e-3);
            prop_assert!(strip.top >= most(|point| point.y) - 1e-9 && strip.top < most(|point| point.y) + 1e-3);
        }

        #[test]
        fn one_camera_and_a_coordinate_give_the_point(
            x in -12.0..12.0, y in 0.0..30.0, z in -12.0..12.0, from in sides()
        ) {
            let views = views(from);
            let [front, side] = views.project([x, y, z]);
            prop_assert!(distance(views.front_at(front, z), [x, y, z]) < 1e-9);
            prop_assert!(distance(views.side_at(side, x), [x, y, z]) < 1e-9);
        }

        #[test]
        fn a_winding_stem_is_found_again(
            reach in 0.0..3.0, turns in 0.0..1.2, lean_x in -0.4..0.4, lean_z in -0.4..0.4, from in sides()
        ) {
            let views = views(from);
            let stem: Vec<SpacePoint> = (0..=200)
                .map(|i| {
                    let share = f64::from(i) / 200.0;
                    let angle = turns * std::f64::consts::TAU * share;
                    let wide = reach * share * share;
                    [wide * cos(angle) + 15.0 * lean_x * share, 15.0 * share, wide * sin(angle) + 15.0 * lean_z * share]
                })
                .collect();
            let seen = |which: usize| Polyline(stem.iter().map(|point| views.project(*point)[which]).collect());
            // The cameras' midlines do not have the same vertices.
            let found = views.triangulate_midline(&seen(0).resampled(90), &seen(1).resampled(70));
            prop_assert!((length(&found) - length(&stem)).abs() < 0.03 * length(&stem));
            for point in &found {
                let nearest = stem.iter().map(|truth| distance(*truth, *point)).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest < 0.2, "{point:?} is {nearest} cm off");
            }
            let ten = resampled(&found, 10);
            prop_assert_eq!(ten.len(), 10);
            prop_assert!(distance(ten[0], stem[0]) < 1e-6 && distance(ten[9], stem[200]) < 1e-6);
        }
    }

    #[test]
    fn an_end_that_one_camera_does_not_see_is_none() {
        let views = views(Side::Right);
        let stem: Vec<SpacePoint> = (0..=20).map(|i| [0.1 * f64::from(i), 0.5 * f64::from(i), 1.0]).collect();
        let seen = |which: usize, count: usize| {
            Polyline(stem[..count].iter().map(|point| views.project(*point)[which]).collect())
        };
        let whole = views.triangulate_midline(&seen(0, 21), &seen(1, 21));
        let hidden = views.triangulate_midline(&seen(0, 21), &seen(1, 15));
        assert!(distance(whole[whole.len() - 1], stem[20]) < 1e-9);
        assert!(distance(hidden[hidden.len() - 1], stem[14]) < 0.6, "{hidden:?}");
    }

    #[test]
    fn a_camera_looks_at_the_centre_of_its_pictures() {
        let calibration = Calibration::from_scale(Pixel::new(320.5, 400.5), 10.0, 640, 480);
        let pose = CameraPose::new(&calibration, 74.0);
        assert_eq!(pose, CameraPose { principal_point: Point::new(-0.1, 16.1), distance_cm: 74.0 });
    }

    #[test]
    fn short_lines_give_nothing() {
        let line = |count: usize| Polyline((0..count).map(|i| Point::new(0.0, i as f64)).collect());
        assert_eq!(views(Side::Right).triangulate_midline(&line(1), &line(5)), Vec::<SpacePoint>::new());
        assert_eq!(views(Side::Right).triangulate_midline(&line(5), &line(0)), Vec::<SpacePoint>::new());
        assert_eq!(resampled(&[[1.0; 3]], 10), [[1.0; 3]]);
    }
}
