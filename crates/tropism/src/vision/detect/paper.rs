//! Detection in mode `paper` (sections 2.2.2 and 4): the highest bright sample, and the row medians of plant pixels.
//!
//! In: a picture and a crop. Out: the paper's tip and stem. The history rule, eq. (11), is applied by a tracker.

use crate::geometry::Region;
use crate::vision::config::VisionConfig;
use crate::vision::detect::detection::Detection;
use crate::vision::detect::{stem, tip};
use crate::vision::raster::levels::Levels;
use crate::vision::raster::source::{PaddedCrop, PixelSource, sample_luma};

/// Detects the plant in a crop.
pub(super) fn detect(image: &dyn PixelSource, crop: Region, config: &VisionConfig) -> Option<Detection> {
    let (width, _) = image.size();
    let step = config.step(width);
    let sigma = config.sigma * step as f64;
    // At full resolution tip and stem are read from the same pixels.
    let padded = (step == 1).then(|| PaddedCrop::of(image, crop, sigma));
    let plane = match &padded {
        Some(padded) => padded.sample_luma(sigma, step),
        None => sample_luma(image, crop, sigma, step),
    };
    let levels = Levels::from_plane(&plane, config.bright_samples);
    let contrast = levels.contrast();
    if contrast <= config.contrast {
        return None;
    }
    let tip = tip::highest_sample(&plane, levels.threshold(config.threshold))?;
    let row_medians = || {
        let PaddedCrop { pixels, crop, origin } = padded.unwrap_or_else(|| PaddedCrop::of(image, crop, 0.0));
        let stem = stem::row_medians(&pixels, crop, &config.gates).into_iter();
        stem.map(|at| at + origin).collect::<Vec<_>>()
    };
    let stem = config.stem.then(row_medians).filter(|stem| stem.len() > 1);
    Some(Detection { tip, stem, contrast, ..Detection::default() })
}
