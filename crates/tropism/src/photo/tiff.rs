//! TIFF files: the first picture, grey or in colour, of 8 or 16 bits, plain or packed with LZW or Deflate.

use std::io::Cursor;

use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, DecodingResult, Limits};

use super::{Image, MAX_PIXELS, PhotoError, check_size};

/// Bytes of the largest picture: four samples of 16 bits a pixel.
const MAX_BYTES: usize = 8 * MAX_PIXELS;

/// Decodes the first picture of a file. Samples of 16 bits become 8; transparency is dropped.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, PhotoError> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_BYTES;
    let decoder = Decoder::new(Cursor::new(bytes)).map_err(PhotoError::damaged_by)?;
    let mut decoder = decoder.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(PhotoError::damaged_by)?;
    let (width, height) = (width as usize, height as usize);
    check_size(width, height)?;
    let samples = match decoder.colortype().map_err(PhotoError::damaged_by)? {
        ColorType::Gray(8 | 16) => 1,
        ColorType::GrayA(8 | 16) => 2,
        ColorType::RGB(8 | 16) => 3,
        ColorType::RGBA(8 | 16) => 4,
        other => {
            return Err(PhotoError::damaged(format!("a TIFF of {other:?}, not grey or RGB of 8 or 16 bits")));
        }
    };
    let values: Vec<u8> = match decoder.read_image().map_err(PhotoError::damaged_by)? {
        DecodingResult::U8(values) => values,
        DecodingResult::U16(values) => values.into_iter().map(|value| (value >> 8) as u8).collect(),
        _ => return Err(PhotoError::damaged("a TIFF of other than whole numbers")),
    };
    if values.len() < samples * width * height {
        return Err(PhotoError::damaged(format!("{} samples for {width} x {height} pixels", values.len())));
    }
    let pixels = values[..samples * width * height].chunks_exact(samples);
    let rgb =
        pixels.flat_map(|pixel| if samples < 3 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] });
    Ok(Image { width, height, rgb: rgb.collect() })
}

#[cfg(test)]
mod tests {
    use ::tiff::encoder::{TiffEncoder, colortype};

    use super::super::Photo;
    use super::*;

    fn open(bytes: Vec<u8>) -> Result<Image, PhotoError> {
        Photo { name: "test.tif".to_owned(), bytes, time_s: 0.0 }.decode()
    }

    #[test]
    fn grey_and_colour_of_8_and_16_bits_decode() {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        encoder.write_image::<colortype::Gray16>(2, 1, &[0x0a00, 0xc8ff]).unwrap();
        let grey = open(file.into_inner()).unwrap();
        assert_eq!((grey.at(0, 0), grey.at(1, 0)), ([10; 3], [200; 3]));
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        encoder.write_image::<colortype::RGBA8>(1, 2, &[1, 2, 3, 0, 4, 5, 6, 255]).unwrap();
        let bytes = file.into_inner();
        let colour = open(bytes.clone()).unwrap();
        assert_eq!((colour.at(0, 0), colour.at(0, 1)), ([1, 2, 3], [4, 5, 6]));
        // Foreign bytes never panic.
        for length in 0..bytes.len() {
            let _ = open(bytes[..length].to_vec());
        }
        assert!(open(bytes[..40].to_vec()).is_err());
    }
}
