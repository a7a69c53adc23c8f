//! A photograph on its way through a step: opened once, decoded where it is read.
//!
//! In: the bytes of a photograph. Out: a picture whose regions can be read by several steps: brightness, detection, the lit
//! lamp. The one idea: opening a file is most of the work of reading it, so the opened picture is kept.

use std::sync::OnceLock;

use crate::photo::{Image, LazyImage, Photo, PhotoError};

/// A photograph that is opened when it is first read, and only once. A clone is opened anew.
///
/// ```
/// use tropism::photo::{Image, Photo};
/// use tropism::vision::Frame;
/// use tropism::vision::raster::source::PixelSource;
/// let bytes = Image { width: 64, height: 48, rgb: vec![90; 3 * 64 * 48] }.to_jpeg(90)?;
/// let frame = Frame::new(Photo { name: "000000.jpg".to_owned(), bytes, time_s: 0.0 });
/// assert_eq!(frame.picture().map(|picture| picture.size()).ok(), Some((64, 48)));
/// # Ok::<(), tropism::photo::PhotoError>(())
/// ```
#[derive(Debug)]
pub struct Frame {
    photo: Photo,
    picture: OnceLock<Result<LazyImage, PhotoError>>,
}

impl Clone for Frame {
    fn clone(&self) -> Self {
        Self::new(self.photo.clone())
    }
}

impl From<Photo> for Frame {
    fn from(photo: Photo) -> Self {
        Self::new(photo)
    }
}

impl Frame {
    /// A photograph that is not opened yet.
    #[must_use]
    pub const fn new(photo: Photo) -> Self {
        Self { photo, picture: OnceLock::new() }
    }

    /// The photograph.
    #[must_use]
    pub const fn photo(&self) -> &Photo {
        &self.photo
    }

    /// Its picture, opened by the first call.
    ///
    /// # Errors
    /// Those of [`Photo::open`].
    pub fn picture(&self) -> Result<&LazyImage, &PhotoError> {
        self.picture.get_or_init(|| self.photo.open()).as_ref()
    }

    /// All pixels of its picture.
    ///
    /// # Errors
    /// Those of [`Photo::open`].
    pub fn into_image(self) -> Result<Image, PhotoError> {
        self.picture.into_inner().unwrap_or_else(|| self.photo.open()).map(LazyImage::into_image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(bytes: Vec<u8>) -> Frame {
        Frame::new(Photo { name: "test.jpg".to_owned(), bytes, time_s: 0.0 })
    }

    #[test]
    fn a_frame_is_opened_once() {
        let rgb = (0..3 * 80 * 64).map(|i| (i * 7919 % 256) as u8).collect();
        let frame = frame(Image { width: 80, height: 64, rgb }.to_jpeg(90).unwrap());
        assert!(std::ptr::eq(frame.picture().unwrap(), frame.picture().unwrap()));
        assert_eq!(frame.clone().into_image().unwrap(), frame.photo().decode().unwrap());
        assert_eq!(frame.clone().into_image().unwrap(), frame.into_image().unwrap());
    }

    #[test]
    fn a_damaged_photograph_is_an_error_each_time() {
        let frame = frame(b"not a picture".to_vec());
        let errors = [frame.picture().unwrap_err().to_string(), frame.picture().unwrap_err().to_string()];
        assert_eq!(errors[0], errors[1]);
        assert_eq!(frame.into_image().unwrap_err().to_string(), errors[0]);
    }
}
