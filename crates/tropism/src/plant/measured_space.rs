//! What was observed of plants in space, as the model of them keeps it in its file.

use serde::{Deserialize, Serialize};

use super::measured_plant::{PlantRecord, check_places, used_steps};
use super::tip::ModelError;
use crate::geometry::STEM_POINTS;
use crate::geometry::path::resampled;
use crate::geometry::space::SpacePoint;
use crate::lamps::{Layout, Light};
use crate::observation::Quality;
use crate::track::{Sample, Track};

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

impl PlantRecord for PlantInSpace {
    type Place = SpacePoint;
    type Entry = FilePlant;

    fn of_track(track: &Track) -> Self {
        Self::of_samples(&track.samples, used_steps(track))
    }

    fn tips(&self) -> &[Option<SpacePoint>] {
        &self.tips
    }

    fn has_stem(&self) -> bool {
        self.stems.iter().any(Option::is_some)
    }

    fn no_stem(track: usize) -> ModelError {
        ModelError::NoDepth { track }
    }

    /// Any lamps: each has its direction.
    fn check_layout(_layout: &Layout) -> Result<(), ModelError> {
        Ok(())
    }

    fn check(&self, index: usize, layout: &Layout) -> Result<(), ModelError> {
        let points = self.tips.iter().flatten().chain(self.stems.iter().flatten().flatten());
        check_places(points.copied(), index)?;
        let is_other = |lit: &&Lit| matches!(lit, Lit::Lamp(light) if !layout.contains(*light));
        match self.lights.iter().find(is_other) {
            Some(lit) => {
                let found = format!("{lit:?} of {} lamps", layout.len());
                Err(ModelError::Shift { index, found })
            }
            None => Ok(()),
        }
    }

    fn entry(&self) -> FilePlant {
        let letter = |lit: &Lit| match lit {
            Lit::Unknown => '?',
            Lit::Dark => 'd',
            // A layout has at most eight lamps.
            Lit::Lamp(light) => char::from(b'0' + light.index() as u8),
        };
        FilePlant {
            tip: self.tips.clone(),
            stem: self.stems.clone(),
            light: self.lights.iter().map(letter).collect(),
        }
    }

    fn of_entry(entry: FilePlant, index: usize) -> Result<Self, ModelError> {
        let FilePlant { tip: tips, stem: stems, light } = entry;
        let lengths = [tips.len(), stems.len(), light.len()];
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
        Ok(Self { tips, stems, lights: light.chars().map(lit).collect::<Result<_, _>>()? })
    }
}

/// One entry a step from the first observation of a plant.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FilePlant {
    /// Tip, x, y and z in cm; null where it was not measured in space.
    tip: Vec<Option<SpacePoint>>,
    /// Points of the stem from the base up, x, y and z in cm; null where none was seen in space.
    stem: Vec<Option<SpaceStem>>,
    /// The lamp that was lit to the next step: its number in the layout, from 0; `d` dark, `?` not known.
    light: String,
}
