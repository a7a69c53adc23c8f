//! What was seen of one plant in all photographs: rows, and what they come to.

use std::collections::BTreeMap;

use serde::Serialize;
use tropism::geometry::{Pixel, Point};
use tropism::lamps::{self, Light};
use tropism::track::{Column, PAPER_PERIOD_MIN, Sample, Track};
use tropism::vision::tracking::smoother::{SmoothedTip, TipMeasurement, smooth};
use tropism::vision::{Calibration, Detection, FrameStatus, TrackedFrame};

use super::series::Shot;

/// Vertices of a stem (section 4).
const VERTICES: usize = 10;

/// Photographs follow each other at least so many periods of five minutes apart.
const SOONEST: f64 = 0.01;

/// One photograph.
struct Row {
    frame: String,
    sample: Sample,
    class: FrameStatus,
    confidence: f64,
    /// What is found in it, whether or not it is believed.
    measurement: TipMeasurement,
    /// What was measured in it; `None` where the tip is held.
    measured: Option<Measured>,
}

struct Measured {
    /// How far the camera's picture has moved, in pixels.
    shift: Pixel,
    top: Pixel,
    apex: Option<Pixel>,
    /// From the base up.
    stem: Vec<Point>,
    length_cm: Option<f64>,
}

/// The rows of one plant.
pub(crate) struct Table {
    calibration: Calibration,
    rows: Vec<Row>,
    gap: usize,
    /// When the plant was seen last, or the first photograph was taken.
    seen_s: Option<f64>,
    pub(crate) counts: Counts,
}

/// What the photographs come to.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Counts {
    pub(crate) frames: usize,
    pub(crate) measured: usize,
    pub(crate) held: usize,
    /// Photographs before the first in which the plant is seen: there is nothing to hold, so they have no row.
    pub(crate) before: usize,
    pub(crate) classes: BTreeMap<&'static str, usize>,
    /// Photographs in which the plant reaches an edge of its region, by edge.
    pub(crate) leaves_view_at: BTreeMap<&'static str, usize>,
    /// The most photographs in a row without a measured tip.
    pub(crate) longest_gap: usize,
    /// The longest time from one measured tip to the next, or to an end of the series, with photographs between.
    pub(crate) longest_gap_min: f64,
    pub(crate) lights: BTreeMap<&'static str, usize>,
    pub(crate) camera: Camera,
}

/// How far the camera was moved.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Camera {
    /// Photographs in which what stands still is elsewhere than in the first; what is seen in them is corrected for that.
    pub(crate) moved: usize,
    /// The first of them.
    pub(crate) first: Option<String>,
    /// The farthest that it was moved, in pixels.
    pub(crate) farthest_px: f64,
    /// Photographs in which too little of what stands still is found again to say, nor to correct.
    pub(crate) unknown: usize,
}

impl Camera {
    fn add(&mut self, frame: &str, sighting: &Detection) {
        self.unknown += usize::from(sighting.is_unregistered);
        let far = sighting.camera_shift.distance(Pixel::default());
        if far > 0.0 {
            self.moved += 1;
            self.first.get_or_insert_with(|| frame.to_owned());
            self.farthest_px = self.farthest_px.max((far * 100.0).round() / 100.0);
        }
    }

    /// A line about it, if there is anything to say.
    pub(crate) fn words(&self, px_per_cm: f64) -> Option<String> {
        let moved = self.first.as_ref().map(|first| {
            format!(
                "moved by up to {:.1} px ({:.1} mm) in {} photographs, first in {first}: corrected",
                self.farthest_px,
                10.0 * self.farthest_px / px_per_cm,
                self.moved
            )
        });
        let unknown = (self.unknown > 0)
            .then(|| format!("background not found again in {} photographs: not corrected", self.unknown));
        let words: Vec<String> = moved.into_iter().chain(unknown).collect();
        (!words.is_empty()).then(|| format!("camera {}", words.join("; ")))
    }
}

impl Table {
    pub(crate) fn new(calibration: Calibration) -> Self {
        Self { calibration, rows: Vec::new(), gap: 0, seen_s: None, counts: Counts::default() }
    }

    /// Adds the next photograph.
    pub(crate) fn add(
        &mut self,
        shot: &Shot,
        sighting: Option<&Detection>,
        seen: TrackedFrame,
        light: Option<Light>,
    ) {
        let counts = &mut self.counts;
        counts.frames += 1;
        *counts.classes.entry(seen.status.name()).or_default() += 1;
        *counts.lights.entry(lamps::name(light)).or_default() += 1;
        let since_min = (shot.time_s - *self.seen_s.get_or_insert(shot.time_s)) / 60.0;
        if !seen.is_measured() || self.gap > 0 {
            counts.longest_gap_min = counts.longest_gap_min.max(since_min);
        }
        if seen.is_measured() {
            (self.gap, self.seen_s) = (0, Some(shot.time_s));
        } else {
            self.gap += 1;
            counts.longest_gap = counts.longest_gap.max(self.gap);
        }
        sighting.iter().for_each(|sighting| counts.camera.add(&shot.name, sighting));
        if let Some(edge) = sighting.and_then(|sighting| sighting.clipped_at) {
            *counts.leaves_view_at.entry(edge.name()).or_default() += 1;
        }
        let is_measured = seen.is_measured();
        let Some(observation) = seen.observation else {
            counts.before += 1;
            return;
        };
        counts.measured += usize::from(is_measured);
        counts.held += usize::from(!is_measured);
        let shift = sighting.map_or_else(Pixel::default, |sighting| sighting.camera_shift);
        let last = self.rows.last().map_or(f64::NEG_INFINITY, |row| row.measurement.time);
        let measurement = TipMeasurement {
            // A burst of photographs may have one time.
            time: (shot.time_s / (60.0 * PAPER_PERIOD_MIN)).max(last + SOONEST),
            tip: seen.tip_px.map(|top| point(&self.calibration, top, shift)),
            is_accepted: is_measured,
        };
        let measured = seen.tip_px.filter(|_| is_measured).map(|top| Measured {
            shift,
            top,
            apex: sighting.and_then(|sighting| sighting.apex),
            length_cm: observation.stem.as_ref().map(|stem| stem.length()),
            stem: observation.stem.map(|stem| stem.resampled(VERTICES).0).unwrap_or_default(),
        });
        self.rows.push(Row {
            frame: shot.name.clone(),
            sample: Sample {
                step: shot.step,
                time_s: shot.time_s,
                tip: observation.tip,
                stem: None,
                light,
                quality: observation.quality,
            },
            class: seen.status,
            confidence: seen.confidence,
            measurement,
            measured,
        });
    }

    /// The track, with what was measured in further columns, empty where the tip is held; `None` if the plant was never
    /// seen.
    pub(crate) fn track(&self) -> Option<Track> {
        let mut track = Track::of(self.rows.iter().map(|row| row.sample.clone()).collect());
        let mut column = |name: &str, value: &dyn Fn(&Row) -> String| {
            let values = self.rows.iter().map(value).collect();
            track.columns.push(Column::parsed(name, values));
        };
        column("frame", &|row| row.frame.clone());
        column("class", &|row| row.class.to_string());
        column("confidence", &|row| format!("{:.3}", row.confidence));
        let calibration = &self.calibration;
        self.places(&mut column, "top", "px", &|found| Some(pair(found.top)));
        self.places(&mut column, "apex", "px", &|found| Some(pair(found.apex?)));
        self.places(&mut column, "apex", "cm", &|found| {
            Some(point(calibration, found.apex?, found.shift).into())
        });
        column("length_cm", &|row| text(row.measured.as_ref().and_then(|found| found.length_cm), 4));
        for unit in ["cm", "px"] {
            for vertex in 0..VERTICES {
                self.places(&mut column, &format!("stem_{}", vertex + 1), unit, &|found| {
                    let point = *found.stem.get(vertex)?;
                    let Pixel { x, y } = calibration.pixel(point);
                    Some(if unit == "cm" { point.into() } else { [x + found.shift.x, y + found.shift.y] })
                });
            }
        }
        let measurements: Vec<TipMeasurement> = self.rows.iter().map(|row| row.measurement).collect();
        let smoothed = smooth(&measurements);
        let mut column = |name: &str, value: fn(&SmoothedTip) -> f64| {
            let values = smoothed.iter().map(|one| text(one.as_ref().map(value), 4)).collect();
            track.columns.push(Column::parsed(name, values));
        };
        column("smooth_x_cm", |one| one.tip.x);
        column("smooth_y_cm", |one| one.tip.y);
        column("smooth_sd_cm", |one| one.deviation);
        (!track.samples.is_empty()).then_some(track)
    }

    /// The columns of a place.
    fn places(
        &self,
        column: &mut impl FnMut(&str, &dyn Fn(&Row) -> String),
        name: &str,
        unit: &str,
        place: &dyn Fn(&Measured) -> Option<[f64; 2]>,
    ) {
        let decimals = if unit == "px" { 2 } else { 4 };
        for (index, axis) in ["x", "y"].into_iter().enumerate() {
            column(&format!("{name}_{axis}_{unit}"), &|row| {
                text(row.measured.as_ref().and_then(place).map(|place| place[index]), decimals)
            });
        }
    }
}

/// The point that a pixel shows of a camera whose picture has moved.
fn point(calibration: &Calibration, pixel: Pixel, shift: Pixel) -> Point {
    calibration.point(Pixel::new(pixel.x - shift.x, pixel.y - shift.y))
}

const fn pair(pixel: Pixel) -> [f64; 2] {
    [pixel.x, pixel.y]
}

fn text(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(String::new, |value| format!("{value:.decimals$}"))
}

/// `left 47, right 47`.
pub(crate) fn words(counts: &BTreeMap<&'static str, usize>) -> String {
    counts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}
