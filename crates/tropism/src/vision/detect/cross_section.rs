//! Cross-sections of a stem: its width, and the shift to its middle.
//!
//! In: a plane that is 0 on background and 1 on plant, and a line through the plant. Out: the line moved to the
//! middle of the plant, and the plant's width across each of its points. The one idea: across the line, an edge lies
//! where the profile falls below half of its height.

use crate::math;
use crate::math::vector::along;
use crate::vision::detect::curve::{PlanePoint, median, normal, smooth};
use crate::vision::raster::plane::Plane;

/// Width, in stem widths, above which a cross-section is a leaf's, where it is long enough. Chosen by hand.
pub(super) const LEAF_WIDTH: f64 = 1.8;

/// Greatest distance to an edge, in samples. Chosen by hand.
const MAX_HALF_WIDTH: f64 = 24.0;

/// Cross-section of a plant at one point of a line.
pub(super) struct CrossSection {
    /// Unit vector across the line.
    normal: PlanePoint,
    /// Distance along `normal` from the line to the middle of the plant, in samples.
    shift: f64,
    /// Width of the plant, in samples.
    pub(super) width: f64,
}

impl CrossSection {
    /// The cross-section at point `i` of a line.
    pub(super) fn at(plane: &Plane, line: &[PlanePoint], i: usize) -> Self {
        let normal = normal(line, i, 3);
        let value = |offset: f64| plane.bilinear(along(line[i], normal, offset));
        let half_height = 0.5 * value(0.0).max(value(-1.0)).max(value(1.0)).clamp(0.1, 1.0);
        let (one, other) = (edge(value, half_height), edge(|offset| value(-offset), half_height));
        Self { normal, shift: (one - other) / 2.0, width: one + other }
    }
}

/// Distance from a point to where the profile `value` falls below `level`, in samples.
fn edge(value: impl Fn(f64) -> f64, level: f64) -> f64 {
    let (mut offset, mut inside) = (0.0, value(0.0));
    while offset < MAX_HALF_WIDTH {
        let outside = value(offset + 0.5);
        if outside < level && inside >= level {
            return offset + 0.5 * (inside - level) / (inside - outside);
        }
        offset += 0.5;
        inside = outside;
    }
    MAX_HALF_WIDTH
}

/// Number of directions in which chords are measured, over half a turn. Chosen by hand.
const CHORDS: usize = 8;

/// Share of the height at which a chord ends. Chosen on the photographs of the bean with an even tens digit, among 0.5 to
/// 0.7: a leaf that hangs beside the stem has brighter edges than half.
const CHORD_HEIGHT: f64 = 0.65;

/// Length of the shortest chord through a point of the plant: its width there, whichever way it runs.
pub(super) fn shortest_chord(plane: &Plane, point: PlanePoint) -> f64 {
    let level = CHORD_HEIGHT * plane.bilinear(point).max(0.1);
    let chord = |i: usize| {
        let (y, x) = math::sin_cos(std::f64::consts::PI * i as f64 / CHORDS as f64);
        let value = |offset: f64| plane.bilinear(along(point, [x, y], offset));
        edge(value, level) + edge(|offset| value(-offset), level)
    };
    (0..CHORDS).map(chord).fold(f64::INFINITY, f64::min)
}

/// Moves a line to the middle of the plant, in two rounds; returns it with the plant's width across each point.
///
/// Where the plant is too wide for a stem, the shift is interpolated between the stem before and after.
pub(super) fn centre(plane: &Plane, mut line: Vec<PlanePoint>) -> (Vec<PlanePoint>, Vec<f64>) {
    let mut widths = Vec::new();
    for _ in 0..2 {
        let sections: Vec<CrossSection> =
            (0..line.len()).map(|i| CrossSection::at(plane, &line, i)).collect();
        widths = sections.iter().map(|section| section.width).collect();
        let widest_stem = LEAF_WIDTH * stem_width(&widths);
        let shifts =
            fill_gaps(sections.iter().map(|section| (section.width <= widest_stem).then_some(section.shift)));
        let points = line.iter().zip(&sections).zip(&shifts);
        let moved: Vec<PlanePoint> =
            points.map(|((at, section), shift)| along(*at, section.normal, *shift)).collect();
        line = smooth(&moved, 2);
    }
    (line, widths)
}

/// Width of the stem: the median over the lower half of a path, which is stem.
pub(super) fn stem_width(widths: &[f64]) -> f64 {
    median(widths[..widths.len().div_ceil(2)].iter().copied()).clamp(1.0, 1e6)
}

/// Fills gaps by linear interpolation; before the first and after the last value that value is repeated.
fn fill_gaps(values: impl Iterator<Item = Option<f64>>) -> Vec<f64> {
    let values: Vec<Option<f64>> = values.collect();
    let known: Vec<(usize, f64)> =
        values.iter().enumerate().filter_map(|(i, value)| Some((i, (*value)?))).collect();
    (0..values.len())
        .map(|i| {
            let next = known.partition_point(|&(at, _)| at < i);
            match (next.checked_sub(1).and_then(|before| known.get(before)), known.get(next)) {
                (Some(&(a, low)), Some(&(b, high))) => low + (high - low) * (i - a) as f64 / (b - a) as f64,
                (Some(&(_, value)), None) | (None, Some(&(_, value))) => value,
                (None, None) => 0.0,
            }
        })
        .collect()
}
