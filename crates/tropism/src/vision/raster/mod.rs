//! Pictures as sampled planes.

pub mod plane;
pub mod filter;
pub mod levels;
pub mod source;
