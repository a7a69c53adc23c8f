//! Statistics of small samples.

/// The median of at least one number in ascending order; of an even count, the mean of the middle two.
pub(crate) fn median(sorted: &[f64]) -> f64 {
    f64::midpoint(sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2])
}
