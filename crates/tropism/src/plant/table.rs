//! Mean shifts on a grid: what makes the cost of a look-up constant.

use super::config::{Empty, TipModelConfig};
use super::shifts::{Shift, Window};
use crate::geometry::Point;
use crate::lamps::Light;

/// The means on a grid around all data, with a margin of one node on each side that stands for all beyond. Node
/// (column, row) of the margin and the grid stands at `(left + column, bottom + row) * grid_cm`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Table {
    pub(super) nodes_per_cm: f32,
    pub(super) left: i32,
    pub(super) bottom: i32,
    pub(super) columns: i32,
    pub(super) rows: i32,
    /// Where the node would stand of which [`counted`] tells 0 and 0.
    origin: u32,
    /// Row by row the shift at each node, with the policy for empty windows already in it, 0 on the margin: one such plane
    /// for each lamp of the layout, in its order.
    pub(super) shifts: Vec<f32>,
    /// In the same order: whether there are data.
    pub(super) has_data: Vec<bool>,
}

impl Table {
    pub(super) fn new(shifts: &[Shift], lamps: usize, config: &TipModelConfig) -> Self {
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
        let mut sums = vec![0.0; lamps * nodes];
        let mut counts = vec![0_u32; lamps * nodes];
        // Each shift is added to every node whose window holds it. A node meets its shifts in the order of the data, as
        // the reference does, so the sums have the same bits.
        for shift in shifts {
            let (column, row) = (node(shift.tip.x), node(shift.tip.y));
            for y in row - reach(wy)..=row + reach(wy) {
                for x in column - reach(wx)..=column + reach(wx) {
                    let centre = Point::new(f64::from(x) * config.grid_cm, f64::from(y) * config.grid_cm);
                    if config.window.holds(centre, shift.tip) {
                        let node = (y - bottom) as usize * columns as usize + (x - left) as usize;
                        let at = lamps * node + shift.light.index();
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
            .map(|(sum, &count)| if count > 0 { (sum / f64::from(count)) as f32 } else { 0.0 });
        let mut means: Vec<f32> = means.collect();
        if config.empty == Empty::Nearest {
            fill_from_nearest(&mut means, &has_data, lamps, columns as usize);
        }
        let (left, bottom, columns_in_all, rows_in_all) = (left - 1, bottom - 1, columns + 2, rows + 2);
        let origin = 0_u32
            .wrapping_sub(counted(bottom as f32).wrapping_mul(columns_in_all as u32))
            .wrapping_sub(counted(left as f32));
        Self {
            nodes_per_cm: (1.0 / config.grid_cm) as f32,
            left,
            bottom,
            columns: columns_in_all,
            rows: rows_in_all,
            origin,
            shifts: with_margin(&means, lamps, columns as usize),
            has_data: with_margin(&has_data, lamps, columns as usize),
        }
    }

    /// The nearest node; of all beyond the grid, one of its margin.
    #[inline]
    pub(super) fn node(&self, x: f32, y: f32) -> usize {
        self.place(x, y, 0) as usize
    }

    /// Where the shift of the nearest node for one of the first two lamps (0 or 1) stands in [`Self::shifts`]; below its
    /// length, whatever the coordinates.
    #[inline(always)]
    pub(crate) fn place(&self, x: f32, y: f32, light: u32) -> u32 {
        let column = self.clamped(x, self.left, self.columns);
        let row = self.clamped(y, self.bottom, self.rows);
        let of_light = if light == 0 { 0 } else { (self.columns * self.rows) as u32 };
        let of_row = counted(row).wrapping_mul(self.columns as u32);
        of_row.wrapping_add(self.origin).wrapping_add(counted(column)).wrapping_add(of_light)
    }

    /// A coordinate in steps of the grid, at most that of the margin. Where there is no number, the comparison fails: the
    /// last one.
    #[inline(always)]
    fn clamped(&self, coordinate: f32, first: i32, count: i32) -> f32 {
        let (least, most) = (first as f32, (first + count - 1) as f32);
        let node = coordinate * self.nodes_per_cm;
        let node = if node < most { node } else { most };
        if node > least { node } else { least }
    }

    /// All shifts, in the order of [`Self::place`].
    #[inline(always)]
    pub(crate) fn shifts(&self) -> &[f32] {
        &self.shifts
    }

    /// The shift at a node.
    #[inline]
    pub(super) fn at(&self, node: usize, light: Light) -> f32 {
        self.shifts[self.of_light(node, light)]
    }

    /// Whether there are data at a node.
    pub(super) fn has_data(&self, node: usize, light: Light) -> bool {
        self.has_data[self.of_light(node, light)]
    }

    #[inline]
    fn of_light(&self, node: usize, light: Light) -> usize {
        node + light.index() * (self.columns * self.rows) as usize
    }
}

/// A value of at most 4e6 in size rounded to a whole number, counted from an unimportant one. Halves go to the even one, which
/// is the same in a mirror.
///
/// Adding 1.5 x 2^23 leaves no room for a fraction, and the bits of the sum count up from there: `round_ties_even` and
/// a conversion, on any processor and in any vector.
#[inline(always)]
fn counted(value: f32) -> u32 {
    (value + 12_582_912.0).to_bits()
}

/// Values at each node for all lamps, lamp by lamp and with a margin of nothing around the grid.
fn with_margin<T: Copy + Default>(values: &[T], lamps: usize, columns: usize) -> Vec<T> {
    let rows = values.len() / (lamps * columns);
    let nothing = T::default();
    let mut all = Vec::with_capacity(lamps * (columns + 2) * (rows + 2));
    for light in 0..lamps {
        all.extend(std::iter::repeat_n(nothing, columns + 2));
        for row in values.chunks_exact(lamps * columns) {
            all.push(nothing);
            all.extend(row.iter().skip(light).step_by(lamps));
            all.push(nothing);
        }
        all.extend(std::iter::repeat_n(nothing, columns + 2));
    }
    all
}

/// Gives each empty node the shift of the nearest node of the same light that has data; of several, of the one with
/// the least row, then the least column.
fn fill_from_nearest(shifts: &mut [f32], has_data: &[bool], lamps: usize, columns: usize) {
    let rows = shifts.len() / (lamps * columns);
    for light in 0..lamps {
        let has_data = |row: usize, column: usize| has_data[lamps * (row * columns + column) + light];
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
                nearest.map_or(0.0, |(_, found)| shifts[lamps * found + light])
            })
            .collect();
        for (node, shift) in filled.into_iter().enumerate() {
            shifts[lamps * node + light] = shift;
        }
    }
}
