//! Stem by its form, as a ridge, where its colour does not separate it from its surroundings.
//!
//! In: a picture and the point where the stem leaves the soil. Out: the midline of the stem, or nothing. The one
//! idea: a cross-section of a stem is a bar that differs from both sides in the same way: brighter, darker or of another
//! colour. The path from the base with the greatest contrast of such bars is the stem. Its flanks show the wall behind it
//! and do not change; without a long stretch of this kind no stem is given. Above that stretch, the stem ends where the
//! plant's width changes, or below the node above its topmost mark.
//!
//! The constants of this module and its children were chosen by hand on the first half of the photographs of sunflower
//! seedlings with centre lines (`docs/validation/vision-real.md`).

mod rgb;
mod bar;
mod search;
mod flanks;
mod paint;
mod leaf;
mod node;

use crate::geometry::{Pixel, Region, path};
use crate::math::vector::{along, distance};
use crate::photo::Image;
use crate::vision::config::VisionConfig;
use crate::vision::detect::curve::{PlanePoint, direction, resample};
use crate::vision::detect::detection::Detection;
use crate::vision::detect::occupancy::OccupancyGrid;
use crate::vision::detect::silhouette::is_silhouette;
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::LUMA;
use crate::vision::raster::source::PixelSource;
use bar::SmoothedImage;
use flanks::{POINTS_PER_WIDTH, StemFlanks};
use search::MAX_WIDTH_SHARE;

/// Depth below the base in which a pot is searched, as a share of the picture's height.
const POT_DEPTH: f64 = 0.06;

/// Level of a pot, as a share of the way from the background to the brightest samples.
const POT_LEVEL: f64 = 0.15;

/// Least length of the stretch with unchanged flanks, and of the stem up to where leaves begin, in stem widths.
const MIN_LENGTH: f64 = 2.5;
const MIN_STEM: f64 = 4.0;

/// Least contrast to the nearer flank over four fifths of the stem, as a share of the mean contrast.
const MIN_FLANK_CONTRAST: f64 = 0.3;

/// Least length of a stem by colour, and greatest distance of its foot from the base, in stem widths.
const MIN_LENGTH_BY_COLOUR: f64 = 4.0;
const MAX_START: f64 = 2.0;

/// A stem found by its form.
#[derive(Clone, Debug)]
pub(super) struct StemRidge {
    /// Its midline from the base up, in pixels of the picture.
    pub(super) line: Vec<PlanePoint>,
    /// Its width, in pixels.
    pub(super) width: f64,
    /// Contrast to its flanks, in standard deviations of the picture's noise.
    pub(super) contrast: f64,
}

/// Finds the stem that leaves the soil at `base`; `None` where none is clear, or its contrast is at most
/// `min_contrast` standard deviations of the picture's noise.
pub(super) fn find_stem(image: &Image, base: PlanePoint, min_contrast: f64) -> Option<StemRidge> {
    let smoothed = SmoothedImage::of(image)?;
    let (line, width) = smoothed.trace_ridge(base)?;
    let line = resample(&line, width / POINTS_PER_WIDTH as f64);
    let mut flanks = StemFlanks::sample(&smoothed, line, width);
    let (first, last) = flanks.stem_stretch()?;
    let length = (last - first) as f64 / POINTS_PER_WIDTH as f64;
    let contrast = flanks.contrast / rgb::noise_deviation(image).max(0.5);
    let is_stem = length > MIN_LENGTH
        && flanks.least_contrast(first, last) >= MIN_FLANK_CONTRAST * flanks.contrast
        && contrast > min_contrast;
    if !is_stem {
        return None;
    }
    flanks.centre(&smoothed, first, last);
    let mut line = resample(&flanks.line, width / POINTS_PER_WIDTH as f64);
    let last = last.min(line.len() - 1);
    let path_end = line.len();
    extend(&mut line);
    let mut flanks = StemFlanks::sample(&smoothed, line, width);
    let first = first.min(last);
    let marks = flanks.marks(&smoothed, first, last);
    let end = flanks.stem_end(&smoothed, first, last, path_end, marks)?;
    flanks.line.truncate(end + 1);
    let is_long = end as f64 >= MIN_STEM * POINTS_PER_WIDTH as f64;
    is_long.then_some(StemRidge { line: flanks.line, width, contrast })
}

/// Extends a line straight by two widths: its path stops where a wide leaf begins, which has no flanks.
fn extend(line: &mut Vec<PlanePoint>) {
    let (end, before) = (line[line.len() - 1], line[line.len().saturating_sub(1 + POINTS_PER_WIDTH)]);
    let step = distance(before, end) / POINTS_PER_WIDTH as f64;
    let tangent = direction(before, end);
    line.extend((1..=2 * POINTS_PER_WIDTH).map(|i| along(end, tangent, i as f64 * step)));
}

/// Corrects a detection by colour where the crop contains a pot, or detects the stem where colour found no plant.
///
/// Where the crop does not "exclude the pot" (section 2.2.2) and the picture is bright below the base, colour does not
/// separate stem and pot. Then the stem is found by its form, or none is given. A photograph that `is_alone` has no
/// neighbours to reject a wrong stem by, so its stem is found by form without a pot, too.
pub(super) fn detect(
    image: &dyn PixelSource,
    crop: Region,
    base: Pixel,
    config: &VisionConfig,
    by_colour: Option<Detection>,
    is_alone: bool,
) -> Option<Detection> {
    let step = config.step(image.size().0).min(crop.width).min(crop.height);
    let scale = step as f64;
    let middle = (scale - 1.0) / 2.0;
    let origin = Pixel::new(crop.x as f64 + middle, crop.y as f64 + middle);
    let foot = base;
    let base = [(base.x - origin.x) / scale, (base.y - origin.y) / scale];
    if base[1] + 1.0 >= (crop.height / step) as f64 {
        return by_colour;
    }
    let small = image.downscale(crop, step);
    let surroundings = Surroundings::of(&small, base, config);
    if by_colour.is_some() && (surroundings.is_silhouette || !surroundings.has_pot && !is_alone) {
        return by_colour;
    }
    let Some(ridge) = find_stem(&small, base, config.contrast) else {
        let keeps_stem = |found: &Detection| !surroundings.has_pot && begins_at(found, foot);
        return by_colour.map(|found| {
            if keeps_stem(&found) {
                return Detection { is_occluded: true, ..found };
            }
            Detection { stem: None, stem_width: None, apex: None, ..found }
        });
    };
    let stem: Vec<Pixel> =
        ridge.line.iter().map(|at| origin + Pixel::new(scale * at[0], scale * at[1])).collect();
    let top = stem.iter().copied().min_by(|one, other| one.y.total_cmp(&other.y))?;
    let apex = stem.last().copied();
    // A tip by colour that lies below the stem's top is not the plant's.
    let is_plausible = |found: &Detection| found.tip.y <= top.y + ridge.width * scale;
    let found = by_colour.filter(is_plausible).unwrap_or_else(|| Detection {
        tip: top,
        contrast: ridge.contrast,
        tissue: OccupancyGrid::from_pixels(stem.iter().copied(), 2.0 * scale),
        is_occluded: true,
        ..Detection::default()
    });
    Some(Detection { apex, stem: Some(stem), stem_width: Some(ridge.width * scale), ..found })
}

/// Whether the stem of a detection by colour begins at `base` and is long enough to be one.
fn begins_at(found: &Detection, base: Pixel) -> bool {
    let (Some(stem), Some(width)) = (found.stem.as_deref(), found.stem_width) else { return false };
    path::length(stem) >= MIN_LENGTH_BY_COLOUR * width && stem[0].distance(base) <= MAX_START * width
}

/// What a picture shows around the base.
struct Surroundings {
    /// Whether most samples just below the base are bright: a pot, not dark soil.
    has_pot: bool,
    /// Whether the picture is a silhouette.
    is_silhouette: bool,
}

impl Surroundings {
    fn of(small: &Image, base: PlanePoint, config: &VisionConfig) -> Self {
        let whole = small.region();
        let luma = sample_gaussian(small, whole, LUMA, config.sigma, 1);
        let levels = Levels::of(&luma.values, config.bright_samples);
        let level = levels.threshold(POT_LEVEL);
        let half_width = MAX_WIDTH_SHARE * small.width.min(small.height) as f64;
        let depth = POT_DEPTH * small.height as f64;
        let is_below = |x: usize, y: usize| {
            (x as f64 - base[0]).abs() <= half_width && (2.0..depth + 3.0).contains(&(y as f64 - base[1]))
        };
        let (mut all, mut bright) = (0, 0);
        for (i, &value) in luma.values.iter().enumerate() {
            if is_below(i % luma.width, i / luma.width) {
                all += 1;
                bright += usize::from(value > level);
            }
        }
        Self { has_pot: 2 * bright > all, is_silhouette: is_silhouette(&luma, &levels) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (160, 200);

    /// The middle of a drawn stem at a height above the base.
    fn middle(rise: f64) -> PlanePoint {
        [70.0 + 0.002 * rise * rise, 170.0 - rise]
    }

    /// A leaning stem nine pixels wide with a painted mark, before a wall that brightens to the right. It grows out
    /// of a pot of its own colour; a leaf of that colour begins at a height of 100 pixels.
    fn picture(stem: [f64; 3]) -> Image {
        marked_picture(stem, &[60.0])
    }

    /// The same with painted marks at several heights.
    fn marked_picture(stem: [f64; 3], marks: &[f64]) -> Image {
        let is_mark = |rise: f64| marks.iter().any(|mark| (*mark..mark + 6.0).contains(&rise));
        let mut rgb = Vec::new();
        for i in 0..SIZE.0 * SIZE.1 {
            let (x, y) = ((i % SIZE.0) as f64, (i / SIZE.0) as f64);
            let rise = 170.0 - y;
            let half = if rise > 100.0 { 14.0 } else { 4.5 };
            let is_plant = (0.0..150.0).contains(&rise) && (x - middle(rise)[0]).abs() < half;
            let is_pot = y > 170.0 && (20.0..140.0).contains(&x);
            let wall = 40.0 + 0.2 * x;
            rgb.extend(match () {
                () if is_plant && is_mark(rise) => [150, 20, 20],
                () if is_plant || is_pot => stem.map(|level| level as u8),
                () => [wall as u8 / 4, wall as u8 / 4, wall as u8],
            });
        }
        Image { width: SIZE.0, height: SIZE.1, rgb }
    }

    #[test]
    fn a_stem_is_followed_from_a_bright_pot_to_where_its_leaf_begins() {
        for colour in [[40.0, 60.0, 240.0], [160.0, 170.0, 90.0], [0.0, 0.0, 5.0]] {
            let found = find_stem(&picture(colour), [70.0, 170.0], 6.0).unwrap();
            for &[x, y] in &found.line[POINTS_PER_WIDTH..found.line.len() - POINTS_PER_WIDTH] {
                assert!((x - middle(170.0 - y)[0]).abs() < 1.5, "{colour:?}: {x}, {y}");
            }
            let last = found.line[found.line.len() - 1];
            assert!((last[1] - 70.0).abs() < 12.0, "{colour:?}: {last:?}");
            assert!((5.0..13.0).contains(&found.width), "{}", found.width);
        }
    }

    #[test]
    fn a_stem_with_a_row_of_marks_ends_between_the_topmost_and_its_leaf() {
        let rise = |marks: &[f64]| {
            let found = find_stem(&marked_picture([40.0, 60.0, 240.0], marks), [70.0, 170.0], 6.0).unwrap();
            170.0 - found.line[found.line.len() - 1][1]
        };
        let ends = [rise(&[54.0, 64.0, 74.0]), rise(&[20.0, 40.0, 60.0])];
        assert!((80.0..100.0).contains(&ends[0]), "{ends:?}");
        assert!((66.0..ends[0]).contains(&ends[1]), "{ends:?}");
    }

    #[test]
    fn no_stem_is_given_where_none_is_clear() {
        let stem = picture([40.0, 60.0, 240.0]);
        assert!(find_stem(&stem, [20.0, 80.0], 6.0).is_none(), "the wall");
        let short =
            Image { rgb: stem.rgb[3 * SIZE.0 * 60..3 * SIZE.0 * 100].to_vec(), height: 40, ..stem.clone() };
        assert!(find_stem(&short, [80.0, 39.0], 6.0).is_none(), "too short to tell");
        assert!(find_stem(&Image { width: 8, height: 8, rgb: vec![9; 192] }, [4.0, 7.0], 6.0).is_none());
    }
}
