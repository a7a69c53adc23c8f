//! The plant's colour, learned from each picture.
//!
//! In: pixels that are surely plant and pixels that are surely not. Out: weights of red, green and blue that tell the two
//! apart best. The one idea: Fisher's linear discriminant (R. A. Fisher 1936, doi:10.1111/j.1469-1809.1936.tb02137.x)
//! finds by itself what a gate would have to be told: yellow-green before brown cloth, pale before black at night.

use crate::math::matrix::solve_symmetric;

/// What a colour must vary by, in grey values: the camera's rounding, so that a background of one colour has a spread.
const ROUNDING: f64 = 1.0;

/// Sums over pixels from which mean and covariance of their colour follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ColourStatistics {
    count: u64,
    sum: [u64; 3],
    /// Sums of products: rr, gg, bb, rg, rb, gb.
    products: [u64; 6],
}

impl ColourStatistics {
    /// Takes a pixel in.
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

    fn mean(&self) -> [f64; 3] {
        self.sum.map(|sum| sum as f64 / self.count as f64)
    }

    /// The covariance matrix, in the order of `products`.
    fn covariance(&self) -> [f64; 6] {
        let [r, g, b] = self.mean();
        let squares = [r * r, g * g, b * b, r * g, r * b, g * b];
        std::array::from_fn(|i| {
            let rounding = if i < 3 { ROUNDING } else { 0.0 };
            self.products[i] as f64 / self.count as f64 - squares[i] + rounding
        })
    }
}

/// A score of colours that is 0 for the mean background and 1 for the mean plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearDiscriminant {
    /// Weights of red, green and blue.
    pub weights: [f64; 3],
    /// What is added to the weighted sum.
    pub offset: f64,
    /// How many deviations of the background's score lie between 0 and 1 (the Mahalanobis distance of the means).
    pub separation: f64,
}

impl LinearDiscriminant {
    /// Learns to tell `plant` from `background`, whose spread of colour is what counts; `None` where either is empty or
    /// both have the same mean.
    #[must_use]
    pub fn learn(plant: &ColourStatistics, background: &ColourStatistics) -> Option<Self> {
        if plant.count == 0 || background.count == 0 {
            return None;
        }
        let (from, to) = (background.mean(), plant.mean());
        let way: [f64; 3] = std::array::from_fn(|i| to[i] - from[i]);
        let direction = solve_symmetric(background.covariance(), way);
        let square: f64 = direction.iter().zip(way).map(|(d, w)| d * w).sum();
        if !square.is_finite() || square <= 0.0 {
            return None;
        }
        let weights = direction.map(|d| d / square);
        let offset = -weights.iter().zip(from).map(|(w, mean)| w * mean).sum::<f64>();
        Some(Self { weights, offset, separation: square.sqrt() })
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
    fn grey_pictures_are_told_by_brightness() {
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
