//! Occupancy grid of a plant: a coarse mask that two photographs can be compared by.
//!
//! In: the samples of a plant. Out: the area of one plant that is far from another. The one idea: a plant moves
//! little from one photograph to the next, so tissue that appears or vanishes far from where some was is an
//! occlusion, not growth.

use serde::{Deserialize, Serialize};

use crate::geometry::Pixel;

/// Cells of a plant, on a grid that is the same for all pictures of a camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// Row and column of each occupied cell, in this order.
    cells: Vec<(i32, i32)>,
    /// Side length of a cell, in pixels.
    side: f64,
}

impl OccupancyGrid {
    /// The cells, `side` pixels wide, that contain any of the `pixels`.
    #[must_use]
    pub fn from_pixels(pixels: impl Iterator<Item = Pixel>, side: f64) -> Self {
        let cell = |at: f64| (at / side).floor() as i32;
        let mut cells: Vec<(i32, i32)> = pixels.map(|at| (cell(at.y), cell(at.x))).collect();
        cells.sort_unstable();
        cells.dedup();
        Self { cells, side }
    }

    /// The grid with a camera shift of `shift` pixels undone, to the nearest cell.
    #[must_use]
    pub fn unshifted(&self, shift: Pixel) -> Self {
        let in_cells = |shift: f64| if shift == 0.0 { 0 } else { (shift / self.side).round() as i32 };
        let (right, down) = (in_cells(shift.x), in_cells(shift.y));
        let cells = self.cells.iter().map(|&(row, column)| (row - down, column - right)).collect();
        Self { cells, side: self.side }
    }

    /// The grid with the middle of each cell moved to another place.
    #[must_use]
    pub(super) fn mapped(&self, place: impl Fn(Pixel) -> Pixel) -> Self {
        let middle = |at: i32| (f64::from(at) + 0.5) * self.side;
        let middles = self.cells.iter().map(|&(row, column)| Pixel::new(middle(column), middle(row)));
        Self::from_pixels(middles.map(place), self.side)
    }

    /// The cells in a square around a pixel, `radius` pixels to each side.
    #[must_use]
    pub fn around(&self, pixel: Pixel, radius: f64) -> Self {
        let cell = |at: f64| (at / self.side).floor() as i32;
        let rows = cell(pixel.y - radius)..=cell(pixel.y + radius);
        let columns = cell(pixel.x - radius)..=cell(pixel.x + radius);
        let is_near = |cell: &&(i32, i32)| rows.contains(&cell.0) && columns.contains(&cell.1);
        Self { cells: self.cells.iter().filter(is_near).copied().collect(), side: self.side }
    }

    /// Whether a pixel lies in an occupied cell or in a neighbour of one.
    #[must_use]
    pub fn is_near(&self, pixel: Pixel) -> bool {
        Self::from_pixels([pixel].into_iter(), self.side).area_beyond(self, self.side) == 0.0
    }

    /// Area of the occupied cells, in square pixels.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.cells.len() as f64 * self.side * self.side
    }

    /// Area, in square pixels, of the cells that are farther than `radius` pixels from every cell of `other`, in
    /// columns or in rows.
    #[must_use]
    pub fn area_beyond(&self, other: &Self, radius: f64) -> f64 {
        let radius = (radius / self.side).ceil() as i32;
        let is_near = |&(row, column): &(i32, i32)| {
            (row - radius..=row + radius).any(|row| {
                let first = other.cells.partition_point(|&cell| cell < (row, column - radius));
                other.cells.get(first).is_some_and(|&cell| cell <= (row, column + radius))
            })
        };
        let far_cells = self.cells.iter().filter(|cell| !is_near(cell)).count();
        far_cells as f64 * self.side * self.side
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(from: i32, to: i32) -> OccupancyGrid {
        OccupancyGrid::from_pixels((from..to).map(|y| Pixel::new(20.0, f64::from(y))), 2.0)
    }

    #[test]
    fn only_far_cells_count() {
        let (before, after) = (bar(0, 40), bar(0, 60));
        assert_eq!(before.area_beyond(&after, 4.0), 0.0);
        // 20 more rows are ten cells of four square pixels, two of which are near.
        assert_eq!(after.area_beyond(&before, 4.0), 32.0);
        assert_eq!(after.area_beyond(&OccupancyGrid::default(), 4.0), 120.0);
        assert_eq!(OccupancyGrid::default().area_beyond(&after, 4.0), 0.0);
    }
}
