//! TIFF files: grey, palette, RGB, CMYK and YCbCr of 1 to 16 bits, in strips or tiles, by pixels or by planes, plain or packed
//! with LZW, Deflate, PackBits or JPEG; and files of several pages.
//!
//! In: the bytes of a file, or a file to read pages from. Out: the first picture ([`decode`]), or a file with one page alone
//! ([`TiffPages`]). No crate does it: of those at hand `tiff` reads neither palettes nor subsampled YCbCr, and no page without
//! the whole file.
//!
//! # References
//! *TIFF Revision 6.0* (Adobe, 1992); *TIFF Technical Note 2* (1995) on JPEG.

mod directory;
mod chunks;
mod pages;

use std::io::Cursor;

use self::chunks::{Layout, samples_of};
use self::directory::{Directories, Directory, tag};
use super::depth::to_eight_bits;
use super::{Image, PhotoError, check_size};

pub use self::pages::TiffPages;

/// Why a file is not read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum TiffError {
    Damaged(&'static str),
    /// What its pictures are.
    Unsupported(String),
}

impl From<std::io::Error> for TiffError {
    fn from(_: std::io::Error) -> Self {
        Self::Damaged("the file ends too early")
    }
}

impl From<TiffError> for PhotoError {
    fn from(error: TiffError) -> Self {
        match error {
            TiffError::Damaged(problem) => Self::damaged(problem),
            TiffError::Unsupported(what) => Self::Unsupported(format!("a TIFF picture with {what}")),
        }
    }
}

/// What a pixel's samples mean (TIFF 6.0, tag PhotometricInterpretation).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Photometric {
    WhiteIsZero,
    BlackIsZero,
    Rgb,
    Palette,
    Cmyk,
    YCbCr,
}

impl Photometric {
    fn of(directory: &Directory) -> Result<Self, TiffError> {
        Ok(match directory.number(tag::PHOTOMETRIC) {
            Some(0) => Self::WhiteIsZero,
            Some(1 | 4) => Self::BlackIsZero,
            Some(2) => Self::Rgb,
            Some(3) => Self::Palette,
            Some(5) => Self::Cmyk,
            Some(6) => Self::YCbCr,
            Some(8..=10) => return Err(TiffError::Unsupported("Lab colours".to_owned())),
            Some(32_803 | 34_892) => {
                return Err(TiffError::Unsupported("raw samples of a sensor".to_owned()));
            }
            // A guess by the samples, as in libtiff.
            None if directory.number(tag::SAMPLES).unwrap_or(1) >= 3 => Self::Rgb,
            None => Self::BlackIsZero,
            Some(other) => return Err(TiffError::Unsupported(format!("photometric interpretation {other}"))),
        })
    }

    /// Samples that a pixel has at least.
    const fn samples(self) -> usize {
        match self {
            Self::WhiteIsZero | Self::BlackIsZero | Self::Palette => 1,
            Self::Rgb | Self::YCbCr => 3,
            Self::Cmyk => 4,
        }
    }
}

/// Decodes the first picture of a file. Samples of 16 bits become 8; transparency is dropped.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, PhotoError> {
    let mut directories = Directories::new(Cursor::new(bytes))?;
    let directory = directories.read_next()?.ok_or(TiffError::Damaged("no picture"))?;
    if directory.description().starts_with("ImageJ=") {
        // Its channels may stand in other pages. A page that is taken out has no description.
        let page = TiffPages::read(Cursor::new(bytes))?.page(0)?.ok_or(TiffError::Damaged("no picture"))?;
        return decode(&page);
    }
    let side = |tag| directory.number(tag).and_then(|side| usize::try_from(side).ok()).unwrap_or(0);
    let (width, height) = (side(tag::WIDTH), side(tag::HEIGHT));
    check_size(width, height)?;
    let photometric = Photometric::of(&directory)?;
    let layout = Layout::of(&directory, photometric, width, height)?;
    let values = samples_of(bytes, &directory, &layout)?;
    let pixels = to_rgb(values, &layout, &directory)?;
    Ok(Image { width, height, rgb: pixels })
}

/// Red, green and blue of the pixels with these samples.
fn to_rgb(values: Vec<u16>, layout: &Layout, directory: &Directory) -> Result<Vec<u8>, TiffError> {
    let samples = layout.samples;
    let photometric = layout.unpacked();
    if photometric == Photometric::Palette {
        let map = directory.numbers(tag::COLOUR_MAP);
        let colours = 1 << layout.bits;
        if layout.bits > 8 || map.len() < 3 * colours {
            return Err(TiffError::Damaged("a palette without colours"));
        }
        // Some programs write colours of 8 bits.
        let shift = if map.iter().any(|&value| value > 255) { 8 } else { 0 };
        let colour = |pixel: &[u16]| {
            let at = usize::from(pixel[0]).min(colours - 1);
            [0, 1, 2].map(|channel| (map[channel * colours + at] >> shift) as u8)
        };
        return Ok(values.chunks_exact(samples).flat_map(colour).collect());
    }
    let values: Vec<u8> = match layout.bits {
        16 => to_eight_bits(values),
        bits => {
            let most = (1_u32 << bits) - 1;
            values.into_iter().map(|value| (u32::from(value) * 255 / most) as u8).collect()
        }
    };
    let pixels = values.chunks_exact(samples);
    Ok(match photometric {
        Photometric::WhiteIsZero => pixels.flat_map(|pixel| [255 - pixel[0]; 3]).collect(),
        Photometric::BlackIsZero | Photometric::Palette => pixels.flat_map(|pixel| [pixel[0]; 3]).collect(),
        Photometric::Rgb => pixels.flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect(),
        Photometric::Cmyk => pixels.flat_map(rgb_of_cmyk).collect(),
        Photometric::YCbCr => pixels.flat_map(rgb_of_ycbcr).collect(),
    })
}

/// The light that the inks of a pixel leave.
fn rgb_of_cmyk(pixel: &[u8]) -> [u8; 3] {
    let left = |ink: u8| 255 - u32::from(ink);
    [0, 1, 2].map(|channel| ((left(pixel[channel]) * left(pixel[3]) + 127) / 255) as u8)
}

/// Rec. 601 over the full range (T.871, section 7).
fn rgb_of_ycbcr(pixel: &[u8]) -> [u8; 3] {
    let [luma, blue, red] = [0, 1, 2].map(|channel| f32::from(pixel[channel]));
    let (blue, red) = (blue - 128.0, red - 128.0);
    [luma + 1.402 * red, luma - 0.344_136 * blue - 0.714_136 * red, luma + 1.772 * blue]
        .map(|value| (value.clamp(0.0, 255.0) + 0.5) as u8)
}
