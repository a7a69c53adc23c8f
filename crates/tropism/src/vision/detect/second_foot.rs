//! A second foot of a component: another plant touches it.
//!
//! In: one component, and where the plant's stem leaves the soil. Out: whether a stem reaches the soil elsewhere. The one
//! idea: a plant has one foot. A component is two plants where a path from the foot climbs and descends again along a stem,
//! farther than a leaf hangs, or where a tall part is joined to the foot along the soil only.
//!
//! The constants were chosen by hand on photographs of the bean's first half into which a second bean was drawn
//! (`docs/validation/vision-real.md`).

use crate::vision::detect::connected_components::BoundingBox;
use crate::vision::detect::curve::{PlanePoint, median};
use crate::vision::detect::geodesic::{GeodesicGrid, ShortestPaths};
use crate::vision::raster::plane::Plane;

/// Least height to which a path between two feet climbs, in widths of the stem.
const MIN_CLIMB: f64 = 2.5;

/// Least height by which it comes down again, as a share of its climb.
const MIN_DESCENT: f64 = 0.6;

/// Widths of a second stem, in widths of the first: the rim of a pot is narrower, a leaf wider.
const WIDTHS: std::ops::RangeInclusive<f64> = 0.6..=1.4;

/// Greatest height above the foot and least distance beside it of samples that are soil, in widths of the stem.
const SOIL: f64 = 2.0;
const BESIDE: f64 = 5.0;

/// Least height of a part that is joined by the soil, as a share of the component's: folds of the pot's cloth are lower.
const MIN_HEIGHT: f64 = 0.5;

/// Whether a component has a foot besides the one at `base`. Samples within `bounds` that `is_plant` belong to it; gaps of up
/// to `reach` - 1 samples are bridged.
pub(super) fn has_second_foot(
    plane: &Plane,
    bounds: BoundingBox,
    is_plant: impl Fn(usize) -> bool,
    base: PlanePoint,
    reach: usize,
) -> bool {
    if !is_parted_below(plane, bounds, &is_plant, base, reach) {
        return false;
    }
    let mut grid = GeodesicGrid::new(plane, bounds, is_plant, |_| false, reach);
    let (Some(foot), Some(top)) = (grid.nearest_sample(base), grid.plant_samples().next()) else {
        return false;
    };
    // First test: a shortest path from the foot climbs and comes down again along another stem.
    let up = grid.shortest_paths(foot);
    let Some(to_top) = up.path_to(top) else { return false };
    let width = stem_width(&grid, &to_top[..to_top.len().div_ceil(2)]);
    if comes_down(&grid, foot, &up, width) {
        return true;
    }
    // Second test: without the soil beside the foot, a tall part of the component is no longer reached.
    let foot_row = grid.point(foot)[1];
    grid.close(|[x, y]| (x - base[0]).abs() >= BESIDE * width && foot_row - y <= SOIL * width);
    let up_above_soil = grid.shortest_paths(foot);
    let is_joined_by_soil = |at: usize| {
        up.leads_to(at)
            && !up_above_soil.leads_to(at)
            && grid.height(foot, at) > MIN_HEIGHT * grid.height(foot, top)
    };
    grid.plant_samples().any(is_joined_by_soil) || comes_down(&grid, foot, &up_above_soil, width)
}

/// Whether some row as low as a foot has two parts. Otherwise there is one foot, and the search of paths is saved.
fn is_parted_below(
    plane: &Plane,
    bounds: BoundingBox,
    is_plant: impl Fn(usize) -> bool,
    base: PlanePoint,
    reach: usize,
) -> bool {
    let height = base[1] - bounds.top as f64;
    let lowest = (base[1] - (1.0 - MIN_DESCENT) * height).max(0.0) as usize;
    (lowest..=bounds.bottom).any(|y| {
        let plant = (bounds.left..=bounds.right).filter(|x| is_plant(y * plane.width + x));
        plant.collect::<Vec<_>>().windows(2).any(|pair| pair[1] - pair[0] > reach)
    })
}

/// Whether one of the shortest paths from the foot comes down along a stem of about that width.
fn comes_down(grid: &GeodesicGrid, foot: usize, up: &ShortestPaths, width: f64) -> bool {
    let climbs = up.along_paths(0.0, |at, climb| grid.height(foot, at).max(climb));
    let feet = grid.plant_samples().filter_map(|at| {
        let climb = climbs[at]?;
        let descent = climb - grid.height(foot, at);
        (climb > MIN_CLIMB * width && descent > MIN_DESCENT * climb).then_some((at, descent))
    });
    let second = feet.max_by(|(_, one), (_, other)| one.total_cmp(other));
    second.and_then(|(second, _)| up.path_to(second)).is_some_and(|path| {
        let height = |i: &usize| grid.height(foot, path[*i]);
        let highest = (0..path.len()).max_by(|one, other| height(one).total_cmp(&height(other))).unwrap_or(0);
        let fall = &path[highest..];
        WIDTHS.contains(&(stem_width(grid, &fall[fall.len() / 2..]) / width))
    })
}

/// Median width along the middle of a stem, in samples.
fn stem_width(grid: &GeodesicGrid, path: &[usize]) -> f64 {
    median(path.iter().map(|&at| grid.width(at)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::detect::testing::{Branch, drawn};

    /// Whether branches have a second foot besides that at (20, 79).
    fn second_foot(branches: &[Branch]) -> bool {
        let plane = drawn(branches);
        let all = BoundingBox { left: 0, right: 79, top: 10, bottom: 79 };
        has_second_foot(&plane, all, |at| plane.values[at] > 0.5, [20.0, 79.0], 3)
    }

    const STEM: Branch = ([20.0, 79.0], [24.0, 20.0], 2.0);

    #[test]
    fn a_stem_that_crosses_touches_or_stands_on_the_same_soil_is_anothers() {
        let other = ([60.0, 79.0], [56.0, 15.0], 2.0);
        assert!(second_foot(&[STEM, ([40.0, 79.0], [8.0, 20.0], 2.0)]), "it crosses");
        assert!(second_foot(&[STEM, other, ([24.0, 30.0], [58.0, 40.0], 3.5)]), "a leaf touches it");
        assert!(second_foot(&[STEM, other, ([20.0, 79.0], [60.0, 79.0], 1.0)]), "on the same soil");
        assert!(!second_foot(&[STEM, other]), "it stands apart");
        assert!(!second_foot(&[STEM, ([60.0, 79.0], [56.0, 40.0], 2.0)]), "it stands apart and is lower");
    }

    #[test]
    fn what_hangs_and_what_is_low_is_the_plants_own() {
        assert!(!second_foot(&[STEM]));
        assert!(
            !second_foot(&[STEM, ([24.0, 20.0], [40.0, 22.0], 2.0), ([40.0, 22.0], [46.0, 52.0], 4.0)]),
            "a leaf"
        );
        assert!(!second_foot(&[STEM, ([0.0, 76.0], [79.0, 76.0], 1.0)]), "the rim of the pot");
    }
}
