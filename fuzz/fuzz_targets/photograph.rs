//! A photograph: decoded or refused, and looked at in both modes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tropism::geometry::Pixel;
use tropism::photo::Photo;
use tropism::vision::{Calibration, Eye, Mode, VisionConfig};

fuzz_target!(|bytes: &[u8]| {
    let photo = Photo { name: "fuzz".to_owned(), bytes: bytes.to_vec(), time_s: 0.0 };
    let Ok(image) = photo.decode() else { return };
    let (width, height) = (image.width, image.height);
    if width * height > 1 << 20 {
        return;
    }
    let base = Pixel::new(width as f64 / 2.0, height as f64 - 1.0);
    let calibration = Calibration::flat(base, 10.0, width, height);
    for mode in [Mode::Paper, Mode::Robust] {
        if let Ok(mut eye) = Eye::new(calibration, VisionConfig { mode, ..VisionConfig::default() }) {
            let _ = eye.observe(&photo);
        }
    }
});
