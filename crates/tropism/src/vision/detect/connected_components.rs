//! Which plant samples hang together, and which of them stand at the base.

use crate::vision::detect::hysteresis::Belief;

/// The samples of a plane that hang together, numbered by part.
#[derive(Clone, Debug)]
pub struct Parts {
    /// For each sample the number of its part, from 1; 0 is background.
    pub labels: Vec<u32>,
    /// Each part, number 1 first.
    pub parts: Vec<Part>,
}

/// One connected part of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Its samples that are surely plant.
    pub sure: usize,
    /// Least distance from one of its samples to the anchor, in samples.
    pub distance: f64,
    /// The columns and rows that it lies in.
    pub bounds: Bounds,
}

/// A rectangle of samples, the last column and row included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// First column.
    pub left: usize,
    /// Last column.
    pub right: usize,
    /// First row.
    pub top: usize,
    /// Last row.
    pub bottom: usize,
}

impl Bounds {
    fn reach(&mut self, x: usize, y: usize) {
        (self.left, self.right) = (self.left.min(x), self.right.max(x));
        (self.top, self.bottom) = (self.top.min(y), self.bottom.max(y));
    }
}

/// Samples that are passed over at a time where none is plant.
const CHUNK: usize = 64;

impl Parts {
    /// Numbers the parts of a plane of `width` columns. Samples belong together that are no more than `reach` columns
    /// and rows apart: a gap of `reach` - 1 samples is bridged. Distances are measured to `anchor` (column, row).
    #[must_use]
    pub fn of(plane: &[Belief], width: usize, reach: usize, anchor: (f64, f64)) -> Self {
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
            |chunk: &[Belief]| chunk.iter().fold(false, |any, &belief| any | (belief != Belief::No));
        let chunks = plane.chunks(CHUNK).enumerate().filter(|(_, chunk)| is_plant(chunk));
        let seeds = chunks.flat_map(|(at, chunk)| CHUNK * at..CHUNK * at + chunk.len());
        for seed in seeds {
            if labels[seed] != 0 || plane[seed] == Belief::No {
                continue;
            }
            let label = parts.len() as u32 + 1;
            let (mut sure, mut square) = (0, f64::INFINITY);
            let (x, y) = (seed % width, seed / width);
            let mut bounds = Bounds { left: x, right: x, top: y, bottom: y };
            labels[seed] = label;
            stack.push(seed);
            while let Some(at) = stack.pop() {
                let (x, y) = (at % width, at / width);
                let (dx, dy) = (x as f64 - anchor.0, y as f64 - anchor.1);
                sure += usize::from(plane[at] == Belief::Sure);
                square = square.min(dx * dx + dy * dy);
                bounds.reach(x, y);
                // All around an inner sample there is one of the part that is nearer to whatever lies farther out.
                let is_inner = around(x, y, 1).all(|row| !plane[row].contains(&Belief::No));
                for row in around(x, y, if is_inner { 1 } else { reach }) {
                    let first = row.start;
                    let samples = plane[row.clone()].iter().zip(&mut labels[row]).enumerate();
                    for (next, (belief, part)) in samples {
                        if *part == 0 && *belief != Belief::No {
                            *part = label;
                            stack.push(first + next);
                        }
                    }
                }
            }
            parts.push(Part { sure, distance: square.sqrt(), bounds });
        }
        Self { labels, parts }
    }

    /// The number of the part nearest to the anchor among those with at least `sure` samples that are surely plant.
    #[must_use]
    pub fn nearest(&self, sure: usize) -> Option<u32> {
        let able = (1..).zip(&self.parts).filter(|(_, part)| part.sure >= sure);
        able.min_by(|(_, one), (_, other)| one.distance.total_cmp(&other.distance)).map(|(label, _)| label)
    }

    /// The number of the part with the most samples that are surely plant, at least `sure` of them; the first of equals.
    #[must_use]
    pub fn largest(&self, sure: usize) -> Option<u32> {
        let able = (1..).zip(&self.parts).filter(|(_, part)| part.sure >= sure);
        able.min_by_key(|(_, part)| std::cmp::Reverse(part.sure)).map(|(label, _)| label)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(rows: &[&str], reach: usize) -> Parts {
        let belief = |byte| match byte {
            b'#' => Belief::Sure,
            b'+' => Belief::Perhaps,
            _ => Belief::No,
        };
        let plane: Vec<Belief> = rows.iter().flat_map(|row| row.bytes().map(belief)).collect();
        Parts::of(&plane, rows[0].len(), reach, (4.0, 3.0))
    }

    const ROWS: [&str; 4] = ["#...#", ".#...", ".....", "...+#"];

    #[test]
    fn parts_hang_together_by_corners_and_know_their_distance() {
        let found = parts(&ROWS, 1);
        assert_eq!(found.labels[..7], [1, 0, 0, 0, 2, 0, 1]);
        let sure: Vec<usize> = found.parts.iter().map(|part| part.sure).collect();
        assert_eq!(sure, [2, 1, 1]);
        assert_eq!(found.parts[1].distance, 3.0);
        assert_eq!((found.nearest(1), found.nearest(2), found.nearest(3)), (Some(3), Some(1), None));
        assert_eq!(found.largest(1), Some(1));
    }

    #[test]
    fn gaps_within_reach_are_bridged() {
        assert_eq!(parts(&ROWS, 2).parts.len(), 2);
        let bounds = Bounds { left: 0, right: 4, top: 0, bottom: 3 };
        assert_eq!(parts(&ROWS, 3).parts, [Part { sure: 4, distance: 0.0, bounds }]);
    }
}
