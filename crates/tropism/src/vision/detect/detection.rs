//! What one photograph shows of a plant.

use serde::{Deserialize, Serialize};

use crate::geometry::Pixel;
use crate::vision::detect::occupancy::OccupancyGrid;

/// An edge of a crop that a plant can grow out of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// The upper one.
    Top,
    /// The left one.
    Left,
    /// The right one.
    Right,
}

impl Edge {
    /// The word used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Top => "top",
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// What one photograph shows of a plant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// The highest point of the plant: the paper's tip.
    pub tip: Pixel,
    /// The end of the stem, where leaves begin or a second limb parts from it: the last point of the midline, in mode
    /// `robust`.
    pub apex: Option<Pixel>,
    /// The stem from the base up, where it was asked for and is in view: one point a row in mode `paper`, the midline
    /// in `robust`.
    pub stem: Option<Vec<Pixel>>,
    /// How many deviations of the background the brightest of the plant exceeds it by.
    pub contrast: f64,
    /// Where there is tissue, in mode `robust`.
    #[serde(rename = "shape")]
    pub tissue: OccupancyGrid,
    /// The edge of the crop that the plant reaches, if it does: its tip may lie beyond.
    #[serde(rename = "cut")]
    pub clipped_at: Option<Edge>,
    /// Whether glare, a shadow or mist lies on the tip, or the backdrop is not found again: the tip may be elsewhere.
    #[serde(rename = "is_veiled")]
    pub is_occluded: bool,
    /// Whether there is a backdrop and it is not found again: the camera may look elsewhere.
    #[serde(rename = "is_lost")]
    pub is_unregistered: bool,
    /// How far the camera's picture has moved since the first one, in pixels to the right and down, as a [`TipTracker`] finds.
    #[serde(rename = "shift")]
    pub camera_shift: Pixel,
}
