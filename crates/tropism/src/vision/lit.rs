//! Which lamp is lit, read from a photograph.

use crate::geometry::Region;
use crate::light::Light;
use crate::photo::Image;

/// How much brighter one side must be: the difference of both sides' glow over their sum.
const CLEAR: f64 = 0.25;

/// The lamp that is lit in a picture; `None` where no side is clearly brighter: both dark, both lit, or no lamps in view.
///
/// `lamps` are the places of the left and the right lamp; without them the outer thirds of the picture are compared.
/// A side's glow is the mean square of what its pixels exceed the picture's median by, so that a saturated lamp
/// outweighs the fitting of the unlit one, which a flash lights up, and things that stand on both sides cancel out.
///
/// A lamp's place that does not lie in the picture glows as little as darkness.
#[must_use]
pub fn lit(image: &Image, lamps: Option<[Region; 2]>) -> Option<Light> {
    let third = Region { x: 0, y: 0, width: (image.width / 3).max(1), height: image.height };
    let sides = lamps.unwrap_or([third, Region { x: image.width - third.width, ..third }]);
    let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
    let median = {
        let mut greys: Vec<u16> = greys(image, whole, (image.width / 80).max(1)).collect();
        let middle = greys.len() / 2;
        *greys.select_nth_unstable(middle).1
    };
    let [left, right] = sides.map(|side| {
        let (mut glow, mut count) = (0_u64, 0_u64);
        for grey in greys(image, side, (image.width / 320).max(2)) {
            let excess = u64::from(grey.saturating_sub(median));
            glow += excess * excess;
            count += 1;
        }
        glow as f64 / count.max(1) as f64
    });
    // Less than one grey value of glow is the camera's noise.
    let difference = (right - left) / (left + right).max(1.0);
    (difference.abs() >= CLEAR).then_some(if difference > 0.0 { Light::Right } else { Light::Left })
}

/// Sums of red, twice green and blue over 4 of every `step`-th pixel of `region`, both ways; none outside the picture.
fn greys(image: &Image, region: Region, step: usize) -> impl Iterator<Item = u16> {
    let is_inside = region.fits(image.width, image.height);
    let rows = if is_inside { region.y..region.y + region.height } else { 0..0 };
    rows.step_by(step).flat_map(move |y| {
        (region.x..region.x + region.width).step_by(step).map(move |x| {
            let [r, g, b] = image.at(x, y).map(u16::from);
            (r + 2 * g + b) / 4
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(lit(&tent(&[(8, 255), (100, 160)]), None), Some(Light::Left));
        assert_eq!(lit(&tent(&[(8, 160), (100, 255)]), None), Some(Light::Right));
        assert_eq!(lit(&tent(&[(100, 60)]), None), Some(Light::Right));
    }

    #[test]
    fn darkness_and_balance_are_undecided() {
        assert_eq!(lit(&tent(&[]), None), None);
        assert_eq!(lit(&tent(&[(8, 255), (100, 255)]), None), None);
        assert_eq!(lit(&Image { width: 1, height: 1, rgb: vec![255; 3] }, None), None);
    }

    #[test]
    fn places_of_lamps_are_believed() {
        let image = tent(&[(50, 255), (8, 120)]);
        let at = |x| Region { x, y: 0, width: 20, height: 20 };
        assert_eq!(lit(&image, Some([at(0), at(45)])), Some(Light::Right));
        assert_eq!(lit(&image, Some([at(1_000), at(2_000)])), None);
    }
}
