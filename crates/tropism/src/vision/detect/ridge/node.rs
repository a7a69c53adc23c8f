//! The node, where the leaves branch off, above a row of marks that are painted on a stem.
//!
//! In: a line along a stem, and the point where its topmost mark ends. Out: the last point of the stem. The one idea:
//! close above its topmost mark a stem goes straight on, while a line that was traced there bends into one of the
//! leaves. Along that straight axis the plant is followed upwards, row by row. At the node it becomes wider, or parts
//! into branches. Its height is a change point: its prior is what is usual above a topmost mark, its likelihood what the
//! rows above show, and the mean of its posterior is taken.
//!
//! The constants are from 83 photographs of the first half of those with centre lines, in which the node was marked by
//! eye (`docs/validation/vision-real.md`).

use crate::math;
use crate::math::vector::{along, dot, mean, sub};
use crate::vision::detect::curve::direction;
use crate::vision::detect::ridge::bar::SmoothedImage;
use crate::vision::detect::ridge::flanks::{POINTS_PER_WIDTH, StemFlanks};
use crate::vision::detect::ridge::rgb::{self, Rgb};

/// Points below the topmost mark's end over which a stem is straight, and over which the background is learned.
const AXIS_POINTS: usize = 5 * POINTS_PER_WIDTH / 2;
const BACKGROUND_POINTS: usize = 3 * POINTS_PER_WIDTH;

/// Samples to each side of the axis, and rows below and above the end of the topmost mark: an eighth of a width apart.
const SIDE: usize = 4 * POINTS_PER_WIDTH;
const ROWS_BELOW: usize = POINTS_PER_WIDTH / 2;
const ROWS_ABOVE: usize = 4 * POINTS_PER_WIDTH;

/// Share of the way from the colour of the background to the stem's from which on a sample is plant. What is darker than
/// the background is shade.
const PLANT: f64 = 0.15;

/// Log-likelihood ratio of a row above the node to one below it: of any row, for each unit of the logarithm of its
/// width, and for branches. It is that of a logistic regression on the 51 photographs with odd numbers, times 0.15, for
/// neighbouring rows are alike.
const ANY_ROW: f64 = -0.09;
const WIDER: f64 = 0.36;
const BRANCHED: f64 = 0.23;

/// Greatest logarithm of a width that counts.
const MAX_WIDER: f64 = 0.6;

/// Height of a node above the topmost mark, mean and standard deviation, and how far below it a stem ends, in widths: by
/// eye, the height was 1.8 ± 0.8, and stems measured by hand ended 0.9 ± 0.7 below.
const NODE_HEIGHT: f64 = 1.8;
const NODE_SPREAD: f64 = 0.8;
const END_BELOW_NODE: f64 = 0.9;

/// First and last sample of a piece of plant in a row.
type Piece = (usize, usize);

impl StemFlanks {
    /// The last point of a stem with a row of marks, the topmost of which ends at the point `topmost`. The points from
    /// `first` to `last` are sure to be stem; there, `width` of the stem's widths are plant.
    pub(super) fn end_above_marks(
        &self,
        image: &SmoothedImage,
        (first, last): (usize, usize),
        topmost: usize,
        width: f64,
    ) -> usize {
        let rows = self.rows_above(image, (first, last), topmost);
        let mut pieces = vec![(SIDE - ROWS_BELOW, SIDE + ROWS_BELOW)];
        let scores: Vec<f64> = rows
            .iter()
            .map(|is_plant| {
                let reached = reached(is_plant, &pieces);
                let samples: usize = reached.iter().map(|piece| piece.1 - piece.0 + 1).sum();
                let wider = samples as f64 / (POINTS_PER_WIDTH as f64 * width.max(0.5));
                let is_branched = reached.len() > 1;
                // A dark mark interrupts the plant.
                if !reached.is_empty() {
                    pieces = reached;
                }
                let wider = math::ln(wider.max(1.0)).min(MAX_WIDER);
                ANY_ROW + WIDER * wider + if is_branched { BRANCHED } else { 0.0 }
            })
            .collect();
        let node = node_height(&scores);
        let end = topmost as f64 + (node - END_BELOW_NODE) * POINTS_PER_WIDTH as f64;
        (end.round().max(0.0) as usize).min(self.line.len() - 1)
    }

    /// Which samples are plant, row by row from below the end of the topmost mark upwards.
    fn rows_above(
        &self,
        image: &SmoothedImage,
        (first, last): (usize, usize),
        topmost: usize,
    ) -> Vec<Vec<bool>> {
        let stem = rgb::median(&(first..=last).map(|i| self.stem_colour(i)).collect::<Vec<_>>());
        let around = last.saturating_sub(BACKGROUND_POINTS).max(first)..=last;
        let background = [0, 1]
            .map(|side| rgb::median(&around.clone().map(|i| self.outer_colour(i, side)).collect::<Vec<_>>()));
        let step = self.width / POINTS_PER_WIDTH as f64;
        let at = self.line[topmost];
        let upwards = direction(self.line[topmost.saturating_sub(AXIS_POINTS)], at);
        let across = [-upwards[1], upwards[0]];
        let colour = |row: usize, k: usize| -> Rgb {
            let middle = along(at, upwards, (row as f64 - ROWS_BELOW as f64) * step);
            image.at(along(middle, across, (k as f64 - SIDE as f64) * step))
        };
        let is_plant = |row: usize, k: usize| {
            let colour = mean((row.saturating_sub(1)..=row + 1).map(|row| colour(row, k)));
            let background = background[usize::from(k >= SIDE)];
            let whole = sub(stem, background);
            dot(sub(colour, background), whole) > PLANT * dot(whole, whole)
        };
        (0..=ROWS_BELOW + ROWS_ABOVE).map(|row| (0..=2 * SIDE).map(|k| is_plant(row, k)).collect()).collect()
    }
}

/// The pieces of a row that touch one of those in the row below.
fn reached(is_plant: &[bool], below: &[Piece]) -> Vec<Piece> {
    let touches =
        |&(start, end): &Piece| below.iter().any(|below| start <= below.1 + 1 && below.0 <= end + 1);
    let mut pieces = Vec::new();
    let mut k = 0;
    for same in is_plant.chunk_by(|one, next| one == next) {
        if same[0] {
            pieces.push((k, k + same.len() - 1));
        }
        k += same.len();
    }
    pieces.retain(touches);
    pieces
}

/// Posterior mean of a node's height above the topmost mark, in widths, from the scores of the rows.
fn node_height(scores: &[f64]) -> f64 {
    let height = |row: usize| (row as f64 - ROWS_BELOW as f64) / POINTS_PER_WIDTH as f64;
    let (mut above, mut weights, mut sum) = (0.0, 0.0, 0.0);
    for row in (0..scores.len()).rev() {
        let deviation = (height(row) - NODE_HEIGHT) / NODE_SPREAD;
        let weight = math::exp(above - 0.5 * deviation * deviation);
        weights += weight;
        sum += weight * height(row);
        above += scores[row];
    }
    sum / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_is_found_between_what_is_usual_and_what_is_seen() {
        let node = |row: usize| {
            let score = |i: usize| if i > row { WIDER * MAX_WIDER + BRANCHED } else { ANY_ROW };
            node_height(&(0..=ROWS_BELOW + ROWS_ABOVE).map(score).collect::<Vec<_>>())
        };
        // These rows are at heights of 0.5, 1.5, 2.5 and 3.5 widths.
        let nodes = [8, 16, 24, 32].map(node);
        assert!((nodes[0] - 0.5).abs() < 0.3 && (nodes[1] - 1.5).abs() < 0.3, "{nodes:?}");
        assert!(NODE_HEIGHT < nodes[2] && nodes[2] < nodes[3] && nodes[3] < 3.5, "{nodes:?}");
    }

    #[test]
    fn a_branch_counts_where_it_is_reached_from_below() {
        let row = |plant: &[Piece]| -> Vec<bool> {
            (0..20).map(|k| plant.iter().any(|piece| (piece.0..=piece.1).contains(&k))).collect()
        };
        assert_eq!(reached(&row(&[(2, 4), (7, 9), (15, 19)]), &[(4, 8)]), [(2, 4), (7, 9)]);
        assert!(reached(&row(&[(10, 12)]), &[(4, 8)]).is_empty());
    }
}
