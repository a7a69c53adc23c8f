//! What was observed of plants: the data of the model, and its file.

use serde::{Deserialize, Serialize};

use super::super::fitted::{ModelError, shared_layout_and_period};
use super::light::Lamps;
use super::shape::{Modes, Place, Scores, Stem, tilts};
use crate::check::ensure;
use crate::file::schema_of;
use crate::geometry::STEM_POINTS;
use crate::geometry::path::{length, resampled};
use crate::geometry::space::SpacePoint;
use crate::lamps::Layout;
use crate::lighting::{FULL, Lighting};
use crate::math::statistics::mean;
use crate::observation::{Observation, Quality};
use crate::track::{SAME_PERIOD, Sample, Track};

/// Longest step, in minutes: with longer ones two windows of the light are the same step.
const MAX_PERIOD_MIN: f64 = 10.0;

/// How much of each track is used at least, in minutes: 500 steps of five minutes. At 0.03 cm a step, eq. (4), a plant is taller
/// than the paper's highest target by then.
const USED_MIN: f64 = 2500.0;

/// Height of the tip until which a track is used in any case, in cm: a slow species gets there later. The paper's experiments end
/// there (section 2.2.3).
const USED_HEIGHT_CM: f64 = 13.8;

/// Steps that begin at this height or above are left out, in cm. Chosen: the paper's experiments end at 13.8 cm.
pub(super) const MAX_HEIGHT_CM: f64 = 16.0;

/// Coordinates beyond this are no plant. Chosen, as in the tip model.
const FARTHEST_CM: f64 = 1000.0;

/// What was observed of one plant, step by step from its first observation: as the front camera sees it, or in space.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeasuredPlant<const AXES: usize> {
    /// The tip at each step; `None` where it was not measured.
    pub(super) tips: Vec<Option<Place<AXES>>>,
    /// The stem at each step; `None` where none was seen.
    pub(super) stems: Vec<Option<Stem<AXES>>>,
    /// How the lamps that steer were lit from each step to the next; `None` where it is not known.
    pub(super) lightings: Vec<Option<Lighting>>,
}

/// The tip of an observation; `None` where it is not known on all axes.
pub(super) fn tip_of<const AXES: usize>(seen: &Observation) -> Option<Place<AXES>> {
    let in_front = [seen.tip.x, seen.tip.y, 0.0];
    Some(Place::of(if AXES == 1 { in_front } else { seen.tip_in_space()? }))
}

/// Ten points of the stem of an observation; `None` without a stem that has a length and is known on all axes.
fn stem_of<const AXES: usize>(seen: &Observation) -> Option<Stem<AXES>> {
    let points: Vec<SpacePoint> = if AXES == 1 {
        seen.stem.as_ref()?.0.iter().map(|point| [point.x, point.y, 0.0]).collect()
    } else {
        seen.stem_in_space()?
    };
    let points = (length(&points) > 0.0).then(|| resampled(&points, STEM_POINTS))?;
    let points: [SpacePoint; STEM_POINTS] = points.try_into().ok()?;
    Some(points.map(Place::of))
}

impl<const AXES: usize> MeasuredPlant<AXES> {
    /// The first `steps` steps of `samples`, under the lamps of `layout`.
    pub(super) fn of_samples(samples: &[Sample], layout: &Layout, steps: usize) -> Self {
        let mut plant = Self { tips: Vec::new(), stems: Vec::new(), lightings: Vec::new() };
        let steering = layout.steering().fold(Lighting::DARK, |lamps, light| lamps.with(light, FULL));
        let first = samples.first().map_or(0, |sample| sample.step);
        for sample in samples {
            let step = sample.step.wrapping_sub(first) as usize;
            if step > steps {
                break;
            }
            plant.tips.resize(step + 1, None);
            plant.stems.resize(step + 1, None);
            plant.lightings.resize(step + 1, None);
            plant.lightings[step] = Some(sample.lighting().zip(steering, u8::min));
            if sample.quality != Quality::CarriedForward {
                let seen = sample.observation();
                plant.tips[step] = tip_of(&seen);
                plant.stems[step] = stem_of(&seen);
            }
        }
        plant
    }

    /// The steps of `track` that models use.
    fn of_track(track: &Track) -> Self {
        let first = track.samples.first().map_or(0, |sample| sample.step);
        let is_high =
            |sample: &&Sample| sample.quality != Quality::CarriedForward && sample.tip.y >= USED_HEIGHT_CM;
        let high = track.samples.iter().find(is_high);
        let risen = high.map_or(usize::MAX, |sample| sample.step.wrapping_sub(first) as usize);
        Self::of_samples(
            &track.samples,
            &track.layout,
            risen.max((USED_MIN / track.period_min).ceil() as usize),
        )
    }

    /// Mean of the lowest points of the stems.
    pub(super) fn mean_base(&self) -> Place<AXES> {
        let along =
            |of: &dyn Fn(Place<AXES>) -> f64| mean(self.stems.iter().flatten().map(|stem| of(stem[0])));
        let aside = core::array::from_fn(|axis| along(&|base| base.aside[axis]));
        Place { aside, up: along(&|base| base.up) }
    }

    /// The light from each step to the next, `None` where it is not known: on the tip where it is then or was last measured.
    pub(super) fn lit(&self, lamps: &Lamps<AXES>) -> impl Iterator<Item = Option<[[f64; 1]; AXES]>> {
        let mut tip = self.tips.iter().flatten().next().copied().unwrap_or(Place::of([0.0; 3]));
        self.tips.iter().zip(&self.lightings).map(move |(seen, lighting)| {
            tip = seen.unwrap_or(tip);
            Some(lamps.light((*lighting)?, tip))
        })
    }

    /// The scores of each stem; `None` without a stem.
    pub(super) fn scores(&self, modes: &Modes) -> Vec<Option<[Scores; AXES]>> {
        self.stems.iter().map(|stem| Some(modes.scores(tilts(stem.as_ref()?)))).collect()
    }

    /// The length of each stem, in cm; `None` without a stem.
    pub(super) fn lengths(&self, modes: &Modes) -> Vec<Option<f64>> {
        self.stems.iter().map(|stem| Some(modes.length_cm(stem.as_ref()?))).collect()
    }

    /// Checks coordinates; the plant is number `index`, from 0.
    fn check(&self, index: usize) -> Result<(), ModelError> {
        let is_far = |place: &&Place<AXES>| {
            !place.aside.iter().chain([&place.up]).all(|coordinate| coordinate.abs() <= FARTHEST_CM)
        };
        let places = self.tips.iter().flatten().chain(self.stems.iter().flatten().flatten());
        if let Some(place) = places.into_iter().find(is_far) {
            return Err(ModelError::Shift { index, found: format!("{:?}", place.in_space()) });
        }
        Ok(())
    }

    fn entry(&self, layout: &Layout) -> FilePlant {
        let point = |place: &Place<AXES>| place.in_space()[..=AXES].to_vec();
        let word = |lighting: &Option<Lighting>| lighting.map(|lighting| lighting.word(layout));
        FilePlant {
            tip: self.tips.iter().map(|tip| tip.as_ref().map(point)).collect(),
            stem: self
                .stems
                .iter()
                .map(|stem| stem.as_ref().map(|stem| stem.iter().map(point).collect()))
                .collect(),
            light: self.lightings.iter().map(word).collect(),
        }
    }

    /// The plant of an entry, which is number `index`, from 0.
    fn of_entry(entry: FilePlant, index: usize, layout: &Layout) -> Result<Self, ModelError> {
        let FilePlant { tip, stem, light } = entry;
        let lengths = [tip.len(), stem.len(), light.len()];
        if lengths.iter().any(|&length| length != lengths[0]) {
            return Err(ModelError::Lengths { found: format!("{lengths:?}") });
        }
        let refused = |found: String| ModelError::Shift { index, found };
        let place = |point: Vec<f64>| match *point.as_slice() {
            [x, y] if AXES == 1 => Ok(Place::of([x, y, 0.0])),
            [x, y, z] if AXES == 2 => Ok(Place::of([x, y, z])),
            _ => Err(refused(format!("{} coordinates of a point", point.len()))),
        };
        let of_points = |points: Vec<Vec<f64>>| -> Result<Stem<AXES>, ModelError> {
            let points = points.into_iter().map(place).collect::<Result<Vec<_>, _>>()?;
            points.try_into().map_err(|points: Vec<_>| refused(format!("a stem of {} points", points.len())))
        };
        let lighting =
            |word: String| Lighting::parse(&word, layout).map_err(|error| refused(error.to_string()));
        let lightings = light.into_iter().map(|word| word.map(lighting).transpose());
        let tips = tip.into_iter().map(|tip| tip.map(place).transpose()).collect::<Result<_, _>>()?;
        let stems =
            stem.into_iter().map(|points| points.map(of_points).transpose()).collect::<Result<_, _>>()?;
        Ok(Self { tips, stems, lightings: lightings.collect::<Result<_, _>>()? })
    }
}

/// Plants under the same lamps, observed at the same period.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeasuredPlants<const AXES: usize> {
    pub(super) layout: Layout,
    pub(super) period_min: f64,
    pub(super) is_virtual: bool,
    pub(super) plants: Vec<MeasuredPlant<AXES>>,
}

/// The schema of the file.
pub(super) const SCHEMA: &str = "tropism.stem-model/3";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    /// 1 in the plane of the front camera, 2 in space.
    axes: usize,
    layout: Layout,
    period_min: f64,
    is_virtual: bool,
    plants: Vec<FilePlant>,
}

/// One entry a step from the first observation of a plant. Points are x and y, in space also z, in cm.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePlant {
    /// Tip; null where it was not measured.
    tip: Vec<Option<Vec<f64>>>,
    /// Ten points of the stem from the base up; null where none was seen.
    stem: Vec<Option<Vec<Vec<f64>>>>,
    /// How the lamps were lit to the next step, as a track says it; null where it is not known.
    light: Vec<Option<String>>,
}

impl<const AXES: usize> MeasuredPlants<AXES> {
    /// The plants of `tracks`.
    ///
    /// # Errors
    /// [`ModelError`] where the tracks differ in lamps or period, where one has no stem, or [`check`](Self::check) refuses them.
    pub(super) fn of_tracks<'t>(tracks: impl IntoIterator<Item = &'t Track>) -> Result<Self, ModelError> {
        let tracks: Vec<&Track> = tracks.into_iter().collect();
        let (layout, period_min) = shared_layout_and_period(&tracks)?;
        let plants = tracks.into_iter().map(MeasuredPlant::of_track).collect();
        let measured = Self { layout, period_min, is_virtual: false, plants };
        measured.check()?;
        let has_no_stem = |plant: &MeasuredPlant<AXES>| plant.stems.iter().all(Option::is_none);
        match measured.plants.iter().position(has_no_stem) {
            Some(index) if AXES == 1 => Err(ModelError::NoStem { track: index + 1 }),
            Some(index) => Err(ModelError::NoDepth { track: index + 1 }),
            None => Ok(measured),
        }
    }

    /// Checks the lamps, the period and the plants. In the plane a lamp is known by its side: there must be two that are mirror
    /// images of each other. In space each lamp has its direction.
    fn check(&self) -> Result<(), ModelError> {
        let Self { layout, period_min, plants, .. } = self;
        let mut sides: Vec<f64> = layout.steering().map(|light| layout.side(light)).collect();
        sides.sort_by(f64::total_cmp);
        if AXES == 1 && !(sides == [-1.0, 1.0] && layout.is_symmetric()) {
            let names: Vec<&str> = layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect();
            return Err(ModelError::Sides { found: names.join(", ") });
        }
        let is_period = *period_min > 0.0 && period_min.is_finite();
        ensure(is_period, "period_min", *period_min, "minutes above 0")?;
        if *period_min > MAX_PERIOD_MIN * (1.0 + SAME_PERIOD) {
            return Err(ModelError::Slow { found: *period_min, most: MAX_PERIOD_MIN });
        }
        plants.iter().enumerate().try_for_each(|(index, plant)| plant.check(index))
    }

    /// The measured tips.
    pub(super) fn tips(&self) -> impl Iterator<Item = Place<AXES>> {
        self.plants.iter().flat_map(|plant| plant.tips.iter().flatten().copied())
    }

    /// The stems whose tip is below 16 cm.
    pub(super) fn low_stems(&self) -> impl Iterator<Item = &Stem<AXES>> {
        let steps = self.plants.iter().flat_map(|plant| plant.tips.iter().zip(&plant.stems));
        let low = steps.filter(|(tip, _)| tip.is_some_and(|tip| tip.up < MAX_HEIGHT_CM));
        low.filter_map(|(_, stem)| stem.as_ref())
    }

    /// The same lamps and period with one plant alone.
    pub(super) fn alone(&self, plant: &MeasuredPlant<AXES>) -> Self {
        Self { plants: vec![plant.clone()], layout: self.layout.clone(), ..*self }
    }

    pub(super) fn to_json(&self) -> String {
        let file = File {
            schema: SCHEMA.to_owned(),
            axes: AXES,
            layout: self.layout.clone(),
            period_min: self.period_min,
            is_virtual: self.is_virtual,
            plants: self.plants.iter().map(|plant| plant.entry(&self.layout)).collect(),
        };
        serde_json::to_string(&file).expect("numbers and text are JSON")
    }

    /// Reads [`Self::to_json`].
    pub(super) fn from_json(text: &str) -> Result<Self, ModelError> {
        let schema = schema_of(text)?;
        if schema != SCHEMA {
            return Err(ModelError::Schema { found: schema, wanted: SCHEMA });
        }
        let File { axes, layout, period_min, is_virtual, plants, .. } = serde_json::from_str(text)?;
        if axes != AXES {
            return Err(ModelError::Axes { found: axes, wanted: AXES });
        }
        let plants = plants.into_iter().enumerate();
        let plants = plants.map(|(index, plant)| MeasuredPlant::of_entry(plant, index, &layout));
        let plants = plants.collect::<Result<_, _>>()?;
        let measured = Self { layout, period_min, is_virtual, plants };
        measured.check()?;
        Ok(measured)
    }
}
