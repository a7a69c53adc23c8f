//! A plant in one picture.

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

/// What a picture shows of a plant; `None` where it shows none, or where the crop does not lie in it.
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

/// [`look`], for a plant whose stem leaves the soil at `base`; without one it is taken to stand at the middle of the
/// crop's lower edge.
#[must_use]
pub fn detect_from_base(
    image: &impl PixelSource,
    base: Option<Pixel>,
    config: &VisionConfig,
) -> Option<Detection> {
    let (width, height) = image.size();
    config.check(width, height).ok()?;
    let crop = config.region(width, height);
    if config.mode == Mode::Robust {
        let seen = robust::detect(image, crop, base, config);
        return match base.filter(|_| config.stem) {
            Some(base) => ridge::detect(image, crop, base, config, seen),
            None => seen,
        };
    }
    paper::detect(image, crop, config)
}
