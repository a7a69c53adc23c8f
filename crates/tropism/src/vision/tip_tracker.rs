//! One plant in the photographs of one camera.

use crate::geometry::{Pixel, Point, Polyline, Region};
use crate::observation::{Observation, Quality};
use crate::photo::{LazyImage, Photo, PhotoError};
use crate::vision::camera::calibration::Calibration;
use crate::vision::camera::registration::ReferenceFeatures;
use crate::vision::config::{Mode, VisionConfig};
use crate::vision::detect::detect_from_base;
use crate::vision::detect::detection::Detection;
use crate::vision::error::VisionError;
use crate::vision::frame_status::FrameStatus;
use crate::vision::raster::source::PixelSource;
use crate::vision::tracking::background::{Background, brightness, is_black};
use crate::vision::tracking::gating::{self, PlantMeasurement, TrackGate};
use crate::vision::tracking::hold::StemHold;

/// What a [`TipTracker`] makes of one photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedFrame {
    /// The tip in cm, measured or held; `None` before the first sighting.
    pub observation: Option<Observation>,
    /// The tip in this photograph where one is found, whether or not it is believed.
    pub tip_px: Option<Pixel>,
    /// Why it is held, if it is.
    pub status: FrameStatus,
    /// How far what is seen can be trusted, 0 to 1: by its contrast, and by how well it fits what was seen before. Halved
    /// with each photograph in which the last sighting is held.
    pub confidence: f64,
    /// How far the camera's picture has moved since the first one, in pixels to the right and down; `None` where nothing
    /// can be said.
    pub camera_shift: Option<Pixel>,
}

/// Minutes from one photograph to the next, unless their times say otherwise (section 2.2.2).
const PERIOD_MIN: f64 = 5.0;

/// A picture is clearer than another that is this many times as bright, or varies as many times as much.
const BETTER: f64 = 1.6;

/// A picture that varies less than this share of the first is misty.
const MISTY: f64 = 0.43;

/// Sees one plant in the photographs of one camera, and remembers what it needs to judge the next.
///
/// A killed run goes on as if it had not been: see [`TipTracker::resume`].
#[derive(Clone, Debug)]
pub struct TipTracker {
    calibration: Calibration,
    config: VisionConfig,
    last: Option<Point>,
    confidence: f64,
    stems: StemHold,
    /// The bytes of the latest photograph.
    bytes: Vec<u8>,
    /// What stands still in the first picture, and how many pictures were looked at for a better one.
    reference: Option<Background>,
    referred: usize,
    gate: TrackGate,
    time_s: f64,
    /// The latest photographs that were believed, and those since, that a run that was cut off has left: to be judged
    /// again.
    past: Vec<(Photo, TrackedFrame)>,
}

impl TipTracker {
    /// Pictures at the beginning that [`TipTracker::refer`] takes up.
    pub const REFERENCE_FRAMES: usize = 6;

    /// The latest photographs in which the plant was believed that the next one is compared with.
    pub const MEMORY_FRAMES: usize = gating::MEMORY;

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
            stems: StemHold::default(),
            bytes: Vec::new(),
            reference: None,
            referred: 0,
            gate: TrackGate::default(),
            time_s: -60.0 * PERIOD_MIN,
            past: Vec::new(),
        })
    }

    /// Takes the first picture of a camera for what stands still in all of them, unless it is of another size than the
    /// calibration's; one of the next few takes its place where the first was dark or misty. [`TipTracker::observe`] does so by
    /// itself.
    pub fn set_reference(&mut self, image: &impl PixelSource) {
        let (width, height) = image.size();
        let is_needed = self.config.mode == Mode::Robust && self.referred < Self::REFERENCE_FRAMES;
        if !is_needed || self.calibration.check_size(width, height).is_err() {
            return;
        }
        self.referred += 1;
        let brightness = brightness(image);
        let is_better = |first: &Background| {
            let clearness = first.features.relative_contrast(image, Pixel::default());
            brightness > BETTER * first.brightness.max(1.0) || clearness > BETTER
        };
        if self.reference.as_ref().is_none_or(is_better) {
            self.reference = Some(Background {
                features: ReferenceFeatures::extract(image, self.config.crop),
                brightness,
            });
        }
    }

    /// Takes up the photographs of a run that was cut off, one by one, and what was seen in each then. The next one is
    /// judged as if the run had not been cut off.
    pub fn resume(&mut self, photo: &Photo, seen: &TrackedFrame) {
        let is_picture =
            ![FrameStatus::Corrupt, FrameStatus::Foreign, FrameStatus::Repeated].contains(&seen.status);
        if is_picture && self.referred < Self::REFERENCE_FRAMES {
            photo.open().iter().for_each(|picture| self.set_reference(picture));
        }
        self.bytes.clone_from(&photo.bytes);
        // Of those believed the latest matter, and of those since only the end of a long time without the plant.
        if seen.is_measured() {
            self.past.retain(|(_, seen)| seen.is_measured());
            self.past.drain(..(self.past.len() + 1).saturating_sub(gating::MEMORY));
        }
        let believed = self.past.iter().filter(|(_, seen)| seen.is_measured()).count();
        if self.past.len() > believed + 2 * gating::MEMORY {
            self.past.drain(believed..believed + gating::MEMORY);
        }
        self.past.push((photo.clone(), seen.clone()));
        self.last = seen.observation.as_ref().map(|held| held.tip);
        if let Some(tip) = self.last.filter(|_| seen.is_measured()) {
            self.gate.accept(tip, photo.time_s);
        }
        self.confidence = seen.confidence;
        self.time_s = photo.time_s;
        // As long as another picture may come to be what it is compared with, it must be judged by what it was then.
        if self.referred < Self::REFERENCE_FRAMES {
            self.catch_up();
        }
    }

    /// Judges once more what the run that was cut off had judged and what is still of use.
    fn catch_up(&mut self) {
        for (photo, seen) in std::mem::take(&mut self.past) {
            let Ok(sighting) = self.detect(photo.open().as_ref()) else { continue };
            let glimpse = self.measure(&sighting);
            if seen.is_measured() {
                self.gate.remember_appearance(glimpse);
            } else if [FrameStatus::Ambiguous, FrameStatus::Jump].contains(&seen.status) {
                self.gate.gate(glimpse, photo.time_s);
            }
        }
    }

    /// The calibration it sees by.
    #[must_use]
    pub const fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The tip in the next photograph, or the last sighting where this one shows none. Never fails: what is wrong with
    /// the photograph is its [`FrameStatus`].
    pub fn observe(&mut self, photo: &Photo) -> TrackedFrame {
        self.catch_up();
        let is_repeated = !photo.bytes.is_empty() && self.bytes == photo.bytes;
        self.bytes.clone_from(&photo.bytes);
        let sighting = if is_repeated {
            Err(FrameStatus::Repeated)
        } else {
            let picture = photo.open();
            picture.iter().for_each(|picture| self.set_reference(picture));
            self.detect(picture.as_ref())
        };
        self.update(sighting, photo.time_s)
    }

    /// What a decoded photograph shows, without memory but for what [`TipTracker::refer`] took in: the part of [`TipTracker::observe`]
    /// that can be done for many photographs at a time, in any order.
    ///
    /// # Errors
    /// The class of a photograph that shows no plant.
    pub fn detect(&self, picture: Result<&impl PixelSource, &PhotoError>) -> Result<Detection, FrameStatus> {
        let image = picture.map_err(|error| match error {
            PhotoError::UnknownFormat(_) | PhotoError::TooLarge { .. } => FrameStatus::Foreign,
            _ => FrameStatus::Corrupt,
        })?;
        let (width, height) = image.size();
        self.calibration.check_size(width, height).map_err(|_| FrameStatus::Foreign)?;
        let features = self.reference.as_ref().map(|reference| &reference.features);
        let found = features.and_then(|features| features.estimate_shift(image));
        // Where nothing is found again of what was there to be found, the camera may look elsewhere.
        let is_unregistered = found.is_none() && features.is_some_and(ReferenceFeatures::has_enough);
        let shift = found.unwrap_or_default();
        let base = Pixel::new(self.calibration.base.x + shift.x, self.calibration.base.y + shift.y);
        let crop = self.config.crop.map(|crop| moved(crop, shift, (width, height)));
        let sighting = detect_from_base(image, Some(base), &VisionConfig { crop, ..self.config.clone() })
            .ok_or_else(|| if self.is_too_dark(image) { FrameStatus::Dark } else { FrameStatus::NoPlant })?;
        let is_misty = features.is_some_and(|features| features.relative_contrast(image, shift) < MISTY);
        // Without the flash, cloth that a lamp lights may pass for a part of the plant.
        let is_occluded = sighting.is_occluded || is_unregistered || is_misty || self.is_darker(image);
        Ok(Detection { camera_shift: shift, is_occluded, is_unregistered, ..sighting })
    }

    /// Whether there is too little light to see a plant by: the picture is black but for noise, or much darker than the
    /// first one.
    fn is_too_dark(&self, image: &impl PixelSource) -> bool {
        self.is_darker(image) || is_black(image)
    }

    /// Whether a picture is much darker than the first one.
    fn is_darker(&self, image: &impl PixelSource) -> bool {
        self.reference.as_ref().is_some_and(|first| brightness(image) < 0.5 * first.brightness)
    }

    /// Whether [`TipTracker::observe`] would find too little light in a photograph to see a plant by.
    #[must_use]
    pub fn is_dark(&self, photo: &Photo) -> bool {
        // Most photographs are bright, which is seen at a glance.
        let is_dark = |picture: &LazyImage| {
            self.is_too_dark(picture) && self.detect(Ok(picture)) == Err(FrameStatus::Dark)
        };
        photo.open().is_ok_and(|picture| is_dark(&picture))
    }

    /// [`TipTracker::update`], a period after the photograph before.
    pub fn update_next(&mut self, sighting: Result<Detection, FrameStatus>) -> TrackedFrame {
        self.update(sighting, self.time_s + 60.0 * PERIOD_MIN)
    }

    /// Takes what [`TipTracker::judge`] made of the next photograph, taken at `time_s`, into memory: the part that needs
    /// photographs in order.
    pub fn update(&mut self, sighting: Result<Detection, FrameStatus>, time_s: f64) -> TrackedFrame {
        let periods = (time_s - self.time_s) / (60.0 * PERIOD_MIN);
        self.time_s = time_s;
        let pixel = sighting.as_ref().ok().map(|sighting| sighting.tip);
        let contrast = sighting.as_ref().map_or(0.0, |sighting| sighting.contrast);
        let (class, fit) = match &sighting {
            Err(class) => (*class, 0.0),
            Ok(_) if self.config.mode == Mode::Paper => (FrameStatus::Ok, 1.0),
            Ok(sighting) if sighting.clipped_at.is_some() => (FrameStatus::LeavesView, 0.0),
            Ok(sighting) => self.gate.gate(self.measure(sighting), time_s),
        };
        let shift = sighting.as_ref().ok().and_then(|sighting| self.known_shift(sighting));
        let believed = sighting.ok().filter(|_| class == FrameStatus::Ok);
        let is_off = periods > 1.5 || (periods > 0.0 && periods < 0.5);
        let class = if class == FrameStatus::Ok && is_off && self.last.is_some() {
            FrameStatus::ClockGap
        } else {
            class
        };
        let seen_stem = believed
            .as_ref()
            .and_then(|sighting| sighting.stem.as_deref().map(|stem| (stem, sighting.camera_shift)));
        let seen_stem = seen_stem.map(|(pixels, shift)| {
            Polyline(pixels.iter().map(|&pixel| self.point(pixel, shift)).collect()).resampled(10)
        });
        let rule = (self.config.mode == Mode::Paper).then_some(&self.config.hold);
        let (stem, _) = self.stems.update(seen_stem, rule);
        let quality = if believed.is_some() { Quality::Measured } else { Quality::Held };
        self.confidence = match believed {
            Some(_) => fit * (1.0 - crate::math::exp(-contrast / (2.0 * self.config.contrast.max(1.0)))),
            None => self.confidence / 2.0,
        };
        self.last = believed.map(|sighting| self.point(sighting.tip, sighting.camera_shift)).or(self.last);
        let observation = self.last.map(|tip| Observation { tip, stem, quality });
        TrackedFrame {
            observation,
            tip_px: pixel,
            status: class,
            confidence: self.confidence,
            camera_shift: shift,
        }
    }

    /// How far the picture of a sighting has moved, where there is something to know it by.
    fn known_shift(&self, sighting: &Detection) -> Option<Pixel> {
        let has_enough = self.reference.as_ref().is_some_and(|first| first.features.has_enough());
        let has_moved = sighting.camera_shift != Pixel::default();
        (!sighting.is_unregistered && (has_enough || has_moved)).then_some(sighting.camera_shift)
    }

    /// The point that a pixel shows of a camera whose picture has moved.
    fn point(&self, pixel: Pixel, shift: Pixel) -> Point {
        self.calibration.point(Pixel::new(pixel.x - shift.x, pixel.y - shift.y))
    }

    fn measure(&self, sighting: &Detection) -> PlantMeasurement {
        let apart = |stem: &[Pixel]| {
            let pixels = stem.iter().map(|at| at.distance(sighting.tip)).fold(f64::INFINITY, f64::min);
            pixels / self.calibration.px_per_cm
        };
        PlantMeasurement {
            tip: self.point(sighting.tip, sighting.camera_shift),
            contrast: sighting.contrast,
            apart: sighting.stem.as_deref().map(apart),
            shape: sighting.tissue.shifted(sighting.camera_shift),
            is_occluded: sighting.is_occluded,
            calibration: self.calibration,
        }
    }
}

impl TrackedFrame {
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
