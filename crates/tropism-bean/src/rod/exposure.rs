//! Exposure: the share of each lamp's light that cones and shadows leave at a place.
//!
//! It is found in the middle of each segment at the beginning of a tick, and held over it: a stem moves by millimetres
//! meanwhile, cones and shadows extend over centimetres. Shadows are sharp, as those of a point source.

use tropism::lamps::MAX_LAMPS;
use tropism::math::vector::{Vec3, along, between, norm, scale, sub};
use tropism::obstacle::Solid;

use super::{Forcing, Rod};
use crate::solid;

/// Least advance along a ray, in cm. Chosen: less than the thinnest pole.
const LEAST_ADVANCE_CM: f64 = 0.05;
/// Solids cast no shadow on what is nearer than this, in cm: the stem itself lies on them. Chosen: more than its radius.
const OWN_CM: f64 = 0.25;

/// Whether a lit lamp has a cone, or solids cast shadows.
pub(super) fn is_limited(forcing: &Forcing) -> bool {
    forcing.is_shaded || forcing.lit().any(|number| forcing.beams[number].is_some())
}

/// The middles of the segments, base first, and then the apex.
pub(super) fn middles(rod: &Rod) -> Vec<Vec3> {
    let mut ends = Vec::with_capacity(rod.count() + 1);
    rod.for_each_section(|section| ends.push(section.at));
    let middles = ends.windows(2).map(|pair| between(pair[0], pair[1], 0.5));
    middles.chain(ends.last().copied()).collect()
}

/// Exposure of `place` to the lit lamps, in their order; 1 for places without a lamp.
pub(super) fn shares(rod: &Rod, forcing: &Forcing, place: Vec3) -> [f64; MAX_LAMPS] {
    let solids =
        rod.contact.as_ref().filter(|_| forcing.is_shaded).map_or(&[][..], |contact| &contact.solids);
    let mut shares = [1.0; MAX_LAMPS];
    for (share, number) in shares.iter_mut().zip(forcing.lit()) {
        let lamp = forcing.lamps[number];
        let cone = forcing.beams[number].map_or(1.0, |beam| beam.share(lamp, place));
        let is_dark = solids.iter().any(|solid| casts_shadow(solid, lamp, place));
        *share = if is_dark { 0.0 } else { cone };
    }
    shares
}

/// Whether `solid` stands between a lamp and a place: sphere tracing along the ray (Hart 1996, doi:10.1007/s003710050084).
fn casts_shadow(solid: &Solid, lamp: Vec3, place: Vec3) -> bool {
    let ray = sub(lamp, place);
    let far = norm(ray);
    let mut at = OWN_CM;
    while at < far {
        let (distance, _) = solid::distance(solid, along(place, scale(ray, 1.0 / far), at));
        if distance <= 0.0 {
            return true;
        }
        at += distance.max(LEAST_ADVANCE_CM);
    }
    false
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tropism::obstacle::Pole;

    use super::*;

    proptest! {
        /// Against the geometry of a circle: the ray passes the axis of a high pole at a known distance.
        #[test]
        fn a_pole_shades_what_lies_behind_it(x in -5.0..5.0, y in 1.0..20.0, radius_cm in 0.2..2.0) {
            let pole: Solid = Pole { at: [x, 10.0], radius_cm, height_cm: 100.0 }.into();
            // A ray along z at x = 0.
            let is_dark = casts_shadow(&pole, [0.0, y, 20.0], [0.0, y, 0.0]);
            prop_assume!((x.abs() - radius_cm).abs() > 0.02);
            prop_assert_eq!(is_dark, x.abs() < radius_cm);
            prop_assert!(!casts_shadow(&pole, [0.0, y, 5.0], [0.0, y, 0.0]), "the pole stands behind the lamp");
        }
    }
}
