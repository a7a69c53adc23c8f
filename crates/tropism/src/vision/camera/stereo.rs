//! Two cameras at a right angle: tips and midlines in space.
//!
//! In: what a camera in front and one at the side see of the same moment, each in cm of the plane through the root that
//! its photographs are scaled to. Out: places in space. The one idea: what a camera sees lies on a ray through its lens;
//! two rays meet where the thing is, and a ray of one camera is a line in the other's picture, on which the stem's
//! midline crosses it.
//!
//! # References
//! Hartley and Zisserman 2003, *Multiple View Geometry in Computer Vision*, chapters 9 and 12 (epipolar lines,
//! triangulation).

use crate::geometry::{Pixel, Point, Polyline};
use crate::math::vector::{Vec3, along, distance, dot, sub};
use crate::vision::camera::calibration::Calibration;

/// A place in space, in cm: x to the right of the root as the front camera sees it, y up, z towards the front camera.
pub type SpacePoint = Vec3;

/// Where a camera stands that looks straight at the plane its photographs are scaled to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Where it looks at: what the middle of its pictures shows, in cm of its plane.
    pub principal_point: Point,
    /// From there to the lens, in cm.
    pub distance_cm: f64,
}

impl CameraPose {
    /// The stand of a calibrated camera, `distance_cm` from the plane.
    #[must_use]
    pub fn new(calibration: &Calibration, distance_cm: f64) -> Self {
        let middle =
            Pixel::new((calibration.width as f64 - 1.0) / 2.0, (calibration.height as f64 - 1.0) / 2.0);
        Self { principal_point: calibration.point(middle), distance_cm }
    }

    /// Where in its plane it sees a place of its own coordinates.
    fn project(&self, [x, y, z]: SpacePoint) -> Point {
        let nearer = self.distance_cm / (self.distance_cm - z);
        Point::new(
            self.principal_point.x + (x - self.principal_point.x) * nearer,
            self.principal_point.y + (y - self.principal_point.y) * nearer,
        )
    }

    /// The place of its lens, in its own coordinates.
    const fn centre(&self) -> SpacePoint {
        [self.principal_point.x, self.principal_point.y, self.distance_cm]
    }
}

/// Two rays that pass each other by more than this, in cm, show different things.
pub const MAX_RAY_GAP_CM: f64 = 0.3;

/// On which side of the front camera's view the second one stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// It sees the plant from the left: what is nearer to the front camera is further to its right.
    Left,
    /// It sees the plant from the right: what is nearer to the front camera is further to its left.
    Right,
}

impl Side {
    /// A place in the side camera's own coordinates: x to its right, z towards it.
    const fn to_camera(self, [x, y, z]: SpacePoint) -> SpacePoint {
        match self {
            Self::Left => [z, y, -x],
            Self::Right => [-z, y, x],
        }
    }

    /// A place of the side camera's own coordinates in those of space.
    const fn to_space(self, [x, y, z]: SpacePoint) -> SpacePoint {
        match self {
            Self::Left => [-z, y, x],
            Self::Right => [z, y, -x],
        }
    }
}

/// Two cameras that see one plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoPair {
    /// The camera in front.
    pub front: CameraPose,
    /// The camera at the side.
    pub side: CameraPose,
    /// Where that is.
    pub side_from: Side,
}

/// A place in space, and how far the two rays to it pass each other by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangulation {
    /// In the middle between both rays where they are nearest.
    pub point: SpacePoint,
    /// Their distance there, in cm: 0 for perfect cameras that see the same thing.
    pub gap_cm: f64,
}

impl StereoPair {
    /// Where both cameras see a place of space, each in cm of its plane.
    #[must_use]
    pub fn project(&self, place: SpacePoint) -> [Point; 2] {
        [self.front.project(place), self.side.project(self.side_from.to_camera(place))]
    }

    /// The place that the front camera sees at `front` and the side camera at `side`.
    #[must_use]
    pub fn triangulate(&self, front: Point, side: Point) -> Triangulation {
        let from = self.front.centre();
        let other_from = self.side_from.to_space(self.side.centre());
        let ray = sub([front.x, front.y, 0.0], from);
        let other_ray = sub(self.side_from.to_space([side.x, side.y, 0.0]), other_from);
        // Where on both rays the way between them is at a right angle to both; rays at about a right angle never run
        // side by side.
        let between = sub(from, other_from);
        let (a, b, c) = (dot(ray, ray), dot(ray, other_ray), dot(other_ray, other_ray));
        let (d, e) = (dot(ray, between), dot(other_ray, between));
        let across = a * c - b * b;
        let one = along(from, ray, (b * e - c * d) / across);
        let other = along(other_from, other_ray, (a * e - b * d) / across);
        let gap = sub(one, other);
        Triangulation { point: along(other, gap, 0.5), gap_cm: dot(gap, gap).sqrt() }
    }

    /// The stem in space whose midline both cameras see: a place for each vertex of `front` whose ray crosses `side`,
    /// from the base up, and both ends as far as their rays meet within [`MAX_RAY_GAP_CM`]: an end that a leaf hides from one
    /// camera is none.
    ///
    /// Empty if either has fewer than two vertices.
    #[must_use]
    pub fn triangulate_midline(&self, front: &Polyline, side: &Polyline) -> Vec<SpacePoint> {
        let ([first, inner @ .., last], [side_first, .., side_last]) =
            (front.0.as_slice(), side.0.as_slice())
        else {
            return Vec::new();
        };
        let ends = |met: Triangulation| Some(met.point).filter(|_| met.gap_cm <= MAX_RAY_GAP_CM);
        let mut stem: Vec<SpacePoint> = ends(self.triangulate(*first, *side_first)).into_iter().collect();
        let mut reached = 0.0;
        for &vertex in inner {
            // Of several crossings the one nearest to the last: a bent stem may cross a ray twice.
            let off = |(at, _): &(f64, Point)| (at - reached).abs();
            let crossings = self.crossings(vertex, side).into_iter();
            let Some((at, point)) = crossings.min_by(|a, b| off(a).total_cmp(&off(b))) else { continue };
            reached = at;
            stem.push(self.triangulate(vertex, point).point);
        }
        stem.extend(ends(self.triangulate(*last, *side_last)));
        stem
    }

    /// Where the ray through `front` crosses the side camera's midline: vertex and share to the next, and the point.
    fn crossings(&self, front: Point, side: &Polyline) -> Vec<(f64, Point)> {
        let ray = sub([front.x, front.y, 0.0], self.front.centre());
        // Two places of the ray, before and behind the plane, are a line in the side camera's picture.
        let [a, b] = [0.5, 1.5]
            .map(|share| self.side.project(self.side_from.to_camera(along(self.front.centre(), ray, share))));
        let height = |point: Point| (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
        let mut found = Vec::new();
        for (vertex, pair) in side.0.windows(2).enumerate() {
            let (low, high) = (height(pair[0]), height(pair[1]));
            if low == high || low.min(high) > 0.0 || low.max(high) < 0.0 {
                continue;
            }
            let share = low / (low - high);
            found.push((vertex as f64 + share, pair[0].lerp(pair[1], share)));
        }
        found
    }
}

/// Length along places, in cm.
#[must_use]
pub fn length(places: &[SpacePoint]) -> f64 {
    places.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// `count` places at equal distances along the line through `places`, both ends kept; fewer than two are returned as they
/// are.
#[must_use]
pub fn resampled(places: &[SpacePoint], count: usize) -> Vec<SpacePoint> {
    let total = length(places);
    if places.len() < 2 || count < 2 || total == 0.0 {
        return places.to_vec();
    }
    let mut walked = 0.0;
    let mut found = vec![places[0]];
    for pair in places.windows(2) {
        let step = distance(pair[0], pair[1]);
        while found.len() + 1 < count && step > 0.0 {
            let wanted = total * found.len() as f64 / (count - 1) as f64;
            if wanted > walked + step {
                break;
            }
            found.push(along(pair[0], sub(pair[1], pair[0]), (wanted - walked) / step));
        }
        walked += step;
    }
    found.push(places[places.len() - 1]);
    found
}

#[cfg(test)]
mod tests {
    use super::*;
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
        fn rays_meet_where_the_thing_is(
            x in -12.0..12.0, y in 0.0..30.0, z in -12.0..12.0, from in sides(), off in -0.3..0.3
        ) {
            let views = views(from);
            let [front, side] = views.project([x, y, z]);
            let met = views.triangulate(front, side);
            prop_assert!(distance(met.point, [x, y, z]) < 1e-9 && met.gap_cm < 1e-9, "{met:?}");
            // A height that is read wrong by one of them is a gap of about that, and half of it in the place.
            let off_met = views.triangulate(front, Point::new(side.x, side.y + off));
            let magnified = 1.35 * f64::abs(off) + 1e-9;
            prop_assert!(off_met.gap_cm <= magnified && distance(off_met.point, [x, y, z]) <= magnified);
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
            let seen = |which: usize| Polyline(stem.iter().map(|place| views.project(*place)[which]).collect());
            // The cameras' midlines do not share vertices.
            let found = views.triangulate_midline(&seen(0).resampled(90), &seen(1).resampled(70));
            prop_assert!((length(&found) - length(&stem)).abs() < 0.03 * length(&stem));
            for place in &found {
                let nearest = stem.iter().map(|truth| distance(*truth, *place)).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest < 0.2, "{place:?} is {nearest} cm off");
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
            Polyline(stem[..count].iter().map(|place| views.project(*place)[which]).collect())
        };
        let whole = views.triangulate_midline(&seen(0, 21), &seen(1, 21));
        let hidden = views.triangulate_midline(&seen(0, 21), &seen(1, 15));
        assert!(distance(whole[whole.len() - 1], stem[20]) < 1e-9);
        assert!(distance(hidden[hidden.len() - 1], stem[14]) < 0.6, "{hidden:?}");
    }

    #[test]
    fn a_stand_looks_at_the_middle_of_its_pictures() {
        let calibration = Calibration::from_scale(Pixel::new(320.5, 400.5), 10.0, 640, 480);
        let stand = CameraPose::new(&calibration, 74.0);
        assert_eq!(stand, CameraPose { principal_point: Point::new(-0.1, 16.1), distance_cm: 74.0 });
    }

    #[test]
    fn short_lines_give_nothing() {
        let line = |count: usize| Polyline((0..count).map(|i| Point::new(0.0, i as f64)).collect());
        assert_eq!(views(Side::Right).triangulate_midline(&line(1), &line(5)), Vec::<SpacePoint>::new());
        assert_eq!(views(Side::Right).triangulate_midline(&line(5), &line(0)), Vec::<SpacePoint>::new());
        assert_eq!(resampled(&[[1.0; 3]], 10), [[1.0; 3]]);
        assert_eq!(resampled(&[[1.0; 3]; 4], 10).len(), 4);
    }
}
