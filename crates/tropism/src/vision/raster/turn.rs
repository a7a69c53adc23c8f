//! A picture turned by quarters, so that the end of a direction is at its top.
//!
//! In: a direction, and pixels and regions of a picture. Out: where they are in the turned picture.

use crate::geometry::{Pixel, Region};
use crate::photo::Orientation;
use crate::vision::config::Direction;

/// The turn of a picture after which the end of a direction is at its top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::vision) struct Turn {
    pub(in crate::vision) up: Direction,
    /// Width and height before the turn.
    size: (usize, usize),
}

impl Turn {
    /// The turn of a picture of `size`.
    pub(in crate::vision) const fn new(up: Direction, size: (usize, usize)) -> Self {
        Self { up, size }
    }

    /// Width and height after the turn.
    pub(in crate::vision) const fn size(&self) -> (usize, usize) {
        let (width, height) = self.size;
        if matches!(self.up, Direction::Left | Direction::Right) { (height, width) } else { (width, height) }
    }

    /// The turn that undoes this one.
    pub(in crate::vision) const fn back(&self) -> Self {
        let up = match self.up {
            Direction::Left => Direction::Right,
            Direction::Right => Direction::Left,
            up => up,
        };
        Self::new(up, self.size())
    }

    /// Number of clockwise quarters by which the direction lies from up.
    pub(in crate::vision) const fn quarters(&self) -> usize {
        match self.up {
            Direction::Up => 0,
            Direction::Right => 1,
            Direction::Down => 2,
            Direction::Left => 3,
        }
    }

    /// The same turn of a camera, as Exif numbers it.
    pub(in crate::vision) const fn orientation(&self) -> Orientation {
        Orientation([1, 8, 3, 6][self.quarters()])
    }

    /// A pixel in the turned picture.
    pub(in crate::vision) fn pixel(&self, Pixel { x, y }: Pixel) -> Pixel {
        let (right, bottom) = (self.size.0 as f64 - 1.0, self.size.1 as f64 - 1.0);
        match self.up {
            Direction::Up => Pixel::new(x, y),
            Direction::Left => Pixel::new(bottom - y, x),
            Direction::Right => Pixel::new(y, right - x),
            Direction::Down => Pixel::new(right - x, bottom - y),
        }
    }

    /// A region in the turned picture.
    pub(in crate::vision) fn region(&self, Region { x, y, width, height }: Region) -> Region {
        let one = self.pixel(Pixel::new(x as f64, y as f64));
        let other = self.pixel(Pixel::new((x + width) as f64 - 1.0, (y + height) as f64 - 1.0));
        let (left, top) = (one.x.min(other.x) as usize, one.y.min(other.y) as usize);
        let length = |one: f64, other: f64| (one - other).abs() as usize + 1;
        Region { x: left, y: top, width: length(one.x, other.x), height: length(one.y, other.y) }
    }
}
