//! Lines of points in a plane of samples: smoothing, resampling, directions along and across.

use std::ops::Range;

use crate::geometry::path::{self, resampled};
use crate::math::statistics::quantile_nearest;
use crate::math::vector::{Vec2, mean, normalize_or, sub};

/// A point in a plane, or a vector: column and row of samples, with fractions.
pub type PlanePoint = Vec2;

/// The median of values, of an even count the greater of the middle two; 0 without values.
pub(in crate::vision) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    quantile_nearest(&values.into_iter().collect::<Vec<_>>(), 0.5)
}

/// Unit vector from one point to another.
pub(super) fn direction(from: PlanePoint, to: PlanePoint) -> PlanePoint {
    normalize_or(sub(to, from), [0.0; 2])
}

/// Unit vector across a line at one of its points, to the right as it leads. The tangent is a central difference over
/// `half` points to each side: single points are noisy.
pub(super) fn normal(line: &[PlanePoint], i: usize, half: usize) -> PlanePoint {
    let [x, y] = direction(line[i.saturating_sub(half)], line[(i + half).min(line.len() - 1)]);
    [-y, x]
}

/// The indices at most `radius` from `i` among `count`.
pub(super) fn window(i: usize, radius: usize, count: usize) -> Range<usize> {
    i.saturating_sub(radius)..(i + radius + 1).min(count)
}

/// Smooths a line by a moving average over `radius` points on both sides, fewer towards the ends, which stay.
pub(super) fn smooth(line: &[PlanePoint], radius: usize) -> Vec<PlanePoint> {
    let radius_at = |i: usize| radius.min(i).min(line.len() - 1 - i);
    (0..line.len()).map(|i| mean(line[window(i, radius_at(i), line.len())].iter().copied())).collect()
}

/// Resamples a line to points about `spacing` apart; both ends are kept.
pub(super) fn resample(line: &[PlanePoint], spacing: f64) -> Vec<PlanePoint> {
    let segments = (path::length(line) / spacing).round().max(1.0) as usize;
    resampled(line, segments + 1)
}
