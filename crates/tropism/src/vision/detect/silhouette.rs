//! The midline of a silhouette.

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::detect::connected_components::ConnectedComponents;
use crate::vision::detect::hysteresis::Evidence;
use crate::vision::detect::midline;
use crate::vision::detect::robust::REACH;
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::plane::LUMA;

/// Samples along the shorter side of a silhouette, at least.
const SILHOUETTE: usize = 600;

/// The midline of a silhouette, light before dark, from where it stands at `base` to the end that is farthest from there
/// along it; `None` where there is nothing light.
///
/// For shoots that were cut out of their photographs. No leaves are expected on them: what the farthest end belongs to is
/// the stem.
#[must_use]
pub fn silhouette_midline(image: &Image, base: Pixel) -> Option<Vec<Pixel>> {
    let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
    let step = (image.width.min(image.height) / SILHOUETTE).max(1);
    if !whole.fits(image.width, image.height) {
        return None;
    }
    let mut plane = sample_gaussian(image, whole, LUMA, 0.5 * step as f64, step);
    let brightest = plane.values.iter().copied().fold(0.0, f32::max).max(1.0);
    plane.values.iter_mut().for_each(|value| *value /= brightest);
    let light = |&value: &f32| if value > 0.5 { Evidence::Strong } else { Evidence::None };
    let belief: Vec<Evidence> = plane.values.iter().map(light).collect();
    let components = ConnectedComponents::label(&belief, plane.width, REACH, plane.to_sample(base));
    let chosen = components.largest(1)?;
    let bounds = components.components[chosen as usize - 1].bounds;
    let line = midline::trace_longest(
        &plane,
        bounds,
        |at| components.labels[at] == chosen,
        plane.to_sample(base),
        REACH,
    )?;
    Some(line.into_iter().map(|(x, y)| plane.to_pixel(x, y)).collect())
}
