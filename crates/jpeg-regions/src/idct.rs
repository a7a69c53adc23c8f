//! Dequantisation and the inverse DCT: from the coefficients of a block to its samples, or to means of them (T.81, A.3.3
//! and A.3.4).
//!
//! The one idea: the transform is linear and separable. A mean of neighbouring samples is the same weighted sum as a
//! sample, of basis functions that are averaged over as many places. So one transform gives all sizes.

use std::ops::Range;

use super::{BLOCK_SIDE, Block, Component, Jpeg, ZIGZAG};

/// Values of one component in the whole blocks around a region: samples, or the means of their squares.
pub(super) struct Window<T> {
    /// Column and row of the first value in the component.
    left: usize,
    top: usize,
    width: usize,
    values: Vec<T>,
}

impl<T> Window<T> {
    /// Some columns of row `y`.
    #[inline]
    pub(super) fn row(&self, y: usize, columns: Range<usize>) -> &[T] {
        let start = (y - self.top) * self.width;
        &self.values[start + columns.start - self.left..start + columns.end - self.left]
    }
}

impl Jpeg {
    /// The given columns and rows of a component of which each block has `ACROSS` x `DOWN` values.
    #[inline(always)]
    pub(super) fn window<T: Copy + Default, const ACROSS: usize, const DOWN: usize>(
        &self,
        component: &Component,
        columns: &Range<usize>,
        rows: &Range<usize>,
        convert: impl Fn(f32) -> T,
    ) -> Window<T> {
        let blocks = |range: &Range<usize>, side: usize, count: usize| {
            (range.start / side, ((range.end - 1) / side).min(count - 1))
        };
        let (left, right) = blocks(columns, ACROSS, component.block_columns);
        let (top, bottom) = blocks(rows, DOWN, component.block_rows);
        let width = ACROSS * (right - left + 1);
        let mut values = vec![T::default(); width * DOWN * (bottom - top + 1)];
        for (row, strip) in (top..=bottom).zip(values.chunks_exact_mut(DOWN * width)) {
            let first = row * component.block_columns;
            for (column, block) in component.blocks[first + left..=first + right].iter().enumerate() {
                // The DC coefficient is eight times the mean; 128 is the level shift (T.81, A.3.1).
                let mean = (i32::from(block.dc) * component.quantisation[0]) as f32 / 8.0 + 128.0;
                let lines = strip.chunks_exact_mut(width);
                if ACROSS * DOWN == 1 || block.ac_count == 0 {
                    let mean = convert(mean);
                    lines.for_each(|line| line[ACROSS * column..][..ACROSS].fill(mean));
                    continue;
                }
                let parts = self.inverse::<ACROSS, DOWN>(component, block, mean);
                for (line, values) in lines.zip(parts) {
                    line[ACROSS * column..][..ACROSS].copy_from_slice(&values.map(&convert));
                }
            }
        }
        Window { left: ACROSS * left, top: DOWN * top, width, values }
    }

    /// The inverse DCT of a block of this mean, row by row: the means of `ACROSS` x `DOWN` equal parts of it.
    #[inline(always)]
    fn inverse<const ACROSS: usize, const DOWN: usize>(
        &self,
        component: &Component,
        block: &Block,
        mean: f32,
    ) -> [[f32; ACROSS]; DOWN] {
        let mut out = [[mean; ACROSS]; DOWN];
        // Down the columns: for each horizontal frequency, its share in each row.
        let mut shares = [[0.0; DOWN]; BLOCK_SIDE];
        let mut highest = 0;
        for coefficient in self.ac_coefficients(block) {
            let index = coefficient.index();
            let value = (coefficient.value() * component.quantisation[index]) as f32 / 8.0;
            let (across, down) =
                (usize::from(ZIGZAG[index]) % BLOCK_SIDE, usize::from(ZIGZAG[index]) / BLOCK_SIDE);
            highest = highest.max(across);
            let basis = &Basis::<DOWN>::BY_FREQUENCY[down];
            shares[across].iter_mut().zip(basis).for_each(|(sum, weight)| *sum += value * weight);
        }
        // Along the rows. Most blocks have low frequencies only.
        let add = |line: &mut [f32; ACROSS], row: usize, count: usize| {
            for (shares, basis) in shares.iter().zip(&Basis::<ACROSS>::BY_FREQUENCY).take(count) {
                line.iter_mut().zip(basis).for_each(|(sum, weight)| *sum += shares[row] * weight);
            }
        };
        for (row, line) in out.iter_mut().enumerate() {
            if highest < 4 { add(line, row, 4) } else { add(line, row, BLOCK_SIDE) }
        }
        out
    }
}

/// Basis functions of the one-dimensional DCT, averaged over `N` equal parts of a block's side. They are scaled so that
/// the first is 1, and a coefficient counts an eighth.
struct Basis<const N: usize>;

impl<const N: usize> Basis<N> {
    /// The means by frequency: of the square root of 2 times cosines (T.81, A.3.3).
    const BY_FREQUENCY: [[f32; N]; BLOCK_SIDE] = {
        let mut basis = [[1.0; N]; BLOCK_SIDE];
        let (length, mut at) = (BLOCK_SIDE / N, N);
        while at < N * BLOCK_SIDE {
            let (frequency, part) = (at / N, at % N);
            let (mut sum, mut sample) = (0.0, part * length);
            while sample < (part + 1) * length {
                let sixteenths = (2 * sample + 1) * frequency % 32;
                let sixteenths = if sixteenths > 16 { 32 - sixteenths } else { sixteenths };
                sum += if sixteenths > 8 { -COSINES[16 - sixteenths] } else { COSINES[sixteenths] };
                sample += 1;
            }
            basis[frequency][part] = (std::f64::consts::SQRT_2 * sum / length as f64) as f32;
            at += 1;
        }
        basis
    };
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
