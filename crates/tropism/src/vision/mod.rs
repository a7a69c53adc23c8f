//! From a photograph to the tip and the stem of the plant in it, in centimetres (sections 2.2.2 and 4).
//!
//! In: photographs, in order. Out: what each shows, and why where it shows nothing. The one idea: [`look`] is pure and
//! knows one picture; [`TipTracker`] adds what the camera's place ([`Calibration`]) and the photographs before know.
//!
//! Two modes. [`Mode::Paper`] does what the paper says, word for word. [`Mode::Robust`], the default, believes only
//! what hangs together with the stem's base, places the tip between pixels, finds out whether the camera was moved, and
//! doubts what a plant cannot do in the time between two photographs.

pub mod error;
pub mod config;
pub mod frame_status;
pub mod raster;
pub mod camera;
pub mod detect;
pub mod tracking;
pub mod tip_tracker;
pub mod overlay;

pub use camera::calibration::Calibration;
pub use config::{Mode, VisionConfig};
pub use detect::detection::{Detection, Edge};
pub use detect::lamp_state::lamp_state;
pub use detect::{detect, detect_from_base};
pub use error::VisionError;
pub use frame_status::FrameStatus;
pub use tip_tracker::{TipTracker, TrackedFrame};
