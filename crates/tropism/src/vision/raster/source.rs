//! What can be looked at: a picture of which any part can be had, and the means of squares of it.
//!
//! The one idea: seeing needs few of a photograph's pixels. It asks for those, and how they are had is the picture's own.

use std::borrow::Cow;

use crate::geometry::{Pixel, Region};
use crate::photo::jpeg::Jpeg;
use crate::photo::{Image, LazyImage};
use crate::vision::raster::filter;
use crate::vision::raster::plane::{LUMA, Plane};

/// A picture, whole or to be decoded where it is looked at.
pub trait PixelSource {
    /// Columns and rows.
    fn size(&self) -> (usize, usize);

    /// The pixels of a region.
    ///
    /// # Panics
    /// If it does not lie in the picture.
    fn crop(&self, region: Region) -> Cow<'_, Image>;

    /// A region at one `factor`-th of its size, each pixel the mean of a square; squares that are not whole are left off.
    ///
    /// # Panics
    /// If the region does not lie in the picture or `factor` is 0.
    fn downscale(&self, region: Region, factor: usize) -> Image {
        filter::downscale(&self.crop(region), full_region((region.width, region.height)), factor)
    }

    /// The mean brightness of each square of a region, row by row, 0 to 255; squares that are not whole are left off.
    ///
    /// # Panics
    /// If the region does not lie in the picture or `factor` is 0.
    fn downscale_luma(&self, region: Region, factor: usize) -> Vec<f32> {
        let part = self.crop(region);
        let (width, height) = (region.width / factor, region.height / factor);
        let mut sums = vec![0.0; width * height];
        for (row, line) in sums.chunks_exact_mut(width.max(1)).enumerate() {
            for y in row * factor..(row + 1) * factor {
                let pixels = part.rgb[3 * y * part.width..][..3 * width * factor].chunks_exact(3 * factor);
                for (sum, square) in line.iter_mut().zip(pixels) {
                    for pixel in square.chunks_exact(3) {
                        *sum += LUMA
                            .iter()
                            .zip(pixel)
                            .map(|(weight, &value)| weight * f32::from(value))
                            .sum::<f32>();
                    }
                }
            }
        }
        let pixels = (factor * factor) as f32;
        sums.iter_mut().for_each(|sum| *sum /= pixels);
        sums
    }
}

/// All of a picture of this size.
pub(in crate::vision) const fn full_region((width, height): (usize, usize)) -> Region {
    Region { x: 0, y: 0, width, height }
}

/// The samples of a crop in grey, smoothed by a filter of deviation `sigma` pixels, one of every `step` pixels.
///
/// Where the mean of the square that a sample stands for is part of so broad a filter, it is taken first, and a Gaussian
/// makes up the rest of the deviation: that needs no pixels of a file that knows its means. Otherwise this is
/// [`filter::sample_gaussian`]. Squares lie on the picture's own grid; those that the crop cuts are left off.
///
/// # Panics
/// If `crop` does not lie inside the picture or `step` is 0.
#[must_use]
pub fn sample_luma(picture: &impl PixelSource, crop: Region, sigma: f64, step: usize) -> Plane {
    // The variance of the mean of so many pixels.
    let square = ((step * step) as f64 - 1.0) / 12.0;
    match aligned_region(crop, step) {
        Some(crop) if step > 1 && sigma * sigma > square => {
            let (width, height) = (crop.width / step, crop.height / step);
            let middle = (step - 1) as f64 / 2.0;
            let origin = (crop.x as f64 + middle, crop.y as f64 + middle);
            let values = picture.downscale_luma(crop, step);
            let rest = (sigma * sigma - square).sqrt() / step as f64;
            filter::smooth_gaussian(Plane { width, height, values, origin, step }, rest)
        }
        _ => PaddedCrop::of(picture, crop, sigma).sample_luma(sigma, step),
    }
}

/// The pixels of a crop and those around it that a filter weighs.
pub(in crate::vision) struct PaddedCrop<'a> {
    pub(in crate::vision) part: Cow<'a, Image>,
    /// The crop within the part.
    pub(in crate::vision) crop: Region,
    /// Where in the picture the part begins.
    pub(in crate::vision) origin: Pixel,
}

impl<'a> PaddedCrop<'a> {
    /// Those of a filter of deviation `sigma` pixels.
    pub(in crate::vision) fn of(picture: &'a impl PixelSource, crop: Region, sigma: f64) -> Self {
        let margin = (3.0 * sigma).ceil() as usize;
        let (width, height) = picture.size();
        let (x, y) = (crop.x.saturating_sub(margin), crop.y.saturating_sub(margin));
        let reach = |from: usize, length: usize, most: usize| (from + length + margin).min(most);
        let (right, bottom) = (reach(crop.x, crop.width, width), reach(crop.y, crop.height, height));
        let part = picture.crop(Region { x, y, width: right - x, height: bottom - y });
        let crop = Region { x: crop.x - x, y: crop.y - y, ..crop };
        Self { part, crop, origin: Pixel::new(x as f64, y as f64) }
    }

    /// [`filter::sample_gaussian`] of the crop in grey.
    pub(in crate::vision) fn sample_luma(&self, sigma: f64, step: usize) -> Plane {
        let plane = filter::sample_gaussian(&self.part, self.crop, LUMA, sigma, step);
        Plane { origin: (plane.origin.0 + self.origin.x, plane.origin.1 + self.origin.y), ..plane }
    }
}

/// The part of a region that is made of whole squares of the picture's grid; `None` where there is none.
pub(in crate::vision) fn aligned_region(region: Region, step: usize) -> Option<Region> {
    let side = |from: usize, length: usize| {
        let first = from.next_multiple_of(step);
        (first, (from + length).saturating_sub(first) / step * step)
    };
    let ((x, width), (y, height)) = (side(region.x, region.width), side(region.y, region.height));
    (width > 0 && height > 0).then_some(Region { x, y, width, height })
}

impl PixelSource for Image {
    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn crop(&self, region: Region) -> Cow<'_, Image> {
        if region == full_region(self.size()) {
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
            Self::Jpeg(jpeg) => Cow::Owned(jpeg.decode_region(region)),
            Self::Decoded(image) => image.crop(region),
        }
    }

    fn downscale(&self, region: Region, factor: usize) -> Image {
        match self {
            Self::Jpeg(jpeg) if Jpeg::can_decode_scaled(region, factor) => jpeg.decode_scaled(region, factor),
            Self::Jpeg(_) => {
                filter::downscale(&self.crop(region), full_region((region.width, region.height)), factor)
            }
            Self::Decoded(image) => image.downscale(region, factor),
        }
    }

    fn downscale_luma(&self, region: Region, factor: usize) -> Vec<f32> {
        match self {
            Self::Jpeg(jpeg) if Jpeg::can_decode_scaled(region, factor) => {
                jpeg.decode_scaled_luma(region, factor)
            }
            Self::Jpeg(jpeg) => {
                jpeg.decode_region(region).downscale_luma(full_region((region.width, region.height)), factor)
            }
            Self::Decoded(image) => image.downscale_luma(region, factor),
        }
    }
}
