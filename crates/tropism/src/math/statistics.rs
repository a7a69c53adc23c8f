//! Mean, spread, medians and quantiles of numbers in any order.
//!
//! There are two quantiles and two medians, because published figures were computed with each. [`quantile_linear`]
//! and [`median`] lie between two values of the sample where the sample has no value at the position;
//! [`quantile_nearest`] and [`upper_median`] always are values of the sample.
//!
//! # References
//! Hyndman and Fan 1996, *Sample quantiles in statistical packages*, doi:10.2307/2684934.

use core::cmp::Ordering;

pub use tropism_neat::statistics::{index_of_greatest, mean, median};

/// The least and the greatest value; infinite and reversed without values.
///
/// ```
/// use tropism::math::statistics::range;
/// assert_eq!(range([3.0, 1.0, 2.0]), [1.0, 3.0]);
/// ```
#[must_use]
pub fn range(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let wider = |[least, most]: [f64; 2], value: f64| [least.min(value), most.max(value)];
    values.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], wider)
}

/// The sample variance (divisor n - 1); 0 for one value, NaN without values.
#[must_use]
pub fn variance(values: &[f64]) -> f64 {
    let centre = mean(values.iter().copied());
    let squares: f64 = values.iter().map(|value| (value - centre).powi(2)).sum();
    if values.is_empty() { f64::NAN } else { squares / (values.len() as f64 - 1.0).max(1.0) }
}

/// The sample standard deviation, the square root of the [`variance`].
#[must_use]
pub fn standard_deviation(values: &[f64]) -> f64 {
    variance(values).sqrt()
}

/// The standard deviation of normal values around 0, estimated from their sizes without being moved by outliers: 1.4826 times the
/// median, which is 0.6745 standard deviations.
#[must_use]
pub fn robust_deviation(sizes: &[f64]) -> f64 {
    1.4826 * median(sizes)
}

/// The upper median after `compare`: the middle value, of an even count the greater of the middle two; `None` without
/// values.
///
/// ```
/// use tropism::math::statistics::upper_median;
/// assert_eq!(upper_median(&[3.0, 1.0, 2.0, 6.0], f64::total_cmp), Some(3.0));
/// ```
#[must_use]
pub fn upper_median<T: Copy>(values: &[T], compare: impl Fn(&T, &T) -> Ordering) -> Option<T> {
    if values.is_empty() {
        return None;
    }
    let half = values.len() / 2;
    Some(*values.to_vec().select_nth_unstable_by(half, compare).1)
}

/// The value nearest to the position `share` (0 to 1) of the sorted values, the greater of two equally near; 0
/// without values.
///
/// Position 0 is the least value and position 1 the greatest (NumPy's method `nearest`, but for ties).
///
/// ```
/// use tropism::math::statistics::quantile_nearest;
/// assert_eq!(quantile_nearest(&[3.0, 1.0, 2.0], 0.5), 2.0);
/// assert_eq!(quantile_nearest(&[3.0, 1.0, 2.0], 1.0), 3.0);
/// ```
#[must_use]
pub fn quantile_nearest(values: &[f64], share: f64) -> f64 {
    let sorted = sorted(values);
    let at = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(0.0)
}

/// The value at the position `share` (0 to 1) of the sorted values, by linear interpolation between neighbours
/// (definition 7 of Hyndman and Fan, the default of NumPy and R); NaN without values.
///
/// ```
/// use tropism::math::statistics::quantile_linear;
/// assert_eq!(quantile_linear(&[4.0, 1.0, 3.0, 2.0], 0.5), 2.5);
/// ```
#[must_use]
pub fn quantile_linear(values: &[f64], share: f64) -> f64 {
    if values.is_empty() { f64::NAN } else { between(&sorted(values), share) }
}

/// Minimum, lower quartile, median, upper quartile and maximum, as [`quantile_linear`] defines them; `None` without
/// values.
#[must_use]
pub fn five_numbers(values: &[f64]) -> Option<[f64; 5]> {
    let sorted = sorted(values);
    (!sorted.is_empty()).then(|| [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| between(&sorted, share)))
}

/// The 95 % interval of a share: `count` of `of` trials.
///
/// # References
/// Wilson 1927, *Probable inference, the law of succession, and statistical inference*, doi:10.2307/2276774.
///
/// ```
/// let [low, high] = tropism::math::statistics::wilson_interval(45.0, 90.0);
/// assert!((low - 0.399).abs() < 1e-3 && (high - 0.601).abs() < 1e-3);
/// assert_eq!(tropism::math::statistics::wilson_interval(0.0, 3.0)[0], 0.0);
/// ```
#[must_use]
pub fn wilson_interval(count: f64, of: f64) -> [f64; 2] {
    // The 97.5 % quantile of the normal distribution.
    const Z: f64 = 1.959_963_984_540_054;
    let share = count / of;
    let middle = share + Z * Z / (2.0 * of);
    let half = Z * (share * (1.0 - share) / of + Z * Z / (4.0 * of * of)).sqrt();
    let [low, high] = [middle - half, middle + half].map(|end| (end / (1.0 + Z * Z / of)).clamp(0.0, 1.0));
    // Of none and of all an end is exact, which rounding would miss.
    [if count > 0.0 { low } else { 0.0 }, if count < of { high } else { 1.0 }]
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The value at the position `share` of at least one sorted value, by linear interpolation.
fn between(sorted: &[f64], share: f64) -> f64 {
    let position = share * (sorted.len() - 1) as f64;
    let (below, above) = (sorted[position.floor() as usize], sorted[position.ceil() as usize]);
    below + (position - position.floor()) * (above - below)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// 1 to 4 in another order: mean 5/2, sample variance 5/3.
    const FOUR: [f64; 4] = [4.0, 1.0, 3.0, 2.0];

    #[test]
    fn mean_and_spread_of_four() {
        assert_eq!(mean(FOUR), 2.5);
        assert!((variance(&FOUR) - 5.0 / 3.0).abs() < 1e-12);
        assert!((standard_deviation(&FOUR) - (5.0_f64 / 3.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn linear_quantiles_lie_between_values() {
        assert_eq!([0.0, 0.5, 1.0].map(|share| quantile_linear(&FOUR, share)), [1.0, 2.5, 4.0]);
        // numpy.percentile([1, 2, 3, 4], 40) = 2.2.
        assert!((quantile_linear(&FOUR, 0.4) - 2.2).abs() < 1e-12);
        assert_eq!(five_numbers(&FOUR), Some([1.0, 1.75, 2.5, 3.25, 4.0]));
    }

    #[test]
    fn nearest_quantiles_are_values() {
        assert_eq!([0.0, 0.3, 0.5, 1.0].map(|share| quantile_nearest(&FOUR, share)), [1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn the_upper_median_is_a_value() {
        assert_eq!(upper_median(&FOUR, f64::total_cmp), Some(3.0));
        assert_eq!(upper_median(&[2_u8, 9, 1], u8::cmp), Some(2));
    }

    #[test]
    fn one_value_has_no_spread_and_none_has_no_figures() {
        assert_eq!((variance(&[7.0]), median(&[7.0]), quantile_linear(&[7.0], 0.3)), (0.0, 7.0, 7.0));
        assert!(mean([]).is_nan() && variance(&[]).is_nan() && median(&[]).is_nan());
        assert!(quantile_linear(&[], 0.5).is_nan() && quantile_nearest(&[], 0.5) == 0.0);
        assert_eq!(five_numbers(&[7.0]), Some([7.0; 5]));
        assert_eq!((five_numbers(&[]), upper_median::<f64>(&[], f64::total_cmp)), (None, None));
    }

    proptest! {
        #[test]
        fn the_median_is_that_of_the_sorted_values(values in prop::collection::vec(-1e3..1e3, 1..30)) {
            let mut sorted: Vec<f64> = values.clone();
            sorted.sort_by(f64::total_cmp);
            let middle = 0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]);
            prop_assert_eq!(median(&values).to_bits(), middle.to_bits());
            prop_assert_eq!(upper_median(&values, f64::total_cmp), Some(sorted[sorted.len() / 2]));
        }

        #[test]
        fn five_numbers_are_in_order(values in prop::collection::vec(-1e3..1e3, 1..40)) {
            prop_assert!(five_numbers(&values).unwrap().is_sorted());
        }
    }
}
