//! Photographs in TIFF.

use std::io::Cursor;

use ::tiff::encoder::{TiffEncoder, colortype};
use tropism::photo::{Image, Photo, PhotoError};

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
