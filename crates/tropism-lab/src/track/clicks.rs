//! Clicks of a user on points of a plant.
//!
//! In: names or numbers of photographs, and pixels. Out: the same as indices into a series, and the region around them.

use serde::{Deserialize, Serialize};
use tropism::geometry::{Pixel, Region};
use tropism::vision::tracking::clicks::Click;

use super::series::Frame;
use crate::Error;

/// A click on a point of a plant in one photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlantClick {
    /// Name of the photograph, or its number in the series, from 1.
    pub photograph: String,
    /// Pixels to the right of the leftmost column.
    pub x: f64,
    /// Pixels below the topmost row.
    pub y: f64,
}

impl PlantClick {
    /// The pixel.
    #[must_use]
    pub const fn at(&self) -> Pixel {
        Pixel::new(self.x, self.y)
    }

    /// The click in a series of photographs of a size.
    pub(super) fn resolve(&self, frames: &[Frame], (width, height): (usize, usize)) -> Result<Click, Error> {
        let named = frames.iter().position(|frame| frame.name == self.photograph);
        let number = self.photograph.parse().ok().filter(|number| (1..=frames.len()).contains(number));
        let Some(frame) = named.or(number.map(|number| number - 1)) else {
            return Err(Error::Plan(format!(
                "a click names the photograph {:?}, which is not in the series: wanted the name of one, or a number from 1 \
                 to {}",
                self.photograph,
                frames.len()
            )));
        };
        let is_inside = |at: f64, size: usize| (-0.5..size as f64).contains(&at);
        if !is_inside(self.x, width) || !is_inside(self.y, height) {
            return Err(Error::Plan(format!(
                "a click at {},{} lies outside of the photograph {:?} of {width} x {height}",
                self.x, self.y, self.photograph
            )));
        }
        Ok(Click { frame, at: self.at() })
    }
}

/// What a user clicked on one plant: each point in one photograph or several.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlantClicks {
    /// The tip, which is tracked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tip: Vec<PlantClick>,
    /// The end of the stem, below the leaves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub node: Vec<PlantClick>,
    /// Where the stem leaves the soil. In several photographs where camera or plant are moved.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub root: Vec<PlantClick>,
}

impl PlantClicks {
    /// A region around all clicks and the root, with a margin of half its larger side to the sides and above; `None` without a
    /// click on the tip. The usual detection is a second witness there.
    pub(super) fn surroundings(&self, root: Pixel, (width, height): (usize, usize)) -> Option<Region> {
        let first = self.tip.first()?.at();
        let all = || {
            [root, first]
                .into_iter()
                .chain(self.tip.iter().chain(&self.node).chain(&self.root).map(PlantClick::at))
        };
        let [left, right] =
            [f64::min, f64::max].map(|least: fn(f64, f64) -> f64| all().map(|at| at.x).fold(first.x, least));
        let [top, bottom] =
            [f64::min, f64::max].map(|least: fn(f64, f64) -> f64| all().map(|at| at.y).fold(first.y, least));
        let margin = 0.5 * (right - left).max(bottom - top);
        let whole = |at: f64, most: usize| at.clamp(0.0, most as f64) as usize;
        let (x, y) = (whole(left - margin, width - 1), whole(top - margin, height - 1));
        let (right, bottom) = (whole(right + margin + 1.0, width), whole(bottom + 1.0, height));
        (right > x && bottom > y).then_some(Region { x, y, width: right - x, height: bottom - y })
    }

    /// Whether nothing is clicked.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.tip.is_empty() && self.node.is_empty() && self.root.is_empty()
    }
}
