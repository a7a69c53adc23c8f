//! The pixels of a region: inverse DCT of the blocks around it, chroma upsampling and colour conversion.

use std::ops::Range;

use super::colour::ycbcr_row_to_rgb;
use super::upsample::{SampleWindow, upsample_row};
use super::{BLOCK_SIDE, Component, Jpeg};

impl Jpeg {
    /// The pixels of a region: red, green and blue, row by row.
    ///
    /// # Panics
    /// If the region is empty or does not lie inside the picture.
    #[must_use]
    #[inline(always)]
    pub fn decode_region(&self, columns: Range<usize>, rows: Range<usize>) -> Vec<u8> {
        self.check_region(&columns, &rows);
        let width = columns.len();
        // A loop, as what a closure of an iterator calls would not be compiled for this processor.
        let mut windows = Vec::with_capacity(self.components.len());
        for component in &self.components {
            windows.push(self.sample_window(component, &columns, &rows));
        }
        let mut rgb = vec![0; 3 * width * rows.len()];
        let mut chroma = [Vec::new(), Vec::new()];
        let mut mixed = Vec::new();
        for (y, out) in rows.zip(rgb.chunks_exact_mut(3 * width)) {
            let luma = &windows[0].row(y)[columns.start - windows[0].left..][..width];
            for ((component, window), line) in self.components.iter().zip(&windows).skip(1).zip(&mut chroma) {
                upsample_row(component, window, y, columns.clone(), &mut mixed, line);
            }
            let [blue, red] = &chroma;
            if self.components.len() == 1 {
                out.chunks_exact_mut(3).zip(luma).for_each(|(pixel, &value)| pixel.fill(value));
            } else {
                ycbcr_row_to_rgb(luma, blue, red, out);
            }
        }
        rgb
    }

    /// The samples of a component that the pixels of a region need.
    #[inline(always)]
    fn sample_window(
        &self,
        component: &Component,
        columns: &Range<usize>,
        rows: &Range<usize>,
    ) -> SampleWindow {
        // A component of half the resolution needs the next sample on each side.
        let blocks = |range: &Range<usize>, subsampling: usize, count: usize| {
            let (first, last) = (range.start / subsampling, (range.end - 1) / subsampling);
            let margin = subsampling - 1;
            (first.saturating_sub(margin) / BLOCK_SIDE, ((last + margin) / BLOCK_SIDE).min(count - 1))
        };
        let Component { subsampling, block_columns, block_rows, .. } = *component;
        let (left, right) = blocks(columns, subsampling.0, block_columns);
        let (top, bottom) = blocks(rows, subsampling.1, block_rows);
        let width = BLOCK_SIDE * (right - left + 1);
        let mut samples = vec![0; width * BLOCK_SIDE * (bottom - top + 1)];
        for (row, strip) in (top..=bottom).zip(samples.chunks_exact_mut(BLOCK_SIDE * width)) {
            let blocks = &component.blocks[row * block_columns + left..=row * block_columns + right];
            for (column, block) in blocks.iter().enumerate() {
                for (line, values) in strip.chunks_exact_mut(width).zip(self.samples(component, block)) {
                    line[BLOCK_SIDE * column..][..BLOCK_SIDE].copy_from_slice(&values);
                }
            }
        }
        SampleWindow { left: BLOCK_SIDE * left, top: BLOCK_SIDE * top, width, samples }
    }
}
