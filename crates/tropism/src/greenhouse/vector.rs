//! Sums and products of places in the tent.

use super::view::Vec3;

pub(super) fn plus(a: Vec3, b: Vec3) -> Vec3 {
    core::array::from_fn(|axis| a[axis] + b[axis])
}

pub(super) fn minus(a: Vec3, b: Vec3) -> Vec3 {
    core::array::from_fn(|axis| a[axis] - b[axis])
}

pub(super) fn scaled(a: Vec3, factor: f64) -> Vec3 {
    a.map(|component| component * factor)
}

pub(super) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// `a` at length 1, or `otherwise` where `a` has no direction.
pub(super) fn unit(a: Vec3, otherwise: Vec3) -> Vec3 {
    let far = length(a);
    if far > 1e-9 { scaled(a, 1.0 / far) } else { otherwise }
}
