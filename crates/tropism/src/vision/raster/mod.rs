//! Pictures as sampled planes.
//!
//! In: a picture, of which any region can be read. Out: planes of filtered samples, and the levels of background and
//! plant in them. The one idea: detection reads few of a photograph's pixels, so only those are decoded, filtered and
//! sampled.

pub mod plane;
pub mod filter;
pub mod levels;
pub mod source;
pub(super) mod turn;
mod masked;
pub mod frame;

pub(in crate::vision) use masked::Masked;
