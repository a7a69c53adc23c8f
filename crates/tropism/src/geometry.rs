//! Points of the plant's plane in centimetres and places in a photograph in pixels: two types, never mixed.

pub mod path;
pub mod space;

use std::fmt;
use std::ops::{Add, Sub};

use serde::{Deserialize, Serialize};

use crate::math;
use crate::math::interpolate::lerp;

/// Points of a stem where it is described by few, at equal distances from the base to the apex. Paper: 10 (section 4).
pub const STEM_POINTS: usize = 10;

/// A point in the plane of the stem, in cm: x to the right of the root as the camera sees it, y up from the soil.
///
/// ```
/// use tropism::geometry::Point;
/// let tip = Point::new(3.0, 4.0);
/// assert_eq!(tip.distance(Point::default()), 5.0);
/// assert_eq!(tip.mirrored(), Point::new(-3.0, 4.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(try_from = "[f64; 2]"))]
#[serde(try_from = "Vec<f64>", into = "[f64; 2]")]
pub struct Point {
    /// cm to the right of the root.
    pub x: f64,
    /// cm above the soil.
    pub y: f64,
}

/// By a list of any length: what a file holds beside two coordinates is no point.
impl TryFrom<Vec<f64>> for Point {
    type Error = String;

    fn try_from(found: Vec<f64>) -> Result<Self, String> {
        let two = <[f64; 2]>::try_from(found);
        two.map(Self::from).map_err(|found| format!("invalid length {}, wanted [x, y] in cm", found.len()))
    }
}

impl Point {
    /// The point (x, y), in cm.
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The mirror image at the vertical through the root: x changes sign.
    #[must_use]
    pub const fn mirrored(self) -> Self {
        Self { x: -self.x, y: self.y }
    }

    /// Euclidean distance to `other`, in cm.
    #[must_use]
    pub fn distance(self, other: Self) -> f64 {
        math::hypot(self.x - other.x, self.y - other.y)
    }

    /// The point at a `share` of the way to `other`: 0 is this point, 1 the other.
    ///
    /// ```
    /// use tropism::geometry::Point;
    /// assert_eq!(Point::new(0.0, 4.0).lerp(Point::new(2.0, 8.0), 0.25), Point::new(0.5, 5.0));
    /// ```
    #[must_use]
    pub fn lerp(self, other: Self, share: f64) -> Self {
        Self { x: lerp(self.x, other.x, share), y: lerp(self.y, other.y, share) }
    }

    /// Whether neither coordinate is infinite or NaN.
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

/// A place in a photograph, in pixels: x to the right, y down. Whole numbers are the centres of pixels.
///
/// ```
/// use tropism::geometry::Pixel;
/// assert_eq!(Pixel::new(10.0, 2.0).distance(Pixel::new(4.0, 10.0)), 10.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

    /// Euclidean distance to `other`, in pixels.
    #[must_use]
    pub fn distance(self, other: Self) -> f64 {
        math::hypot(self.x - other.x, self.y - other.y)
    }
}

impl From<[f64; 2]> for Pixel {
    fn from([x, y]: [f64; 2]) -> Self {
        Self { x, y }
    }
}

impl From<Pixel> for [f64; 2] {
    fn from(pixel: Pixel) -> Self {
        [pixel.x, pixel.y]
    }
}

impl Add for Pixel {
    type Output = Self;

    fn add(self, shift: Self) -> Self {
        Self { x: self.x + shift.x, y: self.y + shift.y }
    }
}

impl Sub for Pixel {
    type Output = Self;

    fn sub(self, shift: Self) -> Self {
        Self { x: self.x - shift.x, y: self.y - shift.y }
    }
}

/// A rectangle of whole pixels in a photograph.
///
/// ```
/// use tropism::geometry::Region;
/// let region = Region { x: 10, y: 0, width: 20, height: 20 };
/// assert!(region.fits(30, 20) && !region.fits(29, 20));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

/// `x,y,width,height`, as `--roi` takes it.
impl fmt::Display for Region {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { x, y, width, height } = self;
        write!(formatter, "{x},{y},{width},{height}")
    }
}

impl Region {
    /// The region that covers a picture of `width` x `height` pixels.
    #[must_use]
    pub const fn whole((width, height): (usize, usize)) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Whether the region is not empty and lies inside a picture of `width` x `height` pixels.
    #[must_use]
    pub const fn fits(&self, width: usize, height: usize) -> bool {
        self.width > 0
            && self.height > 0
            && self.width <= width
            && self.height <= height
            && self.x <= width - self.width
            && self.y <= height - self.height
    }

    /// Whether a pixel lies in the region, or on its edge.
    #[must_use]
    pub fn contains(&self, pixel: Pixel) -> bool {
        let is_within =
            |at: f64, first: usize, count: usize| (first as f64..=(first + count) as f64).contains(&at);
        is_within(pixel.x, self.x, self.width) && is_within(pixel.y, self.y, self.height)
    }
}

/// A line of straight segments from vertex to vertex, in cm, from the base up.
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
        path::length(&self.0)
    }

    /// The same line with `count` vertices at equal distances along it; both ends stay. The paper uses ten vertices
    /// (section 4).
    ///
    /// A line of fewer than two points, or a `count` below two, returns the line unchanged.
    ///
    /// ```
    /// use tropism::geometry::{Point, Polyline};
    /// let bent = Polyline(vec![Point::new(0.0, 0.0), Point::new(0.0, 3.0), Point::new(1.0, 3.0)]);
    /// let even = [(0.0, 0.0), (0.0, 2.0), (1.0, 3.0)].map(|(x, y)| Point::new(x, y));
    /// assert_eq!(bent.resampled(3).0, even);
    /// ```
    #[must_use]
    pub fn resampled(&self, count: usize) -> Self {
        Self(path::resampled(&self.0, count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_points_stand_at_equal_distances() {
        let line = Polyline(vec![Point::new(0.0, 0.0), Point::new(0.0, 5.0), Point::new(4.0, 5.0)]);
        let ten = line.resampled(10);
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
