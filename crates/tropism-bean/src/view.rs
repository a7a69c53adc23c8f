//! Geometry of the tent and pinhole projection of its cameras (section 2.1).
//!
//! Places are in cm: x to the right, y up from the soil, z towards the camera; the root is the origin.

use tropism::geometry::{Pixel, Point};
use tropism::math::vector::Vec3;
use tropism::vision::camera::stereo::{CameraPose, Side, StereoPair};

/// The camera's place: 32 cm above the floor (20 cm above the soil), 74 cm in front of the pot's axis.
pub const CAMERA: Vec3 = [0.0, 20.0, 74.0];

/// The z of the back wall, in cm (section 2.1).
pub const WALL: f64 = -8.0;

/// The x of the left side wall, in cm: half of a tent 120 cm wide.
pub const SIDE_WALL: f64 = -60.0;

/// Both cameras of the tent, for triangulation.
pub const STEREO: StereoPair = StereoPair { front: POSE, side: POSE, side_from: Side::Right };

/// The pose of each camera to the plane through the root that it faces.
const POSE: CameraPose =
    CameraPose { principal_point: Point::new(CAMERA[0], CAMERA[1]), distance_cm: CAMERA[2] };

/// A camera of the tent. In its own coordinates each camera stands at [`CAMERA`] and looks along negative z; those of the front
/// camera are the coordinates of the tent.
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

    /// Transforms a place or direction from tent to camera coordinates.
    ///
    /// ```
    /// use tropism_bean::view::View;
    /// assert_eq!(View::Front.to_camera([3.0, 10.0, -2.0]), [3.0, 10.0, -2.0]);
    /// assert_eq!(View::Side.to_camera([3.0, 10.0, -2.0]), [2.0, 10.0, 3.0]);
    /// ```
    #[must_use]
    pub const fn to_camera(self, place: Vec3) -> Vec3 {
        let [x, y, z] = place;
        match self {
            Self::Front => place,
            Self::Side => [-z, y, x],
        }
    }

    /// Transforms a place or direction from camera to tent coordinates: the inverse of [`Self::to_camera`].
    ///
    /// ```
    /// use tropism_bean::view::View;
    /// for view in View::BOTH {
    ///     assert_eq!(view.to_tent(view.to_camera([3.0, 10.0, -2.0])), [3.0, 10.0, -2.0]);
    /// }
    /// ```
    #[must_use]
    pub const fn to_tent(self, place: Vec3) -> Vec3 {
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

/// Projects `place` through the camera onto the plane of the pot's axis (z = 0), in cm: the position that a detector
/// measures when it scales photographs at that plane.
///
/// ```
/// use tropism_bean::view::project;
/// let seen = project([0.0, 10.0, 0.0]);
/// assert_eq!((seen.x, seen.y), (0.0, 10.0));
/// ```
#[must_use]
pub fn project(place: Vec3) -> Point {
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
