//! Double threshold for segmentation with hysteresis (Canny 1986, doi:10.1109/TPAMI.1986.4767851).
//!
//! In: a score for each sample. Out: weak and strong evidence of plant. The one idea: weak samples count where a
//! component joins them to strong ones, so a dim stem is found without the noise that a single low threshold would
//! let in.

use crate::simd::{Kernel, dispatch};

/// Evidence that a sample is plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Evidence {
    /// At most the low threshold: background.
    None,
    /// Above the low threshold: plant if its component has strong samples.
    Weak,
    /// Above the high threshold: plant.
    Strong,
}

/// Classifies each value by two thresholds.
pub(super) fn double_threshold(values: &[f32], low: f32, high: f32) -> Vec<Evidence> {
    dispatch(DoubleThreshold { values, low, high })
}

/// [`double_threshold`], compiled for several processors.
struct DoubleThreshold<'a> {
    values: &'a [f32],
    low: f32,
    high: f32,
}

impl Kernel for DoubleThreshold<'_> {
    type Result = Vec<Evidence>;

    #[inline(always)]
    fn run(self) -> Vec<Evidence> {
        let Self { values, low, high } = self;
        let mut evidence = vec![Evidence::None; values.len()];
        for (evidence, &value) in evidence.iter_mut().zip(values) {
            let weak = if value > low { Evidence::Weak } else { Evidence::None };
            *evidence = if value > high { Evidence::Strong } else { weak };
        }
        evidence
    }
}
