//! A second camera at the side of the plant: with it, tip and stem are known in space.
//!
//! In: what the front camera's tracker saw, and a photograph from the side of the same moment. Out: one observation in space.
//! Where the side camera has no tip, or another part of the plant, the last known depth is carried forward.

use std::fmt;

use super::{Camera, RigError};
use crate::geometry::path::resampled;
use crate::geometry::space::SpacePoint;
use crate::geometry::{Point, Polyline, STEM_POINTS};
use crate::observation::{Depth, Observation, Quality};
use crate::photo::Photo;
use crate::vision::camera::stereo::{MAX_RAY_GAP_CM, StereoPair};
use crate::vision::{Frame, TipTracker, TrackedFrame};

/// Greatest distance between the rays to the tips of both cameras, in cm. Beyond, they are not the same part of the plant.
/// Chosen by hand: the width of a young leaf.
const MAX_TIP_GAP_CM: f64 = 1.0;

/// A camera at the side, and what reads its photographs.
pub struct SideView {
    camera: Box<dyn Camera>,
    tracker: TipTracker,
    views: StereoPair,
    /// The photograph of the next step, once it is taken.
    frame: Option<Frame>,
    /// Why the camera gave none.
    problem: Option<RigError>,
    /// Last known tip in space, in cm.
    tip: Option<SpacePoint>,
    /// Last stem in space, seen from the front, and its depths in cm.
    stem: Option<(Polyline, Vec<f64>)>,
}

impl fmt::Debug for SideView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SideView").field("views", &self.views).field("tip", &self.tip).finish_non_exhaustive()
    }
}

/// What the camera at the side saw at a step, and what both cameras know together.
#[derive(Clone, Debug, PartialEq)]
pub struct SideShot {
    /// The photograph; without bytes if the camera gave none.
    pub photo: Photo,
    /// What was seen in it.
    pub seen: TrackedFrame,
    /// Tip and stem in space.
    pub observation: Observation,
}

impl SideView {
    /// A camera whose photographs `tracker` reads, and how it stands to the one in front.
    #[must_use]
    pub fn new(camera: Box<dyn Camera>, tracker: TipTracker, views: StereoPair) -> Self {
        Self { camera, tracker, views, frame: None, problem: None, tip: None, stem: None }
    }

    /// What reads its photographs.
    #[must_use]
    pub const fn tracker(&self) -> &TipTracker {
        &self.tracker
    }

    /// Why the camera gave no photograph of the next step; `None` if it gave one.
    #[must_use]
    pub const fn problem(&self) -> Option<&RigError> {
        self.problem.as_ref()
    }

    /// Takes the photograph of a step. If the camera fails, a file without bytes stands for it.
    pub(super) fn photograph(&mut self, name: &str, time_s: f64) {
        let (bytes, problem) = match self.camera.photograph() {
            Ok(photo) => (photo.bytes, None),
            Err(error) => (Vec::new(), Some(error)),
        };
        self.problem = problem;
        self.frame = Some(Frame::new(Photo { name: name.to_owned(), bytes, time_s }));
    }

    /// Reads the photograph of a step at which the front camera saw `front`. Where none was taken, a file without bytes
    /// stands for it.
    pub(super) fn see(&mut self, front: &Observation, name: &str, time_s: f64) -> SideShot {
        let none = || Frame::new(Photo { name: name.to_owned(), bytes: Vec::new(), time_s });
        let frame = self.frame.take().unwrap_or_else(none);
        let seen = self.tracker.observe(&frame);
        let observation = if self.tracker.has_poles() {
            self.among_poles(front, &seen)
        } else {
            self.in_space(front, &seen)
        };
        SideShot { photo: frame.photo().clone(), seen, observation }
    }

    /// Takes in a recorded step.
    pub(super) fn resume(&mut self, shot: &SideShot) {
        self.tracker.resume(&shot.photo, &shot.seen);
        self.camera.skip();
        self.frame = None;
        let Observation { tip, stem, depth: Some(depth), .. } = &shot.observation else { return };
        self.tip = Some([tip.x, tip.y, depth.tip_cm]);
        if let Some(stem) = stem.as_ref().filter(|_| !depth.stem_cm.is_empty()) {
            self.stem = Some((stem.clone(), depth.stem_cm.clone()));
        }
    }

    /// What both cameras know together.
    fn in_space(&mut self, front: &Observation, side: &TrackedFrame) -> Observation {
        let other =
            side.observation.as_ref().filter(|_| front.quality == Quality::Measured && side.is_measured());
        let found = other.map(|other| self.views.triangulate(front.tip, other.tip));
        let found = found.filter(|found| found.gap_cm <= MAX_TIP_GAP_CM);
        let tip = match (found, self.tip) {
            (Some(found), _) => found.point,
            (None, Some([.., z])) => self.views.front_at(front.tip, z),
            (None, None) => return front.clone(),
        };
        self.tip = Some(tip);
        let stems = front.stem.as_ref().zip(other.and_then(|other| other.stem.as_ref()));
        let stem = stems.and_then(|(front, side)| self.stem_in_space(front, side));
        in_plane(front, tip, stem, front.quality)
    }

    /// What both cameras know together where a pole may hide the tip from one of them: that one holds its coordinate, and the
    /// other goes on. Where both see a top, and not the same, the higher one is the tip. The stem is carried forward unless both see it.
    fn among_poles(&mut self, front: &Observation, side: &TrackedFrame) -> Observation {
        let has_front = front.quality == Quality::Measured;
        let other = side.observation.as_ref().filter(|_| side.is_measured());
        let found = other.filter(|_| has_front).map(|other| self.views.triangulate(front.tip, other.tip));
        let found = found.filter(|found| found.gap_cm <= MAX_TIP_GAP_CM);
        let [x, _, z] = self.tip.unwrap_or([front.tip.x, front.tip.y, 0.0]);
        let by_front = (has_front && self.tip.is_some()).then(|| self.views.front_at(front.tip, z));
        let by_side = other.map(|other| self.views.side_at(other.tip, x));
        let (tip, quality) = match (found, by_front, by_side) {
            (Some(found), ..) => (found.point, Quality::Measured),
            (None, Some(front), Some(side)) if front[1] >= side[1] => (front, Quality::Measured),
            (None, _, Some(side)) => (side, Quality::CarriedForward),
            (None, Some(front), None) => (front, Quality::Measured),
            (None, None, None) => match self.tip {
                Some(tip) => (tip, front.quality),
                None => return front.clone(),
            },
        };
        self.tip = Some(tip);
        let stems = front.stem.as_ref().zip(other.and_then(|other| other.stem.as_ref()));
        let stem =
            stems.filter(|_| found.is_some()).and_then(|(front, side)| self.stem_in_space(front, side));
        self.stem = stem.or_else(|| self.stem.take());
        in_plane(front, tip, self.stem.clone(), quality)
    }

    /// Ten points of the stem as seen from the front, and their depths in cm; `None` where the cameras see different ends of it.
    fn stem_in_space(&self, front: &Polyline, side: &Polyline) -> Option<(Polyline, Vec<f64>)> {
        let ends = self.views.triangulate(*front.0.last()?, *side.0.last()?);
        if ends.gap_cm > MAX_RAY_GAP_CM {
            return None;
        }
        let points = resampled(&self.views.triangulate_midline(front, side), STEM_POINTS);
        let plane = || points.iter().map(|&[x, y, _]| Point::new(x, y)).collect();
        let depths = || points.iter().map(|point| point[2]).collect();
        (points.len() == STEM_POINTS).then(|| (Polyline(plane()), depths()))
    }
}

/// The observation of a tip and of a stem with its depths; without them the stem is what the camera in front sees.
fn in_plane(
    front: &Observation,
    [x, y, z]: SpacePoint,
    stem: Option<(Polyline, Vec<f64>)>,
    quality: Quality,
) -> Observation {
    let (stem, stem_cm) =
        stem.map_or_else(|| (front.stem.clone(), Vec::new()), |(stem, depths)| (Some(stem), depths));
    Observation { tip: Point::new(x, y), stem, depth: Some(Depth { tip_cm: z, stem_cm }), quality }
}
