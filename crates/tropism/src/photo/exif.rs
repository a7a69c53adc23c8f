//! The Exif header of a photograph: when it was taken and how the camera was held.
//!
//! # References
//! CIPA DC-008 (Exif 2.32), section 4.6: tags 0x010E (ImageDescription), 0x0112 (Orientation), 0x9003
//! (DateTimeOriginal) and those around them.

use std::io::{BufRead, Seek};

use exif::{DateTime, Exif, In, Tag, Value};

use super::Image;
use super::timestamp::unix_seconds;

/// Description in photographs of the virtual tent, which marks them as virtual wherever the file is copied.
const VIRTUAL: &str = "virtual plant";

/// The TIFF bytes of an Exif header with one field: the description of a photograph of the virtual tent.
pub fn header_of_virtual_plant() -> Vec<u8> {
    // Little-endian, a directory at 8 with one entry: the description, text, of this length, behind the directory at 26.
    let length = VIRTUAL.len() as u8 + 1;
    let mut bytes = b"II*\0\x08\0\0\0\x01\0\x0e\x01\x02\0".to_vec();
    bytes.extend([length, 0, 0, 0, 26, 0, 0, 0, 0, 0, 0, 0]);
    bytes.extend(VIRTUAL.as_bytes());
    bytes.push(0);
    bytes
}

/// The fields of an Exif header that matter here; the default is that of a file without one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExifHeader {
    /// When the photograph was taken, in seconds since 1970: in UTC where the header has an offset, otherwise on the
    /// camera's own clock.
    pub taken_s: Option<f64>,
    /// How the camera was held; `None` if the header does not say.
    pub orientation: Option<Orientation>,
    /// Whether it says that the photograph is of the virtual tent.
    pub is_virtual: bool,
}

impl ExifHeader {
    /// Reads the header from the beginning of a JPEG or PNG file; other bytes give the default.
    pub fn read(input: &mut (impl BufRead + Seek)) -> Self {
        let Ok(exif) = exif::Reader::new().read_from_container(input) else { return Self::default() };
        let field = |tag| exif.get_field(tag, In::PRIMARY);
        let number = field(Tag::Orientation).and_then(|field| field.value.get_uint(0));
        Self {
            taken_s: taken_s(&exif),
            orientation: number.map(|number| Orientation(number.try_into().unwrap_or(1))),
            is_virtual: text(&exif, Tag::ImageDescription).is_some_and(|text| text == VIRTUAL.as_bytes()),
        }
    }
}

fn text(exif: &Exif, tag: Tag) -> Option<Vec<u8>> {
    match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(lines) => lines.first().cloned(),
        _ => None,
    }
}

/// The time of the photograph or, without one, that of the file's last change.
fn taken_s(exif: &Exif) -> Option<f64> {
    let text = |tag| text(exif, tag);
    let mut time =
        DateTime::from_ascii(&text(Tag::DateTimeOriginal).or_else(|| text(Tag::DateTime))?).ok()?;
    // An unreadable fraction or offset counts as none.
    let _ = time.parse_subsec(&text(Tag::SubSecTimeOriginal).unwrap_or_default());
    let _ = time.parse_offset(&text(Tag::OffsetTimeOriginal).unwrap_or_default());
    let clock = [time.month, time.day, time.hour, time.minute, time.second].map(u32::from);
    let seconds = unix_seconds(u32::from(time.year), clock)?;
    Some(seconds + f64::from(time.nanosecond.unwrap_or(0)) / 1e9 - 60.0 * f64::from(time.offset.unwrap_or(0)))
}

/// Exif's number of the camera's orientation: 1 is upright, 2 to 8 are the other turns and mirror images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Orientation(pub u8);

impl Default for Orientation {
    fn default() -> Self {
        Self(1)
    }
}

impl Orientation {
    /// The image turned upright. Numbers beyond 8 count as upright.
    #[must_use]
    pub fn upright(self, image: Image) -> Image {
        let Image { width, height, .. } = image;
        let (right, bottom) = (width.wrapping_sub(1), height.wrapping_sub(1));
        // Where the pixel at (x, y) of the upright image lies in the file.
        let source = |x: usize, y: usize| match self.0 {
            2 => (right - x, y),
            3 => (right - x, bottom - y),
            4 => (x, bottom - y),
            5 => (y, x),
            6 => (y, bottom - x),
            7 => (right - y, bottom - x),
            _ => (right - y, x),
        };
        let (columns, rows) = match self.0 {
            2..=4 => (width, height),
            5..=8 => (height, width),
            _ => return image,
        };
        let place = |at: usize| source(at % columns, at / columns);
        let rgb = (0..columns * rows).flat_map(|at| image.at(place(at).0, place(at).1)).collect();
        Image { width: columns, height: rows, rgb }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_orientation_moves_the_first_row() {
        let rgb: Vec<u8> = (0..3 * 6).collect();
        let image = Image { width: 3, height: 2, rgb };
        let first = [image.at(0, 0), image.at(1, 0), image.at(2, 0)];
        let first_row_lies_at = |orientation: u8, places: [(usize, usize); 3]| {
            let upright = Orientation(orientation).upright(image.clone());
            assert_eq!(places.map(|(x, y)| upright.at(x, y)), first, "{orientation}");
        };
        first_row_lies_at(2, [(2, 0), (1, 0), (0, 0)]);
        first_row_lies_at(3, [(2, 1), (1, 1), (0, 1)]);
        first_row_lies_at(4, [(0, 1), (1, 1), (2, 1)]);
        first_row_lies_at(5, [(0, 0), (0, 1), (0, 2)]);
        first_row_lies_at(6, [(1, 0), (1, 1), (1, 2)]);
        first_row_lies_at(7, [(1, 2), (1, 1), (1, 0)]);
        first_row_lies_at(8, [(0, 2), (0, 1), (0, 0)]);
    }
}
