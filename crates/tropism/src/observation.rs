//! What is seen of a plant at one step, whether in a photograph or in a model.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Polyline};

/// How an observation came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Quality {
    /// Measured in a photograph.
    Measured,
    /// The last detected tip, held because no plant was accepted in this photograph. Never enters a model.
    Held,
    /// Computed by a model, or by the virtual bean without a photograph.
    Simulated,
}

impl Quality {
    /// The word used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Held => "held",
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
        [Self::Measured, Self::Held, Self::Simulated]
            .into_iter()
            .find(|quality| quality.name() == word)
            .ok_or_else(|| format!("found quality {word:?}, wanted measured, held or simulated"))
    }
}

/// What a controller may know of the plant at one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Tip, in cm: the highest point of the plant in the paper's definition (section 2.2.2).
    pub tip: Point,
    /// Stem from the base up, in cm, where the world or the photograph shows one.
    pub stem: Option<Polyline>,
    /// Whether it was measured, held or simulated.
    pub quality: Quality,
}

impl Observation {
    /// A tip that a model computed.
    #[must_use]
    pub const fn simulated(tip: Point) -> Self {
        Self { tip, stem: None, quality: Quality::Simulated }
    }
}
