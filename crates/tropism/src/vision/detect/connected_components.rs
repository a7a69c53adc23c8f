//! Connected components of plant samples, by flood fill.
//!
//! In: evidence for each sample of a plane. Out: labelled components, and the one at the stem base. The one idea:
//! what is connected to the base is plant; falling leaves, glare, lamps and the pot's rim are not.

use crate::geometry::Region;
use crate::math::vector::distance;
use crate::vision::detect::curve::PlanePoint;
use crate::vision::detect::hysteresis::Evidence;

/// Labels of the samples of a plane, by component.
#[derive(Clone, Debug)]
pub struct ConnectedComponents {
    /// Label of each sample: the number of its component, from 1, or 0 for background.
    pub labels: Vec<u32>,
    /// Components in the order of their labels.
    pub components: Vec<Component>,
}

/// One connected component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// Number of its samples with strong evidence.
    pub strong: usize,
    /// Least distance from one of its samples to the anchor, in samples.
    pub distance: f64,
    /// Bounding box.
    pub bounds: BoundingBox,
}

/// A rectangle of samples, including the last column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundingBox {
    /// First column.
    pub left: usize,
    /// Last column.
    pub right: usize,
    /// First row.
    pub top: usize,
    /// Last row.
    pub bottom: usize,
}

impl BoundingBox {
    /// The box of both.
    pub(super) fn union(self, other: Self) -> Self {
        Self {
            left: self.left.min(other.left),
            right: self.right.max(other.right),
            top: self.top.min(other.top),
            bottom: self.bottom.max(other.bottom),
        }
    }

    /// The box as a region of the plane.
    pub(in crate::vision) const fn region(self) -> Region {
        let Self { left, right, top, bottom } = self;
        Region { x: left, y: top, width: right + 1 - left, height: bottom + 1 - top }
    }

    fn include(&mut self, x: usize, y: usize) {
        (self.left, self.right) = (self.left.min(x), self.right.max(x));
        (self.top, self.bottom) = (self.top.min(y), self.bottom.max(y));
    }
}

/// Greatest distance between connected samples of one plant, in columns and rows: gaps of `REACH` - 1 samples are
/// bridged, as a shadow or a saturated rim without colour leaves them. Chosen by hand.
pub(super) const REACH: usize = 3;

/// Samples that are skipped at a time where none is plant, because most of a picture is background. Chosen for speed.
const CHUNK: usize = 64;

impl ConnectedComponents {
    /// Labels the components of a plane of `width` columns.
    ///
    /// Samples are connected that are at most `reach` columns and rows apart: a gap of `reach` - 1 samples is
    /// bridged. Distances are measured to `anchor`.
    #[must_use]
    pub fn label(plane: &[Evidence], width: usize, reach: usize, anchor: PlanePoint) -> Self {
        let height = plane.len() / width.max(1);
        let mut labels = vec![0; plane.len()];
        let mut components = Vec::new();
        let mut stack = Vec::new();
        // The square of samples around one, as a range of indices for each row.
        let neighbourhood = |x: usize, y: usize, reach: usize| {
            let (left, right) = (x.saturating_sub(reach), (x + reach + 1).min(width));
            let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
            rows.map(move |row| row * width + left..row * width + right)
        };
        let has_plant = |chunk: &[Evidence]| {
            chunk.iter().fold(false, |any, &evidence| any | (evidence != Evidence::None))
        };
        let chunks = plane.chunks(CHUNK).enumerate().filter(|(_, chunk)| has_plant(chunk));
        let seeds = chunks.flat_map(|(at, chunk)| CHUNK * at..CHUNK * at + chunk.len());
        for seed in seeds {
            if labels[seed] != 0 || plane[seed] == Evidence::None {
                continue;
            }
            let label = components.len() as u32 + 1;
            let (mut strong, mut least) = (0, f64::INFINITY);
            let (x, y) = (seed % width, seed / width);
            let mut bounds = BoundingBox { left: x, right: x, top: y, bottom: y };
            labels[seed] = label;
            stack.push(seed);
            while let Some(at) = stack.pop() {
                let (x, y) = (at % width, at / width);
                strong += usize::from(plane[at] == Evidence::Strong);
                least = least.min(distance([x as f64, y as f64], anchor));
                bounds.include(x, y);
                // An inner sample need not look beyond its neighbours: they are nearer to whatever lies farther out.
                let is_inner = neighbourhood(x, y, 1).all(|row| !plane[row].contains(&Evidence::None));
                for row in neighbourhood(x, y, if is_inner { 1 } else { reach }) {
                    let first = row.start;
                    let samples = plane[row.clone()].iter().zip(&mut labels[row]).enumerate();
                    for (next, (evidence, sample_label)) in samples {
                        if *sample_label == 0 && *evidence != Evidence::None {
                            *sample_label = label;
                            stack.push(first + next);
                        }
                    }
                }
            }
            components.push(Component { strong, distance: least, bounds });
        }
        Self { labels, components }
    }

    /// The label of the component nearest to the anchor, among those with at least `min_strong` strong samples.
    #[must_use]
    pub fn nearest(&self, min_strong: usize) -> Option<u32> {
        let candidates = (1..).zip(&self.components).filter(|(_, component)| component.strong >= min_strong);
        candidates
            .min_by(|(_, one), (_, other)| one.distance.total_cmp(&other.distance))
            .map(|(label, _)| label)
    }

    /// The label of the component with the most strong samples, at least `min_strong`; the first of equals.
    #[must_use]
    pub fn largest(&self, min_strong: usize) -> Option<u32> {
        let candidates = (1..).zip(&self.components).filter(|(_, component)| component.strong >= min_strong);
        candidates.min_by_key(|(_, component)| std::cmp::Reverse(component.strong)).map(|(label, _)| label)
    }

    /// The component with a label from 1.
    pub(super) fn component(&self, label: u32) -> &Component {
        &self.components[label as usize - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(rows: &[&str], reach: usize) -> ConnectedComponents {
        let evidence = |byte| match byte {
            b'#' => Evidence::Strong,
            b'+' => Evidence::Weak,
            _ => Evidence::None,
        };
        let plane: Vec<Evidence> = rows.iter().flat_map(|row| row.bytes().map(evidence)).collect();
        ConnectedComponents::label(&plane, rows[0].len(), reach, [4.0, 3.0])
    }

    const ROWS: [&str; 4] = ["#...#", ".#...", ".....", "...+#"];

    #[test]
    fn components_connect_at_corners_and_measure_their_distance() {
        let found = label(&ROWS, 1);
        assert_eq!(found.labels[..7], [1, 0, 0, 0, 2, 0, 1]);
        let strong: Vec<usize> = found.components.iter().map(|component| component.strong).collect();
        assert_eq!(strong, [2, 1, 1]);
        assert_eq!(found.components[1].distance, 3.0);
        assert_eq!((found.nearest(1), found.nearest(2), found.nearest(3)), (Some(3), Some(1), None));
        assert_eq!(found.largest(1), Some(1));
    }

    #[test]
    fn gaps_within_reach_are_bridged() {
        assert_eq!(label(&ROWS, 2).components.len(), 2);
        let bounds = BoundingBox { left: 0, right: 4, top: 0, bottom: 3 };
        assert_eq!(label(&ROWS, 3).components, [Component { strong: 4, distance: 0.0, bounds }]);
    }
}
