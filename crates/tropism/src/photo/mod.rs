//! Photographs: the bytes that a camera gave, and the pixels in them.
//!
//! In: the bytes of a JPEG, PNG or TIFF file. Out: an [`Image`], upright, or a [`LazyImage`] that decodes only the regions
//! that are asked for. Half a file is an error here, not a half-grey image.

mod name_order;
mod timestamp;
mod name_times;
mod exif;
mod xmp;
mod image;
mod depth;
mod foreign;
pub mod jpeg;
mod tiff;

use std::error::Error;
use std::io::Cursor;

pub use self::exif::header_of_virtual_plant;
pub use self::exif::{ExifHeader, Orientation};
pub use self::image::Image;
pub use self::name_order::natural_order;
pub use self::name_times::{NameTimes, jump_of_clock, known_times, median_interval, times_in_names};
pub use self::tiff::TiffPages;
pub use self::timestamp::time_in_name;

use crate::geometry::Region;
use jpeg::{Jpeg, JpegError};

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
    /// A JPEG file: regions are decoded when they are asked for.
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
    /// A file of another kind, and what makes photographs of it.
    #[error("found {kind}, wanted a JPEG, PNG or TIFF picture: {advice}")]
    Foreign {
        /// What it is.
        kind: &'static str,
        /// How to convert it.
        advice: &'static str,
    },
    /// A JPEG, PNG or TIFF file of a kind that no usual camera writes.
    #[error("found {0}, which is not read: `magick FILE FILE.png` converts it (ImageMagick)")]
    Unsupported(String),
    /// Cut short or damaged.
    #[error("the picture is damaged ({problem})")]
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

impl From<JpegError> for PhotoError {
    fn from(error: JpegError) -> Self {
        match error {
            JpegError::Unsupported(what) => Self::Unsupported(format!("a JPEG picture with {what}")),
            JpegError::TooLarge { width, height } => Self::TooLarge { width, height },
            JpegError::Damaged(_) => Self::damaged_by(error),
        }
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
            [0xff, 0xd8, ..] => match (Jpeg::read(&self.bytes)?, self.orientation()) {
                (jpeg, upright) if upright == Orientation::default() => return Ok(LazyImage::Jpeg(jpeg)),
                (jpeg, _) => Ok(LazyImage::Jpeg(jpeg).into_image()),
            },
            [0x89, b'P', b'N', b'G', ..] => decode_png(&self.bytes),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => tiff::decode(&self.bytes),
            other => Err(foreign::kind_and_advice(other).map_or_else(
                || PhotoError::UnknownFormat(other.iter().take(4).copied().collect()),
                |(kind, advice)| PhotoError::Foreign { kind, advice },
            )),
        }?;
        Ok(LazyImage::Decoded(self.orientation().upright(image)))
    }

    fn orientation(&self) -> Orientation {
        ExifHeader::read(&mut Cursor::new(&self.bytes))
            .orientation
            .unwrap_or_else(|| xmp::orientation(&self.bytes))
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

/// Refuses images without pixels, and those with more than [`MAX_PIXELS`].
fn check_size(width: usize, height: usize) -> Result<(), PhotoError> {
    match width.checked_mul(height) {
        Some(0) => Err(PhotoError::damaged("no pixels")),
        Some(pixels) if pixels <= MAX_PIXELS => Ok(()),
        _ => Err(PhotoError::TooLarge { width, height }),
    }
}

fn decode_png(bytes: &[u8]) -> Result<Image, PhotoError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(PhotoError::damaged_by)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    check_size(width, height)?;
    let size = reader.output_buffer_size().ok_or(PhotoError::TooLarge { width, height })?;
    let mut buffer = vec![0; size];
    let frame = reader.next_frame(&mut buffer).map_err(PhotoError::damaged_by)?;
    let samples = frame.color_type.samples();
    if frame.bit_depth != png::BitDepth::Sixteen {
        return image_of_samples(&buffer, samples, width, height);
    }
    let values = buffer.chunks_exact(2).map(|value| u16::from_be_bytes([value[0], value[1]]));
    // Of colours only: that nothing is transparent says nothing of the range.
    let colours = if samples < 3 { 1 } else { 3 };
    let colour_values =
        values.enumerate().filter(|(at, _)| at % samples < colours).map(|(_, value)| value).collect();
    image_of_samples(&depth::to_eight_bits(colour_values), colours, width, height)
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
        let error = decode(b"<!DOCTYPE".to_vec()).unwrap_err().to_string();
        assert!(error.contains("3c") && error.contains("wanted a JPEG, PNG or TIFF"), "{error}");
        for (start, name) in [
            (&b"\0\0\0\x1cftypheic\0\0\0\0"[..], "HEIC"),
            (b"\0\0\0\x1cftypavif\0\0\0\0", "AVIF"),
            (b"RIFF\0\0\0\0WEBPVP8 ", "WebP"),
            (b"GIF89a", "GIF"),
        ] {
            let error = decode(start.to_vec()).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("`magick FILE FILE.jpg`"), "{error}");
        }
    }

    #[test]
    fn damage_keeps_the_error_of_the_decoder() {
        let error = decode(vec![0xff, 0xd8, 0xff, 0xd9]).expect_err("no frame");
        let source = error.source().expect("the decoder's error");
        assert!(error.to_string().contains(&source.to_string()), "{error}");
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
