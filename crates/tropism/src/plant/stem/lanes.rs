//! Stems side by side, one plant a vector lane: the fast twin of [`StemModel`], with the same bits.
//!
//! A step of one stem is a chain of sums and sines, and the processor waits for each. Here [`LANES`] stems take the same step
//! side by side: each lane takes the operations of [`PlantModel::step`] in the same order, and nothing is fused. Blocks of what
//! is replayed are drawn stem by stem, by the code of the plain model.

#![allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays at once")]

use super::super::stem_shape::{IMAGES, OFFSET_MIN, SEGMENTS, Scores, draw_like, is_beyond, top_of};
use super::{LENGTH_SCALE_CM, LIGHT_TERMS, MIDDLE_LENGTH_CM, MODES, StemModel, StemState, TERMS, place};
use crate::geometry::{Point, STEM_POINTS};
use crate::math::lanes::{LANES, Row, clamped};
use crate::math::{self, Lanes};
use crate::obstacle::lanes::PointRow;
use crate::plant::PlantModel;
use crate::plant::history::Window;
use crate::random::{NoiseStream, Purpose};

/// Sums of some numbers of each step so far: [`History`](crate::plant::history::History) in lanes, as far back as windows reach.
struct Sums<const N: usize> {
    /// A ring of steps.
    steps: Vec<[Row; N]>,
    now: usize,
}

impl<const N: usize> Sums<N> {
    /// Sums for windows that reach back by `oldest` steps.
    fn new(oldest: usize) -> Self {
        Self { steps: vec![[[0.0; LANES]; N]; oldest + 1], now: 0 }
    }

    /// Forgets all steps of a lane.
    fn clear(&mut self, lane: usize) {
        self.steps.iter_mut().flatten().for_each(|row| row[lane] = 0.0);
    }

    #[inline(always)]
    fn back(&self, steps: usize) -> &[Row; N] {
        let at = if steps > self.now { self.now + self.steps.len() - steps } else { self.now - steps };
        &self.steps[at]
    }

    #[inline(always)]
    fn add(&mut self, numbers: &[Row; N]) {
        let mut sums = *self.back(0);
        for number in 0..N {
            for lane in 0..LANES {
                sums[number][lane] += numbers[number][lane];
            }
        }
        self.now = if self.now + 1 == self.steps.len() { 0 } else { self.now + 1 };
        self.steps[self.now] = sums;
    }

    #[inline(always)]
    fn mean(&self, [newest, oldest]: Window) -> [Row; N] {
        let (mut means, before) = (*self.back(newest), self.back(oldest));
        let count = oldest - newest;
        // A division by a power of 2 is the product with its inverse.
        let inverse = if count.is_power_of_two() { 1.0 / count as f64 } else { 0.0 };
        for number in 0..N {
            for lane in 0..LANES {
                means[number][lane] -= before[number][lane];
            }
            if inverse > 0.0 {
                for lane in 0..LANES {
                    means[number][lane] *= inverse;
                }
            } else {
                for lane in 0..LANES {
                    means[number][lane] /= count as f64;
                }
            }
        }
        means
    }
}

/// Some plants of a model.
#[repr(C, align(64))]
pub(crate) struct Stems<'m> {
    tips: PointRow,
    /// The stems without noise.
    points: [PointRow; STEM_POINTS],
    tops: PointRow,
    scores: [Row; MODES],
    length_cm: Row,
    apart: PointRow,
    gain: Row,
    weights: [[Row; TERMS]; MODES],
    /// What happens in this step, as it is replayed.
    residual: [Row; MODES],
    growth: Row,
    offset: PointRow,
    mirror: Row,
    light: Sums<1>,
    changes: Sums<MODES>,
    model: &'m StemModel,
    /// Share of [`Self::apart`] that is left after a step.
    kept: f64,
    /// Which measured plant each is, and the record that is replayed.
    plants: [usize; LANES],
    records: [Option<(usize, usize)>; LANES],
    noises: [(NoiseStream, u32); LANES],
}

impl<'m> Stems<'m> {
    /// Lanes for plants of `model`, all of them with the same one.
    pub(crate) fn new(model: &'m StemModel, start: Point) -> Self {
        let (zero, windows) = ([0.0; LANES], model.windows);
        let oldest = |windows: &[Window]| windows.iter().map(|window| window[1]).max().unwrap_or(0);
        let noise = NoiseStream::new(0, Purpose::Trial, [0; 3]);
        let mut stems = Self {
            tips: [zero; 2],
            points: [[zero; 2]; STEM_POINTS],
            tops: [zero; 2],
            scores: [zero; MODES],
            length_cm: zero,
            apart: [zero; 2],
            gain: zero,
            weights: [[zero; TERMS]; MODES],
            residual: [zero; MODES],
            growth: zero,
            offset: [zero; 2],
            mirror: zero,
            light: Sums::new(oldest(&windows.light).max(windows.like[1])),
            changes: Sums::new(oldest(&windows.changes)),
            model,
            kept: math::exp(-model.measured.period_min / OFFSET_MIN),
            plants: [0; LANES],
            records: [None; LANES],
            noises: [(noise, 0); LANES],
        };
        (0..LANES).for_each(|lane| stems.refill(lane, start, noise));
        stems
    }

    /// Puts a seedling with its tip at `start` into a lane.
    pub(crate) fn refill(&mut self, lane: usize, start: Point, noise: NoiseStream) {
        let StemState { body, plant, gain, .. } = self.model.seedling(start, &mut noise.of_seedling());
        let put = |row: &mut PointRow, point: Point| (row[0][lane], row[1][lane]) = (point.x, point.y);
        let stem = body.stem(&self.model.modes);
        put(&mut self.tips, body.tip);
        self.points.iter_mut().zip(stem).for_each(|(row, point)| put(row, point));
        put(&mut self.tops, top_of(&stem));
        put(&mut self.apart, Point::default());
        self.scores.iter_mut().zip(body.scores).for_each(|(row, score)| row[lane] = score);
        self.length_cm[lane] = body.length_cm;
        self.gain[lane] = gain;
        let weights = self.model.plants[plant].weights.iter().flatten();
        self.weights.iter_mut().flatten().zip(weights).for_each(|(row, weight)| row[lane] = *weight);
        self.light.clear(lane);
        self.changes.clear(lane);
        (self.plants[lane], self.records[lane], self.noises[lane]) = (plant, None, (noise, 0));
    }

    /// The tip of each plant, in cm.
    pub(crate) const fn tips(&self) -> &PointRow {
        &self.tips
    }

    /// Ten points of the stem of each plant, from the base up, in cm.
    pub(crate) const fn points(&self) -> &[PointRow; STEM_POINTS] {
        &self.points
    }

    /// 1 for each plant that is beyond all data of the model, else 0.
    #[inline(always)]
    pub(crate) fn beyond_data(&self) -> Row {
        let (most_scores, lengths_cm) = (self.model.most_scores, self.model.lengths_cm);
        let mut beyond = [0.0; LANES];
        for lane in 0..LANES {
            let is_beyond = is_beyond(self.scores[0][lane], self.length_cm[lane], most_scores, lengths_cm);
            beyond[lane] = if is_beyond { 1.0 } else { 0.0 };
        }
        beyond
    }

    /// One step of each plant under the lamp on a side.
    #[inline(always)]
    pub(crate) fn step(&mut self, sides: &Row) {
        self.light.add(&[*sides]);
        let [lit] = self.light.mean(self.model.windows.like);
        self.draw(&lit);
        let terms = self.terms();
        let mut changes = [[0.0; LANES]; MODES];
        for mode in 0..MODES {
            let expected = expected(&self.weights[mode], &terms, self.gain);
            for lane in 0..LANES {
                changes[mode][lane] = expected[lane] + self.mirror[lane] * self.residual[mode][lane];
                self.scores[mode][lane] += changes[mode][lane];
            }
        }
        self.changes.add(&changes);
        for lane in 0..LANES {
            self.length_cm[lane] += self.growth[lane];
            self.apart[0][lane] *= self.kept;
            self.apart[1][lane] *= self.kept;
        }
        self.bend();
        for lane in 0..LANES {
            let (x, y) = (self.tops[0][lane], self.tops[1][lane]);
            self.tips[0][lane] = x + self.mirror[lane] * self.offset[0][lane] + self.apart[0][lane];
            self.tips[1][lane] = y + self.offset[1][lane] + self.apart[1][lane];
        }
    }

    /// Draws what happens to each plant, of which the mean light is known already.
    fn draw(&mut self, lit: &Row) {
        for lane in 0..LANES {
            let (noise, step) = &mut self.noises[lane];
            let mut noise = noise.at(*step);
            *step = step.wrapping_add(1);
            let replay = &self.model.plants[self.plants[lane]].replay;
            let before = self.records[lane];
            let state = [self.scores[0][lane], lit[lane]];
            let period_min = self.model.measured.period_min;
            let (place, image) =
                draw_like(replay, before, state, self.length_cm[lane], period_min, &mut noise);
            let (happened, mirror) = (&replay.records[place].what, IMAGES[image]);
            if before.is_none_or(|(last, was)| place != last + 1 || image != was) {
                let theirs = happened.offsets[0];
                self.apart[0][lane] = self.tips[0][lane] - self.tops[0][lane] - mirror * theirs.x;
                self.apart[1][lane] = self.tips[1][lane] - self.tops[1][lane] - theirs.y;
            }
            self.records[lane] = Some((place, image));
            let residual: Scores = happened.residual;
            self.residual.iter_mut().zip(residual).for_each(|(row, residual)| row[lane] = residual);
            self.growth[lane] = happened.growth;
            (self.offset[0][lane], self.offset[1][lane]) = (happened.offsets[1].x, happened.offsets[1].y);
            self.mirror[lane] = mirror;
        }
    }

    /// [`terms`](super::terms) of each plant.
    #[inline(always)]
    fn terms(&self) -> [Row; TERMS] {
        let StemModel { windows, most_scores, lengths_cm, .. } = self.model;
        let mut terms = [[0.0; LANES]; TERMS];
        let (mut length, mut square) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            length[lane] = (clamped(self.length_cm[lane], *lengths_cm) - MIDDLE_LENGTH_CM) / LENGTH_SCALE_CM;
            square[lane] = length[lane] * length[lane];
        }
        let mut lights = [[0.0; LANES]; 5];
        for window in 0..5 {
            [lights[window]] = self.light.mean(windows.light[window]);
        }
        let mut scores = self.scores;
        for mode in 0..MODES {
            for lane in 0..LANES {
                scores[mode][lane] = clamped(scores[mode][lane], [-most_scores[mode], most_scores[mode]]);
            }
        }
        for (number, light) in lights.iter().enumerate() {
            for lane in 0..LANES {
                terms[place(0, number)][lane] = light[lane];
                terms[place(1, number)][lane] = length[lane] * light[lane];
                terms[place(2, number)][lane] = square[lane] * light[lane];
            }
        }
        for (mode, score) in scores.iter().enumerate() {
            for lane in 0..LANES {
                terms[place(3, mode)][lane] = score[lane];
                terms[place(4, mode)][lane] = length[lane] * score[lane];
                terms[place(5, mode)][lane] = square[lane] * score[lane];
                terms[place(6, mode)][lane] = score[lane] * score[lane] * score[lane];
            }
        }
        for (window, number) in windows.changes.into_iter().zip(7..) {
            let means = self.changes.mean(window);
            for mode in 0..MODES {
                if let Some(term) = terms.get_mut(place(number, mode)) {
                    *term = means[mode];
                }
            }
        }
        terms
    }

    /// The stems of the present scores and lengths, and their highest points.
    #[inline(always)]
    fn bend(&mut self) {
        (self.points, self.tops) = bent(&self.model.modes.0, self.scores, self.length_cm, self.points[0]);
    }
}

/// Stems of these scores and lengths from their bases on, and their highest points. Arguments are values: a compiler must know that nothing else stands where is written to.
#[inline(always)]
fn bent(
    modes: &[[f64; SEGMENTS]; MODES],
    scores: [Row; MODES],
    length_cm: Row,
    base: PointRow,
) -> ([PointRow; STEM_POINTS], PointRow) {
    let modes = *modes;
    let mut points = [base; STEM_POINTS];
    let (mut at, mut top) = (base, base);
    for segment in 0..SEGMENTS {
        let mut angles = Lanes([0.0; LANES]);
        for lane in 0..LANES {
            let mut angle = modes[0][segment] * scores[0][lane];
            for mode in 1..MODES {
                angle += modes[mode][segment] * scores[mode][lane];
            }
            // The rest of a seedling is 0: this decides the sign of an angle of 0.
            angles.0[lane] = angle + 0.0;
        }
        let (sine, cosine) = math::sin_cos(angles);
        for lane in 0..LANES {
            let segment_cm = length_cm[lane] / SEGMENTS as f64;
            let (x, y) = (at[0][lane] + segment_cm * sine.0[lane], at[1][lane] + segment_cm * cosine.0[lane]);
            (at[0][lane], at[1][lane]) = (x, y);
            let (top_x, top_y) = (top[0][lane], top[1][lane]);
            top[0][lane] = if y > top_y { x } else { top_x };
            top[1][lane] = if y > top_y { y } else { top_y };
        }
        points[segment + 1] = at;
    }
    (points, top)
}

/// The products of weights and terms, of which those of the light apply with a gain.
#[inline(always)]
fn expected(weights: &[Row; TERMS], terms: &[Row; TERMS], gain: Row) -> Row {
    let (mut of_light, mut others) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        of_light[lane] = weights[0][lane] * terms[0][lane];
        others[lane] = weights[LIGHT_TERMS][lane] * terms[LIGHT_TERMS][lane];
    }
    for term in 1..LIGHT_TERMS {
        for lane in 0..LANES {
            of_light[lane] += weights[term][lane] * terms[term][lane];
        }
    }
    for term in LIGHT_TERMS + 1..TERMS {
        for lane in 0..LANES {
            others[lane] += weights[term][lane] * terms[term][lane];
        }
    }
    for lane in 0..LANES {
        of_light[lane] = gain[lane] * of_light[lane] + others[lane];
    }
    of_light
}
