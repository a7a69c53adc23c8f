//! From photographs to tables: detection on all threads, then gating in the order of the photographs.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;
use tropism::lamps::Light;
use tropism::photo::{Image, Photo};
use tropism::vision::detect::learned_stem::LearnedLine;
use tropism::vision::raster::source::PixelSource;
use tropism::vision::{self, FrameStatus, TipTracker, VisionError, lamp_state};

use super::follow::ClickedPlant;
use super::journal::{FrameDetections, FrameJournal, PlantDetection};
use super::overlays::{Annotation, Overlays};
use super::plan::TrackPlan;
use super::plants::Plant;
use super::series::{Frame, Series};
use super::table::{StemConfidence, Table};
use crate::{Error, Monitor, files};

/// Photographs that are in memory at the same time: a series of any length needs the same memory.
const BATCH: usize = 64;

/// A series of photographs on its way into one table a plant.
pub(super) struct Pipeline<'a> {
    pub(super) plan: &'a TrackPlan,
    pub(super) series: &'a Series,
    pub(super) plants: &'a [Plant],
    /// The light of each photograph; `None` if the pictures say.
    lights: Option<Vec<Option<Light>>>,
    trackers: Vec<TipTracker>,
    /// The plants that a user clicked.
    clicked: Vec<Option<ClickedPlant>>,
    pub(super) tables: Vec<Table>,
    pub(super) journal: FrameJournal,
    overlays: Overlays,
    /// The digests of the photographs so far, one after the other.
    pub(super) sha256: String,
    /// What is wrong with which file.
    pub(super) problems: BTreeMap<String, String>,
}

impl<'a> Pipeline<'a> {
    pub(super) fn new(
        plan: &'a TrackPlan,
        series: &'a Series,
        plants: &'a [Plant],
        clicked: Vec<Option<ClickedPlant>>,
        lights: Option<Vec<Option<Light>>>,
        settings: &impl Serialize,
    ) -> Result<Self, Error> {
        let is_unrelated = plan.each || series.frames.len() == 1;
        let tracker = |plant: &Plant| -> Result<TipTracker, VisionError> {
            let tracker = TipTracker::new(plant.calibration, plant.vision(&plan.vision))?;
            let tracker = tracker.with_period(series.period_min);
            Ok(if is_unrelated { tracker.for_unrelated() } else { tracker })
        };
        let mut trackers: Vec<TipTracker> =
            plants.iter().map(tracker).collect::<Result<_, VisionError>>().map_err(Error::at("vision"))?;
        let journal = FrameJournal::open(&plan.journal_file(), settings, plan.resume)?;
        // The background of the first pictures is the reference for the shift of the camera in all others.
        let readable =
            series.frames.iter().filter_map(|frame| files::read_photo(&frame.path, 0.0).ok()?.open().ok());
        for picture in readable.take(TipTracker::REFERENCE_FRAMES) {
            trackers.iter_mut().for_each(|tracker| tracker.set_reference(&picture));
        }
        let (folder, sheet) = (plan.overlay.as_deref(), plan.sheet.as_deref());
        Ok(Self {
            plan,
            series,
            plants,
            lights,
            trackers,
            clicked,
            tables: plants.iter().map(|plant| Table::new(plant.calibration, plan.each)).collect(),
            journal,
            overlays: Overlays::new(folder, sheet, plants, series.frames.len()),
            sha256: String::new(),
            problems: BTreeMap::new(),
        })
    }

    /// Processes all photographs.
    pub(super) fn run(&mut self, monitor: &dyn Monitor) -> Result<(), Error> {
        let count = self.series.frames.len();
        monitor.stage("track", count as u64);
        for start in (0..count).step_by(BATCH) {
            self.process(start..(start + BATCH).min(count), monitor)?;
            if !monitor.may_go_on() {
                return Err(Error::Interrupted { folder: self.plan.journal_file() });
            }
        }
        self.overlays.finish()
    }

    /// Detects the plants in a batch of photographs on all threads, and gates the detections in order.
    fn process(&mut self, batch: Range<usize>, monitor: &dyn Monitor) -> Result<(), Error> {
        let read = |frame: &Frame| {
            let photo = files::read_photo(&frame.path, frame.time_s).map_err(|error| error.to_string());
            let sha256 = photo.as_ref().map_or_else(|_| String::new(), |photo| files::sha256(&photo.bytes));
            (photo, sha256)
        };
        let frames = &self.series.frames;
        let photos: Vec<_> = frames[batch.clone()].par_iter().map(read).collect();
        let mut known = Vec::with_capacity(batch.len());
        for (frame, (_, sha256)) in frames[batch.clone()].iter().zip(&photos) {
            known.push(self.journal.find(&frame.name, sha256)?);
        }
        let (trackers, clicked, overlays) = (&self.trackers, &self.clicked, &self.overlays);
        let journal_file = self.plan.journal_file();
        let processed: Vec<Processed> = batch
            .clone()
            .into_par_iter()
            .zip(photos)
            .zip(known)
            // One photograph a task: a thread that is done takes the next, and none waits long at the end of a batch.
            .with_max_len(1)
            .map(|((index, (photo, sha256)), known)| {
                // A batch of large photographs takes many seconds on a small computer.
                if !monitor.may_go_on() {
                    return Err(Error::Interrupted { folder: journal_file.clone() });
                }
                let name = &frames[index].name;
                Processed::new(
                    trackers,
                    clicked,
                    (index, name),
                    known,
                    photo,
                    sha256,
                    overlays.needs(index, name),
                )
            })
            .collect::<Result<_, _>>()?;
        let new: Vec<&str> = processed.iter().filter_map(|photo| photo.line.as_deref()).collect();
        if new.len() < processed.len() {
            monitor.skip((processed.len() - new.len()) as u64);
        }
        for (index, photo) in batch.zip(&processed) {
            self.gate(index, photo)?;
        }
        // After the drawings: a photograph in the journal has its overlay.
        self.journal.add(&new)?;
        monitor.advance(new.len() as u64);
        let counts = &self.tables[0].counts;
        monitor.status(&format!("{} measured, {} carried forward", counts.measured, counts.carried_forward));
        Ok(())
    }

    /// Gates the detections of the next photograph, adds them to the tables, and draws them.
    fn gate(&mut self, index: usize, photo: &Processed) -> Result<(), Error> {
        let detections = &photo.detections;
        let frame = &self.series.frames[index];
        let light = self.lights.as_ref().map_or(detections.light, |lights| lights[index]);
        let is_repeated = !detections.sha256.is_empty() && self.sha256.ends_with(&detections.sha256);
        let problem = if is_repeated {
            Some("the same bytes as the photograph before".to_owned())
        } else {
            detections.problem.clone()
        };
        self.sha256 += &detections.sha256;
        self.problems.extend(problem.map(|problem| (frame.name.clone(), problem)));
        let mut seen = Vec::with_capacity(self.plants.len());
        let plants = self.trackers.iter_mut().zip(&mut self.clicked).zip(&mut self.tables);
        for ((((tracker, clicked), table), detection), line) in
            plants.zip(&detections.plants).zip(&photo.lines)
        {
            let result = if is_repeated { Err(FrameStatus::Repeated) } else { detection.result() };
            let (detected, tracked, confidence) = match clicked {
                Some(clicked) => {
                    clicked.update(index, result.as_ref().map_err(|status| *status), line.as_ref())
                }
                None => {
                    let tracked = tracker.update(result, frame.time_s);
                    // A stem whose end is unknown is not written down.
                    let mut detected = detection.detected.clone();
                    if let Some(detected) = detected.as_mut().filter(|_| !tracker.has_measured_stem()) {
                        (detected.stem, detected.apex) = (None, None);
                    }
                    (detected, tracked, StemConfidence::default())
                }
            };
            table.add(frame, detected.as_ref(), tracked.clone(), confidence, light);
            seen.push((detected, tracked));
        }
        let Some(image) = &photo.image else { return Ok(()) };
        let annotations: Vec<Annotation<'_>> = self
            .plants
            .iter()
            .zip(&seen)
            .map(|(plant, (detected, seen))| Annotation { plant, detection: detected.as_ref(), seen })
            .collect();
        self.overlays.add(index, &frame.name, image, &annotations, light)
    }
}

/// The detections of a photograph, and its pixels if it is to be drawn.
struct Processed {
    detections: FrameDetections,
    /// The midline of the stem of each plant that was clicked.
    lines: Vec<Option<LearnedLine>>,
    /// Its line for the journal; `None` if it is there already.
    line: Option<String>,
    image: Option<Arc<Image>>,
}

impl Processed {
    /// Takes the detections that are `known` from the journal, or detects the plants now.
    fn new(
        trackers: &[TipTracker],
        clicked: &[Option<ClickedPlant>],
        (index, name): (usize, &str),
        known: Option<FrameDetections>,
        photo: Result<Photo, String>,
        sha256: String,
        is_drawn: bool,
    ) -> Result<Self, Error> {
        let is_new = known.is_none();
        let frame = photo.map(vision::Frame::new);
        let detections = known.unwrap_or_else(|| detect(trackers, name, &frame, sha256));
        let picture = frame.as_ref().ok().and_then(|frame| frame.picture().ok());
        let learned = |(clicked, detection): (&Option<ClickedPlant>, &PlantDetection)| {
            let registered = detection.detected.as_ref().map(|detected| detected.camera_shift);
            clicked.as_ref()?.line(index, picture?, registered)
        };
        let lines = clicked.iter().zip(&detections.plants).map(learned).collect();
        let line = if is_new { Some(detections.line()?) } else { None };
        let image = frame.ok().filter(|_| is_drawn).and_then(|frame| frame.into_image().ok()).map(Arc::new);
        Ok(Self { detections, lines, line, image })
    }
}

/// Detects all plants in one photograph.
fn detect(
    trackers: &[TipTracker],
    name: &str,
    frame: &Result<vision::Frame, String>,
    sha256: String,
) -> FrameDetections {
    // A file that cannot be read counts as a damaged photograph: it does not end the series.
    let detect = |tracker: &TipTracker| match frame {
        Ok(frame) => PlantDetection::new(tracker.detect(frame.picture())),
        Err(_) => PlantDetection::new(Err(FrameStatus::Corrupt)),
    };
    let plants: Vec<PlantDetection> = trackers.iter().map(detect).collect();
    let picture = frame.as_ref().map(vision::Frame::picture);
    let problem = match picture {
        Err(problem) => Some(problem.clone()),
        Ok(Err(error)) => Some(error.to_string()),
        Ok(Ok(picture)) => {
            let (width, height) = picture.size();
            let is_foreign = plants.iter().any(|plant| plant.class == FrameStatus::Foreign);
            let problem = trackers[0].calibration().check_size(width, height).err();
            problem.filter(|_| is_foreign).map(|error| error.to_string())
        }
    };
    let light = picture.ok().and_then(Result::ok).and_then(|picture| lamp_state(picture, None));
    FrameDetections { frame: name.to_owned(), sha256, light, problem, plants }
}
