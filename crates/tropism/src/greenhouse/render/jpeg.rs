//! The bytes of a JPEG file, colour at half resolution as cameras write it.

use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder, SamplingFactor};

use crate::photo::Image;

/// Writes a picture as a JPEG file of `quality` 1 to 100.
///
/// # Panics
/// If the picture has a side of 0 or above 65 535.
pub(super) fn encode(image: &Image, quality: u8) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(image.rgb.len() / 12);
    let mut encoder = Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    // By itself the encoder takes the colour of one pixel of four, and a stem three pixels across would flicker.
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
    let side = |length: usize| u16::try_from(length).expect("a side of at most 65 535 pixels");
    encoder
        .encode(&image.rgb, side(image.width), side(image.height), ColorType::Rgb)
        .expect("a picture that has pixels is written to memory");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo::Photo;

    #[test]
    fn even_and_odd_sides_come_back_in_their_colours() {
        for (width, height) in [(16, 16), (17, 31), (40, 33), (1, 1)] {
            let rgb = (0..width * height)
                .flat_map(|at| if at % width < width / 2 { [40, 160, 60] } else { [200, 90, 30] })
                .collect();
            let image = Image { width, height, rgb };
            let bytes = encode(&image, 95);
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
