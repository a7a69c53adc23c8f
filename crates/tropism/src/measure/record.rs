//! Stems over time, as they enter the fit.
//!
//! In: a track with stems. Out: ten points a frame with a fixed base, the length as a robust line, and the lamps. Frames that a
//! fit must not use are left out and counted.

use crate::geometry::{Point, STEM_POINTS};
use crate::lamps::Light;
use crate::lighting::Lighting;
use crate::math::statistics::{median, robust_deviation, standard_deviation};
use crate::observation::Quality;
use crate::track::Track;

/// Largest number of frames that a fit uses; more are thinned evenly. Chosen: on simulated plants 25 frames in 12 hours gave
/// what 145 gave, as circumnutation limits and not the camera.
pub const MAX_FRAMES: usize = 145;

/// Least number of frames with a stem. Chosen: the fit has six unknown numbers and the forcing.
pub const MIN_FRAMES: usize = 8;

/// A frame is left out if its length is further from the robust line than this many robust standard deviations. Chosen: the usual
/// limit of an outlier of a normal distribution in a thousand frames.
const LENGTH_OUTLIER: f64 = 4.5;

/// Stems of one plant over time.
#[derive(Clone, Debug, PartialEq)]
pub struct StemRecord {
    /// Time of each frame since the first, in h.
    pub times_h: Vec<f64>,
    /// Ten points at equal distances along the stem in each frame, from the base, which is (0, 0), in cm.
    pub stems: Vec<[Point; STEM_POINTS]>,
    /// The side that is lit from each frame to the next: -1 left, 1 right, 0 dark or another lamp.
    pub lamps: Vec<f64>,
    /// Length in each frame, in cm: the robust line.
    pub length_cm: Vec<f64>,
    /// The line of the length, in cm and cm/h.
    pub growth: Line,
    /// Which frames are left out.
    pub quality: FrameCounts,
}

/// Frames of a record, and those left out by the quality gate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct FrameCounts {
    /// Frames of the track.
    pub all: usize,
    /// Frames without a measured stem.
    pub without_stem: usize,
    /// Frames whose length jumps off the line of growth.
    pub length_jumps: usize,
    /// Frames that the fit uses, after thinning.
    pub used: usize,
}

/// A robust line through values over time.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Line {
    /// Value at time 0.
    pub start: f64,
    /// Change an hour.
    pub slope: f64,
    /// 90 % interval of the slope, from the scatter of blocks of the record.
    pub slope_interval: [f64; 2],
    /// Robust standard deviation of the values around the line (1.4826 times the median deviation).
    pub scatter: f64,
}

/// Why a track gives no record.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// Too few frames show a stem.
    #[error(
        "{with_stem} of {all} frames have a stem that can be used; at least {MIN_FRAMES} are needed. \
         Stems are the columns stem_1_x_cm to stem_10_y_cm of `tropism track` and `tropism grow`"
    )]
    TooFewStems {
        /// Frames of the track.
        all: usize,
        /// Frames with a stem.
        with_stem: usize,
    },
}

impl StemRecord {
    /// The record of a track with stems.
    ///
    /// The base is the median of the first points: pots stand still. A stem whose length jumps is left out.
    ///
    /// # Errors
    /// [`RecordError`] if fewer than [`MIN_FRAMES`] frames have a stem.
    pub fn of(track: &Track) -> Result<Self, RecordError> {
        let side = |lighting: Lighting| {
            let powers = lighting.powers();
            powers[Light::RIGHT.index()] - powers[Light::LEFT.index()]
        };
        let frames =
            track.samples.iter().filter(|sample| sample.quality != Quality::CarriedForward).filter_map(
                |sample| {
                    let stem: [Point; STEM_POINTS] =
                        sample.stem.as_ref()?.resampled(STEM_POINTS).0.try_into().ok()?;
                    stem.iter().all(|point| point.is_finite()).then_some((
                        sample.time_s / 3600.0,
                        stem,
                        side(sample.lighting()),
                    ))
                },
            );
        Self::of_frames(frames.collect(), track.samples.len())
    }

    /// The record of frames: time in h, stem in cm, and lit side. `all` counts frames without a stem, too.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn of_frames(
        mut frames: Vec<(f64, [Point; STEM_POINTS], f64)>,
        all: usize,
    ) -> Result<Self, RecordError> {
        let with_stem = frames.len();
        let too_few = |with_stem| RecordError::TooFewStems { all, with_stem };
        if with_stem < MIN_FRAMES {
            return Err(too_few(with_stem));
        }
        let middle = |axis: fn(&Point) -> f64| {
            median(&frames.iter().map(|(_, stem, _)| axis(&stem[0])).collect::<Vec<_>>())
        };
        let base = Point::new(middle(|point| point.x), middle(|point| point.y));
        for (_, stem, _) in &mut frames {
            stem.iter_mut().for_each(|point| *point = Point::new(point.x - base.x, point.y - base.y));
        }
        let line = |frames: &[(f64, [Point; STEM_POINTS], f64)]| {
            let times: Vec<f64> = frames.iter().map(|(time, ..)| *time).collect();
            let lengths: Vec<f64> =
                frames.iter().map(|(_, stem, _)| crate::geometry::path::length(&stem[..])).collect();
            let growth = Line::through(&times, &lengths);
            (growth, times, lengths)
        };
        let (growth, times, lengths) = line(&frames);
        // A millimetre always passes: stems without noise have no scatter.
        let limit = (LENGTH_OUTLIER * growth.scatter).max(0.1);
        let mut jumps =
            times.iter().zip(&lengths).map(|(time, length)| (length - growth.at(*time)).abs() > limit);
        frames.retain(|_| !jumps.next().unwrap_or(false));
        let kept = frames.len();
        if kept < MIN_FRAMES {
            return Err(too_few(kept));
        }
        let (growth, ..) = line(&frames);
        let frames = thinned(frames);
        let start = frames[0].0;
        let growth = Line { start: growth.at(start), ..growth };
        let times_h: Vec<f64> = frames.iter().map(|(time, ..)| time - start).collect();
        let quality = FrameCounts {
            all,
            without_stem: all - with_stem,
            length_jumps: with_stem - kept,
            used: frames.len(),
        };
        Ok(Self {
            length_cm: times_h.iter().map(|time| growth.at(*time).max(0.1)).collect(),
            stems: frames.iter().map(|(_, stem, _)| *stem).collect(),
            lamps: frames.iter().map(|(.., lamp)| *lamp).collect(),
            times_h,
            growth,
            quality,
        })
    }

    /// Length of the record, in h.
    #[must_use]
    pub fn duration_h(&self) -> f64 {
        self.times_h.last().copied().unwrap_or(0.0)
    }

    /// Angle of the upper third of each stem to the vertical, in rad, positive towards positive x, without jumps of a turn.
    #[must_use]
    pub fn tip_angles(&self) -> Vec<f64> {
        let mut last = 0.0;
        let angle = |stem: &[Point; STEM_POINTS]| {
            let (from, to) = (stem[STEM_POINTS - 4], stem[STEM_POINTS - 1]);
            let angle = crate::math::atan2(to.x - from.x, to.y - from.y);
            let turns = ((last - angle) / core::f64::consts::TAU).round();
            last = angle + turns * core::f64::consts::TAU;
            last
        };
        self.stems.iter().map(angle).collect()
    }
}

/// At most [`MAX_FRAMES`], evenly. A lamp that was lit between two frames that stay is that of the first.
fn thinned<F: Clone>(frames: Vec<F>) -> Vec<F> {
    if frames.len() <= MAX_FRAMES {
        return frames;
    }
    let last = frames.len() - 1;
    (0..MAX_FRAMES)
        .map(|number| frames[(number * last + (MAX_FRAMES - 1) / 2) / (MAX_FRAMES - 1)].clone())
        .collect()
}

/// Blocks of a record whose slopes give the interval of the growth rate, and Student's t for 90 % with one degree of freedom
/// less.
const GROWTH_BLOCKS: usize = 6;
const T_5: f64 = 2.015;

impl Line {
    /// The line of Theil and Sen: the median of the slopes between all pairs (Sen 1968, doi:10.1080/01621459.1968.10480934).
    ///
    /// The interval of the slope is that of the mean slope of six blocks, each from its first to its last third, which allows for
    /// growth that fluctuates slowly.
    #[must_use]
    pub fn through(times_h: &[f64], values: &[f64]) -> Self {
        let slope = slope(times_h, values);
        let start =
            median(&times_h.iter().zip(values).map(|(time, value)| value - slope * time).collect::<Vec<_>>());
        let away: Vec<f64> =
            times_h.iter().zip(values).map(|(time, value)| (value - start - slope * time).abs()).collect();
        let block = times_h.len().div_ceil(GROWTH_BLOCKS).max(2);
        let slopes: Vec<f64> = times_h
            .chunks(block)
            .zip(values.chunks(block))
            .filter(|(times, _)| times.len() >= 2)
            .map(|(times, values)| self::slope(times, values))
            .collect();
        let spread = standard_deviation(&slopes);
        let half = T_5 * spread / (slopes.len() as f64).sqrt();
        Self { start, slope, slope_interval: [slope - half, slope + half], scatter: robust_deviation(&away) }
    }

    /// The value at a time in h.
    #[must_use]
    pub fn at(&self, time_h: f64) -> f64 {
        self.start + self.slope * time_h
    }
}

/// The median slope between pairs of points.
fn slope(times_h: &[f64], values: &[f64]) -> f64 {
    let mut slopes = Vec::new();
    // Pairs of neighbours say little; of long records every pair at least a tenth apart is enough.
    let step = (times_h.len() / 200).max(1);
    for one in (0..times_h.len()).step_by(step) {
        for other in (one + 1..times_h.len()).step_by(step) {
            let apart = times_h[other] - times_h[one];
            if apart > 0.0 {
                slopes.push((values[other] - values[one]) / apart);
            }
        }
    }
    if slopes.is_empty() { 0.0 } else { median(&slopes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_ignores_a_fifth_of_wild_values() {
        let times: Vec<f64> = (0..50).map(f64::from).collect();
        let values: Vec<f64> =
            times.iter().map(|t| if *t as u32 % 5 == 2 { 90.0 } else { 3.0 + 0.1 * t }).collect();
        let line = Line::through(&times, &values);
        assert!((line.slope - 0.1).abs() < 0.01 && (line.start - 3.0).abs() < 0.2, "{line:?}");
    }

    #[test]
    fn frames_that_jump_are_left_out_and_counted() {
        let frame = |number: usize| {
            let length = if number == 7 { 9.0 } else { 5.0 + 0.01 * number as f64 };
            let stem = core::array::from_fn(|k| Point::new(1.0, 2.0 + length * k as f64 / 9.0));
            (number as f64 / 12.0, stem, 0.0)
        };
        let record = StemRecord::of_frames((0..40).map(frame).collect(), 42).unwrap();
        assert_eq!(record.quality, FrameCounts { all: 42, without_stem: 2, length_jumps: 1, used: 39 });
        assert!((record.growth.slope - 0.12).abs() < 1e-6, "{:?}", record.growth);
        assert_eq!(record.stems[0][0], Point::new(0.0, 0.0));
        let few = StemRecord::of_frames((0..5).map(frame).collect(), 42);
        assert_eq!(few, Err(RecordError::TooFewStems { all: 42, with_stem: 5 }));
    }
}
