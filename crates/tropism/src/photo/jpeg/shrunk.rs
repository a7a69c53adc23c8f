//! A picture at a half, a quarter or an eighth of its size, each pixel the mean of a square, without its pixels.
//!
//! The one idea: the mean of some samples of a block is a sum over its frequencies, as each sample is, and there are fewer
//! means than samples.

use super::{Jpeg, Plane, SIDE, ZIGZAG};
use crate::geometry::Region;
use crate::photo::Image;
use crate::simd::{Kernel, dispatch};

/// The means of the squares of a plane that lie in the blocks around a region.
struct Means {
    /// The first square's column and row.
    left: usize,
    top: usize,
    width: usize,
    values: Vec<f32>,
}

/// [`Jpeg::means`].
struct Squares<'a> {
    jpeg: &'a Jpeg,
    plane: &'a Plane,
    region: Region,
    factor: usize,
}

impl Kernel for Squares<'_> {
    type Result = Means;

    #[inline(always)]
    fn run(self) -> Means {
        self.jpeg.squares(self.plane, self.region, self.factor)
    }
}

impl Jpeg {
    /// Whether the means of squares of `factor` x `factor` pixels of a region can be told: of 2, 4 or 8, where the region
    /// begins at a multiple of that.
    #[must_use]
    pub const fn shrinks(region: Region, factor: usize) -> bool {
        matches!(factor, 2 | 4 | 8) && region.x.is_multiple_of(factor) && region.y.is_multiple_of(factor)
    }

    /// The mean brightness of each square of a region, row by row, 0 to 255; squares that are not whole are left off.
    ///
    /// Unlike the mean of pixels, neither clamped nor rounded pixel by pixel.
    ///
    /// # Panics
    /// Where the region does not lie in the picture or [`Jpeg::shrinks`] says no.
    #[must_use]
    pub fn shrunk_grey(&self, region: Region, factor: usize) -> Vec<f32> {
        let means = self.means(&self.planes[0], region, factor);
        let (width, height) = (region.width / factor, region.height / factor);
        let mut values = Vec::with_capacity(width * height);
        for row in 0..height {
            values.extend(means.row(region, factor, row).iter().map(|value| value.clamp(0.0, 255.0)));
        }
        values
    }

    /// The region at one `factor`-th of its size; squares that are not whole are left off.
    ///
    /// Colour that was stored at half the resolution is that of its own samples, not of those around the square.
    ///
    /// # Panics
    /// Where the region does not lie in the picture or [`Jpeg::shrinks`] says no.
    #[must_use]
    pub fn shrunk(&self, region: Region, factor: usize) -> Image {
        let (width, height) = (region.width / factor, region.height / factor);
        let mut rgb = vec![0; 3 * width * height];
        let planes: Vec<Means> = self.planes.iter().map(|plane| self.means(plane, region, factor)).collect();
        for (row, out) in rgb.chunks_exact_mut((3 * width).max(1)).enumerate() {
            let pixels = out.chunks_exact_mut(3);
            let lines: Vec<&[f32]> = planes.iter().map(|plane| plane.row(region, factor, row)).collect();
            if let [light, blue, red] = lines[..] {
                for (((pixel, light), blue), red) in pixels.zip(light).zip(blue).zip(red) {
                    let (blue, red) = (blue - 128.0, red - 128.0);
                    let values = [
                        light + 1.402 * red,
                        light - 0.714_136 * red - 0.344_136 * blue,
                        light + 1.772 * blue,
                    ];
                    pixel.copy_from_slice(&values.map(rounded));
                }
            } else {
                pixels.zip(lines[0]).for_each(|(pixel, &light)| pixel.fill(rounded(light)));
            }
        }
        Image { width, height, rgb }
    }

    fn means(&self, plane: &Plane, region: Region, factor: usize) -> Means {
        dispatch(Squares { jpeg: self, plane, region, factor })
    }

    #[inline(always)]
    fn squares(&self, plane: &Plane, region: Region, factor: usize) -> Means {
        assert!(
            region.fits(self.width, self.height) && Self::shrinks(region, factor),
            "{region:?} by {factor}"
        );
        // Squares across and down in a block.
        match (SIDE * plane.spread.0 / factor, SIDE * plane.spread.1 / factor) {
            (1, 1) => self.means_of::<1, 1>(plane, region, factor),
            (2, 1) => self.means_of::<2, 2>(plane, region, factor),
            (2, 2) => self.means_of::<2, 4>(plane, region, factor),
            (4, 2) => self.means_of::<4, 8>(plane, region, factor),
            (4, 4) => self.means_of::<4, 16>(plane, region, factor),
            (8, 4) => self.means_of::<8, 32>(plane, region, factor),
            _ => self.means_of::<8, 64>(plane, region, factor),
        }
    }

    /// The same with `ACROSS` squares across a block and `ALL` of them in all.
    #[inline(always)]
    fn means_of<const ACROSS: usize, const ALL: usize>(
        &self,
        plane: &Plane,
        region: Region,
        factor: usize,
    ) -> Means {
        let down = ALL / ACROSS;
        let blocks = |from: usize, length: usize, squares: usize, most: usize| {
            (from / factor / squares, ((from + length - 1) / factor / squares).min(most - 1))
        };
        let (left, right) = blocks(region.x, region.width, ACROSS, plane.across);
        let (top, bottom) = blocks(region.y, region.height, down, plane.down);
        let width = ACROSS * (right - left + 1);
        let mut values = vec![0.0; width * down * (bottom - top + 1)];
        for (row, strip) in (top..=bottom).zip(values.chunks_exact_mut(down * width)) {
            let blocks = &plane.blocks[row * plane.across + left..=row * plane.across + right];
            for (column, block) in blocks.iter().enumerate() {
                let mean = 128.0 + (i32::from(block.mean) * plane.steps[0]) as f32 / 8.0;
                let mut squares = [mean; ALL];
                if ALL > 1 {
                    for frequency in self.frequencies(block) {
                        let place = frequency.place();
                        let value = (frequency.value() * plane.steps[place]) as f32;
                        let weights = &Weights::<ACROSS, ALL>::EACH[place];
                        squares.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += value * weight);
                    }
                }
                for (line, squares) in strip.chunks_exact_mut(width).zip(squares.chunks_exact(ACROSS)) {
                    line[ACROSS * column..][..ACROSS].copy_from_slice(squares);
                }
            }
        }
        Means { left: ACROSS * left, top: down * top, width, values }
    }
}

impl Means {
    /// The squares of one row of a region.
    fn row(&self, region: Region, factor: usize, row: usize) -> &[f32] {
        let from = (region.y / factor + row - self.top) * self.width + region.x / factor - self.left;
        &self.values[from..from + region.width / factor]
    }
}

/// The cosines of 0 to 8 sixteenths of half a turn.
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

/// Blocks of `ALL` squares, `ACROSS` across.
struct Weights<const ACROSS: usize, const ALL: usize>;

impl<const ACROSS: usize, const ALL: usize> Weights<ACROSS, ALL> {
    /// What each frequency, in the file's order, adds to the mean of each square of a block.
    const EACH: [[f32; ALL]; 64] = {
        let mut weights = [[0.0; ALL]; 64];
        let mut place = 0;
        while place < 64 {
            let at = ZIGZAG[place] as usize;
            let mut square = 0;
            while square < ALL {
                let (x, y) = (
                    mean(square % ACROSS, ACROSS, at % SIDE),
                    mean(square / ACROSS, ALL / ACROSS, at / SIDE),
                );
                weights[place][square] = (x * y) as f32;
                square += 1;
            }
            place += 1;
        }
        weights
    };
}

/// The mean of a frequency's cosine over a share of a block's side, of so many (T.81, A.3.3).
const fn mean(share: usize, shares: usize, frequency: usize) -> f64 {
    let length = SIDE / shares;
    let mut sum = 0.0;
    let mut at = share * length;
    while at < (share + 1) * length {
        let sixteenths = (2 * at + 1) * frequency % 32;
        let sixteenths = if sixteenths > 16 { 32 - sixteenths } else { sixteenths };
        let cosine = if sixteenths > 8 { -COSINES[16 - sixteenths] } else { COSINES[sixteenths] };
        sum += if frequency == 0 { std::f64::consts::FRAC_1_SQRT_2 } else { cosine };
        at += 1;
    }
    0.5 * sum / length as f64
}

/// The nearest whole number of 0 to 255.
fn rounded(value: f32) -> u8 {
    // At this size a number's last bit is worth one.
    (value.clamp(0.0, 255.0) + 8_388_608.0).to_bits() as u8
}
