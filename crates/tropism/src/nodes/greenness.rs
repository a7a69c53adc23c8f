//! How much green a node's camera sees: the counterpart of an echo.
//!
//! In: a small picture, taken with a flash beside the lens. Out: a reading as of a [proximity sensor](super::Proximity). The idea:
//! the excess of green over red and blue is large on plants, and near 0 on cloth, wood, skin and walls under any white light. A
//! stem fills a share of the picture that falls with its distance, and the light of the flash on it falls with the square of
//! it, so that the excess falls with the third power, as the echo of a stem does.
//!
//! # References
//! Woebbecke et al. 1995, doi:10.13031/2013.27838 (excess green).

use crate::math::ln;
use crate::photo::Image;

/// Excess of green below which a pixel counts as not green, of 510. Chosen: three standard deviations of that of a grey pixel whose
/// colours have noise of 3 grey levels each.
const LEAST_EXCESS: u64 = 22;

/// Mean excess of green over all pixels of a picture, `2 G - R - B` of at most 510, from 22 up: 0 without any green, 1 if all is pure
/// green.
///
/// ```
/// use tropism::{nodes::green_excess, photo::Image};
/// let picture = Image { width: 2, height: 1, rgb: vec![0, 255, 0, 200, 180, 190] };
/// assert_eq!(green_excess(&picture), 0.5);
/// ```
#[must_use]
pub fn green_excess(picture: &Image) -> f64 {
    let excess = |pixel: &[u8]| {
        let [red, green, blue] = [0, 1, 2].map(|band| u64::from(pixel[band]));
        let excess = (2 * green).saturating_sub(red + blue);
        if excess < LEAST_EXCESS { 0 } else { excess }
    };
    let sum: u64 = picture.rgb.chunks_exact(3).map(excess).sum();
    sum as f64 / (510 * picture.width * picture.height) as f64
}

/// The reading of a node's camera, from its picture: `ln(1 + gain * excess)`.
#[must_use]
pub fn green_reading(picture: &Image, gain: f64) -> f64 {
    ln(1.0 + gain * green_excess(picture))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_green_reads_more_and_no_grey_counts() {
        let picture = |green: usize| {
            let pixel = |number: usize| if number < green { [40, 90, 20] } else { [120, 118, 121] };
            Image { width: 4, height: 4, rgb: (0..16).flat_map(pixel).collect() }
        };
        assert_eq!(green_excess(&picture(0)), 0.0);
        let readings: Vec<f64> = (0..=16).map(|green| green_reading(&picture(green), 50.0)).collect();
        assert!(readings.windows(2).all(|pair| pair[1] > pair[0]) && readings[0] == 0.0);
    }
}
