//! Contact of a simulated stem in space with poles.
//!
//! In: the tilts of a stem before a step, and those that the model wants after it. Out: tilts with which no part of the stem lies
//! within a pole. The idea: friction holds a stem that winds. Where the model would move the stem into a pole, it presses on the
//! pole and sticks. Up to the topmost such place the stem keeps its form. Then the deepest point within a pole is pushed to the
//! surface by the least change of the tilts, again and again (a Gauss-Newton step each).

use super::shape::{Angles, Place, SEGMENTS, Stem, size, stem_of};
use crate::math::sin_cos;
use crate::math::vector::{dot, normalize_or};
use crate::obstacle::{Pole, Solid};

/// Radius of a stem, in cm: that of [`Obstacles`](crate::task::Obstacles).
const STEM_RADIUS_CM: f64 = 0.15;

/// How deep a point may stay within a pole, in cm, and after how many pushes the stem is left as it is. Chosen by hand: less than a
/// tenth of the noise with which stems are seen.
const TOLERANCE_CM: f64 = 0.002;
const MOST_PUSHES: u32 = 30;

/// The poles among `solids`, each as thick as the midline of a stem from `base` keeps away from its axis. A pole that stands nearer
/// to the base than the radius of the stem is no hindrance there. In the plane of the front camera there are none.
pub(super) fn poles_among<const AXES: usize>(solids: &[Solid], base: Place<AXES>) -> Vec<Pole> {
    let kept_from = |solid: &Solid| match *solid {
        Solid::Pole(pole) if AXES == 2 => {
            let clearance_cm = size(from_axis(&pole, base)) - pole.radius_cm;
            Some(Pole { radius_cm: pole.radius_cm + clearance_cm.min(STEM_RADIUS_CM), ..pole })
        }
        _ => None,
    };
    solids.iter().filter_map(kept_from).collect()
}

/// From the axis of a pole to a place, along the axes.
fn from_axis<const AXES: usize>(pole: &Pole, place: Place<AXES>) -> [f64; AXES] {
    core::array::from_fn(|axis| place.aside[axis] - pole.at[axis])
}

/// The tilts and the length of a stem, in cm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bent<const AXES: usize> {
    pub(super) tilts: [Angles; AXES],
    pub(super) length_cm: f64,
}

impl<const AXES: usize> Bent<AXES> {
    fn stem(&self, base: Place<AXES>) -> Stem<AXES> {
        stem_of(base, self.tilts, self.length_cm)
    }
}

/// The point of a segment that is nearest to the axis of a pole, where it lies within the pole.
#[derive(Clone, Copy, Debug)]
struct Touch<const AXES: usize> {
    segment: usize,
    /// Where in the segment, from 0 at its lower end to 1.
    share: f64,
    /// How far it lies within the pole, in cm.
    depth_cm: f64,
    /// The direction from the axis of the pole.
    away: [f64; AXES],
}

impl<const AXES: usize> Touch<AXES> {
    fn of(pole: &Pole, stem: &Stem<AXES>, segment: usize) -> Option<Self> {
        let way = stem[segment + 1] - stem[segment];
        let square = dot(way.aside, way.aside);
        let from = from_axis(pole, stem[segment]);
        let share = if square > 0.0 { -dot(way.aside, from) / square } else { 0.0 }.clamp(0.0, 1.0);
        let at = stem[segment] + way.scaled(share);
        let out = from_axis(pole, at);
        let depth_cm = pole.radius_cm - size(out);
        let away = normalize_or(out, core::array::from_fn(|axis| if axis + 1 == AXES { 1.0 } else { 0.0 }));
        (depth_cm > 0.0 && at.up < pole.height_cm).then_some(Self { segment, share, depth_cm, away })
    }

    /// By how much its depth falls for each rad of the tilts along each axis.
    fn slopes(&self, Bent { tilts, length_cm }: &Bent<AXES>) -> [Angles; AXES] {
        let mut slopes = [[0.0; SEGMENTS]; AXES];
        for segment in 0..=self.segment {
            let part = if segment == self.segment { self.share } else { 1.0 };
            let tilt = tilts.map(|tilts| tilts[segment]);
            let angle = size(tilt);
            let (sin, cos) = sin_cos(angle);
            // The horizontal part of a segment is sin(angle) / angle times its tilt.
            let (share, bend) = if angle > 1e-4 {
                (sin / angle, (cos - sin / angle) / (angle * angle))
            } else {
                (1.0, -1.0 / 3.0)
            };
            let bend = bend * dot(self.away, tilt);
            for axis in 0..AXES {
                let slope = share * self.away[axis] + bend * tilt[axis];
                slopes[axis][segment] = part * length_cm / SEGMENTS as f64 * slope;
            }
        }
        slopes
    }
}

/// Where a stem lies within poles.
fn touches<'p, const AXES: usize>(
    poles: &'p [Pole],
    stem: &Stem<AXES>,
) -> impl Iterator<Item = Touch<AXES>> + use<'p, AXES> {
    let stem = *stem;
    poles
        .iter()
        .flat_map(move |pole| (0..SEGMENTS).filter_map(move |segment| Touch::of(pole, &stem, segment)))
}

/// The tilts of a stem from `base` that was bent as `before` and that the model wants to be bent as `wanted`; `None` where it touches
/// none of the poles.
pub(super) fn resolved<const AXES: usize>(
    poles: &[Pole],
    base: Place<AXES>,
    before: &Bent<AXES>,
    wanted: &Bent<AXES>,
) -> Option<[Angles; AXES]> {
    // A segment of which more than half lies below the touch is held, too.
    let held = |touch: Touch<AXES>| touch.segment + usize::from(touch.share > 0.5);
    let held = touches(poles, &wanted.stem(base)).map(held).max()?;
    let mut bent = *wanted;
    for (tilts, before_tilts) in bent.tilts.iter_mut().zip(&before.tilts) {
        let kept = kept(before_tilts, wanted.length_cm / before.length_cm);
        tilts[..held].copy_from_slice(&kept[..held]);
    }
    for _ in 0..MOST_PUSHES {
        let deepest =
            touches(poles, &bent.stem(base)).max_by(|one, other| one.depth_cm.total_cmp(&other.depth_cm));
        let Some(touch) = deepest.filter(|touch| touch.depth_cm > TOLERANCE_CM) else { break };
        let slopes = touch.slopes(&bent);
        let square: f64 = slopes.iter().map(|slopes| dot(*slopes, *slopes)).sum();
        if square == 0.0 {
            break;
        }
        for (tilts, slopes) in bent.tilts.iter_mut().zip(slopes) {
            for (tilt, slope) in tilts.iter_mut().zip(slopes) {
                *tilt += touch.depth_cm / square * slope;
            }
        }
    }
    Some(bent.tilts)
}

/// The tilts of a stem that has become `growth` times as long at its end: what grew there tilts as the last segment.
fn kept(tilts: &[f64; SEGMENTS], growth: f64) -> [f64; SEGMENTS] {
    core::array::from_fn(|segment| {
        // Its ends, in segments of the stem before.
        let (from, to) = (segment as f64 * growth, (segment + 1) as f64 * growth);
        let overlap = |at: usize| {
            let end = if at + 1 == SEGMENTS { f64::INFINITY } else { (at + 1) as f64 };
            (to.min(end) - from.max(at as f64)).max(0.0)
        };
        (0..SEGMENTS).map(|at| overlap(at) * tilts[at]).sum::<f64>() / (to - from)
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math::vector::{add, scale};

    fn tilts() -> impl Strategy<Value = [Angles; 2]> {
        [prop::array::uniform9(-0.8..0.8), prop::array::uniform9(-0.8..0.8)]
    }

    proptest! {
        #[test]
        fn a_stem_that_moves_a_little_ends_outside(
            before in tilts(), moved in tilts(), at in [-4.0..4.0, -4.0..4.0], radius_cm in 0.5..1.5,
        ) {
            let base = Place::<2>::of([0.1, 0.0, -0.1]);
            let poles = poles_among(&[Pole { at, radius_cm, height_cm: 99.0 }.into()], base);
            let depth = |tilts: &[Angles; 2]| {
                let depths = touches(&poles, &stem_of(base, *tilts, 12.0)).map(|touch| touch.depth_cm);
                depths.fold(0.0, f64::max)
            };
            prop_assume!(depth(&before) == 0.0);
            let wanted = [0, 1].map(|axis: usize| add(before[axis], scale(moved[axis], 0.05)));
            let [before, wanted] = [before, wanted].map(|tilts| Bent { tilts, length_cm: 12.0 });
            match resolved(&poles, base, &before, &wanted) {
                Some(tilts) => prop_assert!(depth(&tilts) <= TOLERANCE_CM, "{}", depth(&tilts)),
                None => prop_assert_eq!(depth(&wanted.tilts), 0.0),
            }
        }

        #[test]
        fn slopes_are_those_of_the_depth(tilts in tilts(), segment in 0..SEGMENTS) {
            let bent = Bent { tilts, length_cm: 12.0 };
            let stem = |tilts: &[Angles; 2]| stem_of(Place::of([0.0; 3]), *tilts, 12.0);
            let end = stem(&tilts)[segment + 1].in_space();
            let pole = Pole { at: [end[0] + 0.3, end[2] - 0.4], radius_cm: 1.0, height_cm: 99.0 };
            let far = |tilts: &[Angles; 2]| pole.distance(stem(tilts)[segment + 1].in_space());
            let touch = Touch { segment, share: 1.0, depth_cm: 0.5, away: [-0.6, 0.8] };
            let slopes = touch.slopes(&bent);
            for axis in 0..2 {
                for at in 0..SEGMENTS {
                    let mut moved = tilts;
                    moved[axis][at] += 1e-6;
                    prop_assert!(((far(&moved) - far(&tilts)) / 1e-6 - slopes[axis][at]).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn what_is_kept_stays_where_it_is() {
        let tilts = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
        assert_eq!(kept(&tilts, 1.0), tilts);
        let longer = kept(&tilts, 1.5);
        // The second segment of the longer stem lies from 1.5 to 3 of the old one's.
        let errors = [longer[1] - (0.5 * 0.1 + 0.2) / 1.5, longer[8] - 0.8];
        assert!(errors.iter().all(|error| error.abs() < 1e-12), "{longer:?}");
    }
}
