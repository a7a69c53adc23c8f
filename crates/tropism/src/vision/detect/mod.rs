//! Detection of a plant in one picture.
//!
//! In: a picture, a crop, and where the stem leaves the soil. Out: a [`Detection`], or `None`. The one
//! idea: detection is a pure function of one picture; other pictures belong to tracking.
//!
//! Mode `robust` finds the plant by its [colour] and [connectivity](connected_components), its tip by the [highest
//! edge](tip) and its stem by [shortest paths](midline). Where the crop does not exclude a bright pot, the
//! stem is found by its form, as a ridge. Mode `paper` is the paper's method ([`tip::highest_sample`],
//! [`stem::row_medians`]).

pub mod occupancy;
pub mod detection;
pub mod lamp_state;
pub mod colour;
pub mod hysteresis;
pub mod curve;
pub mod connected_components;
pub(super) mod pole;
mod distance_transform;
mod geodesic;
mod cross_section;
pub mod midline;
mod forest;
pub mod learned_stem;
mod second_foot;
pub mod tip;
pub mod stem;
mod paper;
mod occlusion;
pub mod silhouette;
mod view;
mod robust;
mod ridge;
#[cfg(test)]
mod testing;

use crate::geometry::{Pixel, Region, path};
use crate::math::statistics::upper_median;
use crate::vision::config::{Direction, Mode, VisionConfig};
use crate::vision::raster::source::{PixelSource, coarse_luma};
use detection::Detection;
use pole::PoleView;
use view::View;

/// Detects a plant in a picture; `None` where there is none, or where the crop does not lie in the picture.
///
/// ```
/// use tropism::photo::Image;
/// use tropism::vision::{VisionConfig, detect};
/// let mut image = Image { width: 64, height: 48, rgb: vec![30; 3 * 64 * 48] };
/// for y in 20..48 {
///     image.rgb[3 * (64 * y + 40)..][..9].fill(220);
/// }
/// let tip = detect(&image, &VisionConfig::default()).unwrap().tip;
/// assert!((tip.x - 41.0).abs() < 0.1 && (tip.y - 19.5).abs() < 0.5);
/// ```
#[must_use]
pub fn detect(image: &dyn PixelSource, config: &VisionConfig) -> Option<Detection> {
    detect_from_base(image, None, config)
}

/// Detects a plant whose stem leaves the soil at `base`. Without a base the largest plant is detected, and its stem is
/// taken to begin at the middle of the crop's lower edge.
#[must_use]
pub fn detect_from_base(
    image: &dyn PixelSource,
    base: Option<Pixel>,
    config: &VisionConfig,
) -> Option<Detection> {
    detect_posed(image, base, config, None, false)
}

/// Detects a plant in any pose and tone; among `poles` one that grows upwards before a dark background, in mode `robust`.
///
/// In a photograph that `is_alone`, unrelated to any other, the stem is found by its form first.
pub(super) fn detect_posed(
    image: &dyn PixelSource,
    base: Option<Pixel>,
    config: &VisionConfig,
    poles: Option<&PoleView>,
    is_alone: bool,
) -> Option<Detection> {
    let (width, height) = image.size();
    config.check(width, height).ok()?;
    let crop = config.region(width, height);
    if poles.is_some() {
        return robust::detect(image, crop, base, config, poles);
    }
    // Detection knows one pose and one tone: pictures are turned and inverted instead.
    let is_light = config.mode == Mode::Robust && has_light_background(image);
    if config.up == Direction::Up && !is_light {
        return detect_upright(image, crop, base, config, is_alone);
    }
    let detect_as = |is_inverted| {
        let view = View::new(image, config.up, is_inverted);
        let base = base.map(|base| view.turn.pixel(base));
        let found = detect_upright(&view, view.turn.region(crop), base, config, is_alone)?;
        Some(view.detection_to_picture(found))
    };
    is_light.then(|| detect_as(true)).flatten().or_else(|| detect_as(false))
}

/// Median luma above which a background is light, and a plant may be darker. Chosen: half of the range.
const LIGHT: f32 = 128.0;

/// Whether most of a picture is light.
fn has_light_background(image: &dyn PixelSource) -> bool {
    upper_median(&coarse_luma(image), f32::total_cmp).is_some_and(|median| median > LIGHT)
}

/// A detection whose stem is at least as long as it is wide, or that has none.
fn without_stub(found: Detection) -> Detection {
    let length = found.stem.as_deref().map(path::length);
    match found.stem_width.zip(length) {
        Some((width, length)) if length < width => {
            Detection { apex: None, stem: None, stem_width: None, ..found }
        }
        _ => found,
    }
}

/// Detects a plant that grows upwards and is lighter than its background.
fn detect_upright(
    image: &dyn PixelSource,
    crop: Region,
    base: Option<Pixel>,
    config: &VisionConfig,
    is_alone: bool,
) -> Option<Detection> {
    match config.mode {
        Mode::Paper => paper::detect(image, crop, config),
        Mode::Robust => {
            let by_colour = robust::detect(image, crop, base, config, None);
            let found = match base.filter(|_| config.stem) {
                Some(base) => ridge::detect(image, crop, base, config, by_colour, is_alone),
                None => by_colour,
            };
            found.map(without_stub)
        }
    }
}
