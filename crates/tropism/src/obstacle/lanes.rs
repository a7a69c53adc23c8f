//! Where stems are nearest to obstacles, one stem a vector lane: the fast twin of [`clearance`](super::clearance), with the
//! same bits for coordinates of plants (no two of them differ by less than 1e-100 cm without being equal).
//!
//! A compiler makes vectors of loops over the lanes only where they are long: so each does as much as it can. A box is looked
//! at in many points, and has no form in lanes.

#![allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays at once")]

use super::{Obstacle, ROUNDING_CM};
use crate::geometry::Point;
use crate::math;
use crate::math::interpolate::lerp;
use crate::math::lanes::{LANES, Row, clamped};

/// x and y of a point of each stem, in cm.
pub(crate) type PointRow = [Row; 2];

/// Where each stem is nearest to any obstacle: see [`Clearance`](super::Clearance).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClearanceRow {
    pub(crate) distance_cm: Row,
    /// x of the point of the stem, and of the obstacle.
    pub(crate) stem_x: Row,
    pub(crate) obstacle_x: Row,
    /// The segment of this point: of equally near ones the lowest counts.
    segment: Row,
}

/// Whether [`clearance_of`] knows all of these obstacles.
pub(crate) fn are_known(obstacles: &[Obstacle]) -> bool {
    obstacles.iter().all(|obstacle| !matches!(obstacle, Obstacle::Box { .. }))
}

/// Where each stem of `N` points is nearest to any of `obstacles`, of which there is one at least.
#[inline(always)]
pub(crate) fn clearance_of<const N: usize>(obstacles: &[Obstacle], stems: &[PointRow; N]) -> ClearanceRow {
    // A compiler must know that nothing else stands where is written to.
    let stems = *stems;
    let mut nearest = ClearanceRow::FAR;
    for obstacle in obstacles {
        let mut other = ClearanceRow::FAR;
        match *obstacle {
            Obstacle::Disc { centre, radius_cm } => other.look_at_disc(centre, radius_cm, &stems),
            Obstacle::Line { ends } | Obstacle::Box { corners: ends } => other.look_at_line(ends, &stems),
        }
        for lane in 0..LANES {
            let [before, now] = [&nearest, &other].map(|one| (one.distance_cm[lane], one.segment[lane]));
            let is_nearer = (now.0 < before.0) | ((now.0 == before.0) & (now.1 < before.1));
            let choose = |now: f64, before: f64| if is_nearer { now } else { before };
            nearest.distance_cm[lane] = choose(now.0, before.0);
            nearest.segment[lane] = choose(now.1, before.1);
            nearest.stem_x[lane] = choose(other.stem_x[lane], nearest.stem_x[lane]);
            nearest.obstacle_x[lane] = choose(other.obstacle_x[lane], nearest.obstacle_x[lane]);
        }
    }
    nearest
}

/// [`share_nearest`](super::share_nearest) without branches.
#[inline(always)]
fn share_nearest(from: [f64; 2], to: [f64; 2], point: [f64; 2]) -> f64 {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let square = dx * dx + dy * dy;
    let along = (point[0] - from[0]) * dx + (point[1] - from[1]) * dy;
    let share = clamped(along / square, [0.0, 1.0]);
    if square > 0.0 { share } else { 0.0 }
}

/// [`share_crossing`](super::share_crossing) within the way; 0 where the lines are parallel.
#[inline(always)]
fn share_crossing(from: [f64; 2], to: [f64; 2], ends: [Point; 2]) -> f64 {
    let (dx, dy) = (ends[1].x - ends[0].x, ends[1].y - ends[0].y);
    let before = dx * (from[1] - ends[0].y) - dy * (from[0] - ends[0].x);
    let after = dx * (to[1] - ends[0].y) - dy * (to[0] - ends[0].x);
    let share = clamped(before / (before - after), [0.0, 1.0]);
    if before != after { share } else { 0.0 }
}

impl ClearanceRow {
    const FAR: Self = Self {
        distance_cm: [f64::INFINITY; LANES],
        stem_x: [0.0; LANES],
        obstacle_x: [0.0; LANES],
        segment: [f64::INFINITY; LANES],
    };

    #[inline(always)]
    fn look_at_disc<const N: usize>(&mut self, centre: Point, radius_cm: f64, stems: &[PointRow; N]) {
        self.obstacle_x = [centre.x; LANES];
        for segment in 1..N {
            let [from, to] = [&stems[segment - 1], &stems[segment]];
            for lane in 0..LANES {
                let (start, end) = ([from[0][lane], from[1][lane]], [to[0][lane], to[1][lane]]);
                let share = share_nearest(start, end, [centre.x, centre.y]);
                let (x, y) = (lerp(start[0], end[0], share), lerp(start[1], end[1], share));
                let distance_cm = math::hypot(x - centre.x, y - centre.y) - radius_cm;
                let (distance_before, x_before) = (self.distance_cm[lane], self.stem_x[lane]);
                let segment_before = self.segment[lane];
                let is_nearer = distance_cm < distance_before;
                self.distance_cm[lane] = if is_nearer { distance_cm } else { distance_before };
                self.stem_x[lane] = if is_nearer { x } else { x_before };
                self.segment[lane] = if is_nearer { segment as f64 } else { segment_before };
            }
        }
    }

    /// Segments that are surely farther away than others are left out.
    #[inline(always)]
    fn look_at_line<const N: usize>(&mut self, ends: [Point; 2], stems: &[PointRow; N]) {
        let [first, last] = ends.map(<[f64; 2]>::from);
        let (mut squares, mut reach) = ([[0.0; LANES]; N], [0.0; LANES]);
        for lane in 0..LANES {
            let (mut least, mut longest) = (f64::INFINITY, 0.0);
            for segment in 1..N {
                let [from, to] = [&stems[segment - 1], &stems[segment]];
                let (dx, dy) = (to[0][lane] - from[0][lane], to[1][lane] - from[1][lane]);
                let length = dx * dx + dy * dy;
                longest = if length > longest { length } else { longest };
                let middle = [from[0][lane] + 0.5 * dx, from[1][lane] + 0.5 * dy];
                let share = share_nearest(first, last, middle);
                let x = middle[0] - lerp(first[0], last[0], share);
                let y = middle[1] - lerp(first[1], last[1], share);
                let square = x * x + y * y;
                least = if square < least { square } else { least };
                squares[segment][lane] = square;
            }
            // The nearest point of a stem is not farther away than the middle of a segment, and no point of a segment is
            // nearer than its middle by more than half its length.
            let limit = least.sqrt() + 0.5 * longest.sqrt() + ROUNDING_CM;
            reach[lane] = limit * limit;
        }
        for segment in 1..N {
            let mut is_near = false;
            for lane in 0..LANES {
                is_near |= squares[segment][lane] <= reach[lane];
            }
            if is_near {
                let (way, number) = ([&stems[segment - 1], &stems[segment]], segment as f64);
                self.look_from(ends, way, number, |_, _| 0.0);
                self.look_from(ends, way, number, |_, _| 1.0);
                self.look_from(ends, way, number, |from, to| share_nearest(from, to, first));
                self.look_from(ends, way, number, |from, to| share_nearest(from, to, last));
                self.look_from(ends, way, number, |from, to| share_crossing(from, to, ends));
            }
        }
    }

    /// Looks from the line between `ends` at a point of a segment, at a share of the way.
    #[inline(always)]
    fn look_from(
        &mut self,
        ends: [Point; 2],
        [from, to]: [&PointRow; 2],
        segment: f64,
        share_of: impl Fn([f64; 2], [f64; 2]) -> f64,
    ) {
        let [first, last] = ends.map(<[f64; 2]>::from);
        for lane in 0..LANES {
            let (start, end) = ([from[0][lane], from[1][lane]], [to[0][lane], to[1][lane]]);
            let share = share_of(start, end);
            let (x, y) = (lerp(start[0], end[0], share), lerp(start[1], end[1], share));
            let share = share_nearest(first, last, [x, y]);
            let (near_x, near_y) = (lerp(first[0], last[0], share), lerp(first[1], last[1], share));
            let distance_cm = math::hypot(x - near_x, y - near_y);
            let (distance_before, segment_before) = (self.distance_cm[lane], self.segment[lane]);
            let (x_before, near_before) = (self.stem_x[lane], self.obstacle_x[lane]);
            let is_nearer = distance_cm < distance_before;
            self.distance_cm[lane] = if is_nearer { distance_cm } else { distance_before };
            self.stem_x[lane] = if is_nearer { x } else { x_before };
            self.obstacle_x[lane] = if is_nearer { near_x } else { near_before };
            self.segment[lane] = if is_nearer { segment } else { segment_before };
        }
    }
}
