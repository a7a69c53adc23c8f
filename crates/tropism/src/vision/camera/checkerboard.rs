//! The inner corners of a checkerboard in a photograph, between pixels.
//!
//! In: a picture, and how many corners the board has. Out: where they are, in the board's order. The one idea: around a
//! corner, opposite places are alike and places at a right angle differ; corners that continue each other are a board.
//!
//! # References
//! Bennett and Lasenby 2014, *ChESS: quick and robust detection of chess-board features*, doi:10.1016/j.cviu.2013.10.008.

use std::collections::{BTreeMap, VecDeque};

use crate::geometry::{Pixel, Point, Region};
use crate::math::hypot;
use crate::photo::Image;
use crate::vision::raster::filter;
use crate::vision::raster::plane::LUMA;

/// A board by its inner corners, where four squares meet: one fewer each way than squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checkerboard {
    /// Inner corners along one side, at least 3.
    pub columns: usize,
    /// Inner corners along the other, at least 3.
    pub rows: usize,
    /// Side of a square, in cm.
    pub square_cm: f64,
}

/// Why no board is found.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "found {found} inner corners of a checkerboard, wanted {columns} x {rows}: the whole board in view, sharp, without glare"
)]
pub struct BoardNotFound {
    /// The most that belong together.
    pub found: usize,
    /// Wanted along one side.
    pub columns: usize,
    /// Wanted along the other.
    pub rows: usize,
}

/// Corners are looked for in a picture of at most so many columns.
const COLUMNS: usize = 1_000;

/// Radius of the ring of sixteen places around a corner, in pixels of that picture.
const RADIUS: f64 = 5.0;

/// A corner must response with this share of the strongest.
const FAINT: f32 = 0.15;

/// How far from where the grid would go on a corner may be, as a share of a square.
const ASTRAY: f64 = 0.3;

/// Corners from which a grid is tried to be grown.
const SEEDS: usize = 40;

impl Checkerboard {
    /// Its corners in a picture, each with its place on the board in cm.
    ///
    /// # Errors
    /// [`BoardNotFound`] if not all of them are found.
    pub fn find(&self, image: &Image) -> Result<Vec<(Pixel, Point)>, BoardNotFound> {
        let nothing = |found| BoardNotFound { found, columns: self.columns, rows: self.rows };
        let factor = image.width.div_ceil(COLUMNS).max(1).min(image.height.max(1));
        if image.width < 4 * factor || image.height < 4 * factor {
            return Err(nothing(0));
        }
        let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
        let corners = candidates(&Grey::of(&filter::downscale(image, whole, factor)));
        let full = Grey::of(image);
        let middle = (factor as f64 - 1.0) / 2.0;
        let mut most = 0;
        for seed in 0..corners.len().min(SEEDS) {
            let grid = grow(&corners, seed);
            most = most.max(grid.len());
            let Some(ordered) = self.ordered(&grid) else { continue };
            let spacing =
                factor as f64 * hypot(ordered[1].1.0 - ordered[0].1.0, ordered[1].1.1 - ordered[0].1.1);
            let place = |((i, j), (x, y)): (Cell, Place)| {
                let rough = (x * factor as f64 + middle, y * factor as f64 + middle);
                let (x, y) = full.saddle(rough, (0.3 * spacing).clamp(3.0, 20.0));
                (Pixel::new(x, y), Point::new(i as f64 * self.square_cm, j as f64 * self.square_cm))
            };
            return Ok(ordered.into_iter().map(place).collect());
        }
        Err(nothing(most))
    }

    /// The corners of a grid row by row, if it is this board, whichever way round.
    fn ordered(&self, grid: &Grid) -> Option<Vec<(Cell, Place)>> {
        let ends = |axis: fn(&(i32, i32)) -> i32| {
            let (low, high) = (grid.keys().map(axis).min()?, grid.keys().map(axis).max()?);
            Some((low, (high - low) as usize + 1))
        };
        let ((left, width), (top, height)) = (ends(|at| at.0)?, ends(|at| at.1)?);
        let is_this =
            (width, height) == (self.columns, self.rows) || (height, width) == (self.columns, self.rows);
        if !is_this || grid.len() != width * height {
            return None;
        }
        Some(
            grid.iter()
                .map(|(at, place)| (((at.0 - left) as usize, (at.1 - top) as usize), *place))
                .collect(),
        )
    }
}

/// Corners by where on a board they are, which is counted from the one that was found first.
type Grid = BTreeMap<(i32, i32), Place>;

/// Column and row, in pixels of the picture that is searched.
type Place = (f64, f64);

/// Column and row of a corner on its board, from 0.
type Cell = (usize, usize);

/// The grid that goes on from one corner in all directions.
fn grow(corners: &[Place], seed: usize) -> Grid {
    let mut grid = Grid::new();
    let start = corners[seed];
    let Some(((first_x, first_y), (second_x, second_y))) = axes(corners, seed) else { return grid };
    // Each corner with the steps to its neighbours, as they are around there.
    let mut steps = BTreeMap::new();
    grid.insert((0, 0), start);
    steps.insert((0, 0), [(first_x, first_y), (second_x, second_y)]);
    let mut waiting = VecDeque::from([(0, 0)]);
    while let Some(at) = waiting.pop_front() {
        let (here, around): (Place, [Place; 2]) = (grid[&at], steps[&at]);
        for (axis, sign) in [(0, 1), (0, -1), (1, 1), (1, -1)] {
            let next = if axis == 0 { (at.0 + sign, at.1) } else { (at.0, at.1 + sign) };
            if grid.contains_key(&next) {
                continue;
            }
            let (dx, dy) = (f64::from(sign) * around[axis].0, f64::from(sign) * around[axis].1);
            let expected = (here.0 + dx, here.1 + dy);
            let reach = ASTRAY * hypot(dx, dy);
            let distance = |corner: &Place| hypot(corner.0 - expected.0, corner.1 - expected.1);
            let nearest = corners.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let Some(&found) = nearest.filter(|corner| distance(corner) < reach) else { continue };
            if grid.values().any(|taken| *taken == found) {
                continue;
            }
            let mut known = around;
            known[axis] = (f64::from(sign) * (found.0 - here.0), f64::from(sign) * (found.1 - here.1));
            grid.insert(next, found);
            steps.insert(next, known);
            waiting.push_back(next);
        }
    }
    grid
}

/// The steps from a corner to its nearest and to the nearest that stands across from there.
fn axes(corners: &[Place], seed: usize) -> Option<(Place, Place)> {
    let here = corners[seed];
    let mut steps: Vec<Place> = corners
        .iter()
        .enumerate()
        .filter(|&(index, _)| index != seed)
        .map(|(_, corner)| (corner.0 - here.0, corner.1 - here.1))
        .collect();
    steps.sort_by(|a, b| hypot(a.0, a.1).total_cmp(&hypot(b.0, b.1)));
    let first = *steps.first()?;
    let across = |step: &&Place| {
        let sine = (first.0 * step.1 - first.1 * step.0) / (hypot(first.0, first.1) * hypot(step.0, step.1));
        sine.abs() > 0.8
    };
    Some((first, *steps.iter().find(across)?))
}

/// Places that response as corners do, the strongest first.
fn candidates(grey: &Grey) -> Vec<Place> {
    let responses = grey.corner_response();
    let strongest = responses.iter().copied().fold(0.0, f32::max);
    let reach = RADIUS as usize;
    let mut found: Vec<(f32, Place)> = Vec::new();
    for y in reach..grey.height.saturating_sub(reach) {
        for x in reach..grey.width.saturating_sub(reach) {
            let response = responses[y * grey.width + x];
            if response <= FAINT * strongest {
                continue;
            }
            let around = (y - reach..=y + reach).flat_map(|v| (x - reach..=x + reach).map(move |u| (u, v)));
            let is_top = around.clone().all(|(u, v)| {
                let other = responses[v * grey.width + u];
                // Of two that are alike, the first.
                other < response || other == response && (v, u) >= (y, x)
            });
            if is_top {
                found.push((response, (x as f64, y as f64)));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, place)| place).collect()
}

/// Brightness of a picture.
struct Grey {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Grey {
    fn of(image: &Image) -> Self {
        let grey = |rgb: &[u8]| LUMA.iter().zip(rgb).map(|(weight, &value)| weight * f32::from(value)).sum();
        Self {
            width: image.width,
            height: image.height,
            values: image.rgb.chunks_exact(3).map(grey).collect(),
        }
    }

    /// Between pixels, by its four neighbours; beyond the edge, as at the edge.
    fn at(&self, x: f64, y: f64) -> f32 {
        let x = x.clamp(0.0, self.width as f64 - 1.001);
        let y = y.clamp(0.0, self.height as f64 - 1.001);
        let (column, row) = (x as usize, y as usize);
        let (right, down) = ((x - column as f64) as f32, (y - row as f64) as f32);
        let value = |dx: usize, dy: usize| {
            self.values[(row + dy).min(self.height - 1) * self.width + (column + dx).min(self.width - 1)]
        };
        let corners = [value(0, 0), value(1, 0), value(0, 1), value(1, 1)];
        crate::math::interpolate::bilinear_blend(corners, right, down)
    }

    /// How much each pixel responses as a corner does: opposite places of the ring alike, those at right angles different,
    /// and the middle neither darker nor lighter than the ring.
    fn corner_response(&self) -> Vec<f32> {
        let reach = RADIUS as usize;
        let turn = |i: usize| f64::from(i as u32) * std::f64::consts::TAU / 16.0;
        let ring: Vec<(f64, f64)> = (0..16)
            .map(|i| (RADIUS * crate::math::cos(turn(i)), RADIUS * crate::math::sin(turn(i))))
            .collect();
        let offsets: Vec<isize> = ring
            .iter()
            .map(|(dx, dy)| dy.round() as isize * self.width as isize + dx.round() as isize)
            .collect();
        let mut responses = vec![0.0; self.values.len()];
        for y in reach..self.height.saturating_sub(reach) {
            for x in reach..self.width.saturating_sub(reach) {
                let at = y * self.width + x;
                let around = |i: usize| self.values[(at as isize + offsets[i]) as usize];
                let (mut crossed, mut opposed, mut sum) = (0.0_f32, 0.0_f32, 0.0_f32);
                for i in 0..4 {
                    let [a, b, c, d] = [around(i), around(i + 4), around(i + 8), around(i + 12)];
                    crossed += (a + c - b - d).abs();
                    opposed += (a - c).abs() + (b - d).abs();
                    sum += a + b + c + d;
                }
                let near = self.values[at] + self.values[at - 1] + self.values[at + 1];
                let near = near + self.values[at - self.width] + self.values[at + self.width];
                responses[at] = (crossed - opposed - (near / 5.0 - sum / 16.0).abs() * 16.0).max(0.0);
            }
        }
        responses
    }

    /// The corner near `rough`: the place from which all edges within `reach` point away, or `rough` itself where the walk
    /// there leads off.
    fn saddle(&self, rough: Place, reach: f64) -> Place {
        let mut place = rough;
        let half = reach.ceil() as i32;
        for _ in 0..20 {
            let (mut xx, mut xy, mut yy, mut along, mut down) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for v in -half..=half {
                for u in -half..=half {
                    let (u, v) = (f64::from(u), f64::from(v));
                    let weight = crate::math::exp(-2.0 * (u * u + v * v) / (reach * reach));
                    let (x, y) = (place.0 + u, place.1 + v);
                    let slope_x = f64::from(self.at(x + 1.0, y) - self.at(x - 1.0, y));
                    let slope_y = f64::from(self.at(x, y + 1.0) - self.at(x, y - 1.0));
                    xx += weight * slope_x * slope_x;
                    xy += weight * slope_x * slope_y;
                    yy += weight * slope_y * slope_y;
                    let across = slope_x * u + slope_y * v;
                    along += weight * slope_x * across;
                    down += weight * slope_y * across;
                }
            }
            let determinant = xx * yy - xy * xy;
            if determinant <= 1e-9 * (xx + yy) * (xx + yy) {
                return rough;
            }
            let (dx, dy) = ((yy * along - xy * down) / determinant, (xx * down - xy * along) / determinant);
            place = (place.0 + dx, place.1 + dy);
            if hypot(place.0 - rough.0, place.1 - rough.1) > reach {
                return rough;
            }
            if hypot(dx, dy) < 1e-3 {
                break;
            }
        }
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{self, Purpose};
    use crate::vision::camera::lens::Lens;

    const BOARD: Checkerboard = Checkerboard { columns: 9, rows: 6, square_cm: 1.5 };

    /// A photograph of the board through a lens: 10 x 7 squares on a white sheet, on a grey ground, with noise.
    fn photograph(lens: &Lens, width: usize, height: usize, noise: f64) -> Image {
        let mut rng = random::stream(7, Purpose::Camera, 0);
        let level = |x: f64, y: f64| {
            let Point { x, y } = lens.point(Pixel::new(x, y), width, height);
            let (column, row) = ((x / 1.5 + 5.0).floor(), (y / 1.5 + 3.5).floor());
            let is_board = (0.0..10.0).contains(&column) && (0.0..7.0).contains(&row);
            let is_sheet = (-1.0..11.0).contains(&column) && (-1.0..8.0).contains(&row);
            let is_dark = (column + row).rem_euclid(2.0) < 0.5;
            if is_board && is_dark {
                25.0
            } else if is_sheet {
                220.0
            } else {
                90.0
            }
        };
        let mut rgb = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                let part = |i: usize| (i as f64 + 0.5) / 4.0 - 0.5;
                let parts = (0..16).map(|i| level(x as f64 + part(i % 4), y as f64 + part(i / 4)));
                let value = parts.sum::<f64>() / 16.0 + noise * random::normal(&mut rng);
                rgb.extend([value.clamp(0.0, 255.0) as u8; 3]);
            }
        }
        Image { width, height, rgb }
    }

    fn lens(distortion: f64, pitch: f64, turn: f64, roll: f64) -> Lens {
        let homography = [[18.0, 18.0 * roll, 0.2], [18.0 * roll, -18.0, 0.3], [turn, pitch, 1.0]];
        Lens { distortion, homography }
    }

    #[test]
    fn a_board_tells_lens_and_perspective() {
        let (width, height) = (900, 675);
        for (distortion, pitch, turn, roll) in [
            (0.0, 0.0, 0.0, 0.0),
            (-0.15, 0.1, -0.05, 0.0),
            (-0.08, -0.1, 0.15, 0.1),
            (0.05, 0.05, 0.1, -0.2),
        ] {
            let truth = lens(distortion, pitch, turn, roll);
            let image = photograph(&truth, width, height, 3.0);
            let corners = BOARD.find(&image).unwrap();
            assert_eq!(corners.len(), 54);
            let fit = Lens::fit(&corners, width, height).unwrap();
            assert!(fit.residual_px < 0.15 && fit.residual_mm < 0.1, "{fit:?}");
            // Lengths all over the board, and beyond it, are what they are.
            let cm = |lens: &Lens, (a, b): (Pixel, Pixel)| {
                lens.point(a, width, height).distance(lens.point(b, width, height))
            };
            for ends in [(200, 300, 700, 320), (450, 150, 430, 560), (250, 200, 650, 500)] {
                let (a, b) = (ends.0, ends.1);
                let ends = (
                    Pixel::new(f64::from(a), f64::from(b)),
                    Pixel::new(f64::from(ends.2), f64::from(ends.3)),
                );
                let (found, wanted) = (cm(&fit.lens, ends), cm(&truth, ends));
                assert!((found - wanted).abs() < 0.002 * wanted, "{found} cm, wanted {wanted} cm: {fit:?}");
            }
        }
    }

    #[test]
    fn a_large_photograph_is_searched_small_and_measured_large() {
        let truth = lens(-0.1, 0.05, 0.02, 0.0);
        let (width, height) = (1_800, 1_350);
        let corners = BOARD.find(&photograph(&truth, width, height, 0.0)).unwrap();
        for (pixel, _) in &corners {
            let at = truth.point(*pixel, width, height);
            let off = |cm: f64| {
                (cm / 1.5 - (cm / 1.5 + 0.25).round()).abs().min((cm / 1.5 - (cm / 1.5).round()).abs())
            };
            assert!(off(at.x) < 0.01, "{at:?}");
        }
    }

    #[test]
    fn no_board_is_an_error_that_counts() {
        let truth = lens(0.0, 0.0, 0.0, 0.0);
        let image = photograph(&truth, 600, 450, 2.0);
        let error = Checkerboard { columns: 8, rows: 6, ..BOARD }.find(&image).unwrap_err();
        assert_eq!(error.found, 54);
        assert!(error.to_string().contains("found 54 inner corners of a checkerboard, wanted 8 x 6"));
        for (width, height) in [(0, 0), (1, 1), (3, 900), (60, 40)] {
            let grey = Image { width, height, rgb: vec![100; 3 * width * height] };
            assert_eq!(BOARD.find(&grey).unwrap_err().found, 0);
        }
    }
}
