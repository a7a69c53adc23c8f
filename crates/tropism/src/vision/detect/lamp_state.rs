//! The lamp that is lit, read from a photograph.
//!
//! In: a picture, and where it shows the lamps. Out: the lit one. The one idea: the lit lamp saturates, so the mean
//! square of the luma above the picture's median gives its side.

use crate::geometry::Region;
use crate::lamps::Light;
use crate::math::statistics::upper_median;
use crate::vision::raster::source::PixelSource;

/// Least difference of both sides' glow, as a share of their sum. Chosen by hand.
const MIN_DIFFERENCE: f64 = 0.25;

/// Least number of columns to which a picture is downscaled, and the greatest factor. Chosen by hand; a JPEG is
/// downscaled by 8 without decoding its pixels.
const MIN_COLUMNS: usize = 80;
const MAX_FACTOR: usize = 8;

/// The lamp that is lit; `None` where no side is clearly brighter: both dark, both lit, or no lamp in view.
///
/// `lamps` are the regions of all lamps in the order of their layout, and the brightest is compared with the second;
/// without them the outer thirds of the picture stand for [`Light::LEFT`] and [`Light::RIGHT`].
/// The glow of a region is the mean square of its luma above the picture's median. A saturated lamp thus outweighs
/// the fitting of the unlit one, which a flash lights up, and what stands on both sides cancels out. A region outside
/// the picture has no glow.
#[must_use]
pub fn lamp_state(image: &dyn PixelSource, lamps: Option<&[Region]>) -> Option<Light> {
    let (width, height) = image.size();
    let third = Region { x: 0, y: 0, width: (width / 3).max(1), height };
    let thirds = [third, Region { x: width - third.width, ..third }];
    let sides = lamps.unwrap_or(&thirds);
    let factor = (width / MIN_COLUMNS).clamp(1, MAX_FACTOR);
    let luma = image.downscale_luma(Region::whole((width, height)), factor);
    let median = upper_median(&luma, f32::total_cmp)?;
    let glow = |side: &Region| {
        if !side.fits(width, height) {
            return 0.0;
        }
        let columns = side.x / factor..(side.x + side.width).div_ceil(factor).min(width / factor);
        let rows = side.y / factor..(side.y + side.height).div_ceil(factor).min(height / factor);
        let (mut glow, mut count) = (0.0, 0.0);
        for row in rows {
            for value in &luma[row * (width / factor)..][columns.clone()] {
                let excess = f64::from((value - median).max(0.0));
                glow += excess * excess;
                count += 1.0;
            }
        }
        glow / f64::max(count, 1.0)
    };
    let (mut brightest, mut best, mut second) = (0, 0.0, 0.0);
    for (index, side) in sides.iter().enumerate() {
        let glow = glow(side);
        if glow > best {
            (brightest, best, second) = (index, glow, best);
        } else if glow > second {
            second = glow;
        }
    }
    // Less than one grey value of glow is noise of the camera.
    let difference = (best - second) / (best + second).max(1.0);
    if difference >= MIN_DIFFERENCE { Light::new(brightest) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo::Image;

    fn tent(lamps: &[(usize, u8)]) -> Image {
        let (width, height) = (120, 80);
        let mut image = Image { width, height, rgb: vec![20; 3 * width * height] };
        for &(left, level) in lamps {
            for y in 5..15 {
                image.rgb[3 * (y * width + left)..3 * (y * width + left + 12)].fill(level);
            }
        }
        image
    }

    #[test]
    fn the_brighter_lamp_is_the_lit_one() {
        assert_eq!(lamp_state(&tent(&[(8, 255), (100, 160)]), None), Some(Light::LEFT));
        assert_eq!(lamp_state(&tent(&[(8, 160), (100, 255)]), None), Some(Light::RIGHT));
        assert_eq!(lamp_state(&tent(&[(100, 60)]), None), Some(Light::RIGHT));
    }

    #[test]
    fn darkness_and_balance_are_undecided() {
        assert_eq!(lamp_state(&tent(&[]), None), None);
        assert_eq!(lamp_state(&tent(&[(8, 255), (100, 255)]), None), None);
        assert_eq!(lamp_state(&Image { width: 1, height: 1, rgb: vec![255; 3] }, None), None);
    }

    #[test]
    fn given_regions_of_lamps_are_compared() {
        let image = tent(&[(50, 255), (8, 120)]);
        let at = |x| Region { x, y: 0, width: 20, height: 20 };
        assert_eq!(lamp_state(&image, Some(&[at(0), at(45)])), Some(Light::RIGHT));
        assert_eq!(lamp_state(&image, Some(&[at(1_000), at(2_000)])), None);
        assert_eq!(lamp_state(&image, Some(&[at(0), at(100), at(45), at(20)])), Some(Light::FRONT));
    }
}
