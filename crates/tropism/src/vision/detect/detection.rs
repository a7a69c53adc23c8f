//! Detection of a plant in one photograph.

use serde::{Deserialize, Serialize};

use crate::geometry::Pixel;
use crate::lamps::Light;
use crate::vision::detect::occupancy::OccupancyGrid;

/// An edge of the crop that a plant can grow across.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// The upper edge.
    Top,
    /// The left edge.
    Left,
    /// The right edge.
    Right,
    /// The lower edge, of a plant that does not grow upwards.
    Bottom,
}

// Clockwise from the top.
words! { Edge, "edge": Top = "top", Right = "right", Bottom = "bottom", Left = "left" }

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde wants a reference")]
const fn is_false(flag: &bool) -> bool {
    !*flag
}

/// A plant detected in one photograph, in pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// Highest point of the plant: the paper's tip (section 2.2.2).
    pub tip: Pixel,
    /// End of the stem, where leaves begin or branch off: the last point of the midline. In mode `robust` only.
    pub apex: Option<Pixel>,
    /// Stem from the base up, where it is configured and found: one point a row in mode `paper`, the midline in
    /// `robust`.
    pub stem: Option<Vec<Pixel>>,
    /// Width of the stem, where one is found, in pixels. In mode `robust` only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stem_width: Option<f64>,
    /// The lamp that is lit; set by a tracker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<Light>,
    /// Contrast between plant and background, in standard deviations of the background.
    pub contrast: f64,
    /// Cells that the plant's component occupies. In mode `robust` only.
    #[serde(rename = "shape")]
    pub tissue: OccupancyGrid,
    /// Edge of the crop that the plant touches: its tip may lie beyond.
    #[serde(rename = "cut")]
    pub clipped_at: Option<Edge>,
    /// Whether glare, a shadow or mist lies on the tip, or the picture is not registered: the true tip may be
    /// elsewhere.
    #[serde(rename = "is_veiled")]
    pub is_occluded: bool,
    /// Whether a pole hides the tip: the stem ends at its edge and leads behind it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_behind_pole: bool,
    /// Whether another plant touches it: a stem comes down to the soil elsewhere, too. The tip may be the other plant's.
    #[serde(default, skip_serializing_if = "is_false")]
    pub has_second_foot: bool,
    /// Whether registration failed although the reference has enough features: the camera may have been turned away.
    #[serde(rename = "is_lost")]
    pub is_unregistered: bool,
    /// Shift of the camera's picture since the reference, to the right and down; set by a tracker.
    #[serde(rename = "shift")]
    pub camera_shift: Pixel,
}

impl Detection {
    /// With its points rounded to a thousandth of a pixel, so that a text holds all of it.
    #[must_use]
    pub fn rounded(self) -> Self {
        let rounded = |value: f64| (value * 1e3).round() / 1e3;
        let round = |pixel: Pixel| Pixel::new(rounded(pixel.x), rounded(pixel.y));
        Self {
            tip: round(self.tip),
            apex: self.apex.map(round),
            stem: self.stem.map(|stem| stem.into_iter().map(round).collect()),
            ..self
        }
    }
}
