//! A region at its own size, or at 1/2, 1/4 or 1/8 of it without its pixels: inverse DCT of the blocks around it, chroma
//! upsampling and colour conversion.

use std::ops::Range;

use super::colour::{unusual_row_to_rgb, ycbcr_row_to_rgb};
use super::idct::Window;
use super::upsample::upsample_row;
use super::{BLOCK_SIDE, Colour, Component, Jpeg};

impl Jpeg {
    /// The pixels of a region: red, green and blue, row by row.
    ///
    /// # Panics
    /// If the region is empty or does not lie inside the picture.
    #[must_use]
    #[inline(always)]
    pub fn decode_region(&self, columns: Range<usize>, rows: Range<usize>) -> Vec<u8> {
        self.check_region(&columns, &rows);
        // A loop, as what a closure of an iterator calls would not be compiled for this processor.
        let mut windows = Vec::with_capacity(self.components.len());
        for component in &self.components {
            // A component of half the resolution is interpolated and needs the next sample on each side.
            let (across, down) = component.subsampling;
            let samples = |range: &Range<usize>, subsampling: usize| {
                let margin = usize::from(subsampling == 2);
                (range.start / subsampling).saturating_sub(margin)..(range.end - 1) / subsampling + margin + 1
            };
            let (columns, rows) = (samples(&columns, across), samples(&rows, down));
            windows.push(self.window::<u8, BLOCK_SIDE, BLOCK_SIDE>(component, &columns, &rows, |value| {
                fixed_point::<0>(value.clamp(0.0, 255.0)) as u8
            }));
        }
        let mut rgb = vec![0; 3 * columns.len() * rows.len()];
        let mut lines = [const { Vec::new() }; 4];
        let mut mixed = Vec::new();
        for (y, out) in rows.zip(rgb.chunks_exact_mut(3 * columns.len())) {
            // Luma of usual pictures has a sample a pixel, and is not copied.
            let first = usize::from(self.is_usual());
            for ((component, window), line) in
                self.components.iter().zip(&windows).zip(&mut lines).skip(first)
            {
                upsample_row(component, window, y, columns.clone(), &mut mixed, line);
            }
            match (self.colour, self.is_usual()) {
                (Colour::Grey, _) => {
                    let luma = windows[0].row(y, columns.clone());
                    out.chunks_exact_mut(3).zip(luma).for_each(|(pixel, &value)| pixel.fill(value));
                }
                (Colour::YCbCr, true) => {
                    ycbcr_row_to_rgb::<_, 0>(windows[0].row(y, columns.clone()), &lines[1], &lines[2], out);
                }
                (colour, _) => unusual_row_to_rgb(colour, &lines, out),
            }
        }
        rgb
    }

    /// Whether the picture is grey, or luma and chroma as cameras write it: luma a pixel, chroma the same, or half as much
    /// across, or in both directions.
    pub(super) fn is_usual(&self) -> bool {
        let is_sampled = |index: usize, component: &Component| match index {
            0 => component.subsampling == (1, 1),
            _ => matches!(component.subsampling, (1, 1) | (2, 1) | (2, 2)),
        };
        matches!(self.colour, Colour::Grey | Colour::YCbCr)
            && self.components.iter().enumerate().all(|(index, component)| is_sampled(index, component))
    }

    /// The means of the pixels over squares of `factor` x `factor`, for unusual pictures.
    fn decode_averaged(&self, columns: &Range<usize>, rows: &Range<usize>, factor: usize) -> Vec<u8> {
        let whole = |range: &Range<usize>| range.start..range.start + range.len() / factor * factor;
        let (columns, rows) = (whole(columns), whole(rows));
        if columns.is_empty() || rows.is_empty() {
            return Vec::new();
        }
        let width = columns.len();
        let pixels = self.decode_region(columns, rows.clone());
        let mut out = Vec::with_capacity(pixels.len() / factor / factor);
        for strip in pixels.chunks_exact(3 * width * factor) {
            for column in 0..width / factor {
                for channel in 0..3 {
                    let at = |row: usize, across: usize| {
                        strip[3 * (row * width + column * factor + across) + channel]
                    };
                    let square =
                        (0..factor * factor).map(|place| u32::from(at(place / factor, place % factor)));
                    out.push(
                        ((square.sum::<u32>() + (factor * factor / 2) as u32) / (factor * factor) as u32)
                            as u8,
                    );
                }
            }
        }
        out
    }

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
        if !self.is_usual() {
            self.check_scaled(&columns, &rows, factor);
            return self.decode_averaged(&columns, &rows, factor).chunks_exact(3).map(luma_of).collect();
        }
        let window = self.square_means(&self.components[0], &columns, &rows, factor, |mean| mean);
        let (columns, rows) = (scaled(&columns, factor), scaled(&rows, factor));
        let mut values = Vec::with_capacity(columns.len() * rows.len());
        for row in rows {
            values.extend(window.row(row, columns.clone()).iter().map(|value| value.clamp(0.0, 255.0)));
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
        if !self.is_usual() {
            self.check_scaled(&columns, &rows, factor);
            return self.decode_averaged(&columns, &rows, factor);
        }
        let mut windows = Vec::with_capacity(self.components.len());
        for component in &self.components {
            windows.push(self.square_means(component, &columns, &rows, factor, fixed_point::<FRACTION>));
        }
        let (columns, rows) = (scaled(&columns, factor), scaled(&rows, factor));
        let mut rgb = vec![0; 3 * columns.len() * rows.len()];
        for (row, out) in rows.zip(rgb.chunks_exact_mut((3 * columns.len()).max(1))) {
            let line = |component: usize| windows[component].row(row, columns.clone());
            if windows.len() == 1 {
                let grey = vec![128 << FRACTION; columns.len()];
                ycbcr_row_to_rgb::<_, FRACTION>(line(0), &grey, &grey, out);
            } else {
                ycbcr_row_to_rgb::<_, FRACTION>(line(0), line(1), line(2), out);
            }
        }
        rgb
    }

    /// Panics unless the region lies in the picture and can be decoded at 1/`factor` of its size.
    #[inline(always)]
    fn check_scaled(&self, columns: &Range<usize>, rows: &Range<usize>, factor: usize) {
        self.check_region(columns, rows);
        assert!(Self::can_decode_scaled(columns, rows, factor), "{columns:?} and {rows:?} by {factor}");
    }

    /// The means of a component over squares of `factor` x `factor` pixels.
    #[inline(always)]
    fn square_means<T: Copy + Default>(
        &self,
        component: &Component,
        columns: &Range<usize>,
        rows: &Range<usize>,
        factor: usize,
        convert: impl Fn(f32) -> T,
    ) -> Window<T> {
        self.check_scaled(columns, rows, factor);
        let squares = |range: &Range<usize>| range.start / factor..(range.end - 1) / factor + 1;
        let (columns, rows) = (&squares(columns), &squares(rows));
        // Squares across and down in a block.
        let (across, down) = component.subsampling;
        match (BLOCK_SIDE * across / factor, BLOCK_SIDE * down / factor) {
            (1, 1) => self.window::<_, 1, 1>(component, columns, rows, convert),
            (2, 1) => self.window::<_, 2, 1>(component, columns, rows, convert),
            (2, 2) => self.window::<_, 2, 2>(component, columns, rows, convert),
            (4, 2) => self.window::<_, 4, 2>(component, columns, rows, convert),
            (4, 4) => self.window::<_, 4, 4>(component, columns, rows, convert),
            (8, 4) => self.window::<_, 8, 4>(component, columns, rows, convert),
            _ => self.window::<_, 8, 8>(component, columns, rows, convert),
        }
    }
}

/// Rec. 601 luma of a pixel (T.871, section 7).
fn luma_of(pixel: &[u8]) -> f32 {
    0.299 * f32::from(pixel[0]) + 0.587 * f32::from(pixel[1]) + 0.114 * f32::from(pixel[2])
}

/// Fractional bits of the means of squares before colour conversion.
const FRACTION: u32 = 5;

/// The nearest multiple of 1/2^`FRACTION`, in these units; below 2^15 of them.
#[inline(always)]
fn fixed_point<const FRACTION: u32>(value: f32) -> i16 {
    // At 1.5 times 2^23 the last bit of a number is worth 1, so the sum is rounded and its low bits are the result.
    (value * (1 << FRACTION) as f32 + 12_582_912.0).to_bits() as i16
}

/// The whole squares of a range of pixels.
const fn scaled(range: &Range<usize>, factor: usize) -> Range<usize> {
    range.start / factor..range.start / factor + (range.end - range.start) / factor
}
