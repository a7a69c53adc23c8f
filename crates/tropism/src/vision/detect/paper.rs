//! Detection in mode `paper` (sections 2.2.2 and 4): the highest bright sample, and the row medians of plant pixels.
//!
//! In: a picture and a crop. Out: the paper's tip and stem. The history rule, eq. (11), is applied by a tracker.

use crate::geometry::{Pixel, Region};
use crate::vision::config::VisionConfig;
use crate::vision::detect::detection::Detection;
use crate::vision::detect::{stem, tip};
use crate::vision::raster::levels::Levels;
use crate::vision::raster::source::{PixelSource, sample_luma};

/// Detects the plant in a crop.
pub(super) fn detect(image: &dyn PixelSource, crop: Region, config: &VisionConfig) -> Option<Detection> {
    let (width, _) = image.size();
    let step = config.step(width);
    let sigma = config.sigma * step as f64;
    let plane = sample_luma(image, crop, sigma, step);
    let levels = Levels::of(&plane.values, config.bright_samples);
    let contrast = levels.contrast();
    if contrast <= config.contrast {
        return None;
    }
    let tip = tip::highest_sample(&plane, levels.threshold(config.threshold))?;
    let row_medians = || {
        let pixels = image.crop(crop);
        let stem = stem::row_medians(&pixels, pixels.region(), &config.gates).into_iter();
        stem.map(|at| at + Pixel::new(crop.x as f64, crop.y as f64)).collect::<Vec<_>>()
    };
    let stem = config.stem.then(row_medians).filter(|stem| stem.len() > 1);
    Some(Detection { tip, stem, contrast, ..Detection::default() })
}
