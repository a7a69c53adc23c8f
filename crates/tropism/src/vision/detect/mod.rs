//! Detection of a plant in one picture.
//!
//! In: a picture, a crop, and where the stem leaves the soil. Out: a [`Detection`], or `None`. The one
//! idea: detection is a pure function of one picture; what is known of other pictures belongs to tracking.
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
pub mod connected_components;
pub mod curve;
mod distance_transform;
mod geodesic;
mod cross_section;
pub mod midline;
pub mod tip;
pub mod stem;
mod paper;
mod occlusion;
mod robust;
mod ridge;
pub mod silhouette;

use crate::geometry::Pixel;
use crate::vision::config::{Mode, VisionConfig};
use crate::vision::raster::source::PixelSource;
use detection::Detection;

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
pub fn detect(image: &impl PixelSource, config: &VisionConfig) -> Option<Detection> {
    detect_from_base(image, None, config)
}

/// Detects a plant whose stem leaves the soil at `base`. Without a base the largest plant is detected, and its stem is
/// taken to begin at the middle of the crop's lower edge.
#[must_use]
pub fn detect_from_base(
    image: &impl PixelSource,
    base: Option<Pixel>,
    config: &VisionConfig,
) -> Option<Detection> {
    let (width, height) = image.size();
    config.check(width, height).ok()?;
    let crop = config.region(width, height);
    match config.mode {
        Mode::Paper => paper::detect(image, crop, config),
        Mode::Robust => {
            let by_colour = robust::detect(image, crop, base, config);
            match base.filter(|_| config.stem) {
                Some(base) => ridge::detect(image, crop, base, config, by_colour),
                None => by_colour,
            }
        }
    }
}
