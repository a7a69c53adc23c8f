//! A virtual experiment without photographs: for statistics, where thousands of plants are wanted.

use super::{Bean, Species};
use crate::geometry::Point;
use crate::greenhouse::detector;
use crate::light::Light;
use crate::observation::Quality;
use crate::random::{self, Purpose};
use crate::track::{PERIOD_MIN, Sample, Track};

/// The lamps' power for a light: one of them full, or both dark.
#[must_use]
pub fn lamps(light: Option<Light>) -> [f64; 2] {
    match light {
        Some(Light::Left) => [1.0, 0.0],
        Some(Light::Right) => [0.0, 1.0],
        None => [0.0, 0.0],
    }
}

/// Grows the plant of `seed` for `steps` steps of five minutes and tracks it as the paper's detector would.
///
/// `light` is asked at every step, with the step and the tip just seen, which lamp to light until the next. The track has
/// `steps + 1` rows and the columns `apex_x_cm`, `apex_y_cm`, `apex_z_cm` (the true shoot apex), `length_cm` (along the
/// stem) and `curvature_per_cm` (the largest along the stem).
///
/// ```
/// use tropism::greenhouse::bean::{Species, grow};
/// use tropism::light::Light;
/// let track = grow(&Species::default(), 1, 1.0, 24, |_, tip| {
///     Some(if tip.x < 1.0 { Light::Right } else { Light::Left })
/// });
/// assert_eq!(track.samples.len(), 25);
/// ```
pub fn grow(
    species: &Species,
    seed: u64,
    scale: f64,
    steps: u32,
    mut light: impl FnMut(u32, Point) -> Option<Light>,
) -> Track {
    let mut bean = Bean::new(species.draw(seed, scale), seed);
    let mut noise = random::stream(seed, Purpose::Camera, 0);
    let mut track = Track::default();
    let mut truth: [Vec<f64>; 5] = Default::default();
    for step in 0..=steps {
        let pose = bean.pose();
        let tip = detector::detect(&pose, &mut noise);
        let light = if step < steps { light(step, tip) } else { None };
        track.samples.push(Sample {
            step,
            time_s: f64::from(step) * PERIOD_MIN * 60.0,
            tip,
            light,
            quality: Quality::Simulated,
        });
        let [x, y, z] = pose.apex();
        for (column, value) in truth.iter_mut().zip([x, y, z, bean.length(), bean.peak_curvature()]) {
            column.push(value);
        }
        if step < steps {
            bean.advance(lamps(light), PERIOD_MIN);
        }
    }
    for (name, values) in TRUTH.into_iter().zip(truth) {
        track.add_numbers(name, 5, values);
    }
    track
}

/// The columns of a grown track beside the required ones.
pub(super) const TRUTH: [&str; 5] = ["apex_x_cm", "apex_y_cm", "apex_z_cm", "length_cm", "curvature_per_cm"];
