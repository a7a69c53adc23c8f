//! Time of detection in one photograph, from its file and from its pixels, and of decoding alone.
//!
//! The photographs are drawn: a leaning stem 3 mm wide and 20 cm tall before dark cloth with folds, at the size of
//! the paper's camera and at a quarter of it, cropped to the extents of growth.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use tropism::geometry::{Pixel, Region};
use tropism::photo::jpeg::Jpeg;
use tropism::photo::{Image, Photo};
use tropism::vision::{Mode, VisionConfig, detect_from_base, lamp_state};

/// A photograph of `width` columns, the base of its stem, and its crop.
fn drawing(width: usize) -> (Image, Pixel, Region) {
    let height = width * 3 / 4;
    let scale = width as f64 / 74.0;
    let base = Pixel::new(width as f64 / 2.0, 0.85 * height as f64);
    let mut rgb = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for x in 0..width {
            let rise = (base.y - y as f64) / scale;
            let away = (x as f64 - base.x) / scale - 0.02 * rise * rise;
            let is_plant = (0.0..20.0).contains(&rise) && away.abs() < 0.15;
            let fold = ((x / 9 + y / 31) % 13) as u8 + (x * 7 + y * 13 + x * y) as u8 % 5;
            rgb.extend(if is_plant { [190, 205, 70] } else { [26 + fold, 22 + fold, 24 + fold] });
        }
    }
    let image = Image { width, height, rgb };
    let region = Region { x: width / 5, y: height / 10, width: width * 3 / 5, height: height * 3 / 4 };
    (image, base, region)
}

fn bench(criterion: &mut Criterion) {
    for width in [648, 2592] {
        let (image, base, crop) = drawing(width);
        let photo = Photo { name: "drawn.jpg".to_owned(), bytes: image.to_jpeg(90).unwrap(), time_s: 0.0 };
        let mut group = criterion.benchmark_group(format!("{width} columns"));
        group.sample_size(20);
        group.bench_function("decode", |bencher| bencher.iter(|| black_box(&photo).decode()));
        group.bench_function("open", |bencher| bencher.iter(|| black_box(&photo).open()));
        group.bench_function("codes alone", |bencher| {
            bencher.iter(|| Jpeg::scan_only(black_box(&photo.bytes)))
        });
        for (name, mode, stem) in [
            ("paper, tip", Mode::Paper, false),
            ("paper, tip and stem", Mode::Paper, true),
            ("robust, tip", Mode::Robust, false),
            ("robust, tip and stem", Mode::Robust, true),
        ] {
            let config = VisionConfig { mode, crop: Some(crop), stem, ..VisionConfig::default() };
            assert!(detect_from_base(&image, Some(base), &config).is_some(), "{name}");
            group.bench_function(name, |bencher| {
                bencher.iter(|| detect_from_base(black_box(&image), Some(base), &config));
            });
            group.bench_function(format!("{name}, from the file"), |bencher| {
                bencher.iter(|| detect_from_base(&black_box(&photo).open().unwrap(), Some(base), &config));
            });
        }
        group.bench_function("lit lamp", |bencher| bencher.iter(|| lamp_state(black_box(&image), None)));
        group.finish();
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
