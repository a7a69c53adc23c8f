//! Ground truth of a photograph, for the evaluation of vision. Never read by vision.

use serde::{Deserialize, Serialize};
use tropism::geometry::{Point, Polyline};

use super::body::{Body, midline};
use crate::pose::Pose;
use crate::view::{Frame, project};

/// Ground truth of the plant in a photograph, in cm of the plane of the pot's axis, to the micrometre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// The highest point of stem, leaves and cotyledons as the camera sees them.
    pub top: Point,
    /// The shoot apex.
    pub apex: Point,
    /// The middle of the stem from the base to the apex, about a millimetre apart.
    pub midline: Polyline,
    /// The edges of the primary leaves' blades.
    pub leaves: [Polyline; 2],
    /// Pixels per cm in the plane of the pot's axis.
    pub px_per_cm: f64,
}

/// Ground truth of the photograph of `pose`.
///
/// # Panics
/// If the stem has no nodes.
#[must_use]
pub fn truth(pose: &Pose, frame: Frame) -> Truth {
    let body = Body::new(pose);
    let edge = |which: usize| {
        let [one, other] = &body.leaves[which].halves;
        Polyline(one.iter().chain(other.iter().rev()).map(|&place| rounded(project(place))).collect())
    };
    Truth {
        top: body.top(),
        apex: project(pose.apex()),
        midline: Polyline(midline(&body.stem).into_iter().map(rounded).collect()),
        leaves: [edge(0), edge(1)],
        px_per_cm: frame.px_per_cm,
    }
}

/// A point to the micrometre, so that files stay small.
fn rounded(point: Point) -> Point {
    Point::new((point.x * 1e4).round() / 1e4, (point.y * 1e4).round() / 1e4)
}
