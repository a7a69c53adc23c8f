//! From a photograph to the tip and the stem of the plant in it, in centimetres (sections 2.2.2 and 4).
//!
//! In: photographs, in order. Out: what each shows, and why where it shows nothing. The one idea: [`look`] is pure and
//! knows one picture; [`Eye`] adds what the camera's place ([`Calibration`]) and the photographs before know.
//!
//! Two modes. [`Mode::Paper`] does what the paper says, word for word. [`Mode::Robust`], the default, believes only
//! what hangs together with the stem's base, places the tip between pixels, finds out whether the camera was moved, and
//! doubts what a plant cannot do in the time between two photographs.

pub mod backdrop;
pub mod calibration;
pub mod checkerboard;
pub mod colour;
mod follow;
pub mod hold;
pub mod lens;
pub mod lit;
pub mod midline;
pub mod motion;
pub mod overlay;
pub mod parts;
pub mod pixels;
mod ridge;
pub mod robust;
pub mod segment;
pub mod shape;
pub mod stem;
pub mod tip;
pub mod two_views;
mod ways;

use serde::{Deserialize, Serialize};

use crate::geometry::{Pixel, Point, Polyline, Region};
use crate::observation::{Observation, Quality};
use crate::photo::{Photo, PhotoError, Picture};

pub use calibration::Calibration;
pub use lit::lit;

use backdrop::Backdrop;
use follow::{Follow, Glimpse};
use hold::{Hold, HoldConfig};
use pixels::{Near, Pixels, desaturated, whole};
use segment::{Levels, Plane};
use shape::Shape;
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

/// An edge of a crop that a plant can grow out of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// The upper one.
    Top,
    /// The left one.
    Left,
    /// The right one.
    Right,
}

impl Edge {
    /// The word used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Top => "top",
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// What one photograph shows of a plant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Where there is tissue, in mode `robust`.
    pub shape: Shape,
    /// The edge of the crop that the plant reaches, if it does: its tip may lie beyond.
    pub cut: Option<Edge>,
    /// Whether glare, a shadow or mist lies on the tip, or the backdrop is not found again: the tip may be elsewhere.
    pub is_veiled: bool,
    /// Whether there is a backdrop and it is not found again: the camera may look elsewhere.
    pub is_lost: bool,
    /// How far the camera's picture has moved since the first one, in pixels to the right and down, as an [`Eye`] finds.
    pub shift: Pixel,
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
pub fn look(image: &impl Pixels, config: &VisionConfig) -> Option<Sighting> {
    look_from(image, None, config)
}

/// [`look`], for a plant whose stem leaves the soil at `base`; without one it is taken to stand at the middle of the
/// crop's lower edge.
#[must_use]
pub fn look_from(image: &impl Pixels, base: Option<Pixel>, config: &VisionConfig) -> Option<Sighting> {
    let (width, height) = image.size();
    config.check(width, height).ok()?;
    let crop = config.region(width, height);
    if config.mode == Mode::Robust {
        let seen = robust::look(image, crop, base, config);
        return match base.filter(|_| config.stem) {
            Some(base) => ridge::look(image, crop, base, config, seen),
            None => seen,
        };
    }
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
    /// Something looks otherwise than it can, as when a leaf, a fly or glare is in front of the plant.
    Ambiguous,
    /// The plant reaches out of the crop.
    LeavesView,
    /// The tip is farther from where it was than a plant can move.
    Jump,
    /// The tip is seen and believed, but the time since the photograph before is not the period.
    ClockGap,
}

impl Class {
    /// Every class.
    pub const ALL: [Self; 10] = [
        Self::Ok,
        Self::Corrupt,
        Self::Foreign,
        Self::Dark,
        Self::NoPlant,
        Self::Repeated,
        Self::Ambiguous,
        Self::LeavesView,
        Self::Jump,
        Self::ClockGap,
    ];

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
            Self::Ambiguous => "ambiguous",
            Self::LeavesView => "leaves_view",
            Self::Jump => "jump",
            Self::ClockGap => "clock_gap",
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
    /// The tip in this photograph where one is found, whether or not it is believed.
    pub pixel: Option<Pixel>,
    /// Why it is held, if it is.
    pub class: Class,
    /// How far what is seen can be trusted, 0 to 1: by its contrast, and by how well it fits what was seen before. Halved
    /// with each photograph in which the last sighting is held.
    pub confidence: f64,
    /// How far the camera's picture has moved since the first one, in pixels to the right and down; `None` where nothing
    /// can be said.
    pub shift: Option<Pixel>,
}

/// Minutes from one photograph to the next, unless their times say otherwise (section 2.2.2).
const PERIOD_MIN: f64 = 5.0;

/// A picture is clearer than another that is this many times as bright, or varies as many times as much.
const BETTER: f64 = 1.6;

/// A picture that varies less than this share of the first is misty.
const MISTY: f64 = 0.43;

/// Sees one plant in the photographs of one camera, and remembers what it needs to judge the next.
///
/// A killed run goes on as if it had not been: see [`Eye::resume`].
#[derive(Clone, Debug)]
pub struct Eye {
    calibration: Calibration,
    config: VisionConfig,
    last: Option<Point>,
    confidence: f64,
    stems: Hold,
    /// The bytes of the latest photograph.
    bytes: Vec<u8>,
    /// What stands still in the first picture, and how many pictures were looked at for a better one.
    reference: Option<Reference>,
    referred: usize,
    follow: Follow,
    time_s: f64,
    /// The latest photographs that were believed, and those since, that a run that was cut off has left: to be judged
    /// again.
    past: Vec<(Photo, Seen)>,
}

/// What is remembered of a camera's first picture.
#[derive(Clone, Debug)]
struct Reference {
    backdrop: Backdrop,
    brightness: f64,
}

impl Eye {
    /// Pictures at the beginning that [`Eye::refer`] takes up.
    pub const REFERS: usize = 6;

    /// The latest photographs in which the plant was believed that the next one is compared with.
    pub const REMEMBERS: usize = follow::MEMORY;

    /// An eye that has seen nothing yet.
    ///
    /// # Errors
    /// [`VisionError`] where a value cannot be one or the crop does not lie in pictures of the calibrated size.
    pub fn new(calibration: Calibration, config: VisionConfig) -> Result<Self, VisionError> {
        calibration.check()?;
        config.check(calibration.width, calibration.height)?;
        Ok(Self {
            calibration,
            config,
            last: None,
            confidence: 0.0,
            stems: Hold::default(),
            bytes: Vec::new(),
            reference: None,
            referred: 0,
            follow: Follow::default(),
            time_s: -60.0 * PERIOD_MIN,
            past: Vec::new(),
        })
    }

    /// Takes the first picture of a camera for what stands still in all of them, unless it is of another size than the
    /// calibration's; one of the next few takes its place where the first was dark or misty. [`Eye::observe`] does so by
    /// itself.
    pub fn refer(&mut self, image: &impl Pixels) {
        let (width, height) = image.size();
        let is_needed = self.config.mode == Mode::Robust && self.referred < Self::REFERS;
        if !is_needed || self.calibration.fits(width, height).is_err() {
            return;
        }
        self.referred += 1;
        let brightness = brightness(image);
        let is_better = |first: &Reference| {
            let clearness = first.backdrop.clearness(image, Pixel::default());
            brightness > BETTER * first.brightness.max(1.0) || clearness > BETTER
        };
        if self.reference.as_ref().is_none_or(is_better) {
            self.reference = Some(Reference { backdrop: Backdrop::of(image, self.config.crop), brightness });
        }
    }

    /// Takes up the photographs of a run that was cut off, one by one, and what was seen in each then. The next one is
    /// judged as if the run had not been cut off.
    pub fn resume(&mut self, photo: &Photo, seen: &Seen) {
        let is_picture = ![Class::Corrupt, Class::Foreign, Class::Repeated].contains(&seen.class);
        if is_picture && self.referred < Self::REFERS {
            photo.open().iter().for_each(|picture| self.refer(picture));
        }
        self.bytes.clone_from(&photo.bytes);
        // Of those believed the latest matter, and of those since only the end of a long time without the plant.
        if seen.is_measured() {
            self.past.retain(|(_, seen)| seen.is_measured());
            self.past.drain(..(self.past.len() + 1).saturating_sub(follow::MEMORY));
        }
        let believed = self.past.iter().filter(|(_, seen)| seen.is_measured()).count();
        if self.past.len() > believed + 2 * follow::MEMORY {
            self.past.drain(believed..believed + follow::MEMORY);
        }
        self.past.push((photo.clone(), seen.clone()));
        self.last = seen.observation.as_ref().map(|held| held.tip);
        self.stems.resume(seen.observation.as_ref().and_then(|held| held.stem.as_ref()));
        if let Some(tip) = self.last.filter(|_| seen.is_measured()) {
            self.follow.believe(tip, photo.time_s);
        }
        self.confidence = seen.confidence;
        self.time_s = photo.time_s;
        // As long as another picture may come to be what it is compared with, it must be judged by what it was then.
        if self.referred < Self::REFERS {
            self.catch_up();
        }
    }

    /// Judges once more what the run that was cut off had judged and what is still of use.
    fn catch_up(&mut self) {
        for (photo, seen) in std::mem::take(&mut self.past) {
            let Ok(sighting) = self.judge(photo.open().as_ref()) else { continue };
            let glimpse = self.glimpse(&sighting);
            if seen.is_measured() {
                self.follow.recognise(glimpse);
            } else if [Class::Ambiguous, Class::Jump].contains(&seen.class) {
                self.follow.judge(glimpse, photo.time_s);
            }
        }
    }

    /// The calibration it sees by.
    #[must_use]
    pub const fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The tip in the next photograph, or the last sighting where this one shows none. Never fails: what is wrong with
    /// the photograph is its [`Class`].
    pub fn observe(&mut self, photo: &Photo) -> Seen {
        self.catch_up();
        let is_repeated = !photo.bytes.is_empty() && self.bytes == photo.bytes;
        self.bytes.clone_from(&photo.bytes);
        let sighting = if is_repeated {
            Err(Class::Repeated)
        } else {
            let picture = photo.open();
            picture.iter().for_each(|picture| self.refer(picture));
            self.judge(picture.as_ref())
        };
        self.settle_at(sighting, photo.time_s)
    }

    /// What a decoded photograph shows, without memory but for what [`Eye::refer`] took in: the part of [`Eye::observe`]
    /// that can be done for many photographs at a time, in any order.
    ///
    /// # Errors
    /// The class of a photograph that shows no plant.
    pub fn judge(&self, picture: Result<&impl Pixels, &PhotoError>) -> Result<Sighting, Class> {
        let image = picture.map_err(|error| match error {
            PhotoError::Foreign(_) | PhotoError::TooLarge { .. } => Class::Foreign,
            _ => Class::Corrupt,
        })?;
        let (width, height) = image.size();
        self.calibration.fits(width, height).map_err(|_| Class::Foreign)?;
        let backdrop = self.reference.as_ref().map(|reference| &reference.backdrop);
        let found = backdrop.and_then(|backdrop| backdrop.shift(image));
        // Where nothing is found again of what was there to be found, the camera may look elsewhere.
        let is_lost = found.is_none() && backdrop.is_some_and(Backdrop::is_rich);
        let shift = found.unwrap_or_default();
        let base = Pixel::new(self.calibration.base.x + shift.x, self.calibration.base.y + shift.y);
        let crop = self.config.crop.map(|crop| moved(crop, shift, (width, height)));
        let sighting = look_from(image, Some(base), &VisionConfig { crop, ..self.config.clone() })
            .ok_or_else(|| if self.is_dark(image) { Class::Dark } else { Class::NoPlant })?;
        let is_misty = backdrop.is_some_and(|backdrop| backdrop.clearness(image, shift) < MISTY);
        // Without the flash, cloth that a lamp lights may pass for a part of the plant.
        let is_veiled = sighting.is_veiled || is_lost || is_misty || self.is_darker(image);
        Ok(Sighting { shift, is_veiled, is_lost, ..sighting })
    }

    /// Whether there is too little light to see a plant by: the picture is black but for noise, or much darker than the
    /// first one.
    fn is_dark(&self, image: &impl Pixels) -> bool {
        self.is_darker(image) || is_black(image)
    }

    /// Whether a picture is much darker than the first one.
    fn is_darker(&self, image: &impl Pixels) -> bool {
        self.reference.as_ref().is_some_and(|first| brightness(image) < 0.5 * first.brightness)
    }

    /// Whether [`Eye::observe`] would find too little light in a photograph to see a plant by.
    #[must_use]
    pub fn finds_dark(&self, photo: &Photo) -> bool {
        // Most photographs are bright, which is seen at a glance.
        let is_dark =
            |picture: &Picture| self.is_dark(picture) && self.judge(Ok(picture)) == Err(Class::Dark);
        photo.open().is_ok_and(|picture| is_dark(&picture))
    }

    /// [`Eye::settle_at`], a period after the photograph before.
    pub fn settle(&mut self, sighting: Result<Sighting, Class>) -> Seen {
        self.settle_at(sighting, self.time_s + 60.0 * PERIOD_MIN)
    }

    /// Takes what [`Eye::judge`] made of the next photograph, taken at `time_s`, into memory: the part that needs
    /// photographs in order.
    pub fn settle_at(&mut self, sighting: Result<Sighting, Class>, time_s: f64) -> Seen {
        let periods = (time_s - self.time_s) / (60.0 * PERIOD_MIN);
        self.time_s = time_s;
        let pixel = sighting.as_ref().ok().map(|sighting| sighting.tip);
        let contrast = sighting.as_ref().map_or(0.0, |sighting| sighting.contrast);
        let (class, fit) = match &sighting {
            Err(class) => (*class, 0.0),
            Ok(_) if self.config.mode == Mode::Paper => (Class::Ok, 1.0),
            Ok(sighting) if sighting.cut.is_some() => (Class::LeavesView, 0.0),
            Ok(sighting) => self.follow.judge(self.glimpse(sighting), time_s),
        };
        let shift = sighting.as_ref().ok().and_then(|sighting| self.known_shift(sighting));
        let believed = sighting.ok().filter(|_| class == Class::Ok);
        let is_off = periods > 1.5 || (periods > 0.0 && periods < 0.5);
        let class = if class == Class::Ok && is_off && self.last.is_some() { Class::ClockGap } else { class };
        let seen_stem = believed
            .as_ref()
            .and_then(|sighting| sighting.stem.as_deref().map(|stem| (stem, sighting.shift)));
        let seen_stem = seen_stem.map(|(pixels, shift)| {
            Polyline(pixels.iter().map(|&pixel| self.point(pixel, shift)).collect()).equidistant(10)
        });
        let rule = (self.config.mode == Mode::Paper).then_some(&self.config.hold);
        let (stem, _) = self.stems.settle(seen_stem, rule);
        let quality = if believed.is_some() { Quality::Measured } else { Quality::Held };
        self.confidence = match believed {
            Some(_) => fit * (1.0 - crate::math::exp(-contrast / (2.0 * self.config.contrast.max(1.0)))),
            None => self.confidence / 2.0,
        };
        self.last = believed.map(|sighting| self.point(sighting.tip, sighting.shift)).or(self.last);
        let observation = self.last.map(|tip| Observation { tip, stem, quality });
        Seen { observation, pixel, class, confidence: self.confidence, shift }
    }

    /// How far the picture of a sighting has moved, where there is something to know it by.
    fn known_shift(&self, sighting: &Sighting) -> Option<Pixel> {
        let is_rich = self.reference.as_ref().is_some_and(|first| first.backdrop.is_rich());
        let has_moved = sighting.shift != Pixel::default();
        (!sighting.is_lost && (is_rich || has_moved)).then_some(sighting.shift)
    }

    /// The point that a pixel shows of a camera whose picture has moved.
    fn point(&self, pixel: Pixel, shift: Pixel) -> Point {
        self.calibration.point(Pixel::new(pixel.x - shift.x, pixel.y - shift.y))
    }

    fn glimpse(&self, sighting: &Sighting) -> Glimpse {
        let apart = |stem: &[Pixel]| {
            let pixels = stem.iter().map(|at| at.distance(sighting.tip)).fold(f64::INFINITY, f64::min);
            pixels / self.calibration.px_per_cm
        };
        Glimpse {
            tip: self.point(sighting.tip, sighting.shift),
            contrast: sighting.contrast,
            apart: sighting.stem.as_deref().map(apart),
            shape: sighting.shape.moved(sighting.shift),
            is_veiled: sighting.is_veiled,
            calibration: self.calibration,
        }
    }
}

impl Seen {
    /// Whether the tip was measured in this photograph.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.observation.as_ref().is_some_and(|seen| seen.quality == Quality::Measured)
    }
}

/// A crop that follows a camera's picture, as far as the picture reaches.
fn moved(crop: Region, shift: Pixel, size: (usize, usize)) -> Region {
    let along =
        |from: usize, by: f64, most: usize| (from as f64 + by.round()).clamp(0.0, most as f64) as usize;
    let (width, height) = (crop.width.min(size.0), crop.height.min(size.1));
    Region { x: along(crop.x, shift.x, size.0 - width), y: along(crop.y, shift.y, size.1 - height), ..crop }
}

/// The median brightness of a picture, by means of squares that a JPEG tells without its pixels.
fn brightness(image: &impl Pixels) -> f64 {
    let (width, height) = image.size();
    let step = if width.min(height) < 8 { 1 } else { 8 };
    let values = image.shrunk_grey(whole((width, height)), step);
    let (width, height) = (width / step, height / step);
    f64::from(Levels::of(&Plane { width, height, values, origin: (0.0, 0.0), step }, 1).background)
}

/// Whether a picture is black but for noise: its brightest parts exceed its median by fewer than five deviations.
fn is_black(image: &impl Pixels) -> bool {
    let plane = coarse(image, 256);
    let levels = Levels::of(&plane, plane.values.len() / 1_000);
    levels.contrast() < 5.0
}

/// A picture in grey, unfiltered, at so many columns.
fn coarse(image: &impl Pixels, columns: usize) -> Plane {
    desaturated(image, whole(image.size()), 0.0, (image.size().0 / columns).max(1))
}
