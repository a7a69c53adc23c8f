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

/// Gives an enum its words in files, in the order of its values: names, `Display` and `FromStr`.
macro_rules! words {
    ($type:ident, $kind:literal: $($value:ident = $word:literal),+ $(,)?) => {
        impl $type {
            /// Every value.
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$value),+];

            /// The word used in files.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$value => $word),+
                }
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.name())
            }
        }

        impl std::str::FromStr for $type {
            type Err = String;

            fn from_str(word: &str) -> Result<Self, String> {
                Self::ALL.into_iter().find(|value| value.name() == word).ok_or_else(|| {
                    let words = Self::ALL.map(Self::name).join(", ");
                    format!("found {} {word:?}, wanted one of {words}", $kind)
                })
            }
        }
    };
}

pub mod error;
pub mod config;
pub mod frame_status;
pub mod raster;
pub mod camera;
pub mod detect;
pub mod tracking;
pub mod tip_tracker;
pub mod location;
pub mod phantom;

pub use camera::calibration::Calibration;
pub use config::{Direction, Mode, VisionConfig};
pub use detect::detection::{Detection, Edge};
pub use detect::lamp_state::lamp_state;
pub use detect::{detect, detect_from_base};
pub use error::VisionError;
pub use frame_status::FrameStatus;
pub use raster::frame::Frame;
pub use tip_tracker::{TipTracker, TrackedFrame};
