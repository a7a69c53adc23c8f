//! Errors on real photographs against marks made by hand, in pixels: what `tropism track` itself answers.
//!
//! Each set has two halves: thresholds of vision were chosen on the first (`old`), and the second (`new`) was kept
//! apart from that.

mod bean;
mod centerlines;
mod silhouettes;
mod sunflower;
mod touching;

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use tropism::geometry::Pixel;
use tropism::math::statistics::quantile_nearest;
use tropism::photo::Photo;
use tropism::vision::raster::source::PixelSource;
use tropism::vision::{Calibration, Detection, Frame, FrameStatus, Mode, TipTracker, VisionConfig};

use crate::reliability::Reliability;
use crate::share::Share;

/// Width of the picture at the plant that `tropism track` assumes where no scale is given, in cm.
const ASSUMED_WIDTH_CM: f64 = 74.0;

/// Prints the lines of one half of a set, and adds its answers with marks to the diagram of reliability.
type Half = fn(&Path, &str, Mode, &mut Reliability);

/// Names of the halves, and the suffixes of their folders.
const HALVES: [(&str, &str); 2] = [("old", ""), ("new", "-2")];

pub(crate) fn print(folder: &Path, mode: Mode, has: impl Fn(&str) -> bool) {
    println!("\nreal photographs, pixels; shares with their 95 % intervals (Wilson)");
    let rows: [(&str, Half); 5] = [
        ("real/bean", bean::print),
        ("real/touching", touching::print),
        ("real/sunflower", sunflower::print),
        ("real/centerlines", centerlines::print),
        ("real/silhouettes", silhouettes::print),
    ];
    let mut reliability = HALVES.map(|_| Reliability::default());
    for (name, row) in rows.into_iter().filter(|(name, _)| has(name)) {
        for ((half, suffix), reliability) in HALVES.into_iter().zip(&mut reliability) {
            println!("{name}, {half}");
            row(folder, suffix, mode, reliability);
        }
    }
    for ((half, _), reliability) in HALVES.into_iter().zip(&reliability) {
        println!("confidence, {half}: {reliability}");
    }
}

/// The answer to one photograph.
struct Answer {
    detection: Option<Detection>,
    status: FrameStatus,
    is_measured: bool,
    has_stem: bool,
    confidence: f64,
}

impl Answer {
    /// The tracker's answer to the photograph of time `time_s`, in which this was detected.
    fn of(tracker: &mut TipTracker, detection: Result<Detection, FrameStatus>, time_s: f64) -> Self {
        let tracked = tracker.update(detection.clone(), time_s);
        Self {
            detection: detection.ok(),
            status: tracked.status,
            is_measured: tracked.is_measured(),
            has_stem: tracker.has_measured_stem(),
            confidence: tracked.confidence,
        }
    }

    /// The detection, if the track takes it.
    fn measured(&self) -> Option<&Detection> {
        self.detection.as_ref().filter(|_| self.is_measured)
    }

    /// The end of the stem, if the track takes it.
    fn apex(&self) -> Option<Pixel> {
        self.measured().filter(|_| self.has_stem)?.apex
    }
}

/// Tracks photographs in order, as `tropism track` does: files with their times in seconds.
fn track(files: &[(PathBuf, f64)], calibration: Calibration, config: VisionConfig) -> Vec<Answer> {
    let frames: Vec<Frame> = files.iter().map(|(file, time_s)| frame(file, *time_s)).collect();
    track_frames(&frames, calibration, config)
}

fn track_frames(frames: &[Frame], calibration: Calibration, config: VisionConfig) -> Vec<Answer> {
    let mut tracker = TipTracker::new(calibration, config).expect("a region inside the picture");
    let pictures = frames.iter().filter_map(|frame| frame.picture().ok());
    pictures.take(TipTracker::REFERENCE_FRAMES).for_each(|picture| tracker.set_reference(picture));
    let detections: Vec<_> = frames.par_iter().map(|frame| tracker.detect(frame.picture())).collect();
    let times = frames.iter().map(|frame| frame.photo().time_s);
    detections
        .into_iter()
        .zip(times)
        .map(|(detection, time_s)| Answer::of(&mut tracker, detection, time_s))
        .collect()
}

/// The answer to one photograph of a plant whose stem leaves the soil at `base`, without region and scale.
fn alone(file: &Path, base: Pixel, mode: Mode) -> Answer {
    alone_in(&frame(file, 0.0), base, mode)
}

fn alone_in(frame: &Frame, base: Pixel, mode: Mode) -> Answer {
    let size = frame.picture().expect("a whole photograph").size();
    let config = VisionConfig { mode, ..VisionConfig::default() };
    let tracker = TipTracker::new(assumed_scale(base, size), config).expect("the whole picture");
    let mut tracker = tracker.for_unrelated();
    let detection = tracker.detect(frame.picture());
    Answer::of(&mut tracker, detection, 0.0)
}

/// The photograph in a file, taken at a time in seconds.
fn frame(file: &Path, time_s: f64) -> Frame {
    let bytes = std::fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    Frame::new(Photo { name: file.display().to_string(), bytes, time_s })
}

/// The scale that is assumed for pictures of `width` x `height`.
fn assumed_scale(base: Pixel, (width, height): (usize, usize)) -> Calibration {
    Calibration::from_scale(base, width as f64 / ASSUMED_WIDTH_CM, width, height)
}

/// The share of errors of at most `most` pixels, and their quantiles; `None` is no answer, and no success.
fn within(errors: &[Option<f64>], most: f64) -> String {
    let share = Share::of(errors.iter().map(|error| error.is_some_and(|error| error <= most)));
    let known: Vec<f64> = errors.iter().copied().flatten().collect();
    format!(
        "within {most} px {share}, of those given {}, median {:.1}, worst {:.1}",
        Share::of(known.iter().map(|&error| error <= most)),
        quantile_nearest(&known, 0.5),
        quantile_nearest(&known, 1.0)
    )
}

/// Counts of the classes of answers.
fn classes(answers: &[Answer]) -> String {
    let count = |status: FrameStatus| answers.iter().filter(|answer| answer.status == status).count();
    let counts = FrameStatus::ALL.map(|status| (status.name(), count(status)));
    let named = counts.iter().filter(|(_, count)| *count > 0).map(|(name, count)| format!("{name} {count}"));
    named.collect::<Vec<_>>().join(", ")
}
