//! Points in space.

use crate::math::vector::Vec3;

/// A point in space, in cm: x to the right of the root as the front camera sees it, y up, z towards the front camera.
pub type SpacePoint = Vec3;
