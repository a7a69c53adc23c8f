//! Where the paper's detector would place the tip, without a photograph.
//!
//! In: the [`Pose`] of a bean. Out: its highest point as the camera sees it, in cm. The idea: section 2.2.2 takes the highest
//! bright pixel of a coarse grid, so leaves count as soon as they rise above the stem's end, and where an apex nods, the
//! highest point is on the arch: both make the tip of the paper jump.

use rand::Rng;

use super::pose::Pose;
use super::view::{self, Place};
use crate::geometry::Point;
use crate::random;

/// Size of the detector's pixels, in cm.
pub const GRID: f64 = 0.08;

/// Standard deviation of the detector's noise in x and in y, in cm.
pub const NOISE: f64 = 0.03;

/// Places taken on the centre line between two nodes of the stem.
const FINENESS: usize = 12;

/// Places taken along half the edge of a leaf.
const LEAF_EDGE: usize = 24;

/// The highest point of the plant on the detector's grid, with its noise: what `rng` adds is two normal draws.
pub fn detect(pose: &Pose, rng: &mut impl Rng) -> Point {
    let tip = highest(pose);
    Point::new(tip.x + NOISE * random::normal(rng), tip.y + NOISE * random::normal(rng))
}

/// The highest point of the plant on the detector's grid: the middle of the highest row that shows some of it.
///
/// ```
/// use tropism::greenhouse::{bean::{Bean, Species}, detector};
/// let bean = Bean::quiet(Species::default().average());
/// let tip = detector::highest(&bean.pose());
/// assert!(tip.x.abs() < 0.1 && (tip.y - 4.0).abs() < 0.2);
/// ```
#[must_use]
pub fn highest(pose: &Pose) -> Point {
    let mut top = Row::default();
    for (i, pair) in pose.stem.windows(2).enumerate() {
        let (lower, upper) = (pair[0].at, pair[1].at);
        // An arch rises above its chord by an eighth of its length at most.
        let reach = pair[0].radius.max(pair[1].radius) + 0.125 * distance(lower, upper);
        if view::project(lower).y.max(view::project(upper).y) + 1.3 * reach < top.height() {
            continue;
        }
        let before = pose.stem[i.saturating_sub(1)].at;
        let after = pose.stem[(i + 2).min(pose.stem.len() - 1)].at;
        for step in 0..=FINENESS {
            let share = step as f64 / FINENESS as f64;
            let radius = pair[0].radius + share * (pair[1].radius - pair[0].radius);
            top.add(spline([before, lower, upper, after], share), radius);
        }
    }
    for leaf in &pose.leaves {
        if view::project(leaf.base).y + 1.5 * leaf.length > top.height() {
            leaf.outline(LEAF_EDGE).into_iter().for_each(|place| top.add(place, 0.0));
        }
    }
    top.middle()
}

/// The highest row of the grid so far, and the columns it spans.
#[derive(Default)]
struct Row {
    row: f64,
    span: Option<[f64; 2]>,
}

impl Row {
    fn height(&self) -> f64 {
        if self.span.is_some() { self.row * GRID } else { f64::NEG_INFINITY }
    }

    fn add(&mut self, place: Place, radius: f64) {
        let seen = view::project(place);
        let row = ((seen.y + radius) / GRID).floor();
        let column = (seen.x / GRID).round();
        match &mut self.span {
            Some([least, most]) if row == self.row => {
                *least = least.min(column);
                *most = most.max(column);
            }
            Some(_) if row < self.row => {}
            _ => *self = Self { row, span: Some([column, column]) },
        }
    }

    fn middle(&self) -> Point {
        let [least, most] = self.span.unwrap_or_default();
        Point::new(0.5 * (least + most) * GRID, (self.row + 0.5) * GRID)
    }
}

fn distance(a: Place, b: Place) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// A place on the smooth curve through four places, `share` of the way from the second to the third (Catmull-Rom).
fn spline([a, b, c, d]: [Place; 4], share: f64) -> Place {
    core::array::from_fn(|axis| {
        let (a, b, c, d) = (a[axis], b[axis], c[axis], d[axis]);
        let (linear, square, cube) =
            (0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * d, 0.5 * (d - a) + 1.5 * (b - c));
        b + share * (linear + share * (square + share * cube))
    })
}
