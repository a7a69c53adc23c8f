//! A model with memory: the next shift of the tip depends on the light of the last hour, on the last shifts and on the plant.
//!
//! The paper's tip-motion model is an average plant that forgets: its shift follows from place and lamp alone. A bean goes on
//! bending after the lamp is switched, and plants differ. Here the shift in x is linear in [`TERMS`] terms, with weights of
//! each plant's own. What the line does not explain, and the growth, are replayed from the same plant in blocks, so that
//! pauses and nutation come along. Each simulated plant is one of the measured plants or its mirror image, and answers the
//! light with a gain of its own.
//!
//! Light enters as the side of the lit lamp: there must be two lamps that are mirror images of each other.
//!
//! # References
//! Hoerl and Kennard 1970, doi:10.1080/00401706.1970.10488634 (ridge regression). Politis and Romano 1994,
//! doi:10.1080/01621459.1994.10476870 (stationary bootstrap: blocks of random length).

use super::PlantModel;
use super::tip::{ModelError, shared_layout_and_period};
use crate::check::ensure;
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::math::matrix;
use crate::observation::{Observation, Quality};
use crate::random::StepNoise;
use crate::track::{Sample, Track};

/// Terms of the line: five of light, four of light times height, then x, four shifts, height times x and |x| x.
pub const TERMS: usize = 16;

/// The first terms are those of the light, to which the gain of a plant applies.
const LIGHT_TERMS: usize = 9;

/// Last shifts that enter, in steps.
const SHIFTS: usize = 4;

// The following constants stood in the first version of this model, whose rules scored 11.2 to 11.4 cm on unseen virtual
// beans where the greedy rule scores 9.2. Other values were not tried, except where it says so.

/// Windows over which the light is averaged, in minutes before the end of the step: at five minutes a step these are step 1,
/// steps 2-3, 4-6, 7-10 and 11-14 back. The first is the step itself.
const LIGHT_WINDOWS_MIN: [[f64; 2]; 5] = [[0.0, 5.0], [5.0, 15.0], [15.0, 30.0], [30.0, 50.0], [50.0, 70.0]];

/// How much of each track is used, in minutes: 500 steps of five minutes. At 0.03 cm a step, eq. (4), a plant is taller than
/// the paper's highest target by then.
const USED_MIN: f64 = 2500.0;

/// Steps that begin at this height or above are left out, in cm. The paper's experiments end at 13.8 cm.
const MAX_HEIGHT_CM: f64 = 16.0;

/// Height around which the response to light is linear, in cm, and the scale of its change: the middle and half of the
/// range of heights, 4 to 14 cm.
const MIDDLE_HEIGHT_CM: f64 = 9.0;
const HEIGHT_SCALE_CM: f64 = 5.0;

/// Ridge of the weights of all plants together, which are drawn to 0.
const POOLED_RIDGE: f64 = 1.0;

/// Ridge of the weights of one plant, which are drawn to those of all.
const PLANT_RIDGE: f64 = 30.0;

/// Mean length of a replayed block, in minutes: 24 steps of five minutes.
const BLOCK_MIN: f64 = 120.0;

/// A block begins at data within this of the plant's height, in cm.
const BLOCK_REACH_CM: f64 = 1.5;

/// Gains of simulated plants, all equally likely. Between virtual beans gains differ by some 20 %.
const GAINS: [f64; 5] = [0.7, 0.85, 1.0, 1.15, 1.3];

/// Coordinates beyond this are no plant.
const FARTHEST_CM: f64 = 1000.0;

/// What was observed of one plant, step by step from its first observation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlantData {
    /// The tip at each step, in cm; `None` where it was not measured.
    pub(super) tips: Vec<Option<Point>>,
    /// The side of the lamp that was lit from each step to the next: -1, 1, or 0 in the dark; `None` where it is not known.
    pub(super) sides: Vec<Option<f64>>,
}

impl PlantData {
    /// The first `steps` steps of `track`.
    fn of_track(track: &Track, steps: usize) -> Self {
        let mut data = Self { tips: Vec::new(), sides: Vec::new() };
        let first = track.samples.first().map_or(0, |sample| sample.step);
        for sample in &track.samples {
            let step = sample.step.wrapping_sub(first) as usize;
            if step > steps {
                break;
            }
            data.tips.resize(step + 1, None);
            data.sides.resize(step + 1, None);
            data.tips[step] = (sample.quality != Quality::Held).then_some(sample.tip);
            data.sides[step] = Some(sample.light.map_or(0.0, |light| track.layout.side(light)));
        }
        data
    }
}

/// What a plant remembers: the light so far and its last shifts. Before the first step there was no light and no shift.
#[derive(Clone, Debug, PartialEq)]
struct History {
    /// Sum of the sides of all lights up to each step.
    light_sums: Vec<f64>,
    /// The last shifts in x, the latest first, in cm.
    shifts: [f64; SHIFTS],
}

impl History {
    const fn new() -> Self {
        Self { light_sums: Vec::new(), shifts: [0.0; SHIFTS] }
    }

    fn add_light(&mut self, side: f64) {
        let sum = self.light_sums.last().copied().unwrap_or(0.0);
        self.light_sums.push(sum + side);
    }

    fn add_shift(&mut self, shift: f64) {
        self.shifts.rotate_right(1);
        self.shifts[0] = shift;
    }

    /// Mean side of the lights from `newest` to before `oldest` steps back; 0 steps back is the latest light.
    fn mean_light(&self, [newest, oldest]: [usize; 2]) -> f64 {
        let steps = self.light_sums.len();
        let sum_until = |back: usize| steps.checked_sub(back + 1).map_or(0.0, |at| self.light_sums[at]);
        (sum_until(newest) - sum_until(oldest)) / (oldest - newest) as f64
    }

    /// The terms of the line for a tip at `x` and `height`, in cm. In a mirror all of them change sign.
    fn terms(&self, windows: &[[usize; 2]; 5], x: f64, height: f64) -> [f64; TERMS] {
        let height = (height - MIDDLE_HEIGHT_CM) / HEIGHT_SCALE_CM;
        let [a, b, c, d, e] = windows.map(|window| self.mean_light(window));
        let [first, second, third, fourth] = self.shifts;
        [
            a,
            b,
            c,
            d,
            e,
            height * a,
            height * b,
            height * c,
            height * d,
            x,
            first,
            second,
            third,
            fourth,
            height * x,
            x.abs() * x,
        ]
    }
}

/// One usable step of a plant: the terms, and what the tip did.
struct Row {
    step: usize,
    tip: Point,
    terms: [f64; TERMS],
    shift: f64,
    growth: f64,
}

impl PlantData {
    /// The usable steps: all that enters the terms is known, and the tip is measured before and after.
    fn rows(&self, windows: &[[usize; 2]; 5]) -> Vec<Row> {
        let memory = windows[windows.len() - 1][1];
        // Steps until what is not known has left the memory.
        let (mut light_gap, mut shift_gap) = (0, 0_usize);
        let mut history = History::new();
        let mut rows = Vec::new();
        for (step, pair) in self.tips.windows(2).enumerate() {
            history.add_light(self.sides[step].unwrap_or(0.0));
            if self.sides[step].is_none() {
                light_gap = memory;
            }
            let shift = match *pair {
                [Some(tip), Some(after)] => {
                    if light_gap == 0 && shift_gap == 0 && tip.y < MAX_HEIGHT_CM {
                        let terms = history.terms(windows, tip.x, tip.y);
                        rows.push(Row { step, tip, terms, shift: after.x - tip.x, growth: after.y - tip.y });
                    }
                    Some(after.x - tip.x)
                }
                _ => None,
            };
            history.add_shift(shift.unwrap_or(0.0));
            shift_gap = if shift.is_none() { SHIFTS } else { shift_gap.saturating_sub(1) };
            light_gap = light_gap.saturating_sub(1);
        }
        rows
    }
}

/// Weights of least squares over `rows` and their mirror images, drawn to `prior` by `ridge`. The mirror image of a row has
/// the same products, as terms and shift change sign together: each row counts twice.
fn ridge_regression<'r>(
    rows: impl Iterator<Item = &'r Row>,
    prior: &[f64; TERMS],
    ridge: f64,
) -> [f64; TERMS] {
    let mut products = matrix::identity::<TERMS>().map(|row| row.map(|value| ridge * value));
    let mut right = prior.map(|weight| ridge * weight);
    for row in rows {
        for (at, one) in row.terms.iter().enumerate() {
            for (product, other) in products[at].iter_mut().zip(&row.terms) {
                *product += 2.0 * one * other;
            }
            right[at] += 2.0 * one * row.shift;
        }
    }
    matrix::solve(products, right).expect("a ridge above 0 makes the matrix positive definite")
}

/// A step as it is replayed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Record {
    step: usize,
    /// What the line does not explain of the shift, in cm.
    residual: f64,
    /// Movement in y, in cm.
    growth: f64,
    /// Height before the step, in cm.
    height: f64,
}

/// The response of one measured plant.
#[derive(Clone, Debug, PartialEq)]
struct Response {
    weights: [f64; TERMS],
    /// Its steps in order.
    records: Vec<Record>,
    /// The places of its steps in `records`, in the order of their heights.
    by_height: Vec<usize>,
}

impl Response {
    fn new(rows: &[Row], pooled: &[f64; TERMS]) -> Self {
        let weights = ridge_regression(rows.iter(), pooled, PLANT_RIDGE);
        let record = |row: &Row| Record {
            step: row.step,
            residual: row.shift - dot(&weights, &row.terms),
            growth: row.growth,
            height: row.tip.y,
        };
        let records: Vec<Record> = rows.iter().map(record).collect();
        let mut by_height: Vec<usize> = (0..records.len()).collect();
        by_height.sort_by(|&one, &other| records[one].height.total_cmp(&records[other].height));
        Self { weights, records, by_height }
    }

    /// The record after `place`, if it is of the next step.
    fn successor(&self, place: usize) -> Option<usize> {
        let next = self.records.get(place + 1)?;
        (next.step == self.records[place].step + 1).then_some(place + 1)
    }

    /// A record within reach of `height`, drawn by `uniform`, 0 to 1; the nearest one where there is none within reach.
    fn draw(&self, height: f64, uniform: f64) -> usize {
        let height_of = |&place: &usize| self.records[place].height;
        let below = self.by_height.partition_point(|place| height_of(place) < height - BLOCK_REACH_CM);
        let within =
            self.by_height.partition_point(|place| height_of(place) <= height + BLOCK_REACH_CM) - below;
        if within > 0 {
            return self.by_height[below + (uniform * within as f64) as usize];
        }
        let neighbours = [below.checked_sub(1), Some(below)];
        let neighbours = neighbours.into_iter().flatten().filter_map(|at| self.by_height.get(at).copied());
        let distance = |place: &usize| (self.records[*place].height - height).abs();
        neighbours
            .min_by(|one, other| distance(one).total_cmp(&distance(other)))
            .expect("at least one record")
    }
}

fn dot(weights: &[f64], terms: &[f64]) -> f64 {
    weights.iter().zip(terms).map(|(weight, term)| weight * term).sum()
}

/// A model of how a tip moves, with memory and with differences between plants.
///
/// ```
/// use tropism::control::Periodic;
/// use tropism::environment::unwatched;
/// use tropism::greenhouse::bean::{Species, Trial};
/// use tropism::lamps::Layout;
/// use tropism::plant::memory::MemoryModel;
/// use tropism::prelude::*;
///
/// let species = Species::default();
/// let open_loop = OpenLoop { steps: 200, ..OpenLoop::default() };
/// let grow = |seed| {
///     Trial::new(&species).grow(seed, &mut Periodic::new(72, &Layout::default()), &open_loop, &mut unwatched)
/// };
/// let model = MemoryModel::fit(&[grow(1), grow(2)])?;
/// let task = Targets { max_steps: 40, ..Targets::default() };
/// let track = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, 1);
/// assert_eq!(track.samples.len(), 41);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryModel {
    pub(super) layout: Layout,
    pub(super) period_min: f64,
    pub(super) data: Vec<PlantData>,
    is_virtual: bool,
    /// Windows of the light's memory, in steps.
    windows: [[usize; 2]; 5],
    plants: Vec<Response>,
    /// Greatest |x| of the data, in cm. Beyond it the plant answers as it does there.
    widest_cm: f64,
    /// Least and greatest height of the data, in cm. Beyond them the plant answers as it does there.
    heights_cm: [f64; 2],
}

impl MemoryModel {
    /// A model of the first 500 steps (at five minutes) of `tracks` and their mirror images, below 16 cm.
    ///
    /// # Errors
    /// [`ModelError`] where no step is usable, where the tracks differ in lamps or period, or where the lamps are not two
    /// mirror images.
    pub fn fit<'t>(tracks: impl IntoIterator<Item = &'t Track>) -> Result<Self, ModelError> {
        let tracks: Vec<&Track> = tracks.into_iter().collect();
        let (layout, period_min) = shared_layout_and_period(&tracks)?;
        let steps = (USED_MIN / period_min).ceil() as usize;
        let data = tracks.into_iter().map(|track| PlantData::of_track(track, steps)).collect();
        Self::of_data(data, layout, period_min)
    }

    pub(super) fn of_data(data: Vec<PlantData>, layout: Layout, period_min: f64) -> Result<Self, ModelError> {
        let mut sides: Vec<f64> = layout.lights().map(|light| layout.side(light)).collect();
        sides.sort_by(f64::total_cmp);
        if sides != [-1.0, 1.0] || !layout.is_symmetric() {
            let names: Vec<&str> = layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect();
            return Err(ModelError::Sides { found: names.join(", ") });
        }
        let is_period = period_min > 0.0 && period_min.is_finite();
        ensure(is_period, "period_min", period_min, "minutes above 0")?;
        for (index, plant) in data.iter().enumerate() {
            let is_far = |tip: &&Point| !(tip.x.abs() <= FARTHEST_CM && tip.y.abs() <= FARTHEST_CM);
            if let Some(tip) = plant.tips.iter().flatten().find(is_far) {
                return Err(ModelError::Shift { index, found: format!("{tip:?}") });
            }
        }
        let windows = LIGHT_WINDOWS_MIN.map(|window| steps_of_window(window, period_min));
        let rows: Vec<Vec<Row>> =
            data.iter().map(|plant| plant.rows(&windows)).filter(|rows| !rows.is_empty()).collect();
        if rows.is_empty() {
            return Err(ModelError::NoShifts { tracks: data.len() });
        }
        let pooled = ridge_regression(rows.iter().flatten(), &[0.0; TERMS], POOLED_RIDGE);
        let plants = rows.iter().map(|rows| Response::new(rows, &pooled)).collect();
        let tips = || rows.iter().flatten().map(|row| row.tip);
        let widest_cm = tips().map(|tip| tip.x.abs()).fold(0.0, f64::max);
        let wider = |[least, most]: [f64; 2], tip: Point| [least.min(tip.y), most.max(tip.y)];
        let heights_cm = tips().fold([f64::INFINITY, f64::NEG_INFINITY], wider);
        Ok(Self { layout, period_min, data, is_virtual: false, windows, plants, widest_cm, heights_cm })
    }

    /// The same model, labelled as made of virtual plants or not. Results of evolution carry the label.
    #[must_use]
    pub const fn of_virtual_plants(mut self, is_virtual: bool) -> Self {
        self.is_virtual = is_virtual;
        self
    }

    /// Whether it was made of virtual plants.
    #[must_use]
    pub const fn is_virtual(&self) -> bool {
        self.is_virtual
    }

    /// How many steps the model is made of, without their mirror images.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.plants.iter().map(|plant| plant.records.len()).sum()
    }

    /// The measured tips that it is made of, in cm.
    pub fn tips(&self) -> impl Iterator<Item = Point> {
        self.data.iter().flat_map(|plant| plant.tips.iter().flatten().copied())
    }

    /// One model for each plant, made of its steps alone. Plants without a usable step are left out.
    ///
    /// # Errors
    /// None that [`Self::fit`] would not have given for the same data.
    pub fn of_each_plant(&self) -> Result<Vec<Self>, ModelError> {
        let alone = |plant: &PlantData| {
            let model = Self::of_data(vec![plant.clone()], self.layout.clone(), self.period_min)?;
            Ok(model.of_virtual_plants(self.is_virtual))
        };
        self.data.iter().filter(|plant| !plant.rows(&self.windows).is_empty()).map(alone).collect()
    }

    /// The share of the lit steps of a track, 0 to 1, that begin farther to a side, higher or lower than all data.
    #[must_use]
    pub fn share_without_data(&self, samples: &[Sample]) -> f64 {
        let [lowest, highest] = self.heights_cm;
        let is_outside = |tip: Point| {
            tip.x.abs() > self.widest_cm
                || !(lowest - BLOCK_REACH_CM..=highest + BLOCK_REACH_CM).contains(&tip.y)
        };
        let lit = samples.iter().filter(|sample| sample.light.is_some());
        let (outside, steps) = lit.fold((0, 0), |(outside, steps), sample| {
            (outside + u32::from(is_outside(sample.tip)), steps + 1)
        });
        f64::from(outside) / f64::from(steps.max(1))
    }
}

/// A window of minutes in steps of `period_min` minutes, at least one.
fn steps_of_window([newest, oldest]: [f64; 2], period_min: f64) -> [usize; 2] {
    let newest = (newest / period_min).round() as usize;
    [newest, ((oldest / period_min).round() as usize).max(newest + 1)]
}

/// The state of one plant of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct MemoryState {
    tip: Point,
    /// Which measured plant it is.
    plant: usize,
    /// -1 if it is the mirror image of that plant, else 1.
    mirror: f64,
    /// Factor of the light's terms.
    gain: f64,
    history: History,
    /// The record that is replayed.
    record: Option<usize>,
}

impl PlantModel for MemoryModel {
    type Plant = MemoryState;

    fn seedling(&self, start: Point, noise: &mut StepNoise) -> MemoryState {
        let mut among = |count: usize| (noise.uniform() * count as f64) as usize;
        let (plant, gain) = (among(self.plants.len()), GAINS[among(GAINS.len())]);
        let mirror = [1.0, -1.0][among(2)];
        MemoryState { tip: start, plant, mirror, gain, history: History::new(), record: None }
    }

    fn step(&self, plant: &mut MemoryState, light: Light, noise: &mut StepNoise) {
        let response = &self.plants[plant.plant];
        let goes_on = noise.uniform() >= self.period_min / BLOCK_MIN;
        let next = plant.record.filter(|_| goes_on).and_then(|place| response.successor(place));
        let place = next.unwrap_or_else(|| response.draw(plant.tip.y, noise.uniform()));
        let Record { residual, growth, .. } = response.records[place];

        plant.history.add_light(self.layout.side(light));
        let x = plant.tip.x.clamp(-self.widest_cm, self.widest_cm);
        let height = plant.tip.y.clamp(self.heights_cm[0], self.heights_cm[1]);
        let terms = plant.history.terms(&self.windows, x, height);
        let (of_light, others) = terms.split_at(LIGHT_TERMS);
        let (light_weights, other_weights) = response.weights.split_at(LIGHT_TERMS);
        let shift = plant.gain * dot(light_weights, of_light) + dot(other_weights, others);
        let shift = shift + plant.mirror * residual;

        plant.tip = Point::new(plant.tip.x + shift, plant.tip.y + growth);
        plant.history.add_shift(shift);
        plant.record = Some(place);
    }

    fn observe(&self, plant: &MemoryState) -> Observation {
        Observation::simulated(plant.tip)
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn period_min(&self) -> f64 {
        self.period_min
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::random::{self, NoiseStream, Purpose};
    use crate::track::Sample;

    /// A plant that answers the light of 15 to 30 minutes ago by `gain` cm a step, under a lamp that changes every 30 steps.
    pub(in super::super) fn track(seed: u64, gain: f64, period_min: f64) -> Track {
        let mut rng = random::stream(seed, Purpose::Growth, 0);
        let mut tip = Point::new(0.0, 4.0);
        let mut sides: Vec<f64> = Vec::new();
        let samples = (0..400).map(|step| {
            let light = if step / 30 % 2 == 0 { Light::RIGHT } else { Light::LEFT };
            let sample = Sample {
                step,
                time_s: f64::from(step) * 60.0 * period_min,
                tip,
                stem: None,
                light: (step < 399).then_some(light),
                quality: Quality::Measured,
            };
            sides.push(Layout::default().side(light));
            let back = |steps: usize| sides.len().checked_sub(steps).map_or(0.0, |at| sides[at]);
            let answer = gain * (back(4) + back(5) + back(6)) / 3.0;
            let pull = -0.02 * tip.x;
            tip = Point::new(
                tip.x + answer + pull + 0.01 * random::normal(&mut rng),
                tip.y + 0.025 + 0.005 * random::normal(&mut rng),
            );
            sample
        });
        let samples = samples.collect();
        Track { period_min, ..Track::of(samples) }
    }

    fn model() -> MemoryModel {
        MemoryModel::fit(&[track(1, 0.05, 5.0), track(2, 0.08, 5.0)]).unwrap()
    }

    fn step_noise(step: u32) -> StepNoise {
        NoiseStream::new(1, Purpose::Trial, [0; 3]).at(step)
    }

    #[test]
    fn the_weights_find_the_delay_and_the_gain_of_each_plant() {
        let model = model();
        for (plant, gain) in model.plants.iter().zip([0.05, 0.08]) {
            let found = plant.weights[2];
            assert!((found - gain).abs() < 0.2 * gain, "{found} for {gain}: {:?}", plant.weights);
            assert!(plant.weights[0].abs() < 0.2 * gain, "{:?}", plant.weights);
            let residuals = plant.records.iter().map(|record| record.residual * record.residual);
            assert!((residuals.sum::<f64>() / plant.records.len() as f64).sqrt() < 0.013);
        }
    }

    #[test]
    fn windows_are_minutes_whatever_the_period() {
        let windows = |period| LIGHT_WINDOWS_MIN.map(|window| steps_of_window(window, period));
        assert_eq!(windows(5.0), [[0, 1], [1, 3], [3, 6], [6, 10], [10, 14]]);
        assert_eq!(windows(2.5), [[0, 2], [2, 6], [6, 12], [12, 20], [20, 28]]);
        assert_eq!(windows(30.0), [[0, 1], [0, 1], [1, 2], [1, 2], [2, 3]]);
        let ten = MemoryModel::fit(&[track(1, 0.05, 10.0)]).unwrap();
        assert_eq!((ten.period_min(), ten.steps()), (10.0, 250));
    }

    #[test]
    fn a_mirrored_plant_moves_in_a_mirror() {
        let model = model();
        let mut plant = model.seedling(Point::new(0.2, 4.0), &mut step_noise(u32::MAX));
        let mut image = MemoryState { tip: plant.tip.mirrored(), mirror: -plant.mirror, ..plant.clone() };
        for step in 0..300 {
            let light = if step % 17 < 9 { Light::LEFT } else { Light::RIGHT };
            model.step(&mut plant, light, &mut step_noise(step));
            model.step(&mut image, model.layout().mirrored(light).unwrap(), &mut step_noise(step));
            assert_eq!(plant.tip, image.tip.mirrored(), "step {step}");
        }
        assert!(plant.tip.y > 8.0, "{:?}", plant.tip);
    }

    #[test]
    fn simulated_plants_follow_the_light_and_grow_as_the_measured_ones() {
        let model = model();
        for episode in 0..20 {
            let noise = NoiseStream::new(3, Purpose::Trial, [episode, 0, 0]);
            let mut plant = model.seedling(Point::new(0.0, 4.0), &mut noise.of_seedling());
            for step in 0..200 {
                model.step(&mut plant, Light::RIGHT, &mut noise.at(step));
            }
            // Equilibrium of gain and pull: 2.5 and 4 cm, times the gain of the plant.
            assert!((1.0..8.0).contains(&plant.tip.x), "{:?}", plant.tip);
            assert!((plant.tip.y - 9.0).abs() < 0.4, "{:?}", plant.tip);
        }
    }

    #[test]
    fn blocks_last_24_steps_and_begin_near_the_height() {
        let model = model();
        let (mut begun, mut steps) = (0, 0);
        for episode in 0..40 {
            let noise = NoiseStream::new(4, Purpose::Trial, [episode, 0, 0]);
            let mut plant = model.seedling(Point::new(0.0, 4.0), &mut noise.of_seedling());
            for step in 0..300 {
                let (before, height) = (plant.record, plant.tip.y);
                model.step(&mut plant, Light::RIGHT, &mut noise.at(step));
                let records = &model.plants[plant.plant].records;
                steps += 1;
                if plant.record != before.map(|place| place + 1) {
                    begun += 1;
                    let apart = (records[plant.record.unwrap()].height - height).abs();
                    assert!(apart <= BLOCK_REACH_CM, "{apart}");
                }
            }
        }
        let length = f64::from(steps) / f64::from(begun);
        assert!((19.0..27.0).contains(&length), "{length}");
    }

    #[test]
    fn gaps_and_held_tips_leave_the_steps_out_that_would_remember_them() {
        let whole = track(1, 0.05, 5.0);
        let steps = |track: &Track| MemoryModel::fit([track]).unwrap().steps();
        assert_eq!(steps(&whole), 399);
        let mut held = whole.clone();
        held.samples[100].quality = Quality::Held;
        // Two shifts touch the tip; four further steps remember the later one.
        assert_eq!(steps(&held), 399 - 6);
        let mut gap = whole.clone();
        gap.samples.remove(100);
        // The light of the missing step is remembered for 14 steps, itself included, and one step leads to it.
        assert_eq!(steps(&gap), 399 - 15);
        assert_eq!(steps(&Track { samples: whole.samples[..2].to_vec(), ..whole.clone() }), 1);
    }

    #[test]
    fn lamps_without_sides_and_tracks_without_steps_are_refused() {
        let four = Track { layout: Layout::four_sides(), ..track(1, 0.05, 5.0) };
        let error = MemoryModel::fit([&four]).unwrap_err().to_string();
        assert!(
            error.contains("left, right, front, back") && error.contains("one on each side of the plant"),
            "{error}"
        );
        let error = MemoryModel::fit([&Track::default()]).unwrap_err().to_string();
        assert!(error.contains("no usable step in 1 tracks"), "{error}");
        let error = MemoryModel::fit(&[track(1, 0.05, 5.0), track(1, 0.05, 10.0)]).unwrap_err().to_string();
        assert!(error.contains("track 2: found 10 minutes"), "{error}");
    }

    #[test]
    fn a_model_of_each_plant_has_its_steps_alone() {
        let each = model().of_each_plant().unwrap();
        assert_eq!(each.len(), 2);
        assert_eq!(each[1], MemoryModel::fit([&track(2, 0.08, 5.0)]).unwrap());
    }

    #[test]
    fn steps_beyond_the_data_are_counted() {
        let model = model();
        assert_eq!(model.share_without_data(&track(1, 0.05, 5.0).samples), 0.0);
        let mut far = track(1, 0.05, 5.0);
        far.samples.iter_mut().take(399).for_each(|sample| sample.tip.x += 50.0);
        assert_eq!(model.share_without_data(&far.samples), 1.0);
    }
}
