//! Lines of straight segments between places of any kind: length, and resampling by arc length.

use super::{Pixel, Point};
use crate::math::vector;

/// A place on a line: in the plane of the stem, in a photograph, or in space.
pub trait Place: Copy {
    /// Euclidean distance to `other`.
    #[must_use]
    fn distance(self, other: Self) -> f64;

    /// The place at a `share` of the way to `other`.
    #[must_use]
    fn lerp(self, other: Self, share: f64) -> Self;
}

impl Place for Point {
    #[inline]
    fn distance(self, other: Self) -> f64 {
        Self::distance(self, other)
    }

    #[inline]
    fn lerp(self, other: Self, share: f64) -> Self {
        Self::lerp(self, other, share)
    }
}

impl Place for Pixel {
    #[inline]
    fn distance(self, other: Self) -> f64 {
        Self::distance(self, other)
    }

    #[inline]
    fn lerp(self, other: Self, share: f64) -> Self {
        let [x, y] = [self.x, self.y].lerp([other.x, other.y], share);
        Self { x, y }
    }
}

impl<const N: usize> Place for [f64; N] {
    #[inline]
    fn distance(self, other: Self) -> f64 {
        vector::distance(self, other)
    }

    #[inline]
    fn lerp(self, other: Self, share: f64) -> Self {
        vector::between(self, other, share)
    }
}

/// Length along a line, in the unit of its places.
#[must_use]
pub fn length<P: Place>(vertices: &[P]) -> f64 {
    vertices.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

/// The share of the way from `from` to `to` at which it is nearest to `point`; 0 where both ends are one place.
#[must_use]
pub fn share_nearest<const N: usize>(from: [f64; N], to: [f64; N], point: [f64; N]) -> f64 {
    let way = vector::sub(to, from);
    let square = vector::dot(way, way);
    let along = vector::dot(vector::sub(point, from), way);
    if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// The same line with `count` vertices at equal distances along it; both ends stay.
///
/// A line of fewer than two vertices, or a `count` below two, returns the line unchanged.
///
/// ```
/// use tropism::geometry::path::resampled;
/// let bent = [[0.0, 0.0], [0.0, 3.0], [1.0, 3.0]];
/// assert_eq!(resampled(&bent, 3), [[0.0, 0.0], [0.0, 2.0], [1.0, 3.0]]);
/// ```
#[must_use]
pub fn resampled<P: Place>(vertices: &[P], count: usize) -> Vec<P> {
    if vertices.len() < 2 || count < 2 {
        return vertices.to_vec();
    }
    let segments: Vec<f64> = vertices.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
    let spacing = segments.iter().sum::<f64>() / (count - 1) as f64;
    let mut found = Vec::with_capacity(count);
    found.push(vertices[0]);
    let mut walked = 0.0;
    for (pair, &segment) in vertices.windows(2).zip(&segments) {
        // More than one new vertex may lie on a long segment.
        while found.len() < count - 1 && walked + segment >= spacing * found.len() as f64 && segment > 0.0 {
            let share = (spacing * found.len() as f64 - walked) / segment;
            found.push(pair[0].lerp(pair[1], share));
        }
        walked += segment;
    }
    // Rounding may leave the last vertices out.
    found.resize(count, vertices[vertices.len() - 1]);
    found
}
