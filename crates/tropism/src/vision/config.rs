//! Settings of vision, with the paper's values as defaults.
//!
//! In: keys of a rig file or the options of a command. Out: a checked [`VisionConfig`]. Where the paper gives no
//! value, the field says what was chosen.

use serde::{Deserialize, Serialize};

use crate::check::OutOfRange;
use crate::geometry::Region;
use crate::obstacle::{Obstacle, Pole};
use crate::vision::error::VisionError;

/// Detection method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// The paper's method: the highest bright sample of the crop (section 2.2.2).
    Paper,
    /// The highest point, to a fraction of a sample, of the plant component at the stem base.
    #[default]
    Robust,
}

/// The direction in which a plant grows in its pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Upwards.
    #[default]
    Up,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Downwards, as a plant that hangs.
    Down,
}

// The usual one first.
words! { Direction, "direction": Up = "up", Left = "left", Right = "right", Down = "down" }

/// Settings of plant detection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct VisionConfig {
    /// Detection method.
    pub mode: Mode,
    /// Direction in which the plant grows: what is farthest in it is the tip.
    #[serde(skip_serializing_if = "is_up")]
    pub up: Direction,
    /// Region of interest, in pixels; the whole picture if it is left out. The paper crops to "the extents of actual
    /// plant growth (to exclude the pot and light sources)" (section 2.2.2).
    pub crop: Option<Region>,
    /// Least number of columns to which a whole picture is subsampled: the sampling step is the greatest whole number
    /// of pixels that leaves as many. The paper gives no "sampling resolution"; chosen: 648, a quarter of its
    /// camera's.
    pub sampling_columns: usize,
    /// Standard deviation of the Gaussian filter, in samples. The paper gives none; chosen by hand: 0.5.
    pub sigma: f64,
    /// Plant threshold, as a share of the way from the background's level to that of the brightest samples. The paper
    /// says "the brightest pixels"; chosen: one half, which puts the edge of a blurred stem where the stem ends.
    pub threshold: f64,
    /// Number of brightest samples that define the bright level: a plant covers at least as many. Chosen by hand: 20.
    pub bright_samples: usize,
    /// Least contrast of a plant, in standard deviations of the background: the bright level must exceed the
    /// background by more. In mode `robust` the plant's learned colour must, too. Chosen by hand: 6.
    pub contrast: f64,
    /// Whether to detect the stem: by eqs. (10) and (11) in mode `paper`, as the plant's midline in `robust`.
    pub stem: bool,
    /// Colour thresholds of eq. (10), for mode `paper`.
    pub gates: StemConfig,
    /// Plausibility bounds of eq. (11), for mode `paper`.
    pub hold: HoldConfig,
    /// Obstacles in view, in cm, as the camera sees them: pixels within them are no plant.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub obstacles: Vec<Obstacle>,
    /// Upright poles in view, as the camera sees them: x to the right and z towards it from the stem base, in cm. What has the
    /// plant's colour before a pole is plant; a tip behind it is carried forward.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub poles: Vec<Pole>,
    /// Distance from the camera to the plane of the stem, in cm; required with poles.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera_cm: Option<f64>,
}

impl Default for VisionConfig {
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            up: Direction::default(),
            crop: None,
            sampling_columns: 648,
            sigma: 0.5,
            threshold: 0.5,
            bright_samples: 20,
            contrast: 6.0,
            stem: true,
            gates: StemConfig::default(),
            hold: HoldConfig::default(),
            obstacles: Vec::new(),
            poles: Vec::new(),
            camera_cm: None,
        }
    }
}

/// Whether a direction is the usual one, which settings need not name.
fn is_up(direction: &Direction) -> bool {
    *direction == Direction::Up
}

impl VisionConfig {
    /// Checks that every value is in its range and that the crop lies in pictures of `width` x `height`.
    ///
    /// # Errors
    /// [`VisionError`] names the key or the region.
    pub fn check(&self, width: usize, height: usize) -> Result<(), VisionError> {
        let number = |key, found: f64, is_in_range: bool, wanted| {
            VisionError::check_value(key, found, found.is_finite() && is_in_range, wanted)
        };
        let share =
            |key, found: f64| number(key, found, found > 0.0 && found < 1.0, "a share between 0 and 1");
        number("sampling_columns", self.sampling_columns as f64, self.sampling_columns > 0, "at least 1")?;
        number("sigma", self.sigma, (0.0..=20.0).contains(&self.sigma), "0 to 20 samples")?;
        share("threshold", self.threshold)?;
        number("bright_samples", self.bright_samples as f64, self.bright_samples > 0, "at least 1")?;
        number("contrast", self.contrast, self.contrast >= 0.0, "0 or more deviations")?;
        for (key, value) in [
            ("excess", self.gates.excess),
            ("green", self.gates.green),
            ("brightness", self.gates.brightness),
        ] {
            number(key, value, (0.0..=1.0).contains(&value), "0 to 1")?;
        }
        for (key, value) in [("length", self.hold.length), ("start", self.hold.start), ("end", self.hold.end)]
        {
            number(key, value, value > 0.0, "a share of the length above 0")?;
        }
        for (index, obstacle) in self.obstacles.iter().enumerate() {
            obstacle
                .check()
                .map_err(|error| VisionError::Obstacle(error.in_table(&format!("obstacles[{index}]"))))?;
        }
        self.check_poles()?;
        let region = self.region(width, height);
        if region.fits(width, height) { Ok(()) } else { Err(VisionError::Region { region, width, height }) }
    }

    fn check_poles(&self) -> Result<(), VisionError> {
        for (index, pole) in self.poles.iter().enumerate() {
            let in_table =
                |error: OutOfRange| VisionError::Obstacle(error.in_table(&format!("poles[{index}]")));
            pole.check().map_err(in_table)?;
            let is_beyond = |distance: f64| distance.is_finite() && pole.at[1] + pole.radius_cm < distance;
            let found = self.camera_cm.map_or("none".to_owned(), |distance| distance.to_string());
            let wanted = "the distance from the camera to the stem in cm, with all poles before the camera";
            VisionError::check_value("camera_cm", found, self.camera_cm.is_some_and(is_beyond), wanted)?;
            let is_upright = self.up == Direction::Up && self.mode == Mode::Robust;
            let wanted = "mode robust and plants that grow up, where there are poles";
            VisionError::check_value("mode", format!("{:?}, {:?}", self.mode, self.up), is_upright, wanted)?;
        }
        Ok(())
    }

    /// The crop, or the whole of a picture of `width` x `height`.
    pub(super) fn region(&self, width: usize, height: usize) -> Region {
        self.crop.unwrap_or(Region::whole((width, height)))
    }

    /// Sampling step in a picture of `width` columns, in pixels.
    pub(super) fn step(&self, width: usize) -> usize {
        (width / self.sampling_columns.max(1)).max(1)
    }
}

/// Definition of the brightness V of eq. (10), which the paper leaves open.
///
/// With [`Self::Max`] the condition `G >= 0.75` of eq. (10) would be redundant, which speaks against it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Brightness {
    /// V of HSV: the largest of red, green and blue.
    Max,
    /// L of HSL: the mean of the largest and the smallest. The paper's IronPython could call .NET's `GetBrightness`,
    /// which returns it.
    #[default]
    Lightness,
    /// Luma: 0.299 red, 0.587 green, 0.114 blue.
    Luma,
}

/// Colour thresholds of eq. (10), and the choices that the paper leaves open there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct StemConfig {
    /// Least G - R and G - B of a plant pixel: 0.5.
    pub excess: f64,
    /// Least G of a plant pixel: 0.75.
    pub green: f64,
    /// Least V of a plant pixel: 0.75.
    pub brightness: f64,
    /// Definition of V.
    pub value: Brightness,
}

impl Default for StemConfig {
    fn default() -> Self {
        Self { excess: 0.5, green: 0.75, brightness: 0.75, value: Brightness::default() }
    }
}

/// Plausibility bounds of eq. (11), as shares of the stem's length L at this step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct HoldConfig {
    /// Change of L from which on a stem is an error: 0.25.
    pub length: f64,
    /// Displacement of the starting vertex S from which on a stem is an error: 0.25.
    pub start: f64,
    /// Displacement of the ending vertex E from which on a stem is an error: 0.5.
    pub end: f64,
    /// Number of steps carried forward in a row after which the next stem is accepted. Never if it is left out, as in the
    /// paper, where one wrong stem can then be carried forward for ever.
    pub release: Option<u32>,
}

impl Default for HoldConfig {
    fn default() -> Self {
        Self { length: 0.25, start: 0.25, end: 0.5, release: None }
    }
}
