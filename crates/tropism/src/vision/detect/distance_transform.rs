//! Distance transform of a mask, by the 3-4 chamfer distance in two passes.
//!
//! In: a mask. Out: for each sample about three times its distance to the nearest sample of the other kind.
//!
//! # References
//! Borgefors 1986, *Distance transformations in digital images*, doi:10.1016/S0734-189X(86)80047-0.

/// Cost of a step to a neighbour in the row or column: Borgefors's chamfer 3-4, like the next.
const STRAIGHT: u32 = 3;

/// Cost of a diagonal step.
const DIAGONAL: u32 = 4;

/// Chamfer distance from each sample of a mask of `width` columns to the nearest sample of the other kind. Outside
/// the mask there are none of either kind.
pub(super) fn distance_transform(mask: &[bool], width: usize) -> Vec<u32> {
    let mut distance = vec![u32::from(u16::MAX); mask.len()];
    let rows = mask.len() / width;
    for row in 0..rows {
        let (before, rest) = distance.split_at_mut(row * width);
        let (kinds, current) = (&mask[row * width..][..width], &mut rest[..width]);
        if let Some(above) = row.checked_sub(1) {
            relax_row(current, kinds, &before[above * width..], &mask[above * width..][..width]);
        }
        for x in 1..width {
            current[x] = current[x].min(through(kinds[x], kinds[x - 1], current[x - 1], STRAIGHT));
        }
    }
    for row in (0..rows).rev() {
        let (rest, after) = distance.split_at_mut((row + 1) * width);
        let (kinds, current) = (&mask[row * width..][..width], &mut rest[row * width..]);
        if row + 1 < rows {
            relax_row(current, kinds, &after[..width], &mask[(row + 1) * width..][..width]);
        }
        for x in (1..width).rev() {
            current[x - 1] = current[x - 1].min(through(kinds[x - 1], kinds[x], current[x], STRAIGHT));
        }
    }
    distance
}

/// Distance of a sample through a neighbour at `step`, which is the nearest itself if it is of the other kind.
fn through(kind: bool, neighbour_kind: bool, neighbour_distance: u32, step: u32) -> u32 {
    step + if kind == neighbour_kind { neighbour_distance } else { 0 }
}

/// Lowers the distances of a row to those through the row beside it.
fn relax_row(distance: &mut [u32], kinds: &[bool], beside: &[u32], beside_kinds: &[bool]) {
    let mut relax = |to: usize, from: usize, count: usize, step: u32| {
        let samples = distance[to..][..count].iter_mut().zip(&kinds[to..][..count]);
        let neighbours = beside_kinds[from..][..count].iter().zip(&beside[from..][..count]);
        for ((distance, &kind), (&neighbour_kind, &neighbour)) in samples.zip(neighbours) {
            *distance = (*distance).min(through(kind, neighbour_kind, neighbour, step));
        }
    };
    let width = kinds.len();
    relax(0, 0, width, STRAIGHT);
    relax(1, 0, width - 1, DIAGONAL);
    relax(0, 1, width - 1, DIAGONAL);
}
