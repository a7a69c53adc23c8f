//! From a photograph to the tip and the stem of the plant in it, in centimetres (sections 2.2.2 and 4).
//!
//! In: photographs, in order. Out: what each shows, and why where it shows nothing. The one idea: [`look`] is pure and
//! knows one picture; [`Eye`] adds what a camera's place ([`Calibration`]) and the last sighting know.
//!
//! Two modes. [`Mode::Paper`] does what the paper says, word for word. [`Mode::Robust`], the default, believes only
//! what hangs together with the stem's base and places the tip between pixels.

pub mod calibration;
pub mod colour;
pub mod hold;
pub mod lit;
pub mod midline;
pub mod overlay;
pub mod parts;
pub mod robust;
pub mod segment;
pub mod stem;
pub mod tip;
mod ways;

use serde::{Deserialize, Serialize};

use crate::geometry::{Pixel, Point, Polyline, Region};
use crate::observation::{Observation, Quality};
use crate::photo::{Image, Photo, PhotoError};

pub use calibration::Calibration;
pub use lit::lit;

use hold::{Hold, HoldConfig};
use segment::Levels;
use stem::StemConfig;

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

/// Why pictures cannot be read as they should be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VisionError {
    /// A value that cannot be one.
    #[error("found {key} = {found}, wanted {wanted}")]
    Value {
        /// The key in the file.
        key: &'static str,
        /// Its value.
        found: String,
        /// What it should be.
        wanted: &'static str,
    },
    /// A region with nothing in it or with parts outside the picture.
    #[error("found region {region:?}, wanted one inside a picture of {width} x {height}")]
    Region {
        /// The region.
        region: Region,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// A calibration for pictures of another size.
    #[error("found a picture of {width} x {height}, wanted {wanted_width} x {wanted_height} as calibrated")]
    Size {
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
        /// Columns calibrated for.
        wanted_width: usize,
        /// Rows calibrated for.
        wanted_height: usize,
    },
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

    fn region(&self, width: usize, height: usize) -> Region {
        self.crop.unwrap_or(Region { x: 0, y: 0, width, height })
    }

    /// Pixels from one sample to the next in a picture of so many columns.
    fn step(&self, width: usize) -> usize {
        (width / self.sampling_columns.max(1)).max(1)
    }
}

/// What one photograph shows of a plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sighting {
    /// The highest point of the plant: the paper's tip.
    pub tip: Pixel,
    /// The end of the stem, where leaves begin or a second limb parts from it: the last point of the midline, in mode
    /// `robust`.
    pub apex: Option<Pixel>,
    /// The stem from the base up, where it was asked for and is in view: one point a row in mode `paper`, the midline
    /// in `robust`.
    pub stem: Option<Vec<Pixel>>,
    /// How many deviations of the background the brightest of the plant exceeds it by.
    pub contrast: f64,
}

/// What a picture shows of a plant; `None` where it shows none, or where the crop does not lie in it.
///
/// ```
/// use tropism::photo::Image;
/// use tropism::vision::{VisionConfig, look};
/// let mut image = Image { width: 64, height: 48, rgb: vec![30; 3 * 64 * 48] };
/// for y in 20..48 {
///     image.rgb[3 * (64 * y + 40)..][..9].fill(220);
/// }
/// let tip = look(&image, &VisionConfig::default()).unwrap().tip;
/// assert!((tip.x - 41.0).abs() < 0.1 && (tip.y - 19.5).abs() < 0.5);
/// ```
#[must_use]
pub fn look(image: &Image, config: &VisionConfig) -> Option<Sighting> {
    look_from(image, None, config)
}

/// [`look`], for a plant whose stem leaves the soil at `base`; without one it is taken to stand at the middle of the
/// crop's lower edge.
#[must_use]
pub fn look_from(image: &Image, base: Option<Pixel>, config: &VisionConfig) -> Option<Sighting> {
    config.check(image.width, image.height).ok()?;
    let crop = config.region(image.width, image.height);
    if config.mode == Mode::Robust {
        return robust::look(image, crop, base, config);
    }
    let step = config.step(image.width);
    let plane = segment::sample(image, crop, segment::LUMA, config.sigma * step as f64, step);
    let levels = Levels::of(&plane, config.bright_samples);
    let contrast = levels.contrast();
    if contrast <= config.contrast {
        return None;
    }
    let tip = tip::highest(&plane, levels.threshold(config.threshold))?;
    let stem = config.stem.then(|| stem::medians(image, crop, &config.gates)).filter(|stem| stem.len() > 1);
    Some(Sighting { tip, apex: None, stem, contrast })
}

/// What became of one photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// A plant is seen.
    Ok,
    /// The file is empty, damaged or cut short.
    Corrupt,
    /// The file is no picture, or one of another size than the calibration holds for.
    Foreign,
    /// The picture is black: the flash or the camera failed.
    Dark,
    /// No plant is seen, as before emergence.
    NoPlant,
    /// The same bytes as the photograph before: the camera hangs.
    Repeated,
}

impl Class {
    /// Every class.
    pub const ALL: [Self; 6] =
        [Self::Ok, Self::Corrupt, Self::Foreign, Self::Dark, Self::NoPlant, Self::Repeated];

    /// The word used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Corrupt => "corrupt",
            Self::Foreign => "foreign",
            Self::Dark => "dark",
            Self::NoPlant => "no_plant",
            Self::Repeated => "repeated",
        }
    }
}

impl std::fmt::Display for Class {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl std::str::FromStr for Class {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let class = Self::ALL.into_iter().find(|class| class.name() == word);
        class.ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            format!("found class {word:?}, wanted one of {}", names.join(", "))
        })
    }
}

/// What an [`Eye`] makes of one photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// The tip in cm, measured or held; `None` before the first sighting.
    pub observation: Option<Observation>,
    /// The tip in this photograph; `None` where the observation is held.
    pub pixel: Option<Pixel>,
    /// Why it is held, if it is.
    pub class: Class,
}

/// Sees one plant in the photographs of one camera, and remembers where it was seen last.
///
/// A killed run goes on as if it had not been: see [`Eye::resume`].
#[derive(Clone, Debug)]
pub struct Eye {
    calibration: Calibration,
    config: VisionConfig,
    last: Option<Point>,
    stems: Hold,
    /// The bytes of the latest photograph.
    bytes: Vec<u8>,
}

impl Eye {
    /// An eye that has seen nothing yet.
    ///
    /// # Errors
    /// [`VisionError`] where a value cannot be one or the crop does not lie in pictures of the calibrated size.
    pub fn new(calibration: Calibration, config: VisionConfig) -> Result<Self, VisionError> {
        calibration.check()?;
        config.check(calibration.width, calibration.height)?;
        Ok(Self { calibration, config, last: None, stems: Hold::default(), bytes: Vec::new() })
    }

    /// Takes up a photograph of the run that was cut off, and what was seen in it then.
    pub fn resume(&mut self, photo: &Photo, seen: &Seen) {
        self.bytes.clone_from(&photo.bytes);
        self.last = seen.observation.as_ref().map(|held| held.tip);
    }

    /// The calibration it sees by.
    #[must_use]
    pub const fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The tip in the next photograph, or the last sighting where this one shows none. Never fails: what is wrong with
    /// the photograph is its [`Class`].
    pub fn observe(&mut self, photo: &Photo) -> Seen {
        let is_repeated = !photo.bytes.is_empty() && self.bytes == photo.bytes;
        self.bytes.clone_from(&photo.bytes);
        let sighting = if is_repeated { Err(Class::Repeated) } else { self.judge(photo.decode().as_ref()) };
        self.settle(sighting)
    }

    /// What a decoded photograph shows, without memory: the part of [`Eye::observe`] that can be done for many
    /// photographs at a time, in any order.
    ///
    /// # Errors
    /// The class of a photograph that shows no plant.
    pub fn judge(&self, picture: Result<&Image, &PhotoError>) -> Result<Sighting, Class> {
        let image = picture.map_err(|error| match error {
            PhotoError::Foreign(_) => Class::Foreign,
            _ => Class::Corrupt,
        })?;
        self.calibration.fits(image.width, image.height).map_err(|_| Class::Foreign)?;
        look_from(image, Some(self.calibration.base), &self.config)
            .ok_or_else(|| if is_dark(image) { Class::Dark } else { Class::NoPlant })
    }

    /// Takes what [`Eye::judge`] made of the next photograph into memory: the part that needs photographs in order.
    pub fn settle(&mut self, sighting: Result<Sighting, Class>) -> Seen {
        let class = sighting.as_ref().err().copied().unwrap_or(Class::Ok);
        let sighting = sighting.ok();
        let seen_stem = sighting.as_ref().and_then(|sighting| sighting.stem.as_deref()).map(|pixels| {
            Polyline(pixels.iter().map(|&pixel| self.calibration.point(pixel)).collect()).equidistant(10)
        });
        let rule = (self.config.mode == Mode::Paper).then_some(&self.config.hold);
        let (stem, _) = self.stems.settle(seen_stem, rule);
        let pixel = sighting.map(|sighting| sighting.tip);
        let quality = if pixel.is_some() { Quality::Measured } else { Quality::Held };
        self.last = pixel.map(|pixel| self.calibration.point(pixel)).or(self.last);
        let observation = self.last.map(|tip| Observation { tip, stem, quality });
        Seen { observation, pixel, class }
    }
}

/// Whether a picture is black but for noise: its brightest parts exceed its median by fewer than five deviations.
fn is_dark(image: &Image) -> bool {
    let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
    let plane = segment::sample(image, whole, segment::LUMA, 0.0, (image.width / 256).max(1));
    let levels = Levels::of(&plane, plane.values.len() / 1_000);
    levels.contrast() < 5.0
}
