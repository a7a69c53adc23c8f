//! The middle of the stem, from the base to where it ends.
//!
//! In: a plane that is 0 on background and 1 on plant, the part of it that is one plant, and the plant's highest point.
//! Out: the line through the middle of its stem. The one idea: the cheapest way through the plant from its base to the end
//! of a limb keeps to the middle, and the longest limb that is thin and bright to its end is the stem. Where each ends in a
//! leaf, the stem ends where the way to the top meets a second long limb, or becomes as broad as a leaf. Where leaves part,
//! it ends in the middle of what its straight continuation crosses: their stalks cut the corner, and a way with them.

use crate::math;
use crate::vision::detect::connected_components::BoundingBox;
use crate::vision::detect::cross_section::{BROAD, CrossSection, bilinear, centre_line, stem_width};
use crate::vision::detect::curve::{Place, direction, resampled, smoothed};
use crate::vision::detect::geodesic::{GeodesicMask, ShortestPaths};
use crate::vision::raster::plane::Plane;

/// A limb that leaves the way is a leaf when it reaches this many stem widths from it.
const LIMB: f64 = 4.0;

/// The same where the way itself ends in a leaf: leaves come in pairs. A leaf is at least as long as this, too.
const PAIRED: f64 = 2.0;

/// A limb that leaves the way is a leaf when it reaches this share of the way's length from it.
const LIMB_SHARE: f64 = 0.12;

/// Limbs whose ends are looked at, and the least samples that each reaches from those before it.
const LIMBS: usize = 6;

const SHORTEST: f64 = 4.0;

/// The last so many stem widths of a limb must be thin if it is to be the stem.
const END: f64 = 5.0;

/// How thin, in stem widths: a stem tapers, a leaf seen edge on does not.
const SLENDER: f64 = 1.25;

/// The end of a stem is at least this share as bright as its lower half: leaves seen edge on are thin, but darker.
const BRIGHT: f64 = 0.7;

/// A stem ends at most so many stem widths below its highest point: what hangs farther is a closed hook, or a leaf.
const HANGS: f64 = 3.0;

/// A stem turns less than this, as 1 less the cosine of the turn (0.15: 32 degrees), where a leaf's stalk leaves it.
const KINK: f64 = 0.15;

/// A way that turns by more than this, as 1 less the cosine of the turn (60 degrees), where it is broad, turns into a leaf.
const SHARP: f64 = 0.5;

/// A stem goes on past a fork when it does so by this many stem widths: what is shorter is the shoulder of a leaf.
const PAST: f64 = 2.0;

/// The line through the middle of the stem of one part of a plane, from near `base` up, about a sample between points.
///
/// `is_part` says which samples within `bounds` are the plant, `top` is its highest point, and gaps of up to `reach` - 1
/// samples are crossed. The last point is where the stem ends. `None` where there is no way from base to top.
#[must_use]
pub fn trace_stem(
    plane: &Plane,
    bounds: BoundingBox,
    is_part: impl Fn(usize) -> bool,
    base: Place,
    top: Place,
    reach: usize,
) -> Option<Vec<Place>> {
    let window = GeodesicMask::of_component(plane, bounds, is_part, reach);
    let (start, goal) = (window.nearest_sample(base)?, window.nearest_sample(top)?);
    let up = window.shortest_paths(start);
    let thin = thin_branch(plane, &window, start, &up);
    let way = up.path_to(goal).filter(|way| way.len() > 1)?;
    let rough = smooth_path(&window, &way);
    let (mut line, widths) = centre_line(plane, rough);
    let width = stem_width(&widths);
    let leaf = leaf_start(&widths, width);
    let turns = sharpest_turn(&line, width, |i| widths[i] > BROAD * width) > SHARP;
    let limb = if leaf.is_some() || turns { PAIRED } else { LIMB };
    let down = window.shortest_paths(goal);
    let fork = window.fork(&way, &up, &down, width, (limb * width).max(LIMB_SHARE * way.len() as f64));
    let fork = fork.map(|at| {
        let (x, y) = window.place(way[at]);
        let distance = |i: &usize| math::hypot(line[*i].0 - x, line[*i].1 - y);
        (0..line.len()).min_by(|one, other| distance(one).total_cmp(&distance(other))).unwrap_or(line.len())
    });
    let end = fork.or(leaf).unwrap_or(line.len());
    line.truncate((end + 1).max(2));
    // A stem goes on past a pair of leaves, but not from a closed hook into what hangs from it.
    let least = line.len() as f64 + if fork.is_some() { PAST } else { -PAST } * width;
    if let Some(thin) = thin.filter(|thin| thin.len() as f64 >= least) {
        return Some(thin);
    }
    if fork.is_some() {
        lead_to_fork(&window, &mut line, width);
    } else if leaf.is_none() {
        // The way ends at the plant's edge, a stem in the middle of its round end.
        line.truncate(line.len().saturating_sub((0.5 * width).round() as usize).max(2));
    }
    Some(resampled(&line, 1.0))
}

/// Leads a line that ends about where leaves part from the stem straight on to the middle of their fork: where the plant is
/// deepest before the line leaves it between them.
fn lead_to_fork(window: &GeodesicMask, line: &mut Vec<Place>, stem: f64) {
    let back = |widths: f64| line.len().saturating_sub(1 + (widths * stem).ceil() as usize);
    let (from, to) = (line[back(4.0)], line[back(1.0)]);
    let along = direction(from, to);
    let Some(middle) = window.deepest(to, along, 3.0 * stem) else { return };
    line.truncate(back(1.0) + 1);
    line.push(middle);
}

/// The longest limb that is thin and bright to its end, to where its rounded end begins; `None` where each ends in a leaf.
fn thin_branch(plane: &Plane, window: &GeodesicMask, start: usize, up: &ShortestPaths) -> Option<Vec<Place>> {
    let mut best: Option<(f64, Vec<Place>)> = None;
    for way in window.branches(start, up, SHORTEST, LIMBS) {
        let rough = smooth_path(window, &way);
        // No limb is rated higher than it is long.
        if best.as_ref().is_some_and(|(most, _)| rough.len() as f64 <= *most) {
            continue;
        }
        let (mut line, widths) = centre_line(plane, rough);
        let stem = stem_width(&widths);
        let last = line.len().saturating_sub((END * stem) as usize);
        let end = &widths[last..widths.len().saturating_sub((0.5 * stem) as usize).max(last)];
        let brightness = |line: &[Place]| {
            let values: Vec<f64> = line.iter().map(|&at| bilinear(plane, at)).collect();
            math::statistics::quantile_nearest(&values, 0.5)
        };
        let is_thin = math::statistics::quantile_nearest(end, 0.7) <= SLENDER * stem;
        let share = brightness(&line[last..]) / brightness(&line[..line.len().div_ceil(2)]).max(1e-6);
        if last == 0
            || !is_thin
            || share < BRIGHT
            || drop_below_top(&line) > HANGS * stem
            || sharpest_turn(&line, stem, |_| true) > KINK
        {
            continue;
        }
        let rating = line.len() as f64 * share.min(1.0);
        if best.as_ref().is_none_or(|(most, _)| rating > *most) {
            end_inside_tip(plane, &mut line, stem);
            best = Some((rating, line));
        }
    }
    best.map(|(_, line)| resampled(&line, 1.0))
}

/// How far below its highest point a line ends.
fn drop_below_top(line: &[Place]) -> f64 {
    let highest = line.iter().map(|at| at.1).fold(f64::INFINITY, f64::min);
    line.last().map_or(0.0, |end| end.1 - highest)
}

/// The sharpest turn of a line below its end, within a few stem widths, as 1 less its cosine, at the points that count.
fn sharpest_turn(line: &[Place], stem: f64, counts: impl Fn(usize) -> bool) -> f64 {
    let reach = (2.5 * stem).ceil() as usize;
    let end = line.len().saturating_sub(reach + (1.5 * stem) as usize);
    let way = |from: Place, to: Place| (to.0 - from.0, to.1 - from.1);
    let turn = |i: usize| {
        let (one, other) = (way(line[i - reach], line[i]), way(line[i], line[i + reach]));
        let lengths = math::hypot(one.0, one.1) * math::hypot(other.0, other.1);
        (one.0 * other.0 + one.1 * other.1) / lengths.max(1e-9)
    };
    let least = (reach..end).filter(|&i| counts(i)).map(turn).fold(1.0, f64::min);
    1.0 - least
}

/// Ends a line in the middle of the round end of a stem: half its width before its edge.
fn end_inside_tip(plane: &Plane, line: &mut Vec<Place>, stem: f64) {
    let back = |widths: f64| line.len().saturating_sub(1 + (widths * stem).ceil() as usize);
    let (from, to) = (line[back(3.5)], line[back(1.5)]);
    let along = direction(from, to);
    let at = |far: f64| (to.0 + far * along.0, to.1 + far * along.1);
    let half = 0.5 * bilinear(plane, to).clamp(0.1, 1.0);
    let steps = (0..(16.0 * stem) as u32).map(|step| 0.25 * f64::from(step));
    let Some(edge) = steps.skip(1).find(|&far| bilinear(plane, at(far)) < half) else { return };
    let (inside, outside) = (bilinear(plane, at(edge - 0.25)), bilinear(plane, at(edge)));
    let edge = edge - 0.25 * (half - outside) / (inside - outside).max(1e-9);
    let width = CrossSection::across(plane, line, back(1.5)).width.min(BROAD * stem);
    let end = at((edge - 0.5 * width).max(0.0));
    line.truncate(back(1.5) + 1);
    line.push(end);
}

/// The line through the middle of one part of a plane from near `base` to the end that is farthest from it, however broad
/// or bent the part is.
#[must_use]
pub fn trace_longest(
    plane: &Plane,
    bounds: BoundingBox,
    is_part: impl Fn(usize) -> bool,
    base: Place,
    reach: usize,
) -> Option<Vec<Place>> {
    let window = GeodesicMask::of_component(plane, bounds, is_part, reach);
    let start = window.nearest_sample(base)?;
    let way = window.branches(start, &window.shortest_paths(start), SHORTEST, 1).pop()?;
    let (line, _) = centre_line(plane, smooth_path(&window, &way));
    // Side shoots that were cut off leave bumps, which would count as length.
    Some(resampled(&smoothed(&smoothed(&line, 12), 12), 1.0))
}

/// A way from sample to sample as a smooth line with points about a sample apart.
fn smooth_path(window: &GeodesicMask, way: &[usize]) -> Vec<Place> {
    let places: Vec<Place> = way.iter().map(|&at| window.place(at)).collect();
    resampled(&smoothed(&smoothed(&places, 2), 2), 1.0)
}

/// Where the way becomes a leaf for good: the first point from which on all are broad, but for the rounded end; `None`
/// where it does not.
fn leaf_start(widths: &[f64], stem: f64) -> Option<usize> {
    let end = widths.len().saturating_sub(stem.ceil() as usize);
    let thin = widths[..end].iter().rposition(|&width| width <= BROAD * stem);
    let start = thin.map_or(0, |last| last + 1);
    // A hook is broad too, but short.
    (end.saturating_sub(start) as f64 > PAIRED * stem).then_some(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane whose value falls from 1 to 0 over one sample at `radius` from the nearest of `limbs`.
    fn plane(limbs: &[(Place, Place, f64)]) -> Plane {
        let (width, height) = (80, 90);
        let away = |at: Place, from: Place, to: Place| {
            let (dx, dy) = (to.0 - from.0, to.1 - from.1);
            let share = ((at.0 - from.0) * dx + (at.1 - from.1) * dy) / (dx * dx + dy * dy);
            let share = share.clamp(0.0, 1.0);
            math::hypot(at.0 - from.0 - share * dx, at.1 - from.1 - share * dy)
        };
        let values = (0..width * height)
            .map(|i| {
                let at = ((i % width) as f64, (i / width) as f64);
                let near = limbs.iter().map(|&(from, to, radius)| radius + 0.5 - away(at, from, to));
                near.fold(0.0, f64::max).min(1.0) as f32
            })
            .collect();
        Plane { width, height, values, origin: (0.0, 0.0), step: 1 }
    }

    const ALL: BoundingBox = BoundingBox { left: 0, right: 79, top: 0, bottom: 89 };

    fn traced(plane: &Plane, base: Place, top: Place) -> Vec<Place> {
        trace_stem(plane, ALL, |at| plane.values[at] > 0.5, base, top, 3).unwrap()
    }

    #[test]
    fn a_leaning_stem_is_followed_to_its_top() {
        let (base, top) = ((30.0, 89.0), (50.0, 12.0));
        let line = traced(&plane(&[(base, top, 2.3)]), base, (50.0, 10.0));
        for at in &line[4..line.len() - 4] {
            let x = 30.0 + (89.0 - at.1) * 20.0 / 77.0;
            assert!((at.0 - x).abs() < 0.15, "{at:?}, wanted x = {x}");
        }
        let last = line[line.len() - 1];
        assert!(math::hypot(last.0 - top.0, last.1 - top.1) < 3.0, "{last:?}");
    }

    #[test]
    fn the_stem_ends_where_two_leaves_part() {
        let fork = (40.0, 40.0);
        let leaves = [(fork, (62.0, 20.0), 2.0), (fork, (15.0, 30.0), 2.0)];
        let stem = [((40.0, 89.0), fork, 2.0)];
        let line = traced(&plane(&[&stem[..], &leaves].concat()), (40.0, 89.0), (62.0, 18.0));
        let last = line[line.len() - 1];
        assert!(math::hypot(last.0 - fork.0, last.1 - fork.1) < 3.0, "{last:?}");
    }

    #[test]
    fn the_stem_ends_in_the_middle_of_broad_leaves_that_leave_it_at_right_angles() {
        let fork = (40.0, 40.0);
        let leaves = [(fork, (68.0, 38.0), 6.0), (fork, (12.0, 41.0), 6.0)];
        let stem = [((41.0, 89.0), fork, 2.0)];
        let line = traced(&plane(&[&stem[..], &leaves].concat()), (41.0, 89.0), (68.0, 32.0));
        let last = line[line.len() - 1];
        assert!(math::hypot(last.0 - fork.0, last.1 - fork.1) < 1.5, "{last:?}");
    }

    #[test]
    fn the_stem_ends_where_a_leaf_begins() {
        let line = traced(
            &plane(&[((40.0, 89.0), (40.0, 45.0), 2.0), ((40.0, 34.0), (40.0, 18.0), 9.0)]),
            (40.0, 89.0),
            (40.0, 8.0),
        );
        assert!((line[line.len() - 1].1 - 43.0).abs() < 3.0, "{:?}", line.last());
    }

    #[test]
    fn gaps_are_crossed_and_what_is_not_there_is_none() {
        let broken = plane(&[((40.0, 89.0), (40.0, 52.0), 2.0), ((40.0, 45.0), (40.0, 10.0), 2.0)]);
        assert!(traced(&broken, (40.0, 89.0), (40.0, 8.0)).len() > 70);
        assert_eq!(trace_stem(&broken, ALL, |_| false, (0.0, 0.0), (0.0, 0.0), 3), None);
        assert_eq!(trace_stem(&broken, ALL, |at| at == 7, (0.0, 0.0), (0.0, 0.0), 3), None);
    }
}
