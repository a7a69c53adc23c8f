//! One number for each of some lanes.

#![allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays at once")]

use super::branchless;

/// Numbers side by side: two vectors of AVX2, one of AVX-512.
pub const LANES: usize = 8;

/// One number for each lane.
pub type Row = [f64; LANES];

/// `x` within bounds, as [`f64::clamp`].
#[inline(always)]
pub fn clamped(x: f64, [least, most]: [f64; 2]) -> f64 {
    let x = if x < least { least } else { x };
    if x > most { most } else { x }
}

/// [`math::exp`](super::exp) of all lanes.
#[inline(always)]
pub fn exp(x: &Row) -> Row {
    if !all(x, |x| x.abs() <= branchless::EXP_LIMIT) {
        return x.map(super::exp);
    }
    let mut result = [0.0; LANES];
    for lane in 0..LANES {
        result[lane] = branchless::exp(x[lane]);
    }
    result
}

/// [`math::pow`](super::pow) of all lanes.
#[inline(always)]
pub fn pow(x: &Row, y: &Row) -> Row {
    let mut result = [0.0; LANES];
    if !all(x, branchless::is_pow_base) || !all(y, branchless::is_pow_exponent) {
        for lane in 0..LANES {
            result[lane] = super::pow(x[lane], y[lane]);
        }
        return result;
    }
    for lane in 0..LANES {
        result[lane] = branchless::pow(x[lane], y[lane]);
    }
    result
}

/// [`math::cos`](super::cos) of all lanes, each from 0 to a full turn.
#[inline(always)]
pub fn cos(x: &Row) -> Row {
    if !all(x, branchless::is_between_zeros) {
        return x.map(super::cos);
    }
    let mut result = [0.0; LANES];
    for lane in 0..LANES {
        result[lane] = branchless::cos(x[lane]);
    }
    result
}

/// Whether `holds` in all lanes. Without branches, so that the compiler makes vectors of it.
#[inline(always)]
fn all(x: &Row, holds: impl Fn(f64) -> bool) -> bool {
    let mut all = true;
    for lane in 0..LANES {
        all &= holds(x[lane]);
    }
    all
}
