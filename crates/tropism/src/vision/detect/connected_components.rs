//! Which plant samples hang together, and which of them stand at the base.

use crate::vision::detect::hysteresis::Evidence;

/// The samples of a plane that hang together, numbered by part.
#[derive(Clone, Debug)]
pub struct ConnectedComponents {
    /// For each sample the number of its part, from 1; 0 is background.
    pub labels: Vec<u32>,
    /// Each part, number 1 first.
    pub components: Vec<Component>,
}

/// One connected part of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Component {
    /// Its samples that are surely plant.
    pub strong: usize,
    /// Least distance from one of its samples to the anchor, in samples.
    pub distance: f64,
    /// The columns and rows that it lies in.
    pub bounds: BoundingBox,
}

/// A rectangle of samples, the last column and row included.
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
    fn reach(&mut self, x: usize, y: usize) {
        (self.left, self.right) = (self.left.min(x), self.right.max(x));
        (self.top, self.bottom) = (self.top.min(y), self.bottom.max(y));
    }
}

/// Samples that are passed over at a time where none is plant.
const CHUNK: usize = 64;

impl ConnectedComponents {
    /// Numbers the parts of a plane of `width` columns. Samples belong together that are no more than `reach` columns
    /// and rows apart: a gap of `reach` - 1 samples is bridged. Distances are measured to `anchor` (column, row).
    #[must_use]
    pub fn label(plane: &[Evidence], width: usize, reach: usize, anchor: (f64, f64)) -> Self {
        let height = plane.len() / width.max(1);
        let mut labels = vec![0; plane.len()];
        let mut parts = Vec::new();
        let mut stack = Vec::new();
        // The samples of each row around one.
        let around = |x: usize, y: usize, reach: usize| {
            let (left, right) = (x.saturating_sub(reach), (x + reach + 1).min(width));
            let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
            rows.map(move |row| row * width + left..row * width + right)
        };
        // Most of a picture is background: passed over many samples at a time.
        let is_plant =
            |chunk: &[Evidence]| chunk.iter().fold(false, |any, &belief| any | (belief != Evidence::None));
        let chunks = plane.chunks(CHUNK).enumerate().filter(|(_, chunk)| is_plant(chunk));
        let seeds = chunks.flat_map(|(at, chunk)| CHUNK * at..CHUNK * at + chunk.len());
        for seed in seeds {
            if labels[seed] != 0 || plane[seed] == Evidence::None {
                continue;
            }
            let label = parts.len() as u32 + 1;
            let (mut sure, mut square) = (0, f64::INFINITY);
            let (x, y) = (seed % width, seed / width);
            let mut bounds = BoundingBox { left: x, right: x, top: y, bottom: y };
            labels[seed] = label;
            stack.push(seed);
            while let Some(at) = stack.pop() {
                let (x, y) = (at % width, at / width);
                let (dx, dy) = (x as f64 - anchor.0, y as f64 - anchor.1);
                sure += usize::from(plane[at] == Evidence::Strong);
                square = square.min(dx * dx + dy * dy);
                bounds.reach(x, y);
                // All around an inner sample there is one of the part that is nearer to whatever lies farther out.
                let is_inner = around(x, y, 1).all(|row| !plane[row].contains(&Evidence::None));
                for row in around(x, y, if is_inner { 1 } else { reach }) {
                    let first = row.start;
                    let samples = plane[row.clone()].iter().zip(&mut labels[row]).enumerate();
                    for (next, (belief, part)) in samples {
                        if *part == 0 && *belief != Evidence::None {
                            *part = label;
                            stack.push(first + next);
                        }
                    }
                }
            }
            parts.push(Component { strong: sure, distance: square.sqrt(), bounds });
        }
        Self { labels, components: parts }
    }

    /// The number of the part nearest to the anchor among those with at least `sure` samples that are surely plant.
    #[must_use]
    pub fn nearest(&self, sure: usize) -> Option<u32> {
        let able = (1..).zip(&self.components).filter(|(_, part)| part.strong >= sure);
        able.min_by(|(_, one), (_, other)| one.distance.total_cmp(&other.distance)).map(|(label, _)| label)
    }

    /// The number of the part with the most samples that are surely plant, at least `sure` of them; the first of equals.
    #[must_use]
    pub fn largest(&self, sure: usize) -> Option<u32> {
        let able = (1..).zip(&self.components).filter(|(_, part)| part.strong >= sure);
        able.min_by_key(|(_, part)| std::cmp::Reverse(part.strong)).map(|(label, _)| label)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(rows: &[&str], reach: usize) -> ConnectedComponents {
        let belief = |byte| match byte {
            b'#' => Evidence::Strong,
            b'+' => Evidence::Weak,
            _ => Evidence::None,
        };
        let plane: Vec<Evidence> = rows.iter().flat_map(|row| row.bytes().map(belief)).collect();
        ConnectedComponents::label(&plane, rows[0].len(), reach, (4.0, 3.0))
    }

    const ROWS: [&str; 4] = ["#...#", ".#...", ".....", "...+#"];

    #[test]
    fn parts_hang_together_by_corners_and_know_their_distance() {
        let found = parts(&ROWS, 1);
        assert_eq!(found.labels[..7], [1, 0, 0, 0, 2, 0, 1]);
        let sure: Vec<usize> = found.components.iter().map(|part| part.strong).collect();
        assert_eq!(sure, [2, 1, 1]);
        assert_eq!(found.components[1].distance, 3.0);
        assert_eq!((found.nearest(1), found.nearest(2), found.nearest(3)), (Some(3), Some(1), None));
        assert_eq!(found.largest(1), Some(1));
    }

    #[test]
    fn gaps_within_reach_are_bridged() {
        assert_eq!(parts(&ROWS, 2).components.len(), 2);
        let bounds = BoundingBox { left: 0, right: 4, top: 0, bottom: 3 };
        assert_eq!(parts(&ROWS, 3).components, [Component { strong: 4, distance: 0.0, bounds }]);
    }
}
