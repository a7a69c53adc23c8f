//! Camera geometry: from pixels to centimetres in the plane of the stem, and to space.
//!
//! In: photographs of a checkerboard or of marks of known length, and the first picture of a run. Out: a calibration,
//! the shift of a camera that was moved, and points in space from two cameras. The one idea: the plant grows in one
//! plane, so a homography maps its picture to centimetres.

pub mod lens;
pub mod calibration;
pub mod checkerboard;
pub mod registration;
pub mod stereo;
