//! Regions of JPEG files by [`jpeg_regions`], compiled for the widest vectors of this processor.

use std::ops::Range;

pub use jpeg_regions::{Jpeg, JpegError};

use super::Image;
use crate::geometry::Region;
use crate::simd::{Kernel, dispatch};

fn ranges(region: Region) -> [Range<usize>; 2] {
    [region.x..region.x + region.width, region.y..region.y + region.height]
}

/// The pixels of a region.
///
/// # Panics
/// If the region does not lie in the picture.
#[must_use]
pub fn decode_region(jpeg: &Jpeg, region: Region) -> Image {
    Image { width: region.width, height: region.height, rgb: dispatch(DecodeRegion(jpeg, region)) }
}

/// Whether a region can be decoded at 1/`factor` of its size: [`Jpeg::can_decode_scaled`].
#[must_use]
pub fn can_decode_scaled(region: Region, factor: usize) -> bool {
    let [columns, rows] = ranges(region);
    Jpeg::can_decode_scaled(&columns, &rows, factor)
}

/// A region at 1/`factor` of its size: [`Jpeg::decode_scaled`].
///
/// # Panics
/// If the region does not lie in the picture or [`can_decode_scaled`] is false.
#[must_use]
pub fn decode_scaled(jpeg: &Jpeg, region: Region, factor: usize) -> Image {
    let rgb = dispatch(DecodeScaled(jpeg, region, factor));
    Image { width: region.width / factor, height: region.height / factor, rgb }
}

/// The luma of a region at 1/`factor` of its size, 0 to 255: [`Jpeg::decode_scaled_luma`].
///
/// # Panics
/// If the region does not lie in the picture or [`can_decode_scaled`] is false.
#[must_use]
pub fn decode_scaled_luma(jpeg: &Jpeg, region: Region, factor: usize) -> Vec<f32> {
    dispatch(DecodeScaledLuma(jpeg, region, factor))
}

struct DecodeRegion<'a>(&'a Jpeg, Region);

impl Kernel for DecodeRegion<'_> {
    type Result = Vec<u8>;

    #[inline(always)]
    fn run(self) -> Vec<u8> {
        let [columns, rows] = ranges(self.1);
        self.0.decode_region(columns, rows)
    }
}

struct DecodeScaled<'a>(&'a Jpeg, Region, usize);

impl Kernel for DecodeScaled<'_> {
    type Result = Vec<u8>;

    #[inline(always)]
    fn run(self) -> Vec<u8> {
        let [columns, rows] = ranges(self.1);
        self.0.decode_scaled(columns, rows, self.2)
    }
}

struct DecodeScaledLuma<'a>(&'a Jpeg, Region, usize);

impl Kernel for DecodeScaledLuma<'_> {
    type Result = Vec<f32>;

    #[inline(always)]
    fn run(self) -> Vec<f32> {
        let [columns, rows] = ranges(self.1);
        self.0.decode_scaled_luma(columns, rows, self.2)
    }
}
