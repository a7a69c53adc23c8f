//! Pictures of which any region can be read, at full size or downscaled.
//!
//! In: a decoded [`Image`], or an opened [`LazyImage`] that decodes on demand. Out: pixels of regions, and planes
//! sampled from them. The one idea: detection needs few of a photograph's pixels, so it asks for regions and the
//! picture decodes those.

use std::borrow::Cow;

use crate::geometry::{Pixel, Region};
use crate::photo::{Image, LazyImage, jpeg};
use crate::vision::raster::filter;
use crate::vision::raster::plane::{LUMA, Plane};

/// A picture of which regions can be read.
pub trait PixelSource {
    /// Columns and rows.
    fn size(&self) -> (usize, usize);

    /// The pixels of a region.
    ///
    /// # Panics
    /// If the region does not lie in the picture.
    fn crop(&self, region: Region) -> Cow<'_, Image>;

    /// A region downscaled by `factor`: each pixel is the mean of a square. Incomplete squares are dropped.
    ///
    /// # Panics
    /// If the region does not lie in the picture or `factor` is 0.
    fn downscale(&self, region: Region, factor: usize) -> Image {
        filter::downscale(&self.crop(region), Region::whole((region.width, region.height)), factor)
    }

    /// The luma of a region downscaled by `factor`: the mean of each square, row by row, 0 to 255. Incomplete squares
    /// are dropped.
    ///
    /// # Panics
    /// If the region does not lie in the picture or `factor` is 0.
    fn downscale_luma(&self, region: Region, factor: usize) -> Vec<f32> {
        let pixels = self.crop(region);
        let (width, height) = (region.width / factor, region.height / factor);
        let mut sums = vec![0.0; width * height];
        for (row, line) in sums.chunks_exact_mut(width.max(1)).enumerate() {
            for y in row * factor..(row + 1) * factor {
                let squares =
                    pixels.rgb[3 * y * pixels.width..][..3 * width * factor].chunks_exact(3 * factor);
                for (sum, square) in line.iter_mut().zip(squares) {
                    for pixel in square.chunks_exact(3) {
                        let weighted =
                            LUMA.iter().zip(pixel).map(|(weight, &value)| weight * f32::from(value));
                        *sum += weighted.sum::<f32>();
                    }
                }
            }
        }
        let area = (factor * factor) as f32;
        sums.iter_mut().for_each(|sum| *sum /= area);
        sums
    }
}

/// The luma of a whole picture downscaled by 8, row by row, which a JPEG gives without decoding its pixels: the DC
/// coefficients of its blocks. A picture of less than 8 columns or rows is not downscaled.
pub(in crate::vision) fn coarse_luma(picture: &dyn PixelSource) -> Vec<f32> {
    let (width, height) = picture.size();
    let factor = if width.min(height) < 8 { 1 } else { 8 };
    picture.downscale_luma(Region::whole((width, height)), factor)
}

/// Columns or rows, whichever are more, of a picture's [`reduced_luma`], at most. Chosen by hand.
const MOST_SAMPLES: usize = 1_000;

/// The luma of a whole picture, reduced by a whole number so that it has at most 1000 columns and rows.
#[must_use]
pub fn reduced_luma(picture: &dyn PixelSource) -> Plane {
    let (width, height) = picture.size();
    let step = width.max(height).div_ceil(MOST_SAMPLES).min(width.min(height)).max(1);
    let values = picture.downscale_luma(Region::whole((width, height)), step);
    let middle = (step as f64 - 1.0) / 2.0;
    Plane { width: width / step, height: height / step, values, origin: Pixel::new(middle, middle), step }
}

/// Samples the luma of a crop at every `step`-th pixel, filtered with standard deviation `sigma` pixels.
///
/// Where the filter is broader than the square of `step` x `step` pixels, the mean of each square is taken first and
/// a Gaussian adds the rest of the variance: a JPEG gives these means without decoding its pixels. Otherwise this is
/// [`filter::sample_gaussian`]. Squares lie on the picture's own grid; those that the crop cuts are dropped.
///
/// # Panics
/// If `crop` does not lie inside the picture or `step` is 0.
#[must_use]
pub fn sample_luma(picture: &dyn PixelSource, crop: Region, sigma: f64, step: usize) -> Plane {
    // Variance of a box filter of `step` pixels.
    let box_variance = ((step * step) as f64 - 1.0) / 12.0;
    match aligned_region(crop, step) {
        Some(crop) if step > 1 && sigma * sigma > box_variance => {
            let (width, height) = (crop.width / step, crop.height / step);
            let middle = (step - 1) as f64 / 2.0;
            let origin = Pixel::new(crop.x as f64 + middle, crop.y as f64 + middle);
            let values = picture.downscale_luma(crop, step);
            let rest = (sigma * sigma - box_variance).sqrt() / step as f64;
            filter::smooth_gaussian(&Plane { width, height, values, origin, step }, rest)
        }
        _ => {
            // The crop with the margin of the filter, as far as the picture reaches.
            let margin = (3.0 * sigma).ceil() as usize;
            let (width, height) = picture.size();
            let (x, y) = (crop.x.saturating_sub(margin), crop.y.saturating_sub(margin));
            let right = (crop.x + crop.width + margin).min(width);
            let bottom = (crop.y + crop.height + margin).min(height);
            let pixels = picture.crop(Region { x, y, width: right - x, height: bottom - y });
            let crop = Region { x: crop.x - x, y: crop.y - y, ..crop };
            let plane = filter::sample_gaussian(&pixels, crop, LUMA, sigma, step);
            Plane { origin: plane.origin + Pixel::new(x as f64, y as f64), ..plane }
        }
    }
}

/// The largest part of a region that consists of whole squares of the picture's grid; `None` if there is none.
pub(in crate::vision) fn aligned_region(region: Region, step: usize) -> Option<Region> {
    let align = |start: usize, length: usize| {
        let first = start.next_multiple_of(step);
        (first, (start + length).saturating_sub(first) / step * step)
    };
    let ((x, width), (y, height)) = (align(region.x, region.width), align(region.y, region.height));
    (width > 0 && height > 0).then_some(Region { x, y, width, height })
}

impl PixelSource for Image {
    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn crop(&self, region: Region) -> Cow<'_, Image> {
        if region == Region::whole(self.size()) {
            return Cow::Borrowed(self);
        }
        Cow::Owned(filter::downscale(self, region, 1))
    }

    fn downscale(&self, region: Region, factor: usize) -> Image {
        filter::downscale(self, region, factor)
    }
}

impl PixelSource for LazyImage {
    fn size(&self) -> (usize, usize) {
        match self {
            Self::Jpeg(jpeg) => (jpeg.width, jpeg.height),
            Self::Decoded(image) => image.size(),
        }
    }

    fn crop(&self, region: Region) -> Cow<'_, Image> {
        match self {
            Self::Jpeg(jpeg) => Cow::Owned(jpeg::decode_region(jpeg, region)),
            Self::Decoded(image) => image.crop(region),
        }
    }

    fn downscale(&self, region: Region, factor: usize) -> Image {
        match self {
            Self::Jpeg(jpeg) if jpeg::can_decode_scaled(region, factor) => {
                jpeg::decode_scaled(jpeg, region, factor)
            }
            _ => filter::downscale(&self.crop(region), Region::whole((region.width, region.height)), factor),
        }
    }

    fn downscale_luma(&self, region: Region, factor: usize) -> Vec<f32> {
        match self {
            Self::Jpeg(jpeg) if jpeg::can_decode_scaled(region, factor) => {
                jpeg::decode_scaled_luma(jpeg, region, factor)
            }
            Self::Jpeg(jpeg) => {
                let pixels = jpeg::decode_region(jpeg, region);
                pixels.downscale_luma(pixels.region(), factor)
            }
            Self::Decoded(image) => image.downscale_luma(region, factor),
        }
    }
}
