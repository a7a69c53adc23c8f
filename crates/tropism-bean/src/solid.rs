//! Where solids are in the virtual tent, and how far a place is from them.
//!
//! In: a [`Solid`] and a place in space. Out: a signed distance and its direction. The idea: an obstacle of the plane is a body
//! that points at the front camera, from the back wall to [`FRONT`]. Its flanks run along lines of sight, so the camera sees
//! its end alone, with the outline that the task gives. What touches the outline in a photograph touches the body. Poles and
//! bars stand in space.

use tropism::math::vector::{Vec3, norm, normalize_or};
use tropism::obstacle::{Obstacle, Pole, Solid};

use super::view::{CAMERA, project};

/// z of the end of an obstacle of the plane, in cm. Chosen by measurement: below a height of 16 cm
/// no apex of 100 common beans came nearer to the camera than 2.4 cm.
pub(super) const FRONT: f64 = 6.0;

/// Half the thickness of the sheet that stands for a line, in cm. Chosen by hand: sheet metal of a millimetre.
pub(super) const HALF_SHEET: f64 = 0.05;

/// Where a stem touches a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// Number of the solid, in the order of [`Bean::among`](crate::Bean::among).
    pub solid: usize,
    /// The point of the stem's midline, in cm.
    pub at: Vec3,
    /// Force of the solid on the stem, in dyn.
    pub force: Vec3,
}

/// Distance from `place` to `solid` in cm, below 0 inside, and the direction in which it grows.
#[inline]
pub(super) fn distance(solid: &Solid, place: Vec3) -> (f64, Vec3) {
    match solid {
        Solid::Plane(obstacle) => to_plane(obstacle, place),
        Solid::Pole(pole) => to_pole(pole, place),
        Solid::Bar(bar) => bar.distance_and_normal(place),
    }
}

#[inline]
fn to_plane(obstacle: &Obstacle, place: Vec3) -> (f64, Vec3) {
    let seen = project(place);
    let (outline, [x, y]) = obstacle.distance_and_normal(seen);
    let half = if matches!(obstacle, Obstacle::Line { .. }) { HALF_SHEET } else { 0.0 };
    // The gradient of the distance in the picture, over its length: how fast it grows in space.
    let nearer = CAMERA[2] / (CAMERA[2] - place[2]);
    let slant = (x * (seen.x - CAMERA[0]) + y * (seen.y - CAMERA[1])) / CAMERA[2];
    let length = (1.0 + slant * slant).sqrt();
    let flank = (outline - half) / (nearer * length);
    with_end(flank, [x / length, y / length, slant / length], place[2] - FRONT, [0.0, 0.0, 1.0])
}

#[inline]
fn to_pole(pole: &Pole, place: Vec3) -> (f64, Vec3) {
    let away = [place[0] - pole.at[0], place[2] - pole.at[1]];
    let far = norm(away);
    let [x, z] = if far > 0.0 { away.map(|axis| axis / far) } else { [0.0, 1.0] };
    with_end(far - pole.radius_cm, [x, 0.0, z], place[1] - pole.height_cm, [0.0, 1.0, 0.0])
}

/// The distance from a body that ends in a plane: `flank` and `end` are the distances from its flank and beyond its end.
#[inline]
fn with_end(flank: f64, out: Vec3, end: f64, ahead: Vec3) -> (f64, Vec3) {
    if end <= 0.0 || flank <= 0.0 {
        return if flank >= end { (flank, out) } else { (end, ahead) };
    }
    let away = core::array::from_fn(|axis| flank * out[axis] + end * ahead[axis]);
    (norm([flank, end]), normalize_or(away, out))
}

/// Whether a solid covers the base of the stem, so that no plant can grow there.
#[must_use]
pub(super) fn covers_base(solid: &Solid) -> bool {
    distance(solid, [0.0; 3]).0 <= 0.0
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tropism::geometry::Point;
    use tropism::math::vector::{add, scale};

    use tropism::obstacle::Bar;

    use super::*;
    use crate::view::WALL;

    fn solid() -> impl Strategy<Value = Solid> {
        let point = || (-8.0..8.0, 1.0..15.0).prop_map(|(x, y)| Point::new(x, y));
        prop_oneof![
            (point(), 0.2..3.0).prop_map(|(centre, radius_cm)| Obstacle::Disc { centre, radius_cm }.into()),
            [point(), point()].prop_map(|corners| Obstacle::Box { corners }.into()),
            [point(), point()].prop_map(|ends| Obstacle::Line { ends }.into()),
            ([-5.0..5.0, 0.0..20.0, -5.0..5.0], [-5.0..5.0, 0.0..20.0, -5.0..5.0], 0.1..2.0)
                .prop_map(|(from, to, radius_cm)| Bar { ends: [from, to], radius_cm }.into()),
            ([-5.0..5.0, -5.0..5.0], 0.1..2.0, 5.0..40.0).prop_map(|(at, radius_cm, height_cm)| Pole {
                at,
                radius_cm,
                height_cm
            }
            .into()),
        ]
    }

    proptest! {
        #[test]
        fn the_distance_grows_along_the_normal_about_as_fast_as_one_moves(
            solid in solid(), place in [-8.0..8.0, 0.0..20.0, WALL..16.0],
        ) {
            let (here, normal) = distance(&solid, place);
            prop_assert!((norm(normal) - 1.0).abs() < 1e-9);
            let step = 1e-6;
            let ahead = distance(&solid, add(place, scale(normal, step))).0;
            // Where two sides meet, and far from the axis of the camera, it grows a little slower or faster.
            prop_assert!((0.5 * step..1.3 * step).contains(&(ahead - here)), "{here} {ahead}");
        }

        #[test]
        fn the_front_camera_sees_the_outline_and_nothing_else(
            solid in solid(), place in [-8.0..8.0, 0.0..20.0, WALL..FRONT],
        ) {
            if let Solid::Plane(obstacle) = solid {
                let outline = obstacle.distance(project(place));
                let half = if matches!(obstacle, Obstacle::Line { .. }) { HALF_SHEET } else { 0.0 };
                prop_assert_eq!(distance(&solid, place).0 < 0.0, outline < half);
            }
        }
    }

    #[test]
    fn a_pole_has_a_top() {
        let pole = Pole { at: [2.0, -1.0], radius_cm: 0.5, height_cm: 10.0 }.into();
        assert_eq!(distance(&pole, [4.0, 5.0, -1.0]), (1.5, [1.0, 0.0, 0.0]));
        assert_eq!(distance(&pole, [2.0, 12.0, -1.0]), (2.0, [0.0, 1.0, 0.0]));
        assert_eq!(distance(&pole, [5.5, 14.0, -1.0]).0, 5.0);
        assert!(
            !covers_base(&pole)
                && covers_base(&Pole { at: [0.2, 0.0], radius_cm: 0.5, height_cm: 1.0 }.into())
        );
    }
}
