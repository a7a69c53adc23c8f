//! Scores: errors of tracked frames against ground truth.

use std::collections::BTreeMap;

use tropism::math::statistics::quantile_nearest;
use tropism::observation::Quality;
use tropism::vision::{FrameStatus, TrackedFrame};
use tropism_bean::render::Truth;

use crate::published::off;

/// Distance from the true tip, in mm, above which a tip is wrong: a model must not be built on it.
const WRONG_MM: f64 = 5.0;

/// Number of frames for which a tip may be held; after that there is no answer.
const HELD: usize = 3;

/// Errors and counts of the frames of one row.
#[derive(Default)]
pub(crate) struct Score {
    frames: usize,
    classes: BTreeMap<&'static str, usize>,
    measured: usize,
    held: usize,
    /// Frames with the class ok and a wrong tip, a line each.
    pub(crate) wrong: Vec<String>,
    /// Confidence of each measured tip, and whether it is right.
    pub(crate) answers: Vec<(f64, bool)>,
    /// Errors of measured tops, in mm to the right and up.
    tops: Vec<[f64; 2]>,
    apexes: Vec<f64>,
    /// Mean distance of each ten-point stem from the true curve, in mm.
    stems: Vec<f64>,
    /// Greatest distance of a vertex from the true vertex of the same number, in mm.
    vertices: Vec<f64>,
    /// Errors of tips carried forward, in mm.
    helds: Vec<f64>,
    /// Frames in a row without a measurement: at present, and at most.
    gap: usize,
    longest_gap: usize,
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

impl Score {
    pub(crate) const HEADER: &str = "row                  frames |  top: bias x,y  deviation   median   95 %    max | apex: median   95 %    max | \
                                     stem: mean   95 % vertex | measured   held  none | wrong but ok | held 95 % | gap | classes";

    /// Adds the frame `name`; one that is not `scored` only ends a gap. Returns whether its class is ok and its tip
    /// wrong.
    pub(crate) fn add(&mut self, name: &str, seen: &TrackedFrame, truth: &Truth, scored: bool) -> bool {
        let measured = seen.observation.as_ref().filter(|seen| seen.quality == Quality::Measured);
        self.gap = if measured.is_some() { 0 } else { self.gap + 1 };
        self.longest_gap = self.longest_gap.max(self.gap);
        if !scored {
            return false;
        }
        self.frames += 1;
        *self.classes.entry(seen.status.name()).or_default() += 1;
        let Some(observation) = &seen.observation else { return false };
        let miss = 10.0 * observation.tip.distance(truth.top);
        if measured.is_none() {
            if self.gap <= HELD {
                self.held += 1;
                self.helds.push(miss);
            }
            return false;
        }
        self.measured += 1;
        self.answers.push((seen.confidence, miss <= WRONG_MM));
        let error = [10.0 * (observation.tip.x - truth.top.x), 10.0 * (observation.tip.y - truth.top.y)];
        let is_wrong = seen.status == FrameStatus::Ok && miss > WRONG_MM;
        if is_wrong {
            self.wrong.push(format!(
                "{name}: {miss:.1} mm ({:.1}, {:.1}), confidence {:.2}",
                error[0], error[1], seen.confidence
            ));
        }
        self.tops.push(error);
        if let Some(stem) = observation.stem.as_ref().filter(|stem| stem.0.len() == 10) {
            self.apexes.push(10.0 * stem.0[9].distance(truth.apex));
            self.stems.push(10.0 * mean(stem.0.iter().map(|&point| off(point, &truth.midline))));
            let ten = truth.midline.resampled(10);
            let apart = stem.0.iter().zip(&ten.0).map(|(one, other)| 10.0 * one.distance(*other));
            self.vertices.push(apart.fold(0.0, f64::max));
        }
        is_wrong
    }

    /// Number of frames scored so far.
    pub(crate) const fn frames(&self) -> usize {
        self.frames
    }

    pub(crate) fn merge(&mut self, other: Self) {
        self.frames += other.frames;
        self.measured += other.measured;
        self.held += other.held;
        self.wrong.extend(other.wrong);
        self.answers.extend(other.answers);
        self.tops.extend(other.tops);
        self.apexes.extend(other.apexes);
        self.stems.extend(other.stems);
        self.vertices.extend(other.vertices);
        self.helds.extend(other.helds);
        self.longest_gap = self.longest_gap.max(other.longest_gap);
        for (class, count) in other.classes {
            *self.classes.entry(class).or_default() += count;
        }
    }

    /// The row of the table, as text.
    pub(crate) fn line(&self, name: &str) -> String {
        let bias: [f64; 2] = std::array::from_fn(|axis| mean(self.tops.iter().map(|off| off[axis])));
        let deviation: [f64; 2] = std::array::from_fn(|axis| {
            mean(self.tops.iter().map(|off| (off[axis] - bias[axis]) * (off[axis] - bias[axis]))).sqrt()
        });
        let tops: Vec<f64> = self.tops.iter().map(|off| (off[0] * off[0] + off[1] * off[1]).sqrt()).collect();
        let share = |count: usize| 100.0 * count as f64 / self.frames.max(1) as f64;
        let none = self.frames - self.measured - self.held;
        let classes: Vec<String> =
            self.classes.iter().map(|(class, count)| format!("{class} {count}")).collect();
        format!(
            "{name:20} {:6} | {:6.2},{:5.2} {:5.2},{:5.2} {:8.2} {:6.2} {:6.1} | {:12.2} {:6.2} {:6.1} | {:10.2} {:6.2} {:6.2} | {:8.1} {:6.1} {:5.1} | {:12.2} | {:9.1} | {:3} | {}",
            self.frames,
            bias[0],
            bias[1],
            deviation[0],
            deviation[1],
            quantile_nearest(&tops, 0.5),
            quantile_nearest(&tops, 0.95),
            quantile_nearest(&tops, 1.0),
            quantile_nearest(&self.apexes, 0.5),
            quantile_nearest(&self.apexes, 0.95),
            quantile_nearest(&self.apexes, 1.0),
            quantile_nearest(&self.stems, 0.5),
            quantile_nearest(&self.stems, 0.95),
            quantile_nearest(&self.vertices, 0.5),
            share(self.measured),
            share(self.held),
            share(none),
            share(self.wrong.len()),
            quantile_nearest(&self.helds, 0.95),
            self.longest_gap,
            classes.join(", "),
        )
    }
}
