//! Rotations of the material frame along the stem, and places along it.

use tropism::math::Real;

/// Moves `at` from the lower end of a straight segment in direction `along` to its upper end. Returns its middle.
#[inline(always)]
pub(super) fn pass<R: Real>(at: &mut [R; 3], along: [R; 3], length: R) -> [R; 3] {
    let half = length * 0.5;
    let mut middle = *at;
    for axis in 0..3 {
        let way = half * along[axis];
        middle[axis] += way;
        at[axis] = middle[axis] + way;
    }
    middle
}

/// A rotation: a unit quaternion (w, x, y, z) in the coordinates (d1, d2, t) of the upright base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rotation<R>(pub(super) [R; 4]);

impl<R: Real> Rotation<R> {
    /// The rotation of a segment with these curvatures towards d1 and d2 over half its length.
    ///
    /// Taylor series of sine and cosine of a quarter of the angle of the segment: exact to 1e-13 for curvatures of a stem.
    /// Beyond 4 radians a segment the angle is bounded, and the norm errs by at most 1e-6.
    #[inline(always)]
    pub(super) fn of_bend([k1, k2]: [R; 2], length: R) -> Self {
        let quarter = length * 0.25;
        let bounded = |angle: R| angle.clamp(R::splat(-1.0), R::splat(1.0));
        let (x, y) = (bounded(-k2 * quarter), bounded(k1 * quarter));
        let angle2 = x * x + y * y;
        let series = |[first, second, third]: [f64; 3]| {
            let one = R::splat(1.0);
            one - angle2 * (one - angle2 * (one - angle2 * third) * second) * first
        };
        let sine = series([1.0 / 6.0, 1.0 / 20.0, 1.0 / 42.0]);
        let cosine = series([1.0 / 2.0, 1.0 / 12.0, 1.0 / 30.0]);
        Self([cosine, x * sine, y * sine, R::splat(0.0)])
    }

    /// The product with a rotation whose z is 0: a further rotation in the rotated frame.
    #[inline(always)]
    pub(super) fn then(self, Self([w, x, y, _]): Self) -> Self {
        let Self([a, b, c, d]) = self;
        Self([a * w - b * x - c * y, a * x + b * w - d * y, a * y + c * w + d * x, d * w + b * y - c * x])
    }

    /// This rotation twice; its z is 0.
    #[inline(always)]
    pub(super) fn twice(self) -> Self {
        let Self([w, x, y, z]) = self;
        let double = w + w;
        Self([w * w - x * x - y * y, double * x, double * y, z])
    }

    /// Goes along a segment from its lower end: the rotations at its middle and at its upper end.
    #[inline(always)]
    pub(super) fn through(self, curvature: [R; 2], length: R) -> [Self; 2] {
        let half = Self::of_bend(curvature, length);
        [self.then(half), self.then(half.twice())]
    }

    /// d1, d2 and t in world coordinates: x is d1 of the upright base, y its t, z its d2 reversed.
    #[inline(always)]
    pub(super) fn frame(self) -> [[R; 3]; 3] {
        let Self([w, x, y, z]) = self;
        let one = R::splat(1.0);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, yy, zz) = (x * x2, y * y2, z * z2);
        let (xy, xz, yz) = (x * y2, x * z2, y * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        [
            [one - (yy + zz), xz - wy, -(xy + wz)],
            [xy - wz, yz + wx, (xx + zz) - 1.0],
            [xz + wy, one - (xx + yy), wx - yz],
        ]
    }
}
