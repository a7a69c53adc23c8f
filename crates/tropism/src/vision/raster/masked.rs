//! A picture without some of its regions: pixels that are known to be no plant.
//!
//! In: a picture, and which pixels to leave out. Out: a picture in which these have the colour of the background.

use std::borrow::Cow;

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::raster::source::PixelSource;

/// Downscaling at which the background's colour is measured, in pixels.
const COARSE: usize = 8;

/// A picture in which some pixels are left out.
pub(in crate::vision) struct Masked<'a> {
    picture: &'a dyn PixelSource,
    /// Regions that hold all pixels to leave out.
    regions: Vec<Region>,
    is_out: &'a dyn Fn(Pixel) -> bool,
    background: [u8; 3],
}

impl<'a> Masked<'a> {
    /// `picture` without the pixels of `regions` for which `is_out` holds; the background is measured in `crop`.
    pub(in crate::vision) fn new(
        picture: &'a dyn PixelSource,
        crop: Region,
        regions: Vec<Region>,
        is_out: &'a dyn Fn(Pixel) -> bool,
    ) -> Self {
        let (width, height) = picture.size();
        let factor = if crop.width.min(crop.height) < COARSE { 1 } else { COARSE };
        let coarse = crop.fits(width, height).then(|| picture.downscale(crop, factor));
        let background = coarse.map_or([0; 3], |coarse| coarse.median_colour());
        Self { picture, regions, is_out, background }
    }
}

impl PixelSource for Masked<'_> {
    fn size(&self) -> (usize, usize) {
        self.picture.size()
    }

    fn crop(&self, region: Region) -> Cow<'_, Image> {
        let mut pixels = self.picture.crop(region);
        for masked in &self.regions {
            let span = |from: usize, size: usize, start: usize, end: usize| {
                from.clamp(start, end)..(from + size).clamp(start, end)
            };
            for y in span(masked.y, masked.height, region.y, region.y + region.height) {
                for x in span(masked.x, masked.width, region.x, region.x + region.width) {
                    if (self.is_out)(Pixel::new(x as f64, y as f64)) {
                        let at = 3 * ((y - region.y) * region.width + x - region.x);
                        pixels.to_mut().rgb[at..at + 3].copy_from_slice(&self.background);
                    }
                }
            }
        }
        pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_has_the_colour_of_the_background() {
        let mut image = Image { width: 160, height: 120, rgb: vec![20; 3 * 160 * 120] };
        for y in 10..20 {
            image.rgb[3 * (160 * y + 5)..][..3 * 30].fill(200);
        }
        let is_out = |pixel: Pixel| pixel.x < 15.0;
        let all = Region::whole((160, 120));
        let region = Region { x: 3, y: 8, width: 20, height: 14 };
        let masked = Masked::new(&image, all, vec![region], &is_out);
        let seen = masked.crop(all);
        assert_eq!((seen.at(14, 12), seen.at(15, 12)), ([20; 3], [200; 3]));
        let part = masked.crop(Region { x: 12, y: 11, width: 6, height: 3 });
        assert_eq!((part.at(2, 0), part.at(3, 0)), ([20; 3], [200; 3]));
    }
}
