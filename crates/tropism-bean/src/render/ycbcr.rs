//! A picture as luma and chroma with 4:2:0 subsampling, the layout of JPEG files.
//!
//! The background is converted once. A plant is composited by the same linear sums, so a photograph needs no conversion from
//! red, green and blue.
//!
//! # References
//! ITU-T T.871 (2011), section 7: the colours of JPEG files.

use tropism::photo::Image;

use super::paint::Canvas;

/// A picture as brightness and two differences of colour.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct YcbcrImage {
    /// Columns and rows of the picture.
    pub(super) width: usize,
    pub(super) height: usize,
    /// Brightness of each pixel.
    pub(super) luma: Vec<u8>,
    /// Blueness and redness of each 2 x 2 pixels, 128 for grey.
    pub(super) blue: Vec<u8>,
    pub(super) red: Vec<u8>,
}

/// Brightness of a colour, in 65 536ths.
const fn luma([red, green, blue]: [i32; 3]) -> i32 {
    19_595 * red + 38_470 * green + 7_471 * blue
}

/// Blueness and redness of a colour, 0 for grey, in 65 536ths.
const fn chroma([red, green, blue]: [i32; 3]) -> [i32; 2] {
    [32_768 * blue - 11_058 * red - 21_710 * green, 32_768 * red - 27_439 * green - 5_329 * blue]
}

/// 65 536ths as a byte.
fn byte(value: i32) -> u8 {
    ((value + 32_768) >> 16).clamp(0, 255) as u8
}

/// The middle of blueness and redness, in 65 536ths.
const GREY: i32 = 128 << 16;

/// A 255th in 65 536ths.
const OF_255: i32 = 257;

impl YcbcrImage {
    /// Columns of the colour, half as many as of the brightness.
    const fn half_width(&self) -> usize {
        self.width.div_ceil(2)
    }

    /// A film that is exposed with a picture.
    pub(super) fn of(image: &Image) -> Self {
        let Image { width, height, rgb } = image;
        let (half_width, half_height) = (width.div_ceil(2), height.div_ceil(2));
        let colour = |pixel: &[u8]| -> [i32; 3] { core::array::from_fn(|band| i32::from(pixel[band])) };
        let luma = rgb.chunks_exact(3).map(|pixel| byte(luma(colour(pixel)))).collect();
        let mut film = Self {
            width: *width,
            height: *height,
            luma,
            blue: Vec::with_capacity(half_width * half_height),
            red: Vec::with_capacity(half_width * half_height),
        };
        for y in 0..half_height {
            for x in 0..half_width {
                // At an odd edge the last pixel counts twice.
                let mut sum = [0; 3];
                for (right, down) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let at = image.at((2 * x + right).min(width - 1), (2 * y + down).min(height - 1));
                    sum = core::array::from_fn(|band| sum[band] + i32::from(at[band]));
                }
                let [blue, red] = chroma(sum);
                film.blue.push(byte(GREY + blue / 4));
                film.red.push(byte(GREY + red / 4));
            }
        }
        film
    }

    /// The picture on it.
    pub(super) fn picture(&self) -> Image {
        let mut rgb = Vec::with_capacity(3 * self.luma.len());
        for (y, line) in self.luma.chunks_exact(self.width).enumerate() {
            let start = y / 2 * self.half_width();
            for (x, &luma) in line.iter().enumerate() {
                let [blue, red] = [&self.blue, &self.red].map(|plane| i32::from(plane[start + x / 2]) - 128);
                let luma = i32::from(luma) << 16;
                rgb.extend(
                    [luma + 91_881 * red, luma - 22_554 * blue - 46_802 * red, luma + 116_130 * blue]
                        .map(byte),
                );
            }
        }
        Image { width: self.width, height: self.height, rgb }
    }

    /// Lays the canvas over the part of the picture that it belongs to. Its corner lies at an even column and row.
    pub(super) fn lay_over(&mut self, canvas: &Canvas<'_>) {
        let (columns, rows) = (canvas.pixmap.width() as usize, canvas.pixmap.height() as usize);
        let [left, top] = canvas.corner.map(|corner| corner as usize);
        let pixels = canvas.pixmap.data();
        for y in (0..rows).step_by(2) {
            for x in (0..columns).step_by(2) {
                let mut sum = [0; 4];
                let mut count = 0;
                for (right, down) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (x, y) = (x + right, y + down);
                    if x >= columns || y >= rows {
                        continue;
                    }
                    let at = 4 * (y * columns + x);
                    let [red, green, blue, alpha] = core::array::from_fn(|part| i32::from(pixels[at + part]));
                    count += 1;
                    if alpha == 0 {
                        continue;
                    }
                    let below = &mut self.luma[(top + y) * self.width + left + x];
                    let through = i32::from(*below) * (255 - alpha) * OF_255;
                    *below = byte(luma([red, green, blue]) + through);
                    for (sum, part) in sum.iter_mut().zip([red, green, blue, alpha]) {
                        *sum += part;
                    }
                }
                let [red, green, blue, alpha] = sum;
                if alpha == 0 {
                    continue;
                }
                let at = (top + y) / 2 * self.half_width() + (left + x) / 2;
                let own = chroma([red, green, blue]);
                for (plane, own) in [&mut self.blue, &mut self.red].into_iter().zip(own) {
                    let below = (i32::from(plane[at]) - 128) * (255 * count - alpha) * OF_255;
                    plane[at] = byte(GREY + (own + below) / count);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn pictures_without_fine_colour_come_back(
            width in 1..9_usize, height in 1..9_usize, colours in prop::collection::vec(any::<[u8; 3]>(), 25),
        ) {
            let rgb = (0..width * height).flat_map(|at| colours[at / width / 2 * 5 + at % width / 2]).collect();
            let image = Image { width, height, rgb };
            let back = YcbcrImage::of(&image).picture();
            prop_assert_eq!((back.width, back.height), (width, height));
            for (&one, &other) in image.rgb.iter().zip(&back.rgb) {
                prop_assert!(one.abs_diff(other) <= 2, "{image:?} {back:?}");
            }
        }
    }
}
