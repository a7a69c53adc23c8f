//! A stem known by its form, where its colour does not tell it from what is around it.
//!
//! In: a picture and the place where a stem leaves the soil. Out: the line through the middle of the stem, or nothing. The
//! one idea: across a stem lies a bar that differs from what is on both of its sides in the same way, be it brighter,
//! darker or of another colour; the way from the base along which such a bar goes on best is the stem.
//!
//! What lies beside a stem is the wall behind it, and stays the same along it. Where it changes for good, leaves begin:
//! that is the stem's end. Where there is no such stretch of some length, nothing is said.

mod bar;
mod search;
mod flanks;

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::config::VisionConfig;
use crate::vision::detect::curve::{Place, resampled};
use crate::vision::detect::detection::Detection;
use crate::vision::detect::occupancy::OccupancyGrid;
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::LUMA;
use crate::vision::raster::source::PixelSource;
use bar::{SmoothedImage, noise_deviation};
use flanks::{FINE, StemFlanks};
use search::BROADEST;

/// How deep below the base is looked for a pot, as a share of the picture's height, and the share of the way from the
/// background to the brightest that stands out there.
const BELOW: f64 = 0.06;

const STANDS_BELOW: f64 = 0.15;

/// What is believed: a stretch longer than so many widths, a fifth of which at most stands out on its less clear side by
/// less than this share of the contrast.
const LONG: f64 = 5.5;

const FAINT: f64 = 0.4;

/// The stem that was found.
#[derive(Clone, Debug)]
pub(super) struct StemRidge {
    /// The line through its middle, from the base up, in the picture's pixels.
    pub(super) line: Vec<Place>,
    /// How broad it is about.
    pub(super) width: f64,
    /// By how many deviations of the picture's noise it differs from what lies beside it.
    pub(super) contrast: f64,
}

/// The stem that leaves the soil at `base` in this picture; `None` where none is seen clearly, or it stands out by fewer than `contrast`
/// deviations of the picture's noise.
pub(super) fn find_stem(image: &Image, base: Place, contrast: f64) -> Option<StemRidge> {
    let picture = SmoothedImage::of(image)?;
    let (line, width) = picture.trace_ridge(base)?;
    let mut strip = StemFlanks::along(&picture, resampled(&line, width / FINE as f64), width);
    let (first, last) = strip.stretch()?;
    let long = (last - first) as f64 / FINE as f64;
    let clear = strip.contrast / noise_deviation(image).max(0.5);
    let is_stem = long > LONG && strip.least(first, last) >= FAINT * strip.contrast && clear > contrast;
    if !is_stem {
        return None;
    }
    strip.centre(&picture, first, last);
    strip.line.truncate(last + 1);
    Some(StemRidge { line: strip.line, width, contrast: clear })
}

/// What is believed of a plant that was seen by its colour, or was not.
///
/// Where the crop does not "exclude the pot" (section 2.2.2) and what lies below the base stands out from the background,
/// too, colour does not tell where the stem begins and what is beside it. Then its form must, or no stem is seen.
pub(super) fn detect(
    image: &impl PixelSource,
    crop: Region,
    base: Pixel,
    config: &VisionConfig,
    seen: Option<Detection>,
) -> Option<Detection> {
    let step = config.step(image.size().0).min(crop.width).min(crop.height);
    let far = step as f64;
    let middle = (far - 1.0) / 2.0;
    let origin = Pixel::new(crop.x as f64 + middle, crop.y as f64 + middle);
    let foot = ((base.x - origin.x) / far, (base.y - origin.y) / far);
    if foot.1 + 1.0 >= (crop.height / step) as f64 {
        return seen;
    }
    let small = image.downscale(crop, step);
    if seen.is_some() && !is_potted(&small, foot, config) {
        return seen;
    }
    let Some(ridge) = find_stem(&small, foot, config.contrast) else {
        return seen.map(|seen| Detection { stem: None, apex: None, ..seen });
    };
    let stem: Vec<Pixel> =
        ridge.line.iter().map(|at| Pixel::new(origin.x + far * at.0, origin.y + far * at.1)).collect();
    let top = stem.iter().copied().min_by(|one, other| one.y.total_cmp(&other.y))?;
    let apex = stem.last().copied();
    // What was seen lower than the stem is not the plant's top.
    let seen = seen.filter(|seen| seen.tip.y <= top.y + ridge.width * far).unwrap_or_else(|| {
        let shape = OccupancyGrid::from_pixels(stem.iter().copied(), 2.0 * far);
        Detection {
            tip: top,
            contrast: ridge.contrast,
            tissue: shape,
            is_occluded: true,
            ..Detection::default()
        }
    });
    Some(Detection { apex, stem: Some(stem), ..seen })
}

/// Whether most of what lies just below the foot stands out from the background: a pot, not dark soil.
fn is_potted(small: &Image, foot: Place, config: &VisionConfig) -> bool {
    let whole = Region { x: 0, y: 0, width: small.width, height: small.height };
    let grey = sample_gaussian(small, whole, LUMA, config.sigma, 1);
    let level = Levels::from_plane(&grey, config.bright_samples).threshold(STANDS_BELOW);
    let aside = BROADEST * small.width.min(small.height) as f64;
    let deep = BELOW * small.height as f64;
    let is_below = |x: usize, y: usize| {
        (x as f64 - foot.0).abs() <= aside && (2.0..deep + 3.0).contains(&(y as f64 - foot.1))
    };
    let (mut all, mut bright) = (0, 0);
    for (i, &value) in grey.values.iter().enumerate() {
        if is_below(i % grey.width, i / grey.width) {
            all += 1;
            bright += usize::from(value > level);
        }
    }
    2 * bright > all
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (160, 200);

    /// The middle of a drawn stem, so far above the base.
    fn middle(rise: f64) -> Place {
        (70.0 + 0.002 * rise * rise, 170.0 - rise)
    }

    /// A stem nine pixels wide that leans over before a wall that brightens to the right, with a mark painted on it, out of
    /// a pot that is as bright, under a leaf of its own colour that begins where it has risen by 100 pixels.
    fn picture(stem: [f64; 3]) -> Image {
        let mut rgb = Vec::new();
        for i in 0..SIZE.0 * SIZE.1 {
            let (x, y) = ((i % SIZE.0) as f64, (i / SIZE.0) as f64);
            let rise = 170.0 - y;
            let half = if rise > 100.0 { 14.0 } else { 4.5 };
            let is_plant = (0.0..150.0).contains(&rise) && (x - middle(rise).0).abs() < half;
            let is_pot = y > 170.0 && (20.0..140.0).contains(&x);
            let wall = 40.0 + 0.2 * x;
            rgb.extend(match () {
                () if is_plant && (60.0..66.0).contains(&rise) => [150, 20, 20],
                () if is_plant || is_pot => stem.map(|level| level as u8),
                () => [wall as u8 / 4, wall as u8 / 4, wall as u8],
            });
        }
        Image { width: SIZE.0, height: SIZE.1, rgb }
    }

    #[test]
    fn a_stem_is_followed_from_a_bright_pot_to_where_its_leaf_begins() {
        for colour in [[40.0, 60.0, 240.0], [160.0, 170.0, 90.0], [0.0, 0.0, 5.0]] {
            let found = find_stem(&picture(colour), (70.0, 170.0), 6.0).unwrap();
            for &(x, y) in &found.line[FINE..found.line.len() - FINE] {
                assert!((x - middle(170.0 - y).0).abs() < 1.5, "{colour:?}: {x}, {y}");
            }
            let last = found.line[found.line.len() - 1];
            assert!((last.1 - 70.0).abs() < 12.0, "{colour:?}: {last:?}");
            assert!((5.0..13.0).contains(&found.width), "{}", found.width);
        }
    }

    #[test]
    fn nothing_is_said_where_no_stem_stands_out() {
        let stem = picture([40.0, 60.0, 240.0]);
        assert!(find_stem(&stem, (20.0, 80.0), 6.0).is_none(), "the wall");
        let short =
            Image { rgb: stem.rgb[3 * SIZE.0 * 60..3 * SIZE.0 * 100].to_vec(), height: 40, ..stem.clone() };
        assert!(find_stem(&short, (80.0, 39.0), 6.0).is_none(), "too short to tell");
        assert!(find_stem(&Image { width: 8, height: 8, rgb: vec![9; 192] }, (4.0, 7.0), 6.0).is_none());
    }
}
