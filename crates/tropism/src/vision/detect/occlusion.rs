//! Tests for an occluded tip: glare or a shadow.
//!
//! In: the luma of a picture, and the tip. Out: whether the tip may lie elsewhere.
//!
//! All constants were chosen by hand on rendered frames (the rows `glare` and `fly` of
//! `benches/src/bin/accuracy`, seeds below 100 000).

use crate::geometry::Pixel;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::Plane;

/// Size of the window above a tip, in samples to each side and upwards.
const GLARE_WINDOW: i64 = 8;

/// Share of that window from which on bright samples are glare.
const GLARE_SHARE: f64 = 0.3;

/// Level of a bright sample there, as a share of the way from background to plant.
const GLARE_LEVEL: f64 = 0.25;

/// Whether it is bright above the tip, where no plant is: glare.
pub(super) fn has_glare_above(luma: &Plane, levels: &Levels, tip: Pixel) -> bool {
    let [x, y] = luma.to_sample(tip);
    let threshold = levels.threshold(GLARE_LEVEL);
    let (mut bright, mut all) = (0, 0);
    for row in y as i64 - GLARE_WINDOW..y as i64 - 1 {
        for column in x as i64 - GLARE_WINDOW..=x as i64 + GLARE_WINDOW {
            let is_inside =
                (0..luma.height as i64).contains(&row) && (0..luma.width as i64).contains(&column);
            if is_inside {
                all += 1;
                bright += usize::from(luma.row(row as usize)[column as usize] > threshold);
            }
        }
    }
    bright as f64 > GLARE_SHARE * f64::from(all)
}

/// Size of the window around a tip in which a shadow is searched, in samples to each side.
const SHADOW_WINDOW: i64 = 8;

/// Quantile of the crop that is the level of its darkest folds.
const FOLD_QUANTILE: f64 = 0.05;

/// Greatest brightness of a shadow, as a share of the folds' level, and its least depth below that, in grey values.
const SHADOW_SHARE: f32 = 0.6;
const SHADOW_DEPTH: f32 = 4.0;

/// Whether the surroundings of the tip are the darkest part of the crop.
///
/// An object on the lens, such as a fly, is out of focus and darkens background and plant alike, so the plant seems to
/// end at its edge.
pub(super) fn is_in_shadow(luma: &Plane, tip: Pixel) -> bool {
    // A sparse sample of the crop is enough for the quantile.
    const STRIDE: usize = 17;
    let mut sparse: Vec<f32> = luma.values.iter().copied().step_by(STRIDE).collect();
    let rank = (FOLD_QUANTILE * sparse.len() as f64) as usize;
    let [x, y] = luma.to_sample(tip);
    let mean = |x: i64, y: i64| {
        let column = x as usize - 1;
        let rows = y as usize - 1..=y as usize + 1;
        rows.flat_map(|row| &luma.row(row)[column..column + 3]).sum::<f32>() / 9.0
    };
    let window = |at: f64, size: usize| {
        (at as i64 - SHADOW_WINDOW).max(1)..(at as i64 + SHADOW_WINDOW + 1).min(size as i64 - 1)
    };
    let darkest = window(y, luma.height)
        .step_by(2)
        .flat_map(|y| window(x, luma.width).step_by(2).map(move |x| (x, y)))
        .map(|(x, y)| mean(x, y))
        .fold(f32::MAX, f32::min);
    let folds = *sparse.select_nth_unstable_by(rank, f32::total_cmp).1;
    darkest < SHADOW_SHARE * folds && folds - darkest > SHADOW_DEPTH
}
