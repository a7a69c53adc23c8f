//! What lies across a line through a plant.

use crate::math;
use crate::vision::detect::curve::{Place, direction, smoothed};
use crate::vision::raster::plane::Plane;

/// What is broader than this many stem widths is a leaf, where it is long enough.
pub(super) const BROAD: f64 = 1.8;

/// A line through the plant moved to its middle, in two rounds, and how broad the plant is across each point. Where it is
/// too broad for a stem, the shift is that of the stem before and after.
pub(super) fn centre_line(plane: &Plane, mut line: Vec<Place>) -> (Vec<Place>, Vec<f64>) {
    let mut widths = Vec::new();
    for _ in 0..2 {
        let profiles: Vec<CrossSection> =
            (0..line.len()).map(|i| CrossSection::across(plane, &line, i)).collect();
        widths = profiles.iter().map(|profile| profile.width).collect();
        let broad = BROAD * stem_width(&widths);
        let shifts =
            fill_gaps(profiles.iter().map(|profile| (profile.width <= broad).then_some(profile.shift)));
        let points = line.iter().zip(&profiles).zip(&shifts);
        let moved: Vec<Place> = points
            .map(|((at, profile), shift)| (at.0 + shift * profile.normal.0, at.1 + shift * profile.normal.1))
            .collect();
        line = smoothed(&moved, 2);
    }
    (line, widths)
}

/// The median width of the lower half of the way, which is stem.
pub(super) fn stem_width(widths: &[f64]) -> f64 {
    let mut lower: Vec<f64> = widths[..widths.len().div_ceil(2)].to_vec();
    lower.sort_by(f64::total_cmp);
    lower.get(lower.len() / 2).copied().unwrap_or(1.0).clamp(1.0, 1e6)
}

/// What lies across the line at one of its points.
pub(super) struct CrossSection {
    /// Unit vector across.
    normal: Place,
    /// How far along `normal` the middle of the plant is.
    shift: f64,
    /// How broad the plant is.
    pub(super) width: f64,
}

impl CrossSection {
    /// How far to both sides a stem's edge is looked for, in samples.
    const SIDE: f64 = 24.0;

    pub(super) fn across(plane: &Plane, line: &[Place], i: usize) -> Self {
        let (from, to) = (line[i.saturating_sub(3)], line[(i + 3).min(line.len() - 1)]);
        let along = direction(from, to);
        let normal = (-along.1, along.0);
        let at =
            |offset: f64| bilinear(plane, (line[i].0 + offset * normal.0, line[i].1 + offset * normal.1));
        let middle = at(0.0);
        let half = 0.5 * middle.max(at(-1.0)).max(at(1.0)).clamp(0.1, 1.0);
        let edge = |side: f64| {
            let (mut offset, mut inside) = (0.0, middle);
            while offset < Self::SIDE {
                let outside = at(side * (offset + 0.5));
                if outside < half && inside >= half {
                    return offset + 0.5 * (inside - half) / (inside - outside);
                }
                offset += 0.5;
                inside = outside;
            }
            Self::SIDE
        };
        let (one, other) = (edge(1.0), edge(-1.0));
        Self { normal, shift: (one - other) / 2.0, width: one + other }
    }
}

/// The plane's value at a place between samples; the outermost samples reach on for ever.
pub(super) fn bilinear(plane: &Plane, (x, y): Place) -> f64 {
    let x = x.clamp(0.0, plane.width as f64 - 1.0);
    let y = y.clamp(0.0, plane.height as f64 - 1.0);
    let (left, top) = (x as usize, y as usize);
    let (right, bottom) = ((left + 1).min(plane.width - 1), (top + 1).min(plane.height - 1));
    let (across, down) = (x - left as f64, y - top as f64);
    let at = |x: usize, y: usize| f64::from(plane.values[y * plane.width + x]);
    let corners = [at(left, top), at(right, top), at(left, bottom), at(right, bottom)];
    math::interpolate::bilinear(corners, across, down)
}

/// The values with gaps filled in a straight line between their neighbours; beyond the first and last, theirs.
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
