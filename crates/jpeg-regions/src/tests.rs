use std::collections::BTreeSet;

use jpeg_encoder::{Encoder, ImageBuffer, JpegColorType, SamplingFactor, rgb_to_ycbcr};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::*;

/// Red, green and blue of each pixel, row by row.
#[derive(Clone, PartialEq)]
struct Image {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

/// How a file is encoded.
#[derive(Clone, Copy, Debug)]
struct Encoding {
    quality: u8,
    sampling: SamplingFactor,
    is_grey: bool,
    restart_interval: u16,
}

/// A smooth background, edges and noise.
fn scene(width: usize, height: usize, noise: f64) -> Image {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut rgb = Vec::with_capacity(3 * width * height);
    for at in 0..width * height {
        let (x, y) = (at % width, at / width);
        let is_bar = (x + y / 3) % 40 < 5;
        let background = [x * 255 / width, y * 200 / height, (x * y) % 256 / 4];
        for value in if is_bar { [250, 255, 10] } else { background } {
            rgb.push((value as f64 + noise * (rng.random::<f64>() - 0.5)).clamp(0.0, 255.0) as u8);
        }
    }
    Image { width, height, rgb }
}

fn encoded(image: &Image, encoding: Encoding, is_progressive: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, encoding.quality);
    encoder.set_sampling_factor(encoding.sampling);
    encoder.set_restart_interval(encoding.restart_interval);
    encoder.set_progressive(is_progressive);
    encoder.encode_image(Rows { image, is_grey: encoding.is_grey }).unwrap();
    bytes
}

/// An image as the encoder reads it, in colour or its green as grey. One type for both: each compiles the encoder anew.
struct Rows<'i> {
    image: &'i Image,
    is_grey: bool,
}

impl ImageBuffer for Rows<'_> {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        if self.is_grey { JpegColorType::Luma } else { JpegColorType::Ycbcr }
    }

    fn width(&self) -> u16 {
        self.image.width as u16
    }

    fn height(&self) -> u16 {
        self.image.height as u16
    }

    fn fill_buffers(&self, y: u16, buffers: &mut [Vec<u8>; 4]) {
        let row = 3 * self.image.width;
        for pixel in self.image.rgb[usize::from(y) * row..][..row].chunks_exact(3) {
            if self.is_grey {
                buffers[0].push(pixel[1]);
            } else {
                let (luma, blue, red) = rgb_to_ycbcr(pixel[0], pixel[1], pixel[2]);
                buffers[0].push(luma);
                buffers[1].push(blue);
                buffers[2].push(red);
            }
        }
    }
}

/// The pixels by another decoder.
fn decoded(bytes: &[u8]) -> Image {
    let options = DecoderOptions::default().set_strict_mode(true).jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let rgb = decoder.decode().unwrap();
    let (width, height) = decoder.dimensions().unwrap();
    Image { width, height, rgb }
}

/// Whether two decoders gave the same pixels but for rounding: a level in each of luma and chroma, which is up to three
/// in blue.
fn is_near(one: &[u8], other: &[u8]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(one, other)| one.abs_diff(*other) <= 4)
}

fn cropped(image: &Image, columns: Range<usize>, rows: Range<usize>) -> Vec<u8> {
    let row = |y| &image.rgb[3 * (y * image.width + columns.start)..][..3 * columns.len()];
    rows.flat_map(row).copied().collect()
}

fn encodings() -> impl Strategy<Value = Encoding> {
    let sampling =
        prop_oneof![Just(SamplingFactor::F_1_1), Just(SamplingFactor::F_2_1), Just(SamplingFactor::F_2_2)];
    let restart_interval = prop_oneof![Just(0_u16), Just(2), Just(7)];
    (1..=100_u8, sampling, any::<bool>(), restart_interval).prop_map(
        |(quality, sampling, is_grey, restart_interval)| Encoding {
            quality,
            sampling,
            is_grey,
            restart_interval,
        },
    )
}

const PLAIN: Encoding =
    Encoding { quality: 90, sampling: SamplingFactor::F_2_2, is_grey: false, restart_interval: 0 };

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_region_has_the_pixels_of_another_decoder(
        encoding in encodings(), (width, height) in (16..120_usize, 16..90_usize), noise in 0.0..120.0,
        from in (0.0..1.0, 0.0..1.0), to in (0.0..1.0, 0.0..1.0),
    ) {
        let bytes = encoded(&scene(width, height, noise), encoding, false);
        let whole = decoded(&bytes);
        let jpeg = Jpeg::read(&bytes).unwrap();
        let all = jpeg.decode_region(0..width, 0..height);
        // At the last column and row the other decoder interpolates with what pads the last block.
        let inner = |rgb: &[u8]| cropped(&Image { width, height, rgb: rgb.to_vec() }, 0..width - 1, 0..height - 1);
        prop_assert!(is_near(&inner(&all), &inner(&whole.rgb)));
        let (x, y) = ((from.0 * width as f64) as usize, (from.1 * height as f64) as usize);
        let side = |share: f64, most: usize| 1 + (share * most as f64) as usize % most;
        let (columns, rows) = (x..x + side(to.0, width - x), y..y + side(to.1, height - y));
        let all = Image { rgb: all, ..whole };
        prop_assert_eq!(jpeg.decode_region(columns.clone(), rows.clone()), cropped(&all, columns, rows));
    }

    #[test]
    fn a_scaled_pixel_is_the_mean_of_its_square(
        encoding in encodings(), (width, height) in (16..120_usize, 16..90_usize), factor in 1..4_u32,
    ) {
        // Little noise and middle values: without clamping, only rounding sets the means apart.
        let factor = 2_usize.pow(factor);
        let mut image = scene(width, height, 8.0);
        image.rgb.iter_mut().for_each(|value| *value = 64 + *value / 2);
        let bytes = encoded(&image, Encoding { quality: encoding.quality.max(60), is_grey: true, ..encoding }, false);
        let (whole, jpeg) = (decoded(&bytes), Jpeg::read(&bytes).unwrap());
        let grey = jpeg.decode_scaled_luma(8..width, 8..height, factor);
        let scaled = jpeg.decode_scaled(8..width, 8..height, factor);
        let (columns, rows) = ((width - 8) / factor, (height - 8) / factor);
        prop_assert_eq!((grey.len(), scaled.len()), (columns * rows, 3 * columns * rows));
        for (at, (&grey, rgb)) in grey.iter().zip(scaled.chunks_exact(3)).enumerate() {
            let (x, y) = (8 + at % columns * factor, 8 + at / columns * factor);
            let square = cropped(&whole, x..x + factor, y..y + factor);
            let mean = square.iter().map(|&value| f32::from(value)).sum::<f32>() / square.len() as f32;
            prop_assert!((grey - mean).abs() < 0.75, "{grey} for {mean}");
            prop_assert!(rgb.iter().all(|&value| (f32::from(value) - mean).abs() <= 1.0));
        }
    }
}

#[test]
fn scaled_colours_are_near_the_means_of_the_pixels() {
    let mut image = scene(160, 120, 0.0);
    image.rgb.iter_mut().for_each(|value| *value = 64 + *value / 2);
    for sampling in [SamplingFactor::F_1_1, SamplingFactor::F_2_1, SamplingFactor::F_2_2] {
        let bytes = encoded(&image, Encoding { sampling, ..PLAIN }, false);
        let (whole, jpeg) = (decoded(&bytes), Jpeg::read(&bytes).unwrap());
        let scaled = jpeg.decode_scaled(0..160, 0..120, 4);
        let mut off = 0.0;
        for (at, pixel) in scaled.chunks_exact(3).enumerate() {
            let (x, y) = (at % 40 * 4, at / 40 * 4);
            let square = cropped(&whole, x..x + 4, y..y + 4);
            for (channel, &value) in pixel.iter().enumerate() {
                let mean = square.iter().skip(channel).step_by(3).map(|&v| f64::from(v)).sum::<f64>() / 16.0;
                off += (f64::from(value) - mean).abs() / scaled.len() as f64;
            }
        }
        assert!(off < 1.5, "{sampling:?}: {off}");
    }
}

#[test]
fn damage_is_detected_and_what_follows_the_end_is_not_looked_at() {
    let image = scene(64, 48, 30.0);
    for is_progressive in [false, true] {
        let whole = encoded(&image, PLAIN, is_progressive);
        let pixels = Jpeg::read(&whole).unwrap().decode_region(0..64, 0..48);
        for length in 0..whole.len() {
            assert!(Jpeg::read(&whole[..length]).is_err(), "{length} of {}", whole.len());
            // Cut short, with the end marker put back, as some cameras and bridges do.
            if length < whole.len() - 2 {
                let cut = [&whole[..length], &[0xff, 0xd9]].concat();
                let is_same = |jpeg: Jpeg| jpeg.decode_region(0..64, 0..48) == pixels;
                assert!(
                    Jpeg::read(&cut).is_ok_and(is_same) || Jpeg::read(&cut).is_err(),
                    "{length} of {}",
                    whole.len()
                );
            }
        }
        for trailer in [&b"\n"[..], b"\0\0\0\0", b"\r\n--boundary--\r\n", b"SEFT", &whole] {
            let read = Jpeg::read(&[&whole[..], trailer].concat()).unwrap();
            assert!(read.decode_region(0..64, 0..48) == pixels, "{trailer:?}");
        }
    }
    // A packet of a transmission is missing: by chance the codes come out even at times.
    for is_progressive in [false, true] {
        let whole = encoded(&scene(320, 240, 8.0), PLAIN, is_progressive);
        let places = whole.len() / 4..whole.len() - 600;
        let is_detected = |at: &usize| Jpeg::read(&[&whole[..*at], &whole[at + 500..]].concat()).is_err();
        let detected = places.clone().step_by(101).filter(is_detected).count();
        assert!(detected as f64 > 0.9 * places.len().div_ceil(101) as f64, "{detected} of {places:?}");
    }
    assert_eq!(Jpeg::scan_only(&encoded(&image, PLAIN, false)), Some(4 * 3 * 6));
    assert!(matches!(Jpeg::read(b"GIF89a"), Err(JpegError::Unsupported(_))));
}

#[test]
fn progressive_files_and_unusual_units_have_the_pixels_of_another_decoder() {
    for (width, height) in [(64, 48), (8, 40), (37, 3), (101, 77)] {
        let image = scene(width, height, 60.0);
        for sampling in [
            SamplingFactor::F_1_1,
            SamplingFactor::F_2_1,
            SamplingFactor::F_2_2,
            SamplingFactor::F_1_2,
            SamplingFactor::F_4_1,
        ] {
            for is_progressive in [false, true] {
                let bytes = encoded(&image, Encoding { sampling, ..PLAIN }, is_progressive);
                let jpeg = Jpeg::read(&bytes).unwrap();
                let all = jpeg.decode_region(0..width, 0..height);
                // Of chroma over four pixels, decoders differ in how they spread it.
                let baseline = Jpeg::read(&encoded(&image, Encoding { sampling, ..PLAIN }, false)).unwrap();
                assert!(
                    all == baseline.decode_region(0..width, 0..height),
                    "{sampling:?} {width} x {height}"
                );
                if !matches!(sampling, SamplingFactor::F_4_1 | SamplingFactor::F_1_2)
                    && width >= 16
                    && height >= 16
                {
                    assert!(
                        is_near(&all, &decoded(&bytes).rgb),
                        "{sampling:?} {width} x {height} {is_progressive}"
                    );
                }
                let all = Image { width, height, rgb: all };
                let (columns, rows) = (width / 3..width, height / 2..height);
                assert!(jpeg.decode_region(columns.clone(), rows.clone()) == cropped(&all, columns, rows));
                if width >= 16 && height >= 16 {
                    assert_eq!(
                        jpeg.decode_scaled(0..width, 0..height, 4).len(),
                        3 * (width / 4) * (height / 4)
                    );
                    assert_eq!(
                        jpeg.decode_scaled_luma(8..width, 0..height, 2).len(),
                        (width - 8) / 2 * (height / 2)
                    );
                }
            }
        }
    }
}

#[test]
fn damaged_files_that_are_read_have_the_pixels_of_another_decoder() {
    let whole = encoded(&scene(64, 48, 30.0), Encoding { restart_interval: 2, ..PLAIN }, false);
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut taken = BTreeSet::new();
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (8.0 * rng.random::<f64>()) as u8;
        let options =
            DecoderOptions::default().set_strict_mode(true).jpeg_set_out_colorspace(ColorSpace::RGB);
        let other = JpegDecoder::new_with_options(ZCursor::new(&bytes), options).decode();
        if let (Ok(jpeg), Ok(other)) = (Jpeg::read(&bytes), other)
            && jpeg.is_usual()
        {
            let pixels = jpeg.decode_region(0..jpeg.width, 0..jpeg.height);
            assert!(is_near(&pixels, &other), "byte {at}");
            taken.insert(at);
        }
    }
    assert!(taken.len() > 100, "{}", taken.len());
}
