//! Marks painted on a stem, by which growth is measured: red dots and rings, up to where the stem ends.
//!
//! In: a line along a stem and beyond, and the stretch of it that is surely stem. Out: where the topmost mark ends. The
//! one idea: the share of red less that of green is much higher in a mark than in the stem and its flanks, and a mark
//! is short. Shares do not change in the shade, levels do.
//!
//! All shares and widths here were chosen on the first half of the photographs with centre lines
//! (`docs/validation/vision-real.md`).

use crate::math::statistics::{mean, quantile_nearest};
use crate::math::vector::along;
use crate::vision::detect::curve::{normal, window};
use crate::vision::detect::ridge::bar::SmoothedImage;
use crate::vision::detect::ridge::flanks::{POINTS_PER_WIDTH, StemFlanks};
use crate::vision::detect::ridge::rgb::{self, Rgb};

/// Greatest offset from the line at which a mark is searched, in eighths of a width: rings are wider than the stem.
const ACROSS: i32 = 6;

/// Offsets over which a redness is averaged.
const AVERAGED: usize = 3;

/// Least redness of a mark above that of the stem and its flanks.
const MARK: f64 = 0.06;

/// Brightness, as a share of the stem's, that is added to a colour's, so that the noise of the dark is not red.
const DARK: f64 = 0.2;

/// Points of a mark along the line.
const MARK_POINTS: std::ops::RangeInclusive<usize> = 2..=5 * POINTS_PER_WIDTH / 2;

/// Most points between two marks of a row.
const MAX_GAP: usize = 6 * POINTS_PER_WIDTH;

/// Marks along a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Marks {
    /// The last point of the topmost mark.
    pub(super) topmost: usize,
    /// Whether there are several, so that the stem is marked all along.
    pub(super) is_row: bool,
}

impl StemFlanks {
    /// The marks on a stem whose points from `first` to `last` are sure; `None` where there are none.
    pub(super) fn marks(&self, image: &SmoothedImage, first: usize, last: usize) -> Option<Marks> {
        let normals: Vec<_> =
            (0..self.line.len()).map(|i| normal(&self.line, i, POINTS_PER_WIDTH / 2)).collect();
        let at = |i: usize, eighths: i32| {
            image.at(along(self.line[i], normals[i], f64::from(eighths) / 8.0 * self.width))
        };
        let sure = first..=last;
        let stem = rgb::median(&sure.clone().map(|i| at(i, 0)).collect::<Vec<_>>());
        let dark = DARK * stem.iter().sum::<f64>();
        let redness = |colour: Rgb| (colour[0] - colour[1]) / (colour.iter().sum::<f64>() + dark);
        let beside = |side: usize| {
            quantile_nearest(
                &sure.clone().map(|i| redness(self.outer_colour(i, side))).collect::<Vec<_>>(),
                0.5,
            )
        };
        let inside = quantile_nearest(&sure.clone().map(|i| redness(at(i, 0))).collect::<Vec<_>>(), 0.5);
        let usual = inside.max(beside(0)).max(beside(1));
        let reddest = |i: usize| {
            let across: Vec<f64> = (-ACROSS..=ACROSS).map(|eighths| redness(at(i, eighths))).collect();
            let means = across.windows(AVERAGED).map(|near| near.iter().sum::<f64>() / AVERAGED as f64);
            means.fold(f64::NEG_INFINITY, f64::max)
        };
        let reddest: Vec<f64> = (0..self.line.len()).map(reddest).collect();
        let is_red = |i: usize| mean(reddest[window(i, 1, reddest.len())].iter().copied()) > usual + MARK;
        row_of_marks((0..reddest.len()).map(is_red))
    }
}

/// The row that begins with the lowest mark. What is red from the first point on is the pot's.
fn row_of_marks(is_red: impl Iterator<Item = bool>) -> Option<Marks> {
    let mut marks: Option<Marks> = None;
    let mut start = None;
    for (i, is_red) in is_red.chain([false]).enumerate() {
        match start {
            None if is_red => start = Some(i),
            Some(from) if !is_red => {
                start = None;
                if marks.is_some_and(|marks| from - marks.topmost > MAX_GAP) {
                    break;
                }
                if from > 0 && MARK_POINTS.contains(&(i - from)) {
                    marks = Some(Marks { topmost: i - 1, is_row: marks.is_some() });
                }
            }
            _ => {}
        }
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_marks_ends_where_none_is_near_above() {
        let marks = |marks: &[std::ops::Range<usize>]| {
            let row = row_of_marks((0..200).map(|i| marks.iter().any(|mark| mark.contains(&i))));
            row.map(|row| (row.topmost, row.is_row))
        };
        assert_eq!(marks(&[30..34, 60..68, 80..85]), Some((84, true)));
        assert_eq!(marks(&[30..34, 120..125]), Some((33, false)), "another far above");
        assert_eq!(marks(&[0..9, 30..34, 60..100]), Some((33, false)), "a pot below, a red leaf above");
        assert_eq!(marks(&[50..51, 70..110]), None);
    }
}
