//! Decoded images.

use jpeg_encoder::{Encoder, ImageBuffer, JpegColorType, rgb_to_ycbcr};

use super::PhotoError;
use crate::geometry::Region;
use crate::math::statistics::upper_median;

/// A decoded image.
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
    /// If the place lies outside the image.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let start = 3 * (y * self.width + x);
        [self.rgb[start], self.rgb[start + 1], self.rgb[start + 2]]
    }

    /// The region of the whole image.
    #[must_use]
    pub const fn region(&self) -> Region {
        Region::whole((self.width, self.height))
    }

    /// Median of each channel; black without pixels.
    #[must_use]
    pub fn median_colour(&self) -> [u8; 3] {
        core::array::from_fn(|channel| {
            let values: Vec<u8> = self.rgb.iter().skip(channel).step_by(3).copied().collect();
            upper_median(&values, u8::cmp).unwrap_or(0)
        })
    }

    /// The bytes of the image as a JPEG file of `quality` 1 to 100.
    ///
    /// # Errors
    /// [`PhotoError::TooLarge`] beyond 65 535 columns or rows; [`PhotoError::Damaged`] for an image without pixels.
    pub fn to_jpeg(&self, quality: u8) -> Result<Vec<u8>, PhotoError> {
        let too_large = PhotoError::TooLarge { width: self.width, height: self.height };
        let (Ok(width), Ok(height)) = (u16::try_from(self.width), u16::try_from(self.height)) else {
            return Err(too_large);
        };
        let (found, wanted) = (self.rgb.len(), 3 * self.width * self.height);
        if found != wanted {
            let problem = format!("found {found} bytes of pixels, wanted {wanted}");
            return Err(PhotoError::Damaged { problem, source: None });
        }
        let mut bytes = Vec::new();
        Encoder::new(&mut bytes, quality.clamp(1, 100))
            .encode_image(RgbBuffer { image: self, width, height })
            .map_err(PhotoError::damaged_by)?;
        Ok(bytes)
    }
}

/// An image as the encoder reads it. `Encoder::encode` would compile the encoder once more for each of nine colour types.
struct RgbBuffer<'i> {
    image: &'i Image,
    width: u16,
    height: u16,
}

impl ImageBuffer for RgbBuffer<'_> {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        JpegColorType::Ycbcr
    }

    fn width(&self) -> u16 {
        self.width
    }

    fn height(&self) -> u16 {
        self.height
    }

    fn fill_buffers(&self, y: u16, buffers: &mut [Vec<u8>; 4]) {
        let row = 3 * self.image.width;
        let start = usize::from(y) * row;
        for pixel in self.image.rgb[start..start + row].chunks_exact(3) {
            let (luma, blue, red) = rgb_to_ycbcr(pixel[0], pixel[1], pixel[2]);
            buffers[0].push(luma);
            buffers[1].push(blue);
            buffers[2].push(red);
        }
    }
}
