//! Reference picture of a camera: what later pictures are compared with.
//!
//! In: the first pictures of a camera, then others. Out: the camera's shift, and whether a picture is much darker or
//! flatter than the reference.

use crate::geometry::{Pixel, Region};
use crate::math::statistics::upper_median;
use crate::vision::camera::registration::ReferenceFeatures;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::source::{PixelSource, coarse_luma, sample_luma};

/// Ratio of brightness or contrast from which on a picture is the better reference. Chosen by hand.
const BETTER_RATIO: f64 = 1.6;

/// Contrast, as a share of the reference's, below which a picture is misty. Chosen by hand on rendered frames:
/// higher, one clean tent in sixteen was called misty when the other lamp was lit.
const MISTY_CONTRAST: f64 = 0.43;

/// Brightness, as a share of the reference's, below which a picture is dark. Chosen by hand.
const DARK_BRIGHTNESS: f64 = 0.5;

/// Contrast of a black picture's brightest parts, in standard deviations of its noise, at most. Chosen by hand.
const BLACK_CONTRAST: f64 = 5.0;

/// Grey level that the brightest parts of a black picture stay below. Chosen by hand: a quarter of the range.
const BLACK_LEVEL: f32 = 64.0;

/// Share of samples at the median luma above which a picture is drawn, and the greatest difference from the median. Chosen:
/// letters and pictograms cover less than a third of a title, and no photograph has so little noise.
const DRAWN_SHARE: f64 = 0.66;
const EVEN_LUMA: f32 = 0.02;

/// Least difference of a title's ground from the background of the photographs, in grey levels. Chosen: a smaller one is
/// another photograph with less noise.
const TITLE_LUMA: f64 = 4.0;

/// Columns at which a picture is searched for bright parts. Chosen by hand.
const COARSE_COLUMNS: usize = 256;

/// Reference picture of a camera.
#[derive(Clone, Debug)]
pub(in crate::vision) struct Background {
    features: ReferenceFeatures,
    tone: Tone,
}

/// Global tone of a picture, from means of 8 x 8 pixels.
#[derive(Clone, Copy, Debug)]
pub(in crate::vision) struct Tone {
    /// Median luma, 0 to 255.
    brightness: f64,
    /// Whether it is drawn, such as a title: most samples have the same value.
    is_drawn: bool,
}

impl Tone {
    /// The tone of a picture.
    pub(in crate::vision) fn of(image: &dyn PixelSource) -> Self {
        let values = coarse_luma(image);
        let brightness = upper_median(&values, f32::total_cmp).unwrap_or(0.0);
        let even = values.iter().filter(|&&value| (value - brightness).abs() < EVEN_LUMA).count();
        Self { brightness: f64::from(brightness), is_drawn: even as f64 > DRAWN_SHARE * values.len() as f64 }
    }
}

impl Background {
    /// A picture as the reference; its features are taken outside the inner part of `crop`.
    pub(in crate::vision) fn of(image: &dyn PixelSource, crop: Option<Region>) -> Self {
        Self { features: ReferenceFeatures::extract(image, crop), tone: Tone::of(image) }
    }

    /// Whether another picture is the better reference: this one was dark, misty or drawn.
    pub(in crate::vision) fn is_exceeded_by(&self, image: &dyn PixelSource) -> bool {
        let tone = Tone::of(image);
        if self.tone.is_drawn != tone.is_drawn {
            return self.tone.is_drawn;
        }
        tone.brightness > BETTER_RATIO * self.tone.brightness.max(1.0)
            || self.features.relative_contrast(image, Pixel::default()) > BETTER_RATIO
    }

    /// Estimates the shift of a picture, in pixels to the right and down; `None` where it cannot be registered.
    pub(in crate::vision) fn estimate_shift(&self, image: &dyn PixelSource) -> Option<Pixel> {
        self.features.estimate_shift(image)
    }

    /// Whether the reference has so many features that a failed registration means a turned camera.
    pub(in crate::vision) fn has_enough_features(&self) -> bool {
        self.features.has_enough()
    }

    /// Whether mist took the contrast of a picture that has shifted by `shift`.
    pub(in crate::vision) fn is_misty(&self, image: &dyn PixelSource, shift: Pixel) -> bool {
        self.features.relative_contrast(image, shift) < MISTY_CONTRAST
    }

    /// Whether a picture of a tone is much darker.
    pub(in crate::vision) fn is_darkened(&self, tone: Tone) -> bool {
        tone.brightness < DARK_BRIGHTNESS * self.tone.brightness
    }

    /// Whether a picture of a tone is drawn among photographs, on another ground: a title.
    pub(in crate::vision) const fn is_title(&self, tone: Tone) -> bool {
        let difference = tone.brightness - self.tone.brightness;
        tone.is_drawn && !self.tone.is_drawn && (difference > TITLE_LUMA || difference < -TITLE_LUMA)
    }
}

/// Whether a picture is black but for noise. A white wall has as little contrast, but is bright.
pub(in crate::vision) fn is_black(image: &dyn PixelSource) -> bool {
    let size = image.size();
    let plane = sample_luma(image, Region::whole(size), 0.0, (size.0 / COARSE_COLUMNS).max(1));
    let levels = Levels::of(&plane.values, plane.values.len() / 1_000);
    levels.contrast() < BLACK_CONTRAST && levels.bright < BLACK_LEVEL
}
