//! The pixels of a part of a picture.
//!
//! Colour that was stored at half the resolution is spread by weighing the nearest sample three times as much as the next
//! one, and turned into red, green and blue with factors of 14 bits: the arithmetic of `zune-jpeg`, to the bit.

use super::{Jpeg, Plane, SIDE};
use crate::geometry::Region;
use crate::photo::Image;
use crate::simd::{Kernel, dispatch};

/// Samples of one plane, in whole blocks around a region.
struct Patch {
    /// The plane's column and row of the first sample.
    left: usize,
    top: usize,
    width: usize,
    samples: Vec<u8>,
}

impl Patch {
    fn row(&self, y: usize) -> &[u8] {
        &self.samples[(y - self.top) * self.width..][..self.width]
    }
}

/// [`Jpeg::part`].
struct Part<'a>(&'a Jpeg, Region);

impl Kernel for Part<'_> {
    type Result = Image;

    #[inline(always)]
    fn run(self) -> Image {
        self.0.pixels(self.1)
    }
}

impl Jpeg {
    /// The pixels of a region.
    ///
    /// # Panics
    /// If it does not lie inside the picture.
    #[must_use]
    pub fn part(&self, region: Region) -> Image {
        dispatch(Part(self, region))
    }

    #[inline(always)]
    fn pixels(&self, region: Region) -> Image {
        let Region { x, y, width, height } = region;
        assert!(region.fits(self.width, self.height), "{region:?} in {} x {}", self.width, self.height);
        // A loop: what a closure in an iterator calls would not be compiled for this processor.
        let mut patches = Vec::with_capacity(self.planes.len());
        for plane in &self.planes {
            patches.push(self.patch(plane, region));
        }
        let mut rgb = vec![0; 3 * width * height];
        let mut lines = [Vec::new(), Vec::new()];
        let mut mixed = Vec::new();
        for (y, out) in (y..).zip(rgb.chunks_exact_mut(3 * width)) {
            let light = &patches[0].row(y)[x - patches[0].left..][..width];
            for ((plane, patch), line) in self.planes.iter().zip(&patches).skip(1).zip(&mut lines) {
                spread(plane, patch, y, x..x + width, &mut mixed, line);
            }
            let [blue, red] = &lines;
            if self.planes.len() == 1 {
                out.chunks_exact_mut(3).zip(light).for_each(|(pixel, &value)| pixel.fill(value));
            } else {
                colour(light, blue, red, out);
            }
        }
        Image { width, height, rgb }
    }

    /// The blocks of a plane that the pixels of a region need.
    #[inline(always)]
    fn patch(&self, plane: &Plane, region: Region) -> Patch {
        // Half the resolution needs the next sample on each side.
        let blocks = |from: usize, length: usize, spread: usize, most: usize| {
            let (first, last) = (from / spread, (from + length - 1) / spread);
            let margin = spread - 1;
            (first.saturating_sub(margin) / SIDE, ((last + margin) / SIDE).min(most - 1))
        };
        let (left, right) = blocks(region.x, region.width, plane.spread.0, plane.across);
        let (top, bottom) = blocks(region.y, region.height, plane.spread.1, plane.down);
        let width = SIDE * (right - left + 1);
        let mut samples = vec![0; width * SIDE * (bottom - top + 1)];
        for (row, strip) in (top..=bottom).zip(samples.chunks_exact_mut(SIDE * width)) {
            for (column, block) in
                plane.blocks[row * plane.across + left..=row * plane.across + right].iter().enumerate()
            {
                for (line, values) in strip.chunks_exact_mut(width).zip(self.samples(plane, block)) {
                    line[SIDE * column..][..SIDE].copy_from_slice(&values);
                }
            }
        }
        Patch { left: SIDE * left, top: SIDE * top, width, samples }
    }
}

/// One row of a plane of colour at the resolution of the picture, columns `xs` of it; `mixed` is room to work in.
#[inline(always)]
fn spread(
    plane: &Plane,
    patch: &Patch,
    y: usize,
    xs: std::ops::Range<usize>,
    mixed: &mut Vec<i16>,
    line: &mut Vec<i16>,
) {
    let (across, down) = plane.spread;
    let last = (SIDE * plane.across - 1, SIDE * plane.down - 1);
    let (first, end) = (xs.start / across, (xs.end - 1) / across + 1);
    // One more on each side; beyond the edge that on it.
    let (from, to) = (first.saturating_sub(across - 1), (end + across - 1).min(last.0 + 1));
    let near = &patch.row(y / down)[from - patch.left..to - patch.left];
    mixed.resize(end - first + 2, 0);
    let inner = &mut mixed[1 + from - first..][..to - from];
    if down == 1 {
        inner.iter_mut().zip(near).for_each(|(value, near)| *value = i16::from(*near));
    } else {
        let next = if y.is_multiple_of(2) { (y / 2).saturating_sub(1) } else { (y / 2 + 1).min(last.1) };
        let far = &patch.row(next)[from - patch.left..to - patch.left];
        for ((value, near), far) in inner.iter_mut().zip(near).zip(far) {
            *value = (3 * i16::from(*near) + i16::from(*far) + 2) >> 2;
        }
    }
    let count = mixed.len();
    if across == 1 {
        line.clear();
        line.extend_from_slice(&mixed[1..count - 1]);
        return;
    }
    if from == first {
        mixed[0] = mixed[1];
    }
    if to == end {
        mixed[count - 1] = mixed[count - 2];
    }
    line.resize(2 * (end - first), 0);
    for (i, pair) in line.chunks_exact_mut(2).enumerate() {
        let near = 3 * mixed[i + 1] + 2;
        pair[0] = (near + mixed[i]) >> 2;
        pair[1] = (near + mixed[i + 2]) >> 2;
    }
    line.drain(..xs.start - 2 * first);
    line.truncate(xs.len());
}

/// Red, green and blue of brightness, blueness and redness (Rec. 601 over the full range, as JFIF has it).
#[inline(always)]
fn colour(light: &[u8], blue: &[i16], red: &[i16], out: &mut [u8]) {
    const WIDE: usize = 16;
    let mut pixels = [[0; WIDE]; 3];
    let chunks =
        light.chunks(WIDE).zip(blue.chunks(WIDE)).zip(red.chunks(WIDE)).zip(out.chunks_mut(3 * WIDE));
    for (((light, blue), red), out) in chunks {
        if let (Ok(light), Ok(blue), Ok(red)) = (light.try_into(), blue.try_into(), red.try_into()) {
            convert::<WIDE>(light, blue, red, &mut pixels);
        } else {
            for (i, ((light, blue), red)) in light.iter().zip(blue).zip(red).enumerate() {
                let mut pixel = [[0]; 3];
                convert(&[*light], &[*blue], &[*red], &mut pixel);
                (0..3).for_each(|channel| pixels[channel][i] = pixel[channel][0]);
            }
        }
        for (i, pixel) in out.chunks_exact_mut(3).enumerate() {
            pixel.copy_from_slice(&[pixels[0][i], pixels[1][i], pixels[2][i]]);
        }
    }
}

#[inline(always)]
fn convert<const N: usize>(light: &[u8; N], blue: &[i16; N], red: &[i16; N], out: &mut [[u8; N]; 3]) {
    for i in 0..N {
        let light = (i32::from(light[i]) << 14) + (1 << 13) - 1;
        let (blue, red) = (blue[i] - 128, red[i] - 128);
        let times = |value: i16, factor: i32| i32::from(value) * factor;
        out[0][i] = ((light + times(red, 22_970)) >> 14).clamp(0, 255) as u8;
        out[1][i] = ((light - times(red, 11_700) - times(blue, 5_638)) >> 14).clamp(0, 255) as u8;
        out[2][i] = ((light + times(blue, 29_032)) >> 14).clamp(0, 255) as u8;
    }
}
