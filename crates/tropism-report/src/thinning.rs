//! Thinning of long curves, so that a figure stays small however long its track is.
//!
//! Min-max decimation: a curve is cut into stretches of consecutive points, of which the first, the last and the extremes of
//! x and y are kept, and so are the extremes of each column and of each row of pixels over the whole curve. What is left out
//! lies between points that are drawn.
//!
//! # References
//! Jugel, Jerzak, Hackenbroich and Markl 2014, doi:10.14778/2732951.2732953: M4 aggregation, for curves over time.

use std::collections::BTreeMap;

/// Curves of up to this many points are drawn whole. Chosen: ten times the longest experiment of the paper.
pub(super) const MAX_POINTS: usize = 10_000;

/// Stretches of a longer curve; chosen: two for each pixel of the width of a panel, so that no swing in between is lost.
const STRETCHES: usize = 700;

/// Columns and rows of pixels whose extremes are kept. Chosen: more than a panel has; what lies outside counts as the edge.
const PIXELS: usize = 1024;

/// Points that are kept of a longer curve, at most.
#[cfg(test)]
pub(super) const MAX_KEPT: usize = 6 * STRETCHES + 4 * PIXELS;

/// Needles and other marks of one figure, at most; chosen: some 30 bytes each.
pub(super) const MAX_MARKS: usize = 10_000;

/// A position in pixels.
type Place = (f64, f64);

/// Lowest and highest place by some measure, as indices.
#[derive(Clone, Copy)]
struct Extremes {
    low: usize,
    high: usize,
}

impl Extremes {
    const fn of(index: usize) -> Self {
        Self { low: index, high: index }
    }

    fn add(&mut self, index: usize, value: impl Fn(usize) -> f64) {
        if value(index) < value(self.low) {
            self.low = index;
        }
        if value(index) > value(self.high) {
            self.high = index;
        }
    }
}

/// The indices of the points that are drawn of a curve through `places`, in order: all of up to [`MAX_POINTS`].
pub(super) fn drawn(places: &[Place]) -> Vec<usize> {
    if places.len() <= MAX_POINTS {
        return (0..places.len()).collect();
    }
    let (x, y) = (|index: usize| places[index].0, |index: usize| places[index].1);
    let mut drawn = Vec::new();
    let mut keep = |extremes: Extremes| drawn.extend([extremes.low, extremes.high]);
    let length = places.len().div_ceil(STRETCHES);
    for first in (0..places.len()).step_by(length) {
        let last = (first + length).min(places.len()) - 1;
        let (mut wide, mut high) = (Extremes::of(first), Extremes::of(first));
        for index in first..=last {
            wide.add(index, x);
            high.add(index, y);
        }
        [Extremes { low: first, high: last }, wide, high].into_iter().for_each(&mut keep);
    }
    let mut columns: Vec<Option<Extremes>> = vec![None; PIXELS];
    let mut rows = columns.clone();
    for (index, &place) in places.iter().enumerate() {
        columns[pixel(place.0)].get_or_insert(Extremes::of(index)).add(index, y);
        rows[pixel(place.1)].get_or_insert(Extremes::of(index)).add(index, x);
    }
    columns.into_iter().chain(rows).flatten().for_each(keep);
    drawn.sort_unstable();
    drawn.dedup();
    drawn
}

/// The column or row of pixels of a coordinate.
const fn pixel(coordinate: f64) -> usize {
    let pixel = coordinate as usize;
    if pixel < PIXELS { pixel } else { PIXELS - 1 }
}

/// All of `needles` (start and end in pixels), if there are at most `most`. Of more, the longest that starts in each cell of
/// a grid over `size`, which has about `most` cells.
pub(super) fn longest(needles: Vec<(Place, Place)>, most: usize, size: (f64, f64)) -> Vec<(Place, Place)> {
    if needles.len() <= most {
        return needles;
    }
    let side = (size.0 * size.1 / most as f64).sqrt().max(1.0);
    let length = |(from, to): (Place, Place)| {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        dx * dx + dy * dy
    };
    let mut cells: BTreeMap<(i64, i64), (Place, Place)> = BTreeMap::new();
    for needle in needles {
        let cell = ((needle.0.0 / side) as i64, (needle.0.1 / side) as i64);
        let kept = cells.entry(cell).or_insert(needle);
        if length(needle) > length(*kept) {
            *kept = needle;
        }
    }
    cells.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_short_curve_is_drawn_whole() {
        let places = vec![(1.0, 2.0); MAX_POINTS];
        assert_eq!(drawn(&places).len(), MAX_POINTS);
        assert!(drawn(&[]).is_empty());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn a_long_curve_keeps_its_ends_and_the_extremes_of_each_pixel(
            seed in any::<u32>(), more in 1..30_000_usize
        ) {
            let mut state = u64::from(seed) | 1;
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 40) as f64 / (1_u64 << 24) as f64
            };
            let places: Vec<Place> = (0..MAX_POINTS + more).map(|_| (346.0 * next(), 300.0 * next())).collect();
            let drawn = drawn(&places);
            prop_assert!(drawn.len() <= MAX_KEPT && MAX_KEPT <= MAX_POINTS);
            prop_assert!(drawn.is_sorted());
            prop_assert_eq!((drawn[0], drawn[drawn.len() - 1]), (0, places.len() - 1));
            for column in 0..346 {
                let range = |indices: &mut dyn Iterator<Item = usize>| {
                    let heights = indices.filter(|&at| pixel(places[at].0) == column).map(|at| places[at].1);
                    heights.fold((f64::MAX, f64::MIN), |(low, high), y| (y.min(low), y.max(high)))
                };
                prop_assert_eq!(range(&mut drawn.iter().copied()), range(&mut (0..places.len())));
            }
        }
    }

    #[test]
    fn few_needles_stay_and_of_many_the_longest_of_each_cell() {
        let needle = |x: f64, length: f64| ((x, 5.0), (x + length, 5.0));
        let few = vec![needle(1.0, 2.0); 100];
        assert_eq!(longest(few.clone(), 100, (340.0, 300.0)), few);
        let many: Vec<_> = (0..50_000).map(|at| needle(0.001 * f64::from(at), f64::from(at % 977))).collect();
        let kept = longest(many, 100, (340.0, 300.0));
        assert!(kept.len() <= 100 && kept.iter().any(|(from, to)| to.0 - from.0 > 975.9), "{kept:?}");
    }
}
