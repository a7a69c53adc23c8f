//! Points of the world in centimetres and of photographs in pixels: different types, never mixed.

use serde::{Deserialize, Serialize};

use crate::math;

/// A point in the plane of the stem, in cm: x to the right of the root as the camera sees it, y up from the soil.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct Point {
    /// cm to the right of the root.
    pub x: f64,
    /// cm above the soil.
    pub y: f64,
}

impl Point {
    /// The point (x, y), in cm.
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The same point in a mirror: x changes sign.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self { x: -self.x, y: self.y }
    }

    /// Distance to `other`, in cm.
    #[must_use]
    pub fn distance(self, other: Self) -> f64 {
        math::hypot(self.x - other.x, self.y - other.y)
    }

    /// Whether both coordinates are finite numbers.
    #[must_use]
    pub const fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }
}

impl From<[f64; 2]> for Point {
    fn from([x, y]: [f64; 2]) -> Self {
        Self { x, y }
    }
}

impl From<Point> for [f64; 2] {
    fn from(point: Point) -> Self {
        [point.x, point.y]
    }
}

/// A place in a photograph, in pixels: x to the right, y down, whole numbers at the centres of pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pixel {
    /// Pixels to the right of the centre of the leftmost column.
    pub x: f64,
    /// Pixels below the centre of the topmost row.
    pub y: f64,
}

impl Pixel {
    /// The place (x, y), in pixels.
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Distance to `other`, in pixels.
    #[must_use]
    pub fn distance(self, other: Self) -> f64 {
        math::hypot(self.x - other.x, self.y - other.y)
    }
}

/// A rectangle of whole pixels in a photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Leftmost column.
    pub x: usize,
    /// Topmost row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Region {
    /// Whether the region has pixels and all of them lie in a picture of `width` x `height`.
    #[must_use]
    pub const fn fits(&self, width: usize, height: usize) -> bool {
        self.width > 0
            && self.height > 0
            && self.width <= width
            && self.height <= height
            && self.x <= width - self.width
            && self.y <= height - self.height
    }
}

/// A line through points, in cm, from the base up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Polyline(pub Vec<Point>);

impl Polyline {
    /// The same line in a mirror: x changes sign.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self(self.0.iter().map(|point| point.mirrored()).collect())
    }

    /// Length along the line, in cm.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.0.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }

    /// The same line with `count` vertices at equal distances along it, both ends kept (section 4: ten).
    ///
    /// A line of fewer than two points, or a `count` below two, is returned as it is.
    #[must_use]
    pub fn equidistant(&self, count: usize) -> Self {
        if self.0.len() < 2 || count < 2 {
            return self.clone();
        }
        let spacing = self.length() / (count - 1) as f64;
        let mut vertices = vec![self.0[0]];
        let mut walked = 0.0;
        for pair in self.0.windows(2) {
            let segment = pair[0].distance(pair[1]);
            while vertices.len() < count - 1
                && walked + segment >= spacing * vertices.len() as f64
                && segment > 0.0
            {
                let share = (spacing * vertices.len() as f64 - walked) / segment;
                vertices.push(Point::new(
                    pair[0].x + share * (pair[1].x - pair[0].x),
                    pair[0].y + share * (pair[1].y - pair[0].y),
                ));
            }
            walked += segment;
        }
        vertices.resize(count, self.0[self.0.len() - 1]);
        Self(vertices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_points_stand_at_equal_distances() {
        let line = Polyline(vec![Point::new(0.0, 0.0), Point::new(0.0, 5.0), Point::new(4.0, 5.0)]);
        let ten = line.equidistant(10);
        assert_eq!(ten.0.len(), 10);
        assert_eq!(ten.0[0], line.0[0]);
        assert_eq!(ten.0[9], line.0[2]);
        for pair in ten.0.windows(2) {
            assert!(pair[0].distance(pair[1]) <= 1.0 + 1e-12);
        }
        assert!((ten.0[5].x - 0.0).abs() < 1e-12 && (ten.0[5].y - 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_region_must_lie_inside_the_picture() {
        let region = Region { x: 10, y: 10, width: 20, height: 20 };
        assert!(region.fits(30, 30));
        assert!(!region.fits(29, 30));
        assert!(!Region { width: 0, ..region }.fits(100, 100));
        assert!(!Region { x: usize::MAX, ..region }.fits(100, 100));
    }
}
