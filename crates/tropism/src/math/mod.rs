//! Arithmetic that several modules share, with the same bits on every machine.
//!
//! `std` calls the platform's libm, whose last bits differ between systems; one seed must grow one plant everywhere.
//! The functions below come from the crate `libm`, a port of musl's C library. Clippy's `disallowed-methods` keeps
//! the rest of the library from calling `f64::sin` and the like directly.

pub mod interpolate;
pub mod vector;
pub mod matrix;
pub mod statistics;
pub mod rank_test;
pub mod simplex;
pub(crate) mod branchless;
pub mod lanes;

pub use libm::{atan2, cos, erfc, exp, hypot, log as ln, pow, sin, sincos as sin_cos, tan, tanh};

/// The logistic function `1 / (1 + e^-x)`.
#[must_use]
pub fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + exp(-x))
}
