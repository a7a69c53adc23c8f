//! Lengths of time in a rig file.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Seconds, 0 to 3600.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "f64", into = "f64")]
pub struct Seconds(f64);

impl Seconds {
    pub(crate) const fn new(seconds: f64) -> Self {
        Self(seconds)
    }

    /// The same time as a [`Duration`].
    #[must_use]
    pub fn duration(self) -> Duration {
        Duration::from_secs_f64(self.0)
    }
}

impl TryFrom<f64> for Seconds {
    type Error = String;

    fn try_from(seconds: f64) -> Result<Self, String> {
        if (0.0..=3600.0).contains(&seconds) {
            Ok(Self(seconds))
        } else {
            Err(format!("found {seconds}, wanted 0 to 3600 seconds"))
        }
    }
}

impl From<Seconds> for f64 {
    fn from(seconds: Seconds) -> Self {
        seconds.0
    }
}

pub(crate) const fn one() -> Seconds {
    Seconds(1.0)
}

pub(crate) const fn ten() -> Seconds {
    Seconds(10.0)
}

pub(crate) const fn twenty() -> Seconds {
    Seconds(20.0)
}
