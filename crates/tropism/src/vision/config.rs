//! How a plant is found in a picture.

use serde::{Deserialize, Serialize};

use crate::geometry::Region;
use crate::vision::error::VisionError;

/// How a picture is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// The paper's method: the highest bright sample of the crop.
    Paper,
    /// The highest point, between samples, of the plant that stands at the base.
    #[default]
    Robust,
}

/// How a plant is found in a picture; the default is what the paper says, and a choice of ours where it is silent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VisionConfig {
    /// The paper's method or the robust one.
    pub mode: Mode,
    /// "The extents of actual plant growth (to exclude the pot and light sources)", section 2.2.2; `None` is the whole
    /// picture.
    pub crop: Option<Region>,
    /// Columns that a whole picture is sampled down to at least: every n-th pixel is read, n being the greatest whole
    /// number that leaves as many. The paper does not give its "sampling resolution"; 648 is a quarter of its camera's.
    pub sampling_columns: usize,
    /// Deviation of the Gaussian filter, in samples. The paper does not give it.
    pub sigma: f64,
    /// A sample is plant above this share of the way from the background's level to the brightest samples'. The paper
    /// says "the brightest pixels"; one half puts the edge of a smoothed stem where the stem ends.
    pub threshold: f64,
    /// Samples that are as bright as the plant, at least: what "the brightest" are is read from this many.
    pub bright_samples: usize,
    /// The brightest samples must exceed the background by more of its deviations than this, or no plant is seen; in mode
    /// `robust` the plant's learned colour too.
    pub contrast: f64,
    /// Whether the stem is looked for too: by eqs. (10) and (11) in mode `paper`, as the plant's midline in `robust`.
    pub stem: bool,
    /// The gates of eq. (10), in mode `paper`.
    pub gates: StemConfig,
    /// The history rule of eq. (11), in mode `paper`.
    pub hold: HoldConfig,
}

impl Default for VisionConfig {
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            crop: None,
            sampling_columns: 648,
            sigma: 0.5,
            threshold: 0.5,
            bright_samples: 20,
            contrast: 6.0,
            stem: true,
            gates: StemConfig::default(),
            hold: HoldConfig::default(),
        }
    }
}

impl VisionConfig {
    /// Checks that every value can be one and that the crop lies in pictures of `width` x `height`.
    ///
    /// # Errors
    /// [`VisionError`] names the key or the region.
    pub fn check(&self, width: usize, height: usize) -> Result<(), VisionError> {
        let number = |key, found: f64, is_right: bool, wanted| {
            let error = VisionError::Value { key, found: found.to_string(), wanted };
            if found.is_finite() && is_right { Ok(()) } else { Err(error) }
        };
        let share =
            |key, found: f64| number(key, found, found > 0.0 && found < 1.0, "a share between 0 and 1");
        number("sampling_columns", self.sampling_columns as f64, self.sampling_columns > 0, "at least 1")?;
        number("sigma", self.sigma, (0.0..=20.0).contains(&self.sigma), "0 to 20 samples")?;
        share("threshold", self.threshold)?;
        number("bright_samples", self.bright_samples as f64, self.bright_samples > 0, "at least 1")?;
        number("contrast", self.contrast, self.contrast >= 0.0, "0 or more deviations")?;
        for (key, value) in [
            ("excess", self.gates.excess),
            ("green", self.gates.green),
            ("brightness", self.gates.brightness),
        ] {
            number(key, value, (0.0..=1.0).contains(&value), "0 to 1")?;
        }
        for (key, value) in [("length", self.hold.length), ("start", self.hold.start), ("end", self.hold.end)]
        {
            number(key, value, value > 0.0, "a share of the length above 0")?;
        }
        let region = self.region(width, height);
        if region.fits(width, height) { Ok(()) } else { Err(VisionError::Region { region, width, height }) }
    }

    pub(super) fn region(&self, width: usize, height: usize) -> Region {
        self.crop.unwrap_or(Region { x: 0, y: 0, width, height })
    }

    /// Pixels from one sample to the next in a picture of so many columns.
    pub(super) fn step(&self, width: usize) -> usize {
        (width / self.sampling_columns.max(1)).max(1)
    }
}

/// What the brightness V of eq. (10) is: the paper does not say.
///
/// With [`Self::Max`] the gate `G >= 0.75` of eq. (10) would be redundant, which speaks against it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Brightness {
    /// The largest of red, green and blue: the V of HSV.
    Max,
    /// The mean of the largest and the smallest: the L of HSL, and what .NET's `GetBrightness` returns, which the
    /// paper's IronPython could call.
    #[default]
    Lightness,
    /// 0.299 red, 0.587 green, 0.114 blue.
    Luma,
}

/// How the channels are "remapped onto the domain (0.0, 1.0)" (section 4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Remap {
    /// 0 to 0, 255 to 1.
    #[default]
    Fixed,
    /// The least value of the channel in the crop to 0, the greatest to 1.
    Stretch,
}

/// The gates of eq. (10) and the choices that the paper leaves open there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StemConfig {
    /// Least G - R and G - B of a pixel that is plant by its colour: 0.5.
    pub excess: f64,
    /// Least G of a pixel that is plant: 0.75.
    pub green: f64,
    /// Least V of a pixel that is plant: 0.75.
    pub brightness: f64,
    /// What V is.
    pub value: Brightness,
    /// How channels are mapped to 0 to 1.
    pub remap: Remap,
}

impl Default for StemConfig {
    fn default() -> Self {
        Self {
            excess: 0.5,
            green: 0.75,
            brightness: 0.75,
            value: Brightness::default(),
            remap: Remap::default(),
        }
    }
}

/// The bounds of eq. (11), as shares of the stem's length L at this step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HoldConfig {
    /// A change of L of this share or more is an error: 0.25.
    pub length: f64,
    /// A step of the starting vertex S of this share of L or more is an error: 0.25.
    pub start: f64,
    /// A step of the ending vertex E of this share of L or more is an error: 0.5.
    pub end: f64,
    /// Held steps in a row after which the new stem is believed; `None` never, as in the paper, where one bad picture
    /// can then hold for ever.
    pub release: Option<u32>,
}

impl Default for HoldConfig {
    fn default() -> Self {
        Self { length: 0.25, start: 0.25, end: 0.5, release: None }
    }
}
