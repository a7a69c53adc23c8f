//! From photographs to the tip and the stem of a plant, in centimetres (sections 2.2.2 and 4).
//!
//! In: the photographs of one camera in the order of their times, and its [`Calibration`]. Out: a [`TrackedFrame`]
//! for each photograph. The one idea: [`fn@detect`] is a pure function of one picture; a [`TipTracker`] adds what the
//! camera's pose and the photographs before tell.
//!
//! There are two modes. [`Mode::Paper`] is the paper's method. [`Mode::Robust`], the default, accepts only tissue
//! that is connected to the stem base, locates the tip to a fraction of a sample, registers a camera that was moved,
//! and rejects what a plant cannot do between two photographs.
//!
//! The rooms stand in the order in which data flows, and each uses only those above it: [`raster`] (pictures as
//! sampled planes), [`camera`] (pixels to centimetres), [`mod@detect`] (one picture) and [`tracking`] (one plant over
//! time).

pub mod error;
pub mod config;
pub mod frame_status;
pub mod raster;
pub mod camera;
pub mod detect;
pub mod tracking;
pub mod tip_tracker;
pub mod location;

pub use camera::calibration::Calibration;
pub use config::{Direction, Mode, VisionConfig};
pub use detect::detection::{Detection, Edge};
pub use detect::lamp_state::lamp_state;
pub use detect::{detect, detect_from_base};
pub use error::VisionError;
pub use frame_status::FrameStatus;
pub use raster::frame::Frame;
pub use tip_tracker::{TipTracker, TrackedFrame};
