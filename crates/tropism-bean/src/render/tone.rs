//! Tone curve of the camera: linear light to grey levels (IEC 61966-2-1, sRGB).

use tropism::math;

use crate::scene::Rgb;

/// Steps of the table. Chosen: sixteen for each grey level.
const STEPS: usize = 4096;

/// The curve as a table: linear light to a grey level of 0 to 255, as sRGB has it, above a little stray light.
#[derive(Clone, Debug)]
pub(super) struct ToneCurve {
    table: Vec<u8>,
}

impl ToneCurve {
    pub(super) fn new() -> Self {
        let curve = |step: usize| {
            let light = 0.0012 + step as f64 / (STEPS - 1) as f64;
            let level =
                if light < 0.003_130_8 { 12.92 * light } else { 1.055 * math::pow(light, 1.0 / 2.4) - 0.055 };
            (255.0 * level).round().min(255.0) as u8
        };
        Self { table: (0..STEPS).map(curve).collect() }
    }

    /// The grey level of linear light: 255 from 1 up.
    pub(super) fn grey(&self, light: f64) -> u8 {
        self.table[((light * (STEPS - 1) as f64) as usize).min(STEPS - 1)]
    }

    pub(super) fn rgb(&self, light: Rgb) -> [u8; 3] {
        light.map(|band| self.grey(band))
    }
}
