//! The cheapest ways through one plant, and where its limbs leave them.
//!
//! In: the samples of one part of a plane. Out: ways along the middle of what is bright, and the fork where a leaf parts
//! from the stem. The one idea: a step costs more at the edge, on dim tissue, and most across a gap.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::vision::midline::Place;
use crate::vision::parts::Bounds;
use crate::vision::segment::Plane;

/// A limb touches the stem below its fork when its two ways meet the stem this many stem widths apart.
const TOUCHING: f64 = 3.0;

/// The cost of a step on a gap in the plant, where one in the middle of a thick stem costs 8.
const GAP: u32 = 800;

/// The least value that counts: a step costs as much more as the square of the value is less, so that the way keeps to
/// the bright stem where a dim leaf hangs across.
const FAINT: f64 = 0.25;

/// The smallest rectangle around one part of a plane, with a margin.
pub(super) struct Window {
    origin: (usize, usize),
    width: usize,
    is_part: Vec<bool>,
    /// What a step onto each sample costs; `None` where there is no way.
    step: Vec<Option<u32>>,
}

impl Window {
    pub(super) fn around(
        plane: &Plane,
        bounds: Bounds,
        is_part: impl Fn(usize) -> bool,
        reach: usize,
    ) -> Self {
        let origin = (bounds.left.saturating_sub(reach), bounds.top.saturating_sub(reach));
        let width = (bounds.right + reach).min(plane.width - 1) - origin.0 + 1;
        let height = (bounds.bottom + reach).min(plane.height - 1) - origin.1 + 1;
        let is_part: Vec<bool> = (0..width * height)
            .map(|at| is_part((origin.1 + at / width) * plane.width + origin.0 + at % width))
            .collect();
        let depth = depth(&is_part, width);
        let step = (0..is_part.len())
            .map(|at| {
                let from = (origin.1 + at / width) * plane.width + origin.0 + at % width;
                let value = f64::from(plane.values[from]).clamp(FAINT, 1.0);
                match () {
                    () if is_part[at] => {
                        Some(((8 + 288 / (depth[at] * depth[at])) as f64 / (value * value)) as u32)
                    }
                    () if depth[at] < 3 * reach as u32 => Some(GAP),
                    () => None,
                }
            })
            .collect();
        Self { origin, width, is_part, step }
    }

    pub(super) fn place(&self, at: usize) -> Place {
        ((self.origin.0 + at % self.width) as f64, (self.origin.1 + at / self.width) as f64)
    }

    /// The sample of the part that is nearest to a place.
    pub(super) fn nearest(&self, place: Place) -> Option<usize> {
        let square = |at: usize| {
            let (x, y) = self.place(at);
            (x - place.0) * (x - place.0) + (y - place.1) * (y - place.1)
        };
        let part = (0..self.is_part.len()).filter(|&at| self.is_part[at]);
        part.min_by(|&one, &other| square(one).total_cmp(&square(other)))
    }

    /// The samples around one, and whether they lie across a corner.
    fn around_sample(&self, at: usize) -> impl Iterator<Item = (usize, bool)> {
        let (x, y) = (at % self.width, at / self.width);
        let (width, height) = (self.width, self.is_part.len() / self.width);
        (y.saturating_sub(1)..(y + 2).min(height)).flat_map(move |row| {
            (x.saturating_sub(1)..(x + 2).min(width))
                .map(move |column| (row * width + column, row != y && column != x))
        })
    }

    pub(super) fn ways(&self, start: usize) -> Ways {
        let mut costs = vec![u32::MAX; self.is_part.len()];
        let mut before = vec![None; self.is_part.len()];
        let mut open = BinaryHeap::from([Reverse((0, start))]);
        costs[start] = 0;
        before[start] = Some(start);
        while let Some(Reverse((cost, at))) = open.pop() {
            if cost > costs[at] {
                continue;
            }
            for (next, is_diagonal) in self.around_sample(at) {
                let Some(step) = self.step[next] else { continue };
                let reached = cost + step * if is_diagonal { 7 } else { 5 };
                if reached < costs[next] {
                    costs[next] = reached;
                    before[next] = Some(at);
                    open.push(Reverse((reached, next)));
                }
            }
        }
        Ways { before }
    }

    /// The place along the way at which the first limb leaves it that reaches at least `least` samples from it.
    ///
    /// `up` and `down` are the ways from the way's two ends. Going back from a limb's end, the one meets the stem a
    /// little below the fork, the other a little above. Where they meet it far from each other the limb hangs down and
    /// touches the stem below: the upper place is the fork.
    pub(super) fn fork(&self, way: &[usize], up: &Ways, down: &Ways, stem: f64, least: f64) -> Option<usize> {
        let (nearest, distance) = self.away(way);
        let mut ends = vec![None; way.len()];
        for at in (0..self.is_part.len()).filter(|&at| f64::from(distance[at]) >= least) {
            let end = &mut ends[nearest[at]];
            if end.is_none_or(|farthest: usize| distance[at] > distance[farthest]) {
                *end = Some(at);
            }
        }
        let is_near = |at: usize, far: f64| nearest[at] < way.len() && f64::from(distance[at]) <= far;
        let fork = |end: usize| {
            // Where a limb's middle is half a stem's width away from the stem's, the two meet about as far on.
            let below = nearest[up.back(end, |at| is_near(at, 0.5 * stem))?] + (0.75 * stem) as usize;
            // The way down cuts the corner by up to a stem's width.
            let above = nearest[down.back(end, |at| is_near(at, stem))?];
            let fork = if above as f64 - below as f64 > TOUCHING * stem { above } else { below };
            // What lies beyond the way's end is the end's own.
            Some(fork).filter(|&fork| fork as f64 + stem < way.len() as f64)
        };
        ends.into_iter().flatten().filter_map(fork).min()
    }

    /// The ways to the ends of the part, the longest limb first: each reaches at least `least` samples from those before
    /// it, and there are at most `most`.
    pub(super) fn limbs(&self, start: usize, up: &Ways, least: f64, most: usize) -> Vec<Vec<usize>> {
        let mut seen = vec![start];
        let mut limbs = Vec::new();
        while limbs.len() < most {
            let (_, distance) = self.away(&seen);
            let farthest =
                (0..self.is_part.len()).filter(|&at| self.is_part[at]).max_by_key(|&at| distance[at]);
            let Some(way) = farthest.filter(|&at| f64::from(distance[at]) >= least).and_then(|at| up.to(at))
            else {
                break;
            };
            seen.extend(&way);
            limbs.push(way);
        }
        limbs
    }

    /// For each sample of the part the place along the way that is nearest, walking on the part, and how far it is.
    fn away(&self, way: &[usize]) -> (Vec<usize>, Vec<u32>) {
        let mut nearest = vec![usize::MAX; self.is_part.len()];
        let mut distance = vec![0; self.is_part.len()];
        for (i, &at) in way.iter().enumerate() {
            nearest[at] = i;
        }
        let mut ring: Vec<usize> = way.to_vec();
        while !ring.is_empty() {
            let mut next_ring = Vec::new();
            for at in ring {
                for (next, _) in self.around_sample(at) {
                    if self.is_part[next] && nearest[next] == usize::MAX {
                        nearest[next] = nearest[at];
                        distance[next] = distance[at] + 1;
                        next_ring.push(next);
                    }
                }
            }
            ring = next_ring;
        }
        (nearest, distance)
    }
}

/// The cheapest ways from one sample to all others.
pub(super) struct Ways {
    /// For each sample the one before it, and the start for itself; `None` where no way leads.
    before: Vec<Option<usize>>,
}

impl Ways {
    /// The way to `goal`, from the start; `None` where no way leads.
    pub(super) fn to(&self, goal: usize) -> Option<Vec<usize>> {
        let mut way = vec![goal];
        while self.before[way[way.len() - 1]]? != way[way.len() - 1] {
            way.extend(self.before[way[way.len() - 1]]);
        }
        way.reverse();
        Some(way)
    }

    /// The first sample on the way back from `at` that is `wanted`; `None` where none is.
    fn back(&self, mut at: usize, wanted: impl Fn(usize) -> bool) -> Option<usize> {
        while !wanted(at) {
            at = self.before[at].filter(|&before| before != at)?;
        }
        Some(at)
    }
}

/// Three times the way (four across a corner) to the nearest sample of the other kind; what lies outside is of neither.
fn depth(is_part: &[bool], width: usize) -> Vec<u32> {
    let height = is_part.len() / width;
    let mut depth = vec![u32::from(u16::MAX); is_part.len()];
    let relax = |depth: &mut Vec<u32>, at: usize, other: usize, step: u32| {
        let from = if is_part[other] == is_part[at] { depth[other] } else { 0 };
        depth[at] = depth[at].min(from + step);
    };
    for at in 0..is_part.len() {
        let (x, y) = (at % width, at / width);
        if x > 0 {
            relax(&mut depth, at, at - 1, 3);
        }
        if y > 0 {
            relax(&mut depth, at, at - width, 3);
            if x > 0 {
                relax(&mut depth, at, at - width - 1, 4);
            }
            if x + 1 < width {
                relax(&mut depth, at, at - width + 1, 4);
            }
        }
    }
    for at in (0..is_part.len()).rev() {
        let (x, y) = (at % width, at / width);
        if x + 1 < width {
            relax(&mut depth, at, at + 1, 3);
        }
        if y + 1 < height {
            relax(&mut depth, at, at + width, 3);
            if x + 1 < width {
                relax(&mut depth, at, at + width + 1, 4);
            }
            if x > 0 {
                relax(&mut depth, at, at + width - 1, 4);
            }
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane of dots (background), digits (tenths of plant) and `#` (plant).
    fn window(rows: &[&str], reach: usize) -> Window {
        let value = |byte: u8| match byte {
            b'#' => 1.0,
            b'1'..=b'9' => f32::from(byte - b'0') / 10.0,
            _ => 0.0,
        };
        let values: Vec<f32> = rows.iter().flat_map(|row| row.bytes().map(value)).collect();
        let (width, height) = (rows[0].len(), rows.len());
        let plane = Plane { width, height, values, origin: (0.0, 0.0), step: 1 };
        let bounds = Bounds { left: 0, right: width - 1, top: 0, bottom: height - 1 };
        Window::around(&plane, bounds, |at| plane.values[at] > 0.0, reach)
    }

    fn way(window: &Window, from: Place, to: Place) -> Option<Vec<Place>> {
        let way = window.ways(window.nearest(from)?).to(window.nearest(to)?)?;
        Some(way.into_iter().map(|at| window.place(at)).collect())
    }

    #[test]
    fn the_way_keeps_to_the_bright_side_of_a_loop() {
        let loop_ = window(
            &["..#####..", "..#...3..", "..#...3..", "..#...3..", "..#####..", "....#....", "....#...."],
            1,
        );
        let found = way(&loop_, (4.0, 6.0), (5.0, 0.0)).unwrap();
        assert!(found.contains(&(2.0, 2.0)) && !found.contains(&(6.0, 2.0)), "{found:?}");
    }

    #[test]
    fn a_gap_is_crossed_within_reach_only() {
        let rows = ["#", "#", ".", ".", "#", "#"];
        assert_eq!(way(&window(&rows, 3), (0.0, 5.0), (0.0, 0.0)).map(|way| way.len()), Some(6));
        assert_eq!(way(&window(&rows, 1), (0.0, 5.0), (0.0, 0.0)), None);
    }
}
