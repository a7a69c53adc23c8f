//! A model of the whole stem in space: as [`super::stem`], for plants that are lit from all sides and seen by two cameras.
//!
//! Each of the nine segments of a stem tilts: an angle from the vertical, towards some side. As a vector of x and z this tilt
//! has two components, and so has the light of a lamp. A plant has no side of its own: turned about the vertical, or in a
//! mirror, it answers turned or mirrored light in the same way. So one line for both components is all there is: the modes, the
//! [`TERMS`] terms and their weights are those of the plane, and each step counts twice, along x and along
//! z. That holds for any layout of 2 to 8 lamps.
//!
//! What the line does not explain, the growth, and where the tip is seen beside the end of the stem, are replayed in blocks
//! from the same plant: as they were, or turned and mirrored by one of the [symmetries](Layout::symmetries) of the lamps. A block
//! begins where this image of the plant was about as long, leant about as far to the same side, and had about as much light from
//! there. Each simulated plant is one of the measured plants, and answers the light with a gain of its own.
//!
//! Plants without a pole say nothing of contact. Among poles the stem is kept out of them after each step (see `contact.rs`), and
//! remembers the change that was left.

mod contact;

use contact::Bent;

use super::history::History;
use super::measured_plant::{
    Extent, MAX_HEIGHT_CM, MeasuredPlants, draw_plant, is_named_in, tell_of_measured_plants,
};
use super::measured_space::{Lit, PlantInSpace, SpaceStem};
use super::regression::ridge_regression;
use super::replay::{BLOCK_REACH_CM, Record, Replay};
use super::stem::{LIGHT_TERMS, MIDDLE_LENGTH_CM, MODES, PLANT_RIDGE, POOLED_RIDGE, TERMS, Windows, terms};
use super::stem_shape::{
    Errors, LENGTH_ERROR, LIKE_LIGHT_WEIGHT, Modes, OFFSET_MIN, SEGMENTS, Scores, drawn_rest, length_now,
    smooth_lengths,
};
use super::tip::ModelError;
use super::{PlantModel, evenly};
use crate::geometry::space::SpacePoint;
use crate::geometry::{Point, Polyline, STEM_POINTS};
use crate::lamps::{Lamp, Layout, Light};
use crate::math;
use crate::math::matrix::transform;
use crate::math::vector::{add, distance, dot_slices, norm, scale, sub};
use crate::observation::{Depth, Observation};
use crate::obstacle::{Pole, Solid};
use crate::random::StepNoise;
use crate::track::{Sample, Track};

/// The schema of the file.
const SCHEMA: &str = "tropism.space-model/1";

/// Something along x and along z.
type Axes<T> = [T; 2];

/// A turn about the vertical or a mirror: a matrix for (x, z).
type Image = Axes<Axes<f64>>;

/// The same place with its x and z turned or mirrored.
fn image_of(image: &Image, [x, y, z]: SpacePoint) -> SpacePoint {
    let [x, z] = transform(image, [x, z]);
    [x, y, z]
}

/// How much and from where a lamp shines on a plant: x and z of the unit vector to it from the middle of the heights. A lamp
/// right above the plant has no side.
fn direction_of(lamp: &Lamp) -> Axes<f64> {
    let [x, y, z] = lamp.at;
    let far = norm([x, y - MIDDLE_LENGTH_CM, z]);
    if far > 0.0 { [x / far, z / far] } else { [0.0; 2] }
}

/// The tilts of the segments of a stem, in radians: their angles from the vertical, towards x and towards z.
fn tilts(stem: &SpaceStem) -> Axes<[f64; SEGMENTS]> {
    let mut tilts = [[0.0; SEGMENTS]; 2];
    for segment in 0..SEGMENTS {
        let [x, y, z] = sub(stem[segment + 1], stem[segment]);
        let aside = math::hypot(x, z);
        if aside > 0.0 {
            let angle = math::atan2(aside, y);
            tilts[0][segment] = angle * x / aside;
            tilts[1][segment] = angle * z / aside;
        }
    }
    tilts
}

/// The direction of a segment that tilts by (x, z), in radians.
fn along([x, z]: Axes<f64>) -> SpacePoint {
    let angle = math::hypot(x, z);
    let (sin, cos) = math::sin_cos(angle);
    let share = if angle > 0.0 { sin / angle } else { 1.0 };
    [share * x, cos, share * z]
}

/// A stem of segments of equal length from `base` up.
fn stem_of(base: SpacePoint, tilts: &Axes<[f64; SEGMENTS]>, length_cm: f64) -> SpaceStem {
    let segment_cm = length_cm / SEGMENTS as f64;
    let mut at = base;
    core::array::from_fn(|point| {
        if point > 0 {
            at = add(at, scale(along([0, 1].map(|axis: usize| tilts[axis][point - 1])), segment_cm));
        }
        at
    })
}

/// The highest point of a stem; of equals the lowest along it.
fn top_of(stem: &SpaceStem) -> SpacePoint {
    stem.iter().copied().fold(stem[0], |top, point| if point[1] > top[1] { point } else { top })
}

/// The scores of the modes along x and z.
fn scores_of(modes: &Modes, stem: &SpaceStem) -> Axes<Scores> {
    tilts(stem).map(|tilts| modes.scores(&tilts))
}

/// The length of a stem along the direction that the modes give each segment, in cm.
fn length_of(modes: &Modes, stem: &SpaceStem) -> f64 {
    let smooth = scores_of(modes, stem).map(|scores| modes.angles(scores));
    let segment =
        |at: usize| math::vector::dot(sub(stem[at + 1], stem[at]), along([smooth[0][at], smooth[1][at]]));
    (0..SEGMENTS).map(segment).sum()
}

/// The square of the size of each score.
fn squares([x, z]: Axes<Scores>) -> Scores {
    core::array::from_fn(|mode| x[mode] * x[mode] + z[mode] * z[mode])
}

/// The scores along x, then those along z, as the memory keeps them.
fn joined(scores: Axes<Scores>) -> [f64; 2 * MODES] {
    core::array::from_fn(|at| scores[at / MODES][at % MODES])
}

/// Where [`Extent`] knows a tip: its distance from the vertical through the root, and its height.
fn aside([x, y, z]: SpacePoint) -> Point {
    Point::new(math::hypot(x, z), y)
}

/// The tip of a sample as [`Extent`] knows it.
fn aside_of(sample: &Sample) -> Point {
    aside([sample.tip.x, sample.tip.y, sample.depth.as_ref().map_or(0.0, |depth| depth.tip_cm)])
}

impl PlantInSpace {
    fn scores(&self, modes: &Modes) -> Vec<Option<Axes<Scores>>> {
        self.stems.iter().map(|stem| Some(scores_of(modes, stem.as_ref()?))).collect()
    }

    fn lengths(&self, modes: &Modes) -> Vec<Option<f64>> {
        self.stems.iter().map(|stem| Some(length_of(modes, stem.as_ref()?))).collect()
    }
}

/// The terms along x and along z.
fn terms_of(
    windows: &Windows,
    light: &History<2>,
    length_cm: f64,
    scores: Axes<Scores>,
    changes: &History<{ 2 * MODES }>,
) -> Axes<[f64; TERMS]> {
    let lights = windows.light.map(|window| light.mean(window));
    let past = windows.changes.map(|window| changes.mean(window));
    [0, 1].map(|axis: usize| {
        let past = past.map(|means| core::array::from_fn(|mode| means[axis * MODES + mode]));
        terms(lights.map(|light| light[axis]), length_cm, scores[axis], squares(scores), past)
    })
}

/// What happened in a step, as it is replayed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Happened {
    /// What the line does not explain of the change of the scores.
    residual: Axes<Scores>,
    /// Growth in length, in cm.
    growth: f64,
    /// From the highest point of the stem of the model to the tip, before and after the step, in cm.
    offsets: [SpacePoint; 2],
    /// First score before the step.
    score: Axes<f64>,
    /// Mean light of the last [`super::stem_shape::LIKE_LIGHT_MIN`] minutes.
    light: Axes<f64>,
}

/// One usable step of a plant.
struct Row {
    step: usize,
    terms: Axes<[f64; TERMS]>,
    change: Axes<Scores>,
    happened: Happened,
    length_cm: f64,
}

/// The usable steps of a plant: all that enters the terms is known, and stem and tip are measured before and after.
fn rows(
    plant: &PlantInSpace,
    modes: &Modes,
    windows: &Windows,
    directions: &[Axes<f64>],
    period_min: f64,
) -> Vec<Row> {
    let light_memory = windows.light[windows.light.len() - 1][1];
    let change_memory = windows.changes[windows.changes.len() - 1][1];
    // Steps until what is not known has left the memory.
    let (mut light_gap, mut change_gap) = (0, 0_usize);
    let (mut light, mut changes) = (History::<2>::new(), History::<{ 2 * MODES }>::new());
    let lengths = smooth_lengths(&plant.lengths(modes), period_min);
    let scores = plant.scores(modes);
    let mut rows = Vec::new();
    for step in 0..plant.tips.len().saturating_sub(1) {
        light.add(light_of(directions, plant.lights[step]));
        if plant.lights[step] == Lit::Unknown {
            light_gap = light_memory;
        }
        let change =
            scores[step].zip(scores[step + 1]).map(|(from, to)| [0, 1].map(|axis| sub(to[axis], from[axis])));
        let row = || {
            let (tip, after) = (plant.tips[step]?, plant.tips[step + 1]?);
            let (length_cm, next_length_cm) = (lengths[step]?, lengths[step + 1]?);
            let (change, scores, next) = (change?, scores[step]?, scores[step + 1]?);
            let is_usable = light_gap == 0 && change_gap == 0 && tip[1] < MAX_HEIGHT_CM;
            let offset = |tip: SpacePoint, base: SpacePoint, scores: Axes<Scores>, length_cm| {
                sub(tip, top_of(&stem_of(base, &scores.map(|scores| modes.angles(scores)), length_cm)))
            };
            let offsets = [
                offset(tip, plant.stems[step]?[0], scores, length_cm),
                offset(after, plant.stems[step + 1]?[0], next, next_length_cm),
            ];
            is_usable.then(|| Row {
                step,
                terms: terms_of(windows, &light, length_cm, scores, &changes),
                change,
                happened: Happened {
                    residual: change,
                    growth: next_length_cm - length_cm,
                    offsets,
                    score: scores.map(|scores| scores[0]),
                    light: light.mean(windows.like),
                },
                length_cm,
            })
        };
        rows.extend(row());
        changes.add(change.map_or([0.0; 2 * MODES], joined));
        change_gap = if change.is_none() { change_memory } else { change_gap.saturating_sub(1) };
        light_gap = light_gap.saturating_sub(1);
    }
    rows
}

/// The light of a step, as x and z; none in the dark and where it is not known.
fn light_of(directions: &[Axes<f64>], lit: Lit) -> Axes<f64> {
    match lit {
        Lit::Lamp(light) => directions[light.index()],
        Lit::Dark | Lit::Unknown => [0.0; 2],
    }
}

/// How one measured plant answers.
#[derive(Clone, Debug, PartialEq)]
struct Response {
    /// Weights of the change of each score, the same along x and z.
    weights: [[f64; TERMS]; MODES],
    replay: Replay<Happened>,
    /// Mean of the lowest points of its stems, in cm.
    base: SpacePoint,
}

impl Response {
    fn new(
        plant: &PlantInSpace,
        rows: Vec<Row>,
        pooled: &[[f64; TERMS]; MODES],
        scale: &[f64; TERMS],
    ) -> Self {
        let weights = weights_of(rows.iter(), pooled, &scale.map(|scale| PLANT_RIDGE * scale));
        let left = |row: &Row, axis: usize| -> Scores {
            core::array::from_fn(|mode| row.change[axis][mode] - dot_slices(&weights[mode], &row.terms[axis]))
        };
        let record = |row: Row| Record {
            step: row.step,
            size_cm: row.length_cm,
            what: Happened { residual: [left(&row, 0), left(&row, 1)], ..row.happened },
        };
        Self { weights, replay: Replay::new(rows.into_iter().map(record).collect()), base: plant.mean_base() }
    }
}

fn weights_of<'r>(
    rows: impl Iterator<Item = &'r Row> + Clone,
    prior: &[[f64; TERMS]; MODES],
    ridge: &[f64; TERMS],
) -> [[f64; TERMS]; MODES] {
    core::array::from_fn(|mode| {
        let values =
            rows.clone().flat_map(|row| [0, 1].map(|axis: usize| (&row.terms[axis], row.change[axis][mode])));
        ridge_regression(values, &prior[mode], ridge)
    })
}

/// A model of how a stem bends and grows in space, with memory and with differences between plants.
///
/// ```
/// use tropism::control::Periodic;
/// use tropism::environment::unwatched;
/// use tropism_bean::{Species, Trial};
/// use tropism::lamps::Layout;
/// use tropism::plant::space::SpaceModel;
/// use tropism::prelude::*;
/// use tropism::task::Task;
///
/// let species = Species::default();
/// let trial = Trial { layout: Layout::four_sides(), in_space: true, ..Trial::new(&species) };
/// let open_loop = Task::open_loop(150);
/// let track = trial.grow(1, &mut Periodic::new(24, &trial.layout), &open_loop, &mut unwatched);
/// let model = SpaceModel::fit([&track])?;
/// let task = Task { max_steps: 40, ..Task::space() };
/// let track = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, 1);
/// assert!(track.samples[40].observation().stem_in_space().is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceModel {
    measured: MeasuredPlants<PlantInSpace>,
    windows: Windows,
    /// Where each lamp shines from.
    directions: Vec<Axes<f64>>,
    /// Images in which records are replayed.
    images: Vec<Image>,
    modes: Modes,
    errors: Errors,
    plants: Vec<Response>,
    extent: Extent,
    /// Greatest size of each score in the data. Beyond it the plant answers as it does there.
    most_scores: Scores,
    /// Least and greatest length of the data, in cm. Beyond them the plant answers as it does there.
    lengths_cm: [f64; 2],
}

tell_of_measured_plants!(SpaceModel, SpacePoint, aside_of);

impl SpaceModel {
    /// A model of `tracks` with stems in space, below 16 cm: of their first 2500 minutes, and of plants that grow more slowly until
    /// the tip was 13.8 cm high.
    ///
    /// # Errors
    /// [`ModelError`] where no step is usable, where a track has no stem in space, or where the tracks differ in lamps or period.
    pub fn fit<'t>(tracks: impl IntoIterator<Item = &'t Track>) -> Result<Self, ModelError> {
        let measured = MeasuredPlants::of_tracks(tracks)?;
        measured.check_stems()?;
        Self::of_measured(measured)
    }

    fn of_measured(measured: MeasuredPlants<PlantInSpace>) -> Result<Self, ModelError> {
        let period_min = measured.period_min;
        let windows = Windows::of(period_min);
        let directions: Vec<Axes<f64>> = measured.layout.lamps().iter().map(direction_of).collect();
        let low_tilts: Vec<Axes<[f64; SEGMENTS]>> = low_stems(&measured).map(tilts).collect();
        let modes = Modes::of(low_tilts.iter().copied().flatten());
        let of_plants: Vec<(&PlantInSpace, Vec<Row>)> = (measured.plants.iter())
            .map(|plant| (plant, rows(plant, &modes, &windows, &directions, period_min)))
            .filter(|(_, rows)| !rows.is_empty())
            .collect();
        if of_plants.is_empty() {
            return Err(ModelError::NoShifts { tracks: measured.plants.len() });
        }
        let rows = || of_plants.iter().flat_map(|(_, rows)| rows);
        let size = |term: usize| {
            let squares = rows().flat_map(|row| row.terms.map(|terms| terms[term] * terms[term]));
            // A term that is 0 throughout gets a weight of 0, whatever its ridge.
            math::statistics::mean(squares).max(f64::MIN_POSITIVE)
        };
        let scale: [f64; TERMS] = core::array::from_fn(size);
        let pooled = weights_of(rows(), &[[0.0; TERMS]; MODES], &scale.map(|scale| POOLED_RIDGE * scale));
        let lengths_cm = math::statistics::range(rows().map(|row| row.length_cm));
        let most = |most: Scores, tilts: &Axes<[f64; SEGMENTS]>| {
            let found = squares(tilts.map(|tilts| modes.scores(&tilts)));
            core::array::from_fn(|mode| most[mode].max(found[mode].sqrt()))
        };
        let most_scores = low_tilts.iter().fold([0.0; MODES], most);
        let extent = Extent::of(measured.tips().filter(|tip| tip[1] < MAX_HEIGHT_CM).map(aside));
        let plants =
            of_plants.into_iter().map(|(plant, rows)| Response::new(plant, rows, &pooled, &scale)).collect();
        let errors = errors_of(&measured.plants, &modes);
        let images = measured.layout.symmetries();
        Ok(Self {
            windows,
            directions,
            images,
            modes,
            errors,
            plants,
            extent,
            most_scores,
            lengths_cm,
            measured,
        })
    }

    /// One model for each plant, made of its steps alone. Plants without a usable step are left out. Of more than `most`
    /// plants, as many as that are taken, evenly in their order.
    ///
    /// # Errors
    /// None that [`Self::fit`] would not have given for the same data.
    pub fn of_each_plant(&self, most: usize) -> Result<Vec<Self>, ModelError> {
        let Self { measured, modes, windows, directions, .. } = self;
        let is_usable =
            |plant: &&PlantInSpace| !rows(plant, modes, windows, directions, measured.period_min).is_empty();
        let usable: Vec<&PlantInSpace> = measured.plants.iter().filter(is_usable).collect();
        evenly(&usable, most).map(|plant| Self::of_measured(measured.alone(plant))).collect()
    }

    /// Readable JSON with all data, schema `tropism.space-model/1`; see `docs/formats.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        self.measured.to_json(SCHEMA)
    }

    /// Whether `text` calls itself a model of plants in space, of any version.
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

    /// A straight stem of measured plant number `plant` from `base` to the tip at `start`.
    fn upright(&self, (plant, gain): (usize, f64), base: SpacePoint, start: SpacePoint) -> SpaceState {
        let mut points = [base; STEM_POINTS];
        points[1..].fill(start);
        let tilt = tilts(&points).map(|tilts| tilts[0]);
        SpaceState {
            tip: start,
            base,
            scores: tilt.map(|tilt| self.modes.scores(&[tilt; SEGMENTS])),
            rest: [[0.0; SEGMENTS]; 2],
            length_cm: distance(base, start),
            light: History::new(),
            changes: History::new(),
            apart: [0.0; 3],
            record: None,
            plant,
            gain,
            poles: Vec::new(),
        }
    }

    /// Draws what happens in this step, of which the light is known already, as the image that is meant.
    fn draw(&self, plant: &mut SpaceState, noise: &mut StepNoise) -> Happened {
        let Self { measured, windows, images, plants, .. } = self;
        let (score, lit) = (plant.scores.map(|scores| scores[0]), plant.light.mean(windows.like));
        let apart = |what: &Happened, image: usize| {
            let apart = |theirs: Axes<f64>, ours| norm(sub(transform(&images[image], theirs), ours));
            apart(what.score, score) + LIKE_LIGHT_WEIGHT * apart(what.light, lit)
        };
        let replay = &plants[plant.plant].replay;
        let drawn =
            replay.next_like(plant.record, plant.length_cm, measured.period_min, images.len(), apart, noise);
        let happened = replay.records[drawn.0].what.seen_in(&images[drawn.1]);
        let goes_on = plant.record.is_some_and(|(last, image)| drawn == (last + 1, image));
        if !goes_on {
            plant.apart = sub(sub(plant.tip, top_of(&plant.stem(&self.modes))), happened.offsets[0]);
        }
        plant.record = Some(drawn);
        happened
    }
}

impl Happened {
    /// The same in a mirror, or turned.
    fn seen_in(self, image: &Image) -> Self {
        let [x, z] = self.residual;
        let pairs: [Axes<f64>; MODES] = core::array::from_fn(|mode| transform(image, [x[mode], z[mode]]));
        Self {
            residual: [0, 1].map(|axis: usize| pairs.map(|pair| pair[axis])),
            growth: self.growth,
            offsets: self.offsets.map(|offset| image_of(image, offset)),
            score: transform(image, self.score),
            light: transform(image, self.light),
        }
    }
}

/// The stems below 16 cm.
fn low_stems(measured: &MeasuredPlants<PlantInSpace>) -> impl Iterator<Item = &SpaceStem> {
    let steps = measured.plants.iter().flat_map(|plant| plant.tips.iter().zip(&plant.stems));
    let low = steps.filter(|(tip, _)| tip.is_some_and(|tip| tip[1] < MAX_HEIGHT_CM));
    low.filter_map(|(_, stem)| stem.as_ref())
}

/// The errors with which stems are measured, along x and z alike.
fn errors_of(plants: &[PlantInSpace], modes: &Modes) -> Errors {
    let scores: Vec<Vec<Option<Axes<Scores>>>> = plants.iter().map(|plant| plant.scores(modes)).collect();
    let along = |axis: usize| {
        scores.iter().map(move |scores| scores.iter().map(|scores| Some((*scores)?[axis])).collect())
    };
    let series: Vec<Vec<Option<Scores>>> = along(0).chain(along(1)).collect();
    let lengths: Vec<Vec<Option<f64>>> = plants.iter().map(|plant| plant.lengths(modes)).collect();
    Errors::of_series(&series, &lengths)
}

/// The state of one plant of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceState {
    tip: SpacePoint,
    base: SpacePoint,
    scores: Axes<Scores>,
    /// What the modes leave of the tilts, in radians: it stays as it is, but for contact.
    rest: Axes<[f64; SEGMENTS]>,
    length_cm: f64,
    /// The light of each step so far.
    light: History<2>,
    changes: History<{ 2 * MODES }>,
    /// From where the tip is replayed beside the stem to where it is, in cm.
    apart: SpacePoint,
    /// The record that is replayed, and which image of it.
    record: Option<(usize, usize)>,
    /// Which measured plant it is.
    plant: usize,
    /// Factor of the light's terms.
    gain: f64,
    /// The poles that its midline cannot pass.
    poles: Vec<Pole>,
}

impl SpaceState {
    /// The tilts of its stem without noise.
    fn bent(&self, modes: &Modes) -> Bent {
        let tilts = [0, 1].map(|axis: usize| add(modes.angles(self.scores[axis]), self.rest[axis]));
        Bent { tilts, length_cm: self.length_cm }
    }

    /// The stem without noise.
    fn stem(&self, modes: &Modes) -> SpaceStem {
        self.bent(modes).stem(self.base)
    }
}

impl PlantModel for SpaceModel {
    type Plant = SpaceState;

    /// A straight stem from the base of a measured plant to `start`, in the plane of the front camera.
    fn seedling(&self, start: Point, noise: &mut StepNoise) -> SpaceState {
        let (plant, gain, _) = draw_plant(self.plants.len(), noise);
        let image = (noise.uniform() * self.images.len() as f64) as usize;
        let base = image_of(&self.images[image], self.plants[plant].base);
        self.upright((plant, gain), base, [start.x, start.y, 0.0])
    }

    /// The stem as it was seen last, with the light and the changes of the past.
    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> SpaceState {
        let Self { measured, modes, windows, errors, directions, .. } = self;
        let last = &past[past.len() - 1];
        let steps = windows.light[4][1].max(windows.changes[3][1]).max(windows.like[1]);
        let from = past.partition_point(|sample| sample.step as usize + steps < last.step as usize);
        let seen = PlantInSpace::of_samples(&past[from..], steps);
        let tip = [last.tip.x, last.tip.y, last.depth.as_ref().map_or(0.0, |depth| depth.tip_cm)];
        let seedling = self.seedling(last.tip, noise);
        let mut plant = self.upright((seedling.plant, seedling.gain), seedling.base, tip);
        let tilts: Vec<Axes<[f64; SEGMENTS]>> = seen.stems.iter().flatten().map(tilts).collect();
        let rest = [0, 1].map(|axis: usize| {
            let rests: Vec<[f64; SEGMENTS]> = tilts.iter().map(|tilts| modes.rest(&tilts[axis])).collect();
            drawn_rest(&rests, noise)
        });
        let mut scores = seen.scores(modes);
        for scores in scores.iter_mut().flatten().flatten() {
            for (score, error) in scores.iter_mut().zip(errors.scores) {
                *score += error * noise.normal();
            }
        }
        let length_cm = length_now(&seen.lengths(modes), measured.period_min);
        let error = LENGTH_ERROR * errors.length_cm * noise.normal();
        let now = (seen.stems[seen.stems.len() - 1]).zip(scores[scores.len() - 1]).zip(length_cm);
        let Some(((stem, scores_now), length_cm)) = now else { return plant };
        plant.base = stem[0];
        plant.scores = scores_now;
        plant.rest = rest;
        plant.length_cm = length_cm + error;
        for (pair, &lit) in scores.windows(2).zip(&seen.lights) {
            plant.light.add(light_of(directions, lit));
            let change =
                pair[0].zip(pair[1]).map(|(from, to)| joined([0, 1].map(|axis| sub(to[axis], from[axis]))));
            plant.changes.add(change.unwrap_or([0.0; 2 * MODES]));
        }
        plant
    }

    /// Its stem keeps out of poles.
    fn among(&self, plant: &mut SpaceState, solids: &[Solid]) {
        plant.poles = contact::poles_among(solids, plant.base);
    }

    fn step(&self, plant: &mut SpaceState, light: Light, noise: &mut StepNoise) {
        let Self { measured, modes, windows, .. } = self;
        plant.light.add(self.directions[light.index()]);
        let happened = self.draw(plant, noise);
        let sizes = squares(plant.scores).map(f64::sqrt);
        let shares: Scores = core::array::from_fn(|mode| {
            if sizes[mode] > self.most_scores[mode] { self.most_scores[mode] / sizes[mode] } else { 1.0 }
        });
        let clamped = plant.scores.map(|scores| core::array::from_fn(|mode| shares[mode] * scores[mode]));
        let length_cm = plant.length_cm.clamp(self.lengths_cm[0], self.lengths_cm[1]);
        let terms = terms_of(windows, &plant.light, length_cm, clamped, &plant.changes);
        let weights = &self.plants[plant.plant].weights;
        let change: Axes<Scores> = [0, 1].map(|axis: usize| {
            let (of_light, others) = terms[axis].split_at(LIGHT_TERMS);
            core::array::from_fn(|mode| {
                let (light_weights, other_weights) = weights[mode].split_at(LIGHT_TERMS);
                let expected =
                    plant.gain * dot_slices(light_weights, of_light) + dot_slices(other_weights, others);
                expected + happened.residual[axis][mode]
            })
        });
        let before = (!plant.poles.is_empty()).then(|| plant.bent(modes));
        plant.scores = [0, 1].map(|axis: usize| add(plant.scores[axis], change[axis]));
        plant.length_cm += happened.growth;
        let kept_out = before.and_then(|before| {
            let tilts = contact::resolved(&plant.poles, plant.base, &before, &plant.bent(modes))?;
            let moved = [0, 1].map(|axis: usize| sub(tilts[axis], before.tilts[axis]));
            plant.scores = tilts.map(|tilts| modes.scores(&tilts));
            plant.rest = tilts.map(|tilts| modes.rest(&tilts));
            Some(moved.map(|moved| modes.scores(&moved)))
        });
        plant.changes.add(joined(kept_out.unwrap_or(change)));
        plant.apart = scale(plant.apart, math::exp(-measured.period_min / OFFSET_MIN));
        plant.tip = add(add(top_of(&plant.stem(modes)), happened.offsets[1]), plant.apart);
    }

    /// Tip and stem in space: the tip as it would be measured, the stem without noise.
    fn observe(&self, plant: &SpaceState) -> Observation {
        let stem = plant.stem(&self.modes);
        let [x, y, z] = plant.tip;
        Observation {
            stem: Some(Polyline(stem.iter().map(|point| Point::new(point[0], point[1])).collect())),
            depth: Some(Depth { tip_cm: z, stem_cm: stem.iter().map(|point| point[2]).collect() }),
            ..Observation::simulated(Point::new(x, y))
        }
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

    #[test]
    fn tilts_make_the_stem_again() {
        let wanted: SpaceStem = core::array::from_fn(|at| {
            let turn = 0.15 * at as f64;
            [math::sin(turn), 0.8 * at as f64, 1.0 - math::cos(2.0 * turn)]
        });
        // Segments of one length each.
        let mut stem = wanted;
        for at in 1..STEM_POINTS {
            let step = sub(wanted[at], wanted[at - 1]);
            stem[at] = add(stem[at - 1], scale(step, 0.7 / norm(step)));
        }
        let again = stem_of(stem[0], &tilts(&stem), 0.7 * SEGMENTS as f64);
        assert!(again.iter().zip(stem).all(|(one, other)| distance(*one, other) < 1e-12), "{again:?}");
    }
}
