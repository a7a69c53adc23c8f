//! Shortest paths through one component, and the branches that leave them.
//!
//! In: one component of a plane. Out: paths along the middle of what is bright, the component's branches, and the
//! fork where a leaf branches off a path. The one idea: a step costs more near the edge, on dim tissue, and most
//! across a gap, so the cheapest path keeps to the middle of the stem.
//!
//! # References
//! - Dijkstra 1959, doi:10.1007/BF01386390: shortest paths.
//! - Bitter, Kaufman and Sato 2001, doi:10.1109/2945.942688: centre lines as shortest paths that are penalised near
//!   the edge.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::math::vector::{along, distance};
use crate::vision::detect::connected_components::BoundingBox;
use crate::vision::detect::curve::PlanePoint;
use crate::vision::detect::distance_transform::distance_transform;
use crate::vision::raster::plane::Plane;

/// Distance between the two places where a branch meets a path, in stem widths, from which on the branch touches the
/// stem below its fork. Chosen by hand.
const TOUCHING_WIDTHS: f64 = 3.0;

/// Costs of a step: far from any edge, what an edge adds over the squared distance to it, and across a gap. Chosen by hand:
/// a path is drawn to the middle of a stem that is a few samples wide, and crosses a gap only where no tissue leads on.
const MIDDLE_COST: u32 = 8;
const EDGE_COST: u32 = 288;
const GAP_COST: u32 = 800;

/// Least value that is used: the cost grows with the inverse square of the value, so that a path keeps to the bright
/// stem where a dim leaf hangs across it. Chosen by hand.
const MIN_VALUE: f64 = 0.25;

/// Least brightness of a sample that is no edge, as a share of the brightest one within [`RIDGE_RADIUS`]: the blurred
/// gap between a stem and a leaf that hangs beside it is darker. Chosen on the photographs of the bean with an even tens
/// digit: 0.5 and 0.7 do nearly as well.
const RIDGE_SHARE: f32 = 0.6;

/// Distance of an edge to the next sample beyond it: one straight step of [`distance_transform`].
const EDGE_DISTANCE: u32 = 3;

/// Radius in which the brightest sample is searched, in samples. Chosen by hand: the gap is narrower than twice as much.
const RIDGE_RADIUS: usize = 2;

/// "None" in tables of `u32`.
pub(super) const NONE: u32 = u32::MAX;

/// One component with the cost of a step onto each of its samples.
///
/// It is the component's bounding box with a margin for gaps, and a border of samples that no path enters, so that
/// each sample inside has neighbours on all sides.
pub(super) struct GeodesicGrid {
    /// Column and row in the plane of the first sample inside the border.
    origin: (usize, usize),
    /// Columns, including the border's two.
    width: usize,
    is_plant: Vec<bool>,
    /// Chamfer distance to the edge of the component: about three times the distance in samples.
    edge_distance: Vec<u32>,
    /// Cost of a step onto each sample; [`NONE`] where no path leads.
    step_cost: Vec<u32>,
}

impl GeodesicGrid {
    /// The grid of a component: the samples within `bounds` that `is_plant`. Gaps of up to `reach` - 1 samples are
    /// bridged, and the plant may go on behind samples that `may_hide` it.
    pub(super) fn new(
        plane: &Plane,
        bounds: BoundingBox,
        is_plant: impl Fn(usize) -> bool,
        may_hide: impl Fn(usize) -> bool,
        reach: usize,
    ) -> Self {
        let origin = (bounds.left.saturating_sub(reach), bounds.top.saturating_sub(reach));
        let inner = (bounds.right + reach).min(plane.width - 1) - origin.0 + 1;
        let height = (bounds.bottom + reach).min(plane.height - 1) - origin.1 + 1;
        let rows =
            || (origin.1..).take(height).map(|row| row * plane.width + origin.0..).map(|row| row.take(inner));
        let mask: Vec<bool> = rows().flatten().map(is_plant).collect();
        let distance = distance_transform(&mask, inner);
        let values: Vec<f32> = rows()
            .flatten()
            .zip(&mask)
            .map(|(at, &is_plant)| if is_plant { plane.values[at] } else { 0.0 })
            .collect();
        // A second transform measures the distance to the dark gap between stem and leaf, which is no edge of the component.
        let is_ridge = ridges(&values, inner);
        let ridge_distance = distance_transform(&is_ridge, inner);
        let width = inner + 2;
        let mut grid = Self {
            origin,
            width,
            is_plant: vec![false; width * (height + 2)],
            edge_distance: vec![0; width * (height + 2)],
            step_cost: vec![NONE; width * (height + 2)],
        };
        for (row, samples) in rows().enumerate() {
            for (column, sample) in samples.enumerate() {
                let (from, to) = (row * inner + column, (row + 1) * width + column + 1);
                (grid.is_plant[to], grid.edge_distance[to]) = (mask[from], distance[from]);
                if mask[from] {
                    let value = f64::from(values[from]).clamp(MIN_VALUE, 1.0);
                    let distance = if is_ridge[from] { ridge_distance[from] } else { EDGE_DISTANCE };
                    let cost = (MIDDLE_COST + EDGE_COST / (distance * distance)) as f64 / (value * value);
                    grid.step_cost[to] = cost as u32;
                } else if distance[from] < 3 * reach as u32 || may_hide(sample) {
                    grid.step_cost[to] = GAP_COST;
                }
            }
        }
        grid
    }

    /// The grid of a whole plane of `width` columns, with the cost of a step onto each sample; [`NONE`] where no path leads.
    pub(super) fn of_costs(costs: &[u32], width: usize) -> Self {
        let size = (width + 2) * (costs.len() / width + 2);
        let mut step_cost = vec![NONE; size];
        for (row, costs) in costs.chunks_exact(width).enumerate() {
            step_cost[(row + 1) * (width + 2) + 1..][..width].copy_from_slice(costs);
        }
        let (is_plant, edge_distance) = (vec![false; size], vec![0; size]);
        Self { origin: (0, 0), width: width + 2, is_plant, edge_distance, step_cost }
    }

    /// Column and row in the plane of a sample of the grid.
    pub(super) fn point(&self, at: usize) -> PlanePoint {
        let (column, row) = (self.origin.0 + at % self.width, self.origin.1 + at / self.width);
        [column as f64 - 1.0, row as f64 - 1.0]
    }

    /// The samples of the component, the highest first.
    pub(super) fn plant_samples(&self) -> impl Iterator<Item = usize> {
        (0..self.is_plant.len()).filter(|&at| self.is_plant[at])
    }

    /// Height of a sample above another, in samples.
    pub(super) fn height(&self, from: usize, at: usize) -> f64 {
        self.point(from)[1] - self.point(at)[1]
    }

    /// Width of the component at a sample in its middle, in samples.
    pub(super) fn width(&self, at: usize) -> f64 {
        (f64::from(2 * self.edge_distance[at]) / 3.0 - 1.0).max(1.0)
    }

    /// Removes some samples from the component; no path leads through them.
    pub(super) fn close(&mut self, is_closed: impl Fn(PlanePoint) -> bool) {
        for at in 0..self.is_plant.len() {
            if is_closed(self.point(at)) {
                (self.is_plant[at], self.step_cost[at]) = (false, NONE);
            }
        }
    }

    /// The sample at a point of the plane, plant or not; `None` outside of the grid.
    pub(super) fn sample(&self, [x, y]: PlanePoint) -> Option<usize> {
        let (x, y) = (x.round() - self.origin.0 as f64, y.round() - self.origin.1 as f64);
        let rows = self.is_plant.len() / self.width - 2;
        let is_inside = x >= 0.0 && y >= 0.0 && x < (self.width - 2) as f64 && y < rows as f64;
        is_inside.then_some((y as usize + 1) * self.width + x as usize + 1)
    }

    /// The plant sample nearest to a point.
    pub(super) fn nearest_sample(&self, point: PlanePoint) -> Option<usize> {
        let distances = self.plant_samples().map(|at| (at, distance(self.point(at), point)));
        distances.min_by(|one, other| one.1.total_cmp(&other.1)).map(|(at, _)| at)
    }

    /// The eight neighbours of a sample inside the border, and whether each is diagonal.
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

    /// The shortest paths from one sample to all others, by Dijkstra's algorithm.
    pub(super) fn shortest_paths(&self, start: usize) -> ShortestPaths {
        let mut costs = vec![u32::MAX; self.is_plant.len()];
        let mut predecessor = vec![NONE; self.is_plant.len()];
        // Cost in the upper half and sample in the lower: the cheapest first, and of equals the first sample.
        let key = |cost: u32, at: usize| Reverse(u64::from(cost) << 32 | at as u64);
        let mut queue = BinaryHeap::from([key(0, start)]);
        costs[start] = 0;
        predecessor[start] = start as u32;
        while let Some(Reverse(entry)) = queue.pop() {
            let (cost, at) = ((entry >> 32) as u32, entry as u32 as usize);
            // Lazy deletion: the queue still has this entry from before a cheaper path was found.
            if cost > costs[at] {
                continue;
            }
            for (next, is_diagonal) in self.neighbours(at) {
                let step = self.step_cost[next];
                if step == NONE {
                    continue;
                }
                // A diagonal step is 7/5 as long as a straight one.
                let path_cost = cost + step * if is_diagonal { 7 } else { 5 };
                if path_cost < costs[next] {
                    costs[next] = path_cost;
                    predecessor[next] = at as u32;
                    queue.push(key(path_cost, next));
                }
            }
        }
        ShortestPaths { predecessor }
    }

    /// The position along `path` of the first fork: where a branch leaves it that reaches at least `min_length`
    /// samples from it. `stem` is the stem's width.
    ///
    /// `up` and `down` are the shortest paths from the path's two ends. Traced back from a branch's end, the first
    /// meets the stem a little below the fork and the second a little above. Where they meet it far apart, the branch
    /// hangs down and touches the stem below: the upper place is the fork.
    pub(super) fn fork(
        &self,
        path: &[usize],
        up: &ShortestPaths,
        down: &ShortestPaths,
        stem: f64,
        min_length: f64,
    ) -> Option<usize> {
        let (nearest, distance) = self.distance_from_path(path);
        // The end of the longest branch at each position of the path.
        let mut ends = vec![None; path.len()];
        let is_far = |at: &usize| distance[*at] != NONE && f64::from(distance[*at]) >= min_length;
        // What is at most two samples wide is no leaf but the blurred edge of something in the background.
        let is_inside = |at: &usize| self.edge_distance[*at] > EDGE_DISTANCE;
        for at in (0..self.is_plant.len()).filter(is_far).filter(is_inside) {
            let end = &mut ends[nearest[at] as usize];
            if end.is_none_or(|farthest: usize| distance[at] > distance[farthest]) {
                *end = Some(at);
            }
        }
        let is_within = |at: usize, radius: f64| distance[at] != NONE && f64::from(distance[at]) <= radius;
        let fork = |end: usize| {
            // A branch whose middle is half a stem's width from the stem's joins it about 0.75 stem widths further
            // up.
            let below = nearest[up.trace_back(end, |at| is_within(at, 0.5 * stem))?] as usize
                + (0.75 * stem) as usize;
            // The path from above cuts the corner by up to a stem's width.
            let above = nearest[down.trace_back(end, |at| is_within(at, stem))?] as usize;
            let fork = if above as f64 - below as f64 > TOUCHING_WIDTHS * stem { above } else { below };
            // What lies beyond the end of the path belongs to that end.
            Some(fork).filter(|&fork| fork as f64 + stem < path.len() as f64)
        };
        ends.into_iter().flatten().filter_map(fork).min()
    }

    /// The point farthest from the edge on a ray within the component, at most `max_distance` samples long; `None`
    /// where the edge recedes to the end of the ray.
    pub(super) fn deepest(
        &self,
        start: PlanePoint,
        direction: PlanePoint,
        max_distance: f64,
    ) -> Option<PlanePoint> {
        let point = |i: usize| along(start, direction, 0.5 * i as f64);
        let steps = (2.0 * max_distance) as usize;
        let depths: Vec<u32> = (0..steps).map_while(|i| self.edge_distance_at(point(i))).collect();
        let most = depths.iter().max()?;
        let is_most = |depth: &u32| depth == most;
        let (first, last) = (depths.iter().position(is_most)?, depths.iter().rposition(is_most)?);
        (last + 1 < steps).then(|| point((first + last) / 2))
    }

    /// The distance to the edge at the plant sample nearest to a point; `None` outside the component.
    fn edge_distance_at(&self, point: PlanePoint) -> Option<u32> {
        let at = self.sample(point)?;
        self.is_plant[at].then(|| self.edge_distance[at])
    }

    /// Paths to the ends of the component's branches, the longest first: at most `count`, each ending at least
    /// `min_length` samples from those before it.
    pub(super) fn branches(
        &self,
        start: usize,
        up: &ShortestPaths,
        min_length: f64,
        count: usize,
    ) -> Vec<Vec<usize>> {
        // Farthest-point traversal: each branch ends where the tissue is farthest from all branches before.
        let mut distance = vec![NONE; self.is_plant.len()];
        let mut branches = Vec::new();
        self.spread(&mut distance, vec![start], |_, _| {});
        while branches.len() < count {
            // Tissue that is not connected to the start without a gap is no branch.
            let connected = (0..self.is_plant.len()).filter(|&at| distance[at] != NONE);
            let farthest = connected.max_by_key(|&at| distance[at]);
            let Some(path) =
                farthest.filter(|&at| f64::from(distance[at]) >= min_length).and_then(|at| up.path_to(at))
            else {
                break;
            };
            self.spread(&mut distance, path.clone(), |_, _| {});
            branches.push(path);
        }
        branches
    }

    /// For each plant sample that is connected to the path, the position along the path that is nearest, and its
    /// distance in steps; [`NONE`] elsewhere.
    fn distance_from_path(&self, path: &[usize]) -> (Vec<u32>, Vec<u32>) {
        let mut nearest = vec![NONE; self.is_plant.len()];
        let mut distance = vec![NONE; self.is_plant.len()];
        for (i, &at) in (0..).zip(path) {
            nearest[at] = i;
        }
        self.spread(&mut distance, path.to_vec(), |next, at| nearest[next] = nearest[at]);
        (nearest, distance)
    }

    /// Lowers distances in steps to those from the samples of `front`, breadth first. `reached` is called for each
    /// sample that is now nearer, with the neighbour before it.
    fn spread(&self, distance: &mut [u32], mut front: Vec<usize>, mut reached: impl FnMut(usize, usize)) {
        front.iter().for_each(|&at| distance[at] = 0);
        let mut next_front = Vec::new();
        for steps in 1.. {
            if front.is_empty() {
                return;
            }
            for at in front.drain(..) {
                for (next, _) in self.neighbours(at) {
                    if self.is_plant[next] && steps < distance[next] {
                        distance[next] = steps;
                        reached(next, at);
                        next_front.push(next);
                    }
                }
            }
            std::mem::swap(&mut front, &mut next_front);
        }
    }
}

/// Which of the plant's samples are no edges, in rows of `width` samples; `values` are 0 outside the plant.
fn ridges(values: &[f32], width: usize) -> Vec<bool> {
    let last = values.len() / width - 1;
    let across: Vec<f32> = (0..values.len())
        .map(|at| {
            let (left, right) = ((at % width).min(RIDGE_RADIUS), (width - 1 - at % width).min(RIDGE_RADIUS));
            values[at - left..=at + right].iter().copied().fold(0.0, f32::max)
        })
        .collect();
    let is_ridge = |at: usize| {
        let (row, column) = (at / width, at % width);
        let rows = row.saturating_sub(RIDGE_RADIUS)..=(row + RIDGE_RADIUS).min(last);
        let brightest = rows.map(|row| across[row * width + column]).fold(0.0, f32::max);
        values[at] > 0.0 && values[at] >= RIDGE_SHARE * brightest
    };
    (0..values.len()).map(is_ridge).collect()
}

/// The shortest paths from one sample to all others.
pub(super) struct ShortestPaths {
    /// The sample before each one on its path, and the start for itself; [`NONE`] where no path leads.
    predecessor: Vec<u32>,
}

impl ShortestPaths {
    fn predecessor(&self, at: usize) -> Option<usize> {
        Some(self.predecessor[at]).filter(|&before| before != NONE).map(|before| before as usize)
    }

    /// Whether a path leads to a sample.
    pub(super) fn leads_to(&self, at: usize) -> bool {
        self.predecessor(at).is_some()
    }

    /// The path from the start to `goal`; `None` where no path leads.
    pub(super) fn path_to(&self, goal: usize) -> Option<Vec<usize>> {
        let mut path = vec![goal];
        loop {
            let at = path[path.len() - 1];
            let before = self.predecessor(at)?;
            if before == at {
                path.reverse();
                return Some(path);
            }
            path.push(before);
        }
    }

    /// A value for each sample to which a path leads: the start's, changed by `step` from sample to sample along the path.
    pub(super) fn along_paths<T: Copy>(&self, start: T, step: impl Fn(usize, T) -> T) -> Vec<Option<T>> {
        let mut values: Vec<Option<T>> = vec![None; self.predecessor.len()];
        let mut path = Vec::new();
        for goal in 0..values.len() {
            // Back to the first sample with a value, then forwards: each sample is visited once.
            let mut at = goal;
            while values[at].is_none()
                && let Some(before) = self.predecessor(at)
            {
                if before == at {
                    values[at] = Some(start);
                } else {
                    path.push((before, at));
                    at = before;
                }
            }
            while let Some((before, next)) = path.pop() {
                values[next] = values[before].map(|value| step(next, value));
            }
        }
        values
    }

    /// The first sample on the path from `at` back to the start that is `wanted`; `None` where none is.
    fn trace_back(&self, mut at: usize, wanted: impl Fn(usize) -> bool) -> Option<usize> {
        while !wanted(at) {
            at = self.predecessor(at).filter(|&before| before != at)?;
        }
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::detect::testing::plane;

    /// A plane of dots (background), digits (tenths of plant) and `#` (plant).
    fn grid(rows: &[&str], reach: usize) -> GeodesicGrid {
        let value = |byte: u8| match byte {
            b'#' => 1.0,
            b'1'..=b'9' => f32::from(byte - b'0') / 10.0,
            _ => 0.0,
        };
        let values: Vec<f32> = rows.iter().flat_map(|row| row.bytes().map(value)).collect();
        let plane = plane(rows[0].len(), values);
        let bounds = BoundingBox { left: 0, right: plane.width - 1, top: 0, bottom: rows.len() - 1 };
        GeodesicGrid::new(&plane, bounds, |at| plane.values[at] > 0.0, |_| false, reach)
    }

    #[test]
    fn a_blurred_gap_is_an_edge() {
        let values = [1.0, 1.0, 1.0, 0.5, 0.5, 1.0, 1.0, 0.0];
        assert_eq!(ridges(&values, 8), [true, true, true, false, false, true, true, false]);
        // Shade falls off slowly.
        assert_eq!(ridges(&[1.0, 0.9, 0.8, 0.7, 0.6, 0.5], 6), [true; 6]);
    }

    fn path(grid: &GeodesicGrid, from: PlanePoint, to: PlanePoint) -> Option<Vec<PlanePoint>> {
        let path = grid.shortest_paths(grid.nearest_sample(from)?).path_to(grid.nearest_sample(to)?)?;
        Some(path.into_iter().map(|at| grid.point(at)).collect())
    }

    #[test]
    fn the_path_keeps_to_the_bright_side_of_a_loop() {
        let loop_ = grid(
            &["..#####..", "..#...3..", "..#...3..", "..#...3..", "..#####..", "....#....", "....#...."],
            1,
        );
        let found = path(&loop_, [4.0, 6.0], [5.0, 0.0]).unwrap();
        assert!(found.contains(&[2.0, 2.0]) && !found.contains(&[6.0, 2.0]), "{found:?}");
    }

    #[test]
    fn a_leaf_is_a_fork_and_a_thread_of_the_background_is_none() {
        // A stem three samples wide with a branch of 14 samples to its right, as wide or a single sample wide.
        let fork = |branch: usize| {
            let mut rows = vec!["..###................"; 24];
            rows[12..12 + branch].fill("..###################");
            let grid = grid(&rows, 1);
            let ends = [[3.0, 23.0], [3.0, 0.0]].map(|end| grid.nearest_sample(end).unwrap());
            let [up, down] = ends.map(|end| grid.shortest_paths(end));
            grid.fork(&up.path_to(ends[1]).unwrap(), &up, &down, 3.0, 8.0)
        };
        assert_eq!(fork(1), None);
        assert!(fork(3).is_some_and(|at| at.abs_diff(10) <= 3), "{:?}", fork(3));
    }

    #[test]
    fn a_gap_is_crossed_within_reach_only() {
        let rows = ["#", "#", ".", ".", "#", "#"];
        assert_eq!(path(&grid(&rows, 3), [0.0, 5.0], [0.0, 0.0]).map(|path| path.len()), Some(6));
        assert_eq!(path(&grid(&rows, 1), [0.0, 5.0], [0.0, 0.0]), None);
    }
}
