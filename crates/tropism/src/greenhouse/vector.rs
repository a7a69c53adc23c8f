//! Sums and products of places in the tent.

use super::view::Place;

pub(super) fn plus(a: Place, b: Place) -> Place {
    core::array::from_fn(|axis| a[axis] + b[axis])
}

pub(super) fn minus(a: Place, b: Place) -> Place {
    core::array::from_fn(|axis| a[axis] - b[axis])
}

pub(super) fn scaled(a: Place, factor: f64) -> Place {
    a.map(|component| component * factor)
}

pub(super) fn dot(a: Place, b: Place) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Place, b: Place) -> Place {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn length(a: Place) -> f64 {
    dot(a, a).sqrt()
}

/// `a` at length 1, or `otherwise` where `a` has no direction.
pub(super) fn unit(a: Place, otherwise: Place) -> Place {
    let far = length(a);
    if far > 1e-9 { scaled(a, 1.0 / far) } else { otherwise }
}
