//! Plants that a user clicked: their points in each photograph, by the flow between the clicks.
//!
//! In: clicks on tip, node and root in some photographs. Out: a place and a confidence for each photograph. Photographs are
//! read twice, once in each direction of time, so a series of any length needs the same memory.

use std::sync::Arc;

use rayon::prelude::*;
use tropism::geometry::{Pixel, Polyline, STEM_POINTS};
use tropism::observation::{Observation, Quality};
use tropism::vision::detect::learned_stem::{KnownEnds, LearnedLine, LearnedStem};
use tropism::vision::raster::source::PixelSource;
use tropism::vision::tracking::clicks::{
    Click, ClickFollower, FollowedPlace, LEAST_CONFIDENCE, agreement, blend, tolerance,
};
use tropism::vision::tracking::flow::Pyramid;
use tropism::vision::{Calibration, Detection, FrameStatus, TrackedFrame};

use super::clicks::PlantClick;
use super::plants::{Plant, PlantPlan};
use super::series::Series;
use super::table::StemConfidence;
use crate::{Error, Monitor};

/// Photographs whose pictures are in memory at the same time.
const BATCH: usize = 32;

/// The clicked points of one plant in each photograph.
pub(super) struct ClickedPlant {
    calibration: Calibration,
    /// Distance up to which a place counts as right, in pixels.
    tolerance: f64,
    tip: Vec<Option<FollowedPlace>>,
    node: Option<Vec<Option<FollowedPlace>>>,
    /// `None` where the root is clicked once or not at all: it stands still.
    root: Option<Vec<Option<FollowedPlace>>>,
    /// What the stem looks like; `None` where the root was not clicked, or nothing can be learned.
    stem: Option<LearnedStem>,
    /// Latest measured tip and its confidence.
    last: Option<Observation>,
}

/// Checks that no photograph has two clicks on one point.
fn check_once(clicks: &[Click], series: &Series) -> Result<(), Error> {
    for (number, click) in clicks.iter().enumerate() {
        if let Some(other) = clicks[..number].iter().find(|other| other.frame == click.frame) {
            return Err(Error::Plan(format!(
                "{}: found two clicks on the same point, at {},{} and {},{}: give one of them",
                series.frames[click.frame].path.display(),
                other.at.x,
                other.at.y,
                click.at.x,
                click.at.y
            )));
        }
    }
    Ok(())
}

/// Follows the clicked points of all plants; `None` for a plant without a click on its tip.
pub(super) fn follow(
    plans: &[PlantPlan],
    plants: &[Plant],
    series: &Series,
    monitor: &dyn Monitor,
) -> Result<Vec<Option<ClickedPlant>>, Error> {
    let (mut points, mut heights_px) = (Vec::new(), Vec::new());
    for (plan, plant) in plans.iter().zip(plants) {
        let size = (plant.calibration.width, plant.calibration.height);
        for clicks in [&plan.clicks.tip, &plan.clicks.node, &plan.clicks.root] {
            let clicks = clicks.iter().map(|click| click.resolve(&series.frames, size));
            let clicks = clicks.collect::<Result<Vec<Click>, Error>>()?;
            check_once(&clicks, series)?;
            points.push(clicks);
        }
        let height = |click: &PlantClick| click.at().distance(plant.calibration.base);
        let tallest = plan.clicks.tip.iter().map(height).fold(0.0, f64::max);
        heights_px.extend([tallest; 3]);
    }
    if points.iter().all(Vec::is_empty) {
        return Ok(plans.iter().map(|_| None).collect());
    }
    monitor.stage("follow clicks", 2 * series.frames.len() as u64);
    let order: Vec<usize> = (0..series.frames.len()).collect();
    let forward = flow(&points, &heights_px, &order, series, monitor)?;
    let reversed: Vec<usize> = order.iter().rev().copied().collect();
    let mut backward = flow(&points, &heights_px, &reversed, series, monitor)?;
    backward.iter_mut().for_each(|places| places.reverse());
    let clicked = |index: usize| {
        let calibration = plants[index].calibration;
        let tolerance = tolerance(heights_px[3 * index]);
        let place = |point: usize| {
            let at = 3 * index + point;
            (!points[at].is_empty()).then(|| blend(&points[at], &forward[at], &backward[at], tolerance))
        };
        let root = place(2).filter(|_| points[3 * index + 2].len() > 1);
        let mut plant = ClickedPlant {
            calibration,
            tolerance,
            tip: place(0)?,
            node: place(1),
            root,
            stem: None,
            last: None,
        };
        plant.learn(&points[3 * index], series);
        Some(plant)
    };
    Ok((0..plants.len()).map(clicked).collect())
}

/// The places of all points in all photographs, followed in an order: one list a point, in this order.
fn flow(
    points: &[Vec<Click>],
    heights_px: &[f64],
    order: &[usize],
    series: &Series,
    monitor: &dyn Monitor,
) -> Result<Vec<Vec<Option<Pixel>>>, Error> {
    let mut follower = ClickFollower::new(points, heights_px);
    let mut places = vec![Vec::with_capacity(order.len()); points.len()];
    for batch in order.chunks(BATCH) {
        let read = |&index: &usize| {
            let frame = &series.frames[index];
            let picture = frame.picture()?;
            Some(Arc::new(Pyramid::of(&picture)))
        };
        let pictures: Vec<Option<Arc<Pyramid>>> = batch.par_iter().map(read).collect();
        for (&index, picture) in batch.iter().zip(&pictures) {
            let next = follower.next(index, picture.as_ref());
            places.iter_mut().zip(next).for_each(|(places, place)| places.push(place));
        }
        monitor.advance(batch.len() as u64);
        if !monitor.may_go_on() {
            return Err(Error::cancelled());
        }
    }
    Ok(places)
}

impl ClickedPlant {
    /// Learns what the stem looks like from the photographs in which the tip is clicked.
    fn learn(&mut self, clicks: &[Click], series: &Series) {
        let open = |click: &Click| {
            let root = self.root_at(click.frame, None)?;
            Some((series.frames[click.frame].picture()?, root, click.at))
        };
        let pictures: Vec<_> = clicks.iter().filter_map(open).collect();
        let known: Vec<KnownEnds<'_>> = pictures
            .iter()
            .map(|(picture, root, tip)| KnownEnds { picture, root: *root, tip: *tip })
            .collect();
        self.stem = LearnedStem::learn(&known);
    }

    /// Where the root is in photograph `index`, whose picture is shifted by `registered`; `None` where it moves and is lost.
    fn root_at(&self, index: usize, registered: Option<Pixel>) -> Option<Pixel> {
        match &self.root {
            Some(root) => Some(root[index].filter(|root| root.confidence >= LEAST_CONFIDENCE)?.at),
            None => Some(self.calibration.base + registered.unwrap_or_default()),
        }
    }

    /// The midline of the stem in the picture of photograph `index`; `None` where an end of it is not known.
    pub(super) fn line(
        &self,
        index: usize,
        picture: &dyn PixelSource,
        registered: Option<Pixel>,
    ) -> Option<LearnedLine> {
        let known = |places: &[Option<FollowedPlace>]| {
            Some(places[index].filter(|place| place.confidence >= LEAST_CONFIDENCE)?.at)
        };
        let tip = known(&self.tip)?;
        let end = self.node.as_ref().map_or(Some(tip), |node| known(node))?;
        self.stem.as_ref()?.line(KnownEnds { picture, root: self.root_at(index, registered)?, tip }, end)
    }

    /// The detection, the track, and the confidence of the stem in photograph `index`. What the rules `detected` there is a second
    /// witness of the tip, and gives the stem where both agree; elsewhere it is the learned `line`.
    pub(super) fn update(
        &mut self,
        index: usize,
        detected: Result<&Detection, FrameStatus>,
        line: Option<&LearnedLine>,
    ) -> (Option<Detection>, TrackedFrame, StemConfidence) {
        let known = |places: &Option<Vec<Option<FollowedPlace>>>| {
            let place = places.as_ref()?[index];
            place.filter(|place| place.confidence >= LEAST_CONFIDENCE)
        };
        let moved = known(&self.root).map(|root| root.at - self.calibration.base);
        let registered = detected.ok().map(|detection| detection.camera_shift);
        let shift = moved.or(registered).unwrap_or_default();
        let is_seen = match detected {
            Ok(_) => true,
            Err(status) => {
                ![FrameStatus::Corrupt, FrameStatus::Foreign, FrameStatus::Repeated].contains(&status)
            }
        };
        let witness = |place: FollowedPlace| {
            let agreed = detected.map_or(0.0, |one| agreement(one.tip, place.at, self.tolerance));
            FollowedPlace { confidence: place.confidence.max(agreed), ..place }
        };
        let tip = self.tip[index].filter(|_| is_seen).map(witness);
        let confidence = tip.map_or(0.0, |tip| tip.confidence);
        let Some(tip) = tip.filter(|tip| tip.confidence >= LEAST_CONFIDENCE) else {
            let status =
                if is_seen { FrameStatus::Ambiguous } else { detected.err().unwrap_or(FrameStatus::NoPlant) };
            let observation =
                self.last.clone().map(|last| Observation { quality: Quality::CarriedForward, ..last });
            let tracked = TrackedFrame { observation, tip_px: None, status, confidence, camera_shift: moved };
            return (None, tracked, StemConfidence::default());
        };
        let stem = detected.ok().and_then(|detection| match (known(&self.node), &self.node) {
            (Some(node), _) => ended_at(detection.stem.as_deref()?, node.at, self.tolerance),
            (None, Some(_)) => None,
            (None, None) => {
                let is_agreed = agreement(detection.tip, tip.at, self.tolerance) > 0.0;
                detection.stem.clone().filter(|_| is_agreed)
            }
        });
        let learned = line.filter(|line| stem.is_none() && line.confidence >= LEAST_CONFIDENCE);
        let end = known(&self.node).map(|node| node.confidence);
        // A learned line without a node ends at the tip, whatever the stem does.
        let stem_confidence = StemConfidence {
            end,
            length: learned.map(|line| line.confidence.min(end.unwrap_or(tip.confidence))).or(end),
        };
        let apex = known(&self.node).map(|node| node.at).or_else(|| stem.as_ref()?.last().copied());
        let stem = stem.or_else(|| Some(learned?.line.clone()));
        let point = |pixel: Pixel| self.calibration.point(pixel - shift);
        let polyline = stem.as_ref().map(|stem| Polyline(stem.iter().copied().map(point).collect()));
        let observation = Observation {
            tip: point(tip.at),
            stem: polyline.map(|stem| stem.resampled(STEM_POINTS)),
            depth: None,
            quality: Quality::Measured,
        };
        self.last = Some(observation.clone());
        let detection = Detection { tip: tip.at, apex, stem, camera_shift: shift, ..Detection::default() };
        let tracked = TrackedFrame {
            observation: Some(observation),
            tip_px: Some(tip.at),
            status: FrameStatus::Ok,
            confidence,
            camera_shift: moved.or(registered),
        };
        (Some(detection), tracked, stem_confidence)
    }
}

/// A stem up to the point that is nearest to `node`, and the node; `None` where it does not pass within `tolerance` of it.
fn ended_at(stem: &[Pixel], node: Pixel, tolerance: f64) -> Option<Vec<Pixel>> {
    let distances = stem.iter().map(|at| at.distance(node)).enumerate();
    let (nearest, distance) = distances.min_by(|one, other| one.1.total_cmp(&other.1))?;
    (distance <= tolerance && nearest > 0).then(|| stem[..nearest].iter().copied().chain([node]).collect())
}
