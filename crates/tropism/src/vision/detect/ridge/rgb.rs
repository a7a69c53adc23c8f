//! Colours with fractions: their median, and the noise of a picture.

use crate::math::statistics::quantile_nearest;
use crate::math::vector::Vec3;
use crate::photo::Image;

/// A colour between pixels or averaged over them: red, green and blue from 0 to 255.
pub(super) type Rgb = Vec3;

/// Median of each channel.
pub(super) fn median(colours: &[Rgb]) -> Rgb {
    std::array::from_fn(|i| {
        quantile_nearest(&colours.iter().map(|colour| colour[i]).collect::<Vec<_>>(), 0.5)
    })
}

/// Standard deviation of a picture's noise, as a distance of colours.
///
/// Immerkær's estimate from the green channel: the mean absolute response to a mask that ignores edges and slopes
/// (J. Immerkær 1996, *Fast noise variance estimation*, doi:10.1006/cviu.1996.0060).
pub(super) fn noise_deviation(image: &Image) -> f64 {
    let at = |x: usize, y: usize| f64::from(image.at(x, y)[1]);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in (1..image.height - 1).step_by(2) {
        for x in (1..image.width - 1).step_by(2) {
            let row = |y: usize| at(x - 1, y) - 2.0 * at(x, y) + at(x + 1, y);
            sum += (row(y - 1) - 2.0 * row(y) + row(y + 1)).abs();
            count += 1.0;
        }
    }
    (std::f64::consts::PI / 2.0).sqrt() / 6.0 * sum / f64::max(count, 1.0) * 3_f64.sqrt()
}
