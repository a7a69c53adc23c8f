//! Detection of the inner corners of a checkerboard, to a fraction of a pixel.
//!
//! In: a picture, and the number of corners of the board. Out: the corners' pixels, each with its position on the
//! board. The one idea: on a ring around a corner opposite samples are alike and samples a quarter turn apart differ.
//! Corners with such a response are grown into a grid from one of them, and refined by the gradients around them.
//!
//! # References
//! - Bennett and Lasenby 2014, *ChESS: quick and robust detection of chess-board features*,
//!   doi:10.1016/j.cviu.2013.10.008: the corner response.
//! - Förstner and Gülch 1987, *A fast operator for detection and precise location of distinct points, corners and
//!   centres of circular features*: the refinement, as in OpenCV's `cornerSubPix`.

use std::collections::{BTreeMap, VecDeque};

use crate::geometry::{Pixel, Point};
use crate::math::vector::{Vec2, add, along, distance, norm, scale, sub};
use crate::photo::Image;
use crate::vision::raster::filter;
use crate::vision::raster::plane::{LUMA, Plane};

/// A checkerboard, by its inner corners, where four squares meet: one fewer each way than squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    /// Number of inner corners along one side, at least 3.
    pub columns: usize,
    /// Number of inner corners along the other side, at least 3.
    pub rows: usize,
    /// Side length of a square, in cm.
    pub square_cm: f64,
}

/// The picture does not show the whole board.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "found {found} inner corners of a checkerboard, wanted {columns} x {rows}: the whole board in view, sharp, without glare"
)]
pub struct BoardNotFound {
    /// Number of corners of the largest grid found.
    pub found: usize,
    /// Number of corners wanted along one side.
    pub columns: usize,
    /// Number of corners wanted along the other side.
    pub rows: usize,
}

/// Most columns of the picture in which corners are searched; larger ones are downscaled. Chosen by hand.
const SEARCH_COLUMNS: usize = 1_000;

/// Radius of the ring of sixteen samples around a corner, in pixels of the searched picture: that of Bennett and
/// Lasenby.
const RING_RADIUS: f64 = 5.0;

/// Least response of a corner, as a share of the strongest. Chosen by hand.
const MIN_RESPONSE: f32 = 0.15;

/// Greatest distance of a corner from its predicted position, as a share of a square. Chosen by hand.
const MAX_DEVIATION: f64 = 0.3;

/// Number of the strongest corners from which growing a grid is tried. Chosen by hand.
const SEEDS: usize = 40;

impl Checkerboard {
    /// Finds the board's corners in a picture, each with its position on the board in cm.
    ///
    /// # Errors
    /// [`BoardNotFound`] if not all of them are found.
    pub fn find(&self, image: &Image) -> Result<Vec<(Pixel, Point)>, BoardNotFound> {
        let not_found = |found| BoardNotFound { found, columns: self.columns, rows: self.rows };
        let factor = image.width.div_ceil(SEARCH_COLUMNS).max(1).min(image.height.max(1));
        if image.width < 4 * factor || image.height < 4 * factor {
            return Err(not_found(0));
        }
        let corners = find_candidates(&luma(&filter::downscale(image, image.region(), factor)));
        let full = luma(image);
        let middle = (factor as f64 - 1.0) / 2.0;
        let mut most = 0;
        for seed in 0..corners.len().min(SEEDS) {
            let grid = grow_grid(&corners, seed);
            most = most.max(grid.len());
            let Some(ordered) = self.match_grid(&grid) else { continue };
            let spacing = factor as f64 * distance(ordered[1].1, ordered[0].1);
            let refine = |((i, j), at): (Cell, Vec2)| {
                let rough = at.map(|at| at * factor as f64 + middle);
                let [x, y] = full.refine_corner(rough, (0.3 * spacing).clamp(3.0, 20.0));
                (Pixel::new(x, y), Point::new(i as f64 * self.square_cm, j as f64 * self.square_cm))
            };
            return Ok(ordered.into_iter().map(refine).collect());
        }
        Err(not_found(most))
    }

    /// The corners of a complete grid with the board's columns and rows, in either orientation; `None` for another
    /// grid.
    fn match_grid(&self, grid: &Grid) -> Option<Vec<(Cell, Vec2)>> {
        let extent = |axis: fn(&(i32, i32)) -> i32| {
            let (low, high) = (grid.keys().map(axis).min()?, grid.keys().map(axis).max()?);
            Some((low, (high - low) as usize + 1))
        };
        let ((left, width), (top, height)) = (extent(|at| at.0)?, extent(|at| at.1)?);
        let has_size =
            (width, height) == (self.columns, self.rows) || (height, width) == (self.columns, self.rows);
        if !has_size || grid.len() != width * height {
            return None;
        }
        let cell = |at: &(i32, i32)| ((at.0 - left) as usize, (at.1 - top) as usize);
        Some(grid.iter().map(|(at, position)| (cell(at), *position)).collect())
    }
}

/// Corners by column and row on the board, counted from the seed: column and row in the searched picture, in pixels.
type Grid = BTreeMap<(i32, i32), Vec2>;

/// Column and row of a corner on its board, from 0.
type Cell = (usize, usize);

/// Grows a grid from one corner: each corner predicts its four neighbours, breadth first.
fn grow_grid(corners: &[Vec2], seed: usize) -> Grid {
    let mut grid = Grid::new();
    let start = corners[seed];
    let Some(axes) = grid_axes(corners, seed) else { return grid };
    // The steps to the neighbours of each corner, which perspective changes over the board.
    let mut steps = BTreeMap::new();
    grid.insert((0, 0), start);
    steps.insert((0, 0), axes);
    let mut queue = VecDeque::from([(0, 0)]);
    while let Some(at) = queue.pop_front() {
        let (here, around): (Vec2, [Vec2; 2]) = (grid[&at], steps[&at]);
        for (axis, sign) in [(0, 1), (0, -1), (1, 1), (1, -1)] {
            let next = if axis == 0 { (at.0 + sign, at.1) } else { (at.0, at.1 + sign) };
            if grid.contains_key(&next) {
                continue;
            }
            let predicted = along(here, around[axis], f64::from(sign));
            let error = |corner: &Vec2| distance(*corner, predicted);
            let nearest = corners.iter().min_by(|a, b| error(a).total_cmp(&error(b)));
            let max_error = MAX_DEVIATION * norm(around[axis]);
            let Some(&found) = nearest.filter(|corner| error(corner) < max_error) else { continue };
            if grid.values().any(|taken| *taken == found) {
                continue;
            }
            let mut updated = around;
            updated[axis] = scale(sub(found, here), f64::from(sign));
            grid.insert(next, found);
            steps.insert(next, updated);
            queue.push_back(next);
        }
    }
    grid
}

/// The steps from a corner to its nearest neighbour, and to the nearest one across that direction.
fn grid_axes(corners: &[Vec2], seed: usize) -> Option<[Vec2; 2]> {
    let here = corners[seed];
    let mut steps: Vec<Vec2> = corners
        .iter()
        .enumerate()
        .filter(|&(index, _)| index != seed)
        .map(|(_, corner)| sub(*corner, here))
        .collect();
    steps.sort_by(|a, b| norm(*a).total_cmp(&norm(*b)));
    let first = *steps.first()?;
    // More than 53 degrees from the first axis.
    let is_across = |step: &&Vec2| {
        let sine = (first[0] * step[1] - first[1] * step[0]) / (norm(first) * norm(**step));
        sine.abs() > 0.8
    };
    Some([first, *steps.iter().find(is_across)?])
}

/// The luma of each pixel.
fn luma(image: &Image) -> Plane {
    filter::sample_gaussian(image, image.region(), LUMA, 0.0, 1)
}

/// Local maxima of the corner response (non-maximum suppression), the strongest first.
fn find_candidates(luma: &Plane) -> Vec<Vec2> {
    let responses = luma.corner_response();
    let strongest = responses.iter().copied().fold(0.0, f32::max);
    let radius = RING_RADIUS as usize;
    let mut found: Vec<(f32, Vec2)> = Vec::new();
    for y in radius..luma.height.saturating_sub(radius) {
        for x in radius..luma.width.saturating_sub(radius) {
            let response = responses[y * luma.width + x];
            if response <= MIN_RESPONSE * strongest {
                continue;
            }
            let mut window =
                (y - radius..=y + radius).flat_map(|v| (x - radius..=x + radius).map(move |u| (u, v)));
            let is_maximum = window.all(|(u, v)| {
                let other = responses[v * luma.width + u];
                // The first of equals.
                other < response || other == response && (v, u) >= (y, x)
            });
            if is_maximum {
                found.push((response, [x as f64, y as f64]));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, position)| position).collect()
}

impl Plane {
    /// The ChESS response of each pixel (Bennett and Lasenby 2014): the sum response over the ring, less the
    /// difference response and 16 times the mean response.
    fn corner_response(&self) -> Vec<f32> {
        let radius = RING_RADIUS as usize;
        let angle = |i: usize| f64::from(i as u32) * std::f64::consts::TAU / 16.0;
        let ring: Vec<(f64, f64)> = (0..16)
            .map(|i| (RING_RADIUS * crate::math::cos(angle(i)), RING_RADIUS * crate::math::sin(angle(i))))
            .collect();
        let offsets: Vec<isize> = ring
            .iter()
            .map(|(dx, dy)| dy.round() as isize * self.width as isize + dx.round() as isize)
            .collect();
        let mut responses = vec![0.0; self.values.len()];
        for y in radius..self.height.saturating_sub(radius) {
            for x in radius..self.width.saturating_sub(radius) {
                let at = y * self.width + x;
                let ring = |i: usize| self.values[(at as isize + offsets[i]) as usize];
                let (mut sum_response, mut difference_response, mut sum) = (0.0_f32, 0.0_f32, 0.0_f32);
                for i in 0..4 {
                    let [a, b, c, d] = [ring(i), ring(i + 4), ring(i + 8), ring(i + 12)];
                    sum_response += (a + c - b - d).abs();
                    difference_response += (a - c).abs() + (b - d).abs();
                    sum += a + b + c + d;
                }
                let centre = self.values[at] + self.values[at - 1] + self.values[at + 1];
                let centre = centre + self.values[at - self.width] + self.values[at + self.width];
                let mean_response = (centre / 5.0 - sum / 16.0).abs();
                responses[at] = (sum_response - difference_response - mean_response * 16.0).max(0.0);
            }
        }
        responses
    }

    /// Refines a corner by Förstner's operator: at the corner, each gradient within `radius` is perpendicular to the
    /// line from there. Returns `rough` where the iteration leaves the window.
    fn refine_corner(&self, rough: Vec2, radius: f64) -> Vec2 {
        let mut corner = rough;
        let half = radius.ceil() as i32;
        for _ in 0..20 {
            let (mut xx, mut xy, mut yy, mut right_x, mut right_y) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for v in -half..=half {
                for u in -half..=half {
                    let (u, v) = (f64::from(u), f64::from(v));
                    let weight = crate::math::exp(-2.0 * (u * u + v * v) / (radius * radius));
                    let [x, y] = [corner[0] + u, corner[1] + v];
                    let slope_x = self.bilinear([x + 1.0, y]) - self.bilinear([x - 1.0, y]);
                    let slope_y = self.bilinear([x, y + 1.0]) - self.bilinear([x, y - 1.0]);
                    xx += weight * slope_x * slope_x;
                    xy += weight * slope_x * slope_y;
                    yy += weight * slope_y * slope_y;
                    let projection = slope_x * u + slope_y * v;
                    right_x += weight * slope_x * projection;
                    right_y += weight * slope_y * projection;
                }
            }
            let determinant = xx * yy - xy * xy;
            if determinant <= 1e-9 * (xx + yy) * (xx + yy) {
                return rough;
            }
            let step = [yy * right_x - xy * right_y, xx * right_y - xy * right_x].map(|x| x / determinant);
            corner = add(corner, step);
            if distance(corner, rough) > radius {
                return rough;
            }
            if norm(step) < 1e-3 {
                break;
            }
        }
        corner
    }
}
