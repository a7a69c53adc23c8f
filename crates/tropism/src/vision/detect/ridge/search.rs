//! Beam search for the path of a bar from the stem base.
//!
//! In: a picture and the base. Out: the path with the highest score, and the stem's width. The one idea: a path is
//! extended by half a width at a time in several directions and widths; its score is the bar's contrast along it,
//! less the cost of turning and tapering; the best few paths are kept at each step (beam search, Lowerre 1976).

use crate::math;
use crate::vision::detect::curve::PlanePoint;
use crate::vision::detect::ridge::bar::{MIN_WIDTH, SmoothedImage};

/// Width of the widest stem that is found, as a share of the picture's shorter side.
pub(super) const MAX_WIDTH_SHARE: f64 = 0.08;

/// Ratio of two successive widths that are tried.
const WIDTH_RATIO: f64 = 1.15;

/// Greatest lean of a stem at its base, and the difference of two leans that are tried, in degrees from upright.
const MAX_LEAN: i32 = 60;
const LEAN_STEP: i32 = 6;

/// Number of bars of a first piece, half a width apart, and of the best among them that count: the lowest may lie in
/// the pot's rim.
const PIECE_BARS: usize = 9;
const COUNTED_BARS: usize = 6;

/// Least contrast of a first piece, as a share of the greatest. The thinnest such piece is the stem's: a wider one
/// belongs to a leaf above it.
const MIN_CONTRAST_SHARE: f64 = 0.6;

/// Greatest width of a first piece, as a multiple of the thinnest one's.
const MAX_WIDTH_RATIO: f64 = 1.4;

/// Number of paths that are kept at each step.
const BEAM_WIDTH: usize = 32;

/// Most steps of a path, of half a width each.
const MAX_STEPS: usize = 400;

/// Turns in one step, in degrees, and factors of the width.
const TURNS: [f64; 7] = [-15.0, -9.0, -4.0, 0.0, 4.0, 9.0, 15.0];
const TAPERS: [f64; 3] = [1.0 / 1.06, 1.0, 1.06];

/// Range of the width along a path, as a factor of its first.
const MIN_TAPER: f64 = 0.7;
const MAX_TAPER: f64 = 1.35;

/// Contrast, as a share of the first piece's, from which on a step raises the score: low, for a path may lead on into a
/// leaf. Where the stem ends is found afterwards.
const STEP_COST: f64 = 0.15;

/// Cost of a turn, per squared radian, and of a change of width, per unit of its logarithm.
const TURN_COST: f64 = 3.0;
const TAPER_COST: f64 = 0.5;

/// Contrast, as a multiple of the first piece's, above which a bar is something else, such as a lamp.
const MAX_CONTRAST: f64 = 1.25;

/// The end of a path.
#[derive(Clone, Copy, Debug)]
struct Node {
    at: PlanePoint,
    /// Direction, in radians from upright to the right.
    heading: f64,
    width: f64,
    /// Score of the path.
    score: f64,
    /// Width at the beginning of the path.
    first_width: f64,
    /// The node before; `None` at the beginning.
    predecessor: Option<usize>,
}

impl Node {
    /// Whether two paths end at nearly the same place and heading, so that only the better is kept.
    fn is_duplicate(&self, other: &Self) -> bool {
        let cell = |at: f64| (at / (0.3 * self.first_width)).floor();
        let sector = |heading: f64| (heading / 0.17).floor();
        cell(self.at[0]) == cell(other.at[0])
            && cell(self.at[1]) == cell(other.at[1])
            && sector(self.heading) == sector(other.heading)
    }
}

impl SmoothedImage {
    /// The path from `base` with the highest score, and its median width.
    pub(super) fn trace_ridge(&self, base: PlanePoint) -> Option<(Vec<PlanePoint>, f64)> {
        let (mut nodes, contrast) = self.first_nodes(base);
        if contrast <= 0.0 {
            return None;
        }
        let mut beam: Vec<usize> = (0..nodes.len()).collect();
        let mut best = 0;
        for _ in 0..MAX_STEPS {
            let mut candidates: Vec<Node> =
                beam.iter().flat_map(|&from| self.successors(&nodes, from, contrast)).collect();
            candidates.sort_by(|one, other| other.score.total_cmp(&one.score));
            // Non-maximum suppression keeps the beam from filling with copies of one path.
            beam.clear();
            for node in candidates {
                if beam.len() < BEAM_WIDTH
                    && !beam.iter().any(|&kept: &usize| nodes[kept].is_duplicate(&node))
                {
                    beam.push(nodes.len());
                    nodes.push(node);
                }
            }
            let Some(&leader) = beam.first() else { break };
            if nodes[leader].score > nodes[best].score {
                best = leader;
            } else if nodes[leader].score < nodes[best].score - 3.0 * nodes[leader].first_width - 8.0 {
                // No path regains so much: three widths of full contrast.
                break;
            }
        }
        let mut path = vec![nodes[best]];
        while let Some(predecessor) = path[path.len() - 1].predecessor {
            path.push(nodes[predecessor]);
        }
        path.reverse();
        let widths: Vec<f64> = path.iter().map(|node| node.width).collect();
        let line: Vec<PlanePoint> = path.iter().map(|node| node.at).collect();
        (line.len() > 2).then(|| (line, math::statistics::quantile_nearest(&widths, 0.5)))
    }

    /// The first nodes at `base`, the best first, and the contrast of the best first piece.
    fn first_nodes(&self, base: PlanePoint) -> (Vec<Node>, f64) {
        let max_width = MAX_WIDTH_SHARE * self.width.min(self.height) as f64;
        let widths = std::iter::successors(Some(MIN_WIDTH), |width| Some(width * WIDTH_RATIO))
            .take_while(|&width| width <= max_width);
        let mut pieces: Vec<(f64, Node)> = Vec::new();
        for width in widths {
            for degrees in (-MAX_LEAN..=MAX_LEAN).step_by(LEAN_STEP as usize) {
                let heading = f64::from(degrees).to_radians();
                for aside in [-0.5, -0.25, 0.0, 0.25, 0.5] {
                    let at = [base[0] + aside * width, base[1]];
                    let node = Node { at, heading, width, score: 0.0, first_width: width, predecessor: None };
                    pieces.push((self.piece_contrast(&node), node));
                }
            }
        }
        let greatest = pieces.iter().map(|piece| piece.0).fold(0.0, f64::max);
        let clear = pieces.iter().filter(|piece| piece.0 > MIN_CONTRAST_SHARE * greatest);
        let thinnest = clear.map(|piece| piece.1.width).fold(1e9, f64::min);
        pieces.retain(|piece| (thinnest..MAX_WIDTH_RATIO * thinnest).contains(&piece.1.width));
        pieces.sort_by(|one, other| other.0.total_cmp(&one.0));
        pieces.truncate(BEAM_WIDTH);
        let best = pieces.first().map_or(0.0, |piece| piece.0);
        let nodes = pieces.into_iter().filter(|piece| piece.0 > MIN_CONTRAST_SHARE * best);
        (nodes.map(|piece| piece.1).collect(), best)
    }

    /// Contrast of a first piece: the mean of the best of its bars.
    fn piece_contrast(&self, node: &Node) -> f64 {
        let (sin, cos) = (math::sin(node.heading), math::cos(node.heading));
        let mut bars: [f64; PIECE_BARS] = std::array::from_fn(|i| {
            let distance = 0.5 * i as f64 * node.width;
            let at = [node.at[0] + distance * sin, node.at[1] - distance * cos];
            self.bar_contrast(at, node.heading, node.width)
        });
        bars.sort_by(f64::total_cmp);
        bars[PIECE_BARS - COUNTED_BARS..].iter().sum::<f64>() / COUNTED_BARS as f64
    }

    /// The nodes that may follow one. `contrast` is that of the first piece.
    fn successors(&self, nodes: &[Node], from: usize, contrast: f64) -> Vec<Node> {
        let node = nodes[from];
        let length = 0.5 * node.first_width;
        let mut successors = Vec::new();
        for turn in TURNS.map(f64::to_radians) {
            // An arc: its chord has the mean heading.
            let (heading, chord) = (node.heading + turn, node.heading + turn / 2.0);
            let at = [node.at[0] + length * math::sin(chord), node.at[1] - length * math::cos(chord)];
            if !self.contains(at) || heading.abs() > std::f64::consts::PI {
                continue;
            }
            for taper in TAPERS {
                let width = node.width * taper;
                if width < MIN_TAPER * node.first_width || width > MAX_TAPER * node.first_width {
                    continue;
                }
                let relative = self.bar_contrast(at, heading, width) / contrast;
                let gain =
                    if relative > MAX_CONTRAST { MAX_CONTRAST / relative } else { relative.clamp(-0.5, 1.0) };
                let cost = STEP_COST + TURN_COST * turn * turn + TAPER_COST * math::ln(taper).abs();
                let score = node.score + length * (gain - cost);
                successors.push(Node { at, heading, width, score, predecessor: Some(from), ..node });
            }
        }
        successors
    }
}
