//! What is remembered of a camera's first picture.

use crate::vision::camera::registration::ReferenceFeatures;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::Plane;
use crate::vision::raster::source::{PixelSource, full_region, sample_luma};

/// What is remembered of a camera's first picture.
#[derive(Clone, Debug)]
pub(in crate::vision) struct Background {
    pub(in crate::vision) features: ReferenceFeatures,
    pub(in crate::vision) brightness: f64,
}

/// The median brightness of a picture, by means of squares that a JPEG tells without its pixels.
pub(in crate::vision) fn brightness(image: &impl PixelSource) -> f64 {
    let (width, height) = image.size();
    let step = if width.min(height) < 8 { 1 } else { 8 };
    let values = image.downscale_luma(full_region((width, height)), step);
    let (width, height) = (width / step, height / step);
    f64::from(Levels::from_plane(&Plane { width, height, values, origin: (0.0, 0.0), step }, 1).background)
}

/// Whether a picture is black but for noise: its brightest parts exceed its median by fewer than five deviations.
pub(in crate::vision) fn is_black(image: &impl PixelSource) -> bool {
    let plane = coarse(image, 256);
    let levels = Levels::from_plane(&plane, plane.values.len() / 1_000);
    levels.contrast() < 5.0
}

/// A picture in grey, unfiltered, at so many columns.
fn coarse(image: &impl PixelSource, columns: usize) -> Plane {
    sample_luma(image, full_region(image.size()), 0.0, (image.size().0 / columns).max(1))
}
