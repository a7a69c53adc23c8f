//! The form of a stem: its tilts, of which a few principal components hold nearly all, and its length.
//!
//! A stem is ten points, so nine segments. Each segment tilts from the vertical by an angle, towards some side. As a vector
//! along the axes this tilt has one component in the plane of the front camera (x) and two in space (x and z). All formulas
//! are written once for both.
//!
//! # References
//! - Stephens et al. 2008, doi:10.1371/journal.pcbi.1000028 (principal components of the angles along a body, "eigenworms").
//! - Jolliffe 2002, *Principal Component Analysis*, 2nd edition.

use core::f64::consts::TAU;
use core::ops::{Add, Sub};

use crate::geometry::STEM_POINTS;
use crate::geometry::space::SpacePoint;
use crate::math::matrix::{eigen_symmetric, transform};
use crate::math::vector::{dot, scale};
use crate::math::{Real, atan2, sin_cos};

pub(crate) const SEGMENTS: usize = STEM_POINTS - 1;

/// Principal components that are kept. Two hold nearly all of how virtual beans bend; the third is hardly more than the errors
/// of the points. Three components of the displacements of the points, which errors do not fill, gave worse rules
/// (docs/validation/obstacles.md). A fourth one changed the predicted fitness by less than 0.1 cm.
pub const MODES: usize = 3;

/// One number for each principal component.
pub(crate) type Scores<R = f64> = [R; MODES];

/// One angle for each segment, in radians.
pub(crate) type Angles<R = f64> = [R; SEGMENTS];

/// A place, in cm: how far aside of the vertical through the root along each axis, and how high.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place<const AXES: usize, R = f64> {
    pub(crate) aside: [R; AXES],
    pub(crate) up: R,
}

/// Ten points from the base up.
pub(crate) type Stem<const AXES: usize, R = f64> = [Place<AXES, R>; STEM_POINTS];

impl<const AXES: usize> Place<AXES> {
    pub(super) fn of([x, y, z]: SpacePoint) -> Self {
        Self { aside: core::array::from_fn(|axis| [x, z][axis]), up: y }
    }

    /// x, y and z; z is 0 in the plane.
    pub(super) fn in_space(self) -> SpacePoint {
        [self.aside[0], self.up, if AXES == 2 { self.aside[1] } else { 0.0 }]
    }
}

impl<const AXES: usize, R: Real> Place<AXES, R> {
    pub(crate) fn splat(place: Place<AXES>) -> Self {
        Self { aside: place.aside.map(R::splat), up: R::splat(place.up) }
    }

    pub(crate) fn lane(self, lane: usize) -> Place<AXES> {
        Place { aside: self.aside.map(|aside| aside.lane(lane)), up: self.up.lane(lane) }
    }

    pub(crate) fn set_lane(&mut self, lane: usize, place: Place<AXES>) {
        self.aside.iter_mut().zip(place.aside).for_each(|(aside, value)| aside.set_lane(lane, value));
        self.up.set_lane(lane, place.up);
    }

    #[inline(always)]
    pub(super) fn scaled(mut self, factor: R) -> Self {
        for axis in 0..AXES {
            self.aside[axis] *= factor;
        }
        self.up *= factor;
        self
    }
}

impl<const AXES: usize, R: Real> Add for Place<AXES, R> {
    type Output = Self;

    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        for axis in 0..AXES {
            self.aside[axis] += other.aside[axis];
        }
        self.up += other.up;
        self
    }
}

impl<const AXES: usize, R: Real> Sub for Place<AXES, R> {
    type Output = Self;

    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        for axis in 0..AXES {
            self.aside[axis] -= other.aside[axis];
        }
        self.up -= other.up;
        self
    }
}

/// A vector along the axes as its size and its direction. On one axis the size has the sign, and the direction is 1.
#[inline(always)]
fn polar<const AXES: usize, R: Real>(vector: [R; AXES]) -> (R, [R; AXES]) {
    if AXES == 1 {
        return (vector[0], [R::splat(1.0); AXES]);
    }
    let size = size(vector);
    let share = R::splat(1.0) / R::select(size.gt(R::splat(0.0)), size, R::splat(1.0));
    let mut direction = vector;
    for axis in 0..AXES {
        direction[axis] *= share;
    }
    (size, direction)
}

/// The size of a vector along the axes.
#[inline(always)]
pub(crate) fn size<const AXES: usize, R: Real>(vector: [R; AXES]) -> R {
    if AXES == 1 {
        return vector[0].abs();
    }
    let mut square = vector[0] * vector[0];
    for axis in 1..AXES {
        square += vector[axis] * vector[axis];
    }
    square.sqrt()
}

/// The tilt of each segment of a stem along each axis. Where a stem bends over, the angle goes on beyond half a turn.
pub(super) fn tilts<const AXES: usize>(stem: &Stem<AXES>) -> [Angles; AXES] {
    let mut tilts = [[0.0; SEGMENTS]; AXES];
    let mut last = [0.0; AXES];
    for segment in 0..SEGMENTS {
        let Place { aside, up } = stem[segment + 1] - stem[segment];
        let (aside, direction) = polar(aside);
        let angle = atan2(aside, up);
        let turns = ((dot(last, direction) - angle) / TAU).round();
        last = scale(direction, angle + turns * TAU);
        for axis in 0..AXES {
            tilts[axis][segment] = last[axis];
        }
    }
    tilts
}

/// The direction of a segment of a tilt, as a place 1 cm away.
#[inline(always)]
fn along<const AXES: usize, R: Real>(tilt: [R; AXES]) -> Place<AXES, R> {
    let (angle, mut direction) = polar(tilt);
    let (sin, cos) = sin_cos(angle);
    for axis in 0..AXES {
        direction[axis] *= sin;
    }
    Place { aside: direction, up: cos }
}

/// A stem of segments of equal length from `base` up. Arguments are values: the compiler must know that nothing else stands
/// where it writes.
#[inline(always)]
pub(super) fn stem_of<const AXES: usize, R: Real>(
    base: Place<AXES, R>,
    tilts: [Angles<R>; AXES],
    length_cm: R,
) -> Stem<AXES, R> {
    let segment_cm = length_cm / SEGMENTS as f64;
    let mut stem = [base; STEM_POINTS];
    for segment in 0..SEGMENTS {
        let mut tilt = [R::splat(0.0); AXES];
        for axis in 0..AXES {
            tilt[axis] = tilts[axis][segment];
        }
        stem[segment + 1] = stem[segment] + along(tilt).scaled(segment_cm);
    }
    stem
}

/// The highest point of a stem; of equals the lowest along it.
#[inline(always)]
pub(super) fn top_of<const AXES: usize, R: Real>(stem: &Stem<AXES, R>) -> Place<AXES, R> {
    let mut top = stem[0];
    for point in &stem[1..] {
        let is_higher = point.up.gt(top.up);
        for axis in 0..AXES {
            top.aside[axis] = R::select(is_higher, point.aside[axis], top.aside[axis]);
        }
        top.up = R::select(is_higher, point.up, top.up);
    }
    top
}

/// The principal components of tilts: orthonormal, the one with the most variance first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Modes([Angles; MODES]);

impl Modes {
    /// The components of some tilts and their mirror images, whose mean is 0: eigenvectors of their covariance.
    pub(super) fn of(tilts: impl Iterator<Item = Angles>) -> Self {
        let mut products = [[0.0; SEGMENTS]; SEGMENTS];
        for tilts in tilts {
            for (row, one) in products.iter_mut().zip(tilts) {
                for (product, other) in row.iter_mut().zip(tilts) {
                    *product += one * other;
                }
            }
        }
        let (variances, modes) = eigen_symmetric(products);
        let mut order: [usize; SEGMENTS] = core::array::from_fn(|at| at);
        order.sort_by(|&one, &other| variances[other].total_cmp(&variances[one]));
        Self(core::array::from_fn(|mode| modes[order[mode]]))
    }

    /// The scores of tilts: their projections on the components.
    pub(super) fn scores<const AXES: usize>(&self, tilts: [Angles; AXES]) -> [Scores; AXES] {
        tilts.map(|tilts| transform(&self.0, tilts))
    }

    /// The tilts of scores.
    #[inline(always)]
    pub(super) fn tilts<const AXES: usize, R: Real>(&self, scores: [Scores<R>; AXES]) -> [Angles<R>; AXES] {
        let mut tilts = [[R::splat(0.0); SEGMENTS]; AXES];
        for axis in 0..AXES {
            for segment in 0..SEGMENTS {
                let mut tilt = scores[axis][0] * self.0[0][segment];
                for mode in 1..MODES {
                    tilt += scores[axis][mode] * self.0[mode][segment];
                }
                tilts[axis][segment] = tilt;
            }
        }
        tilts
    }

    /// What the components leave of some tilts.
    pub(super) fn rest<const AXES: usize>(&self, mut tilts: [Angles; AXES]) -> [Angles; AXES] {
        let bent = self.tilts(self.scores(tilts));
        for (tilt, bent) in tilts.as_flattened_mut().iter_mut().zip(bent.as_flattened()) {
            *tilt -= bent;
        }
        tilts
    }

    /// The length of a stem along the direction that the components give each segment, in cm. The noise of the points across
    /// the stem does not lengthen it.
    pub(super) fn length_cm<const AXES: usize>(&self, stem: &Stem<AXES>) -> f64 {
        let smooth = self.tilts(self.scores(tilts(stem)));
        let segment = |at: usize| {
            let (part, along) = (stem[at + 1] - stem[at], along(smooth.map(|tilts| tilts[at])));
            dot(part.aside, along.aside) + part.up * along.up
        };
        (0..SEGMENTS).map(segment).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::statistics::mean;
    use crate::math::{cos, hypot, sin};
    use crate::random::{NoiseStream, Purpose};

    #[test]
    fn tilts_make_the_stem_again() {
        let tilt = |at: usize| [0.1 * at as f64, 0.8 - 0.2 * at as f64];
        let both = [0, 1].map(|axis: usize| core::array::from_fn(|at| tilt(at)[axis]));
        let stem = stem_of(Place::of([0.1, 0.2, 0.3]), both, 7.0);
        for (one, other) in tilts(&stem).iter().flatten().zip(both.iter().flatten()) {
            assert!((one - other).abs() < 1e-12, "{one} for {other}");
        }
    }

    #[test]
    fn angles_do_not_jump_where_a_stem_bends_over() {
        // A circle: the angle goes on beyond half a turn, in the plane and in space.
        let circle = |point: usize| {
            let turn = 0.8 * point as f64;
            [-0.6 * cos(turn), sin(turn), -0.8 * cos(turn)]
        };
        let [x, z] = tilts::<2>(&core::array::from_fn(|point| Place::of(circle(point))));
        let [flat] = tilts::<1>(&core::array::from_fn(|point| {
            let [x, y, _] = circle(point);
            Place::of([x / 0.6, y, 0.0])
        }));
        for at in 1..SEGMENTS {
            let steps = [x[at] - x[at - 1], z[at] - z[at - 1], flat[at] - flat[at - 1]];
            let errors = [steps[0] - 0.48, steps[1] - 0.64, steps[2] - 0.8];
            assert!(errors.iter().all(|error| error.abs() < 1e-9), "{steps:?}");
        }
    }

    #[test]
    fn noise_across_a_stem_does_not_lengthen_it() {
        let noise = NoiseStream::new(2, Purpose::Trial, [0; 3]);
        let noisy = |number: u32| -> Stem<1> {
            core::array::from_fn(|at| Place {
                aside: [0.1 * noise.at(number * 10 + at as u32).normal()],
                up: at as f64,
            })
        };
        let stems: Vec<Stem<1>> = (0..200).map(noisy).collect();
        let modes = Modes::of((0..100).map(|number| [0.01 * (f64::from(number) - 50.0); SEGMENTS]));
        let length_cm = mean(stems.iter().map(|stem| modes.length_cm(stem)));
        let segment = |pair: &[Place<1>]| {
            let part = pair[1] - pair[0];
            hypot(part.aside[0], part.up)
        };
        let longer = mean(stems.iter().map(|stem| stem.windows(2).map(segment).sum::<f64>()));
        assert!((length_cm - 9.0).abs() < 0.05 && longer > 9.07, "{length_cm} {longer}");
    }
}
