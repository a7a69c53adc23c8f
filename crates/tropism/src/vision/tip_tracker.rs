//! Tracker of one plant's tip in the photographs of one camera: the front of vision.
//!
//! In: photographs in the order of their times. Out: a [`TrackedFrame`] for each: the tip in cm, measured or carried forward,
//! and its [`FrameStatus`]. The one idea: [detection](TipTracker::detect) is a function of one picture and the
//! reference, so it can run for many photographs at a time; only the [update](TipTracker::update) of the track needs
//! their order.

use std::sync::Arc;

use crate::geometry::{Pixel, Point, Polyline, Region, STEM_POINTS, path};
use crate::math;
use crate::observation::{Observation, Quality};
use crate::photo::{LazyImage, Photo, PhotoError};
use crate::vision::camera::calibration::Calibration;
use crate::vision::camera::stereo::{CameraPose, Strip};
use crate::vision::config::{Mode, VisionConfig};
use crate::vision::detect::detect_posed;
use crate::vision::detect::detection::Detection;
use crate::vision::detect::lamp_state::lamp_state;
use crate::vision::detect::pole::PoleView;
use crate::vision::error::VisionError;
use crate::vision::frame_status::FrameStatus;
use crate::vision::raster::Masked;
use crate::vision::raster::frame::Frame;
use crate::vision::raster::source::PixelSource;
use crate::vision::tracking::background::{Background, Tone, is_black};
use crate::vision::tracking::clicks::{self, Click, FollowedPlace, LivePoint, agreement, tolerance};
use crate::vision::tracking::flow::Pyramid;
use crate::vision::tracking::gating::{Interval, PlantMeasurement, TrackGate};
use crate::vision::tracking::hold::StemHold;

/// Intervals shorter or longer than these, as shares of the expected one, are clock gaps. Chosen by hand.
const MIN_INTERVAL: f64 = 0.5;
const MAX_INTERVAL: f64 = 1.5;

/// Factors of the confidence of a photograph on its own: of a clear detection, and of one whose tip may be occluded or
/// whose plant reaches an edge. Chosen: of the stems of the first centre lines 96 % are right (`scripts/score-vision
/// centerlines`), but no photograph before or after confirms them.
const CLEAR_ALONE: f64 = 0.88;
const UNCERTAIN_ALONE: f64 = 0.8;

/// Greatest loss of confidence of an accepted tip, at no contrast. Chosen on the reliability diagram of the virtual rows and
/// the first halves of the real sets (`scripts/score-vision`).
const TRACK_DOUBT: f64 = 0.15;

/// Greatest confidence where another plant touches the plant. Chosen: even odds, for either may be the higher.
const TOUCHED: f64 = 0.5;

/// Width of the blurred edge of an obstacle that is masked with it, in cm. Chosen by hand: half a pixel of the paper's crop.
const OBSTACLE_EDGE_CM: f64 = 0.05;

/// One photograph after detection and tracking.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedFrame {
    /// Tip and stem in cm, measured or carried forward; `None` before the first accepted detection.
    pub observation: Option<Observation>,
    /// Tip detected in this photograph, in pixels, whether or not it is accepted.
    pub tip_px: Option<Pixel>,
    /// `Ok`, or why the tip is carried forward.
    pub status: FrameStatus,
    /// Confidence, 0 to 1: it grows with contrast, falls with the distance from the expected tip, and is halved with
    /// each photograph in which the tip is carried forward.
    pub confidence: f64,
    /// Shift of the camera's picture since the reference, in pixels to the right and down; `None` where it is
    /// unknown.
    pub camera_shift: Option<Pixel>,
}

impl TrackedFrame {
    /// Whether the tip was measured in this photograph.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.observation.as_ref().is_some_and(|observation| observation.quality == Quality::Measured)
    }
}

/// Tracks the tip of one plant in the photographs of one camera.
///
/// An interrupted run continues as if it had not been interrupted: see [`TipTracker::resume`].
#[derive(Clone, Debug)]
pub struct TipTracker {
    calibration: Calibration,
    config: VisionConfig,
    /// Latest accepted tip, in cm.
    tip: Option<Point>,
    confidence: f64,
    stem: StemHold,
    /// Bytes of the latest photograph, to detect a repeated one.
    bytes: Vec<u8>,
    /// The reference picture, and the number of pictures that were candidates for it.
    reference: Option<Background>,
    candidates: usize,
    gate: TrackGate,
    /// The clicked tip, followed by the flow; `None` without clicks.
    clicked: Option<LivePoint>,
    /// Whether photographs have nothing to do with each other.
    is_unrelated: bool,
    /// Interval at which photographs are expected.
    interval: Interval,
    /// Time of the latest photograph, in seconds.
    time_s: f64,
    /// Photographs of an interrupted run whose gating is still to be repeated: the latest accepted ones, and those
    /// since.
    replay: Vec<(Frame, TrackedFrame)>,
}

impl TipTracker {
    /// Number of pictures at the beginning that may become the reference. Chosen: half an hour at the paper's period.
    pub const REFERENCE_FRAMES: usize = 6;

    /// A tracker that expects a photograph every five minutes, as in the paper.
    ///
    /// # Errors
    /// [`VisionError`] where a value is out of range or the crop does not lie in pictures of the calibrated size.
    pub fn new(calibration: Calibration, config: VisionConfig) -> Result<Self, VisionError> {
        calibration.check()?;
        config.check(calibration.width, calibration.height)?;
        Ok(Self {
            calibration,
            config,
            tip: None,
            confidence: 0.0,
            stem: StemHold::default(),
            bytes: Vec::new(),
            reference: None,
            candidates: 0,
            gate: TrackGate::new(Interval::default(), calibration.px_per_cm),
            clicked: None,
            is_unrelated: false,
            interval: Interval::default(),
            time_s: -60.0 * Interval::default().0,
            replay: Vec::new(),
        })
    }

    /// The same tracker for photographs `period_min` minutes apart, without photographs so far. Gates, confirmations and
    /// clock gaps scale with it.
    ///
    /// # Panics
    /// If `period_min` is not above 0.
    #[must_use]
    pub fn with_period(mut self, period_min: f64) -> Self {
        assert!(period_min > 0.0, "photographs are some time apart");
        self.interval = Interval(period_min);
        self.gate = TrackGate::new(self.interval, self.calibration.px_per_cm);
        self.time_s = -60.0 * period_min;
        self
    }

    /// The same tracker for unrelated photographs, such as a folder of many plants: each detection is accepted. In a
    /// picture of another size the root is expected at the same relative place.
    #[must_use]
    pub const fn for_unrelated(mut self) -> Self {
        self.is_unrelated = true;
        self
    }

    /// The same tracker for a plant whose tip a user clicked in some of the first photographs, which count from 0, one a period.
    /// The tip is followed from there by optical flow, and detection is a second witness: see [`FrameStatus::Disputed`].
    /// Without clicks it is the same tracker.
    ///
    /// # Errors
    /// [`VisionError`] where a click lies outside of the pictures.
    pub fn with_clicks(mut self, clicks: &[Click]) -> Result<Self, VisionError> {
        let Calibration { base, width, height, .. } = self.calibration;
        clicks::check(clicks, (width, height))?;
        self.clicked = (!clicks.is_empty()).then(|| LivePoint::new(clicks.to_vec(), base));
        Ok(self)
    }

    /// Number of latest accepted photographs that gating depends on.
    #[must_use]
    pub fn memory_frames(&self) -> usize {
        self.interval.memory()
    }

    /// Whether poles are configured, which may hide a tip.
    #[must_use]
    pub const fn has_poles(&self) -> bool {
        !self.config.poles.is_empty()
    }

    /// Whether the stem was measured in the latest photograph. It is not where none is found, or one whose length differs
    /// from those before.
    #[must_use]
    pub const fn has_measured_stem(&self) -> bool {
        !self.stem.is_carried_forward()
    }

    /// The camera's calibration.
    #[must_use]
    pub const fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Makes a picture the reference if it is one of the first [`REFERENCE_FRAMES`](Self::REFERENCE_FRAMES) and
    /// better than the present one. [`TipTracker::observe`] calls it by itself.
    ///
    /// Pictures of another size than the calibration's are ignored. Mode `paper` has no reference.
    pub fn set_reference(&mut self, image: &dyn PixelSource) {
        let (width, height) = image.size();
        let is_compared = self.config.mode == Mode::Robust && !self.is_unrelated;
        let is_candidate = is_compared && self.candidates < Self::REFERENCE_FRAMES;
        if !is_candidate || self.calibration.check_size(width, height).is_err() {
            return;
        }
        self.candidates += 1;
        if self.reference.as_ref().is_none_or(|reference| reference.is_exceeded_by(image)) {
            self.reference = Some(Background::of(image, self.config.crop));
        }
    }

    /// Takes in the next photograph of an interrupted run, and how it was tracked then. After all of them, the next
    /// one is tracked as if the run had not been interrupted.
    pub fn resume(&mut self, photo: &Photo, tracked: &TrackedFrame) {
        let is_picture =
            ![FrameStatus::Corrupt, FrameStatus::Foreign, FrameStatus::Repeated].contains(&tracked.status);
        let frame = Frame::new(photo.clone());
        if is_picture && self.candidates < Self::REFERENCE_FRAMES {
            frame.picture().iter().for_each(|picture| self.set_reference(*picture));
        }
        self.bytes.clone_from(&photo.bytes);
        // Only the latest accepted frames are kept, and of those since only the end of a long time without the plant.
        if tracked.is_measured() {
            self.replay.retain(|(_, tracked)| tracked.is_measured());
            self.replay.drain(..(self.replay.len() + 1).saturating_sub(self.memory_frames()));
        }
        let accepted = self.replay.iter().filter(|(_, tracked)| tracked.is_measured()).count();
        let memory = self.memory_frames();
        if self.replay.len() > accepted + 2 * memory {
            let mut dropped = self.replay.drain(accepted..accepted + memory);
            if dropped.any(|(_, tracked)| tracked.status == FrameStatus::Hidden) {
                self.gate.hide();
            }
        }
        let index = self.index_at(photo.time_s);
        if let Some(clicked) = &mut self.clicked {
            let place = tracked.tip_px.filter(|_| tracked.is_measured());
            let place = place.map(|at| FollowedPlace { at, confidence: tracked.confidence });
            // Photographs that are not wanted any more have no bytes.
            let picture = place.and_then(|_| frame.picture().ok()).map(pyramid);
            clicked.record(index, picture.as_ref(), place);
        }
        self.replay.push((frame, tracked.clone()));
        self.tip = tracked.observation.as_ref().map(|observation| observation.tip);
        self.stem.resume(tracked.observation.as_ref().and_then(|observation| observation.stem.as_ref()));
        if let Some(tip) = self.tip.filter(|_| tracked.is_measured()) {
            if self.gate.is_learning() && self.config.mode == Mode::Robust {
                let detection = self.replay.last().and_then(|(frame, _)| self.detect(frame.picture()).ok());
                self.gate.learn(detection.and_then(|detection| detection.stem_width));
            }
            self.gate.accept(self.calibration.pixel(tip), photo.time_s);
        }
        self.confidence = tracked.confidence;
        self.time_s = photo.time_s;
        // While the reference may still change, a photograph must be detected with the reference of its time.
        if self.candidates < Self::REFERENCE_FRAMES {
            self.finish_replay();
        }
    }

    /// Repeats the gating of the photographs of an interrupted run.
    fn finish_replay(&mut self) {
        for (frame, tracked) in std::mem::take(&mut self.replay) {
            let Ok(detection) = self.detect(frame.picture()) else { continue };
            let measurement = self.measure(&detection);
            if tracked.is_measured() {
                self.gate.remember_appearance(measurement);
            } else if tracked.status == FrameStatus::Hidden {
                self.gate.hide();
            } else if [FrameStatus::Ambiguous, FrameStatus::Jump].contains(&tracked.status) {
                self.gate.gate(measurement, frame.photo().time_s);
            }
        }
    }

    /// Detects and tracks the tip in the next photograph; where that fails, the last tip is carried forward.
    ///
    /// It has no error: what is wrong with a photograph is its [`FrameStatus`].
    pub fn observe(&mut self, frame: &Frame) -> TrackedFrame {
        self.finish_replay();
        let photo = frame.photo();
        let is_repeated = !photo.bytes.is_empty() && self.bytes == photo.bytes;
        self.bytes.clone_from(&photo.bytes);
        if is_repeated {
            return self.update_followed(Err(FrameStatus::Repeated), None, photo.time_s);
        }
        let picture = frame.picture();
        picture.iter().for_each(|picture| self.set_reference(*picture));
        let detection = self.detect(picture);
        self.update_followed(detection, picture.ok(), photo.time_s)
    }

    /// Number of the photograph taken at `time_s`, from 0, at one a period.
    fn index_at(&self, time_s: f64) -> usize {
        (time_s / (60.0 * self.interval.0)).round().max(0.0) as usize
    }

    /// Updates the track by the next photograph; by the clicked tip in its `picture`, if one was clicked.
    fn update_followed(
        &mut self,
        detection: Result<Detection, FrameStatus>,
        picture: Option<&LazyImage>,
        time_s: f64,
    ) -> TrackedFrame {
        let index = self.index_at(time_s);
        let Some(clicked) = &mut self.clicked else { return self.update(detection, time_s) };
        let picture = picture.filter(|picture| {
            let (width, height) = picture.size();
            self.calibration.check_size(width, height).is_ok()
        });
        let detected = detection.as_ref().ok().map(|detection| detection.tip);
        // A pole before the tip is followed no better than it is detected.
        let is_hidden = detection.as_ref().is_ok_and(|detection| detection.is_behind_pole);
        let pyramid = picture.filter(|_| !is_hidden).map(pyramid);
        let place = clicked.next(index, pyramid.as_ref(), detected);
        let Some(place) = place else {
            let unsure =
                if picture.is_some() && !is_hidden { Err(FrameStatus::Ambiguous) } else { detection };
            return self.update(unsure, time_s);
        };
        let tolerance = tolerance(place.at.distance(self.calibration.base));
        let is_agreed = detected.map(|detected| agreement(detected, place.at, tolerance) > 0.0);
        let status = if is_agreed == Some(false) { FrameStatus::Disputed } else { FrameStatus::Ok };
        let detection = match detection {
            Ok(detection) if is_agreed == Some(true) => Detection { tip: place.at, ..detection },
            Ok(detection) => Detection { tip: place.at, stem: None, ..detection },
            Err(_) => {
                let shift = self.reference.as_ref().zip(picture);
                let shift = shift.and_then(|(reference, picture)| reference.estimate_shift(picture));
                Detection { tip: place.at, camera_shift: shift.unwrap_or_default(), ..Detection::default() }
            }
        };
        self.update_by(Ok(detection), Some((status, place.confidence)), time_s)
    }

    /// Detects the plant in a picture, corrected for the camera's shift since the reference. Depends on no other
    /// picture, so it can run for many photographs at a time, in any order.
    ///
    /// # Errors
    /// The status of a photograph in which no plant is detected.
    pub fn detect<P: PixelSource>(&self, picture: Result<&P, &PhotoError>) -> Result<Detection, FrameStatus> {
        self.detect_in(picture.map(|picture| picture as &dyn PixelSource))
    }

    fn detect_in(&self, picture: Result<&dyn PixelSource, &PhotoError>) -> Result<Detection, FrameStatus> {
        let image = picture.map_err(|error| match error {
            PhotoError::UnknownFormat(_)
            | PhotoError::Foreign { .. }
            | PhotoError::Unsupported(_)
            | PhotoError::TooLarge { .. } => FrameStatus::Foreign,
            _ => FrameStatus::Corrupt,
        })?;
        let (width, height) = image.size();
        if !self.is_unrelated {
            self.calibration.check_size(width, height).map_err(|_| FrameStatus::Foreign)?;
        }
        let reference = self.reference.as_ref();
        let compared = reference.map(|reference| (reference, Tone::of(image)));
        if compared.is_some_and(|(reference, tone)| reference.is_title(tone)) && !is_black(image) {
            return Err(FrameStatus::NoPlant);
        }
        let is_darkened = compared.is_some_and(|(reference, tone)| reference.is_darkened(tone));
        let estimate = reference.and_then(|reference| reference.estimate_shift(image));
        let is_unregistered = estimate.is_none() && reference.is_some_and(Background::has_enough_features);
        let shift =
            if self.is_unrelated { self.root_shift((width, height)) } else { estimate.unwrap_or_default() };
        let base = self.calibration.base + shift;
        let crop = self.config.crop.map(|crop| shift_region(crop, shift, (width, height)));
        let config = VisionConfig { crop, ..self.config.clone() };
        let detection = self.detect_beside_obstacles(image, base, shift, &config).ok_or_else(|| {
            if is_darkened || is_black(image) { FrameStatus::Dark } else { FrameStatus::NoPlant }
        })?;
        let is_misty = reference.is_some_and(|reference| reference.is_misty(image, shift));
        // Without the flash, lit cloth may pass for a part of the plant.
        let is_occluded = detection.is_occluded || is_unregistered || is_misty || is_darkened;
        let light = lamp_state(image, None);
        Ok(Detection { camera_shift: shift, light, is_occluded, is_unregistered, ..detection })
    }

    /// Detects the plant with the stem's base at `base` where no obstacle is, in a picture shifted by `shift`.
    fn detect_beside_obstacles(
        &self,
        image: &dyn PixelSource,
        base: Pixel,
        shift: Pixel,
        config: &VisionConfig,
    ) -> Option<Detection> {
        let camera_cm = config.camera_cm.unwrap_or(f64::INFINITY);
        let pose = CameraPose::new(&self.calibration, camera_cm);
        let strips: Vec<Strip> = config.poles.iter().map(|pole| pose.silhouette(*pole)).collect();
        let poles = PoleView::new(self.calibration, shift, &strips);
        if config.obstacles.is_empty() {
            return detect_posed(image, Some(base), config, poles.as_ref(), self.is_unrelated);
        }
        let (width, height) = image.size();
        let regions = config.obstacles.iter().map(|obstacle| {
            let (low, high) = obstacle.extent();
            let margin = OBSTACLE_EDGE_CM + 1.0 / self.calibration.px_per_cm;
            let corner = |x, y| {
                let pixel = self.calibration.pixel(Point::new(x, y)) + shift;
                let whole = |value: f64, most: usize| (value.max(0.0) as usize).min(most);
                (whole(pixel.x, width), whole(pixel.y, height))
            };
            let (left, top) = corner(low.x - margin, high.y + margin);
            let (right, bottom) = corner(high.x + margin, low.y - margin);
            Region { x: left, y: top, width: right.saturating_sub(left), height: bottom.saturating_sub(top) }
        });
        let is_obstacle = |pixel: Pixel| {
            let point = self.calibration.point(pixel - shift);
            config.obstacles.iter().any(|obstacle| obstacle.distance(point) < OBSTACLE_EDGE_CM)
        };
        let masked = Masked::new(image, config.region(width, height), regions.collect(), &is_obstacle);
        detect_posed(&masked, Some(base), config, poles.as_ref(), self.is_unrelated)
    }

    /// Shift of the root in a picture of another size than the calibration's, whose root has the same place in proportion.
    fn root_shift(&self, (width, height): (usize, usize)) -> Pixel {
        let Calibration { base, width: columns, height: rows, .. } = self.calibration;
        let [across, down] =
            [(width, columns), (height, rows)].map(|(now, then)| now as f64 / then as f64 - 1.0);
        Pixel::new(base.x * across, base.y * down)
    }

    /// Whether [`TipTracker::observe`] would give a photograph the status [`FrameStatus::Dark`].
    #[must_use]
    pub fn is_dark(&self, frame: &Frame) -> bool {
        // Most photographs are bright, which is known without detection.
        let lacks_light = |picture: &LazyImage| {
            is_black(picture) || self.reference.as_ref().is_some_and(|one| one.is_darkened(Tone::of(picture)))
        };
        let picture = frame.picture();
        picture.is_ok_and(lacks_light) && self.detect(picture) == Err(FrameStatus::Dark)
    }

    /// [`TipTracker::update`], one period after the photograph before.
    pub fn update_next(&mut self, detection: Result<Detection, FrameStatus>) -> TrackedFrame {
        self.update(detection, self.time_s + 60.0 * self.interval.0)
    }

    /// Updates the track by the [detection](TipTracker::detect) in the next photograph, taken at `time_s` seconds.
    pub fn update(&mut self, detection: Result<Detection, FrameStatus>, time_s: f64) -> TrackedFrame {
        self.update_by(detection, None, time_s)
    }

    /// [`TipTracker::update`]; a clicked tip comes with its status and confidence, and is not gated.
    fn update_by(
        &mut self,
        detection: Result<Detection, FrameStatus>,
        clicked: Option<(FrameStatus, f64)>,
        time_s: f64,
    ) -> TrackedFrame {
        let steps = (time_s - self.time_s) / (60.0 * self.interval.0);
        self.time_s = time_s;
        if self.is_unrelated {
            (self.tip, self.stem) = (None, StemHold::default());
        }
        let mut has_steady_stem = true;
        let (status, fit) = match &detection {
            Err(status) => (*status, 0.0),
            Ok(_) if let Some(clicked) = clicked => clicked,
            Ok(_) if self.config.mode == Mode::Paper => (FrameStatus::Ok, 1.0),
            Ok(detection) if self.is_unrelated => {
                let is_uncertain = detection.is_occluded || detection.clipped_at.is_some();
                (FrameStatus::Ok, if is_uncertain { UNCERTAIN_ALONE } else { CLEAR_ALONE })
            }
            Ok(detection) if detection.clipped_at.is_some() => (FrameStatus::LeavesView, 0.0),
            Ok(detection) if detection.is_behind_pole => {
                self.gate.hide();
                (FrameStatus::Hidden, 0.0)
            }
            Ok(detection) => {
                let measurement = self.measure(detection);
                has_steady_stem = self.gate.has_steady_stem(&measurement);
                self.gate.gate(measurement, time_s)
            }
        };
        let tip_px = detection.as_ref().ok().map(|detection| detection.tip);
        let camera_shift = detection.as_ref().ok().and_then(|detection| self.known_shift(detection));
        let is_accepted = [FrameStatus::Ok, FrameStatus::Disputed].contains(&status);
        let accepted = detection.ok().filter(|_| is_accepted);
        let is_clock_gap = steps > MAX_INTERVAL || (steps > 0.0 && steps < MIN_INTERVAL);
        let has_gap = is_clock_gap && self.tip.is_some();
        let status = if status == FrameStatus::Ok && has_gap { FrameStatus::ClockGap } else { status };
        let rule = (self.config.mode == Mode::Paper).then_some(&self.config.hold);
        let stem = accepted.as_ref().filter(|_| has_steady_stem);
        let stem = stem.and_then(|detection| self.stem_of(detection));
        let stem = self.stem.update(stem, rule);
        let quality = if accepted.is_some() { Quality::Measured } else { Quality::CarriedForward };
        self.confidence = match &accepted {
            Some(_) if clicked.is_some() => fit,
            Some(Detection { contrast, has_second_foot, .. }) => {
                let clarity = fit * (1.0 - math::exp(-contrast / (2.0 * self.config.contrast.max(1.0))));
                let confidence =
                    if self.is_unrelated { clarity } else { 1.0 - TRACK_DOUBT * (1.0 - clarity) };
                if *has_second_foot { confidence.min(TOUCHED) } else { confidence }
            }
            None => self.confidence / 2.0,
        };
        self.tip = accepted.map(|detection| self.point(detection.tip, detection.camera_shift)).or(self.tip);
        let observation = self.tip.map(|tip| Observation { tip, stem, depth: None, quality });
        TrackedFrame { observation, tip_px, status, confidence: self.confidence, camera_shift }
    }

    /// The stem of a detection, in cm, with [`STEM_POINTS`] equidistant vertices.
    fn stem_of(&self, detection: &Detection) -> Option<Polyline> {
        let stem = detection.stem.as_deref()?;
        let points = stem.iter().map(|&pixel| self.point(pixel, detection.camera_shift));
        Some(Polyline(points.collect()).resampled(STEM_POINTS))
    }

    /// The camera's shift in a detection, where registration says something: `None` with too few features at rest.
    fn known_shift(&self, detection: &Detection) -> Option<Pixel> {
        let has_enough = self.reference.as_ref().is_some_and(Background::has_enough_features);
        let has_moved = detection.camera_shift != Pixel::default();
        (!detection.is_unregistered && (has_enough || has_moved)).then_some(detection.camera_shift)
    }

    /// Converts a pixel of a picture that has shifted to cm.
    fn point(&self, pixel: Pixel, shift: Pixel) -> Point {
        self.calibration.point(pixel - shift)
    }

    /// The measurement of a detection, for gating.
    fn measure(&self, detection: &Detection) -> PlantMeasurement {
        let distance_to_tip =
            |stem: &[Pixel]| stem.iter().map(|at| at.distance(detection.tip)).fold(f64::INFINITY, f64::min);
        PlantMeasurement {
            // By way of the centimetres that a record keeps, so that a resumed run has the same bits.
            tip: self.calibration.pixel(self.point(detection.tip, detection.camera_shift)),
            tissue: detection.tissue.unshifted(detection.camera_shift),
            contrast: detection.contrast,
            light: detection.light,
            tip_to_stem: detection.stem.as_deref().map(distance_to_tip),
            stem_width: detection.stem_width,
            stem_length: detection.stem.as_deref().map(path::length),
            is_occluded: detection.is_occluded || detection.has_second_foot,
        }
    }
}

/// The pyramid of a picture, for the flow of a clicked tip.
fn pyramid(picture: &LazyImage) -> Arc<Pyramid> {
    Arc::new(Pyramid::of(picture))
}

/// A region shifted with a camera's picture, as far as the picture reaches.
fn shift_region(region: Region, shift: Pixel, size: (usize, usize)) -> Region {
    let shifted = |start: usize, shift: f64, last: usize| {
        (start as f64 + shift.round()).clamp(0.0, last as f64) as usize
    };
    let (width, height) = (region.width.min(size.0), region.height.min(size.1));
    Region {
        x: shifted(region.x, shift.x, size.0 - width),
        y: shifted(region.y, shift.y, size.1 - height),
        ..region
    }
}
