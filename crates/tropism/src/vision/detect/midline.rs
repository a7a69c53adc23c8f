//! Midline of a stem, from the base to where it ends.
//!
//! In: a plane that is 0 on background and 1 on plant, the component that is the plant, and its highest point. Out:
//! the midline of the stem. The one idea: shortest paths from the base to the ends of branches follow their midlines,
//! and the longest branch that is thin and bright to its end is the stem.
//!
//! Where each branch ends in a leaf, the stem ends where the path to the top reaches a fork with a second long
//! branch, becomes as wide as a leaf, or becomes thick for good, as a bean's hook does where the stalks of its leaves
//! begin. At a fork the line is led straight on to the middle between the leaves' stalks, because the paths to them cut
//! the corner.
//!
//! If no other source is given, constants were chosen by hand on rendered plants, the marked stem ends of the sunflower
//! time lapse and the bean's marked apices (the rows `clean`, `hook` and `real/` of `benches/src/bin/accuracy`).

use crate::math::statistics::quantile_nearest;
use crate::math::vector::{along, distance, dot, norm, sub};
use crate::vision::detect::connected_components::BoundingBox;
use crate::vision::detect::cross_section::{CrossSection, LEAF_WIDTH, centre, shortest_chord, stem_width};
use crate::vision::detect::curve::{PlanePoint, direction, median, resample, smooth, window};
use crate::vision::detect::geodesic::{GeodesicGrid, ShortestPaths};
use crate::vision::raster::plane::Plane;

/// Least length of a branch that is a leaf, in stem widths.
const LEAF_BRANCH: f64 = 4.0;

/// The same where the path itself ends in a leaf, because leaves come in pairs; also the least length of a leaf at
/// the path's end.
const PAIRED_LEAF_BRANCH: f64 = 2.0;

/// Least length of a branch that is a leaf, as a share of the path's length.
const LEAF_BRANCH_SHARE: f64 = 0.12;

/// Number of branches that may be the stem, and the least length of each, in samples.
const MAX_BRANCHES: usize = 6;
const MIN_BRANCH: f64 = 4.0;

/// Length of a branch's end that must be thin, in stem widths.
const END_LENGTH: f64 = 5.0;

/// Greatest width of a thin end, in stem widths: a stem tapers, a leaf seen edge on does not.
const THIN_END: f64 = 1.25;

/// Least brightness of a branch's end, as a share of its lower half's: leaves seen edge on are thin, but darker.
const MIN_END_BRIGHTNESS: f64 = 0.7;

/// Greatest drop of a stem's end below its highest point, in stem widths: what hangs farther is a closed hook, or a
/// leaf.
const MAX_DROP: f64 = 3.0;

/// Sharpest turn of a stem, as 1 less the cosine (32 degrees): where a leaf's stalk leaves it, a path turns more.
const MAX_STEM_TURN: f64 = 0.15;

/// Turn of a wide path from which on it turns into a leaf, as 1 less the cosine (60 degrees).
const LEAF_TURN: f64 = 0.5;

/// Least length of a stem past a fork, in stem widths: what is shorter is the shoulder of a leaf.
const MIN_PAST_FORK: f64 = 2.0;

/// Greatest length of the path beyond a thin branch's end that is the plant's round end, in stem widths.
const MAX_PAST_THIN: f64 = 1.0;

/// Least chord of a thick part, in chords of the stem. Chosen on the bean's marked apices with an even tens digit, like
/// the next two: 1.5 and 1.7 do as well.
const THICK: f64 = 1.6;

/// Least share of a thick part that is as thick: with less, a path through hanging leaves may have thick parts, too.
const THICK_SHARE: f64 = 0.9;

/// Greatest length of a thick part before a leaf, in stem widths. Chosen on the sunflowers' first half: 3 does as well.
const MAX_STALK: f64 = 2.0;

/// Distance from where the width changes to where the stem is marked to end, in stem widths: it widens gradually.
const WIDENING: f64 = 0.5;

/// The midline of a stem, and its width.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedStem {
    /// The midline from the base up, with points about a sample apart.
    pub line: Vec<PlanePoint>,
    /// Its width over its lower half, in samples.
    pub width: f64,
    /// The plant beyond a stem that ends where it becomes thick, up to a fork, a leaf or the plant's end.
    pub beyond: Vec<PlanePoint>,
}

/// Two planes of one picture that are 0 on background and 1 on plant.
#[derive(Clone, Copy, Debug)]
pub struct Planes<'a> {
    /// Likeness to the plant's colour: light leaves and the stem differ.
    pub colour: &'a Plane,
    /// The same, or brightness where that is greater: what is saturated has lost its colour.
    pub bright: &'a Plane,
}

/// Traces the midline of the stem of one component, from near `base` up, with points about a sample apart.
///
/// `is_plant` says which samples within `bounds` belong to the component, `top` is its highest point, and gaps of up
/// to `reach` - 1 samples are bridged; samples that `may_hide` the plant are crossed on the shortest way. The last point is
/// the end of the stem. `None` where no path leads from base to top.
#[must_use]
pub fn trace_stem(
    Planes { colour: plane, bright }: Planes<'_>,
    bounds: BoundingBox,
    is_plant: impl Fn(usize) -> bool,
    may_hide: impl Fn(usize) -> bool,
    base: PlanePoint,
    top: PlanePoint,
    reach: usize,
) -> Option<TracedStem> {
    let grid = GeodesicGrid::new(bright, bounds, is_plant, may_hide, reach);
    let (start, goal) = (grid.nearest_sample(base)?, grid.nearest_sample(top)?);
    let up = grid.shortest_paths(start);
    let thin = thin_branch(plane, &grid, start, &up);
    let path = up.path_to(goal).filter(|path| path.len() > 1)?;
    let (mut line, widths) = centre(plane, smooth_path(&grid, &path));
    let width = stem_width(&widths);
    let leaf = leaf_start(&widths, width);
    let turns_into_leaf = sharpest_turn(&line, width, |i| widths[i] > LEAF_WIDTH * width) > LEAF_TURN;
    let min_branch = if leaf.is_some() || turns_into_leaf { PAIRED_LEAF_BRANCH } else { LEAF_BRANCH };
    // A leaf is a long branch. Paths from both ends of the stem locate where it leaves.
    let down = grid.shortest_paths(goal);
    let min_length = (min_branch * width).max(LEAF_BRANCH_SHARE * path.len() as f64);
    let fork = grid.fork(&path, &up, &down, width, min_length);
    let fork = fork.map(|at| {
        let fork = grid.point(path[at]);
        let to_fork = |i: &usize| distance(fork, line[*i]);
        (0..line.len()).min_by(|one, other| to_fork(one).total_cmp(&to_fork(other))).unwrap_or(line.len())
    });
    // A fork shortly after widens the stem itself, and a leaf long after hangs against it before.
    let thick = thick_start(bright, &line, width).filter(|&at| {
        let is_after = |next: usize, widths: f64| next as f64 > at as f64 + widths * width;
        fork.is_none_or(|fork| is_after(fork, 1.0))
            && leaf.is_none_or(|leaf| is_after(leaf, 0.0) && !is_after(leaf, MAX_STALK))
    });
    // The path's own end is the plant's edge, a stem's in the middle of its round end.
    let round_end = line.len().saturating_sub((0.5 * width).round() as usize);
    let beyond =
        thick.map_or_else(Vec::new, |thick| line[thick + 1..fork.or(leaf).unwrap_or(round_end)].to_vec());
    let end = thick.or(fork).or(leaf).unwrap_or(line.len());
    line.truncate((end + 1).max(2));
    // A stem continues past a pair of leaves, but not from a closed hook into the leaves that hang from it.
    let past_end = if thick.or(fork).is_some() { MIN_PAST_FORK } else { -MAX_PAST_THIN };
    if let Some(thin) = thin.filter(|thin| thin.len() as f64 >= line.len() as f64 + past_end * width) {
        return Some(TracedStem { line: thin, width, beyond: Vec::new() });
    }
    if thick.is_none() && fork.is_some() {
        lead_to_fork(&grid, &mut line, width);
    } else if thick.or(leaf).is_none() {
        line.truncate(round_end.max(2));
    }
    Some(TracedStem { line: resample(&line, 1.0), width, beyond })
}

/// The index of the point that lies `widths` stem widths before the end of a line.
fn index_before_end(line: &[PlanePoint], widths: f64, stem: f64) -> usize {
    line.len().saturating_sub(1 + (widths * stem).ceil() as usize)
}

/// Leads a line that ends near a fork straight on to the middle of the fork: the point on its tangent that is
/// farthest from the plant's edge.
fn lead_to_fork(grid: &GeodesicGrid, line: &mut Vec<PlanePoint>, stem: f64) {
    let last = index_before_end(line, 1.0, stem);
    let tangent = direction(line[index_before_end(line, 4.0, stem)], line[last]);
    let Some(middle) = grid.deepest(line[last], tangent, 3.0 * stem) else { return };
    line.truncate(last + 1);
    line.push(middle);
}

/// The midline of the longest branch that is thin and bright to its end, up to where its round end begins; `None`
/// where each branch ends in a leaf.
fn thin_branch(
    plane: &Plane,
    grid: &GeodesicGrid,
    start: usize,
    up: &ShortestPaths,
) -> Option<Vec<PlanePoint>> {
    let mut best: Option<(f64, Vec<PlanePoint>)> = None;
    for path in grid.branches(start, up, MIN_BRANCH, MAX_BRANCHES) {
        let rough = smooth_path(grid, &path);
        // The rating is at most the length: a shorter branch cannot win.
        if best.as_ref().is_some_and(|(most, _)| rough.len() as f64 <= *most) {
            continue;
        }
        let (mut line, widths) = centre(plane, rough);
        let stem = stem_width(&widths);
        let last = line.len().saturating_sub((END_LENGTH * stem) as usize);
        let end_widths = &widths[last..widths.len().saturating_sub((0.5 * stem) as usize).max(last)];
        let brightness = |line: &[PlanePoint]| median(line.iter().map(|&at| plane.bilinear(at)));
        let is_thin = quantile_nearest(end_widths, 0.7) <= THIN_END * stem;
        let end_brightness =
            brightness(&line[last..]) / brightness(&line[..line.len().div_ceil(2)]).max(1e-6);
        if last == 0
            || !is_thin
            || end_brightness < MIN_END_BRIGHTNESS
            || drop_below_top(&line) > MAX_DROP * stem
            || sharpest_turn(&line, stem, |_| true) > MAX_STEM_TURN
        {
            continue;
        }
        let rating = line.len() as f64 * end_brightness.min(1.0);
        if best.as_ref().is_none_or(|(most, _)| rating > *most) {
            end_inside_tip(plane, &mut line, stem);
            best = Some((rating, line));
        }
    }
    best.map(|(_, line)| resample(&line, 1.0))
}

/// Distance of a line's end below its highest point, in samples.
fn drop_below_top(line: &[PlanePoint]) -> f64 {
    let highest = line.iter().map(|at| at[1]).fold(f64::INFINITY, f64::min);
    line.last().map_or(0.0, |end| end[1] - highest)
}

/// The sharpest turn of a line over a few stem widths, as 1 less its cosine, at the points that `counts` admits. The
/// end is left out.
fn sharpest_turn(line: &[PlanePoint], stem: f64, counts: impl Fn(usize) -> bool) -> f64 {
    let reach = (2.5 * stem).ceil() as usize;
    let end = line.len().saturating_sub(reach + (1.5 * stem) as usize);
    let cosine = |i: usize| {
        let (before, after) = (sub(line[i], line[i - reach]), sub(line[i + reach], line[i]));
        dot(before, after) / (norm(before) * norm(after)).max(1e-9)
    };
    let least = (reach..end).filter(|&i| counts(i)).map(cosine).fold(1.0, f64::min);
    1.0 - least
}

/// Ends a line in the middle of a stem's round end: half a stem width before its edge.
fn end_inside_tip(plane: &Plane, line: &mut Vec<PlanePoint>, stem: f64) {
    let last = index_before_end(line, 1.5, stem);
    let point = line[last];
    let tangent = direction(line[index_before_end(line, 3.5, stem)], point);
    let value = |offset: f64| plane.bilinear(along(point, tangent, offset));
    let half_height = 0.5 * plane.bilinear(point).clamp(0.1, 1.0);
    let offsets = (0..(16.0 * stem) as u32).map(|step| 0.25 * f64::from(step));
    let Some(edge) = offsets.skip(1).find(|&offset| value(offset) < half_height) else { return };
    let (inside, outside) = (value(edge - 0.25), value(edge));
    let edge = edge - 0.25 * (half_height - outside) / (inside - outside).max(1e-9);
    let width = CrossSection::at(plane, line, last).width.min(LEAF_WIDTH * stem);
    let end = along(point, tangent, (edge - 0.5 * width).max(0.0));
    line.truncate(last + 1);
    line.push(end);
}

/// Traces the midline of one component from near `base` to the end that is farthest along it, however wide or bent it
/// is.
#[must_use]
pub fn trace_longest(
    plane: &Plane,
    bounds: BoundingBox,
    is_plant: impl Fn(usize) -> bool,
    base: PlanePoint,
    reach: usize,
) -> Option<Vec<PlanePoint>> {
    let grid = GeodesicGrid::new(plane, bounds, is_plant, |_| false, reach);
    let start = grid.nearest_sample(base)?;
    let path = grid.branches(start, &grid.shortest_paths(start), MIN_BRANCH, 1).pop()?;
    let (line, _) = centre(plane, smooth_path(&grid, &path));
    // Side shoots that were cut off leave bumps, which would count as length.
    Some(resample(&smooth(&smooth(&line, 12), 12), 1.0))
}

/// A path of samples as a smooth line with points about a sample apart.
pub(super) fn smooth_path(grid: &GeodesicGrid, path: &[usize]) -> Vec<PlanePoint> {
    let points: Vec<PlanePoint> = path.iter().map(|&at| grid.point(at)).collect();
    resample(&smooth(&smooth(&points, 2), 2), 1.0)
}

/// The first point from which on a path is as wide as a leaf, but for its round end; `None` where there is none.
fn leaf_start(widths: &[f64], stem: f64) -> Option<usize> {
    let end = widths.len().saturating_sub(stem.ceil() as usize);
    let last_thin = widths[..end].iter().rposition(|&width| width <= LEAF_WIDTH * stem);
    let start = last_thin.map_or(0, |last| last + 1);
    // A hook is wide, too, but short.
    (end.saturating_sub(start) as f64 > PAIRED_LEAF_BRANCH * stem).then_some(start)
}

/// The point at which a path becomes thick for good, but for its round end; `None` where it does not.
fn thick_start(plane: &Plane, line: &[PlanePoint], stem: f64) -> Option<usize> {
    let chords: Vec<f64> = line.iter().map(|&at| shortest_chord(plane, at)).collect();
    // The median of five: single chords end at specks.
    let radius = |i: usize| 2.min(i).min(chords.len() - 1 - i);
    let near = |i: usize| chords[window(i, radius(i), chords.len())].iter().copied();
    let chords: Vec<f64> = (0..chords.len()).map(|i| median(near(i))).collect();
    // A change point by least misclassification: the best split has the most thin points before it and thick ones after.
    let thick = THICK * stem_width(&chords);
    let end = line.len().saturating_sub(stem.ceil() as usize);
    let is_thick: Vec<bool> = chords[..end].iter().map(|&chord| chord > thick).collect();
    let mut gain = 0_i32;
    let gains = is_thick.iter().map(|&is_thick| {
        gain += if is_thick { -1 } else { 1 };
        gain
    });
    let (start, _) = (1..).zip(gains).max_by_key(|&(_, gain)| gain).filter(|&(_, gain)| gain > 0)?;
    let part = &is_thick[start..];
    let share = part.iter().filter(|&&is_thick| is_thick).count() as f64 / part.len() as f64;
    let is_found = part.len() as f64 > stem && share >= THICK_SHARE;
    is_found.then(|| start + (WIDENING * stem) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::detect::testing::drawn;

    const ALL: BoundingBox = BoundingBox { left: 0, right: 79, top: 0, bottom: 89 };

    fn both(plane: &Plane) -> Planes<'_> {
        Planes { colour: plane, bright: plane }
    }

    fn trace(plane: &Plane, base: PlanePoint, top: PlanePoint) -> Vec<PlanePoint> {
        trace_stem(both(plane), ALL, |at| plane.values[at] > 0.5, |_| false, base, top, 3).unwrap().line
    }

    #[test]
    fn a_leaning_stem_is_followed_to_its_top() {
        let (base, top) = ([30.0, 89.0], [50.0, 12.0]);
        let line = trace(&drawn(&[(base, top, 2.3)]), base, [50.0, 10.0]);
        for at in &line[4..line.len() - 4] {
            let x = 30.0 + (89.0 - at[1]) * 20.0 / 77.0;
            assert!((at[0] - x).abs() < 0.15, "{at:?}, wanted x = {x}");
        }
        let last = line[line.len() - 1];
        assert!(distance(last, top) < 3.0, "{last:?}");
    }

    #[test]
    fn the_stem_ends_at_the_fork_of_two_leaves() {
        let fork = [40.0, 40.0];
        let leaves = [(fork, [62.0, 20.0], 2.0), (fork, [15.0, 30.0], 2.0)];
        let stem = [([40.0, 89.0], fork, 2.0)];
        let line = trace(&drawn(&[&stem[..], &leaves].concat()), [40.0, 89.0], [62.0, 18.0]);
        let last = line[line.len() - 1];
        assert!(distance(last, fork) < 3.0, "{last:?}");
    }

    #[test]
    fn the_stem_ends_between_wide_leaves_at_right_angles_to_it() {
        let fork = [40.0, 40.0];
        let leaves = [(fork, [68.0, 38.0], 6.0), (fork, [12.0, 41.0], 6.0)];
        let stem = [([41.0, 89.0], fork, 2.0)];
        let line = trace(&drawn(&[&stem[..], &leaves].concat()), [41.0, 89.0], [68.0, 32.0]);
        let last = line[line.len() - 1];
        assert!(distance(last, fork) < 1.5, "{last:?}");
    }

    #[test]
    fn the_stem_ends_where_a_leaf_begins() {
        let line = trace(
            &drawn(&[([40.0, 89.0], [40.0, 45.0], 2.0), ([40.0, 34.0], [40.0, 18.0], 9.0)]),
            [40.0, 89.0],
            [40.0, 8.0],
        );
        assert!((line[line.len() - 1][1] - 43.0).abs() < 3.0, "{:?}", line.last());
    }

    #[test]
    fn the_stem_ends_where_a_bend_becomes_thick_beside_a_hanging_leaf() {
        // A hook that opens: a thick bend leads on from the stem, and a leaf hangs two samples beside it.
        let (bend, hook) = ([30.0, 40.0], [46.0, 28.0]);
        let shoot = [([50.0, 89.0], bend, 2.0), (bend, hook, 3.6), ([45.0, 44.0], [53.0, 66.0], 3.5)];
        let plane = drawn(&shoot);
        let is_plant = |at: usize| plane.values[at] > 0.5;
        let traced =
            trace_stem(both(&plane), ALL, is_plant, |_| false, [50.0, 89.0], [46.0, 24.0], 3).unwrap();
        let last = traced.line[traced.line.len() - 1];
        assert!(distance(last, bend) < 4.0, "{last:?}");
        // From there the plant is seen to go on to its top.
        let top = traced.beyond[traced.beyond.len() - 1];
        assert!(distance(last, traced.beyond[0]) < 3.0 && distance(top, hook) < 4.0, "{:?}", traced.beyond);
    }

    #[test]
    fn gaps_are_bridged_and_an_empty_component_has_no_midline() {
        let broken = drawn(&[([40.0, 89.0], [40.0, 52.0], 2.0), ([40.0, 45.0], [40.0, 10.0], 2.0)]);
        assert!(trace(&broken, [40.0, 89.0], [40.0, 8.0]).len() > 70);
        assert_eq!(trace_stem(both(&broken), ALL, |_| false, |_| false, [0.0, 0.0], [0.0, 0.0], 3), None);
        assert_eq!(trace_stem(both(&broken), ALL, |at| at == 7, |_| false, [0.0, 0.0], [0.0, 0.0], 3), None);
    }
}
