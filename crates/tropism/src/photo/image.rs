//! Decoded images.

use super::PhotoError;

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

    /// The bytes of the image as a JPEG file of `quality` 1 to 100.
    ///
    /// # Errors
    /// [`PhotoError::TooLarge`] beyond 65 535 columns or rows; [`PhotoError::Damaged`] for an image without pixels.
    pub fn to_jpeg(&self, quality: u8) -> Result<Vec<u8>, PhotoError> {
        let too_large = PhotoError::TooLarge { width: self.width, height: self.height };
        let (Ok(width), Ok(height)) = (u16::try_from(self.width), u16::try_from(self.height)) else {
            return Err(too_large);
        };
        let mut bytes = Vec::new();
        jpeg_encoder::Encoder::new(&mut bytes, quality.clamp(1, 100))
            .encode(&self.rgb, width, height, jpeg_encoder::ColorType::Rgb)
            .map_err(PhotoError::damaged_by)?;
        Ok(bytes)
    }
}
