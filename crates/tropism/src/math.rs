//! Transcendental functions with the same bits on every machine.
//!
//! `std` calls the platform's libm, whose last bits differ between systems; one seed must give one plant everywhere.
//! Clippy's `disallowed-methods` keeps the rest of the library from calling `f64::sin` and its kin directly.

pub use libm::{atan2, cos, exp, hypot, log as ln, pow, sin, tan, tanh};

/// The logistic function `1 / (1 + e^-x)`.
#[must_use]
pub fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + exp(-x))
}
