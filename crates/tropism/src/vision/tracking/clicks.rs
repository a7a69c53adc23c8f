//! A point of a plant through a series of photographs, from a few clicks of a user and the flow between them.
//!
//! In: the clicks, and the pictures in the order of their times. Out: a place and a confidence for each picture. The one
//! idea: between two clicks the point is followed from both; where both ways meet the flow is right, and where they differ
//! another click helps. In a run, where no later photograph is known yet, the usual detection is the second witness.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::geometry::Pixel;
use crate::vision::error::VisionError;
use crate::vision::tracking::flow::{FollowedPoint, Pyramid};

/// Distance up to which a place counts as right, in pixels and as a share of the plant's height: whichever is more. Both as in
/// the sketch of this method: a user clicks with a deviation of some 2.5 pixels.
const TOLERANCE_PX: f64 = 5.0;
const TOLERANCE_SHARE: f64 = 0.02;

/// Confidence where the two ways agree within a tolerance. Chosen on the first halves of `scripts/score-clicks`.
const AGREED: f64 = 0.95;

/// Confidence right beside a click with flow from one side only, and photographs after which it is half of that.
const ONE_SIDED: f64 = 0.85;
const HALF_LIFE: f64 = 150.0;

/// Factor of the confidence from photograph to photograph of a run, as long as nothing confirms the flow. Chosen: after 105
/// photographs it is 0.5, as with [`HALF_LIFE`].
const UNCONFIRMED: f64 = 0.995;

/// Tolerances by which a point of a run may move from photograph to photograph where nothing confirms the flow. Chosen: two
/// witnesses so far apart do not agree. What flies past the tip may take the flow with it across the picture.
const MOST_MOTION: f64 = 3.0;

/// Confidence from which on a place is an answer. Chosen: even odds.
pub const LEAST_CONFIDENCE: f64 = 0.5;

/// A click on a point of the plant.
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Click {
    /// Index of the photograph in the series, from 0.
    pub frame: usize,
    /// The point there.
    pub at: Pixel,
}

/// Checks that clicks lie inside of pictures of a size.
///
/// # Errors
/// [`VisionError`] names the first that does not.
pub fn check(clicks: &[Click], (width, height): (usize, usize)) -> Result<(), VisionError> {
    let is_inside = |at: f64, size: usize| (-0.5..size as f64 - 0.5).contains(&at);
    let outside = clicks.iter().find(|Click { at, .. }| !is_inside(at.x, width) || !is_inside(at.y, height));
    let found =
        outside.map_or(String::new(), |Click { at, .. }| format!("{},{} in {width} x {height}", at.x, at.y));
    VisionError::check_value("clicks", found, outside.is_none(), "pixels inside of the photographs")
}

/// Where a point is in one photograph.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FollowedPlace {
    /// The place, in pixels.
    pub at: Pixel,
    /// How sure it is, 0 to 1.
    pub confidence: f64,
}

/// Distance up to which a place counts as right on a plant of a height in pixels.
#[must_use]
pub fn tolerance(height_px: f64) -> f64 {
    TOLERANCE_PX.max(TOLERANCE_SHARE * height_px)
}

/// Confidence of two witnesses of one place: 0.95 where they agree within a tolerance, and 0 from three times that on.
///
/// With clicks that are off by 2.5 pixels a coordinate, 21 of 23 places between 1.5 and 2 tolerances were right.
#[must_use]
pub fn agreement(one: Pixel, other: Pixel, tolerance: f64) -> f64 {
    AGREED * (1.5 - 0.5 * one.distance(other) / tolerance).clamp(0.0, 1.0)
}

/// Follows points through pictures in one direction; each begins anew at each of its clicks.
#[derive(Debug)]
pub struct ClickFollower<'a> {
    clicks: &'a [Vec<Click>],
    heights_px: &'a [f64],
    points: Vec<Option<FollowedPoint>>,
}

impl<'a> ClickFollower<'a> {
    /// A follower of one point for each list of clicks, on a plant of the height in pixels at the same place in `heights_px`.
    ///
    /// # Panics
    /// If there is not one height a list.
    #[must_use]
    pub fn new(clicks: &'a [Vec<Click>], heights_px: &'a [f64]) -> Self {
        assert_eq!(clicks.len(), heights_px.len(), "one height a point");
        Self { clicks, heights_px, points: vec![None; clicks.len()] }
    }

    /// The places of all points in the next picture, which is photograph `frame`; `None` where a point is lost, or not clicked
    /// yet, or no picture can be read.
    pub fn next(&mut self, frame: usize, picture: Option<&Arc<Pyramid>>) -> Vec<Option<Pixel>> {
        let Some(picture) = picture else { return vec![None; self.points.len()] };
        let follow = |((point, clicks), height_px): ((&mut Option<FollowedPoint>, &Vec<Click>), &f64)| {
            if let Some(click) = clicks.iter().find(|click| click.frame == frame) {
                *point = Some(FollowedPoint::new(Arc::clone(picture), click.at, *height_px));
                return Some(click.at);
            }
            point.as_mut()?.follow(picture)
        };
        self.points.iter_mut().zip(self.clicks).zip(self.heights_px).map(follow).collect()
    }
}

/// The place of a point in each photograph, from its clicks and from the flow `forward` and `backward` in time. `tolerance` is
/// the distance up to which a place counts as right.
///
/// # Panics
/// If the two flows are of different lengths.
#[must_use]
pub fn blend(
    clicks: &[Click],
    forward: &[Option<Pixel>],
    backward: &[Option<Pixel>],
    tolerance: f64,
) -> Vec<Option<FollowedPlace>> {
    assert_eq!(forward.len(), backward.len(), "one place a photograph");
    let place = |frame: usize| {
        let before = clicks.iter().map(|click| click.frame).filter(|&click| click <= frame).max();
        let after = clicks.iter().map(|click| click.frame).filter(|&click| click >= frame).min();
        match (before, after) {
            (Some(before), Some(after)) if before == after => {
                Some(FollowedPlace { at: forward[frame]?, confidence: 1.0 })
            }
            (Some(before), Some(after)) => {
                let (one, other) = (forward[frame]?, backward[frame]?);
                let share = (frame - before) as f64 / (after - before) as f64;
                let at = Pixel::new(one.x + share * (other.x - one.x), one.y + share * (other.y - one.y));
                Some(FollowedPlace { at, confidence: agreement(one, other, tolerance) })
            }
            (Some(click), None) => one_sided(forward[frame]?, frame - click),
            (None, Some(click)) => one_sided(backward[frame]?, click - frame),
            (None, None) => None,
        }
    };
    (0..forward.len()).map(place).collect()
}

/// A clicked point in photographs that are tracked as they are taken.
///
/// All that the next place depends on is the latest photograph that showed the point, its place and its confidence there, so an
/// interrupted run goes on with the same bits: see [`LivePoint::record`].
#[derive(Clone, Debug)]
pub struct LivePoint {
    clicks: Vec<Click>,
    /// Where the stem leaves the soil: the plant's height is the distance from there.
    root: Pixel,
    /// The point in the latest photograph that showed it.
    point: Option<FollowedPoint>,
    confidence: f64,
    /// Clicks in photographs before this one were taken in.
    next_click: usize,
}

impl LivePoint {
    /// The point of a plant with its root at a pixel, clicked in some photographs of a run, which count from 0.
    #[must_use]
    pub const fn new(clicks: Vec<Click>, root: Pixel) -> Self {
        Self { clicks, root, point: None, confidence: 0.0, next_click: 0 }
    }

    /// Follows the point into photograph `frame`, where the usual detection takes `detected` for it. `None` where the point is
    /// lost, or its place is no answer any more.
    pub fn next(
        &mut self,
        frame: usize,
        picture: Option<&Arc<Pyramid>>,
        detected: Option<Pixel>,
    ) -> Option<FollowedPlace> {
        let place = picture.and_then(|picture| self.place(frame, picture, detected));
        self.record(frame, picture, place);
        place
    }

    fn place(&self, frame: usize, picture: &Arc<Pyramid>, detected: Option<Pixel>) -> Option<FollowedPlace> {
        // If the photograph that was to be clicked failed, the next one stands for it.
        let is_next = |click: &&Click| (self.next_click..=frame).contains(&click.frame);
        if let Some(click) = self.clicks.iter().filter(is_next).max_by_key(|click| click.frame) {
            return Some(FollowedPlace { at: click.at, confidence: 1.0 });
        }
        let mut point = self.point.clone()?;
        let before = point.at();
        let followed = point.follow(picture);
        let tolerance = tolerance(before.distance(self.root));
        let photographs = (frame + 1 - self.next_click) as f64;
        let is_near = |at: &Pixel| at.distance(before) <= MOST_MOTION * tolerance * photographs;
        let alone = ONE_SIDED.min(UNCONFIRMED * self.confidence);
        let agreed = followed.zip(detected).map_or(0.0, |(at, detected)| agreement(at, detected, tolerance));
        let place = match detected {
            // Flow drifts from photograph to photograph, detection does not: where both agree the point begins anew.
            Some(at) if agreed > 0.0 => FollowedPlace { at, confidence: alone.max(agreed) },
            // Where the flow is lost, detection goes on near the latest place.
            _ => FollowedPlace {
                at: followed.filter(is_near).or(detected.filter(is_near))?,
                confidence: alone,
            },
        };
        (place.confidence >= LEAST_CONFIDENCE).then_some(place)
    }

    /// Takes in photograph `frame`, which showed the point at `place`; of an interrupted run, too, of which `picture` is wanted for
    /// the latest photograph that showed it.
    pub fn record(&mut self, frame: usize, picture: Option<&Arc<Pyramid>>, place: Option<FollowedPlace>) {
        let Some(place) = place else {
            self.confidence *= UNCONFIRMED;
            return;
        };
        (self.confidence, self.next_click) = (place.confidence, frame + 1);
        if let Some(picture) = picture {
            let height_px = place.at.distance(self.root);
            self.point = Some(FollowedPoint::new(Arc::clone(picture), place.at, height_px));
        }
    }
}

/// A place with flow from one side only, so many photographs from the click.
fn one_sided(at: Pixel, frames: usize) -> Option<FollowedPlace> {
    Some(FollowedPlace { at, confidence: ONE_SIDED / (1.0 + frames as f64 / HALF_LIFE) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FRAMES: usize = 21;

    /// A bright spot on dark noise.
    fn spot(at: Pixel) -> Arc<Pyramid> {
        let (width, height) = (160, 120);
        let value = |index: usize| {
            let (x, y) = ((index % width) as f64 - at.x, (index / width) as f64 - at.y);
            (40.0 + 160.0 * crate::math::exp(-(x * x + 2.0 * y * y) / 40.0)) as u8
        };
        let rgb = (0..width * height).flat_map(|index| [value(index); 3]).collect();
        Arc::new(Pyramid::of(&crate::photo::Image { width, height, rgb }))
    }

    #[test]
    fn a_live_point_goes_on_as_if_it_had_not_been_interrupted() {
        let truth = |frame: usize| Pixel::new(60.0 + 1.5 * frame as f64, 40.0 + 0.5 * frame as f64);
        let click = Click { frame: 0, at: truth(0) };
        let point = || LivePoint::new(vec![click], Pixel::new(60.0, 118.0));
        // The first photograph fails, and a black one later; the detection is right in every fifth.
        let black = Arc::new(Pyramid::of(&crate::photo::Image {
            width: 160,
            height: 120,
            rgb: vec![0; 3 * 160 * 120],
        }));
        let picture = |frame: usize| match frame {
            0 => None,
            9 => Some(Arc::clone(&black)),
            _ => Some(spot(truth(frame.saturating_sub(1)))),
        };
        let detected = |frame: usize| (frame > 0 && frame.is_multiple_of(5)).then(|| truth(frame - 1));
        let mut whole = point();
        let places: Vec<_> =
            (0..FRAMES).map(|frame| whole.next(frame, picture(frame).as_ref(), detected(frame))).collect();
        assert_eq!((places[0], places[9]), (None, None));
        for frame in [1, 2, 8, 10, 20] {
            let place = places[frame].unwrap();
            assert!(place.at.distance(truth(frame - 1)) < 1.0, "{frame}: {place:?}");
        }
        let confidence = |frame: usize| places[frame].unwrap().confidence;
        assert!(confidence(1) == 1.0 && confidence(5) == AGREED && confidence(7) < confidence(6));
        for stop in 1..FRAMES {
            let mut resumed = point();
            // Only the latest photograph with the point is read again.
            let latest = (0..stop).rev().find(|&frame| places[frame].is_some());
            for (frame, &place) in places.iter().enumerate() {
                if frame < stop {
                    let picture = picture(frame).filter(|_| Some(frame) == latest);
                    resumed.record(frame, picture.as_ref(), place);
                } else {
                    assert_eq!(
                        resumed.next(frame, picture(frame).as_ref(), detected(frame)),
                        place,
                        "{stop}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_leap_is_believed_by_two_witnesses_and_a_step_by_one() {
        let (from, to) = (Pixel::new(60.0, 60.0), Pixel::new(78.0, 60.0));
        let next = |detected| {
            let mut point = LivePoint::new(vec![Click { frame: 0, at: from }], Pixel::new(60.0, 118.0));
            assert!(point.next(0, Some(&spot(from)), None).is_some());
            point.next(1, Some(&spot(to)), detected)
        };
        assert_eq!(next(None), None);
        assert_eq!(next(Some(to)), Some(FollowedPlace { at: to, confidence: AGREED }));
        let near = Pixel::new(64.0, 58.0);
        assert_eq!(next(Some(near)), Some(FollowedPlace { at: near, confidence: ONE_SIDED }));
    }

    #[test]
    fn a_live_point_that_nothing_confirms_ends() {
        let mut point =
            LivePoint::new(vec![Click { frame: 0, at: Pixel::new(60.0, 40.0) }], Pixel::new(60.0, 118.0));
        let picture = spot(Pixel::new(60.0, 40.0));
        let elsewhere = Some(Pixel::new(120.0, 100.0));
        let answered =
            (0..300).take_while(|&frame| point.next(frame, Some(&picture), elsewhere).is_some()).count();
        assert!((80..150).contains(&answered), "{answered}");
        assert!(point.next(300, Some(&picture), Some(Pixel::new(60.0, 40.0))).is_some());
    }

    /// A point that moves steadily, followed with so much drift a photograph, to the right forwards and to the left backwards.
    fn places(drift: f64, clicks: &[usize]) -> Vec<Option<FollowedPlace>> {
        let truth = |frame: usize| Pixel::new(100.0 + 3.0 * frame as f64, 50.0);
        let clicks: Vec<Click> = clicks.iter().map(|&frame| Click { frame, at: truth(frame) }).collect();
        let drifted = |frame: usize, from: Option<&Click>, side: f64| {
            let age = from?.frame.abs_diff(frame) as f64;
            Some(truth(frame) + Pixel::new(side * drift * age, 0.0))
        };
        let before = |frame: usize| clicks.iter().rfind(|click| click.frame <= frame);
        let after = |frame: usize| clicks.iter().find(|click| click.frame >= frame);
        let forward: Vec<_> = (0..FRAMES).map(|frame| drifted(frame, before(frame), 1.0)).collect();
        let backward: Vec<_> = (0..FRAMES).map(|frame| drifted(frame, after(frame), -1.0)).collect();
        let found = blend(&clicks, &forward, &backward, 5.0);
        for (frame, place) in found.iter().enumerate().filter(|_| clicks.len() > 1) {
            let place = place.unwrap();
            assert!(place.at.distance(truth(frame)) <= drift * FRAMES as f64, "{frame}: {place:?}");
        }
        found
    }

    proptest! {
        #[test]
        fn clicks_are_certain_and_doubt_grows_with_drift(drift in 0.0..2.0, more in 0.0..1.0) {
            let (found, worse) = (places(drift, &[0, 10, 20]), places(drift + more, &[0, 10, 20]));
            for frame in [0, 10, 20] {
                prop_assert_eq!(found[frame].unwrap().confidence, 1.0);
            }
            for (one, other) in found.iter().zip(&worse) {
                prop_assert!(one.unwrap().confidence >= other.unwrap().confidence);
            }
        }
    }

    #[test]
    fn drift_the_same_from_both_sides_cancels_in_the_middle() {
        let middle = places(0.4, &[0, 20])[10].unwrap();
        assert!((middle.at.x - 130.0).abs() < 1e-9, "{middle:?}");
        // 8 pixels apart at a tolerance of 5.
        assert!((middle.confidence - AGREED * 0.7).abs() < 1e-9, "{middle:?}");
    }

    #[test]
    fn after_the_last_click_confidence_falls() {
        let found = places(0.0, &[5]);
        let confidence = |frame: usize| found[frame].unwrap().confidence;
        assert!(confidence(6) < ONE_SIDED && confidence(20) < confidence(6) && confidence(0) < confidence(4));
    }
}
