//! Points and curves in space.

use crate::math::vector::{Vec3, along, distance, sub};

/// A point in space, in cm: x to the right of the root as the front camera sees it, y up, z towards the front camera.
pub type SpacePoint = Vec3;

/// Length of a polyline in space, in cm.
#[must_use]
pub fn length(points: &[SpacePoint]) -> f64 {
    points.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
}

/// Resamples a polyline in space to `count` points at equal distances along it; both ends are kept. Fewer than two
/// points are returned as they are.
#[must_use]
pub fn resampled(points: &[SpacePoint], count: usize) -> Vec<SpacePoint> {
    let total = length(points);
    if points.len() < 2 || count < 2 || total == 0.0 {
        return points.to_vec();
    }
    let mut walked = 0.0;
    let mut found = vec![points[0]];
    for pair in points.windows(2) {
        let step = distance(pair[0], pair[1]);
        while found.len() + 1 < count && step > 0.0 {
            let wanted = total * found.len() as f64 / (count - 1) as f64;
            if wanted > walked + step {
                break;
            }
            found.push(along(pair[0], sub(pair[1], pair[0]), (wanted - walked) / step));
        }
        walked += step;
    }
    // Rounding may leave the last points out.
    found.resize(count, points[points.len() - 1]);
    found
}
