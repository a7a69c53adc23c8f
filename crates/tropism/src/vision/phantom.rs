//! Detections of something that never moves.
//!
//! In: pictures of a series, and the tips that were detected in some of them. Out: how much the surroundings of a tip look like
//! the same place in the median of the pictures. The one idea: a plant grows and sways, so the median shows it blurred or not
//! at all; a pot, a reflection or a stick is in the median as it is in each picture.

use crate::geometry::Pixel;
use crate::vision::raster::plane::Plane;
use crate::vision::tracking::flow::{correlation, window};

/// Pictures of a series that are compared, at most, at equal distances. Chosen by hand.
pub const COMPARED: usize = 24;

/// Number of detected tips below which nothing is said: in a few photographs a plant does not move either. Chosen by hand: more
/// than an hour at the paper's period.
pub const LEAST_TIPS: usize = 20;

/// Resemblance above which what was detected never moves. In the first five series in which something else was detected it is
/// 0.95 and more, in 19 with a plant up to 0.65.
pub const MOST_RESEMBLANCE: f64 = 0.8;

/// Side of the window around a tip, as a share of the picture's height, and at least, in samples. Chosen by hand.
const SIDE_SHARE: f64 = 0.04;
const LEAST_SIDE: usize = 21;

/// Resemblance of the surroundings of detected tips to the median of `pictures` at the same places, -1 to 1: the lower quartile
/// of their normalised cross-correlations. `tips` are indices into `pictures`, with the tip in each. `None` with too few.
#[must_use]
pub fn resemblance(pictures: &[Plane], tips: &[(usize, Pixel)]) -> Option<f64> {
    let size = (pictures.first()?.width, pictures.first()?.height);
    let pictures_of_size = || pictures.iter().filter(|picture| (picture.width, picture.height) == size);
    let side = ((SIDE_SHARE * size.1 as f64) as usize).max(LEAST_SIDE) | 1;
    let of_tip = |&(index, tip): &(usize, Pixel)| {
        let picture = pictures.get(index).filter(|picture| (picture.width, picture.height) == size)?;
        let place = picture.to_sample(tip);
        let windows: Vec<Vec<f32>> = pictures_of_size().map(|picture| window(picture, place, side)).collect();
        let median: Vec<f32> = (0..side * side)
            .map(|at| {
                let mut values: Vec<f32> = windows.iter().map(|window| window[at]).collect();
                let middle = values.len() / 2;
                *values.select_nth_unstable_by(middle, f32::total_cmp).1
            })
            .collect();
        Some(f64::from(correlation(&window(picture, place, side), &median)))
    };
    let mut found: Vec<f64> = tips.iter().filter_map(of_tip).collect();
    found.sort_by(f64::total_cmp);
    (found.len() >= LEAST_TIPS).then(|| found[found.len() / 4])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pictures of a shoot that leans by `lean` columns more in each, and its tips.
    fn series(lean: usize) -> (Vec<Plane>, Vec<(usize, Pixel)>) {
        let (width, height) = (160, 120);
        let picture = |step: usize| {
            let value = |at: usize| {
                let (x, y) = (at % width, at / width);
                let noise = ((at + 31 * step) * 7919 % 5) as f32;
                if y > 40 && x.abs_diff(30 + lean * step) < 3 { 200.0 } else { 20.0 + noise }
            };
            let values = (0..width * height).map(value).collect();
            Plane { width, height, values, origin: Pixel::default(), step: 1 }
        };
        let tip = |step: usize| (step, Pixel::new((30 + lean * step) as f64, 41.0));
        ((0..COMPARED).map(picture).collect(), (0..COMPARED).map(tip).collect())
    }

    #[test]
    fn what_stands_still_resembles_the_median_and_what_moves_does_not() {
        let (pictures, tips) = series(0);
        assert!(resemblance(&pictures, &tips).unwrap() > 0.95);
        assert_eq!(resemblance(&pictures, &tips[..LEAST_TIPS - 1]), None);
        assert_eq!(resemblance(&[], &tips), None);
        let (pictures, tips) = series(4);
        assert!(resemblance(&pictures, &tips).unwrap() < 0.3);
    }
}
