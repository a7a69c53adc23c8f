//! One number for each of some lanes.

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
