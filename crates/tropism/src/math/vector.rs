//! Vectors of the plane and of space as arrays of components, in whatever unit the caller counts.
//!
//! A length is the square root of the sum of squares, summed from the first component to the last. It may differ in
//! its last bit from [`hypot`](super::hypot), which [`Point`](crate::geometry::Point) and
//! [`Pixel`](crate::geometry::Pixel) use.

use super::interpolate::lerp;

/// A vector of the plane.
pub type Vec2 = [f64; 2];

/// A vector of space.
pub type Vec3 = [f64; 3];

/// `a + b`.
#[must_use]
#[inline]
pub fn add<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    core::array::from_fn(|axis| a[axis] + b[axis])
}

/// `a - b`.
#[must_use]
#[inline]
pub fn sub<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    core::array::from_fn(|axis| a[axis] - b[axis])
}

/// `factor * a`.
#[must_use]
#[inline]
pub fn scale<const N: usize>(a: [f64; N], factor: f64) -> [f64; N] {
    a.map(|component| component * factor)
}

/// The dot product.
///
/// ```
/// use tropism::math::vector::dot;
/// assert_eq!(dot([1.0, 2.0, 3.0], [4.0, -5.0, 6.0]), 12.0);
/// ```
#[must_use]
#[inline]
pub fn dot<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    let mut sum = a[0] * b[0];
    for axis in 1..N {
        sum += a[axis] * b[axis];
    }
    sum
}

/// The dot product of vectors of any length, in four partial sums whose order does not depend on the machine; what one of them has
/// beyond the other counts nothing.
#[must_use]
pub fn dot_slices(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    let mut sums = [0.0; 4];
    let (quads, others) = (a[..length].chunks_exact(4), b[..length].chunks_exact(4));
    let rest: f64 = quads.remainder().iter().zip(others.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in quads.zip(others) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

/// The cross product.
///
/// ```
/// use tropism::math::vector::cross;
/// assert_eq!(cross([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
/// ```
#[must_use]
#[inline]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The Euclidean length.
#[must_use]
#[inline]
pub fn norm<const N: usize>(a: [f64; N]) -> f64 {
    dot(a, a).sqrt()
}

/// The Euclidean distance between two places.
#[must_use]
#[inline]
pub fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    norm(sub(a, b))
}

/// `a` scaled to length 1, or `otherwise` where `a` is at most 1e-9 long and its direction is rounding error.
#[must_use]
#[inline]
pub fn normalize_or<const N: usize>(a: [f64; N], otherwise: [f64; N]) -> [f64; N] {
    let length = norm(a);
    if length > 1e-9 { scale(a, 1.0 / length) } else { otherwise }
}

/// The mean, component by component; 0 of nothing.
#[must_use]
pub fn mean<const N: usize>(vectors: impl IntoIterator<Item = [f64; N]>) -> [f64; N] {
    let (sum, count) =
        vectors.into_iter().fold(([0.0; N], 0.0), |(sum, count), vector| (add(sum, vector), count + 1.0));
    sum.map(|component| component / f64::max(count, 1.0))
}

/// The place that lies `far` times `direction` from `start`.
#[must_use]
#[inline]
pub fn along<const N: usize>(start: [f64; N], direction: [f64; N], far: f64) -> [f64; N] {
    add(start, scale(direction, far))
}

/// The place at a `share` of the way from `a` (0) to `b` (1).
#[must_use]
#[inline]
pub fn between<const N: usize>(a: [f64; N], b: [f64; N], share: f64) -> [f64; N] {
    core::array::from_fn(|axis| lerp(a[axis], b[axis], share))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn three_four_five() {
        assert_eq!((norm([3.0, 4.0]), norm([2.0, 3.0, 6.0])), (5.0, 7.0));
        assert_eq!(distance([1.0, 1.0], [4.0, 5.0]), 5.0);
        assert_eq!(normalize_or([0.0, 0.0, 2.0], [1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(normalize_or([0.0; 3], [1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
        assert_eq!(between([0.0, 2.0], [4.0, 0.0], 0.25), [1.0, 1.5]);
        assert_eq!(add([1.0, 2.0], scale([0.5, 1.0], 2.0)), [2.0, 4.0]);
    }

    proptest! {
        #[test]
        fn a_cross_product_stands_at_right_angles(
            a in prop::array::uniform3(-5.0..5.0), b in prop::array::uniform3(-5.0..5.0),
        ) {
            let c = cross(a, b);
            prop_assert!(dot(a, c).abs() < 1e-9 && dot(b, c).abs() < 1e-9);
            let sine_squared = norm(c).powi(2) + dot(a, b).powi(2);
            prop_assert!((sine_squared - dot(a, a) * dot(b, b)).abs() < 1e-6, "Lagrange's identity");
        }
    }
}
