//! A model of the whole stem: the angles along it change by the light of the last hour, by their own past and by the plant.
//!
//! A stem is ten points; its nine segments have angles. A few modes of the angles hold nearly all of how stems bend. The
//! model is linear in [`TERMS`] terms: given the scores of the modes, the light and the past, by how much does each score
//! change in a step? Weights are each plant's own. What the line does not explain, the growth, and where the tip is seen
//! beside the end of the stem, are replayed in blocks from the same plant or its mirror image, when it was about as long, leant
//! about as far and had about as much light from either side. Each simulated plant is one of the measured plants, and answers
//! the light with a gain of its own.
//!
//! A model of the tip alone takes for speed what is lean: a lean tip moves on as it grows. Here the lean is part of the
//! state, so a simulated plant does not run away, and its fitness is nearly that of a plant.
//!
//! Light enters as the side of the lit lamp: there must be two lamps that are mirror images of each other.
//!
//! # References
//! Stephens et al. 2008, doi:10.1371/journal.pcbi.1000028 (modes of the angles along a body).

pub(crate) mod lanes;

use super::history::{History, LIGHT_WINDOWS_MIN, Window, steps_of_window};
use super::measured_plant::{
    Extent, MAX_HEIGHT_CM, MeasuredPlant, MeasuredPlants, draw_plant, is_named_in, tell_of_measured_plants,
};
use super::regression::ridge_regression;
use super::replay::{BLOCK_REACH_CM, Record, Replay};
pub use super::stem_shape::MODES;
use super::stem_shape::{
    Body, Errors, Happened, LIKE_LIGHT_MIN, Modes, Past, Scores, is_beyond, low_angles, smooth_lengths,
    stem_of, top_of,
};
use super::tip::ModelError;
use super::{PlantModel, evenly};
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::math;
use crate::math::vector::dot_slices;
use crate::observation::Observation;
use crate::random::StepNoise;
use crate::track::{Sample, Track};

/// The schema of the file.
const SCHEMA: &str = "tropism.stem-model/1";

/// Places of the terms of the line: five of light, these times the length and times its square, the scores, these times the
/// length and times its square, their cubes, and past changes of the scores. Some places stay empty.
pub const TERMS: usize = 39;

/// The first terms are those of the light, to which the gain of a plant applies.
pub(super) const LIGHT_TERMS: usize = 15;

/// Windows over which past changes of the scores are averaged, in minutes before the step.
const CHANGE_WINDOWS_MIN: [[f64; 2]; 4] = [[0.0, 5.0], [5.0, 15.0], [15.0, 30.0], [30.0, 60.0]];

/// Length around which the response is expanded, in cm, and the scale of its change: the middle and half of the range of
/// lengths, 4 to 14 cm.
pub(super) const MIDDLE_LENGTH_CM: f64 = 9.0;
const LENGTH_SCALE_CM: f64 = 5.0;

/// Ridge of the weights of all plants together, which are drawn to 0; of terms scaled to a mean square of 1. At 100 the
/// predicted fitness was the same within 0.1 cm.
pub(super) const POOLED_RIDGE: f64 = 30.0;

/// Ridge of the weights of one plant, which are drawn to those of all. Of 30, 100 and infinity, 100 predicted the fitness of
/// the greedy rule best in five laboratories of virtual beans.
pub(super) const PLANT_RIDGE: f64 = 100.0;

/// The place of a term: groups 0 to 2 are those of the light, 3 to 6 those of the scores, and the others the past changes.
///
/// Before each group but the first one place stays empty. So the weights of the last two terms of light have no gain, and of the
/// past changes only the first four have a place. With a place for each, neither the forecasts nor the rules were better
/// (docs/beyond.md), and all figures in `docs/` were measured so.
#[inline(always)]
const fn place(group: usize, number: usize) -> usize {
    let first = if group <= 3 { 5 * group } else { 15 + 3 * (group - 3) };
    first + group + number
}

/// The terms of the line. `squares` are those of the size of each score. In a mirror all terms change sign.
pub(super) fn terms(
    light: [f64; 5],
    length_cm: f64,
    scores: Scores,
    squares: Scores,
    changes: [Scores; 4],
) -> [f64; TERMS] {
    let length = (length_cm - MIDDLE_LENGTH_CM) / LENGTH_SCALE_CM;
    let mut terms = [0.0; TERMS];
    let mut put = |group: usize, values: &[f64], factor: f64| {
        for (number, value) in values.iter().enumerate() {
            if let Some(term) = terms.get_mut(place(group, number)) {
                *term = factor * value;
            }
        }
    };
    for (factor, group) in [1.0, length, length * length].into_iter().zip(0..) {
        put(group, &light, factor);
        put(group + 3, &scores, factor);
    }
    put(6, &core::array::from_fn::<f64, MODES, _>(|mode| squares[mode] * scores[mode]), 1.0);
    for (change, group) in changes.iter().zip(7..) {
        put(group, change, 1.0);
    }
    terms
}

/// The square of each score.
fn squares(scores: Scores) -> Scores {
    scores.map(|score| score * score)
}

/// One usable step of a plant.
struct Row {
    step: usize,
    terms: [f64; TERMS],
    change: Scores,
    happened: Happened,
    length_cm: f64,
}

/// Windows of the memory, in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Windows {
    pub(super) like: Window,
    pub(super) light: [Window; 5],
    pub(super) changes: [Window; 4],
}

impl Windows {
    pub(super) fn of(period_min: f64) -> Self {
        let steps = |window| steps_of_window(window, period_min);
        Self {
            like: steps([0.0, LIKE_LIGHT_MIN]),
            light: LIGHT_WINDOWS_MIN.map(steps),
            changes: CHANGE_WINDOWS_MIN.map(steps),
        }
    }
}

/// The usable steps of a plant: all that enters the terms is known, and stem and tip are measured before and after.
fn rows(plant: &MeasuredPlant, modes: &Modes, windows: &Windows, period_min: f64) -> Vec<Row> {
    let light_memory = windows.light[windows.light.len() - 1][1];
    let change_memory = windows.changes[windows.changes.len() - 1][1];
    // Steps until what is not known has left the memory.
    let (mut light_gap, mut change_gap) = (0, 0_usize);
    let (mut light, mut changes) = (History::<1>::new(), History::<MODES>::new());
    let lengths = smooth_lengths(&plant.lengths(modes), period_min);
    let scores = plant.scores(modes);
    let mut rows = Vec::new();
    for step in 0..plant.tips.len().saturating_sub(1) {
        light.add([plant.sides[step].unwrap_or(0.0)]);
        if plant.sides[step].is_none() {
            light_gap = light_memory;
        }
        let change = scores[step].zip(scores[step + 1]);
        let change: Option<Scores> =
            change.map(|(from, to)| core::array::from_fn(|mode| to[mode] - from[mode]));
        let row = || {
            let (tip, after) = (plant.tips[step]?, plant.tips[step + 1]?);
            let (length_cm, next_length_cm) = (lengths[step]?, lengths[step + 1]?);
            let (change, scores, next) = (change?, scores[step]?, scores[step + 1]?);
            let is_usable = light_gap == 0 && change_gap == 0 && tip.y < MAX_HEIGHT_CM;
            let offset = |tip: Point, base: Point, scores, length_cm| {
                let top = top_of(&stem_of(base, &modes.angles(scores), length_cm));
                Point::new(tip.x - top.x, tip.y - top.y)
            };
            let offsets = [
                offset(tip, plant.stems[step]?[0], scores, length_cm),
                offset(after, plant.stems[step + 1]?[0], next, next_length_cm),
            ];
            let past = windows.changes.map(|window| changes.mean(window));
            let lights = windows.light.map(|window| light.mean(window)[0]);
            is_usable.then(|| Row {
                step,
                terms: terms(lights, length_cm, scores, squares(scores), past),
                change,
                happened: Happened {
                    residual: change,
                    growth: next_length_cm - length_cm,
                    offsets,
                    state: [scores[0], light.mean(windows.like)[0]],
                },
                length_cm,
            })
        };
        rows.extend(row());
        changes.add(change.unwrap_or([0.0; MODES]));
        change_gap = if change.is_none() { change_memory } else { change_gap.saturating_sub(1) };
        light_gap = light_gap.saturating_sub(1);
    }
    rows
}

/// How one measured plant answers.
#[derive(Clone, Debug, PartialEq)]
struct Response {
    /// Weights of the change of each score.
    weights: [[f64; TERMS]; MODES],
    replay: Replay<Happened>,
    /// Mean of the lowest points of its stems, in cm.
    base: Point,
}

impl Response {
    fn new(
        plant: &MeasuredPlant,
        rows: Vec<Row>,
        pooled: &[[f64; TERMS]; MODES],
        scale: &[f64; TERMS],
    ) -> Self {
        let weights = weights_of(rows.iter(), pooled, &scale.map(|scale| PLANT_RIDGE * scale));
        let record = |row: Row| Record {
            step: row.step,
            size_cm: row.length_cm,
            what: Happened {
                residual: core::array::from_fn(|mode| {
                    row.change[mode] - dot_slices(&weights[mode], &row.terms)
                }),
                ..row.happened
            },
        };
        Self { weights, replay: Replay::new(rows.into_iter().map(record).collect()), base: plant.mean_base() }
    }
}

/// The responses of all plants with a usable step.
fn responses(
    measured: &MeasuredPlants,
    modes: &Modes,
    windows: &Windows,
) -> Result<Vec<Response>, ModelError> {
    let of_plants = measured.plants.iter();
    let of_plants: Vec<(&MeasuredPlant, Vec<Row>)> = of_plants
        .map(|plant| (plant, rows(plant, modes, windows, measured.period_min)))
        .filter(|(_, rows)| !rows.is_empty())
        .collect();
    if of_plants.is_empty() {
        return Err(ModelError::NoShifts { tracks: measured.plants.len() });
    }
    let rows = || of_plants.iter().flat_map(|(_, rows)| rows);
    let scale: [f64; TERMS] = core::array::from_fn(|term| {
        // A term that is 0 throughout gets a weight of 0, whatever its ridge.
        math::statistics::mean(rows().map(|row| row.terms[term] * row.terms[term])).max(f64::MIN_POSITIVE)
    });
    let pooled = weights_of(rows(), &[[0.0; TERMS]; MODES], &scale.map(|scale| POOLED_RIDGE * scale));
    Ok(of_plants.into_iter().map(|(plant, rows)| Response::new(plant, rows, &pooled, &scale)).collect())
}

fn weights_of<'r>(
    rows: impl Iterator<Item = &'r Row> + Clone,
    prior: &[[f64; TERMS]; MODES],
    ridge: &[f64; TERMS],
) -> [[f64; TERMS]; MODES] {
    core::array::from_fn(|mode| {
        ridge_regression(rows.clone().map(|row| (&row.terms, row.change[mode])), &prior[mode], ridge)
    })
}

/// A model of how a stem bends and grows, with memory and with differences between plants.
///
/// ```
/// use tropism::control::Periodic;
/// use tropism::environment::unwatched;
/// use tropism_bean::{Species, Trial};
/// use tropism::lamps::Layout;
/// use tropism::plant::stem::StemModel;
/// use tropism::prelude::*;
///
/// let species = Species::default();
/// let open_loop = Task::open_loop(200);
/// let grow = |seed| {
///     Trial::new(&species).grow(seed, &mut Periodic::new(72, &Layout::default()), &open_loop, &mut unwatched)
/// };
/// let model = StemModel::fit(&[grow(1), grow(2)])?;
/// let task = Task { max_steps: 40, ..Task::default() };
/// let track = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, 1);
/// assert_eq!(track.samples[40].stem.as_ref().map(|stem| stem.0.len()), Some(10));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StemModel {
    measured: MeasuredPlants,
    windows: Windows,
    modes: Modes,
    errors: Errors,
    plants: Vec<Response>,
    extent: Extent,
    /// Greatest size of each score in the data. Beyond it the plant answers as it does there.
    most_scores: Scores,
    /// Least and greatest length of the data, in cm. Beyond them the plant answers as it does there.
    lengths_cm: [f64; 2],
}

tell_of_measured_plants!(StemModel, Point, |sample| sample.tip);

impl StemModel {
    /// A model of `tracks` with stems and of their mirror images, below 16 cm: of their first 2500 minutes, and of plants that grow
    /// more slowly until the tip was 13.8 cm high.
    ///
    /// # Errors
    /// [`ModelError`] where no step is usable or no track has stems, where the tracks differ in lamps or period, or where
    /// the lamps are not two mirror images.
    pub fn fit<'t>(tracks: impl IntoIterator<Item = &'t Track>) -> Result<Self, ModelError> {
        let measured = MeasuredPlants::of_tracks(tracks)?;
        measured.check_stems()?;
        Self::of_measured(measured)
    }

    fn of_measured(measured: MeasuredPlants) -> Result<Self, ModelError> {
        let windows = Windows::of(measured.period_min);
        let modes = Modes::of_low(&measured);
        let plants = responses(&measured, &modes, &windows)?;
        let records = plants.iter().flat_map(|plant: &Response| &plant.replay.records);
        let lengths_cm = math::statistics::range(records.map(|record| record.size_cm));
        let most_scores = core::array::from_fn(|mode| {
            let sizes = low_angles(&measured).map(|angles| modes.scores(&angles)[mode].abs());
            sizes.fold(0.0, f64::max)
        });
        let low_tips = measured.tips().filter(|tip| tip.y < MAX_HEIGHT_CM);
        let extent = Extent::of(low_tips);
        let errors = Errors::of(&measured.plants, &modes);
        Ok(Self { windows, modes, errors, plants, extent, most_scores, lengths_cm, measured })
    }

    /// One model for each plant, made of its steps alone. Plants without a usable step are left out. Of more than `most`
    /// plants, as many as that are taken, evenly in their order.
    ///
    /// # Errors
    /// None that [`Self::fit`] would not have given for the same data.
    pub fn of_each_plant(&self, most: usize) -> Result<Vec<Self>, ModelError> {
        let Self { measured, modes, windows, .. } = self;
        let is_usable = |plant: &&MeasuredPlant| !rows(plant, modes, windows, measured.period_min).is_empty();
        let usable: Vec<&MeasuredPlant> = measured.plants.iter().filter(is_usable).collect();
        evenly(&usable, most).map(|plant| Self::of_measured(measured.alone(plant))).collect()
    }

    /// Readable JSON with all data, schema `tropism.stem-model/1`; see `docs/formats.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        self.measured.to_json(SCHEMA)
    }

    /// Whether `text` calls itself a model of stems, of any version.
    #[must_use]
    pub fn is_named_in(text: &str) -> bool {
        is_named_in(text, SCHEMA)
    }

    /// Reads [`Self::to_json`].
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        Self::of_measured(MeasuredPlants::from_json(text, SCHEMA)?)
    }
}

/// The state of one plant of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct StemState {
    body: Body,
    /// Which measured plant it is.
    plant: usize,
    /// Factor of the light's terms.
    gain: f64,
    changes: History<MODES>,
}

impl PlantModel for StemModel {
    type Plant = StemState;

    /// A straight stem from the base of a measured plant to `start`.
    fn seedling(&self, start: Point, noise: &mut StepNoise) -> StemState {
        let (plant, gain, mirror) = draw_plant(self.plants.len(), noise);
        let Point { x, y } = self.plants[plant].base;
        let base = Point::new(mirror * x, y);
        let body = Body::upright(&self.modes, base, start);
        StemState { body, plant, gain, changes: History::new() }
    }

    /// The stem as it was seen last, with the light and the changes of the past.
    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> StemState {
        let Self { measured, modes, windows, errors, .. } = self;
        let steps = windows.light[4][1].max(windows.changes[3][1]).max(windows.like[1]);
        let mut plant = self.seedling(past[past.len() - 1].tip, noise);
        let seen = Past::of(past, steps, (measured, modes, errors), noise);
        let Some(body) = Body::observed(&seen) else { return plant };
        plant.body = body;
        for pair in seen.scores.windows(2) {
            let change = |(from, to): (Scores, Scores)| core::array::from_fn(|mode| to[mode] - from[mode]);
            plant.changes.add(pair[0].zip(pair[1]).map_or([0.0; MODES], change));
        }
        plant
    }

    fn step(&self, plant: &mut StemState, light: Light, noise: &mut StepNoise) {
        let Self { measured, modes, windows, .. } = self;
        let Response { weights, replay, .. } = &self.plants[plant.plant];
        plant.body.light.add([measured.layout.side(light)]);
        let (happened, mirror) = plant.body.draw(replay, modes, windows.like, measured.period_min, noise);
        let Body { scores, length_cm, light, .. } = &plant.body;
        let clamped = |mode: usize| scores[mode].clamp(-self.most_scores[mode], self.most_scores[mode]);
        let clamped: Scores = core::array::from_fn(clamped);
        let terms = terms(
            windows.light.map(|window| light.mean(window)[0]),
            length_cm.clamp(self.lengths_cm[0], self.lengths_cm[1]),
            clamped,
            squares(clamped),
            windows.changes.map(|window| plant.changes.mean(window)),
        );
        let (of_light, others) = terms.split_at(LIGHT_TERMS);
        let change: Scores = core::array::from_fn(|mode| {
            let (light_weights, other_weights) = weights[mode].split_at(LIGHT_TERMS);
            let expected =
                plant.gain * dot_slices(light_weights, of_light) + dot_slices(other_weights, others);
            expected + mirror * happened.residual[mode]
        });
        plant.changes.add(change);
        plant.body.step(modes, change, (happened, mirror), measured.period_min);
    }

    fn observe(&self, plant: &StemState) -> Observation {
        plant.body.observe(&self.modes)
    }

    fn is_beyond_data(&self, plant: &StemState) -> bool {
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
    use super::super::stem_shape::angles;
    use super::*;
    use crate::geometry::Polyline;
    use crate::lamps::Light;
    use crate::observation::{Observation, Quality};
    use crate::track::Sample;

    /// A growing arc that bends towards the lamp that is lit, which changes every three hours.
    fn swaying(gain: f64) -> Track {
        let mut bend = 0.0;
        let samples = (0..300_u32).map(|step| {
            let light = if (step / 36) % 2 == 0 { Light::LEFT } else { Light::RIGHT };
            let pull = if light == Light::LEFT { -1.0 } else { 1.0 };
            bend += gain * (pull - bend);
            let length_cm = 5.0 + 0.02 * f64::from(step);
            let mut stem = vec![Point::new(0.0, 0.0)];
            for part in 0..20 {
                let (last, angle) = (stem[part], bend * (part as f64 + 0.5) / 20.0);
                stem.push(Point::new(
                    last.x + length_cm / 20.0 * math::sin(angle),
                    last.y + length_cm / 20.0 * math::cos(angle),
                ));
            }
            let seen = Observation {
                tip: stem[20],
                stem: Some(Polyline(stem)),
                depth: None,
                quality: Quality::Simulated,
            };
            Sample::of(seen, step, 300.0 * f64::from(step), Some(light))
        });
        Track { samples: samples.collect(), ..Track::default() }
    }

    #[test]
    fn few_modes_make_the_stem_again() {
        let measured = MeasuredPlants::of_tracks(&[swaying(0.02), swaying(0.03)]).unwrap();
        let modes = Modes::of_low(&measured);
        for plant in &measured.plants {
            for stem in plant.stems.iter().flatten() {
                let angles = angles(stem);
                let length_cm = stem.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
                let again = stem_of(stem[0], &modes.angles(modes.scores(&angles)), length_cm);
                for (point, wanted) in again.iter().zip(stem) {
                    assert!(point.distance(*wanted) < 0.5, "{point:?} for {wanted:?}");
                }
            }
        }
    }

    #[test]
    fn angles_do_not_jump_where_a_stem_bends_over() {
        // A circle: the angle goes on beyond half a turn.
        let stem = core::array::from_fn(|point| {
            let turn = 0.8 * point as f64;
            Point::new(-math::cos(turn), math::sin(turn))
        });
        let angles = angles(&stem);
        for pair in angles.windows(2) {
            assert!((pair[1] - pair[0] - 0.8).abs() < 1e-9, "{angles:?}");
        }
    }
}
