//! Dequantisation and the inverse DCT: from the coefficients of a block to its samples (T.81, A.3.3 and A.3.4).
//!
//! The transform computes in whole numbers, columns first, with cosines of 12 bits. It repeats the arithmetic of
//! `zune-jpeg`, so that both decoders give the same samples.
//!
//! # References
//! Loeffler, Ligtenberg and Moschytz 1989, *Practical fast 1-D DCT algorithms with 11 multiplications*,
//! doi:10.1109/ICASSP.1989.266596.

use super::{BLOCK_SIDE, Block, Component, Jpeg, ZIGZAG};

/// Eight rows of eight numbers.
type Rows<T> = [[T; BLOCK_SIDE]; BLOCK_SIDE];

/// What the first pass (columns) and the second (rows) add before they drop the lowest bits: half of the last bit
/// kept. The second pass adds the half of the first again, as `zune-jpeg` does, and the level shift of 128 (T.81,
/// A.3.1).
const ROUNDING: [i32; 2] = [1 << 9, (1 << 9) + (1 << 16) + (128 << 17)];

/// Bits that each pass drops. The factors have 12 bits; the first pass keeps two of them for precision, and the
/// second drops those, its own 12 and the 3 of the transform's scale of 1/8.
const DROPPED_BITS: [u32; 2] = [10, 17];

/// The last zig-zag index up to which all coefficients lie in the first four rows and columns (T.81, figure A.6).
const LAST_OF_CORNER: usize = 9;

impl Jpeg {
    /// The samples of a block, row by row.
    #[inline(always)]
    pub(super) fn samples(&self, component: &Component, block: &Block) -> Rows<u8> {
        let dc = i32::from(block.dc) * component.quantisation[0];
        let coefficients = self.ac_coefficients(block);
        let Some(last) = coefficients.last() else {
            // The DC coefficient is eight times the mean; 4 rounds, 1024 is the level shift of 128.
            return [[((dc + 4 + 1024) >> 3).clamp(0, 255) as u8; BLOCK_SIDE]; BLOCK_SIDE];
        };
        let mut short: Rows<i16> = [[0; BLOCK_SIDE]; BLOCK_SIDE];
        short[0][0] = dc as i16;
        let mut sum = 0;
        for coefficient in coefficients {
            let value = coefficient.value() * component.quantisation[coefficient.index()];
            let at = usize::from(ZIGZAG[coefficient.index()]);
            short[at / BLOCK_SIDE][at % BLOCK_SIDE] = value as i16;
            sum += value.abs();
        }
        // 16 bits suffice: the first pass multiplies the DC coefficient by 4 and the others by at most 5.6.
        if 4 * dc.abs() + 6 * sum <= i32::from(i16::MAX) {
            return if last.index() <= LAST_OF_CORNER {
                inverse::<i16, 4>(&short, |value| value as i16)
            } else {
                inverse::<i16, BLOCK_SIDE>(&short, |value| value as i16)
            };
        }
        let mut long: Rows<i32> = [[0; BLOCK_SIDE]; BLOCK_SIDE];
        long[0][0] = dc;
        for coefficient in coefficients {
            let at = usize::from(ZIGZAG[coefficient.index()]);
            long[at / BLOCK_SIDE][at % BLOCK_SIDE] =
                coefficient.value() * component.quantisation[coefficient.index()];
        }
        inverse::<i32, BLOCK_SIDE>(&long, |value| value)
    }
}

/// The inverse DCT of dequantised coefficients that are zero outside the first `USED` rows and columns. Processors
/// multiply numbers of 16 bits several times faster than those of 32.
#[inline(always)]
fn inverse<T: Copy + Default + Into<i32>, const USED: usize>(
    rows: &Rows<T>,
    narrow: impl Fn(i32) -> T,
) -> Rows<u8> {
    let columns = pass::<T, USED>(rows, ROUNDING[0], DROPPED_BITS[0]);
    let mut transposed: Rows<T> = [[T::default(); BLOCK_SIDE]; BLOCK_SIDE];
    for y in 0..BLOCK_SIDE {
        for x in 0..BLOCK_SIDE {
            transposed[x][y] = narrow(columns[y][x]);
        }
    }
    let samples = pass::<T, USED>(&transposed, ROUNDING[1], DROPPED_BITS[1]);
    let mut out = [[0; BLOCK_SIDE]; BLOCK_SIDE];
    for (y, row) in out.iter_mut().enumerate() {
        for (x, value) in row.iter_mut().enumerate() {
            *value = samples[x][y].clamp(0, 255) as u8;
        }
    }
    out
}

/// The one-dimensional inverse DCT of eight columns at a time: `rounding` is added before the lowest `dropped_bits`
/// go.
///
/// A factor is the square root of 2 times the cosine of n/16 of half a turn, times 4096. It is put together from the
/// rounded factors of Loeffler and others, which is why its last digit may be off (5683 for 5681.3).
#[inline(always)]
fn pass<T: Copy + Into<i32>, const USED: usize>(
    rows: &Rows<T>,
    rounding: i32,
    dropped_bits: u32,
) -> Rows<i32> {
    let mut out: Rows<i32> = [[0; BLOCK_SIDE]; BLOCK_SIDE];
    for x in 0..BLOCK_SIDE {
        let at: [i32; BLOCK_SIDE] = std::array::from_fn(|y| if y < USED { rows[y][x].into() } else { 0 });
        let times = |y: usize, factor: i32| at[y].wrapping_mul(factor);
        let sum = |one: i32, other: i32| one.wrapping_add(other);
        // The even half: a four-point transform of coefficients 0, 2, 4 and 6.
        let sum04 = sum(at[0], at[4]).wrapping_shl(12);
        let difference04 = at[0].wrapping_sub(at[4]).wrapping_shl(12);
        let rotated2 = sum(times(2, 5352), times(6, 2217));
        let rotated6 = sum(times(2, 2217), times(6, -5350));
        let even = [
            sum(sum04, rotated2),
            sum(difference04, rotated6),
            difference04.wrapping_sub(rotated6),
            sum04.wrapping_sub(rotated2),
        ];
        let odd = [
            sum(sum(times(1, 5683), times(3, 4816)), sum(times(5, 3219), times(7, 1131))),
            sum(sum(times(1, 4816), times(3, -1129)), sum(times(5, -5681), times(7, -3218))),
            sum(sum(times(1, 3219), times(3, -5681)), sum(times(5, 1132), times(7, 4816))),
            sum(sum(times(1, 1131), times(3, -3218)), sum(times(5, 4816), times(7, -5680))),
        ];
        for y in 0..4 {
            let even = sum(even[y], rounding);
            out[y][x] = sum(even, odd[y]) >> dropped_bits;
            out[7 - y][x] = even.wrapping_sub(odd[y]) >> dropped_bits;
        }
    }
    out
}
