//! Observation of a plant at one step, by a camera or from a model.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Polyline, STEM_POINTS};
use crate::math::vector::Vec3;

/// How an observation came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quality {
    /// Measured in a photograph.
    Measured,
    /// The last detected tip, carried forward because no plant was accepted in this photograph. Never enters a model.
    CarriedForward,
    /// Computed by a model, or by the virtual bean without a photograph.
    Simulated,
}

impl Quality {
    /// The word used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::CarriedForward => "carried_forward",
            Self::Simulated => "simulated",
        }
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Quality {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        [Self::Measured, Self::CarriedForward, Self::Simulated]
            .into_iter()
            .find(|quality| quality.name() == word)
            .ok_or_else(|| format!("found quality {word:?}, wanted measured, carried_forward or simulated"))
    }
}

/// Third coordinate of the plant, in front of the plane through the root: a second camera at the side measures it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Depth {
    /// z of the tip, in cm.
    pub tip_cm: f64,
    /// z of each point of the stem, in cm; empty where the stem is not known in space.
    pub stem_cm: Vec<f64>,
}

/// What a controller observes of the plant at one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Observation {
    /// Tip, in cm: the highest point of the plant in the paper's definition (section 2.2.2).
    pub tip: Point,
    /// Stem from the base up, in cm, where the world or the photograph shows one.
    pub stem: Option<Polyline>,
    /// The third coordinate of tip and stem, where the world knows it.
    pub depth: Option<Depth>,
    /// Whether it was measured, carried_forward or simulated.
    pub quality: Quality,
}

impl Observation {
    /// A tip that a model computed.
    #[must_use]
    pub const fn simulated(tip: Point) -> Self {
        Self { tip, stem: None, depth: None, quality: Quality::Simulated }
    }

    /// The same with the stem of an observation `before` it, where it has none itself: as a running experiment sees it.
    #[must_use]
    pub fn holding_stem(mut self, before: &Self) -> Self {
        if self.stem.is_none() {
            self.stem.clone_from(&before.stem);
            if let Some((depth, before)) = self.depth.as_mut().zip(before.depth.as_ref()) {
                depth.stem_cm.clone_from(&before.stem_cm);
            }
        }
        self
    }

    /// Ten points of the stem from the base up, in cm; `None` without a stem that has a length.
    #[must_use]
    pub fn ten_points(&self) -> Option<[Point; STEM_POINTS]> {
        let stem = self.stem.as_ref().filter(|stem| stem.length() > 0.0)?;
        stem.resampled(STEM_POINTS).0.try_into().ok()
    }

    /// The tip in space, in cm; `None` where its depth is not known.
    #[must_use]
    pub fn tip_in_space(&self) -> Option<Vec3> {
        self.depth.as_ref().map(|depth| [self.tip.x, self.tip.y, depth.tip_cm])
    }

    /// The stem in space from the base up, in cm; `None` where it is not known there.
    #[must_use]
    pub fn stem_in_space(&self) -> Option<Vec<Vec3>> {
        let (stem, depth) = (self.stem.as_ref()?, self.depth.as_ref()?);
        let points = stem.0.iter().zip(&depth.stem_cm).map(|(point, &z)| [point.x, point.y, z]);
        (stem.0.len() == depth.stem_cm.len()).then(|| points.collect())
    }
}
