//! Where leaves begin: the width of the plant across the line changes, or a second leaf lies beside it.
//!
//! In: a line along a stem and beyond, and the stretch of it that is surely stem. Out: the point at which leaves begin.
//! The one idea: samples that differ from the background on their side are plant. A leaf is wider than the stem over a
//! long stretch, its stalk is thinner, and a second leaf lies beside the first. From there the stem's end is the last
//! point at which the plant is as wide as a stem.
//!
//! All shares and widths here were chosen on the first half of the photographs with centre lines
//! (`docs/validation/vision-real.md`).

use crate::math::statistics::quantile_nearest;
use crate::math::vector::{along, distance, mean};
use crate::vision::detect::curve::{normal, window};
use crate::vision::detect::ridge::bar::SmoothedImage;
use crate::vision::detect::ridge::flanks::{POINTS_PER_WIDTH, StemFlanks};
use crate::vision::detect::ridge::paint::Marks;
use crate::vision::detect::ridge::rgb::{self, Rgb};

/// Reach of a profile to each side of the line, in widths, and its samples along one width.
const REACH: usize = 3;
const SAMPLES_PER_WIDTH: usize = 16;

/// Samples of a profile on one side.
const SIDE: usize = REACH * SAMPLES_PER_WIDTH;

/// Colour differences from the background, as shares of the stem's contrast, at which a sample begins to be plant and
/// is wholly plant.
const LEAST_PLANT: f64 = 0.12;
const WHOLE_PLANT: f64 = 0.37;

/// Points to each side over which a background is the median.
const BACKGROUND_POINTS: usize = 3 * POINTS_PER_WIDTH;

/// Points of the sure stem from which on its width is learned.
const WIDTH_POINTS: usize = 4 * POINTS_PER_WIDTH;

/// Widths above which a cross-section is a leaf, and below which it is a leaf's stalk, as multiples of the stem's.
const LEAF: f64 = 1.4;
const STALK: f64 = 0.55;

/// Plant beside the stem, in widths, that is a second leaf.
const BESIDE: f64 = 0.7;

/// Number of points of which a share must be leaf where leaves begin: marks painted on a stem are shorter.
const LASTING_POINTS: usize = 5 * POINTS_PER_WIDTH / 4;
const LASTING_SHARE: f64 = 0.8;

/// Widths, as multiples of the stem's, and plant beside it, in widths, with which a stem ends.
const STEM_WIDTHS: std::ops::RangeInclusive<f64> = 0.7..=1.2;
const STEM_BESIDE: f64 = 0.25;

/// Points below the leaf at which a stem begins to widen.
const WIDENING_POINTS: usize = 3 * POINTS_PER_WIDTH / 8;

/// Points from a single mark to the end of a stem within which it says where that is, and points above it within which
/// the stem then ends.
const ALONE: usize = 2 * POINTS_PER_WIDTH;
const ABOVE_MARK: std::ops::RangeInclusive<usize> = POINTS_PER_WIDTH / 4..=POINTS_PER_WIDTH;

/// How much of the plant lies across a line at one point, in widths.
#[derive(Clone, Copy, Debug, Default)]
struct Extent {
    /// What is connected to the line.
    width: f64,
    /// All within reach.
    all: f64,
}

impl StemFlanks {
    /// The last point of the stem whose points from `first` to `last` are sure; `None` where no leaves are found above, so
    /// that the end is unknown. From the point `path_end` on the line is extrapolated: there only a wide cross-section is a
    /// leaf. A stem with a painted mark reaches beyond it, and one with a row of marks ends
    /// [above the topmost](Self::end_above_marks).
    pub(super) fn stem_end(
        &self,
        image: &SmoothedImage,
        first: usize,
        last: usize,
        path_end: usize,
        marks: Option<Marks>,
    ) -> Option<usize> {
        let extents = self.extents(image, first, last);
        let sure = first..(first + WIDTH_POINTS).min(last + 1);
        let usual = |of: fn(&Extent) -> f64| {
            quantile_nearest(&extents[sure.clone()].iter().map(of).collect::<Vec<_>>(), 0.5)
        };
        let (width, all) = (usual(|extent| extent.width), usual(|extent| extent.all));
        let is_leaf = |i: usize| {
            let extent = &extents[i];
            let is_narrow = extent.width < STALK * width || extent.all > all + BESIDE;
            extent.width > LEAF * width || i < path_end && is_narrow
        };
        let is_stem = |extent: &Extent| {
            STEM_WIDTHS.contains(&(extent.width / width)) && extent.all <= all + STEM_BESIDE
        };
        let lasts = |start: usize| {
            let next = start..(start + LASTING_POINTS).min(extents.len());
            let leaf = next.clone().filter(|&i| is_leaf(i)).count();
            2 * next.len() > LASTING_POINTS && leaf as f64 >= LASTING_SHARE * next.len() as f64
        };
        // Below the topmost mark, what looks like a leaf is another mark.
        let start = marks.map_or(sure.end + POINTS_PER_WIDTH, |marks| marks.topmost);
        let leaf = (start..extents.len()).find(|&i| is_leaf(i) && lasts(i))?;
        if let Some(Marks { topmost, is_row: true }) = marks {
            return Some(self.end_above_marks(image, (first, last), topmost, width));
        }
        let end = (first + 1..leaf).rev().find(|&i| is_stem(&extents[i]))?;
        let Some(Marks { topmost, .. }) = marks else { return Some(end.saturating_sub(WIDENING_POINTS)) };
        let end = end.max(topmost).saturating_sub(WIDENING_POINTS);
        let highest = if end <= topmost + ALONE { topmost + ABOVE_MARK.end() } else { end };
        Some(end.clamp(topmost + ABOVE_MARK.start(), highest).min(self.line.len() - 1))
    }

    /// The plant across each point of the line.
    fn extents(&self, image: &SmoothedImage, first: usize, last: usize) -> Vec<Extent> {
        let background = |i: usize, side: usize| {
            let at = i.clamp(first, last);
            let around = at.saturating_sub(BACKGROUND_POINTS).max(first)..=(at + BACKGROUND_POINTS).min(last);
            rgb::median(&around.map(|i| self.outer_colour(i, side)).collect::<Vec<_>>())
        };
        let profile = |i: usize| -> Vec<Rgb> {
            let normal = normal(&self.line, i, POINTS_PER_WIDTH / 2);
            let across = |k: usize| (k as f64 - SIDE as f64) / SAMPLES_PER_WIDTH as f64 * self.width;
            (0..=2 * SIDE).map(|k| image.at(along(self.line[i], normal, across(k)))).collect()
        };
        let profiles: Vec<Vec<Rgb>> = (0..self.line.len()).map(profile).collect();
        let is_plant = |i: usize, k: usize, background: Rgb| {
            let colour = mean(profiles[window(i, 2, profiles.len())].iter().map(|profile| profile[k]));
            let difference = distance(colour, background) / self.contrast;
            ((difference - LEAST_PLANT) / (WHOLE_PLANT - LEAST_PLANT)).clamp(0.0, 1.0)
        };
        let extents: Vec<Extent> = (0..profiles.len())
            .map(|i| {
                let sides = [background(i, 0), background(i, 1)];
                let plant: Vec<f64> =
                    (0..=2 * SIDE).map(|k| is_plant(i, k, sides[usize::from(k >= SIDE)])).collect();
                extent(&plant)
            })
            .collect();
        let median = |i: usize, of: fn(&Extent) -> f64| {
            quantile_nearest(&extents[window(i, 2, extents.len())].iter().map(of).collect::<Vec<_>>(), 0.5)
        };
        (0..extents.len())
            .map(|i| Extent { width: median(i, |extent| extent.width), all: median(i, |extent| extent.all) })
            .collect()
    }
}

/// The extent of a profile, whose samples are 0 on background and 1 on plant.
fn extent(plant: &[f64]) -> Extent {
    let all = plant.iter().sum::<f64>() / SAMPLES_PER_WIDTH as f64;
    let is_plant = |k: usize| plant[k] > 0.5;
    let near = SIDE - SAMPLES_PER_WIDTH / 2..=SIDE + SAMPLES_PER_WIDTH / 2;
    let middle = near.filter(|&k| is_plant(k)).min_by_key(|k| k.abs_diff(SIDE));
    let Some(middle) = middle else { return Extent { width: 0.0, all } };
    // A gap of one sample is noise.
    let mut right = middle;
    while let Some(next) = (right + 1..plant.len().min(right + 3)).find(|&k| is_plant(k)) {
        right = next;
    }
    let mut left = middle;
    while let Some(next) = (left.saturating_sub(2)..left).rev().find(|&k| is_plant(k)) {
        left = next;
    }
    Extent { width: (right - left + 1) as f64 / SAMPLES_PER_WIDTH as f64, all }
}
