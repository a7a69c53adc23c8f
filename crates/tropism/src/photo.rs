//! A photograph: the bytes as the camera gave them, and the picture in them.

mod header;
pub mod jpeg;
mod name_order;

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

pub use header::{Header, Turn, time_in_name};
pub use name_order::natural_order;

use crate::geometry::Region;
use jpeg::Jpeg;

/// The largest picture that is decoded, in pixels: a bound on memory when the bytes are foreign.
pub const MAX_PIXELS: usize = 64 << 20;

/// A photograph as the camera gave it.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// Name of the file it came from or will be kept in.
    pub name: String,
    /// JPEG or PNG.
    pub bytes: Vec<u8>,
    /// Seconds since the start of the experiment.
    pub time_s: f64,
}

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of each pixel, row by row from the top left: `3 * width * height` bytes.
    pub rgb: Vec<u8>,
}

impl Image {
    /// Red, green and blue at column `x`, row `y`.
    ///
    /// # Panics
    /// Outside the picture.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let start = 3 * (y * self.width + x);
        [self.rgb[start], self.rgb[start + 1], self.rgb[start + 2]]
    }

    /// The picture as a JPEG file of `quality` 1 to 100.
    ///
    /// # Errors
    /// [`PhotoError::TooLarge`] beyond 65 535 columns or rows; [`PhotoError::Damaged`] for a picture without pixels.
    pub fn to_jpeg(&self, quality: u8) -> Result<Vec<u8>, PhotoError> {
        let too_large = PhotoError::TooLarge { width: self.width, height: self.height };
        let (Ok(width), Ok(height)) = (u16::try_from(self.width), u16::try_from(self.height)) else {
            return Err(too_large);
        };
        let mut bytes = Vec::new();
        jpeg_encoder::Encoder::new(&mut bytes, quality.clamp(1, 100))
            .encode(&self.rgb, width, height, jpeg_encoder::ColorType::Rgb)
            .map_err(|error| PhotoError::Damaged(error.to_string()))?;
        Ok(bytes)
    }
}

/// A photograph that is known to be whole, decoded only where somebody looks if its file allows for it.
#[derive(Clone, Debug)]
pub enum Picture {
    /// Most files of cameras.
    Jpeg(Jpeg),
    /// All others.
    Image(Image),
}

/// Why bytes are not a picture.
#[derive(Debug, thiserror::Error)]
pub enum PhotoError {
    /// No bytes at all.
    #[error("the file is empty")]
    Empty,
    /// Neither JPEG nor PNG.
    #[error("found a file that starts with {0:02x?}, wanted a JPEG or PNG picture")]
    Foreign(Vec<u8>),
    /// Cut short or damaged.
    #[error("found a damaged picture ({0}), wanted a whole one")]
    Damaged(String),
    /// More pixels than [`MAX_PIXELS`].
    #[error("found {width} x {height} pixels, wanted at most {MAX_PIXELS} in all")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl Photo {
    /// Decodes the picture, upright as its header says the camera was held, and strictly: half a file is an error, not a
    /// grey half.
    ///
    /// Sixteen bits become eight; what lies behind transparency is shown.
    ///
    /// # Errors
    /// [`PhotoError`] says what the bytes are instead.
    pub fn decode(&self) -> Result<Image, PhotoError> {
        let image = match self.bytes.as_slice() {
            [] => Err(PhotoError::Empty),
            [0xff, 0xd8, ..] => decode_jpeg(&self.bytes),
            [0x89, b'P', b'N', b'G', ..] => decode_png(&self.bytes),
            other => Err(PhotoError::Foreign(other.iter().take(4).copied().collect())),
        }?;
        Ok(Header::read(&mut Cursor::new(&self.bytes)).turn.upright(image))
    }
}

impl Picture {
    /// All of its pixels.
    #[must_use]
    pub fn into_image(self) -> Image {
        match self {
            Self::Jpeg(jpeg) => jpeg.part(Region { x: 0, y: 0, width: jpeg.width, height: jpeg.height }),
            Self::Image(image) => image,
        }
    }
}

impl Photo {
    /// What [`Photo::decode`] decodes, opened.
    ///
    /// # Errors
    /// Those of [`Photo::decode`].
    pub fn open(&self) -> Result<Picture, PhotoError> {
        let is_upright = || Header::read(&mut Cursor::new(&self.bytes)).turn == Turn::default();
        match Jpeg::read(unpadded(&self.bytes)) {
            Some(jpeg) if is_upright() => Ok(Picture::Jpeg(jpeg)),
            _ => self.decode().map(Picture::Image),
        }
    }
}

/// A file without the zeros with which some cameras pad it.
fn unpadded(bytes: &[u8]) -> &[u8] {
    &bytes[..bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1)]
}

fn bounded(width: usize, height: usize) -> Result<(), PhotoError> {
    match width.checked_mul(height) {
        Some(0) => Err(PhotoError::Damaged("no pixels".to_owned())),
        Some(pixels) if pixels <= MAX_PIXELS => Ok(()),
        _ => Err(PhotoError::TooLarge { width, height }),
    }
}

fn decode_jpeg(bytes: &[u8]) -> Result<Image, PhotoError> {
    // A decoder fills in what is missing at the end without a word, even in strict mode: demand the end marker first.
    let whole = unpadded(bytes);
    if !whole.ends_with(&[0xff, 0xd9]) {
        return Err(PhotoError::Damaged(format!("no end marker after {} bytes", bytes.len())));
    }
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(1 << 16)
        .set_max_height(1 << 16)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let damaged = |error: &dyn std::fmt::Debug| PhotoError::Damaged(format!("{error:?}").replace('\n', " "));
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(whole), options);
    decoder.decode_headers().map_err(|error| damaged(&error))?;
    let (width, height) = decoder.dimensions().ok_or_else(|| PhotoError::Damaged("no size".to_owned()))?;
    bounded(width, height)?;
    let rgb = decoder.decode().map_err(|error| damaged(&error))?;
    if rgb.len() != 3 * width * height {
        return Err(PhotoError::Damaged(format!("{} bytes for {width} x {height} pixels", rgb.len())));
    }
    Ok(Image { width, height, rgb })
}

fn decode_png(bytes: &[u8]) -> Result<Image, PhotoError> {
    let damaged = |error: png::DecodingError| PhotoError::Damaged(error.to_string());
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(damaged)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    bounded(width, height)?;
    let size = reader.output_buffer_size().ok_or(PhotoError::TooLarge { width, height })?;
    let mut buffer = vec![0; size];
    let frame = reader.next_frame(&mut buffer).map_err(damaged)?;
    let samples = frame.color_type.samples();
    let rgb = buffer[..samples * width * height]
        .chunks_exact(samples)
        .flat_map(|pixel| if samples < 3 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] })
        .collect();
    Ok(Image { width, height, rgb })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jpeg(width: u16, height: u16) -> Vec<u8> {
        let (width, height) = (usize::from(width), usize::from(height));
        let rgb = (0..3 * width * height).map(|i| (i % 251) as u8).collect();
        Image { width, height, rgb }.to_jpeg(90).unwrap()
    }

    fn decode(bytes: Vec<u8>) -> Result<Image, PhotoError> {
        Photo { name: "test".to_owned(), bytes, time_s: 0.0 }.decode()
    }

    #[test]
    fn a_whole_file_decodes_and_every_cut_one_is_refused() {
        let whole = jpeg(48, 32);
        let image = decode(whole.clone()).unwrap();
        assert_eq!((image.width, image.height, image.rgb.len()), (48, 32, 3 * 48 * 32));
        for length in 0..whole.len() {
            assert!(decode(whole[..length].to_vec()).is_err(), "{length} of {} bytes", whole.len());
        }
    }

    #[test]
    fn foreign_bytes_are_named() {
        assert!(matches!(decode(Vec::new()), Err(PhotoError::Empty)));
        let error = decode(b"GIF89a".to_vec()).unwrap_err().to_string();
        assert!(error.contains("47") && error.contains("wanted a JPEG or PNG"), "{error}");
    }

    #[test]
    fn grey_png_decodes() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&[10, 200]).unwrap();
        let image = decode(bytes).unwrap();
        assert_eq!((image.at(0, 0), image.at(1, 0)), ([10; 3], [200; 3]));
    }
}
