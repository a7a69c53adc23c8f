//! Whether something lies on the tip.

use crate::geometry::Pixel;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::Plane;

/// Samples to each side of a tip, and above it, in which there should be nothing bright, and the share of them that may
/// be.
const ABOVE: (i64, f64) = (8, 0.3);

/// Whether it is bright above the tip, where nothing of the plant is: glare.
pub(super) fn has_glare_above(grey: &Plane, levels: &Levels, tip: Pixel) -> bool {
    let (x, y) = grey.to_sample(tip);
    let bright = levels.threshold(0.25);
    let (mut lit, mut all) = (0, 0);
    for row in y as i64 - ABOVE.0..y as i64 - 1 {
        for column in x as i64 - ABOVE.0..=x as i64 + ABOVE.0 {
            let is_inside =
                (0..grey.height as i64).contains(&row) && (0..grey.width as i64).contains(&column);
            if is_inside {
                all += 1;
                lit += usize::from(grey.row(row as usize)[column as usize] > bright);
            }
        }
    }
    lit as f64 > ABOVE.1 * f64::from(all)
}

/// Samples to each side of a tip in which nothing should be darker than the background is elsewhere.
const BESIDE: i64 = 8;

/// The share of the samples of a crop that are as dark as its darkest folds, and the share of their brightness below
/// which it is a shadow, and by how many grey values at least.
const SHADOW: (f64, f32, f32) = (0.05, 0.6, 4.0);

/// Whether it is darker about the tip than anywhere else in the crop: what is out of focus on the lens, a fly say, takes
/// the light of background and plant alike, and the plant seems to end where it begins.
pub(super) fn is_in_shadow(grey: &Plane, tip: Pixel) -> bool {
    const STRIDE: usize = 4;
    let mut some: Vec<f32> = grey.values.iter().copied().step_by(STRIDE * STRIDE + 1).collect();
    let rank = (SHADOW.0 * some.len() as f64) as usize;
    let (x, y) = grey.to_sample(tip);
    let mean = |x: i64, y: i64| {
        let column = x as usize - 1;
        let rows = y as usize - 1..=y as usize + 1;
        rows.flat_map(|row| &grey.row(row)[column..column + 3]).sum::<f32>() / 9.0
    };
    let within =
        |at: f64, most: usize| (at as i64 - BESIDE).max(1)..(at as i64 + BESIDE + 1).min(most as i64 - 1);
    let darkest = within(y, grey.height)
        .step_by(2)
        .flat_map(|y| within(x, grey.width).step_by(2).map(move |x| (x, y)))
        .map(|(x, y)| mean(x, y))
        .fold(f32::MAX, f32::min);
    let folds = *some.select_nth_unstable_by(rank, f32::total_cmp).1;
    darkest < SHADOW.1 * folds && folds - darkest > SHADOW.2
}

/// Samples by which a stem may rise above the tip.
const RISES: usize = 4;

/// Whether the stem goes on above what is taken for the tip: mist has taken the contrast of what lies between.
pub(super) fn stem_exceeds_tip(stem: Option<&[Pixel]>, tip: Pixel, step: usize) -> bool {
    stem.is_some_and(|stem| stem.iter().any(|at| tip.y - at.y > (RISES * step) as f64))
}

/// Samples before the end of a stem that are as bright as the rest, but for the last, and the share of brightness that
/// they have at least.
const END: (usize, usize, f64) = (8, 2, 0.75);

/// Whether a stem that ends at the tip gets darker towards its end: something throws a shadow there.
pub(super) fn fades_towards_tip(plant: &Plane, stem: Option<&[Pixel]>, tip: Pixel) -> bool {
    let Some(stem) = stem.filter(|stem| stem.len() > 2 * END.0) else { return false };
    let last = stem[stem.len() - 1];
    if last.distance(tip) > (END.0 * plant.step) as f64 {
        return false;
    }
    let values = |stem: &[Pixel]| -> Vec<f32> {
        let mut values: Vec<f32> = stem.iter().filter_map(|&at| plant.nearest(at)).collect();
        values.sort_by(f32::total_cmp);
        values
    };
    let (all, end) = (values(stem), values(&stem[stem.len() - END.0..stem.len() - END.1]));
    match (all.get(all.len() / 2), end.get(end.len() / 2)) {
        (Some(all), Some(end)) => f64::from(*end) < END.2 * f64::from(*all),
        _ => false,
    }
}
