//! Where the camera of the paper stands, and what it projects where (section 2.1).

use crate::geometry::{Pixel, Point};
use crate::math::vector::Vec3;

/// A place in the tent, in cm: x to the right, y up from the soil, z towards the camera; the root is the origin.
pub type Place = Vec3;

/// The camera's place: 32 cm above the floor (20 cm above the soil), 74 cm in front of the pot's axis.
pub const CAMERA: Place = [0.0, 20.0, 74.0];

/// The back wall's z, in cm.
pub const WALL: f64 = -8.0;

/// The side wall's x, in cm: the tent is 120 cm wide, and the pot stands in its middle.
pub const SIDE_WALL: f64 = -60.0;

/// From where the plant is seen. Each camera has coordinates of its own, in which it stands at [`CAMERA`] and looks along
/// negative z, as the front camera does in those of the tent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// From the front: the paper's only camera.
    #[default]
    Front,
    /// From the right, at the same height and distance, through an opening in the cloth: x towards the camera becomes z,
    /// and what is nearer to the back wall is further to the right.
    Side,
}

impl View {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::Front, Self::Side];

    /// A place or direction of the tent in this camera's coordinates.
    ///
    /// ```
    /// use tropism::greenhouse::view::View;
    /// assert_eq!(View::Front.of([3.0, 10.0, -2.0]), [3.0, 10.0, -2.0]);
    /// assert_eq!(View::Side.of([3.0, 10.0, -2.0]), [2.0, 10.0, 3.0]);
    /// ```
    #[must_use]
    pub const fn of(self, place: Place) -> Place {
        let [x, y, z] = place;
        match self {
            Self::Front => place,
            Self::Side => [-z, y, x],
        }
    }

    /// A place or direction in this camera's coordinates in those of the tent: the inverse of [`Self::of`].
    ///
    /// ```
    /// use tropism::greenhouse::view::View;
    /// for view in View::BOTH {
    ///     assert_eq!(view.back(view.of([3.0, 10.0, -2.0])), [3.0, 10.0, -2.0]);
    /// }
    /// ```
    #[must_use]
    pub const fn back(self, place: Place) -> Place {
        let [x, y, z] = place;
        match self {
            Self::Front => place,
            Self::Side => [z, y, -x],
        }
    }

    /// z of the wall behind the plant, in this camera's coordinates, in cm.
    #[must_use]
    pub const fn wall(self) -> f64 {
        match self {
            Self::Front => WALL,
            Self::Side => SIDE_WALL,
        }
    }
}

/// Where the ray from the camera through `place` meets the plane of the pot's axis (z = 0), in cm.
///
/// This is what a detector sees that scales photographs to centimetres at the pot's axis.
///
/// ```
/// use tropism::greenhouse::view::project;
/// let seen = project([0.0, 10.0, 0.0]);
/// assert_eq!((seen.x, seen.y), (0.0, 10.0));
/// ```
#[must_use]
pub fn project(place: Place) -> Point {
    let nearer = CAMERA[2] / (CAMERA[2] - place[2]);
    Point::new(CAMERA[0] + (place[0] - CAMERA[0]) * nearer, CAMERA[1] + (place[1] - CAMERA[1]) * nearer)
}

/// How a photograph of some size maps the plane of the pot's axis to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels per cm in the plane of the pot's axis.
    pub px_per_cm: f64,
}

impl Frame {
    /// Width of the plane of the pot's axis that a photograph shows, in cm.
    ///
    /// The paper does not give the lens. The Raspberry Pi camera module of 2013 (54 degrees wide) shows 74 cm at a
    /// distance of 74 cm: tip, pot and both lamps are in the picture, as in Fig. 2.
    pub const WIDTH_CM: f64 = 74.0;

    /// A photograph of `width` x `height` pixels, [`Self::WIDTH_CM`] wide.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, px_per_cm: f64::from(width) / Self::WIDTH_CM }
    }

    /// The pixel that shows a point of the plane of the pot's axis. The picture's centre is at a height of 20 cm.
    #[must_use]
    pub fn pixel(&self, point: Point) -> Pixel {
        Pixel::new(
            (f64::from(self.width) - 1.0) / 2.0 + (point.x - CAMERA[0]) * self.px_per_cm,
            (f64::from(self.height) - 1.0) / 2.0 - (point.y - CAMERA[1]) * self.px_per_cm,
        )
    }

    /// The point of the plane of the pot's axis that a pixel shows: the inverse of [`Self::pixel`].
    #[must_use]
    pub fn point(&self, pixel: Pixel) -> Point {
        Point::new(
            CAMERA[0] + (pixel.x - (f64::from(self.width) - 1.0) / 2.0) / self.px_per_cm,
            CAMERA[1] - (pixel.y - (f64::from(self.height) - 1.0) / 2.0) / self.px_per_cm,
        )
    }
}
