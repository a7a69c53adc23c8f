//! Photographs in TIFF.

use std::io::Cursor;

use ::tiff::encoder::{TiffEncoder, colortype};
use tropism::photo::{Image, Photo, PhotoError, TiffPages};

fn open(bytes: Vec<u8>) -> Result<Image, PhotoError> {
    Photo { name: "test.tif".to_owned(), bytes, time_s: 0.0 }.decode()
}

#[test]
fn grey_and_colour_of_8_and_16_bits_decode() {
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap();
    encoder.write_image::<colortype::Gray16>(2, 1, &[0x0a00, 0xc8ff]).unwrap();
    let grey = open(file.into_inner()).unwrap();
    assert_eq!((grey.at(0, 0), grey.at(1, 0)), ([10; 3], [200; 3]));
    let mut file = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).unwrap();
    encoder.write_image::<colortype::RGBA8>(1, 2, &[1, 2, 3, 0, 4, 5, 6, 255]).unwrap();
    let bytes = file.into_inner();
    let colour = open(bytes.clone()).unwrap();
    assert_eq!((colour.at(0, 0), colour.at(0, 1)), ([1, 2, 3], [4, 5, 6]));
    // Foreign bytes never panic.
    for length in 0..bytes.len() {
        let _ = open(bytes[..length].to_vec());
    }
    assert!(open(bytes[..40].to_vec()).is_err());
}

/// A page: tags with their numbers, and its only strip.
type TiffPage<'a> = (&'a [(u16, &'a [u32])], &'a [u8]);

/// A little-endian file of pages, whose numbers have 16 or 32 bits.
fn file(pages: &[TiffPage<'_>]) -> Vec<u8> {
    let mut bytes = b"II*\0\0\0\0\0".to_vec();
    let mut link = 4;
    for (tags, strip) in pages {
        let place = bytes.len() as u32;
        bytes.extend(*strip);
        bytes.resize(bytes.len().next_multiple_of(2), 0);
        let (places, lengths) = ([place], [strip.len() as u32]);
        let mut tags: Vec<(u16, &[u32])> = tags.to_vec();
        tags.extend([(273, &places[..]), (279, &lengths[..])]);
        tags.sort_unstable();
        let mut table = (tags.len() as u16).to_le_bytes().to_vec();
        for (tag, values) in tags {
            let (kind, size) = match tag {
                273 | 279 => (4, 4),
                270 => (2, 1),
                _ => (3, 2),
            };
            let data: Vec<u8> =
                values.iter().flat_map(|value| value.to_le_bytes()[..size].to_vec()).collect();
            table.extend(tag.to_le_bytes());
            table.extend([kind, 0]);
            table.extend((values.len() as u32).to_le_bytes());
            let mut value = data.clone();
            if data.len() > 4 {
                value = (bytes.len() as u32).to_le_bytes().to_vec();
                bytes.extend(data);
                bytes.resize(bytes.len().next_multiple_of(2), 0);
            }
            value.resize(4, 0);
            table.extend(value);
        }
        let start = bytes.len() as u32;
        bytes[link..link + 4].copy_from_slice(&start.to_le_bytes());
        bytes.extend(table);
        link = bytes.len();
        bytes.extend([0; 4]);
    }
    bytes
}

#[test]
fn palettes_planes_inks_and_subsampled_chroma_decode() {
    let pixels = |tags: &[(u16, &[u32])], strip: &[u8]| open(file(&[(tags, strip)])).unwrap().rgb;
    let size: [(u16, &[u32]); 2] = [(256, &[2]), (257, &[1])];
    let mut map = vec![0; 3 * 256];
    (map[7], map[256 + 7], map[512 + 9]) = (0xff00, 0x8000, 0x1000);
    let palette = [&size[..], &[(258, &[8]), (262, &[3]), (277, &[1]), (320, &map)]].concat();
    assert_eq!(pixels(&palette, &[7, 9]), [255, 128, 0, 0, 0, 16]);
    let planes = [&size[..], &[(258, &[8, 8, 8]), (262, &[2]), (277, &[3]), (284, &[2])]].concat();
    // Only its first strip is given, so the others are missing.
    assert!(
        open(file(&[(&planes, &[1, 2])])).unwrap_err().to_string().contains("strips or tiles are missing")
    );
    let inks = [&size[..], &[(258, &[8; 4]), (262, &[5]), (277, &[4])]].concat();
    assert_eq!(pixels(&inks, &[255, 0, 0, 0, 0, 0, 255, 128]), [0, 255, 255, 127, 127, 0]);
    let chroma = [&size[..], &[(258, &[8; 3]), (262, &[6]), (277, &[3]), (530, &[2, 1])]].concat();
    assert_eq!(pixels(&chroma, &[100, 200, 128, 128]), [100, 100, 100, 200, 200, 200]);
    let bits = [&size[..], &[(258, &[1]), (262, &[0]), (277, &[1])]].concat();
    assert_eq!(pixels(&bits, &[0b1000_0000]), [0, 0, 0, 255, 255, 255]);
    // PackBits: twice 5, then one literal.
    let packed =
        [&[(256, &[3][..]), (257, &[1])][..], &[(258, &[8]), (259, &[32_773]), (262, &[1])]].concat();
    assert_eq!(pixels(&packed, &[255, 5, 0, 9]), [5, 5, 5, 5, 5, 5, 9, 9, 9]);
    let fax = [&size[..], &[(258, &[1]), (259, &[4]), (262, &[0])]].concat();
    let error = open(file(&[(&fax, &[0])])).unwrap_err().to_string();
    assert!(error.contains("a TIFF picture with fax compression") && error.contains("magick"), "{error}");
}

#[test]
fn each_page_is_a_file_of_its_own() {
    let grey: [(u16, &[u32]); 5] = [(256, &[2]), (257, &[1]), (258, &[8]), (262, &[1]), (277, &[1])];
    let small: [(u16, &[u32]); 5] = [(256, &[1]), (257, &[1]), (258, &[8]), (262, &[1]), (277, &[1])];
    let bytes = file(&[(&grey, &[1, 2]), (&small, &[9]), (&grey, &[3, 4])]);
    let mut pages = TiffPages::read(Cursor::new(&bytes)).unwrap();
    assert_eq!(pages.count(), 2);
    for (index, wanted) in [[1, 1, 1, 2, 2, 2], [3, 3, 3, 4, 4, 4]].into_iter().enumerate() {
        assert_eq!(open(pages.page(index).unwrap().unwrap()).unwrap().rgb, wanted);
    }
    assert_eq!(pages.page(2).unwrap(), None);
    // Three channels of ImageJ are one picture in colour: the text of the description, a byte a number.
    let text: Vec<u32> = "ImageJ=1\nimages=3\nchannels=3\n\0".bytes().map(u32::from).collect();
    let channel = [&[(270, &text[..])], &grey[..]].concat();
    let channels = file(&[(&channel, &[1, 2]), (&grey, &[3, 4]), (&grey, &[5, 6])]);
    assert_eq!(open(channels).unwrap().rgb, [1, 3, 5, 2, 4, 6]);
    for length in 0..bytes.len() {
        let _ = TiffPages::read(Cursor::new(&bytes[..length])).map(|mut pages| pages.page(1));
    }
}
