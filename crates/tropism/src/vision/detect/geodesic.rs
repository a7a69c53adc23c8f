//! The cheapest ways through one plant, and where its limbs leave them.
//!
//! In: the samples of one part of a plane. Out: ways along the middle of what is bright, and the fork where a leaf parts
//! from the stem. The one idea: a step costs more at the edge, on dim tissue, and most across a gap.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::vision::detect::connected_components::BoundingBox;
use crate::vision::detect::curve::Place;
use crate::vision::detect::distance_transform::distance_transform;
use crate::vision::raster::plane::Plane;

/// A limb touches the stem below its fork when its two ways meet the stem this many stem widths apart.
const TOUCHING: f64 = 3.0;

/// The cost of a step on a gap in the plant, where one in the middle of a thick stem costs 8.
const GAP: u32 = 800;

/// The least value that counts: a step costs as much more as the square of the value is less, so that the way keeps to
/// the bright stem where a dim leaf hangs across.
const FAINT: f64 = 0.25;

/// What stands for "none" in the tables below.
const NONE: u32 = u32::MAX;

/// The smallest rectangle around one part of a plane, with a margin, and a border of samples that no way enters, so that
/// each sample within has neighbours on all sides.
pub(super) struct GeodesicMask {
    /// Column and row in the plane of the first sample within the border.
    origin: (usize, usize),
    /// Columns, the border's two included.
    width: usize,
    is_part: Vec<bool>,
    /// Three times the way from each sample to the plant's edge.
    depth: Vec<u32>,
    /// What a step onto each sample costs; [`NONE`] where there is no way.
    step: Vec<u32>,
}

impl GeodesicMask {
    pub(super) fn of_component(
        plane: &Plane,
        bounds: BoundingBox,
        is_part: impl Fn(usize) -> bool,
        reach: usize,
    ) -> Self {
        let origin = (bounds.left.saturating_sub(reach), bounds.top.saturating_sub(reach));
        let inner = (bounds.right + reach).min(plane.width - 1) - origin.0 + 1;
        let height = (bounds.bottom + reach).min(plane.height - 1) - origin.1 + 1;
        let rows =
            || (origin.1..).take(height).map(|row| row * plane.width + origin.0..).map(|row| row.take(inner));
        let inside: Vec<bool> = rows().flatten().map(is_part).collect();
        let depth = distance_transform(&inside, inner);
        let width = inner + 2;
        let mut window = Self {
            origin,
            width,
            is_part: vec![false; width * (height + 2)],
            depth: vec![0; width * (height + 2)],
            step: vec![NONE; width * (height + 2)],
        };
        for (row, from) in rows().enumerate() {
            for (column, from) in from.enumerate() {
                let (at, to) = (row * inner + column, (row + 1) * width + column + 1);
                (window.is_part[to], window.depth[to]) = (inside[at], depth[at]);
                if inside[at] {
                    let value = f64::from(plane.values[from]).clamp(FAINT, 1.0);
                    window.step[to] = ((8 + 288 / (depth[at] * depth[at])) as f64 / (value * value)) as u32;
                } else if depth[at] < 3 * reach as u32 {
                    window.step[to] = GAP;
                }
            }
        }
        window
    }

    pub(super) fn place(&self, at: usize) -> Place {
        let (column, row) = (self.origin.0 + at % self.width, self.origin.1 + at / self.width);
        (column as f64 - 1.0, row as f64 - 1.0)
    }

    /// The sample of the part that is nearest to a place.
    pub(super) fn nearest_sample(&self, place: Place) -> Option<usize> {
        let square = |at: usize| {
            let (x, y) = self.place(at);
            (x - place.0) * (x - place.0) + (y - place.1) * (y - place.1)
        };
        let part = (0..self.is_part.len()).filter(|&at| self.is_part[at]);
        part.map(|at| (at, square(at))).min_by(|one, other| one.1.total_cmp(&other.1)).map(|(at, _)| at)
    }

    /// The samples around one within the border, and whether they lie across a corner.
    fn neighbours(&self, at: usize) -> [(usize, bool); 8] {
        let (above, below) = (at - self.width, at + self.width);
        [
            (above - 1, true),
            (above, false),
            (above + 1, true),
            (at - 1, false),
            (at + 1, false),
            (below - 1, true),
            (below, false),
            (below + 1, true),
        ]
    }

    pub(super) fn shortest_paths(&self, start: usize) -> ShortestPaths {
        let mut costs = vec![u32::MAX; self.is_part.len()];
        let mut predecessor = vec![NONE; self.is_part.len()];
        // Cost above, sample below: the cheapest first, and of equals the first.
        let key = |cost: u32, at: usize| Reverse(u64::from(cost) << 32 | at as u64);
        let mut open = BinaryHeap::from([key(0, start)]);
        costs[start] = 0;
        predecessor[start] = start as u32;
        while let Some(Reverse(key_of)) = open.pop() {
            let (cost, at) = ((key_of >> 32) as u32, key_of as u32 as usize);
            if cost > costs[at] {
                continue;
            }
            for (next, is_diagonal) in self.neighbours(at) {
                let step = self.step[next];
                if step == NONE {
                    continue;
                }
                let reached = cost + step * if is_diagonal { 7 } else { 5 };
                if reached < costs[next] {
                    costs[next] = reached;
                    predecessor[next] = at as u32;
                    open.push(key(reached, next));
                }
            }
        }
        ShortestPaths { predecessor }
    }

    /// The place along the way at which the first limb leaves it that reaches at least `least` samples from it.
    ///
    /// `up` and `down` are the ways from the way's two ends. Going back from a limb's end, the one meets the stem a
    /// little below the fork, the other a little above. Where they meet it far from each other the limb hangs down and
    /// touches the stem below: the upper place is the fork.
    pub(super) fn fork(
        &self,
        way: &[usize],
        up: &ShortestPaths,
        down: &ShortestPaths,
        stem: f64,
        least: f64,
    ) -> Option<usize> {
        let (nearest, distance) = self.distance_from_path(way);
        let mut ends = vec![None; way.len()];
        for at in
            (0..self.is_part.len()).filter(|&at| distance[at] != NONE && f64::from(distance[at]) >= least)
        {
            let end = &mut ends[nearest[at] as usize];
            if end.is_none_or(|farthest: usize| distance[at] > distance[farthest]) {
                *end = Some(at);
            }
        }
        let is_near = |at: usize, far: f64| distance[at] != NONE && f64::from(distance[at]) <= far;
        let fork = |end: usize| {
            // Where a limb's middle is half a stem's width away from the stem's, the two meet about as far on.
            let below =
                nearest[up.trace_back(end, |at| is_near(at, 0.5 * stem))?] as usize + (0.75 * stem) as usize;
            // The way down cuts the corner by up to a stem's width.
            let above = nearest[down.trace_back(end, |at| is_near(at, stem))?] as usize;
            let fork = if above as f64 - below as f64 > TOUCHING * stem { above } else { below };
            // What lies beyond the way's end is the end's own.
            Some(fork).filter(|&fork| fork as f64 + stem < way.len() as f64)
        };
        ends.into_iter().flatten().filter_map(fork).min()
    }

    /// Where the plant is deepest on a straight line from a place in it, along a unit vector, before the line leaves it or
    /// after `far` samples at most; `None` where it gets deeper to the last.
    pub(super) fn deepest(&self, from: Place, along: Place, far: f64) -> Option<Place> {
        let place = |i: usize| (from.0 + 0.5 * i as f64 * along.0, from.1 + 0.5 * i as f64 * along.1);
        let depths: Vec<u32> = (0..(2.0 * far) as usize).map_while(|i| self.depth_at(place(i))).collect();
        let most = depths.iter().max()?;
        let is_most = |depth: &u32| depth == most;
        let (first, last) = (depths.iter().position(is_most)?, depths.iter().rposition(is_most)?);
        (last + 1 < (2.0 * far) as usize).then(|| place((first + last) / 2))
    }

    /// The depth of the sample of the part that is nearest to a place; `None` outside.
    fn depth_at(&self, place: Place) -> Option<u32> {
        let (x, y) =
            (place.0.round() - self.origin.0 as f64 + 1.0, place.1.round() - self.origin.1 as f64 + 1.0);
        let is_inside = x >= 0.0 && y >= 0.0 && x < self.width as f64;
        let at = is_inside.then_some(y as usize * self.width + x as usize)?;
        self.is_part.get(at)?.then(|| self.depth[at])
    }

    /// The ways to the ends of the part, the longest limb first: each reaches at least `least` samples from those before
    /// it, and there are at most `most`.
    pub(super) fn branches(
        &self,
        start: usize,
        up: &ShortestPaths,
        least: f64,
        most: usize,
    ) -> Vec<Vec<usize>> {
        let mut distance = vec![NONE; self.is_part.len()];
        let mut limbs = Vec::new();
        self.relax_outwards(&mut distance, vec![start], |_, _| {});
        while limbs.len() < most {
            // What cannot be walked to from the start is no limb.
            let walked = (0..self.is_part.len()).filter(|&at| distance[at] != NONE);
            let farthest = walked.max_by_key(|&at| distance[at]);
            let Some(way) =
                farthest.filter(|&at| f64::from(distance[at]) >= least).and_then(|at| up.path_to(at))
            else {
                break;
            };
            self.relax_outwards(&mut distance, way.clone(), |_, _| {});
            limbs.push(way);
        }
        limbs
    }

    /// For each sample of the part that can be walked to on the part, the place along the way that is nearest, and how
    /// far it is; [`NONE`] elsewhere.
    fn distance_from_path(&self, way: &[usize]) -> (Vec<u32>, Vec<u32>) {
        let mut nearest = vec![NONE; self.is_part.len()];
        let mut distance = vec![NONE; self.is_part.len()];
        for (i, &at) in (0..).zip(way) {
            nearest[at] = i;
        }
        self.relax_outwards(&mut distance, way.to_vec(), |next, at| nearest[next] = nearest[at]);
        (nearest, distance)
    }

    /// Makes of distances those to what is nearer: `ring` or what they were measured to; `tell` hears of each sample that
    /// is now nearer, and by which it was reached.
    fn relax_outwards(&self, distance: &mut [u32], mut ring: Vec<usize>, mut tell: impl FnMut(usize, usize)) {
        ring.iter().for_each(|&at| distance[at] = 0);
        let mut next_ring = Vec::new();
        for far in 1.. {
            if ring.is_empty() {
                return;
            }
            for at in ring.drain(..) {
                for (next, _) in self.neighbours(at) {
                    if self.is_part[next] && far < distance[next] {
                        distance[next] = far;
                        tell(next, at);
                        next_ring.push(next);
                    }
                }
            }
            std::mem::swap(&mut ring, &mut next_ring);
        }
    }
}

/// The cheapest ways from one sample to all others.
pub(super) struct ShortestPaths {
    /// For each sample the one before it, and the start for itself; [`NONE`] where no way leads.
    predecessor: Vec<u32>,
}

impl ShortestPaths {
    /// The sample before one on the way to it; `None` where no way leads.
    fn predecessor(&self, at: usize) -> Option<usize> {
        Some(self.predecessor[at])
            .filter(|&predecessor| predecessor != NONE)
            .map(|predecessor| predecessor as usize)
    }

    /// The way to `goal`, from the start; `None` where no way leads.
    pub(super) fn path_to(&self, goal: usize) -> Option<Vec<usize>> {
        let mut way = vec![goal];
        loop {
            let at = way[way.len() - 1];
            let predecessor = self.predecessor(at)?;
            if predecessor == at {
                way.reverse();
                return Some(way);
            }
            way.push(predecessor);
        }
    }

    /// The first sample on the way back from `at` that is `wanted`; `None` where none is.
    fn trace_back(&self, mut at: usize, wanted: impl Fn(usize) -> bool) -> Option<usize> {
        while !wanted(at) {
            at = self.predecessor(at).filter(|&predecessor| predecessor != at)?;
        }
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane of dots (background), digits (tenths of plant) and `#` (plant).
    fn window(rows: &[&str], reach: usize) -> GeodesicMask {
        let value = |byte: u8| match byte {
            b'#' => 1.0,
            b'1'..=b'9' => f32::from(byte - b'0') / 10.0,
            _ => 0.0,
        };
        let values: Vec<f32> = rows.iter().flat_map(|row| row.bytes().map(value)).collect();
        let (width, height) = (rows[0].len(), rows.len());
        let plane = Plane { width, height, values, origin: (0.0, 0.0), step: 1 };
        let bounds = BoundingBox { left: 0, right: width - 1, top: 0, bottom: height - 1 };
        GeodesicMask::of_component(&plane, bounds, |at| plane.values[at] > 0.0, reach)
    }

    fn way(window: &GeodesicMask, from: Place, to: Place) -> Option<Vec<Place>> {
        let way = window.shortest_paths(window.nearest_sample(from)?).path_to(window.nearest_sample(to)?)?;
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
