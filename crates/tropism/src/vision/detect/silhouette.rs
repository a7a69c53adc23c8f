//! Midline of a silhouette: a shoot that was cut out of its photograph, light before dark.

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::detect::connected_components::{ConnectedComponents, REACH};
use crate::vision::detect::hysteresis::Evidence;
use crate::vision::detect::midline;
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::plane::LUMA;

/// Least number of samples along the shorter side of a silhouette. Chosen by hand.
const MIN_SAMPLES: usize = 600;

/// The midline of a silhouette from `base` to the end that is farthest along it; `None` where nothing is light.
///
/// No leaves are expected: the farthest end is the stem's.
#[must_use]
pub fn silhouette_midline(image: &Image, base: Pixel) -> Option<Vec<Pixel>> {
    let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
    let step = (image.width.min(image.height) / MIN_SAMPLES).max(1);
    if !whole.fits(image.width, image.height) {
        return None;
    }
    let mut plane = sample_gaussian(image, whole, LUMA, 0.5 * step as f64, step);
    let brightest = plane.values.iter().copied().fold(0.0, f32::max).max(1.0);
    plane.values.iter_mut().for_each(|value| *value /= brightest);
    let classify = |&value: &f32| if value > 0.5 { Evidence::Strong } else { Evidence::None };
    let evidence: Vec<Evidence> = plane.values.iter().map(classify).collect();
    let anchor = plane.to_sample(base);
    let components = ConnectedComponents::label(&evidence, plane.width, REACH, anchor);
    let label = components.largest(1)?;
    let bounds = components.component(label).bounds;
    let is_plant = |at: usize| components.labels[at] == label;
    let line = midline::trace_longest(&plane, bounds, is_plant, anchor, REACH)?;
    Some(line.into_iter().map(|(x, y)| plane.to_pixel(x, y)).collect())
}
