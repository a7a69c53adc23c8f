//! The bytes of a JPEG file, colour at half resolution as cameras write it.

use jpeg_encoder::{Encoder, ImageBuffer, JpegColorType, SamplingFactor};
use tropism::photo::header_of_virtual_plant;

use super::ycbcr::YcbcrImage;

impl ImageBuffer for &YcbcrImage {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        JpegColorType::Ycbcr
    }

    fn width(&self) -> u16 {
        side(self.width)
    }

    fn height(&self) -> u16 {
        side(self.height)
    }

    /// Of the colours the encoder takes every second one of every second row; the last one is continued outwards.
    fn fill_buffers(&self, y: u16, buffers: &mut [Vec<u8>; 4]) {
        let (y, half) = (usize::from(y), self.width.div_ceil(2));
        let [luma, blue, red, _] = buffers;
        luma.extend_from_slice(&self.luma[y * self.width..(y + 1) * self.width]);
        for (buffer, plane) in [(blue, &self.blue), (red, &self.red)] {
            let filled = buffer.len();
            buffer.resize(filled + self.width, 0);
            if y.is_multiple_of(2) {
                let row = &plane[y / 2 * half..(y / 2 + 1) * half];
                for (pair, &colour) in buffer[filled..].chunks_exact_mut(2).zip(row) {
                    [pair[0], pair[1]] = [colour; 2];
                }
                buffer[filled + self.width - 1] = row[half - 1];
            }
        }
    }
}

fn side(length: usize) -> u16 {
    u16::try_from(length).expect("a side of at most 65 535 pixels")
}

/// Writes a picture as a JPEG file of `quality` 1 to 100, whose Exif header says that its plant is virtual.
///
/// # Panics
/// If the picture has a side of 0 or above 65 535.
pub(super) fn encode(film: &YcbcrImage, quality: u8) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(film.luma.len() / 4);
    let mut encoder = Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder.add_exif_metadata(&header_of_virtual_plant()).expect("a header of few bytes");
    encoder.encode_image(film).expect("a picture that has pixels is written to memory");
    bytes
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use tropism::photo::{ExifHeader, Image, Photo};

    use super::*;

    #[test]
    fn even_and_odd_sides_come_back_in_their_colours() {
        for (width, height) in [(16, 16), (17, 31), (40, 33), (1, 1)] {
            let rgb = (0..width * height)
                .flat_map(|at| if at % width < width / 2 { [40, 160, 60] } else { [200, 90, 30] })
                .collect();
            let image = Image { width, height, rgb };
            let bytes = encode(&YcbcrImage::of(&image), 95);
            assert!(ExifHeader::read(&mut Cursor::new(&bytes)).is_virtual);
            let back = Photo { name: String::new(), bytes, time_s: 0.0 }.decode().unwrap();
            assert_eq!((back.width, back.height), (width, height));
            for (x, y) in [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)] {
                let (wanted, found) = (image.at(x, y), back.at(x, y));
                let off = wanted.iter().zip(found).map(|(&a, b)| a.abs_diff(b)).max();
                assert!(off < Some(12), "({x}, {y}) of {width} x {height}: {found:?} for {wanted:?}");
            }
        }
    }
}
