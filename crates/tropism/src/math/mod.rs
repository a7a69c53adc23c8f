//! Arithmetic that several modules share, with the same bits on every machine.
//!
//! `std` calls the platform's libm, whose last bits differ between systems; one seed must grow one plant everywhere.
//! Clippy's `disallowed-methods` keeps the rest of the library from calling `f64::sin` and the like directly. A formula for
//! many plants at once is generic over [`Real`].

mod real;
mod elementary;
pub mod interpolate;
pub mod vector;
pub mod matrix;
pub mod cholesky;
pub mod statistics;
pub mod rank_test;

pub use elementary::{atan2, cos, erfc, exp, hypot, ln, logistic, pow, sin, sin_cos, tan, tanh};
pub use real::{LaneMask, Lanes, Mask, Real};
