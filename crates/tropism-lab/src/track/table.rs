//! The rows of one plant's track, and their counts.

use std::collections::BTreeMap;

use serde::Serialize;
use tropism::geometry::{Pixel, Point, STEM_POINTS};
use tropism::lamps::{self, Light};
use tropism::track::{Column, PAPER_PERIOD_MIN, Sample, Track};
use tropism::vision::tracking::smoother::{SmoothedTip, TipMeasurement, smooth};
use tropism::vision::{Calibration, Detection, FrameStatus, TrackedFrame};

use super::series::Frame;

/// Unit of time of the smoother, whose noise is given per five minutes, in minutes; whatever the period of the track.
const SMOOTHER_UNIT_MIN: f64 = PAPER_PERIOD_MIN;

/// Least time between two measurements for the smoother, in its units: photographs of a burst may have the same time, and
/// its times must rise.
const LEAST_INTERVAL: f64 = 0.01;

/// Share of the confidence of a tip that its stem's end has without a click. Of the ends on photographs that nothing was chosen
/// on, 62 to 73 % were right.
const UNCLICKED_END: f64 = 0.7;

/// One photograph.
struct Row {
    frame: String,
    sample: Sample,
    class: FrameStatus,
    confidence: f64,
    /// The detected tip, accepted or not, for the smoother.
    glance: TipMeasurement,
    /// `None` if the tip is carried forward.
    measurement: Option<Measurement>,
}

/// How sure the stem of a clicked plant is in one photograph, 0 to 1; `None` where no click says so.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StemConfidence {
    /// That its end is right.
    pub(super) end: Option<f64>,
    /// That its length is right.
    pub(super) length: Option<f64>,
}

/// What was measured in one photograph.
struct Measurement {
    /// Shift of the camera's picture since the first photograph, in pixels.
    shift: Pixel,
    /// The highest point of the plant.
    top: Pixel,
    /// The end of the stem.
    apex: Option<Pixel>,
    /// From the base up, in cm.
    stem: Vec<Point>,
    length_cm: Option<f64>,
    /// Confidence of the stem's end, 0 to 1.
    end_confidence: f64,
    /// Confidence of its length.
    length_confidence: f64,
}

/// The rows of one plant.
pub(super) struct Table {
    calibration: Calibration,
    /// Whether the photographs have nothing to do with each other.
    is_unrelated: bool,
    rows: Vec<Row>,
    /// Photographs since the last measured tip.
    gap: usize,
    /// Time of the last measured tip, or of the first photograph.
    measured_s: Option<f64>,
    /// The lowest point of the stem in each photograph with a measured tip, as if the camera had not moved.
    pub(super) feet: Vec<Pixel>,
    pub(super) counts: TrackCounts,
    /// The measured tip in each photograph, in pixels; `None` where it is held, or not yet seen.
    pub(super) tips: Vec<Option<Pixel>>,
}

/// How many photographs of a series are of which kind, for one plant.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TrackCounts {
    /// Photographs.
    pub frames: usize,
    /// Photographs with a measured tip.
    pub measured: usize,
    /// Photographs whose tip is carried forward from an earlier one.
    pub carried_forward: usize,
    /// Photographs before the first measured tip; they have no row in the track.
    pub before: usize,
    /// Photographs by [`FrameStatus`].
    pub classes: BTreeMap<&'static str, usize>,
    /// Photographs in which the plant reaches an edge of its region, by edge.
    pub leaves_view_at: BTreeMap<&'static str, usize>,
    /// Photographs in which another plant touches it.
    pub touched: usize,
    /// The most photographs in a row without a measured tip.
    pub longest_gap: usize,
    /// The longest time in minutes from one measured tip to the next, or to an end of the series, with photographs without a
    /// measured tip between them.
    pub longest_gap_min: f64,
    /// Photographs by the lamp that is lit.
    pub lights: BTreeMap<&'static str, usize>,
    /// Movement of the camera.
    pub camera: CameraMotion,
}

/// Movement of the camera over a series, from the background of the photographs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CameraMotion {
    /// Photographs whose background is shifted against the first. Their detections are corrected for the shift.
    pub moved: usize,
    /// The first of them.
    pub first: Option<String>,
    /// The largest shift, in pixels.
    pub farthest_px: f64,
    /// Photographs in which too little of the background is found to measure a shift. They are not corrected.
    pub unknown: usize,
}

impl CameraMotion {
    fn add(&mut self, frame: &str, detection: &Detection) {
        self.unknown += usize::from(detection.is_unregistered);
        let shift_px = detection.camera_shift.distance(Pixel::default());
        if shift_px > 0.0 {
            self.moved += 1;
            self.first.get_or_insert_with(|| frame.to_owned());
            self.farthest_px = self.farthest_px.max((shift_px * 100.0).round() / 100.0);
        }
    }
}

impl Table {
    pub(super) fn new(calibration: Calibration, is_unrelated: bool) -> Self {
        Self {
            calibration,
            is_unrelated,
            rows: Vec::new(),
            gap: 0,
            measured_s: None,
            feet: Vec::new(),
            counts: TrackCounts::default(),
            tips: Vec::new(),
        }
    }

    /// Adds the next photograph.
    pub(super) fn add(
        &mut self,
        frame: &Frame,
        detection: Option<&Detection>,
        seen: TrackedFrame,
        clicked: StemConfidence,
        light: Option<Light>,
    ) {
        self.count(frame, detection, &seen, light);
        let is_measured = seen.is_measured();
        self.tips.push(seen.tip_px.filter(|_| is_measured));
        let Some(observation) = seen.observation else { return };
        let shift = detection.map_or_else(Pixel::default, |detection| detection.camera_shift);
        let last = self.rows.last().map_or(f64::NEG_INFINITY, |row| row.glance.time);
        let glance = TipMeasurement {
            time: (frame.time_s / (60.0 * SMOOTHER_UNIT_MIN)).max(last + LEAST_INTERVAL),
            tip: seen.tip_px.map(|top| point(&self.calibration, top, shift)),
            is_accepted: is_measured,
        };
        // The observation holds the stem of an earlier photograph where this one shows none.
        let stem = observation.stem.filter(|_| detection.is_some_and(|detection| detection.stem.is_some()));
        let measurement = seen.tip_px.filter(|_| is_measured).map(|top| Measurement {
            shift,
            top,
            apex: detection.and_then(|detection| detection.apex),
            end_confidence: clicked.end.unwrap_or(UNCLICKED_END * seen.confidence),
            length_confidence: clicked.length.unwrap_or(UNCLICKED_END * seen.confidence),
            length_cm: stem.as_ref().map(|stem| stem.length()),
            stem: stem.map(|stem| stem.resampled(STEM_POINTS).0).unwrap_or_default(),
        });
        self.rows.push(Row {
            frame: frame.name.clone(),
            sample: Sample {
                step: frame.step,
                time_s: frame.time_s,
                tip: observation.tip,
                stem: None,
                depth: None,
                light,
                levels: None,
                quality: observation.quality,
            },
            class: seen.status,
            confidence: seen.confidence,
            glance,
            measurement,
        });
    }

    fn count(
        &mut self,
        frame: &Frame,
        detection: Option<&Detection>,
        seen: &TrackedFrame,
        light: Option<Light>,
    ) {
        let counts = &mut self.counts;
        counts.frames += 1;
        *counts.classes.entry(seen.status.name()).or_default() += 1;
        *counts.lights.entry(lamps::name(light)).or_default() += 1;
        let is_measured = seen.is_measured();
        let since_min = (frame.time_s - *self.measured_s.get_or_insert(frame.time_s)) / 60.0;
        if !is_measured || self.gap > 0 {
            counts.longest_gap_min = counts.longest_gap_min.max(since_min);
        }
        if is_measured {
            (self.gap, self.measured_s) = (0, Some(frame.time_s));
        } else {
            self.gap += 1;
            counts.longest_gap = counts.longest_gap.max(self.gap);
        }
        if let Some(detection) = detection {
            self.feet.extend(foot(detection, self.calibration.base).filter(|_| is_measured));
            if !self.is_unrelated {
                counts.camera.add(&frame.name, detection);
            }
            counts.touched += usize::from(detection.has_second_foot);
            if let Some(edge) = detection.clipped_at {
                *counts.leaves_view_at.entry(edge.name()).or_default() += 1;
            }
        }
        match (&seen.observation, is_measured) {
            (None, _) => counts.before += 1,
            (Some(_), true) => counts.measured += 1,
            (Some(_), false) => counts.carried_forward += 1,
        }
    }

    /// The photograph in which a click would help most: the middle of the longest row of photographs without a measured tip.
    pub(super) fn next_click(&self) -> Option<usize> {
        let mut start = 0;
        let mut gaps = Vec::new();
        for row in self.tips.chunk_by(|one, other| one.is_some() == other.is_some()) {
            if row[0].is_none() {
                gaps.push((row.len(), start + row.len() / 2));
            }
            start += row.len();
        }
        gaps.into_iter().rev().max_by_key(|(length, _)| *length).map(|(_, middle)| middle)
    }

    /// The track, with further columns of what was measured, empty where the tip is carried forward, and of the smoothed tip. `None` if
    /// the plant was never detected.
    ///
    /// `lights_are_seen` says whether lamps are as the photographs show them.
    pub(super) fn track(&self, lights_are_seen: bool) -> Option<Track> {
        if self.rows.is_empty() {
            return None;
        }
        let samples = self.rows.iter().map(|row| row.sample.clone()).collect();
        let is_of_photographs = lights_are_seen && !self.is_unrelated;
        let mut track = if is_of_photographs { Track::of_photographs(samples) } else { Track::of(samples) };
        self.add_measured_columns(&mut track);
        if !self.is_unrelated {
            self.add_smoothed_columns(&mut track);
        }
        Some(track)
    }

    fn add_measured_columns(&self, track: &mut Track) {
        let mut column = |name: &str, value: &dyn Fn(&Row) -> String| {
            let values = self.rows.iter().map(value).collect();
            track.columns.push(Column::parsed(name, values));
        };
        column("frame", &|row| row.frame.clone());
        column("class", &|row| row.class.to_string());
        column("confidence", &|row| format!("{:.3}", row.confidence));
        let calibration = &self.calibration;
        add_point_columns(&mut column, "top", "px", &|measured| Some(pair(measured.top)));
        add_point_columns(&mut column, "apex", "px", &|measured| Some(pair(measured.apex?)));
        add_point_columns(&mut column, "apex", "cm", &|measured| {
            Some(point(calibration, measured.apex?, measured.shift).into())
        });
        let confidence = |of: fn(&Measurement) -> Option<f64>| {
            move |row: &Row| text(row.measurement.as_ref().and_then(of), 3)
        };
        column("apex_confidence", &confidence(|measured| measured.apex.map(|_| measured.end_confidence)));
        column("length_cm", &|row| text(row.measurement.as_ref().and_then(|measured| measured.length_cm), 4));
        column(
            "length_confidence",
            &confidence(|measured| measured.length_cm.map(|_| measured.length_confidence)),
        );
        for unit in ["cm", "px"] {
            for vertex in 0..STEM_POINTS {
                add_point_columns(&mut column, &format!("stem_{}", vertex + 1), unit, &|measured| {
                    let point = *measured.stem.get(vertex)?;
                    let Pixel { x, y } = calibration.pixel(point);
                    let shift = measured.shift;
                    Some(if unit == "cm" { point.into() } else { [x + shift.x, y + shift.y] })
                });
            }
        }
    }

    fn add_smoothed_columns(&self, track: &mut Track) {
        let glances: Vec<TipMeasurement> = self.rows.iter().map(|row| row.glance).collect();
        let smoothed = smooth(&glances);
        let mut column = |name: &str, value: fn(&SmoothedTip) -> f64| {
            let values = smoothed.iter().map(|state| text(state.as_ref().map(value), 4)).collect();
            track.columns.push(Column::parsed(name, values));
        };
        column("smooth_x_cm", |state| state.tip.x);
        column("smooth_y_cm", |state| state.tip.y);
        column("smooth_sd_cm", |state| state.deviation);
    }
}

/// The lowest detected point of the stem, as if the camera had not moved. Where the detection extends the stem straight down
/// to `base`, it is the point above that.
fn foot(detection: &Detection, base: Pixel) -> Option<Pixel> {
    let shift = detection.camera_shift;
    let at_rest = |pixel: &Pixel| Pixel::new(pixel.x - shift.x, pixel.y - shift.y);
    detection.stem.as_deref()?.iter().map(at_rest).find(|pixel| pixel.distance(base) > 1e-6)
}

/// Adds the columns `NAME_x_UNIT` and `NAME_y_UNIT` of a point.
fn add_point_columns(
    column: &mut impl FnMut(&str, &dyn Fn(&Row) -> String),
    name: &str,
    unit: &str,
    point: &dyn Fn(&Measurement) -> Option<[f64; 2]>,
) {
    let decimals = if unit == "px" { 2 } else { 4 };
    for (index, axis) in ["x", "y"].into_iter().enumerate() {
        column(&format!("{name}_{axis}_{unit}"), &|row| {
            text(row.measurement.as_ref().and_then(point).map(|point| point[index]), decimals)
        });
    }
}

/// The point that a pixel shows, in a picture that the camera has shifted by `shift`.
fn point(calibration: &Calibration, pixel: Pixel, shift: Pixel) -> Point {
    calibration.point(Pixel::new(pixel.x - shift.x, pixel.y - shift.y))
}

const fn pair(pixel: Pixel) -> [f64; 2] {
    [pixel.x, pixel.y]
}

/// A number with `decimals` places; empty for `None`.
fn text(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(String::new, |value| format!("{value:.decimals$}"))
}
