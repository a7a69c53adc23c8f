//! A model of the whole stem that is an LSTM, as the group of the paper used later; the linear one is [`super::stem`].
//!
//! The network sees the light, the scores of the modes and the length of the stem, and says by how much they change in a
//! step. It is trained on free runs: for two hours it sees a plant, then it runs on by itself for six, and all its errors
//! count. Each plant has a gain of the light of its own, which is learnt with the weights. What the network does not explain
//! is replayed from the same plant, as in the linear model. In a mirror all is mirrored, by construction.
//!
//! Light enters as the side of the lit lamp: there must be two lamps that are mirror images of each other.
//!
//! # References
//! Wahby et al. 2018, doi:10.1145/3205455.3205477 (an LSTM of the stem, on which networks evolve);
//! Williams and Peng 1990, doi:10.1162/neco.1990.2.4.490 (truncated back-propagation through time).

use core::ops::ControlFlow;

use super::history::{Window, steps_of_window};
use super::measured_plant::{
    Extent, MAX_HEIGHT_CM, MeasuredPlant, MeasuredPlants, Network, draw_plant, is_named_in,
    tell_of_measured_plants,
};
use super::recurrent::{self, Adam, CHANGES, EVEN, Memory, ODD, WEIGHTS};
use super::replay::{BLOCK_REACH_CM, Record, Replay};
use super::stem_shape::{
    Body, Errors, Happened, LIKE_LIGHT_MIN, MODES, Modes, Past, SEGMENTS, Scores, is_beyond, smooth_lengths,
    stem_of, top_of,
};
use super::tip::ModelError;
use super::{PlantModel, evenly};
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::math;
use crate::observation::Observation;
use crate::parallel;
use crate::random::{NoiseStream, Purpose, StepNoise};
use crate::track::{Sample, Track};

/// The schema of the file.
const SCHEMA: &str = "tropism.lstm-model/1";

/// Minutes for which the network sees a plant before it runs freely, and for which it then does.
const SEEN_MIN: f64 = 120.0;
const FREE_MIN: f64 = 360.0;

/// Minutes from one window of training to the next on the same plant.
const STRIDE_MIN: f64 = 60.0;

/// Windows of one step of Adam.
const BATCH: usize = 16;

/// First size of a step of Adam, decay of the weights, and epochs without a better one after which training ends.
const RATE: f64 = 4e-3;
const DECAY: f64 = 0.01;
const PATIENCE: u32 = 40;

/// Gains at which a plant that is left out is tried.
const TRIED_GAINS: [f64; 7] = [0.55, 0.7, 0.85, 1.0, 1.15, 1.3, 1.45];

/// Epochs where there is no plant to leave out.
const EPOCHS_ALONE: u32 = 40;

/// An error counts as a share of what is usual after some time: of 0.1 cm, and 0.36 cm more each hour. Measured with the linear
/// model.
const USUAL_CM: [f64; 2] = [0.1, 0.36];

/// How strongly the logarithms of the gains are drawn to 0.
const GAIN_RIDGE: f64 = 0.02;

/// Length around which the response is expanded, in cm, and the scale of its change, as in the linear model.
const MIDDLE_LENGTH_CM: f64 = 9.0;
const LENGTH_SCALE_CM: f64 = 5.0;

/// How an LSTM is trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Training {
    /// Most passes over the data, at least 1.
    pub max_epochs: u32,
    /// Seed of the first weights and of the order of the windows.
    pub seed: u64,
}

impl Default for Training {
    /// 150 epochs at most, seed 1.
    fn default() -> Self {
        Self { max_epochs: 150, seed: 1 }
    }
}

/// How far a training is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingProgress {
    /// Passes over the data that are done, of both trainings: the one with a plant left out and the one with all plants.
    pub epochs: u32,
    /// Most passes that there may be.
    pub of: u32,
    /// Mean error of free runs, as a share of what is usual: of the plant that is left out where `is_judged`, else of all.
    pub error: f64,
    /// Whether a plant is left out, so that the error is one of a plant that the network does not know.
    pub is_judged: bool,
}

/// State of the stem at a step of a window: light, scores, length.
#[derive(Clone, Copy, Debug)]
struct Step {
    side: f64,
    scores: Scores,
    length_cm: f64,
}

/// The scales of what goes into the network and comes out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scales {
    /// Root mean square of each score, and of its change in a step.
    scores: Scores,
    changes: Scores,
    /// Root mean square of the growth in a step, in cm.
    growth_cm: f64,
    /// Mean square displacement of the ten points, in cm², by a unit of each score and by a cm of length, at 9 cm.
    squares: [f64; MODES + 1],
}

impl Scales {
    fn of(plants: &[Vec<Option<Step>>], modes: &Modes) -> Self {
        let steps = || plants.iter().flatten().flatten();
        let pairs =
            || plants.iter().flat_map(|plant| plant.windows(2)).filter_map(|pair| pair[0].zip(pair[1]));
        let root = |squares: Vec<f64>| math::statistics::mean(squares).max(f64::MIN_POSITIVE).sqrt();
        let of_mode = |mode: usize| {
            let mut bent = 0.0;
            let at_point = |angle: &f64| {
                bent += angle * MIDDLE_LENGTH_CM / SEGMENTS as f64;
                bent * bent
            };
            modes.0[mode].iter().map(at_point).sum::<f64>() / (SEGMENTS + 1) as f64
        };
        let along: f64 = (0..=SEGMENTS).map(|point| (point as f64 / SEGMENTS as f64).powi(2)).sum();
        Self {
            scores: core::array::from_fn(|mode| {
                root(steps().map(|step| step.scores[mode].powi(2)).collect())
            }),
            changes: core::array::from_fn(|mode| {
                root(pairs().map(|(from, to)| (to.scores[mode] - from.scores[mode]).powi(2)).collect())
            }),
            growth_cm: root(pairs().map(|(from, to)| (to.length_cm - from.length_cm).powi(2)).collect()),
            squares: core::array::from_fn(|part| {
                if part < MODES { of_mode(part) } else { along / (SEGMENTS + 1) as f64 }
            }),
        }
    }

    /// The inputs of the network. `side` is the side of the light, times the gain of the plant.
    fn inputs(&self, side: f64, scores: &Scores, length_cm: f64) -> ([f64; ODD], [f64; EVEN]) {
        let length = (length_cm - MIDDLE_LENGTH_CM) / LENGTH_SCALE_CM;
        let [a, b, c] = core::array::from_fn(|mode| scores[mode] / self.scores[mode]);
        (
            [side, a, b, c, length * side, length * a, length * b, length * c],
            [1.0, length, length * length, side * a, side * b, side * c, a * a, b * b, c * c],
        )
    }

    /// The derivatives by side, scores and length of what the derivatives by the inputs are given of.
    fn back(
        &self,
        side: f64,
        scores: &Scores,
        length_cm: f64,
        odd: &[f64; ODD],
        even: &[f64; EVEN],
    ) -> (f64, Scores, f64) {
        let length = (length_cm - MIDDLE_LENGTH_CM) / LENGTH_SCALE_CM;
        let scaled: Scores = core::array::from_fn(|mode| scores[mode] / self.scores[mode]);
        let by_side =
            odd[0] + length * odd[4] + (0..MODES).map(|mode| scaled[mode] * even[3 + mode]).sum::<f64>();
        let by_scores = core::array::from_fn(|mode| {
            let by = odd[1 + mode]
                + length * odd[5 + mode]
                + side * even[3 + mode]
                + 2.0 * scaled[mode] * even[6 + mode];
            by / self.scores[mode]
        });
        let by_length = side * odd[4]
            + (0..MODES).map(|mode| scaled[mode] * odd[5 + mode]).sum::<f64>()
            + even[1]
            + 2.0 * length * even[2];
        (by_side, by_scores, by_length / LENGTH_SCALE_CM)
    }
}

/// A stretch of one plant: seen first, then predicted.
struct Stretch<'p> {
    plant: usize,
    steps: Vec<&'p Step>,
    seen: usize,
}

/// The loss of a free run, and its derivatives by the weights, and by the logarithm of the gain of the side.
struct Slope {
    loss: f64,
    weights: Vec<f64>,
    gain: f64,
}

impl Stretch<'_> {
    /// The loss of the free run under `gain`: the mean square of errors as shares of the usual ones.
    fn run(&self, weights: &[f64], scales: &Scales, gain: f64, period_min: f64, is_sloped: bool) -> Slope {
        let mut memory = Memory::EMPTY;
        let Step { mut scores, mut length_cm, .. } = *self.steps[0];
        let (mut made, mut loss) = (Vec::with_capacity(self.steps.len()), 0.0);
        // Derivatives of the loss by the state after each step, as far as this step's error goes.
        let mut by_state = Vec::with_capacity(self.steps.len());
        let free = (self.steps.len() - 1 - self.seen) as f64;
        for (step, pair) in self.steps.windows(2).enumerate() {
            if step <= self.seen {
                Step { scores, length_cm, .. } = *pair[0];
            }
            let side = gain * pair[0].side;
            let (odd, even) = scales.inputs(side, &scores, length_cm);
            let forward = recurrent::forward(weights, &memory, odd, even);
            memory = forward.after;
            let from = (scores, length_cm);
            scores = core::array::from_fn(|mode| scores[mode] + scales.changes[mode] * forward.changes[mode]);
            length_cm += scales.growth_cm * forward.growth;
            let mut by = [0.0; MODES + 1];
            if step >= self.seen {
                let hours = (step + 1 - self.seen) as f64 * period_min / 60.0;
                let usual = USUAL_CM[0] + USUAL_CM[1] * hours;
                let errors: [f64; MODES + 1] = core::array::from_fn(|part| {
                    if part < MODES {
                        scores[part] - pair[1].scores[part]
                    } else {
                        length_cm - pair[1].length_cm
                    }
                });
                for part in 0..=MODES {
                    let weight = scales.squares[part] / (usual * usual * free);
                    loss += weight * errors[part] * errors[part];
                    by[part] = 2.0 * weight * errors[part];
                }
            }
            by_state.push(by);
            if is_sloped {
                made.push((forward, side, from));
            }
        }
        let mut slope = Slope { loss, weights: vec![0.0; if is_sloped { WEIGHTS } else { 0 }], gain: 0.0 };
        let (mut after, mut later) = (Memory::EMPTY, [0.0; MODES + 1]);
        for (step, (forward, side, (scores, length_cm))) in made.iter().enumerate().rev() {
            let total: [f64; MODES + 1] = core::array::from_fn(|part| by_state[step][part] + later[part]);
            let changes: [f64; CHANGES] = core::array::from_fn(|mode| scales.changes[mode] * total[mode]);
            let growth = scales.growth_cm * total[MODES];
            let back = recurrent::backward(weights, forward, changes, growth, &after, &mut slope.weights);
            let (by_side, by_scores, by_length) =
                scales.back(*side, scores, *length_cm, &back.odd, &back.even);
            slope.gain += by_side * side;
            after = back.memory;
            // A state that was seen does not depend on the step before.
            let is_own = step > self.seen;
            later = core::array::from_fn(|part| {
                let through = if part < MODES { by_scores[part] } else { by_length };
                if is_own { total[part] + through } else { 0.0 }
            });
        }
        slope
    }
}

/// The whole steps of each plant: light and stem known, below 16 cm.
fn steps_of(measured: &MeasuredPlants, modes: &Modes) -> Vec<Vec<Option<Step>>> {
    let of_plant = |plant: &MeasuredPlant| {
        let (scores, lengths) =
            (plant.scores(modes), smooth_lengths(&plant.lengths(modes), measured.period_min));
        let step = |at: usize| {
            let is_low = plant.tips[at].is_some_and(|tip| tip.y < MAX_HEIGHT_CM);
            let length_cm = lengths[at].filter(|_| is_low)?;
            Some(Step { side: plant.sides[at]?, scores: scores[at]?, length_cm })
        };
        (0..plant.tips.len()).map(step).collect()
    };
    measured.plants.iter().map(of_plant).collect()
}

/// Windows of training and how they are run.
struct Trainer<'p> {
    plants: &'p [Vec<Option<Step>>],
    scales: Scales,
    period_min: f64,
    training: Training,
}

/// Weights and gains of a trained network, with the epoch after which they were best.
struct Trained {
    weights: Vec<f64>,
    gains: Vec<f64>,
    epoch: u32,
}

impl<'p> Trainer<'p> {
    fn steps(&self, minutes: f64) -> usize {
        (minutes / self.period_min).round() as usize
    }

    /// The windows of the plants, of which the first begins at `phase` times the stride.
    fn stretches(&self, is_taken: impl Fn(usize) -> bool, phase: f64) -> Vec<Stretch<'p>> {
        let [seen, free, stride] = [SEEN_MIN, FREE_MIN, STRIDE_MIN].map(|minutes| self.steps(minutes));
        let mut stretches = Vec::new();
        for (plant, steps) in self.plants.iter().enumerate().filter(|(plant, _)| is_taken(*plant)) {
            let windows =
                steps.windows(seen + free + 1).skip((phase * stride as f64) as usize).step_by(stride);
            let whole =
                windows.filter_map(|window| window.iter().map(Option::as_ref).collect::<Option<Vec<_>>>());
            stretches.extend(whole.map(|steps| Stretch { plant, steps, seen }));
        }
        stretches
    }

    /// The error of free runs of some plants, each at the gain that suits it best: what a plant is by itself says nothing
    /// about the network.
    fn error(&self, weights: &[f64], plants: &[Vec<Stretch<'_>>]) -> f64 {
        let losses = parallel::map(plants.len() * TRIED_GAINS.len(), |number| {
            let (plant, gain) =
                (&plants[number / TRIED_GAINS.len()], TRIED_GAINS[number % TRIED_GAINS.len()]);
            let loss =
                |stretch: &Stretch<'_>| stretch.run(weights, &self.scales, gain, self.period_min, false).loss;
            math::statistics::mean(plant.iter().map(loss))
        });
        let least = losses
            .chunks(TRIED_GAINS.len())
            .map(|losses| losses.iter().copied().fold(f64::INFINITY, f64::min));
        math::statistics::mean(least).sqrt()
    }

    /// Trains on all plants but those `left_out` for `epochs` at most, or until these are predicted no better.
    /// `None` if `watch` breaks off; it hears of epochs and errors.
    fn train(
        &self,
        left_out: &[usize],
        epochs: u32,
        watch: &mut dyn FnMut(u32, f64) -> ControlFlow<()>,
    ) -> Option<Trained> {
        let mut weights =
            recurrent::first_weights(&NoiseStream::new(self.training.seed, Purpose::Training, [0; 3]));
        // Behind the weights: the logarithm of the gain of each plant.
        weights.resize(WEIGHTS + self.plants.len(), 0.0);
        let mut adam = Adam::new(weights.len());
        let judging: Vec<Vec<Stretch<'p>>> =
            left_out.iter().map(|&plant| self.stretches(|other| other == plant, 0.0)).collect();
        let (mut best, mut least): (Option<Trained>, f64) = (None, f64::INFINITY);
        for epoch in 1..=epochs {
            let mut draws =
                NoiseStream::new(self.training.seed, Purpose::Training, [epoch, 0, 0]).of_seedling();
            let mut stretches = self.stretches(|plant| !left_out.contains(&plant), draws.uniform());
            for last in (1..stretches.len()).rev() {
                stretches.swap(last, (draws.uniform() * (last + 1) as f64) as usize);
            }
            // The last steps are small: a cosine from the first size to a tenth of it.
            let share = f64::from(epoch - 1) / f64::from(self.training.max_epochs);
            let rate = RATE * (0.55 + 0.45 * math::cos(core::f64::consts::PI * share));
            let mut losses = Vec::new();
            for batch in stretches.chunks(BATCH) {
                let slopes = parallel::map(batch.len(), |number| {
                    let stretch = &batch[number];
                    let gain = math::exp(weights[WEIGHTS + stretch.plant]);
                    stretch.run(&weights, &self.scales, gain, self.period_min, true)
                });
                let mut gradient = vec![0.0; weights.len()];
                let share = 1.0 / batch.len() as f64;
                for (slope, stretch) in slopes.iter().zip(batch) {
                    losses.push(slope.loss);
                    gradient.iter_mut().zip(&slope.weights).for_each(|(sum, by)| *sum += share * by);
                    gradient[WEIGHTS + stretch.plant] += share * slope.gain;
                }
                for plant in 0..self.plants.len() {
                    gradient[WEIGHTS + plant] += GAIN_RIDGE * weights[WEIGHTS + plant];
                }
                adam.step(&mut weights, &gradient, rate, DECAY);
            }
            let error = if judging.is_empty() {
                math::statistics::mean(losses).sqrt()
            } else {
                self.error(&weights, &judging)
            };
            if watch(epoch, error).is_break() {
                return None;
            }
            if judging.is_empty() || error < least {
                least = error;
                let (weights, gains) = weights.split_at(WEIGHTS);
                let gains = gains.iter().map(|&gain| math::exp(gain)).collect();
                best = Some(Trained { weights: weights.to_vec(), gains, epoch });
            }
            if best.as_ref().is_some_and(|best| epoch - best.epoch >= PATIENCE) {
                break;
            }
        }
        best
    }
}

/// How one measured plant answers.
#[derive(Clone, Debug, PartialEq)]
struct Response {
    /// Factor of the light.
    gain: f64,
    replay: Replay<Happened>,
    /// Mean of the lowest points of its stems, in cm.
    base: Point,
}

/// A model of how a stem bends and grows that is an LSTM, with differences between plants.
///
/// ```
/// use std::ops::ControlFlow;
/// use tropism::control::Periodic;
/// use tropism::environment::unwatched;
/// use tropism::greenhouse::bean::{Species, Trial};
/// use tropism::lamps::Layout;
/// use tropism::plant::lstm::{LstmModel, Training};
/// use tropism::prelude::*;
///
/// let species = Species::default();
/// let open_loop = OpenLoop { steps: 200, ..OpenLoop::default() };
/// let grow = |seed| {
///     Trial::new(&species).grow(seed, &mut Periodic::new(72, &Layout::default()), &open_loop, &mut unwatched)
/// };
/// // Two epochs make no good model; the default has more.
/// let training = Training { max_epochs: 2, ..Training::default() };
/// let model = LstmModel::fit(&[grow(1), grow(2)], training, &mut |_| ControlFlow::Continue(()))?.unwrap();
/// let task = Targets { max_steps: 40, ..Targets::default() };
/// let track = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, 1);
/// assert_eq!(track.samples[40].stem.as_ref().map(|stem| stem.0.len()), Some(10));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LstmModel {
    measured: MeasuredPlants,
    network: Network,
    scales: Scales,
    like: Window,
    modes: Modes,
    errors: Errors,
    plants: Vec<Response>,
    extent: Extent,
    /// Greatest size of each score in the data. Beyond it the plant answers as it does there.
    most_scores: Scores,
    /// Least and greatest length of the data, in cm. Beyond them the plant answers as it does there.
    lengths_cm: [f64; 2],
}

tell_of_measured_plants!(LstmModel);

impl LstmModel {
    /// Trains a model on `tracks` with stems, below 16 cm: on their first 2500 minutes, and of plants that grow more slowly until
    /// the tip was 13.8 cm high.
    ///
    /// One plant is left out first, to find after how many epochs it is predicted best; then all plants are trained on for as
    /// many. `watch` hears of each epoch and may break off: then there is no model. The same bits come for any number of
    /// threads.
    ///
    /// # Errors
    /// [`ModelError`] where no track has eight hours of successive measured stems, or no stems at all, where the tracks differ
    /// in lamps or period, or where the lamps are not two mirror images.
    pub fn fit<'t>(
        tracks: impl IntoIterator<Item = &'t Track>,
        training: Training,
        watch: &mut dyn FnMut(&TrainingProgress) -> ControlFlow<()>,
    ) -> Result<Option<Self>, ModelError> {
        let measured = MeasuredPlants::of_tracks(tracks)?;
        measured.check_stems()?;
        let modes = Modes::of_low(&measured);
        let plants = steps_of(&measured, &modes);
        let scales = Scales::of(&plants, &modes);
        let trainer = Trainer { plants: &plants, scales, period_min: measured.period_min, training };
        let usable: Vec<usize> = (0..plants.len())
            .filter(|&plant| !trainer.stretches(|other| other == plant, 0.0).is_empty())
            .collect();
        if usable.is_empty() {
            return Err(ModelError::NoStretch { tracks: plants.len() });
        }
        let max_epochs = training.max_epochs.max(1);
        // Every third plant from the last one on.
        let left_out: Vec<usize> = usable.iter().rev().step_by(3).copied().collect();
        let has_others = usable.len() > 1;
        let of = if has_others { 2 * max_epochs } else { max_epochs.min(EPOCHS_ALONE) };
        let mut done = 0;
        let mut epochs = of;
        if has_others {
            let watch =
                &mut |epoch, error| watch(&TrainingProgress { epochs: epoch, of, error, is_judged: true });
            let Some(trained) = trainer.train(&left_out, max_epochs, watch) else { return Ok(None) };
            epochs = trained.epoch;
            done = max_epochs;
        }
        let watch = &mut |epoch, error| {
            watch(&TrainingProgress { epochs: done + epoch, of, error, is_judged: false })
        };
        let Some(Trained { weights, gains, .. }) = trainer.train(&[], epochs, watch) else {
            return Ok(None);
        };
        Self::of_network(measured, Network { weights, gains }).map(Some)
    }

    /// The model of a trained network, from the data of which it was made.
    fn of_network(measured: MeasuredPlants, network: Network) -> Result<Self, ModelError> {
        let modes = Modes::of_low(&measured);
        let steps = steps_of(&measured, &modes);
        let scales = Scales::of(&steps, &modes);
        let like = steps_of_window([0.0, LIKE_LIGHT_MIN], measured.period_min);
        let known = || steps.iter().flatten().flatten();
        let lengths_cm = math::statistics::range(known().map(|step| step.length_cm));
        let most_scores =
            core::array::from_fn(|mode| known().map(|step| step.scores[mode].abs()).fold(0.0, f64::max));
        let extent = Extent::of(measured.tips().filter(|tip| tip.y < MAX_HEIGHT_CM));
        let errors = Errors::of(&measured.plants, &modes);
        let mut model = Self {
            network,
            scales,
            like,
            modes,
            errors,
            plants: Vec::new(),
            extent,
            most_scores,
            lengths_cm,
            measured,
        };
        let responses = (0..steps.len()).filter_map(|plant| model.response(plant, &steps[plant]));
        model.plants = responses.collect();
        if model.plants.is_empty() {
            return Err(ModelError::NoStretch { tracks: steps.len() });
        }
        Ok(model)
    }

    /// How the measured plant answers; `None` without a usable step.
    fn response(&self, plant: usize, steps: &[Option<Step>]) -> Option<Response> {
        let (data, gain) = (&self.measured.plants[plant], self.network.gains[plant]);
        let mut memory = Memory::EMPTY;
        let mut light = super::history::History::<1>::new();
        // Steps until what is not known has left the memory.
        let mut gap = self.like[1];
        let mut records = Vec::new();
        for (at, pair) in steps.windows(2).enumerate() {
            let side = data.sides[at].unwrap_or(0.0);
            light.add([side]);
            gap = gap.saturating_sub(1);
            let [Some(from), to] = pair else {
                (memory, gap) = (Memory::EMPTY, self.like[1]);
                continue;
            };
            let (forward, changes, growth) = self.expect(&memory, gain * side, &from.scores, from.length_cm);
            memory = forward;
            let Some(to) = to.as_ref().filter(|_| gap == 0) else { continue };
            let offset = |at: usize, step: &Step| {
                let base = data.stems[at].as_ref()?[0];
                let top = top_of(&stem_of(base, &self.modes.angles(step.scores), step.length_cm));
                data.tips[at].map(|tip| Point::new(tip.x - top.x, tip.y - top.y))
            };
            let Some(offsets) = offset(at, from).zip(offset(at + 1, to)) else { continue };
            let happened = Happened {
                residual: core::array::from_fn(|mode| to.scores[mode] - from.scores[mode] - changes[mode]),
                growth: to.length_cm - from.length_cm - growth,
                offsets: [offsets.0, offsets.1],
                state: [from.scores[0], light.mean(self.like)[0]],
            };
            records.push(Record { step: at, size_cm: from.length_cm, what: happened });
        }
        if records.is_empty() {
            return None;
        }
        Some(Response { gain, replay: Replay::new(records), base: data.mean_base() })
    }

    /// What the network expects of a step: its memory after it, the changes of the scores and the growth in cm.
    fn expect(&self, memory: &Memory, side: f64, scores: &Scores, length_cm: f64) -> (Memory, Scores, f64) {
        let scores =
            core::array::from_fn(|mode| scores[mode].clamp(-self.most_scores[mode], self.most_scores[mode]));
        let length_cm = length_cm.clamp(self.lengths_cm[0], self.lengths_cm[1]);
        let (odd, even) = self.scales.inputs(side, &scores, length_cm);
        let step = recurrent::forward(&self.network.weights, memory, odd, even);
        let changes = core::array::from_fn(|mode| self.scales.changes[mode] * step.changes[mode]);
        (step.after, changes, self.scales.growth_cm * step.growth)
    }

    /// One model for each plant: the same network, with the gain and the records of that plant alone. Of more than `most`
    /// plants, as many as that are taken, evenly in their order.
    #[must_use]
    pub fn of_each_plant(&self, most: usize) -> Vec<Self> {
        let plants: Vec<&Response> = self.plants.iter().collect();
        evenly(&plants, most).map(|plant| Self { plants: vec![plant.clone()], ..self.clone() }).collect()
    }

    /// Readable JSON with all data and weights, schema `tropism.lstm-model/1`; see `docs/formats.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        self.measured.to_json(SCHEMA, Some(&self.network))
    }

    /// Whether `text` calls itself an LSTM of stems, of any version.
    #[must_use]
    pub fn is_named_in(text: &str) -> bool {
        is_named_in(text, SCHEMA)
    }

    /// Reads [`Self::to_json`].
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let (measured, network) = MeasuredPlants::from_json_with_network(text, SCHEMA)?;
        let network = network.unwrap_or_default();
        network.check(WEIGHTS, measured.plants.len())?;
        Self::of_network(measured, network)
    }
}

/// The state of one plant of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct LstmState {
    body: Body,
    memory: Memory,
    /// Which measured plant it is.
    plant: usize,
    /// Factor of the light, beside that of the measured plant.
    gain: f64,
}

impl PlantModel for LstmModel {
    type Plant = LstmState;

    /// A straight stem from the base of a measured plant to `start`.
    fn seedling(&self, start: Point, noise: &mut StepNoise) -> LstmState {
        let (plant, gain, mirror) = draw_plant(self.plants.len(), noise);
        let Point { x, y } = self.plants[plant].base;
        let base = Point::new(mirror * x, y);
        LstmState { body: Body::upright(&self.modes, base, start), memory: Memory::EMPTY, plant, gain }
    }

    /// The stem as it was seen last; the network has seen the hours before.
    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> LstmState {
        let period_min = self.measured.period_min;
        let steps = steps_of_window([0.0, SEEN_MIN], period_min)[1];
        let mut plant = self.seedling(past[past.len() - 1].tip, noise);
        let seen = Past::of(past, steps, (&self.measured, &self.modes, &self.errors), noise);
        let Some(body) = Body::observed(&seen) else { return plant };
        plant.body = body;
        let gain = plant.gain * self.plants[plant.plant].gain;
        let lengths = smooth_lengths(&seen.plant.lengths(&self.modes), period_min);
        let known = seen.scores.iter().zip(&lengths).zip(&seen.plant.sides);
        let mut last = None;
        // A step without a stem is taken for one at which nothing changed.
        for ((scores, length_cm), side) in known.take(seen.scores.len() - 1) {
            last = scores.zip(*length_cm).or(last);
            let Some((scores, length_cm)) = last else { continue };
            (plant.memory, ..) = self.expect(&plant.memory, gain * side.unwrap_or(0.0), &scores, length_cm);
        }
        plant
    }

    fn step(&self, plant: &mut LstmState, light: Light, noise: &mut StepNoise) {
        let Response { gain, replay, .. } = &self.plants[plant.plant];
        let (side, period_min) = (self.measured.layout.side(light), self.measured.period_min);
        let LstmState { body, memory, .. } = plant;
        body.light.add([side]);
        let (happened, mirror) = body.draw(replay, &self.modes, self.like, period_min, noise);
        let expected = self.expect(memory, plant.gain * gain * side, &body.scores, body.length_cm);
        *memory = expected.0;
        let change = core::array::from_fn(|mode| expected.1[mode] + mirror * happened.residual[mode]);
        let happened = Happened { growth: happened.growth + expected.2, ..happened };
        body.step(&self.modes, change, (happened, mirror), period_min);
    }

    fn observe(&self, plant: &LstmState) -> Observation {
        plant.body.observe(&self.modes)
    }

    fn is_beyond_data(&self, plant: &LstmState) -> bool {
        is_beyond(plant.body.scores[0], plant.body.length_cm, self.most_scores, self.lengths_cm)
    }

    fn layout(&self) -> &Layout {
        &self.measured.layout
    }

    fn period_min(&self) -> f64 {
        self.measured.period_min
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Periodic;
    use crate::environment::unwatched;
    use crate::greenhouse::bean::{Species, Trial};
    use crate::task::OpenLoop;

    /// A virtual bean under lamps that are switched every three hours.
    fn grown(seed: u64, steps: u32) -> Track {
        let species = Species::default();
        let trial = Trial::new(&species);
        let mut controller = Periodic::new(36, &trial.layout);
        trial.grow(seed, &mut controller, &OpenLoop { steps, ..OpenLoop::default() }, &mut unwatched)
    }

    #[test]
    fn slopes_of_free_runs_are_those_of_finite_differences() {
        let measured = MeasuredPlants::of_tracks(&[grown(1, 60)]).unwrap();
        let modes = Modes::of_low(&measured);
        let plants = steps_of(&measured, &modes);
        let scales = Scales::of(&plants, &modes);
        let steps = plants[0][20..32].iter().map(|step| step.as_ref().unwrap()).collect();
        let stretch = Stretch { plant: 0, steps, seen: 4 };
        let mut weights = recurrent::first_weights(&NoiseStream::new(1, Purpose::Training, [0; 3]));
        let noise = NoiseStream::new(2, Purpose::Training, [0; 3]);
        (0..WEIGHTS).for_each(|place| weights[place] += 0.1 * noise.at(place as u32).normal());
        let slope = stretch.run(&weights, &scales, 1.2, 5.0, true);
        let loss = |weights: &[f64], gain| stretch.run(weights, &scales, gain, 5.0, false).loss;
        let is_near = |slope: f64, above: f64, below: f64, what: String| {
            let difference = (above - below) / 2e-5;
            let most = 1e-6 * (1.0 + slope.abs()) + 1e-4 * difference.abs();
            assert!((difference - slope).abs() < most, "{what}: {difference} {slope}");
        };
        let [above, below] = [1e-5, -1e-5].map(|by: f64| loss(&weights, 1.2 * math::exp(by)));
        is_near(slope.gain, above, below, "gain".to_owned());
        for place in (0..WEIGHTS).step_by(7) {
            let weight = weights[place];
            let [above, below] = [1e-5, -1e-5].map(|by| {
                weights[place] = weight + by;
                loss(&weights, 1.2)
            });
            weights[place] = weight;
            is_near(slope.weights[place], above, below, format!("weight {place}"));
        }
    }
}
