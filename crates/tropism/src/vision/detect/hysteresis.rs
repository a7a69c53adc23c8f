//! How surely each sample is plant, by two thresholds.

use crate::simd::Kernel;

/// How surely a sample is plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Evidence {
    /// Background.
    None,
    /// Plant if it hangs together with what surely is.
    Weak,
    /// Plant.
    Strong,
}

/// What is believed of each sample, by what its value must exceed.
pub(super) struct DoubleThreshold<'a> {
    pub(super) values: &'a [f32],
    pub(super) low: f32,
    pub(super) high: f32,
}

impl Kernel for DoubleThreshold<'_> {
    type Result = Vec<Evidence>;

    #[inline(always)]
    fn run(self) -> Vec<Evidence> {
        let Self { values, low, high } = self;
        let mut belief = vec![Evidence::None; values.len()];
        for (belief, &value) in belief.iter_mut().zip(values) {
            let low = if value > low { Evidence::Weak } else { Evidence::None };
            *belief = if value > high { Evidence::Strong } else { low };
        }
        belief
    }
}
