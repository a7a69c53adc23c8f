//! Colour of plant and background, learned from each picture.
//!
//! In: pixels that are certainly plant and pixels that are certainly background. Out: weights of red, green and blue
//! that separate them best. The one idea: Fisher's linear discriminant adapts to each picture, where fixed thresholds
//! would have to be set by hand: yellow-green before brown cloth, pale before black at night.
//!
//! # References
//! Fisher 1936, *The use of multiple measurements in taxonomic problems*, doi:10.1111/j.1469-1809.1936.tb02137.x.

use crate::math::matrix::solve_symmetric;

/// Ridge that is added to each channel's variance, in squared grey values, so that the covariance of a uniform background
/// stays invertible (Tikhonov regularisation). Chosen: the order of a camera's rounding, 1/12, after a JPEG.
const ROUNDING_VARIANCE: f64 = 1.0;

/// Sums over pixels that give the mean and the covariance of their colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ColourStatistics {
    count: u64,
    sum: [u64; 3],
    /// Sums of products: rr, gg, bb, rg, rb, gb.
    products: [u64; 6],
}

impl ColourStatistics {
    /// Adds a pixel.
    pub fn add(&mut self, rgb: [u8; 3]) {
        let [r, g, b] = rgb.map(u64::from);
        self.count += 1;
        for (sum, value) in self.sum.iter_mut().zip([r, g, b]) {
            *sum += value;
        }
        for (sum, value) in self.products.iter_mut().zip([r * r, g * g, b * b, r * g, r * b, g * b]) {
            *sum += value;
        }
    }

    /// Number of pixels.
    pub(super) const fn count(&self) -> usize {
        self.count as usize
    }

    /// The mean colour, 0 to 255; of no pixels it is not a number.
    pub(super) fn mean(&self) -> [f64; 3] {
        self.sum.map(|sum| sum as f64 / self.count as f64)
    }

    /// The regularised covariance matrix, in the order of `products`.
    fn covariance(&self) -> [f64; 6] {
        let [r, g, b] = self.mean();
        let mean_products = [r * r, g * g, b * b, r * g, r * b, g * b];
        std::array::from_fn(|i| {
            let rounding = if i < 3 { ROUNDING_VARIANCE } else { 0.0 };
            self.products[i] as f64 / self.count as f64 - mean_products[i] + rounding
        })
    }
}

/// Linear score of a colour: 0 for the mean background, 1 for the mean plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearDiscriminant {
    /// Weights of red, green and blue.
    pub weights: [f64; 3],
    /// Offset that is added to the weighted sum.
    pub offset: f64,
    /// Mahalanobis distance of the means: standard deviations of the background's score between 0 and 1.
    pub separation: f64,
}

impl LinearDiscriminant {
    /// Fisher's discriminant of `plant` and `background`, with the covariance of the background alone; `None` where
    /// either is empty or both have the same mean.
    #[must_use]
    pub fn learn(plant: &ColourStatistics, background: &ColourStatistics) -> Option<Self> {
        if plant.count == 0 || background.count == 0 {
            return None;
        }
        let (origin, target) = (background.mean(), plant.mean());
        let difference: [f64; 3] = std::array::from_fn(|i| target[i] - origin[i]);
        let direction = solve_symmetric(background.covariance(), difference);
        let squared_distance: f64 = direction.iter().zip(difference).map(|(d, w)| d * w).sum();
        if !squared_distance.is_finite() || squared_distance <= 0.0 {
            return None;
        }
        let weights = direction.map(|d| d / squared_distance);
        let offset = -weights.iter().zip(origin).map(|(w, mean)| w * mean).sum::<f64>();
        Some(Self { weights, offset, separation: squared_distance.sqrt() })
    }

    /// The score of a colour.
    pub(super) fn score(&self, rgb: [u8; 3]) -> f64 {
        self.offset
            + self.weights.iter().zip(rgb).map(|(weight, value)| weight * f64::from(value)).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colours(pixels: &[[u8; 3]]) -> ColourStatistics {
        let mut colours = ColourStatistics::default();
        pixels.iter().for_each(|&pixel| colours.add(pixel));
        colours
    }

    #[test]
    fn brightness_that_varies_in_the_background_counts_less_than_hue() {
        // Grey folds from dark to bright; a plant that is green but no brighter than the brightest fold.
        let folds = colours(&(20..=150).map(|level| [level; 3]).collect::<Vec<_>>());
        let plant = colours(&[[80, 120, 60], [90, 130, 70]]);
        let found = LinearDiscriminant::learn(&plant, &folds).unwrap();
        let score = |rgb: [f64; 3]| {
            found.offset + found.weights.iter().zip(rgb).map(|(weight, value)| weight * value).sum::<f64>()
        };
        assert!((score([85.0, 125.0, 65.0]) - 1.0).abs() < 1e-9 && score([85.0; 3]).abs() < 1e-9);
        assert!(score([150.0; 3]) < 0.1, "{}", score([150.0; 3]));
        assert!(score([30.0, 70.0, 10.0]) > 0.8, "a dim plant: {}", score([30.0, 70.0, 10.0]));
        assert!(found.separation > 20.0, "{}", found.separation);
    }

    #[test]
    fn grey_pictures_are_separated_by_brightness() {
        let found = LinearDiscriminant::learn(&colours(&[[200; 3], [220; 3]]), &colours(&[[20; 3], [24; 3]]))
            .unwrap();
        assert!(found.weights.iter().all(|weight| (weight - 1.0 / (3.0 * 188.0)).abs() < 1e-9), "{found:?}");
    }

    #[test]
    fn nothing_is_learned_from_nothing() {
        let some = colours(&[[9; 3]]);
        assert_eq!(LinearDiscriminant::learn(&ColourStatistics::default(), &some), None);
        assert_eq!(LinearDiscriminant::learn(&some, &ColourStatistics::default()), None);
        assert_eq!(LinearDiscriminant::learn(&some, &some), None);
    }
}
