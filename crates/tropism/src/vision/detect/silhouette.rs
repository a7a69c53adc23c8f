//! Midline of a silhouette: a shoot that was cut out of its photograph, light before dark.
//!
//! In: a picture of two levels. Out: the midline to the farthest end. The one idea: a shoot that was
//! cut out has nothing beside it, so all of it is stem.

use crate::geometry::Pixel;
use crate::photo::Image;
use crate::vision::detect::connected_components::{ConnectedComponents, REACH};
use crate::vision::detect::hysteresis::double_threshold;
use crate::vision::detect::midline;
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::{LUMA, Plane};

/// Least number of samples along the shorter side of a silhouette. Chosen by hand.
const MIN_SAMPLES: usize = 600;

/// Greatest distance of a silhouette's samples from their level, as a share of the contrast. Chosen by hand: JPEG files
/// have ripples along edges.
const MAX_UNEVENNESS: f32 = 0.04;

/// Least share of the samples of background and shoot that are so near to their level. Chosen by hand: no photograph of
/// the real sets has as many, and each silhouette has.
const MIN_EVEN: [f64; 2] = [0.97, 0.6];

/// Whether a plane shows a silhouette: nearly all samples have one of two levels.
pub(super) fn is_silhouette(plane: &Plane, levels: &Levels) -> bool {
    let range = levels.bright - levels.background;
    let middle = levels.threshold(0.5);
    let (mut all, mut even) = ([0_usize; 2], [0_usize; 2]);
    for &value in &plane.values {
        let (kind, level) = if value > middle { (1, levels.bright) } else { (0, levels.background) };
        all[kind] += 1;
        even[kind] += usize::from((value - level).abs() <= MAX_UNEVENNESS * range);
    }
    // Grey values are whole: a range of less than a few tens says nothing.
    range > 1.0 / MAX_UNEVENNESS
        && (0..2).all(|kind| even[kind] as f64 >= MIN_EVEN[kind] * all[kind].max(1) as f64)
}

/// The midline of a silhouette from `base` to the end that is farthest along it; `None` where nothing is light.
///
/// Leaves are not expected: the farthest end is the stem's.
#[must_use]
pub fn silhouette_midline(image: &Image, base: Pixel) -> Option<Vec<Pixel>> {
    let whole = image.region();
    let step = (image.width.min(image.height) / MIN_SAMPLES).max(1);
    if !whole.fits(image.width, image.height) {
        return None;
    }
    let mut plane = sample_gaussian(image, whole, LUMA, 0.5 * step as f64, step);
    let brightest = plane.values.iter().copied().fold(0.0, f32::max).max(1.0);
    plane.values.iter_mut().for_each(|value| *value /= brightest);
    let evidence = double_threshold(&plane.values, 0.5, 0.5);
    let anchor = plane.to_sample(base);
    let components = ConnectedComponents::label(&evidence, plane.width, REACH, anchor);
    let label = components.largest(1)?;
    let bounds = components.component(label).bounds;
    let is_plant = |at: usize| components.labels[at] == label;
    let line = midline::trace_longest(&plane, bounds, is_plant, anchor, REACH)?;
    Some(line.into_iter().map(|at| plane.to_pixel(at)).collect())
}
