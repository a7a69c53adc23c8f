//! A region at 1/2, 1/4 or 1/8 of its size, without its pixels.
//!
//! Each pixel is the mean of a square of samples. The one idea: the mean of some samples of a block is a weighted sum
//! of its DCT coefficients, as each sample is, and there are fewer means than samples.

use std::ops::Range;

use super::colour::rgb_of;
use super::{BLOCK_SIDE, Component, Jpeg, ZIGZAG};

/// The means of a component's squares, in the blocks around a region.
struct ScaledWindow {
    /// Column and row of the first square.
    left: usize,
    top: usize,
    width: usize,
    means: Vec<f32>,
}

impl Jpeg {
    /// Whether a region can be decoded at 1/`factor` of its size: for 2, 4 and 8, where the region begins at a
    /// multiple of the factor.
    #[must_use]
    pub const fn can_decode_scaled(columns: &Range<usize>, rows: &Range<usize>, factor: usize) -> bool {
        matches!(factor, 2 | 4 | 8)
            && columns.start.is_multiple_of(factor)
            && rows.start.is_multiple_of(factor)
    }

    /// The luma of a region at 1/`factor` of its size, row by row, 0 to 255. Squares that the region cuts are left
    /// out.
    ///
    /// A mean of pixels would differ a little, as each pixel is clamped and rounded.
    ///
    /// # Panics
    /// If the region does not lie in the picture or [`Jpeg::can_decode_scaled`] is false.
    #[must_use]
    #[inline(always)]
    pub fn decode_scaled_luma(&self, columns: Range<usize>, rows: Range<usize>, factor: usize) -> Vec<f32> {
        let window = self.square_means(&self.components[0], &columns, &rows, factor);
        let (width, height) = (columns.len() / factor, rows.len() / factor);
        let (left, top) = (columns.start / factor, rows.start / factor);
        let mut values = Vec::with_capacity(width * height);
        for row in top..top + height {
            values.extend(window.row(left, row, width).iter().map(|value| value.clamp(0.0, 255.0)));
        }
        values
    }

    /// The region at 1/`factor` of its size. Squares that the region cuts are left out.
    ///
    /// Chroma of half the resolution is not interpolated: a square takes the mean of its own chroma samples.
    ///
    /// # Panics
    /// If the region does not lie in the picture or [`Jpeg::can_decode_scaled`] is false.
    #[must_use]
    #[inline(always)]
    pub fn decode_scaled(&self, columns: Range<usize>, rows: Range<usize>, factor: usize) -> Vec<u8> {
        let (width, height) = (columns.len() / factor, rows.len() / factor);
        let (left, top) = (columns.start / factor, rows.start / factor);
        let mut rgb = vec![0; 3 * width * height];
        let mut windows = Vec::with_capacity(self.components.len());
        for component in &self.components {
            windows.push(self.square_means(component, &columns, &rows, factor));
        }
        for (row, out) in (top..).zip(rgb.chunks_exact_mut((3 * width).max(1))) {
            let pixels = out.chunks_exact_mut(3);
            let lines: Vec<&[f32]> = windows.iter().map(|window| window.row(left, row, width)).collect();
            if let [luma, blue, red] = lines[..] {
                for (((pixel, luma), blue), red) in pixels.zip(luma).zip(blue).zip(red) {
                    pixel.copy_from_slice(&rgb_of(*luma, *blue, *red).map(rounded));
                }
            } else {
                pixels.zip(lines[0]).for_each(|(pixel, &luma)| pixel.fill(rounded(luma)));
            }
        }
        rgb
    }

    #[inline(always)]
    fn square_means(
        &self,
        component: &Component,
        columns: &Range<usize>,
        rows: &Range<usize>,
        factor: usize,
    ) -> ScaledWindow {
        self.check_region(columns, rows);
        assert!(Self::can_decode_scaled(columns, rows, factor), "{columns:?} and {rows:?} by {factor}");
        // Squares across and down in a block.
        let (across, down) = component.subsampling;
        match (BLOCK_SIDE * across / factor, BLOCK_SIDE * down / factor) {
            (1, 1) => self.means_of::<1, 1>(component, columns, rows, factor),
            (2, 1) => self.means_of::<2, 2>(component, columns, rows, factor),
            (2, 2) => self.means_of::<2, 4>(component, columns, rows, factor),
            (4, 2) => self.means_of::<4, 8>(component, columns, rows, factor),
            (4, 4) => self.means_of::<4, 16>(component, columns, rows, factor),
            (8, 4) => self.means_of::<8, 32>(component, columns, rows, factor),
            _ => self.means_of::<8, 64>(component, columns, rows, factor),
        }
    }

    /// The means of `ALL` squares a block, `ACROSS` of them in a row.
    #[inline(always)]
    fn means_of<const ACROSS: usize, const ALL: usize>(
        &self,
        component: &Component,
        columns: &Range<usize>,
        rows: &Range<usize>,
        factor: usize,
    ) -> ScaledWindow {
        let down = ALL / ACROSS;
        let blocks = |range: &Range<usize>, squares: usize, count: usize| {
            (range.start / factor / squares, ((range.end - 1) / factor / squares).min(count - 1))
        };
        let (left, right) = blocks(columns, ACROSS, component.block_columns);
        let (top, bottom) = blocks(rows, down, component.block_rows);
        let width = ACROSS * (right - left + 1);
        let mut means = vec![0.0; width * down * (bottom - top + 1)];
        for (row, strip) in (top..=bottom).zip(means.chunks_exact_mut(down * width)) {
            let first = row * component.block_columns;
            let blocks = &component.blocks[first + left..=first + right];
            for (column, block) in blocks.iter().enumerate() {
                // The mean of the block with the level shift of 128 (T.81, A.3.1).
                let mean = 128.0 + (i32::from(block.dc) * component.quantisation[0]) as f32 / 8.0;
                let mut squares = [mean; ALL];
                if ALL > 1 {
                    for coefficient in self.ac_coefficients(block) {
                        let index = coefficient.index();
                        let value = (coefficient.value() * component.quantisation[index]) as f32;
                        let weights = &SquareWeights::<ACROSS, ALL>::BY_INDEX[index];
                        squares.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += value * weight);
                    }
                }
                for (line, squares) in strip.chunks_exact_mut(width).zip(squares.chunks_exact(ACROSS)) {
                    line[ACROSS * column..][..ACROSS].copy_from_slice(squares);
                }
            }
        }
        ScaledWindow { left: ACROSS * left, top: down * top, width, means }
    }
}

impl ScaledWindow {
    /// `width` squares of row `row` from column `left` on.
    fn row(&self, left: usize, row: usize, width: usize) -> &[f32] {
        let from = (row - self.top) * self.width + left - self.left;
        &self.means[from..from + width]
    }
}

/// Cosines of 0 to 8 sixteenths of half a turn. `const` code cannot call `cos`.
const COSINES: [f64; 9] = [
    1.0,
    0.980_785_280_403_230_4,
    0.923_879_532_511_286_7,
    0.831_469_612_302_545_2,
    std::f64::consts::FRAC_1_SQRT_2,
    0.555_570_233_019_602_2,
    0.382_683_432_365_089_8,
    0.195_090_322_016_128_27,
    0.0,
];

/// The weights of DCT coefficients in the means of a block's `ALL` squares, `ACROSS` of them in a row.
struct SquareWeights<const ACROSS: usize, const ALL: usize>;

impl<const ACROSS: usize, const ALL: usize> SquareWeights<ACROSS, ALL> {
    /// For each zig-zag index, the weight in each square.
    const BY_INDEX: [[f32; ALL]; 64] = {
        let mut weights = [[0.0; ALL]; 64];
        let mut index = 0;
        while index < 64 {
            let at = ZIGZAG[index] as usize;
            let mut square = 0;
            while square < ALL {
                let (x, y) = (
                    mean_of_basis(square % ACROSS, ACROSS, at % BLOCK_SIDE),
                    mean_of_basis(square / ACROSS, ALL / ACROSS, at / BLOCK_SIDE),
                );
                weights[index][square] = (x * y) as f32;
                square += 1;
            }
            index += 1;
        }
        weights
    };
}

/// The mean of the one-dimensional basis function of `frequency` (T.81, A.3.3) over part number `part` of `parts`
/// equal parts of a block's side.
const fn mean_of_basis(part: usize, parts: usize, frequency: usize) -> f64 {
    let length = BLOCK_SIDE / parts;
    let mut sum = 0.0;
    let mut at = part * length;
    while at < (part + 1) * length {
        let sixteenths = (2 * at + 1) * frequency % 32;
        let sixteenths = if sixteenths > 16 { 32 - sixteenths } else { sixteenths };
        let cosine = if sixteenths > 8 { -COSINES[16 - sixteenths] } else { COSINES[sixteenths] };
        sum += if frequency == 0 { std::f64::consts::FRAC_1_SQRT_2 } else { cosine };
        at += 1;
    }
    0.5 * sum / length as f64
}

/// The nearest whole number from 0 to 255.
fn rounded(value: f32) -> u8 {
    // At 2^23 the last bit of a number is worth 1, so the sum is rounded and its low byte is the result.
    (value.clamp(0.0, 255.0) + 8_388_608.0).to_bits() as u8
}
