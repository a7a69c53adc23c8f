//! Why pictures cannot be read as they should be.

use crate::geometry::Region;

/// Why pictures cannot be read as they should be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VisionError {
    /// A value that cannot be one.
    #[error("found {key} = {found}, wanted {wanted}")]
    Value {
        /// The key in the file.
        key: &'static str,
        /// Its value.
        found: String,
        /// What it should be.
        wanted: &'static str,
    },
    /// A region with nothing in it or with parts outside the picture.
    #[error("found region {region:?}, wanted one inside a picture of {width} x {height}")]
    Region {
        /// The region.
        region: Region,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// A calibration for pictures of another size.
    #[error("found a picture of {width} x {height}, wanted {wanted_width} x {wanted_height} as calibrated")]
    Size {
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
        /// Columns calibrated for.
        wanted_width: usize,
        /// Rows calibrated for.
        wanted_height: usize,
    },
}
