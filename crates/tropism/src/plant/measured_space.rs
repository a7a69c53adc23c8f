//! What was observed of plants in space, as the model of them keeps it in its file.

use serde::{Deserialize, Serialize};

use super::measured_plant::{FARTHEST_CM, MAX_PERIOD_MIN, used_steps};
use super::tip::{ModelError, shared_layout_and_period};
use crate::check::ensure;
use crate::file::schema_of;
use crate::geometry::STEM_POINTS;
use crate::geometry::space::{SpacePoint, resampled};
use crate::lamps::{Layout, Light};
use crate::observation::Quality;
use crate::track::{SAME_PERIOD, Sample, Track};

/// A stem from the base up, in cm.
pub(super) type SpaceStem = [SpacePoint; STEM_POINTS];

/// What lit a plant from a step to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Lit {
    /// Not known.
    Unknown,
    /// No lamp.
    Dark,
    /// A lamp of the layout.
    Lamp(Light),
}

/// What was observed of one plant, step by step from its first observation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlantInSpace {
    /// The tip at each step, in cm; `None` where it was not measured in space.
    pub(super) tips: Vec<Option<SpacePoint>>,
    /// The stem at each step; `None` where none was seen in space.
    pub(super) stems: Vec<Option<SpaceStem>>,
    /// What was lit from each step to the next.
    pub(super) lights: Vec<Lit>,
}

impl PlantInSpace {
    /// The first `steps` steps of `samples`.
    pub(super) fn of_samples(samples: &[Sample], steps: usize) -> Self {
        let mut data = Self { tips: Vec::new(), stems: Vec::new(), lights: Vec::new() };
        let first = samples.first().map_or(0, |sample| sample.step);
        for sample in samples {
            let step = sample.step.wrapping_sub(first) as usize;
            if step > steps {
                break;
            }
            data.tips.resize(step + 1, None);
            data.stems.resize(step + 1, None);
            data.lights.resize(step + 1, Lit::Unknown);
            data.lights[step] = sample.light.map_or(Lit::Dark, Lit::Lamp);
            if sample.quality != Quality::Held {
                let seen = sample.observation();
                data.tips[step] = seen.tip_in_space();
                let stem = seen.stem_in_space().map(|stem| resampled(&stem, STEM_POINTS));
                data.stems[step] = stem.and_then(|stem| stem.try_into().ok());
            }
        }
        data
    }

    /// Mean of the lowest points of the stems, in cm.
    pub(super) fn mean_base(&self) -> SpacePoint {
        core::array::from_fn(|axis| {
            crate::math::statistics::mean(self.stems.iter().flatten().map(|stem| stem[0][axis]))
        })
    }
}

/// Plants under the same lamps, observed at the same period by two cameras.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlantsInSpace {
    pub(super) layout: Layout,
    pub(super) period_min: f64,
    pub(super) is_virtual: bool,
    pub(super) plants: Vec<PlantInSpace>,
}

impl PlantsInSpace {
    /// The plants of `tracks`.
    ///
    /// # Errors
    /// [`ModelError`] where the tracks differ in lamps or period, or where one has no stem in space.
    pub(super) fn of_tracks<'t>(tracks: impl IntoIterator<Item = &'t Track>) -> Result<Self, ModelError> {
        let tracks: Vec<&Track> = tracks.into_iter().collect();
        let (layout, period_min) = shared_layout_and_period(&tracks)?;
        let plant = |track: &&Track| PlantInSpace::of_samples(&track.samples, used_steps(track));
        let plants: Vec<PlantInSpace> = tracks.iter().map(plant).collect();
        let has_none = |plant: &PlantInSpace| plant.stems.iter().all(Option::is_none);
        if let Some(track) = plants.iter().position(has_none) {
            return Err(ModelError::NoDepth { track: track + 1 });
        }
        let measured = Self { layout, period_min, is_virtual: false, plants };
        measured.check()?;
        Ok(measured)
    }

    /// Checks the period, the lamps and the coordinates.
    fn check(&self) -> Result<(), ModelError> {
        let Self { layout, period_min, plants, .. } = self;
        let is_period = *period_min > 0.0 && period_min.is_finite();
        ensure(is_period, "period_min", *period_min, "minutes above 0")?;
        if *period_min > MAX_PERIOD_MIN * (1.0 + SAME_PERIOD) {
            return Err(ModelError::Slow { found: *period_min, most: MAX_PERIOD_MIN });
        }
        for (index, plant) in plants.iter().enumerate() {
            let is_far = |point: &&SpacePoint| !point.iter().all(|axis| axis.abs() <= FARTHEST_CM);
            let mut points = plant.tips.iter().flatten().chain(plant.stems.iter().flatten().flatten());
            if let Some(point) = points.find(is_far) {
                return Err(ModelError::Shift { index, found: format!("{point:?}") });
            }
            let is_other = |lit: &&Lit| matches!(lit, Lit::Lamp(light) if !layout.contains(*light));
            if let Some(lit) = plant.lights.iter().find(is_other) {
                let found = format!("{lit:?} of {} lamps", layout.len());
                return Err(ModelError::Shift { index, found });
            }
        }
        Ok(())
    }

    /// The tips that were measured in space, in cm.
    pub(super) fn tips(&self) -> impl Iterator<Item = SpacePoint> {
        self.plants.iter().flat_map(|plant| plant.tips.iter().flatten().copied())
    }

    /// The same lamps and period with one plant alone.
    pub(super) fn alone(&self, plant: &PlantInSpace) -> Self {
        Self { plants: vec![plant.clone()], layout: self.layout.clone(), ..*self }
    }

    /// JSON of this `schema`.
    pub(super) fn to_json(&self, schema: &str) -> String {
        let file = File {
            schema: schema.to_owned(),
            layout: self.layout.clone(),
            period_min: self.period_min,
            is_virtual: self.is_virtual,
            plants: self.plants.iter().map(FilePlant::of).collect(),
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
        let plants = plants.map(|(index, plant)| plant.measured(index)).collect::<Result<_, _>>()?;
        let measured = Self { layout, period_min, is_virtual, plants };
        measured.check()?;
        Ok(measured)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    layout: Layout,
    period_min: f64,
    is_virtual: bool,
    plants: Vec<FilePlant>,
}

/// One entry a step from the first observation of a plant.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePlant {
    /// Tip, x, y and z in cm; null where it was not measured in space.
    tip: Vec<Option<SpacePoint>>,
    /// Points of the stem from the base up, x, y and z in cm; null where none was seen in space.
    stem: Vec<Option<SpaceStem>>,
    /// The lamp that was lit to the next step: its number in the layout, from 0; `d` dark, `?` not known.
    light: String,
}

impl FilePlant {
    fn of(data: &PlantInSpace) -> Self {
        let letter = |lit: &Lit| match lit {
            Lit::Unknown => '?',
            Lit::Dark => 'd',
            // A layout has at most eight lamps.
            Lit::Lamp(light) => char::from(b'0' + light.index() as u8),
        };
        Self {
            tip: data.tips.clone(),
            stem: data.stems.clone(),
            light: data.lights.iter().map(letter).collect(),
        }
    }

    fn measured(self, index: usize) -> Result<PlantInSpace, ModelError> {
        let lengths = [self.tip.len(), self.stem.len(), self.light.len()];
        if lengths.iter().any(|&length| length != lengths[0]) {
            return Err(ModelError::Lengths { found: format!("{lengths:?}") });
        }
        let lit = |letter: char| match letter {
            '?' => Ok(Lit::Unknown),
            'd' => Ok(Lit::Dark),
            _ => {
                let number = letter.to_digit(10).and_then(|number| Light::new(number as usize));
                let refused = || ModelError::Shift { index, found: format!("light {letter:?}") };
                number.map(Lit::Lamp).ok_or_else(refused)
            }
        };
        let lights = self.light.chars().map(lit).collect::<Result<_, _>>()?;
        Ok(PlantInSpace { tips: self.tip, stems: self.stem, lights })
    }
}
