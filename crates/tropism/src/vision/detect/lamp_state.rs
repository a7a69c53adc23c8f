//! Which lamp is lit, read from a photograph.

use crate::geometry::Region;
use crate::lamps::Light;
use crate::math::statistics::upper_median;
use crate::vision::raster::source::{PixelSource, full_region};

/// How much brighter one side must be: the difference of both sides' glow over their sum.
const CLEAR: f64 = 0.25;

/// Columns that a picture is read at, at least, and the most pixels that make one.
const COLUMNS: usize = 80;
const COARSEST: usize = 8;

/// The lamp that is lit in a picture; `None` where no side is clearly brighter: both dark, both lit, or no lamps in view.
///
/// `lamps` are the places of all lamps in the order of their layout, and the brightest is compared with the second; without
/// them the outer thirds of the picture stand for [`Light::LEFT`] and [`Light::RIGHT`].
/// A side's glow is the mean square of what its squares of up to eight pixels exceed the picture's median by, so that a saturated lamp
/// outweighs the fitting of the unlit one, which a flash lights up, and things that stand on both sides cancel out.
///
/// A lamp's place that does not lie in the picture glows as little as darkness.
#[must_use]
pub fn lamp_state(image: &impl PixelSource, lamps: Option<&[Region]>) -> Option<Light> {
    let (width, height) = image.size();
    let third = Region { x: 0, y: 0, width: (width / 3).max(1), height };
    let thirds = [third, Region { x: width - third.width, ..third }];
    let sides = lamps.unwrap_or(&thirds);
    let step = (width / COLUMNS).clamp(1, COARSEST);
    let greys = image.downscale_luma(full_region((width, height)), step);
    let median = upper_median(&greys, f32::total_cmp)?;
    let glow = |side: &Region| {
        if !side.fits(width, height) {
            return 0.0;
        }
        let columns = side.x / step..(side.x + side.width).div_ceil(step).min(width / step);
        let rows = side.y / step..(side.y + side.height).div_ceil(step).min(height / step);
        let (mut glow, mut count) = (0.0, 0.0);
        for row in rows {
            for grey in &greys[row * (width / step)..][columns.clone()] {
                let excess = f64::from((grey - median).max(0.0));
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
    // Less than one grey value of glow is the camera's noise.
    let difference = (best - second) / (best + second).max(1.0);
    if difference >= CLEAR { Light::new(brightest) } else { None }
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
    fn places_of_lamps_are_believed() {
        let image = tent(&[(50, 255), (8, 120)]);
        let at = |x| Region { x, y: 0, width: 20, height: 20 };
        assert_eq!(lamp_state(&image, Some(&[at(0), at(45)])), Some(Light::RIGHT));
        assert_eq!(lamp_state(&image, Some(&[at(1_000), at(2_000)])), None);
        assert_eq!(lamp_state(&image, Some(&[at(0), at(100), at(45), at(20)])), Some(Light::FRONT));
    }
}
