//! Transcendental functions with the same bits on every machine, and what stands in the middle of many numbers.
//!
//! `std` calls the platform's libm, whose last bits differ between systems; one seed must give one plant everywhere.
//! Clippy's `disallowed-methods` keeps the rest of the library from calling `f64::sin` and its kin directly.

pub use libm::{atan2, cos, exp, hypot, log as ln, pow, sin, tan, tanh};

/// The logistic function `1 / (1 + e^-x)`.
#[must_use]
pub fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + exp(-x))
}
/// The one of `values` that a `share` of them, 0 to 1, lies below; 0 without values.
///
/// ```
/// use tropism::math::quantile;
/// assert_eq!(quantile(&[3.0, 1.0, 2.0], 0.5), 2.0);
/// assert_eq!(quantile(&[3.0, 1.0, 2.0], 1.0), 3.0);
/// ```
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(0.0)
}
