//! Linear interpolation between two values and between the four corners of a square.
//!
//! Each comes in two forms, which are equal but for rounding: the form that `lerp` and [`bilinear`] use needs one
//! multiplication less; the form that [`blend`] and [`bilinear_blend`] use is exact at both ends. A figure that was
//! computed with one keeps it.

use core::ops::{Add, Mul, Sub};

/// `from` at a `share` of 0, `to` at 1, as `from + share * (to - from)`.
///
/// ```
/// use tropism::math::interpolate::lerp;
/// assert_eq!(lerp(2.0, 6.0, 0.25), 3.0);
/// ```
#[must_use]
#[inline]
pub fn lerp(from: f64, to: f64, share: f64) -> f64 {
    from + share * (to - from)
}

/// `from` at a `share` of 0, `to` at 1, as `(1 - share) * from + share * to`.
#[must_use]
#[inline]
pub fn blend<T>(from: T, to: T, share: T) -> T
where
    T: Copy + From<u8> + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    (T::from(1) - share) * from + share * to
}

/// The value at (`across`, `down`), both 0 to 1, in a square whose corners are upper left, upper right, lower left
/// and lower right, by [`lerp`].
///
/// ```
/// use tropism::math::interpolate::bilinear;
/// assert_eq!(bilinear([0.0, 1.0, 2.0, 3.0], 0.5, 0.25), 1.0);
/// ```
#[must_use]
#[inline]
pub fn bilinear([a, b, c, d]: [f64; 4], across: f64, down: f64) -> f64 {
    lerp(lerp(a, b, across), lerp(c, d, across), down)
}

/// The same by [`blend`].
#[must_use]
#[inline]
pub fn bilinear_blend<T>([a, b, c, d]: [T; 4], across: T, down: T) -> T
where
    T: Copy + From<u8> + Add<Output = T> + Sub<Output = T> + Mul<Output = T>,
{
    blend(blend(a, b, across), blend(c, d, across), down)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [f64; 4] = [0.1, 0.7, -2.3, 11.0];

    #[test]
    fn corners_and_centre() {
        for (corner, (across, down)) in
            CORNERS.into_iter().zip([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
        {
            assert!((bilinear(CORNERS, across, down) - corner).abs() < 1e-12);
            assert_eq!(bilinear_blend(CORNERS, across, down), corner);
        }
        let centre = CORNERS.iter().sum::<f64>() / 4.0;
        assert!((bilinear(CORNERS, 0.5, 0.5) - centre).abs() < 1e-12);
        assert!((bilinear_blend(CORNERS, 0.5, 0.5) - centre).abs() < 1e-12);
    }

    #[test]
    fn single_precision_blends_too() {
        assert_eq!(bilinear_blend([0.0_f32, 2.0, 4.0, 6.0], 0.5, 0.5), 3.0);
    }
}
