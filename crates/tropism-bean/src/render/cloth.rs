//! The black cloth of the back wall: hanging folds, wrinkles and a few sharp creases, as slopes over the wall.

use tropism::math;
use tropism::math::interpolate::bilinear_blend;
use tropism::random::{Purpose, stream, uniform};

use crate::scene::Scene;
use crate::view::{CAMERA, View};

/// Spacing of the grid on which the cloth is computed, in cm. Chosen by hand.
const SPACING: f64 = 0.125;

/// Slopes of the cloth over the wall, computed once on a grid and interpolated.
#[derive(Clone, Debug)]
pub(super) struct Cloth {
    left: f64,
    bottom: f64,
    columns: usize,
    rows: usize,
    /// dz/dx and dz/dy at each grid point, and the cloth's brightness around 1.
    grid: Vec<[f32; 3]>,
}

impl Cloth {
    pub(super) fn new(scene: &Scene, seed: u64, view: View) -> Self {
        let frame = scene.frame();
        let further = (CAMERA[2] - view.wall()) / CAMERA[2];
        let half_width = f64::from(frame.width) / frame.px_per_cm / 2.0 * further + 1.0;
        let half_height = f64::from(frame.height) / frame.px_per_cm / 2.0 * further + 1.0;
        let (left, bottom) = (CAMERA[0] - half_width, CAMERA[1] - half_height);
        let columns = (2.0 * half_width / SPACING) as usize + 2;
        let rows = (2.0 * half_height / SPACING) as usize + 2;
        let mut surface = Surface::new(Texture { seed });
        let mut height = vec![0.0; columns * rows];
        for row in 0..rows {
            for column in 0..columns {
                let (x, y) = (left + column as f64 * SPACING, bottom + row as f64 * SPACING);
                height[row * columns + column] = surface.height(x, y);
            }
        }
        let mut cloth = Self { left, bottom, columns, rows, grid: Vec::new() };
        cloth.crease(&mut height, seed);
        let slope = |ahead: usize, behind: usize| scene.folds * (height[ahead] - height[behind]) / SPACING;
        cloth.grid = (0..columns * rows)
            .map(|at| {
                let (row, column) = (at / columns, at % columns);
                let (x, y) = (left + column as f64 * SPACING, bottom + row as f64 * SPACING);
                let east = row * columns + (column + 1).min(columns - 1);
                let north = (row + 1).min(rows - 1) * columns + column;
                [slope(east, at) as f32, slope(north, at) as f32, surface.brightness(x, y) as f32]
            })
            .collect();
        cloth
    }

    /// Sharp creases from folding, long and mostly upright.
    fn crease(&self, height: &mut [f64], seed: u64) {
        let mut rng = stream(seed, Purpose::Scene, 1);
        for _ in 0..34 {
            let mut draw = |low: f64, high: f64| low + (high - low) * uniform(&mut rng);
            let start =
                [draw(self.left, -self.left), draw(self.bottom, self.bottom + self.rows as f64 * SPACING)];
            let (turn, long) = (draw(0.9, 2.2), draw(5.0, 30.0));
            let (deep, wide) = (draw(-0.10, 0.10), draw(0.12, 0.24));
            let bow = draw(-0.012, 0.012);
            let (along_x, along_y) = (math::cos(turn), math::sin(turn));
            // A crease ends at `long` to both sides, and is as wide as its bow and its flanks: nothing lies outside.
            let across = bow.abs() * long * long + 3.0 * wide;
            let half =
                |along: f64, aside: f64| (long * along.abs() + across * aside.abs() + SPACING).min(long);
            let reach = |centre: f64, half: f64, from: f64, count: usize| {
                let low = ((centre - half - from) / SPACING).max(0.0) as usize;
                let high = ((centre + half - from) / SPACING).max(0.0) as usize;
                low.min(count)..high.min(count)
            };
            for row in reach(start[1], half(along_y, along_x), self.bottom, self.rows) {
                for column in reach(start[0], half(along_x, along_y), self.left, self.columns) {
                    let x = self.left + column as f64 * SPACING - start[0];
                    let y = self.bottom + row as f64 * SPACING - start[1];
                    let s = (x * along_x + y * along_y) / long;
                    let off = -x * along_y + y * along_x + bow * s * s * long * long;
                    if s.abs() < 1.0 && off.abs() < 3.0 * wide {
                        let taper = (1.0 - s * s) * (1.0 - s * s);
                        height[row * self.columns + column] +=
                            deep * taper * math::exp(-off * off / (wide * wide));
                    }
                }
            }
        }
    }

    /// dz/dx, dz/dy and brightness of the cloth at (x, y) of the wall, in cm.
    pub(super) fn at(&self, x: f64, y: f64) -> [f64; 3] {
        let place = |value: f64, from: f64, count: usize| {
            let steps = ((value - from) / SPACING).clamp(0.0, count as f64 - 1.001);
            (steps as usize, steps - steps.floor())
        };
        let (column, across) = place(x, self.left, self.columns);
        let (row, up) = place(y, self.bottom, self.rows);
        let at = row * self.columns + column;
        let corner = |index: usize, part: usize| f64::from(self.grid[index][part]);
        core::array::from_fn(|part| {
            let corners = [at, at + 1, at + self.columns, at + self.columns + 1];
            bilinear_blend(corners.map(|index| corner(index, part)), across, up)
        })
    }
}

/// Smooth noise on the plane, from a hash of its lattice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texture {
    pub(super) seed: u64,
}

impl Texture {
    /// Smooth noise from -1 to 1 with features about 1 across; `layer` picks one of many.
    pub(super) fn noise(self, layer: u64, x: f64, y: f64) -> f64 {
        let cell = [x.floor(), y.floor()];
        blend(self.corners(layer, cell), x - cell[0], y - cell[1])
    }

    /// Values at the corners of a cell of the lattice.
    fn corners(self, layer: u64, [column, row]: [f64; 2]) -> [f64; 4] {
        let corner = |i: f64, j: f64| self.lattice(layer, (column + i) as i64, (row + j) as i64);
        [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)]
    }

    fn lattice(self, layer: u64, column: i64, row: i64) -> f64 {
        let mut word = self.seed ^ layer.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        for part in [column as u64, row as u64] {
            word = (word ^ part).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            word ^= word >> 29;
        }
        (word >> 40) as f64 / f64::from(1 << 23) - 1.0
    }
}

/// Noise within a cell of the lattice, from the values at its corners.
fn blend(corners: [f64; 4], u: f64, v: f64) -> f64 {
    let (u, v) = (u * u * u * (u * (u * 6.0 - 15.0) + 10.0), v * v * v * (v * (v * 6.0 - 15.0) + 10.0));
    bilinear_blend(corners, u, v)
}

/// One layer of a texture: [`Texture::noise`], to the bit, for places that follow each other closely. The corners of a cell
/// are hashed once for all places in it.
struct Layer {
    texture: Texture,
    layer: u64,
    cell: [f64; 2],
    corners: [f64; 4],
}

impl Layer {
    fn noise(&mut self, x: f64, y: f64) -> f64 {
        let cell = [x.floor(), y.floor()];
        if cell != self.cell {
            (self.cell, self.corners) = (cell, self.texture.corners(self.layer, cell));
        }
        blend(self.corners, x - cell[0], y - cell[1])
    }
}

/// Height and brightness of the cloth, along rows.
struct Surface([Layer; 9]);

impl Surface {
    fn new(texture: Texture) -> Self {
        let layer =
            |index: usize| Layer { texture, layer: index as u64 + 1, cell: [f64::NAN; 2], corners: [0.0; 4] };
        Self(core::array::from_fn(layer))
    }

    /// Height of the cloth in front of the wall, in cm: drapes that hang, wrinkles that slant, and a fine crumple.
    fn height(&mut self, x: f64, y: f64) -> f64 {
        let [sway, drape, pleat, slant, counter, coarse, fine, ..] = &mut self.0;
        let sway = 2.5 * sway.noise(0.06 * y, 0.04 * x);
        let drape = 1.9 * drape.noise(0.095 * (x + sway), 0.014 * y);
        let pleat = 0.40 * pleat.noise(0.30 * (x + sway), 0.025 * y);
        let slant = 0.17 * slant.noise(0.33 * (0.80 * x + 0.60 * y), 0.07 * (0.80 * y - 0.60 * x));
        let counter = 0.12 * counter.noise(0.38 * (0.85 * x - 0.52 * y), 0.08 * (0.85 * y + 0.52 * x));
        let crumple = 0.035 * coarse.noise(1.1 * x, 0.5 * y) + 0.010 * fine.noise(2.3 * x, 1.9 * y);
        drape + pleat + slant + counter + crumple
    }

    fn brightness(&mut self, x: f64, y: f64) -> f64 {
        let [.., coarse, fine] = &mut self.0;
        1.0 + 0.18 * coarse.noise(0.08 * x, 0.05 * y) + 0.05 * fine.noise(3.1 * x, 3.1 * y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_along_rows_have_the_noise_of_single_places_to_the_bit() {
        let texture = Texture { seed: 9 };
        let mut layer = Layer { texture, layer: 3, cell: [f64::NAN; 2], corners: [0.0; 4] };
        for step in 0..4000 {
            let (x, y) = (f64::from(step % 400) * 0.037 - 7.0, f64::from(step / 400) * 0.41 - 2.0);
            assert_eq!(layer.noise(x, y).to_bits(), texture.noise(3, x, y).to_bits(), "{x} {y}");
        }
    }
}
