//! A number of which a formula is written once: one `f64`, or several side by side in vector lanes.
//!
//! A formula that is generic over [`Real`] is compiled for [`f64`] and for [`Lanes`], with the same bits in both. Comparisons
//! give masks, and [`Real::select`] stands where plain code branches. All methods are inlined, so that within a
//! [`Kernel`](crate::simd::Kernel) the compiler makes vector instructions of the loops over lanes.
//!
//! ```
//! use tropism::math::{Lanes, Real, exp};
//!
//! /// A positive part that decays.
//! fn decayed<R: Real>(x: R, time: f64) -> R {
//!     R::select(x.gt(R::splat(0.0)), x, R::splat(0.0)) * exp(R::splat(-time))
//! }
//!
//! let together = decayed(Lanes([-1.0, 0.5, 1.0, 2.0]), 0.3);
//! assert_eq!(together.lane(2), decayed(1.0, 0.3));
//! ```

use core::fmt::Debug;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

/// One `f64`, or several in lanes.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialEq
    + Send
    + Sync
    + 'static
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// What a comparison gives: true or false in each lane.
    type Mask: Mask;

    /// Number of lanes.
    const LANES: usize;

    /// The number of each lane, by its index.
    fn from_fn(of_lane: impl FnMut(usize) -> f64) -> Self;

    /// The number in a lane.
    fn lane(self, lane: usize) -> f64;

    /// Replaces the number in a lane.
    fn set_lane(&mut self, lane: usize, value: f64);

    /// The numbers of `yes` where the mask holds, else those of `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Whether this is less than `other`.
    fn lt(self, other: Self) -> Self::Mask;

    /// Whether this is at most `other`.
    fn le(self, other: Self) -> Self::Mask;

    /// Whether this is `other`.
    fn eq(self, other: Self) -> Self::Mask;

    /// The square root, correctly rounded.
    fn sqrt(self) -> Self;

    /// The magnitude.
    fn abs(self) -> Self;

    /// The magnitude of this with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// 2 to the power of this integer from -1022 to 1023.
    fn power_of_two(self) -> Self;

    /// The exponent of a positive normal number: the integer `n` with 2^n <= x < 2^(n+1).
    fn exponent(self) -> Self;

    /// The same number in all lanes.
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self::from_fn(|_| x)
    }

    /// Whether this is greater than `other`.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }

    /// Whether this is at least `other`.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }

    /// The lesser of both. Where one is not a number: `self`.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(other.lt(self), other, self)
    }

    /// The greater of both. Where one is not a number: `self`.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.lt(other), other, self)
    }

    /// This, or the nearest of both bounds.
    #[inline(always)]
    fn clamp(self, least: Self, most: Self) -> Self {
        self.max(least).min(most)
    }
}

/// True or false in each lane.
pub trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> + 'static
{
    /// The value of each lane, by its index.
    fn from_fn(of_lane: impl FnMut(usize) -> bool) -> Self;

    /// Whether it holds in a lane.
    fn lane(self, lane: usize) -> bool;

    /// Whether it holds in some lane.
    fn any(self) -> bool;

    /// Whether it holds in all lanes.
    #[inline(always)]
    fn all(self) -> bool {
        !(!self).any()
    }
}

impl Mask for bool {
    #[inline(always)]
    fn from_fn(mut of_lane: impl FnMut(usize) -> bool) -> Self {
        of_lane(0)
    }

    #[inline(always)]
    fn lane(self, _: usize) -> bool {
        self
    }

    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

/// 2^52: from here on a number has no bits below 1, so the low bits of the sum with an integer are that integer.
const TWO_52: f64 = 4_503_599_627_370_496.0;
/// Bits of the significand, and the exponent of 1.
const SIGNIFICAND_BITS: u32 = 52;
const BIAS: f64 = 1023.0;

impl Real for f64 {
    type Mask = bool;

    const LANES: usize = 1;

    #[inline(always)]
    fn from_fn(mut of_lane: impl FnMut(usize) -> f64) -> Self {
        of_lane(0)
    }

    #[inline(always)]
    fn lane(self, _: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn set_lane(&mut self, _: usize, value: f64) {
        *self = value;
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f64::copysign(self, sign)
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        f64::from_bits((self + (BIAS + TWO_52)).to_bits() << SIGNIFICAND_BITS)
    }

    #[inline(always)]
    fn exponent(self) -> Self {
        f64::from_bits(TWO_52.to_bits() | (self.to_bits() >> SIGNIFICAND_BITS)) - (TWO_52 + BIAS)
    }
}

/// `N` numbers side by side: 4 are a vector of AVX2, 8 two.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct Lanes<const N: usize>(pub [f64; N]);

/// A mask of [`Lanes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneMask<const N: usize>([bool; N]);

/// Applies a method to each lane. A macro, as a closure need not be inlined.
macro_rules! each_lane {
    ($lane:ident => $value:expr) => {{
        let mut result = [<_>::default(); N];
        let mut $lane = 0;
        while $lane < N {
            result[$lane] = $value;
            $lane += 1;
        }
        result
    }};
}

impl<const N: usize> Real for Lanes<N> {
    type Mask = LaneMask<N>;

    const LANES: usize = N;

    #[inline(always)]
    fn from_fn(mut of_lane: impl FnMut(usize) -> f64) -> Self {
        Self(each_lane!(lane => of_lane(lane)))
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.0[lane]
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        self.0[lane] = value;
    }

    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        Self(each_lane!(lane => if mask.0[lane] { yes.0[lane] } else { no.0[lane] }))
    }

    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<N> {
        LaneMask(each_lane!(lane => self.0[lane] < other.0[lane]))
    }

    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<N> {
        LaneMask(each_lane!(lane => self.0[lane] <= other.0[lane]))
    }

    #[inline(always)]
    fn eq(self, other: Self) -> LaneMask<N> {
        LaneMask(each_lane!(lane => self.0[lane] == other.0[lane]))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(each_lane!(lane => f64::sqrt(self.0[lane])))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(each_lane!(lane => f64::abs(self.0[lane])))
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(each_lane!(lane => f64::copysign(self.0[lane], sign.0[lane])))
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self(each_lane!(lane => self.0[lane].power_of_two()))
    }

    #[inline(always)]
    fn exponent(self) -> Self {
        Self(each_lane!(lane => self.0[lane].exponent()))
    }
}

impl<const N: usize> Default for Lanes<N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(each_lane!(lane => -self.0[lane]))
    }
}

/// An operator between lanes, its assignment where there is one, and the operator with one number for all lanes.
macro_rules! operators {
    ($($operator:ident $method:ident $sign:tt $($assignment:ident $assign:ident)?;)+) => {$(
        impl<const N: usize> $operator for Lanes<N> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(each_lane!(lane => self.0[lane] $sign other.0[lane]))
            }
        }

        impl<const N: usize> $operator<f64> for Lanes<N> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                Self(each_lane!(lane => self.0[lane] $sign other))
            }
        }

        $(impl<const N: usize> $assignment for Lanes<N> {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                *self = *self $sign other;
            }
        })?
    )+};
}

operators! {
    Add add + AddAssign add_assign;
    Sub sub - SubAssign sub_assign;
    Mul mul * MulAssign mul_assign;
    Div div /;
}

impl<const N: usize> Mask for LaneMask<N> {
    #[inline(always)]
    fn from_fn(mut of_lane: impl FnMut(usize) -> bool) -> Self {
        Self(each_lane!(lane => of_lane(lane)))
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self.0[lane]
    }

    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(false, |any, holds| any | holds)
    }
}

impl<const N: usize> BitAnd for LaneMask<N> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(each_lane!(lane => self.0[lane] & other.0[lane]))
    }
}

impl<const N: usize> BitOr for LaneMask<N> {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(each_lane!(lane => self.0[lane] | other.0[lane]))
    }
}

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(each_lane!(lane => !self.0[lane]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_select_lane_by_lane() {
        let (one, other) = (Lanes([1.0, 5.0, f64::NAN, -0.0]), Lanes([2.0, 3.0, 0.0, 7.0]));
        assert_eq!(one.min(other).0[..2], [1.0, 3.0]);
        assert_eq!(one.max(other).0[..2], [2.0, 5.0]);
        assert!(one.max(other).lane(2).is_nan() && one.lt(other).any() && !one.lt(other).all());
        assert_eq!(other.min(Lanes([f64::NAN; 4])), other);
        assert_eq!(Lanes([3.0, -4.0]).clamp(Lanes::splat(-1.0), Lanes::splat(1.0)), Lanes([1.0, -1.0]));
        let mask = one.le(other) & !one.eq(Lanes::splat(1.0)) | LaneMask::from_fn(|lane| lane == 2);
        assert_eq!([0, 1, 2, 3].map(|lane| mask.lane(lane)), [false, false, true, true]);
    }

    #[test]
    fn exponents_and_powers_of_two_are_exact() {
        for n in -1022..=1023 {
            let power = f64::from(n).power_of_two();
            assert_eq!((power, power.exponent()), (2.0_f64.powi(n), f64::from(n)));
            assert_eq!((1.99 * power).exponent(), f64::from(n));
        }
    }
}
