//! What a camera writes into the header of a photograph.

use std::io::Cursor;
use tropism::photo::{ExifHeader, Image, Orientation, Photo, time_in_name};

/// A JPEG of two columns, red and blue, that was taken at half past one and has this orientation.
fn photograph(orientation: u8) -> Vec<u8> {
    let rgb = [[250, 0, 0, 0, 0, 250]; 16].concat();
    let wide: Vec<u8> =
        rgb.chunks(6).flat_map(|row| [row[..3].repeat(16), row[3..].repeat(16)].concat()).collect();
    let jpeg = Image { width: 32, height: 16, rgb: wide }.to_jpeg(95).unwrap();
    let mut exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x02".to_vec();
    exif.extend([1, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0]);
    exif.extend([1, 0x32, 0, 2, 0, 0, 0, 20, 0, 0, 0, 38, 0, 0, 0, 0]);
    exif.extend(b"2024:05:01 01:30:00\0");
    let length = (exif.len() + 2) as u16;
    [&jpeg[..2], &[0xff, 0xe1], &length.to_be_bytes(), &exif, &jpeg[2..]].concat()
}

#[test]
fn the_header_has_time_and_orientation() {
    let header = ExifHeader::read(&mut Cursor::new(photograph(6)));
    assert_eq!(
        header,
        ExifHeader { taken_s: Some(1_714_527_000.0), orientation: Some(Orientation(6)), is_virtual: false }
    );
    assert_eq!(header.taken_s, time_in_name("20240501013000"));
    for foreign in [&b""[..], b"GIF89a", &photograph(6)[..30]] {
        assert_eq!(ExifHeader::read(&mut Cursor::new(foreign)), ExifHeader::default());
    }
}

#[test]
fn a_turned_photograph_is_decoded_upright() {
    let red = |image: &Image, x: usize, y: usize| image.at(x, y)[0] > 128;
    for (orientation, size, corner) in [
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
        let photo = Photo { name: String::new(), bytes: photograph(orientation), time_s: 0.0 };
        let image = photo.decode().unwrap();
        assert_eq!((image.width, image.height), size, "{orientation}");
        assert!(red(&image, corner.0, corner.1), "{orientation}");
        assert!(!red(&image, size.0 - 1 - corner.0, size.1 - 1 - corner.1), "{orientation}");
    }
}
