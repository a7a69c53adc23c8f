//! Settings of the tip-motion model: window, growth, and what happens where there are no data.

use serde::{Deserialize, Serialize};

use super::shifts::Window;
use crate::check::{OutOfRange, ensure};
use crate::track::{PAPER_PERIOD_MIN, SAME_PERIOD};

/// Growth of the shoot in one step, eq. (4): in settings a step of five minutes, in a model one of its own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Growth {
    /// Mean, in cm. Paper: 0.03.
    pub mean: f64,
    /// Standard deviation, in cm. Paper: 0.01.
    pub sd: f64,
}

impl Default for Growth {
    fn default() -> Self {
        Self { mean: 0.03, sd: 0.01 }
    }
}

impl Growth {
    /// The growth of a step of `minutes`, where this is that of the paper's five: steps add up, and their deviations add up
    /// as those of independent draws. Within what a clock keeps, five minutes are five.
    #[must_use]
    pub fn over(&self, minutes: f64) -> Self {
        let steps = minutes / PAPER_PERIOD_MIN;
        if (steps - 1.0).abs() <= SAME_PERIOD {
            return *self;
        }
        Self { mean: self.mean * steps, sd: self.sd * steps.sqrt() }
    }

    /// The growth that a standard normal draw stands for, in cm.
    #[must_use]
    pub fn with_noise(&self, normal: f64) -> f64 {
        self.mean + self.sd * normal
    }
}

/// What the model does where its window holds no data: the white of Fig. 5. The paper does not say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Empty {
    /// The tip is not shifted sideways; it only grows.
    #[default]
    Still,
    /// The shift of the nearest node that has data.
    Nearest,
}

/// How a model is made of tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct TipModelConfig {
    /// Sliding window, eq. (1). Paper: 1 cm x 2 cm.
    pub window: Window,
    /// Distance between the nodes of the table, in cm.
    pub grid_cm: f64,
    /// Growth of a step, eq. (4). For a fit that of five minutes, which is scaled to the step of the tracks.
    pub growth: Growth,
    /// What happens where a window is empty.
    pub empty: Empty,
}

impl Default for TipModelConfig {
    fn default() -> Self {
        Self { window: Window::default(), grid_cm: 0.1, growth: Growth::default(), empty: Empty::Still }
    }
}

impl TipModelConfig {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let Self { window, grid_cm, growth, .. } = self;
        let positive =
            |key, found: f64, wanted, most: f64| ensure(found > 0.0 && found <= most, key, found, wanted);
        positive("window.wx", window.wx, "a half-width above 0 and at most 20 cm", 20.0)?;
        positive("window.wy", window.wy, "a half-height above 0 and at most 20 cm", 20.0)?;
        ensure((0.01..=5.0).contains(grid_cm), "grid_cm", grid_cm, "0.01 to 5 cm")?;
        positive("growth.mean", growth.mean, "growth above 0 and at most 100 cm a step", 100.0)?;
        ensure((0.0..=100.0).contains(&growth.sd), "growth.sd", growth.sd, "0 to 100 cm a step")
    }
}
