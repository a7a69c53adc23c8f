//! The tip as the paper's detector measures it, computed without a photograph.
//!
//! In: the [`Pose`] of a bean. Out: its highest point as the camera sees it, in cm. The idea: section 2.2.2 takes the highest
//! bright pixel of a coarse grid. Leaves count when they rise above the apex, and on a nodding stem the top of the arch counts.
//! Both make the measured tip jump.

use std::sync::LazyLock;

use rand::Rng;
use tropism::geometry::path::resampled;
use tropism::geometry::space::SpacePoint;
use tropism::geometry::{Point, Polyline, STEM_POINTS};
use tropism::math::interpolate::lerp;
use tropism::math::vector::Vec3;
use tropism::observation::{Depth, Observation};
use tropism::random;

use super::pose::{Leaf, Pose};
use super::view::{self, View};

/// Size of the pixels of the detector, in cm. Chosen by hand: a coarse grid as in section 2.2.2.
pub const GRID_CM: f64 = 0.08;

/// Standard deviation of the detector's noise in x and in y, in cm. Chosen by hand.
pub const NOISE_SD_CM: f64 = 0.03;

/// Standard deviation of the noise of each point of the stem, in x and in y, in cm. Chosen by hand: the tracker's error at
/// stems is of this size (`docs/validation/vision-virtual.md`).
pub const STEM_NOISE_SD_CM: f64 = 0.05;

/// Points on the midline between two nodes of the stem. Chosen by hand: less than a pixel apart.
const POINTS_PER_SEGMENT: usize = 12;

/// Points along half the edge of a leaf. Chosen by hand.
const POINTS_PER_LEAF_EDGE: usize = 24;

/// The outline of a leaf of length 1.
static LEAF_OUTLINE: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| Leaf::unit_outline(POINTS_PER_LEAF_EDGE));

/// The highest point of the plant on the detector's grid, plus two normal draws of `rng` as noise.
pub fn detect(pose: &Pose, rng: &mut impl Rng) -> Point {
    let tip = highest_point(pose);
    let mut noise = [0.0; 2];
    random::fill_normal(&mut noise, rng);
    Point::new(tip.x + NOISE_SD_CM * noise[0], tip.y + NOISE_SD_CM * noise[1])
}

/// The midline of the stem as the camera sees it: ten points at equal distances from the base to the apex, in cm.
#[must_use]
pub fn midline(pose: &Pose) -> Polyline {
    Polyline(pose.stem.iter().map(|node| view::project(node.at)).collect()).resampled(STEM_POINTS)
}

/// The midline of the stem in space: ten points at equal distances from the base to the apex, in cm.
#[must_use]
pub fn midline_in_space(pose: &Pose) -> Vec<SpacePoint> {
    let nodes: Vec<SpacePoint> = pose.stem.iter().map(|node| node.at).collect();
    resampled(&nodes, STEM_POINTS)
}

/// [`midline`], plus normal draws of `rng` as noise. The base is known: it stays.
pub fn detect_stem(pose: &Pose, rng: &mut impl Rng) -> Polyline {
    let mut stem = midline(pose);
    let mut noise = [[0.0; 2]; STEM_POINTS - 1];
    random::fill_normal(noise.as_flattened_mut(), rng);
    for (point, [x, y]) in stem.0.iter_mut().skip(1).zip(noise) {
        point.x += STEM_NOISE_SD_CM * x;
        point.y += STEM_NOISE_SD_CM * y;
    }
    stem
}

/// What two cameras know of a plant that the front one has `seen`: the tip is triangulated from the detector's tips of both,
/// and the stem is ten points in space with the noise of [`detect_stem`]. `rng` is that of the camera at the side.
pub fn detect_in_space(pose: &Pose, seen: Observation, rng: &mut impl Rng) -> Observation {
    let side = detect(&pose.seen_from(View::Side), rng);
    let mut stem = midline_in_space(pose);
    for point in stem.iter_mut().skip(1) {
        *point = point.map(|axis| axis + STEM_NOISE_SD_CM * random::normal(rng));
    }
    in_space(seen, side, &stem)
}

/// What two cameras without noise know of a plant: the tip is triangulated from the [highest points](highest_point) of both.
#[must_use]
pub fn seen_in_space(pose: &Pose) -> Observation {
    let [front, side] = [highest_point(pose), highest_point(&pose.seen_from(View::Side))];
    in_space(Observation::simulated(front), side, &midline_in_space(pose))
}

/// What the front camera has `seen`, with the tip of the camera at the `side`, and with the stem in space.
fn in_space(seen: Observation, side: Point, stem: &[SpacePoint]) -> Observation {
    let [x, y, z] = view::STEREO.triangulate(seen.tip, side).point;
    Observation {
        tip: Point::new(x, y),
        stem: Some(Polyline(stem.iter().map(|&[x, y, _]| Point::new(x, y)).collect())),
        depth: Some(Depth { tip_cm: z, stem_cm: stem.iter().map(|point| point[2]).collect() }),
        ..seen
    }
}

/// The highest point of the plant on the detector's grid: the middle of the highest row that shows some of it.
///
/// ```
/// use tropism_bean::{Bean, Species, detector};
/// let bean = Bean::noise_free(Species::default().average());
/// let tip = detector::highest_point(&bean.pose());
/// assert!(tip.x.abs() < 0.1 && (tip.y - 4.0).abs() < 0.2);
/// ```
#[must_use]
pub fn highest_point(pose: &Pose) -> Point {
    let mut top = TopRow::default();
    for (i, pair) in pose.stem.windows(2).enumerate().rev() {
        let (lower, upper) = (pair[0].at, pair[1].at);
        // An arch rises above its chord by an eighth of its length at most, and a chord is no longer than its three axes.
        let chord: f64 = (0..3).map(|axis| (upper[axis] - lower[axis]).abs()).sum();
        let reach = pair[0].radius.max(pair[1].radius) + 0.125 * chord;
        let limit = top.height() - 1.3 * reach;
        if is_seen_below(lower, limit) && is_seen_below(upper, limit) {
            continue;
        }
        let before = pose.stem[i.saturating_sub(1)].at;
        let after = pose.stem[(i + 2).min(pose.stem.len() - 1)].at;
        for step in 0..=POINTS_PER_SEGMENT {
            let share = step as f64 / POINTS_PER_SEGMENT as f64;
            let radius = lerp(pair[0].radius, pair[1].radius, share);
            top.add(spline([before, lower, upper, after], share), radius);
        }
    }
    for leaf in &pose.leaves {
        // The blade ends at the leaf's length and is no wider than half of it on either side.
        let reach = leaf.length * (leaf.along[1].max(0.0) + 0.5 * leaf.across[1].abs() + 0.1);
        if view::project(leaf.base).y + 1.3 * reach > top.height() {
            leaf.outline_of(&LEAF_OUTLINE).for_each(|place| top.add(place, 0.0));
        }
    }
    top.middle()
}

/// Whether the camera sees `place` below `height`: that of [`view::project`], without its division.
fn is_seen_below(place: Vec3, height: f64) -> bool {
    let [_, y, distance] = view::CAMERA;
    (place[1] - y) * distance < (height - y) * (distance - place[2])
}

/// The highest row of the grid so far, and the columns it spans.
#[derive(Default)]
struct TopRow {
    row: f64,
    span: Option<[f64; 2]>,
}

impl TopRow {
    fn height(&self) -> f64 {
        if self.span.is_some() { self.row * GRID_CM } else { f64::NEG_INFINITY }
    }

    fn add(&mut self, place: Vec3, radius: f64) {
        let seen = view::project(place);
        if seen.y + radius < self.height() {
            return;
        }
        let row = ((seen.y + radius) / GRID_CM).floor();
        let column = (seen.x / GRID_CM).round();
        match &mut self.span {
            Some([least, most]) if row == self.row => {
                *least = least.min(column);
                *most = most.max(column);
            }
            _ => *self = Self { row, span: Some([column, column]) },
        }
    }

    fn middle(&self) -> Point {
        let [least, most] = self.span.unwrap_or_default();
        Point::new(0.5 * (least + most) * GRID_CM, (self.row + 0.5) * GRID_CM)
    }
}

/// Catmull-Rom spline through four points, at `share` of the way from the second to the third.
fn spline([a, b, c, d]: [Vec3; 4], share: f64) -> Vec3 {
    core::array::from_fn(|axis| {
        let (a, b, c, d) = (a[axis], b[axis], c[axis], d[axis]);
        let (linear, square, cube) =
            (0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * d, 0.5 * (d - a) + 1.5 * (b - c));
        b + share * (linear + share * (square + share * cube))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Node;
    use crate::{Bean, Species};

    /// A stem of radius 0.1 cm through `places`, and leaves of `length` that point up from `base`.
    fn pose(places: &[Vec3], base: Vec3, length: f64) -> Pose {
        let leaf = Leaf { base, along: [0.0, 1.0, 0.0], across: [1.0, 0.0, 0.0], length };
        Pose {
            age_h: 0.0,
            stem: places.iter().map(|&at| Node { at, radius: 0.1 }).collect(),
            heading: [0.0, 1.0, 0.0],
            leaves: [leaf, leaf],
            spread: 1.0,
            withered: 1.0,
        }
    }

    #[test]
    fn the_tip_of_an_upright_stem_is_its_end() {
        let tip = highest_point(&pose(&[[0.0; 3], [0.0, 5.0, 0.0], [0.0, 10.0, 0.0]], [0.0; 3], 0.0));
        assert!(tip.distance(Point::new(0.0, 10.1)) < GRID_CM, "{tip:?}");
    }

    #[test]
    fn the_tip_of_an_arch_is_its_top() {
        let arch: Vec<Vec3> = (0..=20)
            .map(|i| f64::from(i) / 20.0 * core::f64::consts::PI)
            .map(|turn| [5.0 - 5.0 * tropism::math::cos(turn), 5.0 + 5.0 * tropism::math::sin(turn), 0.0])
            .collect();
        let tip = highest_point(&pose(&arch, [0.0; 3], 0.0));
        assert!(tip.distance(Point::new(5.0, 10.1)) < 0.15, "{tip:?}");
    }

    #[test]
    fn leaves_count_where_they_rise_above_the_stem() {
        let stem = [[0.0; 3], [0.0, 5.0, 0.0], [0.0, 10.0, 0.0]];
        assert!(highest_point(&pose(&stem, [0.0, 8.0, 0.0], 1.5)).y < 10.2);
        let tip = highest_point(&pose(&stem, [0.0, 8.0, 0.0], 4.0));
        assert!((tip.y - 12.0).abs() < 0.2, "{tip:?}");
    }

    #[test]
    fn no_place_is_missed() {
        let mut bean = Bean::new(Species::default().draw(2, 1.0), 2);
        for step in 0..120 {
            bean.advance(&[f64::from(step % 2), f64::from(step / 40 % 2)], 30.0);
            let pose = bean.pose();
            let stem = pose.stem.iter().map(|node| view::project(node.at).y + node.radius);
            let leaves = pose.leaves.iter().flat_map(|leaf| leaf.outline(POINTS_PER_LEAF_EDGE));
            let top = stem.chain(leaves.map(|place| view::project(place).y)).fold(0.0, f64::max);
            assert!(highest_point(&pose).y > top - GRID_CM, "step {step}");
        }
    }
}
