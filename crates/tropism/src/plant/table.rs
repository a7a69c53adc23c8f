//! Mean shifts on a grid: what makes the cost of a look-up constant.

use super::shifts::{Shift, Window};
use super::tip::{Empty, TipModelConfig};
use crate::geometry::Point;
use crate::light::Light;

/// The means on a grid around all data. Node (column, row) stands at `(left + column, bottom + row) * grid_cm`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    pub(super) nodes_per_cm: f32,
    left: i32,
    bottom: i32,
    pub(super) columns: i32,
    pub(super) rows: i32,
    /// Row by row, at each node the shift for left and for right, with the policy for empty windows already in it; and
    /// at the end, for all that is beyond the grid, 0 twice.
    pub(crate) shifts: Vec<f32>,
    /// In the same order: whether there are data.
    pub(super) has_data: Vec<bool>,
}

impl Table {
    pub(super) fn new(shifts: &[Shift], config: &TipModelConfig) -> Self {
        let Window { wx, wy } = config.window;
        let reach = |half: f64| (half / config.grid_cm).ceil() as i32 + 1;
        let node = |value: f64| (value / config.grid_cm).round() as i32;
        let span = |value: fn(&Shift) -> f64, half| {
            let nodes = shifts.iter().map(|shift| node(value(shift)));
            let (least, most) = nodes.fold((i32::MAX, i32::MIN), |(a, b), at| (a.min(at), b.max(at)));
            (least - reach(half), most + reach(half))
        };
        let (left, right) = span(|shift| shift.tip.x, wx);
        let (bottom, top) = span(|shift| shift.tip.y, wy);
        let (columns, rows) = (right - left + 1, top - bottom + 1);
        let nodes = columns as usize * rows as usize;
        let mut sums = vec![0.0; 2 * nodes];
        let mut counts = vec![0_u32; 2 * nodes];
        // Each shift is added to every node whose window holds it. A node meets its shifts in the order of the data, as
        // the reference does, so the sums have the same bits.
        for shift in shifts {
            let (column, row) = (node(shift.tip.x), node(shift.tip.y));
            for y in row - reach(wy)..=row + reach(wy) {
                for x in column - reach(wx)..=column + reach(wx) {
                    let centre = Point::new(f64::from(x) * config.grid_cm, f64::from(y) * config.grid_cm);
                    if config.window.holds(centre, shift.tip) {
                        let node = (y - bottom) as usize * columns as usize + (x - left) as usize;
                        let at = 2 * node + shift.light as usize;
                        sums[at] += shift.dx;
                        counts[at] += 1;
                    }
                }
            }
        }
        let has_data: Vec<bool> = counts.iter().map(|&count| count > 0).collect();
        let means = sums
            .iter()
            .zip(&counts)
            .map(|(sum, &count)| if count > 0 { sum / f64::from(count) } else { 0.0 });
        let mut table = Self {
            nodes_per_cm: (1.0 / config.grid_cm) as f32,
            left,
            bottom,
            columns,
            rows,
            shifts: means.map(|mean| mean as f32).collect(),
            has_data,
        };
        if config.empty == Empty::Nearest {
            table.fill_from_nearest();
        }
        table.shifts.extend([0.0; 2]);
        table
    }

    /// Gives each empty node the shift of the nearest node of the same light that has data; of several, of the one with
    /// the least row, then the least column.
    fn fill_from_nearest(&mut self) {
        let (columns, rows) = (self.columns as usize, self.rows as usize);
        for light in 0..2 {
            let has_data = |row: usize, column: usize| self.has_data[2 * (row * columns + column) + light];
            // The nearest column with data in each row, of two the left one.
            let nearest_in_row: Vec<Option<usize>> = (0..rows)
                .flat_map(|row| {
                    let mut last = None;
                    let mut left = vec![None; columns];
                    for (column, left) in left.iter_mut().enumerate() {
                        last = if has_data(row, column) { Some(column) } else { last };
                        *left = last;
                    }
                    let mut next = None;
                    for column in (0..columns).rev() {
                        next = if has_data(row, column) { Some(column) } else { next };
                        let is_nearer =
                            |right: usize| left[column].is_none_or(|left| right - column < column - left);
                        left[column] = next.filter(|&right| is_nearer(right)).or(left[column]);
                    }
                    left
                })
                .collect();
            let filled: Vec<f32> = (0..rows * columns)
                .map(|node| {
                    let (row, column) = (node / columns, node % columns);
                    let distance = |other: usize| -> Option<(usize, usize)> {
                        let found = nearest_in_row[other * columns + column]?;
                        Some((
                            other.abs_diff(row).pow(2) + found.abs_diff(column).pow(2),
                            other * columns + found,
                        ))
                    };
                    // Rows from here outwards, until even their nearest column is farther than what was found.
                    let mut nearest = distance(row);
                    for away in 1..rows {
                        if nearest.is_some_and(|(squared, _)| away * away > squared) {
                            break;
                        }
                        let above = row.checked_sub(away).and_then(distance);
                        let below = Some(row + away).filter(|&below| below < rows).and_then(distance);
                        nearest = [nearest, above, below].into_iter().flatten().min();
                    }
                    nearest.map_or(0.0, |(_, found)| self.shifts[2 * found + light])
                })
                .collect();
            for (node, shift) in filled.into_iter().enumerate() {
                self.shifts[2 * node + light] = shift;
            }
        }
    }

    /// The nearest node, or the one past the last for all that is beyond the grid.
    #[inline]
    pub(crate) fn node(&self, x: f32, y: f32) -> usize {
        let (column, row) =
            (self.nearest(x).wrapping_sub(self.left), self.nearest(y).wrapping_sub(self.bottom));
        let is_inside = (column as u32) < (self.columns as u32) && (row as u32) < (self.rows as u32);
        if is_inside { (row * self.columns + column) as usize } else { (self.rows * self.columns) as usize }
    }

    /// The number of the column or row that is nearest to a coordinate. Halves go to the even one, which is the same in
    /// a mirror.
    ///
    /// Adding 1.5 x 2^23 leaves no room for a fraction, and the bits of the sum count up from there: `round_ties_even` and
    /// a conversion, on any processor and in any vector.
    #[inline]
    pub(super) fn nearest(&self, coordinate: f32) -> i32 {
        const NO_FRACTION: f32 = 12_582_912.0;
        let node = (coordinate * self.nodes_per_cm).clamp(-4e6, 4e6);
        ((node + NO_FRACTION).to_bits() as i32).wrapping_sub(NO_FRACTION.to_bits() as i32)
    }

    /// The shift at a node.
    #[inline]
    pub(super) fn at(&self, node: usize, light: Light) -> f32 {
        self.shifts[2 * node + light as usize]
    }
}
