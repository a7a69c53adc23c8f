//! Animated GIF, written picture by picture.
//!
//! In: pictures of one size. Out: bytes. One palette for all pictures avoids flicker. Only the pixels that changed are
//! written, because the noise of the camera would otherwise be most of the file.
//!
//! # References
//! Dekker 1994, doi:10.1088/0954-898X_5_3_003: NeuQuant, the choice of the palette.

use std::borrow::Cow;
use std::io::Write;

use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Frame, Repeat};

use super::Film;
use tropism::photo::Image;

/// A pixel whose channels all differ by at most this from the shown ones is not written. Chosen by hand: above the noise of
/// the camera.
const TOLERANCE: u8 = 10;

/// Index of the transparent colour: the pixel stays as it is.
const UNCHANGED: u8 = 255;

/// Bits of a channel in the look-up table of nearest colours.
const BITS: u32 = 5;

/// An animated GIF that repeats for ever.
pub struct Animation<W: Write> {
    encoder: Encoder<W>,
    palette: Palette,
    /// The picture as a viewer shows it now; `None` before the first.
    shown: Option<Vec<u8>>,
    size: (usize, usize),
}

/// Why an animation cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AnimationError {
    /// The encoder or its writer failed.
    #[error(transparent)]
    Gif(#[from] gif::EncodingError),
    /// A picture of another size than the first.
    #[error("found a picture of {} x {} pixels, wanted {} x {}", found.0, found.1, wanted.0, wanted.1)]
    Size {
        /// Columns and rows of the picture.
        found: (usize, usize),
        /// Columns and rows of the animation.
        wanted: (usize, usize),
    },
    /// A size that the format cannot hold.
    #[error("found {0} x {1} pixels, wanted 1 to 65535 each way")]
    Range(usize, usize),
}

impl<W: Write> Animation<W> {
    /// Begins an animation of the size of `samples`, with a palette for their colours and those that `film` draws, written
    /// to `to`.
    ///
    /// # Errors
    /// [`AnimationError`].
    ///
    /// # Panics
    /// If there are no samples.
    pub fn new(to: W, samples: &[Image], film: &Film) -> Result<Self, AnimationError> {
        let (width, height) = (samples[0].width, samples[0].height);
        let side = |length: usize| u16::try_from(length).ok().filter(|&side| side > 0);
        let (Some(columns), Some(rows)) = (side(width), side(height)) else {
            return Err(AnimationError::Range(width, height));
        };
        let palette = Palette::of(samples, &film.colours());
        let mut encoder = Encoder::new(to, columns, rows, &palette.colours.concat())?;
        encoder.set_repeat(Repeat::Infinite)?;
        Ok(Self { encoder, palette, shown: None, size: (width, height) })
    }

    /// Adds a picture that is shown for `delay` hundredths of a second.
    ///
    /// # Errors
    /// [`AnimationError`].
    pub fn add(&mut self, image: &Image, delay: u16) -> Result<(), AnimationError> {
        let found = (image.width, image.height);
        if found != self.size {
            return Err(AnimationError::Size { found, wanted: self.size });
        }
        let is_first = self.shown.is_none();
        let shown = self.shown.get_or_insert_with(|| vec![0; image.rgb.len()]);
        let mut indices = Vec::with_capacity(image.rgb.len() / 3);
        for (new, old) in image.rgb.chunks_exact(3).zip(shown.chunks_exact_mut(3)) {
            let is_near = new.iter().zip(&*old).all(|(new, old)| new.abs_diff(*old) <= TOLERANCE);
            let index = if is_near && !is_first { UNCHANGED } else { self.palette.index(new) };
            if index != UNCHANGED {
                old.copy_from_slice(&self.palette.colours[usize::from(index)]);
            }
            indices.push(index);
        }
        let (left, top, width, buffer) = changed(&indices, self.size.0);
        self.encoder.write_frame(&Frame {
            delay,
            dispose: DisposalMethod::Keep,
            transparent: Some(UNCHANGED),
            left: left as u16,
            top: top as u16,
            width: width as u16,
            height: (buffer.len() / width) as u16,
            buffer: Cow::Owned(buffer),
            ..Frame::default()
        })?;
        Ok(())
    }

    /// Ends the file and returns what it was written to.
    ///
    /// # Errors
    /// [`AnimationError`].
    pub fn finish(self) -> Result<W, AnimationError> {
        Ok(self.encoder.into_inner()?)
    }
}

/// The bounding box of the changed pixels in a picture `columns` wide: left, top, width and its indices.
fn changed(indices: &[u8], columns: usize) -> (usize, usize, usize, Vec<u8>) {
    let is_changed = |index: &u8| *index != UNCHANGED;
    let rows: Vec<&[u8]> = indices.chunks_exact(columns).collect();
    let has = |row: &&[u8]| row.iter().any(is_changed);
    let Some(top) = rows.iter().position(has) else { return (0, 0, 1, vec![UNCHANGED]) };
    let bottom = rows.iter().rposition(has).unwrap_or(top);
    let rows = &rows[top..=bottom];
    let left = rows.iter().filter_map(|row| row.iter().position(is_changed)).min().unwrap_or(0);
    let right = rows.iter().filter_map(|row| row.iter().rposition(is_changed)).max().unwrap_or(left);
    (left, top, right - left + 1, rows.iter().flat_map(|row| &row[left..=right]).copied().collect())
}

/// At most 255 colours, with a look-up table of the nearest one.
struct Palette {
    colours: Vec<[u8; 3]>,
    nearest: Vec<u8>,
}

impl Palette {
    /// The palette of `samples` that holds the `drawn` colours as they are.
    fn of(samples: &[Image], drawn: &[[u8; 3]]) -> Self {
        let pixels: Vec<u8> = samples
            .iter()
            .flat_map(|image| image.rgb.chunks_exact(3))
            .flat_map(|pixel| [pixel[0], pixel[1], pixel[2], 255])
            .collect();
        let learned = NeuQuant::new(10, usize::from(UNCHANGED) - drawn.len(), &pixels).color_map_rgb();
        let learned = learned.chunks_exact(3).map(|colour| [colour[0], colour[1], colour[2]]);
        let colours: Vec<[u8; 3]> =
            drawn.iter().copied().chain(learned).take(usize::from(UNCHANGED)).collect();
        let cells = 1_usize << (3 * BITS);
        let channel = |cell: usize, place: u32| {
            let low = cell >> (place * BITS) & ((1 << BITS) - 1);
            ((low << (8 - BITS)) + (1 << (7 - BITS))) as i32
        };
        let distance = |cell: usize, colour: &[u8; 3]| {
            (0..3).map(|place| (channel(cell, place as u32) - i32::from(colour[place])).pow(2)).sum::<i32>()
        };
        let nearest = |cell: usize| {
            let best = (0..colours.len()).min_by_key(|&index| distance(cell, &colours[index]));
            best.unwrap_or_default() as u8
        };
        let nearest = (0..cells).map(nearest).collect();
        Self { colours, nearest }
    }

    fn index(&self, pixel: &[u8]) -> u8 {
        let part = |place: usize| usize::from(pixel[place] >> (8 - BITS)) << (place as u32 * BITS);
        self.nearest[part(0) | part(1) | part(2)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bright rectangle that moves over dark ground of changing brightness.
    fn pictures(count: u8) -> Vec<Image> {
        let picture = |number: u8| {
            let at = |x: usize, y: usize| match (x, y) {
                _ if (10 + usize::from(number)..20 + usize::from(number)).contains(&x) && y > 20 => {
                    [40, 200, 60]
                }
                _ => [20 + number % 3, 22, 24],
            };
            let rgb =
                (0..40).flat_map(|y| (0..60).map(move |x| (x, y))).flat_map(|(x, y)| at(x, y)).collect();
            Image { width: 60, height: 40, rgb }
        };
        (0..count).map(picture).collect()
    }

    /// The pictures of a GIF as a viewer shows them, each with its delay.
    fn played(bytes: &[u8]) -> Vec<(Image, u16)> {
        let mut decoder = gif::DecodeOptions::new().read_info(bytes).unwrap();
        let palette = decoder.global_palette().unwrap().to_vec();
        let (width, height) = (usize::from(decoder.width()), usize::from(decoder.height()));
        let mut canvas = vec![0; 3 * width * height];
        let mut pictures = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            let (left, top) = (usize::from(frame.left), usize::from(frame.top));
            for (row, indices) in frame.buffer.chunks_exact(usize::from(frame.width)).enumerate() {
                for (column, &index) in indices.iter().enumerate().filter(|(_, index)| **index != UNCHANGED) {
                    let at = 3 * ((top + row) * width + left + column);
                    canvas[at..at + 3].copy_from_slice(&palette[3 * usize::from(index)..][..3]);
                }
            }
            pictures.push((Image { width, height, rgb: canvas.clone() }, frame.delay));
        }
        pictures
    }

    fn animated(pictures: &[Image]) -> Vec<u8> {
        let mut animation = Animation::new(Vec::new(), pictures, &Film::default()).unwrap();
        for picture in pictures {
            animation.add(picture, 5).unwrap();
        }
        animation.finish().unwrap()
    }

    #[test]
    fn a_viewer_shows_the_added_pictures_within_the_tolerance() {
        let pictures = pictures(12);
        let bytes = animated(&pictures);
        assert!(bytes.starts_with(b"GIF89a"));
        let played = played(&bytes);
        assert_eq!(played.len(), 12);
        for (number, ((found, delay), wanted)) in played.iter().zip(&pictures).enumerate() {
            assert_eq!(*delay, 5);
            let worst = found.rgb.iter().zip(&wanted.rgb).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(worst <= Some(TOLERANCE + 8), "{number}: {worst:?}");
        }
    }

    #[test]
    fn a_still_picture_takes_few_bytes() {
        let still = vec![pictures(1).remove(0); 50];
        assert!(animated(&still).len() < animated(&still[..1]).len() + 50 * 40);
    }

    #[test]
    fn the_same_pictures_give_the_same_bytes() {
        assert_eq!(animated(&pictures(5)), animated(&pictures(5)));
    }

    #[test]
    fn sizes_are_checked() {
        let mut animation = Animation::new(Vec::new(), &pictures(1), &Film::default()).unwrap();
        let other = Image { width: 2, height: 2, rgb: vec![0; 12] };
        let error = animation.add(&other, 1).unwrap_err().to_string();
        assert_eq!(error, "found a picture of 2 x 2 pixels, wanted 60 x 40");
        let empty = Image { width: 0, height: 0, rgb: Vec::new() };
        assert!(matches!(
            Animation::new(Vec::new(), &[empty], &Film::default()),
            Err(AnimationError::Range(0, 0))
        ));
    }
}
