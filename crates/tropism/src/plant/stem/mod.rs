//! A linear model of the whole stem, in the plane of the front camera (one axis) or in space (two axes): the tilts along the stem
//! change by the light of the last hour, by their own past and by the plant.
//!
//! Given the scores of the principal components of the tilts (`shape.rs`), the light and the past (`terms.rs`), a line says by how
//! much each score changes in a step. Its weights are those of ridge regression: of each plant, drawn to those of all plants
//! (`regression.rs`). What the line does not explain, the growth, and where the tip is seen beside the end of the stem, are a block
//! bootstrap of the residuals of one measured plant (`replay.rs`). Each simulated plant is one of the measured plants or an image
//! of it, and answers the light with a gain of its own.
//!
//! A plant has no side of its own: in a mirror it answers mirrored light in the same way, and turned about the vertical, turned
//! light. So one line for all axes is all there is, and residuals are replayed as they were or in the symmetries of the lamps. In
//! the plane there must be two lamps that are mirror images of each other; in space there may be any, near or far (`light.rs`).
//! Lamps may be lit together and at any level.
//!
//! A model of the tip alone takes for speed what is lean: a lean tip moves on as it grows. Here the lean is part of the
//! state, so a simulated plant does not run away, and its fitness is nearly that of a plant.
//!
//! Plants without a pole say nothing of contact. Among poles the stem in space is kept out of them after each step (see
//! `contact.rs`), and remembers the change that was left.

#![allow(
    clippy::needless_range_loop,
    reason = "an axis, a mode or a segment is an index into many arrays at once"
)]

mod history;
mod shape;
mod terms;
mod light;
mod regression;
mod replay;
mod measured;
mod errors;
mod body;
mod fit;
mod contact;

use self::body::{Body, Residual};
use self::contact::Bent;
use self::errors::{Errors, Past};
use self::fit::{Response, Step, Weights, changes_of, responses, rows};
use self::light::Lamps;
use self::measured::{MAX_HEIGHT_CM, MeasuredPlant, MeasuredPlants};
use self::replay::{BLOCK_REACH_CM, LIKE_LIGHT_WEIGHT};
pub use self::shape::MODES;
pub(crate) use self::shape::Place;
use self::shape::{Modes, Scores, size, tilts};
use self::terms::{TERMS, Windows, expected};
use super::config::TipModelConfig;
use super::fitted::{FittedModel, ModelError};
use super::{PlantModel, evenly};
use crate::geometry::{Point, Polyline};
use crate::lamps::{Layout, Light};
use crate::lighting::Lighting;
use crate::math::Real;
use crate::math::matrix::transform;
use crate::math::statistics::range;
use crate::math::vector::sub;
use crate::observation::{Depth, Observation};
use crate::obstacle::{Pole, Solid};
use crate::random::{NoiseStream, StepNoise};
use crate::track::{Sample, Track};

/// Gains of simulated plants, all equally likely. Between virtual beans gains differ by some 20 %.
const GAINS: [f64; 5] = [0.7, 0.85, 1.0, 1.15, 1.3];

/// A turn about the vertical or a mirror: a matrix for vectors along the axes.
type Image<const AXES: usize> = [[f64; AXES]; AXES];

/// The images in which residuals are replayed: the symmetries of the lamps, in the plane the plant and its mirror image.
fn images<const AXES: usize>(layout: &Layout) -> Vec<Image<AXES>> {
    if AXES == 1 {
        return vec![[[-1.0; AXES]; AXES], [[1.0; AXES]; AXES]];
    }
    let symmetries = layout.symmetries().into_iter();
    symmetries
        .map(|image| core::array::from_fn(|row| core::array::from_fn(|column| image[row][column])))
        .collect()
}

impl<const AXES: usize> Residual<AXES> {
    /// The same in a mirror, or turned.
    fn seen_in(mut self, image: &Image<AXES>) -> Self {
        for mode in 0..MODES {
            let turned = transform(image, self.scores.map(|scores| scores[mode]));
            self.scores.iter_mut().zip(turned).for_each(|(scores, score)| scores[mode] = score);
        }
        Self { offset: self.offset.seen_in(image), ..self }
    }
}

impl<const AXES: usize> Place<AXES> {
    /// The same in a mirror, or turned.
    fn seen_in(self, image: &Image<AXES>) -> Self {
        Self { aside: transform(image, self.aside), ..self }
    }
}

/// A model of how a stem bends and grows, with memory and with differences between plants: [`PlaneModel`] or [`SpaceModel`].
///
/// ```
/// use tropism::control::Periodic;
/// use tropism::environment::unwatched;
/// use tropism::lamps::Layout;
/// use tropism::plant::stem::{PlaneModel, SpaceModel};
/// use tropism::prelude::*;
/// use tropism::task::Task;
/// use tropism_bean::{Species, Trial};
///
/// let species = Species::default();
/// let open_loop = Task::open_loop(150);
/// let trial = Trial::new(&species);
/// let track = trial.grow(1, &mut Periodic::new(24, &trial.layout), &open_loop, &mut unwatched);
/// let model = PlaneModel::fit([&track])?;
/// let task = Task { max_steps: 40, ..Task::default() };
/// let track = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, 1);
/// assert_eq!(track.samples[40].stem.as_ref().map(|stem| stem.0.len()), Some(10));
///
/// let trial = Trial { layout: Layout::four_sides(), in_space: true, ..trial };
/// let track = trial.grow(1, &mut Periodic::new(24, &trial.layout), &open_loop, &mut unwatched);
/// let model = SpaceModel::fit([&track])?;
/// let task = Task { max_steps: 40, ..Task::space() };
/// let track = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, 1);
/// assert!(track.samples[40].observation().stem_in_space().is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct StemModel<const AXES: usize> {
    measured: MeasuredPlants<AXES>,
    windows: Windows,
    lamps: Lamps<AXES>,
    images: Vec<Image<AXES>>,
    modes: Modes,
    errors: Errors,
    plants: Vec<Response<AXES>>,
    /// Greatest distance of a tip from the vertical through the root, least and greatest height, and of the stems, in cm.
    widest_cm: f64,
    heights_cm: [f64; 2],
    lengths_cm: [f64; 2],
    /// Greatest size of each score. Beyond all data the plant answers as at their edge.
    most_scores: Scores,
}

/// The model in the plane of the front camera, under two lamps that are mirror images of each other.
pub type PlaneModel = StemModel<1>;

/// The model in space, under 2 to 16 lamps, of plants that are seen by two cameras.
pub type SpaceModel = StemModel<2>;

impl<const AXES: usize> StemModel<AXES> {
    /// A model of `tracks` with stems, below 16 cm: of their first 2500 minutes, and of plants that grow more slowly until the tip
    /// was 13.8 cm high.
    ///
    /// # Errors
    /// [`ModelError`] where no step is usable or a track has no stems, where the tracks differ in lamps or period, or where in
    /// the plane the lamps are not two mirror images.
    pub fn fit<'t>(tracks: impl IntoIterator<Item = &'t Track>) -> Result<Self, ModelError> {
        Self::of_measured(MeasuredPlants::of_tracks(tracks)?)
    }

    fn of_measured(measured: MeasuredPlants<AXES>) -> Result<Self, ModelError> {
        let windows = Windows::of(measured.period_min);
        let modes = Modes::of(measured.low_stems().flat_map(tilts));
        let plants = responses(&measured, &modes, &windows)?;
        let lengths_cm =
            range(plants.iter().flat_map(|plant| plant.replay.records.iter().map(|record| record.length_cm)));
        let low_scores: Vec<[Scores; AXES]> =
            measured.low_stems().map(|stem| modes.scores(tilts(stem))).collect();
        let size_of = |scores: &[Scores; AXES], mode: usize| size(scores.map(|scores| scores[mode]));
        let low_tips = || measured.tips().filter(|tip| tip.up < MAX_HEIGHT_CM);
        Ok(Self {
            windows,
            lamps: Lamps::of(&measured.layout),
            images: images(&measured.layout),
            errors: Errors::of(&measured.plants, &modes),
            modes,
            plants,
            widest_cm: low_tips().map(|tip| size(tip.aside)).fold(0.0, f64::max),
            heights_cm: range(low_tips().map(|tip| tip.up)),
            lengths_cm,
            most_scores: core::array::from_fn(|mode| {
                low_scores.iter().map(|scores| size_of(scores, mode)).fold(0.0, f64::max)
            }),
            measured,
        })
    }

    /// Draws what happens in this step to the plant in a lane, of which the mean light is known already: the residual after the
    /// last one, or the beginning of a block of a stem that was about as long, leant about as far to the same side, and had about
    /// as much light from there.
    fn draw<R: Real>(
        &self,
        body: &mut Body<AXES, R>,
        lane: usize,
        lit: [[R; 1]; AXES],
        seat: &mut Seat,
        noise: &mut StepNoise,
    ) {
        let lean = body.lean().map(|lean| lean.lane(lane));
        let lit = lit.map(|[lit]| lit.lane(lane));
        let unlike = |step: &Step<AXES>, image: usize| {
            let apart = |theirs, ours| size(sub(transform(&self.images[image], theirs), ours));
            apart(step.lean, lean) + LIKE_LIGHT_WEIGHT * apart(step.light, lit)
        };
        let Self { measured, images, plants, .. } = self;
        let replay = &plants[seat.plant].replay;
        let length_cm = body.length_cm.lane(lane);
        let drawn = replay.next(seat.record, length_cm, measured.period_min, images.len(), unlike, noise);
        let (step, image) = (&replay.records[drawn.0].what, &images[drawn.1]);
        let goes_on = seat.record.is_some_and(|(last, image)| drawn == (last + 1, image));
        let begun = (!goes_on).then(|| step.offset_before.seen_in(image));
        body.replay(lane, &step.residual.seen_in(image), begun);
        seat.record = Some(drawn);
    }

    /// The change of the scores in this step: what the line expects, and the residual.
    #[inline(always)]
    fn change<R: Real>(&self, body: &Body<AXES, R>, weights: &Weights<R>) -> [Scores<R>; AXES] {
        let [least, most] = self.lengths_cm.map(R::splat);
        let scores = body.scores_within(&self.most_scores);
        let terms = self.windows.terms(&body.light, body.length_cm.clamp(least, most), scores, &body.changes);
        let mut change = body.drawn.scores;
        for axis in 0..AXES {
            for mode in 0..MODES {
                change[axis][mode] += expected(&weights[mode], &terms[axis], body.gain);
            }
        }
        change
    }

    /// Whether plants are beyond all data, so that no block is like them: they lean farther, or are shorter or longer by more than
    /// blocks reach.
    #[inline(always)]
    fn is_beyond<R: Real>(&self, body: &Body<AXES, R>) -> R::Mask {
        let [least, most] = self.lengths_cm;
        size(body.lean()).gt(R::splat(self.most_scores[0]))
            | body.length_cm.lt(R::splat(least - BLOCK_REACH_CM))
            | body.length_cm.gt(R::splat(most + BLOCK_REACH_CM))
    }
}

impl<const AXES: usize> FittedModel for StemModel<AXES> {
    fn of_tracks(tracks: &[&Track], _config: &TipModelConfig) -> Result<Self, ModelError> {
        Self::fit(tracks.iter().copied())
    }

    fn from_json(text: &str) -> Result<Self, ModelError> {
        Self::of_measured(MeasuredPlants::from_json(text)?)
    }

    fn to_json(&self) -> String {
        self.measured.to_json()
    }

    fn of_virtual_plants(mut self, is_virtual: bool) -> Self {
        self.measured.is_virtual = is_virtual;
        self
    }

    fn is_virtual(&self) -> bool {
        self.measured.is_virtual
    }

    fn of_each_plant(&self, most: usize) -> Result<Vec<Self>, ModelError> {
        let Self { measured, modes, windows, .. } = self;
        let is_usable = |plant: &&MeasuredPlant<AXES>| !rows(plant, measured, modes, windows).is_empty();
        let usable: Vec<&MeasuredPlant<AXES>> = measured.plants.iter().filter(is_usable).collect();
        evenly(&usable, most).map(|plant| Self::of_measured(measured.alone(plant))).collect()
    }

    fn steps(&self) -> usize {
        self.plants.iter().map(|plant| plant.replay.records.len()).sum()
    }

    fn tips(&self) -> Vec<Point> {
        self.measured.tips().map(|tip| Point::new(tip.aside[0], tip.up)).collect()
    }

    /// Turned about the vertical, data are data.
    fn gap_cm(&self, place: Point) -> f64 {
        let folded = Point::new(place.x.abs(), place.y);
        let gap = |tip: Place<AXES>| Point::new(size(tip.aside), tip.up).distance(folded);
        self.measured.tips().map(gap).fold(f64::INFINITY, f64::min)
    }

    /// The share of steps that begin farther to a side, or by more than 1.5 cm higher or lower, than all data.
    fn share_without_data(&self, samples: &[Sample]) -> f64 {
        let [lowest, highest] = self.heights_cm;
        let is_outside = |sample: &Sample| {
            let z = sample.depth.as_ref().map_or(0.0, |depth| depth.tip_cm);
            let tip = Place::<AXES>::of([sample.tip.x, sample.tip.y, z]);
            size(tip.aside) > self.widest_cm
                || !(lowest - BLOCK_REACH_CM..=highest + BLOCK_REACH_CM).contains(&tip.up)
        };
        let lit: Vec<&Sample> = samples.iter().filter(|sample| sample.light.is_some()).collect();
        let outside = lit.iter().filter(|sample| is_outside(sample)).count();
        outside as f64 / lit.len().max(1) as f64
    }
}

/// Which measured plant a simulated one is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seat {
    plant: usize,
    /// The record that is replayed, and the image of it.
    record: Option<(usize, usize)>,
}

/// The state of one plant of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct StemState<const AXES: usize> {
    body: Body<AXES>,
    seat: Seat,
    /// The poles that its midline cannot pass.
    poles: Vec<Pole>,
}

impl<const AXES: usize> PlantModel for StemModel<AXES> {
    type Plant = StemState<AXES>;

    /// A straight stem from the base of a measured plant, or of an image of it, to `start`, in the plane of the front camera.
    fn seedling(&self, start: Point, noise: &mut StepNoise) -> StemState<AXES> {
        let mut among = |count: usize| (noise.uniform() * count as f64) as usize;
        let (plant, gain) = (among(self.plants.len()), GAINS[among(GAINS.len())]);
        let base = self.plants[plant].base.seen_in(&self.images[among(self.images.len())]);
        let start = Place::of([start.x, start.y, 0.0]);
        let body = Body::upright(&self.modes, &self.windows, gain, base, start);
        StemState { body, seat: Seat { plant, record: None }, poles: Vec::new() }
    }

    /// The stem as it was seen last, with the light and the changes of the past.
    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> StemState<AXES> {
        let Self { measured, modes, windows, errors, lamps, .. } = self;
        let mut plant = self.seedling(past[past.len() - 1].tip, noise);
        let steps = windows.oldest_light().max(windows.oldest_change());
        let setting = (&measured.layout, measured.period_min);
        let seen = Past::<AXES>::draw(past, steps, setting, (modes, errors), noise);
        if let Some(tip) = seen.tip {
            let StemState { body, .. } = &plant;
            plant.body = Body::upright(modes, windows, body.gain, body.stem[0], tip);
        }
        let Some((stem, scores, length_cm)) = seen.now() else { return plant };
        plant.body.take(modes, stem[0], scores, seen.rest, length_cm);
        for (pair, lit) in seen.scores.windows(2).zip(seen.plant.lit(lamps)) {
            plant.body.light.add(lit.unwrap_or([[0.0]; AXES]));
            let change = pair[0].zip(pair[1]).map(|(from, to)| changes_of(&from, &to));
            plant.body.changes.add(change.unwrap_or([[0.0; MODES]; AXES]));
        }
        plant
    }

    /// In space its stem keeps out of poles.
    fn among(&self, plant: &mut StemState<AXES>, solids: &[Solid]) {
        plant.poles = contact::poles_among(solids, plant.body.stem[0]);
    }

    fn step(&self, plant: &mut StemState<AXES>, light: Light, noise: &mut StepNoise) {
        self.shine(plant, light.into(), noise);
    }

    fn shine(&self, plant: &mut StemState<AXES>, lighting: Lighting, noise: &mut StepNoise) {
        let Self { measured, modes, windows, lamps, .. } = self;
        let StemState { body, seat, poles } = plant;
        body.light.add(lamps.light(lighting, body.tip));
        self.draw(body, 0, body.light.mean(windows.like), seat, noise);
        let mut change = self.change(body, &self.plants[seat.plant].weights);
        let before = Bent { tilts: body.tilts(modes), length_cm: body.length_cm };
        body.bend(&change);
        let wanted = Bent { tilts: body.tilts(modes), length_cm: body.length_cm };
        if let Some(tilts) = contact::resolved(poles, body.stem[0], &before, &wanted) {
            (body.scores, body.rest) = (modes.scores(tilts), modes.rest(tilts));
            change = modes.scores(core::array::from_fn(|axis| sub(tilts[axis], before.tilts[axis])));
        }
        body.settle(change, modes, measured.period_min);
    }

    fn knows_levels(&self) -> bool {
        true
    }

    /// The tip as it would be measured, and the stem without noise.
    fn observe(&self, plant: &StemState<AXES>) -> Observation {
        let Body { tip, stem, .. } = &plant.body;
        let front = |place: &Place<AXES>| Point::new(place.aside[0], place.up);
        let depth = |place: &Place<AXES>| place.in_space()[2];
        Observation {
            stem: Some(Polyline(stem.iter().map(front).collect())),
            depth: (AXES == 2)
                .then(|| Depth { tip_cm: depth(tip), stem_cm: stem.iter().map(depth).collect() }),
            ..Observation::simulated(front(tip))
        }
    }

    fn is_beyond_data(&self, plant: &StemState<AXES>) -> bool {
        self.is_beyond(&plant.body)
    }

    fn layout(&self) -> &Layout {
        &self.measured.layout
    }

    fn period_min(&self) -> f64 {
        self.measured.period_min
    }
}

/// Plants of a model side by side, one in each lane of a number: the steps of [`PlantModel`], with the same bits.
pub(crate) struct Stems<'m, const AXES: usize, R> {
    model: &'m StemModel<AXES>,
    pub(crate) body: Body<AXES, R>,
    weights: Weights<R>,
    seats: Vec<Seat>,
    noises: Vec<(NoiseStream, u32)>,
}

impl<'m, const AXES: usize, R: Real> Stems<'m, AXES, R> {
    /// Lanes for plants of `model`, all of them with the same one, whose tip is at `start`.
    pub(crate) fn new(model: &'m StemModel<AXES>, start: Point, noise: NoiseStream) -> Self {
        let start = Place::of([start.x, start.y, 0.0]);
        let body = Body::upright(&model.modes, &model.windows, 1.0, model.plants[0].base, start);
        let mut stems = Self {
            model,
            body,
            weights: [[R::splat(0.0); TERMS]; MODES],
            seats: vec![Seat { plant: 0, record: None }; R::LANES],
            noises: vec![(noise, 0); R::LANES],
        };
        (0..R::LANES).for_each(|lane| stems.refill(lane, Point::new(start.aside[0], start.up), noise));
        stems
    }

    /// Puts a seedling with its tip at `start` into a lane.
    pub(crate) fn refill(&mut self, lane: usize, start: Point, noise: NoiseStream) {
        let seedling = self.model.seedling(start, &mut noise.of_seedling());
        self.body.refill(lane, &seedling.body);
        let weights = self.model.plants[seedling.seat.plant].weights.as_flattened();
        let rows = self.weights.as_flattened_mut().iter_mut();
        rows.zip(weights).for_each(|(row, weight)| row.set_lane(lane, *weight));
        (self.seats[lane], self.noises[lane]) = (seedling.seat, (noise, 0));
    }

    /// One step of each plant under light along the axes.
    #[inline(always)]
    pub(crate) fn step(&mut self, light: [[R; 1]; AXES]) {
        let Self { model, body, weights, seats, noises } = self;
        body.light.add(light);
        let lit = body.light.mean(model.windows.like);
        for (lane, (seat, (noise, step))) in seats.iter_mut().zip(noises).enumerate() {
            model.draw(body, lane, lit, seat, &mut noise.at(*step));
            *step = step.wrapping_add(1);
        }
        let change = model.change(body, weights);
        body.bend(&change);
        body.settle(change, &model.modes, model.measured.period_min);
    }

    /// Whether each plant is beyond all data of the model.
    #[inline(always)]
    pub(crate) fn is_beyond_data(&self) -> R::Mask {
        self.model.is_beyond(&self.body)
    }
}

#[cfg(test)]
mod tests {
    use super::shape::stem_of;
    use super::*;
    use crate::math::{cos, hypot, sin};
    use crate::observation::Quality;

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
                let step_cm = length_cm / 20.0;
                stem.push(Point::new(last.x + step_cm * sin(angle), last.y + step_cm * cos(angle)));
            }
            let (tip, quality) = (stem[20], Quality::Simulated);
            let seen = Observation { tip, stem: Some(Polyline(stem)), depth: None, quality };
            Sample::of(seen, step, 300.0 * f64::from(step), Some(light))
        });
        Track { samples: samples.collect(), ..Track::default() }
    }

    #[test]
    fn few_components_make_the_stem_again() {
        let measured = MeasuredPlants::<1>::of_tracks(&[swaying(0.02), swaying(0.03)]).unwrap();
        let modes = Modes::of(measured.low_stems().flat_map(tilts));
        for stem in measured.plants.iter().flat_map(|plant| plant.stems.iter().flatten()) {
            let again = stem_of(stem[0], modes.tilts(modes.scores(tilts(stem))), modes.length_cm(stem));
            for (point, wanted) in again.iter().zip(stem) {
                let Place { aside: [x], up } = *point - *wanted;
                assert!(hypot(x, up) < 0.5, "{point:?} for {wanted:?}");
            }
        }
    }
}
