//! Statistics that scores of any kind need: those of a generation, and of the crates that build on this one.

/// The arithmetic mean, summed in order; NaN without values.
#[must_use]
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut count = 0_u32;
    let sum: f64 = values.into_iter().inspect(|_| count += 1).sum();
    sum / f64::from(count)
}

/// The median: the middle value, or the mean of the middle two; NaN without values.
///
/// ```
/// use tropism_neat::statistics::median;
/// assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
/// assert_eq!(median(&[3.0, 1.0, 2.0, 6.0]), 2.5);
/// ```
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let mut values = values.to_vec();
    let half = values.len() / 2;
    let is_even = values.len().is_multiple_of(2);
    let (lower, &mut upper, _) = values.select_nth_unstable_by(half, f64::total_cmp);
    match lower.iter().copied().max_by(f64::total_cmp) {
        Some(lower) if is_even => f64::midpoint(lower, upper),
        _ => upper,
    }
}

/// The place of the greatest value, of equals the first; 0 without values. A NaN is not greater than another value.
///
/// ```
/// use tropism_neat::statistics::index_of_greatest;
/// assert_eq!(index_of_greatest(&[1.0, 3.0, 3.0, 2.0]), 1);
/// ```
#[must_use]
pub fn index_of_greatest(values: &[f64]) -> usize {
    (1..values.len()).fold(0, |best, at| if values[at] > values[best] { at } else { best })
}
