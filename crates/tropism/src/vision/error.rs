//! Errors of vision.

use crate::check::OutOfRange;
use crate::geometry::Region;

/// Why a configuration, a calibration or a picture cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VisionError {
    /// A value outside its range.
    #[error("found {key} = {found}, wanted {wanted}")]
    Value {
        /// Key in the file.
        key: &'static str,
        /// Value found.
        found: String,
        /// Range wanted.
        wanted: &'static str,
    },
    /// A region that is empty or does not lie inside the picture.
    #[error("found region {region}, wanted one inside a picture of {width} x {height}")]
    Region {
        /// Region found.
        region: Region,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// An obstacle in view.
    #[error(transparent)]
    Obstacle(OutOfRange),
    /// A picture of another size than the calibration's.
    #[error("found a picture of {width} x {height}, wanted {wanted_width} x {wanted_height} as calibrated")]
    Size {
        /// Columns found.
        width: usize,
        /// Rows found.
        height: usize,
        /// Columns of the calibration.
        wanted_width: usize,
        /// Rows of the calibration.
        wanted_height: usize,
    },
}

impl VisionError {
    /// `Ok` if the value is valid, otherwise [`VisionError::Value`].
    pub(super) fn check_value(
        key: &'static str,
        found: impl ToString,
        is_valid: bool,
        wanted: &'static str,
    ) -> Result<(), Self> {
        if is_valid { Ok(()) } else { Err(Self::Value { key, found: found.to_string(), wanted }) }
    }
}
