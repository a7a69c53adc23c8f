//! The paper's method.

use crate::geometry::{Pixel, Region};
use crate::vision::config::VisionConfig;
use crate::vision::detect::detection::Sighting;
use crate::vision::detect::{stem, tip};
use crate::vision::raster::levels::Levels;
use crate::vision::raster::source::{Near, Pixels, desaturated};

/// What a picture shows of the plant.
pub(super) fn look(image: &impl Pixels, crop: Region, config: &VisionConfig) -> Option<Sighting> {
    let (width, _) = image.size();
    let step = config.step(width);
    let sigma = config.sigma * step as f64;
    // At the picture's own resolution tip and stem need the same pixels.
    let near = (step == 1).then(|| Near::of(image, crop, sigma));
    let plane = match &near {
        Some(near) => near.desaturated(sigma, step),
        None => desaturated(image, crop, sigma, step),
    };
    let levels = Levels::of(&plane, config.bright_samples);
    let contrast = levels.contrast();
    if contrast <= config.contrast {
        return None;
    }
    let tip = tip::highest(&plane, levels.threshold(config.threshold))?;
    let medians = || {
        let Near { part, crop, origin } = near.unwrap_or_else(|| Near::of(image, crop, 0.0));
        let stem = stem::medians(&part, crop, &config.gates).into_iter();
        stem.map(|at| Pixel::new(at.x + origin.x, at.y + origin.y)).collect::<Vec<_>>()
    };
    let stem = config.stem.then(medians).filter(|stem| stem.len() > 1);
    Some(Sighting { tip, stem, contrast, ..Sighting::default() })
}
