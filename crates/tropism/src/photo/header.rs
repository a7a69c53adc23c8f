//! When a photograph was taken and which way up it is, from its Exif header or its name.

use std::io::{BufRead, Seek};

use exif::{DateTime, Exif, In, Tag, Value};

use super::Image;

/// What the Exif header of a photograph says; the default is what a file without one says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Header {
    /// When it was taken, in seconds since the beginning of 1970: of the place's own clock where the header does not say
    /// how that clock differs from Greenwich.
    pub taken_s: Option<f64>,
    /// How the camera was held.
    pub turn: Turn,
}

impl Header {
    /// Reads no more of `input` than the header; bytes that are no photograph have none.
    pub fn read(input: &mut (impl BufRead + Seek)) -> Self {
        let Ok(exif) = exif::Reader::new().read_from_container(input) else { return Self::default() };
        let field = |tag| exif.get_field(tag, In::PRIMARY);
        let number = field(Tag::Orientation).and_then(|field| field.value.get_uint(0)).unwrap_or(1);
        Self { taken_s: taken(&exif), turn: Turn(number.try_into().unwrap_or(1)) }
    }
}

fn taken(exif: &Exif) -> Option<f64> {
    let text = |tag| match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Ascii(lines) => lines.first().cloned(),
        _ => None,
    };
    let mut time =
        DateTime::from_ascii(&text(Tag::DateTimeOriginal).or_else(|| text(Tag::DateTime))?).ok()?;
    // A fraction of a second or an offset that cannot be read is as good as none.
    let _ = time.parse_subsec(&text(Tag::SubSecTimeOriginal).unwrap_or_default());
    let _ = time.parse_offset(&text(Tag::OffsetTimeOriginal).unwrap_or_default());
    let clock = [time.month, time.day, time.hour, time.minute, time.second].map(u32::from);
    let seconds = seconds(u32::from(time.year), clock)?;
    Some(seconds + f64::from(time.nanosecond.unwrap_or(0)) / 1e9 - 60.0 * f64::from(time.offset.unwrap_or(0)))
}

/// How a camera was held, as Exif numbers it: 1 is upright, 2 to 8 are the other turns and mirrorings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn(pub u8);

impl Default for Turn {
    fn default() -> Self {
        Self(1)
    }
}

impl Turn {
    /// The picture as it is meant to be seen. Numbers that mean nothing are upright.
    #[must_use]
    pub fn upright(self, image: Image) -> Image {
        let Image { width, height, .. } = image;
        let (right, bottom) = (width.wrapping_sub(1), height.wrapping_sub(1));
        // Where the pixel at (x, y) of the upright picture stands in the file.
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

/// The time in the name of a file, in seconds since the beginning of 1970; `None` where it holds none.
///
/// Year to second or minute, with or without signs between them; month to second with signs between them; or ten or
/// thirteen digits, the seconds or milliseconds that a computer counts.
///
/// ```
/// use tropism::photo::time_in_name;
/// assert_eq!(time_in_name("IMG_20240501_130500.jpg"), time_in_name("2024-05-01T13h05.png"));
/// assert_eq!(time_in_name("1714568700.jpg"), time_in_name("IMG_20240501_130500.jpg"));
/// assert_eq!(time_in_name("frame000123.jpg"), None);
/// ```
#[must_use]
pub fn time_in_name(name: &str) -> Option<f64> {
    let groups = digits(name);
    (0..groups.len()).find_map(|first| {
        let groups = &groups[first..];
        counted(groups[0].1).or_else(|| dated(groups)).or_else(|| yearless(groups))
    })
}

/// The groups of digits in a name, each with how many bytes stand between it and the one before.
fn digits(name: &str) -> Vec<(usize, &str)> {
    let mut groups = Vec::new();
    let (mut rest, mut between) = (name, 0);
    while let Some(start) = rest.find(|letter: char| letter.is_ascii_digit()) {
        let length = rest[start..].find(|letter: char| !letter.is_ascii_digit());
        let (group, after) = rest[start..].split_at(length.unwrap_or(rest.len() - start));
        groups.push((between + start, group));
        (rest, between) = (after, 0);
    }
    groups
}

/// Seconds or milliseconds as computers count them, from 2001 to 2286.
fn counted(group: &str) -> Option<f64> {
    let number: f64 = group.parse().ok()?;
    match group.len() {
        10 if group.as_bytes()[0] != b'0' => Some(number),
        13 if group.as_bytes()[0] != b'0' => Some(number / 1e3),
        _ => None,
    }
}

/// Year to second, or to minute: groups that end where these do, with at most two signs between them.
fn dated(groups: &[(usize, &str)]) -> Option<f64> {
    let mut text = String::new();
    for (index, (between, group)) in groups.iter().enumerate() {
        let is_apart = index > 0 && *between > 2;
        let is_whole = [4, 6, 8, 10, 12, 14].contains(&(text.len() + group.len()));
        if is_apart || !is_whole {
            break;
        }
        text += group;
    }
    let pair = |start: usize| text.get(start..start + 2).and_then(|pair| pair.parse::<u32>().ok());
    let year = text.get(..4)?.parse().ok()?;
    let second = if text.len() == 14 { pair(12)? } else { 0 };
    seconds(year, [pair(4)?, pair(6)?, pair(8)?, pair(10)?, second])
}

/// Month to second in five groups of two digits: of the year 1970, for want of another.
fn yearless(groups: &[(usize, &str)]) -> Option<f64> {
    let five = groups.get(..5).filter(|five| five.iter().all(|(_, group)| group.len() == 2))?;
    if five[1..].iter().any(|(between, _)| !(1..=2).contains(between)) {
        return None;
    }
    let number = |at: usize| five[at].1.parse::<u32>().ok();
    seconds(1970, [number(0)?, number(1)?, number(2)?, number(3)?, number(4)?])
}

/// Seconds from the beginning of 1970 to a time of the Gregorian calendar; `None` for what is no such time from 1970 to
/// 2199.
fn seconds(year: u32, [month, day, hour, minute, second]: [u32; 5]) -> Option<f64> {
    let is_leap =
        |year: u32| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let length = |month: u32| match month {
        2 => 28 + u32::from(is_leap(year)),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    };
    let is_date =
        (1970..2200).contains(&year) && (1..=12).contains(&month) && day >= 1 && day <= length(month);
    if !(is_date && hour < 24 && minute < 60 && second <= 60) {
        return None;
    }
    let years: u32 = (1970..year).map(|year| 365 + u32::from(is_leap(year))).sum();
    let days = years + (1..month).map(length).sum::<u32>() + day - 1;
    Some(f64::from(days) * 86_400.0 + f64::from(hour * 3_600 + minute * 60 + second))
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::photo::Photo;

    /// A JPEG of two columns, red and blue, that was taken at half past one and held as `turn` says.
    fn photograph(turn: u8) -> Vec<u8> {
        let rgb = [[250, 0, 0, 0, 0, 250]; 16].concat();
        let wide: Vec<u8> =
            rgb.chunks(6).flat_map(|row| [row[..3].repeat(16), row[3..].repeat(16)].concat()).collect();
        let jpeg = Image { width: 32, height: 16, rgb: wide }.to_jpeg(95).unwrap();
        let mut exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x02".to_vec();
        exif.extend([1, 0x12, 0, 3, 0, 0, 0, 1, 0, turn, 0, 0]);
        exif.extend([1, 0x32, 0, 2, 0, 0, 0, 20, 0, 0, 0, 38, 0, 0, 0, 0]);
        exif.extend(b"2024:05:01 01:30:00\0");
        let length = (exif.len() + 2) as u16;
        [&jpeg[..2], &[0xff, 0xe1], &length.to_be_bytes(), &exif, &jpeg[2..]].concat()
    }

    #[test]
    fn exif_tells_time_and_turn() {
        let header = Header::read(&mut Cursor::new(photograph(6)));
        assert_eq!(header, Header { taken_s: Some(1_714_527_000.0), turn: Turn(6) });
        assert_eq!(header.taken_s, time_in_name("20240501013000"));
        for foreign in [&b""[..], b"GIF89a", &photograph(6)[..30]] {
            assert_eq!(Header::read(&mut Cursor::new(foreign)), Header::default());
        }
    }

    #[test]
    fn a_turned_photograph_is_seen_upright() {
        let red = |image: &Image, x: usize, y: usize| image.at(x, y)[0] > 128;
        for (turn, size, corner) in [
            (1, (32, 16), (0, 0)),
            (2, (32, 16), (31, 0)),
            (3, (32, 16), (31, 15)),
            (4, (32, 16), (0, 15)),
            (5, (16, 32), (0, 0)),
            (6, (16, 32), (15, 0)),
            (7, (16, 32), (15, 31)),
            (8, (16, 32), (0, 31)),
            (9, (32, 16), (0, 0)),
        ] {
            let photo = Photo { name: String::new(), bytes: photograph(turn), time_s: 0.0 };
            let image = photo.decode().unwrap();
            assert_eq!((image.width, image.height), size, "{turn}");
            assert!(red(&image, corner.0, corner.1), "{turn}");
            assert!(!red(&image, size.0 - 1 - corner.0, size.1 - 1 - corner.1), "{turn}");
        }
    }

    #[test]
    fn every_turn_puts_each_pixel_somewhere_else() {
        let rgb: Vec<u8> = (0..3 * 6).collect();
        let image = Image { width: 3, height: 2, rgb };
        // What the first row of the file becomes: the left edge from below, say, for a camera held on its side.
        let first = [image.at(0, 0), image.at(1, 0), image.at(2, 0)];
        let line = |turn: u8, places: [(usize, usize); 3]| {
            let upright = Turn(turn).upright(image.clone());
            assert_eq!(places.map(|(x, y)| upright.at(x, y)), first, "{turn}");
        };
        line(2, [(2, 0), (1, 0), (0, 0)]);
        line(3, [(2, 1), (1, 1), (0, 1)]);
        line(4, [(0, 1), (1, 1), (2, 1)]);
        line(5, [(0, 0), (0, 1), (0, 2)]);
        line(6, [(1, 0), (1, 1), (1, 2)]);
        line(7, [(1, 2), (1, 1), (1, 0)]);
        line(8, [(0, 2), (0, 1), (0, 0)]);
    }

    #[test]
    fn names_tell_the_time() {
        let noon = time_in_name("20240301120000").unwrap();
        for name in [
            "2024-03-01_12-00-00.jpg",
            "2024-03-01T12:00:00Z.png",
            "cam1_20240301-1200.jpg",
            "plant_3 2024.03.01 12h00m00s.jpg",
            "IMG_20240301_120000_0042.jpg",
            "1709294400.jpg",
            "cam 1709294400000.jpg",
        ] {
            assert_eq!(time_in_name(name), Some(noon), "{name}");
        }
        let yearless = |name| time_in_name(name).unwrap();
        assert_eq!(yearless("03_02__17_10_53.jpg") - yearless("03_02__17_09_52.jpg"), 61.0);
        for name in [
            "0001.jpg",
            "IMG-20240301-WA0003.jpg",
            "20241301_120000.jpg",
            "20240230_120000.jpg",
            "a.jpg",
            "frame123456789.jpg",
        ] {
            assert_eq!(time_in_name(name), None, "{name}");
        }
        assert_eq!(time_in_name("1970-01-02 00:00:01"), Some(86_401.0));
        assert!(time_in_name("20240229_000000").is_some() && time_in_name("21000229_000000").is_none());
    }
}
