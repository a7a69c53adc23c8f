//! How a camera maps the plane of the stem.

pub mod lens;
pub mod calibration;
pub mod checkerboard;
pub mod registration;
pub mod stereo;
