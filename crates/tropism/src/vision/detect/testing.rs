//! Synthetic planes for the tests of detection.

use crate::geometry::Pixel;
use crate::geometry::path::share_nearest;
use crate::math::vector::{between, distance};
use crate::vision::detect::curve::PlanePoint;
use crate::vision::raster::plane::Plane;

/// A straight piece of plant: from one point to another, and half of its width.
pub(super) type Branch = (PlanePoint, PlanePoint, f64);

/// A plane of `width` columns with these values.
pub(super) fn plane(width: usize, values: Vec<f32>) -> Plane {
    Plane { width, height: values.len() / width, values, origin: Pixel::default(), step: 1 }
}

/// A plane of 80 columns and 90 rows whose value falls from 1 to 0 over one sample at the edge of the branches.
pub(super) fn drawn(branches: &[Branch]) -> Plane {
    let values = (0..80 * 90).map(|i| {
        let at = [(i % 80) as f64, (i / 80) as f64];
        let depth = |&(from, to, half): &Branch| {
            half + 0.5 - distance(at, between(from, to, share_nearest(from, to, at)))
        };
        branches.iter().map(depth).fold(0.0, f64::max).min(1.0) as f32
    });
    plane(80, values.collect())
}
