//! A photograph: decoded or refused, the same by both decoders, and looked at in both modes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tropism::geometry::{Pixel, Region};
use tropism::photo::{Image, LazyImage, Photo};
use tropism::vision::raster::source::PixelSource;
use tropism::vision::{Calibration, Frame, Mode, TipTracker, VisionConfig, lamp_state};

fuzz_target!(|bytes: &[u8]| {
    let photo = Photo { name: "fuzz".to_owned(), bytes: bytes.to_vec(), time_s: 0.0 };
    let (decoded, opened) = (photo.decode(), photo.open());
    let (image, picture) = match (decoded, opened) {
        (Ok(image), Ok(picture)) => (image, picture),
        (Err(one), Err(other)) => return assert_eq!(one.to_string(), other.to_string()),
        (decoded, opened) => panic!("decoded {:?}, opened {:?}", decoded.err(), opened.err()),
    };
    let (width, height) = (image.width, image.height);
    assert_eq!(picture.size(), (width, height));
    if width * height > 1 << 20 {
        return;
    }
    if matches!(picture, LazyImage::Jpeg(_)) {
        agree(
            &picture,
            &image,
            bytes.iter().fold(0, |sum, &byte| 31 * (sum % (1 << 32)) + usize::from(byte)),
        );
    }
    let _ = lamp_state(&picture, None);
    let base = Pixel::new(width as f64 / 2.0, height as f64 - 1.0);
    let calibration = Calibration::from_scale(base, 10.0, width, height);
    for mode in [Mode::Paper, Mode::Robust] {
        if let Ok(mut tracker) =
            TipTracker::new(calibration, VisionConfig { mode, ..VisionConfig::default() })
        {
            let _ = tracker.observe(&Frame::new(photo.clone()));
        }
    }
});

/// Holds the whole picture and some part of it to what the plain decoder says, and tries every way of shrinking that part.
fn agree(picture: &LazyImage, image: &Image, seed: usize) {
    let all = picture.crop(Region { x: 0, y: 0, width: image.width, height: image.height });
    assert!(*all == *image, "the whole picture differs");
    let (x, y) = (seed % image.width, seed / 7 % image.height);
    let (width, height) = (1 + seed / 11 % (image.width - x), 1 + seed / 13 % (image.height - y));
    let region = Region { x, y, width, height };
    let part = picture.crop(region);
    for row in 0..height {
        let there = &image.rgb[3 * ((y + row) * image.width + x)..][..3 * width];
        assert!(part.rgb[3 * row * width..][..3 * width] == *there, "{region:?} differs");
    }
    for factor in 1..10 {
        let shrunk = picture.downscale(region, factor);
        assert_eq!((shrunk.width, shrunk.height), (width / factor, height / factor));
        assert_eq!(picture.downscale_luma(region, factor).len(), shrunk.width * shrunk.height);
    }
}
