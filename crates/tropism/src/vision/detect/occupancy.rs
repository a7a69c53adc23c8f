//! Where tissue is, coarsely: enough to see that some came out of nothing or is gone.
//!
//! In: the samples of a plant. Out: how much of one plant is far from another. The one idea: a plant moves by little from
//! one photograph to the next, so what appears or vanishes far from where it was is no growth: something is in front of it.

use serde::{Deserialize, Serialize};

use crate::geometry::Pixel;

/// Cells that hold tissue, on a grid that is the same for all pictures of a camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// Column and row of each cell with tissue, by row and then by column.
    cells: Vec<(i32, i32)>,
    /// Pixels that a cell is wide.
    side: f64,
}

impl OccupancyGrid {
    /// The cells, `side` pixels wide, of these places in a picture.
    #[must_use]
    pub fn from_pixels(places: impl Iterator<Item = Pixel>, side: f64) -> Self {
        let cell = |at: f64| (at / side).floor() as i32;
        let mut cells: Vec<(i32, i32)> = places.map(|at| (cell(at.y), cell(at.x))).collect();
        cells.sort_unstable();
        cells.dedup();
        Self { cells, side }
    }

    /// The same shape where a picture that moved by `shift` would not have moved, to the nearest cell.
    #[must_use]
    pub fn shifted(&self, shift: Pixel) -> Self {
        let by = |shift: f64| if shift == 0.0 { 0 } else { (shift / self.side).round() as i32 };
        let (across, down) = (by(shift.x), by(shift.y));
        let cells = self.cells.iter().map(|&(row, column)| (row - down, column - across)).collect();
        Self { cells, side: self.side }
    }

    /// The cells no farther than `reach` pixels from a place, both ways across and down.
    #[must_use]
    pub fn around(&self, place: Pixel, reach: f64) -> Self {
        let cell = |at: f64| (at / self.side).floor() as i32;
        let rows = cell(place.y - reach)..=cell(place.y + reach);
        let columns = cell(place.x - reach)..=cell(place.x + reach);
        let is_near = |cell: &&(i32, i32)| rows.contains(&cell.0) && columns.contains(&cell.1);
        Self { cells: self.cells.iter().filter(is_near).copied().collect(), side: self.side }
    }

    /// Whether a place lies in one of its cells or beside one.
    #[must_use]
    pub fn is_near(&self, place: Pixel) -> bool {
        Self::from_pixels([place].into_iter(), self.side).area_beyond(self, self.side) == 0.0
    }

    /// Square pixels of all its cells.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.cells.len() as f64 * self.side * self.side
    }

    /// Square pixels of this shape that are farther than `reach` pixels from every cell of `other`, both ways across and
    /// down.
    #[must_use]
    pub fn area_beyond(&self, other: &Self, reach: f64) -> f64 {
        let reach = (reach / self.side).ceil() as i32;
        let is_near = |&(row, column): &(i32, i32)| {
            (row - reach..=row + reach).any(|row| {
                let from = other.cells.partition_point(|&cell| cell < (row, column - reach));
                other.cells.get(from).is_some_and(|&cell| cell <= (row, column + reach))
            })
        };
        let far = self.cells.iter().filter(|cell| !is_near(cell)).count();
        far as f64 * self.side * self.side
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(from: i32, to: i32) -> OccupancyGrid {
        OccupancyGrid::from_pixels((from..to).map(|y| Pixel::new(20.0, f64::from(y))), 2.0)
    }

    #[test]
    fn only_what_is_far_counts() {
        let (before, after) = (bar(0, 40), bar(0, 60));
        assert_eq!(before.area_beyond(&after, 4.0), 0.0);
        // 20 more rows are ten cells of four square pixels, two of which are near.
        assert_eq!(after.area_beyond(&before, 4.0), 32.0);
        assert_eq!(after.area_beyond(&OccupancyGrid::default(), 4.0), 120.0);
        assert_eq!(OccupancyGrid::default().area_beyond(&after, 4.0), 0.0);
    }
}
