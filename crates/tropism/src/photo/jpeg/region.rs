//! The pixels of a region: inverse DCT of the blocks around it, chroma upsampling and colour conversion.

use super::colour::ycbcr_row_to_rgb;
use super::upsample::{SampleWindow, upsample_row};
use super::{BLOCK_SIDE, Component, Jpeg};
use crate::geometry::Region;
use crate::photo::Image;
use crate::simd::{Kernel, dispatch};

/// [`Jpeg::decode_region`], compiled for several processors.
struct DecodeRegion<'a>(&'a Jpeg, Region);

impl Kernel for DecodeRegion<'_> {
    type Result = Image;

    #[inline(always)]
    fn run(self) -> Image {
        self.0.region(self.1)
    }
}

impl Jpeg {
    /// The pixels of a region.
    ///
    /// # Panics
    /// If the region does not lie inside the picture.
    #[must_use]
    pub fn decode_region(&self, region: Region) -> Image {
        dispatch(DecodeRegion(self, region))
    }

    #[inline(always)]
    fn region(&self, region: Region) -> Image {
        let Region { x, y, width, height } = region;
        assert!(region.fits(self.width, self.height), "{region:?} in {} x {}", self.width, self.height);
        // A loop, as what a closure of an iterator calls would not be compiled for this processor.
        let mut windows = Vec::with_capacity(self.components.len());
        for component in &self.components {
            windows.push(self.sample_window(component, region));
        }
        let mut rgb = vec![0; 3 * width * height];
        let mut chroma = [Vec::new(), Vec::new()];
        let mut mixed = Vec::new();
        for (y, out) in (y..).zip(rgb.chunks_exact_mut(3 * width)) {
            let luma = &windows[0].row(y)[x - windows[0].left..][..width];
            for ((component, window), line) in self.components.iter().zip(&windows).skip(1).zip(&mut chroma) {
                upsample_row(component, window, y, x..x + width, &mut mixed, line);
            }
            let [blue, red] = &chroma;
            if self.components.len() == 1 {
                out.chunks_exact_mut(3).zip(luma).for_each(|(pixel, &value)| pixel.fill(value));
            } else {
                ycbcr_row_to_rgb(luma, blue, red, out);
            }
        }
        Image { width, height, rgb }
    }

    /// The samples of a component that the pixels of a region need.
    #[inline(always)]
    fn sample_window(&self, component: &Component, region: Region) -> SampleWindow {
        // A component of half the resolution needs the next sample on each side.
        let blocks = |from: usize, length: usize, subsampling: usize, count: usize| {
            let (first, last) = (from / subsampling, (from + length - 1) / subsampling);
            let margin = subsampling - 1;
            (first.saturating_sub(margin) / BLOCK_SIDE, ((last + margin) / BLOCK_SIDE).min(count - 1))
        };
        let Component { subsampling, block_columns, block_rows, .. } = *component;
        let (left, right) = blocks(region.x, region.width, subsampling.0, block_columns);
        let (top, bottom) = blocks(region.y, region.height, subsampling.1, block_rows);
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
