//! Whether what was detected ever moves.

use std::collections::BTreeMap;

use rayon::prelude::*;
use tropism::geometry::Pixel;
use tropism::vision::phantom::{COMPARED, LEAST_TIPS, MOST_RESEMBLANCE, resemblance};
use tropism::vision::raster::source::reduced_luma;

use super::series::Frame;

/// Whether none of the `tips`, each with the index of its photograph, moves against the median of the series.
pub(super) fn never_moves(frames: &[Frame], tips: &[(usize, Pixel)]) -> bool {
    if tips.len() < LEAST_TIPS {
        return false;
    }
    let tips: Vec<(usize, Pixel)> = evenly(tips.len()).map(|at| tips[at]).collect();
    let mut wanted: Vec<usize> = evenly(frames.len()).chain(tips.iter().map(|(index, _)| *index)).collect();
    wanted.sort_unstable();
    wanted.dedup();
    let read = |&index: &usize| {
        let frame = &frames[index];
        let picture = frame.picture()?;
        Some((index, reduced_luma(&picture)))
    };
    let (indices, pictures): (Vec<usize>, Vec<_>) = wanted.par_iter().filter_map(read).unzip();
    let place: BTreeMap<usize, usize> = indices.into_iter().zip(0..).collect();
    let tips: Vec<_> = tips.iter().filter_map(|(index, tip)| Some((*place.get(index)?, *tip))).collect();
    resemblance(&pictures, &tips).is_some_and(|found| found > MOST_RESEMBLANCE)
}

/// Some of `count` indices at equal distances, from the first to the last.
fn evenly(count: usize) -> impl Iterator<Item = usize> {
    let taken = count.min(COMPARED);
    (0..taken).map(move |index| index * (count - 1) / (taken - 1).max(1))
}
