//! The paper's method.

use crate::geometry::{Pixel, Region};
use crate::vision::config::VisionConfig;
use crate::vision::detect::detection::Detection;
use crate::vision::detect::{stem, tip};
use crate::vision::raster::levels::Levels;
use crate::vision::raster::source::{PaddedCrop, PixelSource, sample_luma};

/// What a picture shows of the plant.
pub(super) fn detect(image: &impl PixelSource, crop: Region, config: &VisionConfig) -> Option<Detection> {
    let (width, _) = image.size();
    let step = config.step(width);
    let sigma = config.sigma * step as f64;
    // At the picture's own resolution tip and stem need the same pixels.
    let near = (step == 1).then(|| PaddedCrop::of(image, crop, sigma));
    let plane = match &near {
        Some(near) => near.sample_luma(sigma, step),
        None => sample_luma(image, crop, sigma, step),
    };
    let levels = Levels::from_plane(&plane, config.bright_samples);
    let contrast = levels.contrast();
    if contrast <= config.contrast {
        return None;
    }
    let tip = tip::highest_sample(&plane, levels.threshold(config.threshold))?;
    let medians = || {
        let PaddedCrop { part, crop, origin } = near.unwrap_or_else(|| PaddedCrop::of(image, crop, 0.0));
        let stem = stem::row_medians(&part, crop, &config.gates).into_iter();
        stem.map(|at| Pixel::new(at.x + origin.x, at.y + origin.y)).collect::<Vec<_>>()
    };
    let stem = config.stem.then(medians).filter(|stem| stem.len() > 1);
    Some(Detection { tip, stem, contrast, ..Detection::default() })
}
