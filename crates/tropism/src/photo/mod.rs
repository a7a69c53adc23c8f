//! Photographs: the bytes that a camera gave, and the pixels in them.
//!
//! In: the bytes of a JPEG, PNG or TIFF file. Out: an [`Image`], upright, or a [`LazyImage`] that decodes only the regions
//! that are asked for. Half a file is an error here, not a half-grey image.

mod name_order;
mod timestamp;
mod exif;
mod image;
pub mod jpeg;
mod tiff;

use std::error::Error;
use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

pub use self::exif::header_of_virtual_plant;
pub use self::exif::{ExifHeader, Orientation};
pub use self::image::Image;
pub use self::name_order::natural_order;
pub use self::timestamp::time_in_name;

use crate::geometry::Region;
use jpeg::Jpeg;

/// The largest image that is decoded, in pixels. It bounds the memory that a foreign file can claim to 192 MiB.
pub const MAX_PIXELS: usize = jpeg_regions::MAX_PIXELS;

/// A photograph as the camera gave it.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// Name of the file that it came from or will be kept in.
    pub name: String,
    /// The bytes of a JPEG, PNG or TIFF file.
    pub bytes: Vec<u8>,
    /// Seconds since the start of the experiment.
    pub time_s: f64,
}

/// The image of a photograph that is known to be whole, decoded region by region where its file allows.
#[derive(Clone, Debug)]
pub enum LazyImage {
    /// A baseline JPEG file, as most cameras write it: regions are decoded when they are asked for.
    Jpeg(Jpeg),
    /// Any other file, decoded as a whole.
    Decoded(Image),
}

/// Why bytes are not a photograph.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PhotoError {
    /// No bytes at all.
    #[error("the file is empty")]
    Empty,
    /// Neither JPEG nor PNG nor TIFF: the first four bytes.
    #[error("found a file that starts with {0:02x?}, wanted a JPEG, PNG or TIFF picture")]
    UnknownFormat(Vec<u8>),
    /// Cut short or damaged.
    #[error("found a damaged picture ({problem}), wanted a whole one")]
    Damaged {
        /// What is wrong with it.
        problem: String,
        /// The decoder's error, if it was the decoder that found it.
        source: Option<Box<dyn Error + Send + Sync>>,
    },
    /// More pixels than [`MAX_PIXELS`].
    #[error("found {width} x {height} pixels, wanted at most {MAX_PIXELS} in all")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

impl PhotoError {
    fn damaged(problem: impl Into<String>) -> Self {
        Self::Damaged { problem: problem.into(), source: None }
    }

    fn damaged_by(source: impl Error + Send + Sync + 'static) -> Self {
        Self::Damaged { problem: source.to_string().replace('\n', " "), source: Some(Box::new(source)) }
    }
}

impl Photo {
    /// Decodes the image and turns it upright as its Exif header says.
    ///
    /// Samples of 16 bits become 8; transparency is dropped.
    ///
    /// # Errors
    /// [`PhotoError`] where the bytes are not one whole JPEG, PNG or TIFF file.
    pub fn decode(&self) -> Result<Image, PhotoError> {
        self.open().map(LazyImage::into_image)
    }

    /// Checks that the photograph is whole and prepares it for decoding by regions, with the same pixels as
    /// [`Photo::decode`].
    ///
    /// # Errors
    /// Those of [`Photo::decode`].
    pub fn open(&self) -> Result<LazyImage, PhotoError> {
        let image = match self.bytes.as_slice() {
            [] => Err(PhotoError::Empty),
            [0xff, 0xd8, ..] => match Jpeg::read(without_padding(&self.bytes)).map(LazyImage::Jpeg) {
                Some(jpeg) if self.orientation() == Orientation::default() => return Ok(jpeg),
                Some(jpeg) => Ok(jpeg.into_image()),
                None => decode_jpeg(&self.bytes),
            },
            [0x89, b'P', b'N', b'G', ..] => decode_png(&self.bytes),
            [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => tiff::decode(&self.bytes),
            other => Err(PhotoError::UnknownFormat(other.iter().take(4).copied().collect())),
        }?;
        Ok(LazyImage::Decoded(self.orientation().upright(image)))
    }

    fn orientation(&self) -> Orientation {
        ExifHeader::read(&mut Cursor::new(&self.bytes)).orientation
    }
}

impl LazyImage {
    /// The whole image.
    #[must_use]
    pub fn into_image(self) -> Image {
        match self {
            Self::Jpeg(jpeg) => {
                let whole = Region { x: 0, y: 0, width: jpeg.width, height: jpeg.height };
                jpeg::decode_region(&jpeg, whole)
            }
            Self::Decoded(image) => image,
        }
    }
}

/// The bytes of a file without the zeros that some cameras append.
fn without_padding(bytes: &[u8]) -> &[u8] {
    &bytes[..bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1)]
}

/// Refuses images without pixels, and those with more than [`MAX_PIXELS`].
fn check_size(width: usize, height: usize) -> Result<(), PhotoError> {
    match width.checked_mul(height) {
        Some(0) => Err(PhotoError::damaged("no pixels")),
        Some(pixels) if pixels <= MAX_PIXELS => Ok(()),
        _ => Err(PhotoError::TooLarge { width, height }),
    }
}

fn decode_jpeg(bytes: &[u8]) -> Result<Image, PhotoError> {
    // zune-jpeg fills in what is missing at the end even in strict mode, so the end marker (EOI) is demanded first.
    let whole = without_padding(bytes);
    if !whole.ends_with(&[0xff, 0xd9]) {
        return Err(PhotoError::damaged(format!("no end marker after {} bytes", bytes.len())));
    }
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(1 << 16)
        .set_max_height(1 << 16)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(whole), options);
    decoder.decode_headers().map_err(PhotoError::damaged_by)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| PhotoError::damaged("no size"))?;
    check_size(width, height)?;
    let rgb = decoder.decode().map_err(PhotoError::damaged_by)?;
    if rgb.len() != 3 * width * height {
        return Err(PhotoError::damaged(format!("{} bytes for {width} x {height} pixels", rgb.len())));
    }
    Ok(Image { width, height, rgb })
}

fn decode_png(bytes: &[u8]) -> Result<Image, PhotoError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(PhotoError::damaged_by)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    check_size(width, height)?;
    let size = reader.output_buffer_size().ok_or(PhotoError::TooLarge { width, height })?;
    let mut buffer = vec![0; size];
    let frame = reader.next_frame(&mut buffer).map_err(PhotoError::damaged_by)?;
    let samples = frame.color_type.samples();
    image_of_samples(&buffer, samples, width, height)
}

/// The image of pixels with one or two samples (grey) or three or four (colour) each; transparency is dropped.
fn image_of_samples(values: &[u8], samples: usize, width: usize, height: usize) -> Result<Image, PhotoError> {
    let short = || PhotoError::damaged(format!("{} samples for {width} x {height} pixels", values.len()));
    let pixels = values.get(..samples * width * height).ok_or_else(short)?.chunks_exact(samples);
    let rgb =
        pixels.flat_map(|pixel| if samples < 3 { [pixel[0]; 3] } else { [pixel[0], pixel[1], pixel[2]] });
    Ok(Image { width, height, rgb: rgb.collect() })
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
    fn a_whole_file_decodes_and_every_truncated_one_is_refused() {
        let whole = jpeg(48, 32);
        let image = decode(whole.clone()).unwrap();
        assert_eq!((image.width, image.height, image.rgb.len()), (48, 32, 3 * 48 * 32));
        for length in 0..whole.len() {
            assert!(decode(whole[..length].to_vec()).is_err(), "{length} of {} bytes", whole.len());
        }
    }

    #[test]
    fn unknown_formats_are_named() {
        assert!(matches!(decode(Vec::new()), Err(PhotoError::Empty)));
        let error = decode(b"GIF89a".to_vec()).unwrap_err().to_string();
        assert!(error.contains("47") && error.contains("wanted a JPEG, PNG or TIFF"), "{error}");
    }

    #[test]
    fn damage_keeps_the_error_of_the_decoder() {
        let error = decode(vec![0xff, 0xd8, 0xff, 0xd9]).expect_err("no frame");
        let source = error.source().expect("zune-jpeg's error");
        assert!(error.to_string().contains(&source.to_string().replace('\n', " ")), "{error}");
        let cut = decode(jpeg(48, 32)[..100].to_vec()).expect_err("no end marker");
        assert!(cut.source().is_none(), "{cut}");
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
