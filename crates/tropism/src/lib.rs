//! Steers living plants with light.
//!
//! The modules stand in the order in which data flows, and each uses only those above it.

pub mod math;
pub mod random;

pub mod geometry;
pub mod light;
pub mod observation;
pub mod photo;
pub mod track;

pub mod vision;

pub mod greenhouse;

pub mod report;
