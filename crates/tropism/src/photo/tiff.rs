//! TIFF files: the first picture, grey or in colour, of 8 or 16 bits, plain or packed with LZW or Deflate.

use std::io::Cursor;

use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, DecodingResult, Limits};

use super::{Image, MAX_PIXELS, PhotoError, check_size, image_of_samples};

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
    image_of_samples(&values, samples, width, height)
}
