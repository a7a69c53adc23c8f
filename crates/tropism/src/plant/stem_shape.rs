//! The stem as the models of it know it: few modes of the angles along it, its length, and the tip beside its end.
//!
//! In: measured stems, and what happened to them in each step. Out: the state of a simulated stem, which moves by what a
//! model expects and by what is replayed.

use super::history::{History, Window};
use super::measured_plant::{MAX_HEIGHT_CM, MeasuredPlant, MeasuredPlants, Stem};
use super::replay::{BLOCK_REACH_CM, Replay};
use crate::geometry::{Point, Polyline, STEM_POINTS};
use crate::math;
use crate::math::matrix::{eigen_symmetric, transform};
use crate::observation::Observation;
use crate::random::StepNoise;
use crate::track::Sample;

pub(super) const SEGMENTS: usize = STEM_POINTS - 1;

/// Modes of the angles. Two hold nearly all of how virtual beans bend; the third is hardly more than the errors of the points.
/// Three modes of the displacements of the points, which errors do not fill, gave worse rules (docs/beyond.md). A fourth mode
/// changed the predicted fitness by less than 0.1 cm.
pub const MODES: usize = 3;

/// Minutes to either side over which the length is averaged: a plant does not shrink and grow again within an hour.
const LENGTH_SMOOTHING_MIN: f64 = 25.0;

/// Minutes of light by which a block is chosen to be like the plant now, and how many units of the first score a whole unit
/// of mean light counts. Chosen in five laboratories of virtual beans: their plants gave 8.3 cm under the greedy rule on
/// average, and the model 7.4 without a choice, 7.8 by the score alone, and 8.3 with the light.
pub(super) const LIKE_LIGHT_MIN: f64 = 50.0;
pub(super) const LIKE_LIGHT_WEIGHT: f64 = 0.5;

/// One number for each mode.
pub(super) type Scores = [f64; MODES];

/// The angles of the segments of a stem from the vertical, in radians, right positive. They do not jump along the stem.
pub(super) fn angles(stem: &Stem) -> [f64; SEGMENTS] {
    let mut last = 0.0;
    core::array::from_fn(|segment| {
        let (from, to) = (stem[segment], stem[segment + 1]);
        let angle = math::atan2(to.x - from.x, to.y - from.y);
        let turns = ((angle - last) / core::f64::consts::TAU).round();
        last = angle - turns * core::f64::consts::TAU;
        last
    })
}

/// A stem of segments of equal length from `base` up.
pub(super) fn stem_of(base: Point, angles: &[f64; SEGMENTS], length_cm: f64) -> Stem {
    let segment_cm = length_cm / SEGMENTS as f64;
    let mut at = base;
    core::array::from_fn(|point| {
        if point > 0 {
            let (sin, cos) = math::sin_cos(angles[point - 1]);
            at = Point::new(at.x + segment_cm * sin, at.y + segment_cm * cos);
        }
        at
    })
}

/// The highest point of a stem; of equals the lowest along it.
pub(super) fn top_of(stem: &Stem) -> Point {
    stem.iter().copied().fold(stem[0], |top, point| if point.y > top.y { point } else { top })
}

/// What happened in a step, as it is replayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Happened {
    /// What the model does not explain of the change of the scores.
    pub(super) residual: Scores,
    /// Growth in length, in cm.
    pub(super) growth: f64,
    /// From the highest point of the stem of the model to the tip, before and after the step, in cm.
    pub(super) offsets: [Point; 2],
    /// First score before the step, and mean light of the last [`LIKE_LIGHT_MIN`] minutes.
    pub(super) state: [f64; 2],
}

/// Lengths at each step, averaged over an hour; `None` without a stem.
pub(super) fn smooth_lengths(lengths: &[Option<f64>], period_min: f64) -> Vec<Option<f64>> {
    let reach = (LENGTH_SMOOTHING_MIN / period_min).round() as usize;
    let mean = |(step, length): (usize, &Option<f64>)| {
        length.as_ref()?;
        let around = &lengths[step.saturating_sub(reach)..(step + reach + 1).min(lengths.len())];
        Some(math::statistics::mean(around.iter().flatten().copied()))
    };
    lengths.iter().enumerate().map(mean).collect()
}

/// The principal modes of the angles: orthonormal, the one with the most variance first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Modes(pub(super) [[f64; SEGMENTS]; MODES]);

impl MeasuredPlant {
    /// The length of each stem, in cm; `None` without a stem.
    pub(super) fn lengths(&self, modes: &Modes) -> Vec<Option<f64>> {
        self.stems.iter().map(|stem| stem.as_ref().map(|stem| modes.length_cm(stem))).collect()
    }

    /// The scores of each stem; `None` without a stem.
    pub(super) fn scores(&self, modes: &Modes) -> Vec<Option<Scores>> {
        self.stems.iter().map(|stem| Some(modes.scores(&angles(stem.as_ref()?)))).collect()
    }
}

/// The angles of all stems below 16 cm.
pub(super) fn low_angles(measured: &MeasuredPlants) -> impl Iterator<Item = [f64; SEGMENTS]> {
    let steps = measured.plants.iter().flat_map(|plant| plant.tips.iter().zip(&plant.stems));
    let low = steps.filter(|(tip, _)| tip.is_some_and(|tip| tip.y < MAX_HEIGHT_CM));
    low.filter_map(|(_, stem)| stem.as_ref()).map(angles)
}

impl Modes {
    /// The modes of all stems below 16 cm.
    pub(super) fn of_low(measured: &MeasuredPlants) -> Self {
        Self::of(low_angles(measured))
    }

    /// The modes of some angles and their mirror images, whose mean is 0.
    pub(super) fn of(angles: impl Iterator<Item = [f64; SEGMENTS]>) -> Self {
        let mut products = [[0.0; SEGMENTS]; SEGMENTS];
        for angles in angles {
            for (row, one) in products.iter_mut().zip(angles) {
                for (product, other) in row.iter_mut().zip(angles) {
                    *product += one * other;
                }
            }
        }
        let (variances, modes) = eigen_symmetric(products);
        let mut order: [usize; SEGMENTS] = core::array::from_fn(|at| at);
        order.sort_by(|&one, &other| variances[other].total_cmp(&variances[one]));
        Self(core::array::from_fn(|mode| modes[order[mode]]))
    }

    /// The length of a stem along the direction that the modes give each segment, in cm. The noise of the points across the
    /// stem does not lengthen it.
    pub(super) fn length_cm(&self, stem: &Stem) -> f64 {
        let smooth = self.angles(self.scores(&angles(stem)));
        let along = |(pair, angle): (&[Point], f64)| {
            (pair[1].x - pair[0].x) * math::sin(angle) + (pair[1].y - pair[0].y) * math::cos(angle)
        };
        stem.windows(2).zip(smooth).map(along).sum()
    }

    pub(super) fn scores(&self, angles: &[f64; SEGMENTS]) -> Scores {
        transform(&self.0, *angles)
    }

    /// What the modes leave of some angles.
    pub(super) fn rest(&self, angles: &[f64; SEGMENTS]) -> [f64; SEGMENTS] {
        let bent = self.angles(self.scores(angles));
        core::array::from_fn(|segment| angles[segment] - bent[segment])
    }

    pub(super) fn angles(&self, scores: Scores) -> [f64; SEGMENTS] {
        core::array::from_fn(|segment| {
            self.0.iter().zip(scores).map(|(mode, score)| mode[segment] * score).sum()
        })
    }
}

/// Minutes in which a simulated tip comes back by 63 % to where the replayed tip is seen beside the stem. Chosen: the top
/// leaves, which make most of this distance, take their time.
pub(super) const OFFSET_MIN: f64 = 60.0;

/// The images of a record: in a mirror, and as it is.
pub(super) const IMAGES: [f64; 2] = [-1.0, 1.0];

/// The state of a simulated stem, whatever expects how it bends.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Body {
    pub(super) tip: Point,
    pub(super) base: Point,
    pub(super) scores: Scores,
    /// What the modes leave of the angles, in radians: it stays as it is.
    rest: [f64; SEGMENTS],
    pub(super) length_cm: f64,
    /// The side of the lit lamp at each step so far.
    pub(super) light: History<1>,
    /// From where the tip is replayed beside the stem to where it is, in cm.
    apart: Point,
    /// The record that is replayed, and which of its [`IMAGES`].
    record: Option<(usize, usize)>,
}

impl Body {
    /// A straight stem from `base` to the tip at `start`.
    pub(super) fn upright(modes: &Modes, base: Point, start: Point) -> Self {
        let lean = math::atan2(start.x - base.x, start.y - base.y);
        Self {
            tip: start,
            base,
            scores: modes.scores(&[lean; SEGMENTS]),
            rest: [0.0; SEGMENTS],
            length_cm: base.distance(start),
            light: History::new(),
            apart: Point::default(),
            record: None,
        }
    }

    /// The stem as it was observed last, under the lights of the past; `None` where no stem was seen last.
    pub(super) fn observed(past: &Past) -> Option<Self> {
        let mut light = History::new();
        let lit = &past.plant.sides[..past.plant.sides.len().saturating_sub(1)];
        lit.iter().for_each(|side| light.add([side.unwrap_or(0.0)]));
        Some(Self {
            tip: past.tip,
            base: past.plant.stems.last()?.as_ref()?[0],
            scores: (*past.scores.last()?)?,
            rest: past.rest,
            length_cm: past.length_cm?,
            light,
            apart: Point::default(),
            record: None,
        })
    }

    /// Draws what happens in this step, of which the light is known already: the record after the last one, or one of a
    /// stem that was about as long, leant about as far and had about as much light from either side. -1 if its mirror image
    /// is meant, else 1.
    pub(super) fn draw(
        &mut self,
        replay: &Replay<Happened>,
        modes: &Modes,
        like: Window,
        period_min: f64,
        noise: &mut StepNoise,
    ) -> (Happened, f64) {
        let state = [self.scores[0], self.light.mean(like)[0]];
        let drawn = draw_like(replay, self.record, state, self.length_cm, period_min, noise);
        let (place, image) = drawn;
        let (happened, mirror) = (replay.records[place].what, IMAGES[image]);
        let goes_on = self.record.is_some_and(|(last, before)| place == last + 1 && image == before);
        if !goes_on {
            let top = top_of(&self.stem(modes));
            let theirs = happened.offsets[0];
            self.apart = Point::new(self.tip.x - top.x - mirror * theirs.x, self.tip.y - top.y - theirs.y);
        }
        self.record = Some(drawn);
        (happened, mirror)
    }

    /// Moves the stem by a `change` of the scores and by what happened.
    pub(super) fn step(
        &mut self,
        modes: &Modes,
        change: Scores,
        (happened, mirror): (Happened, f64),
        period_min: f64,
    ) {
        for (score, change) in self.scores.iter_mut().zip(change) {
            *score += change;
        }
        self.length_cm += happened.growth;
        let kept = math::exp(-period_min / OFFSET_MIN);
        self.apart = Point::new(kept * self.apart.x, kept * self.apart.y);
        let (top, offset) = (top_of(&self.stem(modes)), happened.offsets[1]);
        self.tip = Point::new(top.x + mirror * offset.x + self.apart.x, top.y + offset.y + self.apart.y);
    }

    /// The stem without noise.
    pub(super) fn stem(&self, modes: &Modes) -> Stem {
        let bent = modes.angles(self.scores);
        stem_of(
            self.base,
            &core::array::from_fn(|segment| bent[segment] + self.rest[segment]),
            self.length_cm,
        )
    }

    /// The tip as it would be measured, and the stem without noise.
    pub(super) fn observe(&self, modes: &Modes) -> Observation {
        Observation { stem: Some(Polyline(self.stem(modes).to_vec())), ..Observation::simulated(self.tip) }
    }
}

/// Whether a stem of such a first score and length is beyond all data, so that no block is like it: it leans farther, or is
/// shorter or longer by more than blocks reach.
#[inline(always)]
pub(super) fn is_beyond(lean: f64, length_cm: f64, [most_lean, ..]: Scores, [least, most]: [f64; 2]) -> bool {
    (lean.abs() > most_lean) | (length_cm < least - BLOCK_REACH_CM) | (length_cm > most + BLOCK_REACH_CM)
}

/// Draws the record after `last`, or one of a stem that was about as long and in about the same state: its first score, and the
/// mean light of the last [`LIKE_LIGHT_MIN`] minutes. Its place, and which of its [`IMAGES`].
pub(super) fn draw_like(
    replay: &Replay<Happened>,
    last: Option<(usize, usize)>,
    [score, lit]: [f64; 2],
    length_cm: f64,
    period_min: f64,
    noise: &mut StepNoise,
) -> (usize, usize) {
    let apart = |what: &Happened, image: usize| {
        let (mirror, [their_score, their_light]) = (IMAGES[image], what.state);
        (mirror * their_score - score).abs() + LIKE_LIGHT_WEIGHT * (mirror * their_light - lit).abs()
    };
    replay.next_like(last, length_cm, period_min, IMAGES.len(), apart, noise)
}

/// What may have happened to an observed plant up to now: stems are measured with errors, so the past is drawn from those
/// around it that look like it.
pub(super) struct Past {
    pub(super) plant: MeasuredPlant,
    /// The scores of the modes at each step; `None` without a stem.
    pub(super) scores: Vec<Option<Scores>>,
    /// What the modes leave of the angles, in radians: mainly the lowest ones, which hardly bend any more.
    rest: [f64; SEGMENTS],
    /// The length now, in cm; `None` where no stem was seen.
    length_cm: Option<f64>,
    /// The last tip, held or not.
    tip: Point,
}

impl Past {
    /// The latest `most_steps` of `samples`, of which there is one at least.
    pub(super) fn of(
        samples: &[Sample],
        most_steps: usize,
        of_model: (&MeasuredPlants, &Modes, &Errors),
        noise: &mut StepNoise,
    ) -> Self {
        let (MeasuredPlants { layout, period_min, .. }, modes, errors) = of_model;
        let last = &samples[samples.len() - 1];
        let from = samples.partition_point(|sample| sample.step as usize + most_steps < last.step as usize);
        let plant = MeasuredPlant::of_samples(&samples[from..], layout, most_steps);
        let rests: Vec<[f64; SEGMENTS]> =
            plant.stems.iter().flatten().map(|stem| modes.rest(&angles(stem))).collect();
        let rest = drawn_rest(&rests, noise);
        let mut scores = plant.scores(modes);
        for scores in scores.iter_mut().flatten() {
            for (score, error) in scores.iter_mut().zip(errors.scores) {
                *score += error * noise.normal();
            }
        }
        let length_cm = length_now(&plant.lengths(modes), *period_min);
        let error = LENGTH_ERROR * errors.length_cm * noise.normal();
        Self { plant, scores, rest, length_cm: length_cm.map(|length_cm| length_cm + error), tip: last.tip }
    }
}

/// The mean of what the modes leave of the angles of a plant, in radians, drawn with its standard error.
pub(super) fn drawn_rest(rests: &[[f64; SEGMENTS]], noise: &mut StepNoise) -> [f64; SEGMENTS] {
    if rests.len() < 2 {
        return [0.0; SEGMENTS];
    }
    core::array::from_fn(|segment| {
        let values: Vec<f64> = rests.iter().map(|rest| rest[segment]).collect();
        let error = math::statistics::standard_deviation(&values) / (values.len() as f64).sqrt();
        math::statistics::mean(values) + error * noise.normal()
    })
}

/// The last of some lengths, in cm: the mean of the last half hour, and what the plant grew since its middle.
pub(super) fn length_now(lengths: &[Option<f64>], period_min: f64) -> Option<f64> {
    let half = (LENGTH_SMOOTHING_MIN / period_min).round() as usize + 1;
    let mean = |window: &[Option<f64>]| {
        let known: Vec<f64> = window.iter().flatten().copied().collect();
        (!known.is_empty()).then(|| math::statistics::mean(known))
    };
    let (before, latest) = lengths.split_at(lengths.len().saturating_sub(half));
    let latest_mean = mean(latest)?;
    let before = &before[before.len().saturating_sub(half)..];
    let growth = mean(before).map_or(0.0, |mean| (latest_mean - mean) / half as f64);
    Some(latest_mean + 0.5 * (latest.len() - 1) as f64 * growth.max(0.0))
}

/// Standard deviation of [`Past::length_cm`] as a share of that of one length: two means of six, 1.42 and -0.42 of
/// them.
pub(super) const LENGTH_ERROR: f64 = 0.6;

/// Standard deviations of the errors with which stems are measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Errors {
    pub(super) scores: Scores,
    pub(super) length_cm: f64,
}

impl Errors {
    /// The errors in the stems of `plants`.
    pub(super) fn of(plants: &[MeasuredPlant], modes: &Modes) -> Self {
        let scores: Vec<Vec<Option<Scores>>> = plants.iter().map(|plant| plant.scores(modes)).collect();
        let lengths: Vec<Vec<Option<f64>>> = plants.iter().map(|plant| plant.lengths(modes)).collect();
        Self::of_series(&scores, &lengths)
    }

    /// The errors in series of scores and of lengths: what a parabola through seven successive values leaves of the middle
    /// one.
    ///
    /// # References
    /// Savitzky and Golay 1964, doi:10.1021/ac60214a047 (the parabola; it takes on a third of the error of the middle value).
    pub(super) fn of_series(scores: &[Vec<Option<Scores>>], lengths: &[Vec<Option<f64>>]) -> Self {
        let of_mode = |mode: usize| {
            let series =
                scores.iter().map(|scores| scores.iter().map(|scores| Some((*scores)?[mode])).collect());
            rough(&series.collect::<Vec<Vec<Option<f64>>>>())
        };
        Self { scores: core::array::from_fn(of_mode), length_cm: rough(lengths) }
    }
}

/// Weights of a parabola through seven values at the middle one.
const PARABOLA: [f64; 7] =
    [-2.0 / 21.0, 3.0 / 21.0, 6.0 / 21.0, 7.0 / 21.0, 6.0 / 21.0, 3.0 / 21.0, -2.0 / 21.0];

/// The standard deviation of the errors of values that change smoothly; 0 without seven successive ones.
fn rough(series: &[Vec<Option<f64>>]) -> f64 {
    let left = |window: &[Option<f64>]| {
        let values: Vec<f64> = window.iter().copied().collect::<Option<_>>()?;
        Some(
            (values[3] - values.iter().zip(PARABOLA).map(|(value, weight)| value * weight).sum::<f64>())
                .powi(2),
        )
    };
    let squares: Vec<f64> = series.iter().flat_map(|values| values.windows(7).filter_map(left)).collect();
    if squares.is_empty() { 0.0 } else { (math::statistics::mean(squares) / (1.0 - PARABOLA[3])).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{NoiseStream, Purpose};

    #[test]
    fn errors_are_told_from_smooth_changes() {
        let noise = NoiseStream::new(1, Purpose::Trial, [0; 3]);
        let value = |step: u32| Some(3.0 * math::sin(f64::from(step) / 12.0) + 0.2 * noise.normal(step));
        let found = rough(&[(0..4000).map(value).collect(), vec![Some(1.0), None]]);
        assert!((found - 0.2).abs() < 0.01, "{found}");
        assert_eq!(rough(&[vec![Some(1.0); 6]]), 0.0);
    }

    #[test]
    fn noise_across_a_stem_does_not_lengthen_it() {
        let noise = NoiseStream::new(2, Purpose::Trial, [0; 3]);
        let straight = |at: usize, x: f64| Point::new(x, at as f64);
        let noisy = |number: u32| -> Stem {
            core::array::from_fn(|at| straight(at, 0.1 * noise.at(number * 10 + at as u32).normal()))
        };
        let stems: Vec<Stem> = (0..200).map(noisy).collect();
        let lean = |number: usize| [0.01 * (number as f64 - 50.0); SEGMENTS];
        let modes = Modes::of((0..100).map(lean));
        let mean = math::statistics::mean(stems.iter().map(|stem| modes.length_cm(stem)));
        let sum = |stem: &Stem| stem.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f64>();
        let longer = math::statistics::mean(stems.iter().map(sum));
        assert!((mean - 9.0).abs() < 0.05 && longer > 9.07, "{mean} {longer}");
    }
}
