//! From frequencies to samples (T.81, A.3.3).
//!
//! The inverse cosine transform in whole numbers, columns first, with cosines of 12 bits: the arithmetic of `zune-jpeg`,
//! so that both give the same samples.

use super::{Block, Jpeg, Plane, SIDE, ZIGZAG};

/// Eight rows of eight numbers.
type Rows<T> = [[T; SIDE]; SIDE];

/// Rounding of the first pass, which leaves two bits more than there were, and of the second, which takes them and the
/// scale off and 128 on.
const HALF: [i32; 2] = [1 << 9, (1 << 9) + (1 << 16) + (128 << 17)];
const BITS: [u32; 2] = [10, 17];

/// The last place in the file's order of those which all lie in the first four rows and columns.
const CORNER: usize = 9;

impl Jpeg {
    /// The samples of a block, row by row.
    #[inline(always)]
    pub(super) fn samples(&self, plane: &Plane, block: &Block) -> Rows<u8> {
        let mean = i32::from(block.mean) * plane.steps[0];
        let frequencies = self.frequencies(block);
        let Some(last) = frequencies.last() else {
            return [[((mean + 4 + 1024) >> 3).clamp(0, 255) as u8; SIDE]; SIDE];
        };
        let mut short: Rows<i16> = [[0; SIDE]; SIDE];
        short[0][0] = mean as i16;
        let mut sum = 0;
        for frequency in frequencies {
            let value = frequency.value() * plane.steps[frequency.place()];
            let at = usize::from(ZIGZAG[frequency.place()]);
            short[at / SIDE][at % SIDE] = value as i16;
            sum += value.abs();
        }
        // What the first pass makes of a mean is four times as large, and of the others up to 5.6 times.
        if 4 * mean.abs() + 6 * sum <= i32::from(i16::MAX) {
            return if last.place() <= CORNER {
                inverse::<i16, 4>(&short, |value| value as i16)
            } else {
                inverse::<i16, SIDE>(&short, |value| value as i16)
            };
        }
        let mut long: Rows<i32> = [[0; SIDE]; SIDE];
        long[0][0] = mean;
        for frequency in frequencies {
            let at = usize::from(ZIGZAG[frequency.place()]);
            long[at / SIDE][at % SIDE] = frequency.value() * plane.steps[frequency.place()];
        }
        inverse::<i32, SIDE>(&long, |value| value)
    }
}

/// The samples of frequencies of which none is zero but in the first `MOST` rows and columns. Processors multiply short
/// numbers several times faster than long ones.
#[inline(always)]
fn inverse<T: Copy + Default + Into<i32>, const MOST: usize>(
    rows: &Rows<T>,
    to: impl Fn(i32) -> T,
) -> Rows<u8> {
    let columns = pass::<T, MOST>(rows, HALF[0], BITS[0]);
    let mut turned: Rows<T> = [[T::default(); SIDE]; SIDE];
    for y in 0..SIDE {
        for x in 0..SIDE {
            turned[x][y] = to(columns[y][x]);
        }
    }
    let samples = pass::<T, MOST>(&turned, HALF[1], BITS[1]);
    let mut out = [[0; SIDE]; SIDE];
    for (y, row) in out.iter_mut().enumerate() {
        for (x, value) in row.iter_mut().enumerate() {
            *value = samples[x][y].clamp(0, 255) as u8;
        }
    }
    out
}

/// The inverse transform of eight numbers, for eight columns at a time; `half` is added for rounding before the lowest
/// `bits` are taken off.
#[inline(always)]
fn pass<T: Copy + Into<i32>, const MOST: usize>(rows: &Rows<T>, half: i32, bits: u32) -> Rows<i32> {
    let mut out: Rows<i32> = [[0; SIDE]; SIDE];
    for x in 0..SIDE {
        let at: [i32; SIDE] = std::array::from_fn(|y| if y < MOST { rows[y][x].into() } else { 0 });
        let times = |y: usize, cosine: i32| at[y].wrapping_mul(cosine);
        let sum = |one: i32, other: i32| one.wrapping_add(other);
        let low = sum(at[0], at[4]).wrapping_shl(12);
        let high = at[0].wrapping_sub(at[4]).wrapping_shl(12);
        let wide = sum(times(2, 5352), times(6, 2217));
        let narrow = sum(times(2, 2217), times(6, -5350));
        let even = [sum(low, wide), sum(high, narrow), high.wrapping_sub(narrow), low.wrapping_sub(wide)];
        let odd = [
            sum(sum(times(1, 5683), times(3, 4816)), sum(times(5, 3219), times(7, 1131))),
            sum(sum(times(1, 4816), times(3, -1129)), sum(times(5, -5681), times(7, -3218))),
            sum(sum(times(1, 3219), times(3, -5681)), sum(times(5, 1132), times(7, 4816))),
            sum(sum(times(1, 1131), times(3, -3218)), sum(times(5, 4816), times(7, -5680))),
        ];
        for y in 0..4 {
            let even = sum(even[y], half);
            out[y][x] = sum(even, odd[y]) >> bits;
            out[7 - y][x] = even.wrapping_sub(odd[y]) >> bits;
        }
    }
    out
}
