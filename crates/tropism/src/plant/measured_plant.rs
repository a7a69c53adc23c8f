//! What was observed of plants, as the models with memory keep it in their files.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::tip::{ModelError, shared_layout_and_period};
use crate::check::ensure;
use crate::file::schema_of;
use crate::geometry::{Point, STEM_POINTS};
use crate::lamps::Layout;
use crate::observation::Quality;
use crate::random::StepNoise;
use crate::track::{SAME_PERIOD, Sample, Track};

/// Longest step of a model with memory, in minutes: with longer ones two windows of the light are the same step.
const MAX_PERIOD_MIN: f64 = 10.0;

/// How much of each track is used at least, in minutes: 500 steps of five minutes. At 0.03 cm a step, eq. (4), a plant is taller
/// than the paper's highest target by then.
const USED_MIN: f64 = 2500.0;

/// Height of the tip until which a track is used in any case, in cm: a slow species gets there later. The paper's experiments end
/// there (section 2.2.3).
const USED_HEIGHT_CM: f64 = 13.8;

/// Number of the last step of `track` that models use, from its first.
pub(super) fn used_steps(track: &Track) -> usize {
    let first = track.samples.first().map_or(0, |sample| sample.step);
    let is_high = |sample: &&Sample| sample.quality != Quality::Held && sample.tip.y >= USED_HEIGHT_CM;
    let high = track.samples.iter().find(is_high);
    let risen = high.map_or(usize::MAX, |sample| sample.step.wrapping_sub(first) as usize);
    risen.max((USED_MIN / track.period_min).ceil() as usize)
}

/// Steps that begin at this height or above are left out, in cm. The paper's experiments end at 13.8 cm.
pub(super) const MAX_HEIGHT_CM: f64 = 16.0;

/// Gains of simulated plants, all equally likely. Between virtual beans gains differ by some 20 %.
const GAINS: [f64; 5] = [0.7, 0.85, 1.0, 1.15, 1.3];

/// Which of the measured plants a simulated one is: its number of `count`, its own gain of the light, and -1 if it is the mirror
/// image of that plant, else 1.
pub(super) fn draw_plant(count: usize, noise: &mut StepNoise) -> (usize, f64, f64) {
    let mut among = |count: usize| (noise.uniform() * count as f64) as usize;
    (among(count), GAINS[among(GAINS.len())], [1.0, -1.0][among(2)])
}

/// Coordinates beyond this are no plant.
const FARTHEST_CM: f64 = 1000.0;

/// What was observed of one plant, in the plane of the front camera or in space.
pub(super) trait PlantRecord: Clone {
    /// Where a tip is, in cm.
    type Place: Copy;

    /// The plant as it stands in a file.
    type Entry: Serialize + DeserializeOwned;

    /// The steps of `track` that models use.
    fn of_track(track: &Track) -> Self;

    /// The tip at each step; `None` where it was not measured.
    fn tips(&self) -> &[Option<Self::Place>];

    /// Whether a stem was seen at any step.
    fn has_stem(&self) -> bool;

    /// The error where the track of this number, from 1, has no stem.
    fn no_stem(track: usize) -> ModelError;

    /// Checks that models can use the lamps of `layout`.
    fn check_layout(layout: &Layout) -> Result<(), ModelError>;

    /// Checks coordinates and lights; the plant is number `index`, from 0.
    fn check(&self, index: usize, layout: &Layout) -> Result<(), ModelError>;

    fn entry(&self) -> Self::Entry;

    /// The plant of an entry, which is number `index`, from 0.
    fn of_entry(entry: Self::Entry, index: usize) -> Result<Self, ModelError>;
}

/// Checks that no place of plant number `index`, from 0, is too far away for a plant.
pub(super) fn check_places<const AXES: usize>(
    mut places: impl Iterator<Item = [f64; AXES]>,
    index: usize,
) -> Result<(), ModelError> {
    let is_far = |place: &[f64; AXES]| !place.iter().all(|axis| axis.abs() <= FARTHEST_CM);
    match places.find(is_far) {
        Some(place) => Err(ModelError::Shift { index, found: format!("{place:?}") }),
        None => Ok(()),
    }
}

/// A stem from the base up, in cm.
pub(super) type Stem = [Point; STEM_POINTS];

/// What was observed of one plant, step by step from its first observation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeasuredPlant {
    /// The tip at each step, in cm; `None` where it was not measured.
    pub(super) tips: Vec<Option<Point>>,
    /// The stem at each step; `None` where none was seen.
    pub(super) stems: Vec<Option<Stem>>,
    /// The side of the lamp that was lit from each step to the next: -1, 1, or 0 in the dark; `None` where it is not known.
    pub(super) sides: Vec<Option<f64>>,
}

impl MeasuredPlant {
    /// The first `steps` steps of `samples` under the lamps of `layout`.
    pub(super) fn of_samples(samples: &[Sample], layout: &Layout, steps: usize) -> Self {
        let mut data = Self { tips: Vec::new(), stems: Vec::new(), sides: Vec::new() };
        let first = samples.first().map_or(0, |sample| sample.step);
        for sample in samples {
            let step = sample.step.wrapping_sub(first) as usize;
            if step > steps {
                break;
            }
            data.tips.resize(step + 1, None);
            data.stems.resize(step + 1, None);
            data.sides.resize(step + 1, None);
            let is_measured = sample.quality != Quality::Held;
            data.tips[step] = is_measured.then_some(sample.tip);
            data.stems[step] = sample.observation().ten_points().filter(|_| is_measured);
            data.sides[step] = Some(sample.light.map_or(0.0, |light| layout.side(light)));
        }
        data
    }

    /// Mean of the lowest points of the stems, in cm.
    pub(super) fn mean_base(&self) -> Point {
        let mean = |axis: fn(Point) -> f64| {
            crate::math::statistics::mean(self.stems.iter().flatten().map(|stem| axis(stem[0])))
        };
        Point::new(mean(|base| base.x), mean(|base| base.y))
    }
}

impl PlantRecord for MeasuredPlant {
    type Place = Point;
    type Entry = FilePlant;

    fn of_track(track: &Track) -> Self {
        Self::of_samples(&track.samples, &track.layout, used_steps(track))
    }

    fn tips(&self) -> &[Option<Point>] {
        &self.tips
    }

    fn has_stem(&self) -> bool {
        self.stems.iter().any(Option::is_some)
    }

    fn no_stem(track: usize) -> ModelError {
        ModelError::NoStem { track }
    }

    /// Two lamps that are mirror images of each other.
    fn check_layout(layout: &Layout) -> Result<(), ModelError> {
        let mut sides: Vec<f64> = layout.lights().map(|light| layout.side(light)).collect();
        sides.sort_by(f64::total_cmp);
        if sides == [-1.0, 1.0] && layout.is_symmetric() {
            return Ok(());
        }
        let names: Vec<&str> = layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect();
        Err(ModelError::Sides { found: names.join(", ") })
    }

    fn check(&self, index: usize, _layout: &Layout) -> Result<(), ModelError> {
        let points = self.tips.iter().flatten().chain(self.stems.iter().flatten().flatten());
        check_places(points.map(|point| [point.x, point.y]), index)
    }

    fn entry(&self) -> FilePlant {
        let letter = |side: &Option<f64>| match side {
            None => '?',
            Some(side) if *side > 0.0 => 'r',
            Some(side) if *side < 0.0 => 'l',
            Some(_) => 'd',
        };
        let stem = |stem: &Option<Stem>| stem.map(|stem| stem.map(|point| [point.x, point.y]));
        FilePlant {
            x: self.tips.iter().map(|tip| tip.map(|tip| tip.x)).collect(),
            y: self.tips.iter().map(|tip| tip.map(|tip| tip.y)).collect(),
            stem: if self.has_stem() { self.stems.iter().map(stem).collect() } else { Vec::new() },
            light: self.sides.iter().map(letter).collect(),
        }
    }

    fn of_entry(entry: FilePlant, index: usize) -> Result<Self, ModelError> {
        let FilePlant { x, y, stem, light } = entry;
        let steps = x.len();
        let stems = if stem.is_empty() { steps } else { stem.len() };
        let lengths = [steps, y.len(), stems, light.len()];
        if lengths.iter().any(|&length| length != steps) {
            return Err(ModelError::Lengths { found: format!("{lengths:?}") });
        }
        let side = |letter| match letter {
            'r' => Ok(Some(1.0)),
            'l' => Ok(Some(-1.0)),
            'd' => Ok(Some(0.0)),
            '?' => Ok(None),
            _ => Err(ModelError::Shift { index, found: format!("light {letter:?}") }),
        };
        let tips = x.iter().zip(&y).map(|(x, y)| Some(Point::new((*x)?, (*y)?))).collect();
        let points = |stem: [[f64; 2]; STEM_POINTS]| stem.map(|[x, y]| Point::new(x, y));
        let mut stems: Vec<Option<Stem>> = stem.into_iter().map(|stem| stem.map(points)).collect();
        stems.resize(steps, None);
        Ok(Self { tips, stems, sides: light.chars().map(side).collect::<Result<_, _>>()? })
    }
}

/// Plants under the same lamps, observed at the same period.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeasuredPlants<P = MeasuredPlant> {
    pub(super) layout: Layout,
    pub(super) period_min: f64,
    pub(super) is_virtual: bool,
    pub(super) plants: Vec<P>,
}

impl<P: PlantRecord> MeasuredPlants<P> {
    /// The plants of `tracks`.
    ///
    /// # Errors
    /// [`ModelError`] where the tracks differ in lamps or period, or [`check`](Self::check) refuses them.
    pub(super) fn of_tracks<'t>(tracks: impl IntoIterator<Item = &'t Track>) -> Result<Self, ModelError> {
        let tracks: Vec<&Track> = tracks.into_iter().collect();
        let (layout, period_min) = shared_layout_and_period(&tracks)?;
        let plants = tracks.into_iter().map(P::of_track).collect();
        let measured = Self { layout, period_min, is_virtual: false, plants };
        measured.check()?;
        Ok(measured)
    }

    /// Checks the lamps, the period and the plants.
    fn check(&self) -> Result<(), ModelError> {
        let Self { layout, period_min, plants, .. } = self;
        P::check_layout(layout)?;
        let is_period = *period_min > 0.0 && period_min.is_finite();
        ensure(is_period, "period_min", *period_min, "minutes above 0")?;
        if *period_min > MAX_PERIOD_MIN * (1.0 + SAME_PERIOD) {
            return Err(ModelError::Slow { found: *period_min, most: MAX_PERIOD_MIN });
        }
        plants.iter().enumerate().try_for_each(|(index, plant)| plant.check(index, layout))
    }

    /// Checks that each plant has stems.
    pub(super) fn check_stems(&self) -> Result<(), ModelError> {
        match self.plants.iter().position(|plant| !plant.has_stem()) {
            Some(index) => Err(P::no_stem(index + 1)),
            None => Ok(()),
        }
    }

    /// The measured tips, in cm.
    pub(super) fn tips(&self) -> impl Iterator<Item = P::Place> {
        self.plants.iter().flat_map(|plant| plant.tips().iter().flatten().copied())
    }

    /// The same lamps and period with one plant alone.
    pub(super) fn alone(&self, plant: &P) -> Self {
        Self { plants: vec![plant.clone()], layout: self.layout.clone(), ..*self }
    }

    /// JSON of this `schema`.
    pub(super) fn to_json(&self, schema: &str) -> String {
        let file = File {
            schema: schema.to_owned(),
            layout: self.layout.clone(),
            period_min: self.period_min,
            is_virtual: self.is_virtual,
            plants: self.plants.iter().map(P::entry).collect(),
        };
        serde_json::to_string(&file).expect("numbers and text are JSON")
    }

    /// Reads [`Self::to_json`] of the same schema.
    pub(super) fn from_json(text: &str, wanted: &'static str) -> Result<Self, ModelError> {
        let schema = schema_of(text)?;
        if schema != wanted {
            return Err(ModelError::Schema { found: schema, wanted });
        }
        let File { layout, period_min, is_virtual, plants, .. } = serde_json::from_str(text)?;
        let plants = plants.into_iter().enumerate();
        let plants = plants.map(|(index, plant)| P::of_entry(plant, index)).collect::<Result<_, _>>()?;
        let measured = Self { layout, period_min, is_virtual, plants };
        measured.check()?;
        Ok(measured)
    }
}

/// What models of measured plants tell of their data alike: a model has the fields `measured`, `plants` and `extent`. `$place`
/// is the type of a measured tip, `$seen` where [`Extent`] knows the tip of a sample.
macro_rules! tell_of_measured_plants {
    ($model:ident, $place:ty, $seen:expr) => {
        impl $model {
            /// The same model, labelled as made of virtual plants or not. Results of evolution carry the label.
            #[must_use]
            pub const fn of_virtual_plants(mut self, is_virtual: bool) -> Self {
                self.measured.is_virtual = is_virtual;
                self
            }

            /// Whether it was made of virtual plants.
            #[must_use]
            pub const fn is_virtual(&self) -> bool {
                self.measured.is_virtual
            }

            /// How many measured steps are replayed, without their mirror images.
            #[must_use]
            pub fn steps(&self) -> usize {
                self.plants.iter().map(|plant| plant.replay.records.len()).sum()
            }

            /// The measured tips that it is made of, in cm.
            pub fn tips(&self) -> impl Iterator<Item = $place> {
                self.measured.tips()
            }

            /// The share of the lit steps of a track, 0 to 1, that begin farther to a side, higher or lower than all data.
            #[must_use]
            pub fn share_without_data(&self, samples: &[Sample]) -> f64 {
                self.extent.share_outside(samples, BLOCK_REACH_CM, $seen)
            }
        }
    };
}
pub(super) use tell_of_measured_plants;

/// Whether `text` calls itself a file of `schema`, of any version.
pub(super) fn is_named_in(text: &str, schema: &str) -> bool {
    let family = |schema: &str| schema.split('/').next().map(str::to_owned);
    schema_of(text).is_ok_and(|found| family(&found) == family(schema))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File<E> {
    schema: String,
    layout: Layout,
    period_min: f64,
    is_virtual: bool,
    plants: Vec<E>,
}

/// One entry a step from the first observation of a plant.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FilePlant {
    /// Tip, in cm; null where it was not measured.
    x: Vec<Option<f64>>,
    y: Vec<Option<f64>>,
    /// Points of the stem from the base up, x and y in cm; null where none was seen. Absent without stems.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    stem: Vec<Option<[[f64; 2]; STEM_POINTS]>>,
    /// The lamp that was lit to the next step: `l` or `r` for its side, `d` dark, `?` not known.
    light: String,
}

/// Where there are data. Beyond it plants answer as they do at its edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    /// Greatest |x|, in cm.
    pub(super) widest_cm: f64,
    /// Least and greatest height, in cm.
    pub(super) heights_cm: [f64; 2],
}

impl Extent {
    /// The extent of `tips` and their mirror images.
    pub(super) fn of(tips: impl Iterator<Item = Point>) -> Self {
        let nothing = Self { widest_cm: 0.0, heights_cm: [f64::INFINITY, f64::NEG_INFINITY] };
        tips.fold(nothing, |Self { widest_cm, heights_cm: [least, most] }, tip| Self {
            widest_cm: widest_cm.max(tip.x.abs()),
            heights_cm: [least.min(tip.y), most.max(tip.y)],
        })
    }

    /// The share of the lit steps of a track, 0 to 1, that begin farther to a side, or by more than `reach_cm` higher or
    /// lower, than all data.
    /// `place` is where the tip of a sample is.
    pub(super) fn share_outside(
        &self,
        samples: &[Sample],
        reach_cm: f64,
        place: impl Fn(&Sample) -> Point,
    ) -> f64 {
        let [lowest, highest] = self.heights_cm;
        let is_outside = |tip: Point| {
            tip.x.abs() > self.widest_cm || !(lowest - reach_cm..=highest + reach_cm).contains(&tip.y)
        };
        let lit = samples.iter().filter(|sample| sample.light.is_some());
        let (outside, steps) = lit.fold((0, 0), |(outside, steps), sample| {
            (outside + u32::from(is_outside(place(sample))), steps + 1)
        });
        f64::from(outside) / f64::from(steps.max(1))
    }
}
