//! Whether the plant can be where a photograph shows it, given where it was.
//!
//! In: what each photograph shows, in order. Out: what of it is believed. The one idea: a plant moves steadily and by
//! little, and its tissue neither appears nor vanishes, so what a leaf, a fly or a lamp's glare does to a picture gives
//! itself away as soon as the one before is known.

use std::collections::VecDeque;

use crate::geometry::Point;
use crate::math;
use crate::vision::camera::calibration::Calibration;
use crate::vision::detect::occupancy::OccupancyGrid;
use crate::vision::frame_status::FrameStatus;
use crate::vision::tracking::hold::MAX_HELD_FRAMES;
use crate::vision::tracking::kalman::{KalmanState, STEADY};

/// Minutes between two photographs unless their times say otherwise (section 2.2.2).
const PERIOD_MIN: f64 = 5.0;

/// How far a tip can move in a period, in cm: no bean was seen to move faster.
const GATE: f64 = 2.2;

/// How far from where it is expected a tip is believed whatever else has changed, in cm, after one period and for each
/// further one, and at most: below half a centimetre nothing is called wrong. With something on the tip that holds for as
/// long as a held tip may steer. Behind thin mist a tip is believed within the first of these for each period.
const NEAR: (f64, f64, f64) = (0.25, 0.05, 0.4);

/// Tissue moves as far as the tip does, and at least this far, in cm.
const MOVES: f64 = 0.5;

/// How far around the tip what appears or vanishes matters, in cm.
const AROUND: f64 = 3.0;

/// Tissue that may appear or vanish there, in square cm.
const CHANGE: f64 = 0.12;

/// What moves comes as much as it goes, but for this share of it.
const UNEVEN: f64 = 0.3;

/// Two photographs agree where less than this share of the plant is not where it was.
const ALIKE: f64 = 0.1;

/// Photographs that must agree before a jump is believed, before a plant is believed that looks otherwise, and before one
/// is believed with something on its tip.
const AGREE: (usize, usize, usize) = (2, 5, 12);

/// Photographs at the beginning that may all be wrong: as long as no more were believed, two that agree outvote them.
const YOUNG: usize = 2;

/// Photographs that must be known for the next to be judged: of those believed how they look, and of those doubted in a
/// row all, for where more agree, they are believed.
pub(in crate::vision) const MEMORY: usize = AGREE.2;

/// Where the contrast of a plant falls below this share of the most that it was of late, mist or a shadow took it; below
/// the second, so much that the tip may have gone, too.
const DIMMED: (f64, f64) = (0.85, 0.7);

/// A tip farther than this from the stem, in cm, is no end of it: a leaf is.
const APART: f64 = 0.4;

/// What a photograph shows of a plant, in cm.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::vision) struct PlantMeasurement {
    pub(in crate::vision) tip: Point,
    pub(in crate::vision) shape: OccupancyGrid,
    /// How many deviations of the background the plant exceeds it by.
    pub(in crate::vision) contrast: f64,
    /// How far the tip is from the nearest point of the stem, in cm, where there is one.
    pub(in crate::vision) apart: Option<f64>,
    /// Whether something lies on the tip.
    pub(in crate::vision) is_occluded: bool,
    pub(in crate::vision) calibration: Calibration,
}

impl PlantMeasurement {
    /// Whether the tip is a leaf's.
    fn is_leaf(&self) -> bool {
        self.apart.is_some_and(|apart| apart > APART)
    }
}

/// What is known of a plant from the photographs so far.
#[derive(Clone, Debug, Default)]
pub(in crate::vision) struct TrackGate {
    motion: Option<KalmanState>,
    /// How many photographs were believed.
    believed: usize,
    /// The latest photograph that was believed.
    before: Option<PlantMeasurement>,
    /// The contrasts of the latest that were, and whether a leaf's tip was taken for the plant's; at most [`MEMORY`] of
    /// them: mist comes slowly.
    looks: VecDeque<(f64, bool)>,
    /// Time of that photograph, in seconds.
    time_s: f64,
    /// What the latest photograph showed if it was not believed, how many before it agree with each other, and it with
    /// them.
    doubted: Option<(PlantMeasurement, usize)>,
}

impl TrackGate {
    /// Whether what a photograph shows is believed, and how well it fits what is known, 0 to 1.
    pub(in crate::vision) fn gate(&mut self, glimpse: PlantMeasurement, time_s: f64) -> (FrameStatus, f64) {
        let periods = self.periods(time_s);
        let far = GATE * periods.max(1.0);
        let grows = |(one, more, most): (f64, f64, f64)| (one + more * (periods - 1.0).max(0.0)).min(most);
        let doubt = self.anomaly(&glimpse);
        let gate = match doubt {
            Anomaly::None => far,
            Anomaly::Dimmed => NEAR.0 * periods.max(1.0),
            Anomaly::Hidden => 0.0,
            Anomaly::Veiled if periods > f64::from(MAX_HELD_FRAMES) + 1.5 => 0.0,
            Anomaly::Changed | Anomaly::Veiled => grows(NEAR),
        };
        // Before anything is known, what nothing lies on is believed, and nothing else.
        let nowhere = if doubt == Anomaly::None { 0.0 } else { far };
        let expected = self.motion.map(|motion| motion.extrapolate(periods));
        let miss = expected.map_or(nowhere, |expected| expected.distance(glimpse.tip));
        let fit = math::exp(-0.5 * (miss / gate.max(0.1)) * (miss / gate.max(0.1)));
        let alike = match &self.doubted {
            Some((before, count)) if agree(&glimpse, before) => count + 1,
            _ => 1,
        };
        let enough = if self.believed <= YOUNG { AGREE.0 } else { doubt.agreeing() };
        if miss <= gate || alike >= enough {
            self.accept(glimpse.tip, time_s);
            self.remember_appearance(glimpse);
            return (FrameStatus::Ok, if miss <= gate { fit } else { 0.5 });
        }
        let class = if miss > far { FrameStatus::Jump } else { FrameStatus::Ambiguous };
        self.doubted = Some((glimpse, alike));
        (class, fit)
    }

    fn anomaly(&self, glimpse: &PlantMeasurement) -> Anomaly {
        match (&self.before, self.motion) {
            (Some(before), Some(motion)) => {
                let clearest = self.looks.iter().map(|look| look.0).fold(0.0, f64::max);
                let is_dimmed = |share: f64| glimpse.contrast < share * clearest;
                let leaves = self.looks.iter().filter(|look| look.1).count();
                // Of two leaves of one height, now the one is higher, now the other: both were there before.
                let was_there = glimpse.tip.distance(motion.tip()) > NEAR.2
                    && before.shape.is_near(glimpse.calibration.pixel(glimpse.tip));
                let is_leaf = glimpse.is_leaf() && 2 * leaves < self.looks.len() && !was_there;
                let is_changed = || is_changed(glimpse, &before.shape, motion.tip());
                match () {
                    () if is_leaf && !is_dimmed(DIMMED.0) && is_changed() => Anomaly::Hidden,
                    () if glimpse.is_occluded || is_leaf || is_dimmed(DIMMED.1) => Anomaly::Veiled,
                    () if is_dimmed(DIMMED.0) => Anomaly::Dimmed,
                    () if is_changed() => Anomaly::Changed,
                    () => Anomaly::None,
                }
            }
            _ if glimpse.is_occluded => Anomaly::Veiled,
            _ => Anomaly::None,
        }
    }

    /// Takes up how the plant looks in the latest photograph that was believed.
    pub(in crate::vision) fn remember_appearance(&mut self, glimpse: PlantMeasurement) {
        self.looks.truncate(MEMORY - 1);
        self.looks.push_front((glimpse.contrast, glimpse.is_leaf()));
        self.before = Some(glimpse);
    }

    /// Takes a measured tip for true. How the plant looks there is not known until it is [recognised](Self::remember_appearance).
    pub(in crate::vision) fn accept(&mut self, tip: Point, time_s: f64) {
        let periods = self.periods(time_s);
        // What is believed after a jump says nothing about velocity.
        let is_steady =
            |motion: &KalmanState| motion.extrapolate(periods).distance(tip) <= STEADY * periods.max(1.0);
        let motion = self.motion.filter(is_steady);
        self.motion = Some(
            motion
                .map_or_else(|| KalmanState::initial(tip), |motion| motion.predict_and_update(tip, periods)),
        );
        self.believed += 1;
        (self.before, self.time_s, self.doubted) = (None, time_s, None);
    }

    /// Periods since the latest photograph that was believed; one where times say nothing.
    fn periods(&self, time_s: f64) -> f64 {
        let periods = (time_s - self.time_s) / (60.0 * PERIOD_MIN);
        if periods > 0.0 { periods } else { 1.0 }
    }
}

/// Why a plant is believed only where it is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Anomaly {
    None,
    /// It stands out less than it did, but shows where it ends.
    Dimmed,
    /// Tissue appeared or vanished.
    Changed,
    /// Something lies on the tip.
    Veiled,
    /// A leaf has come whose tip is clearly seen, and the stem's was before: the leaf hides it, wherever it is.
    Hidden,
}

impl Anomaly {
    /// Photographs that must agree before one is believed that shows the tip elsewhere.
    const fn agreeing(self) -> usize {
        match self {
            Self::None | Self::Dimmed => AGREE.0,
            Self::Changed => AGREE.1,
            Self::Veiled | Self::Hidden => AGREE.2,
        }
    }
}

/// Whether tissue appeared or vanished: some is farther from where some was than the tip has moved, more came than went,
/// or the plant drew back along itself.
fn is_changed(glimpse: &PlantMeasurement, before: &OccupancyGrid, tip: Point) -> bool {
    let moved = glimpse.tip.distance(tip);
    let square = glimpse.calibration.px_per_cm * glimpse.calibration.px_per_cm;
    let most = CHANGE * square;
    let around = |shape: &OccupancyGrid, tip: Point| {
        shape.around(glimpse.calibration.pixel(tip), AROUND * glimpse.calibration.px_per_cm)
    };
    let (here, there) = (around(&glimpse.shape, glimpse.tip), around(before, tip));
    let came = |reach: f64| here.area_beyond(before, reach * glimpse.calibration.px_per_cm);
    let went = |reach: f64| there.area_beyond(&glimpse.shape, reach * glimpse.calibration.px_per_cm);
    let far = moved.clamp(MOVES, GATE);
    let (new, gone) = (came(MOVES / 2.0), went(MOVES / 2.0));
    let is_at = |shape: &OccupancyGrid, at: Point| shape.is_near(glimpse.calibration.pixel(at));
    let draws_back = moved > NEAR.0 && is_at(before, glimpse.tip) && !is_at(&glimpse.shape, tip);
    draws_back || came(far).max(went(far)) > most || (new - gone).abs() > most + UNEVEN * new.min(gone)
}

/// Whether two photographs in a row show the same plant.
fn agree(one: &PlantMeasurement, other: &PlantMeasurement) -> bool {
    let moved = one.tip.distance(other.tip);
    let most = ALIKE * one.shape.area().max(other.shape.area());
    let reach = moved.max(MOVES) * one.calibration.px_per_cm;
    moved <= GATE
        && one.shape.area_beyond(&other.shape, reach).max(other.shape.area_beyond(&one.shape, reach)) <= most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pixel;

    /// A stem of 10 px a cm, and whatever else is in the picture, from one place to another.
    fn glimpse(tip: Point, more: Option<[f64; 4]>) -> PlantMeasurement {
        let base = Pixel::new(300.0, 400.0);
        let calibration = Calibration::from_scale(base, 10.0, 648, 486);
        let line = |from: [f64; 2], to: [f64; 2]| {
            (0..=200).map(move |i| {
                let share = f64::from(i) / 200.0;
                Pixel::new(from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]))
            })
        };
        let stem = line([300.0, 400.0], [300.0 + 10.0 * tip.x, 400.0 - 10.0 * tip.y]);
        let more = more.into_iter().flat_map(|[a, b, c, d]| line([a, b], [c, d]));
        let shape = OccupancyGrid::from_pixels(stem.chain(more), 2.5);
        PlantMeasurement { tip, shape, contrast: 20.0, apart: Some(0.1), is_occluded: false, calibration }
    }

    fn followed(steps: u32) -> TrackGate {
        let mut gate = TrackGate::default();
        for step in 0..steps {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            assert_eq!(gate.gate(glimpse(tip, None), 300.0 * f64::from(step)).0, FrameStatus::Ok);
        }
        gate
    }

    #[test]
    fn a_leaf_in_front_is_doubted_until_it_has_stayed() {
        let mut gate = followed(8);
        let hidden = || glimpse(Point::new(0.8, 11.5), Some([260.0, 285.0, 350.0, 290.0]));
        for step in 8..12 {
            assert_eq!(gate.gate(hidden(), 300.0 * f64::from(step)).0, FrameStatus::Ambiguous, "{step}");
        }
        assert_eq!(gate.gate(hidden(), 3_600.0).0, FrameStatus::Ok);
    }

    #[test]
    fn what_lies_on_the_tip_is_doubted_unless_it_is_where_it_should_be() {
        let mut gate = followed(8);
        let veiled = |tip| PlantMeasurement { is_occluded: true, ..glimpse(tip, None) };
        assert_eq!(gate.gate(veiled(Point::new(0.8, 9.8)), 2_400.0).0, FrameStatus::Ambiguous);
        assert_eq!(gate.gate(veiled(Point::new(0.9, 10.45)), 2_700.0).0, FrameStatus::Ok);
        let misty = PlantMeasurement { contrast: 12.0, ..glimpse(Point::new(1.0, 9.9), None) };
        assert_eq!(gate.gate(misty, 3_000.0).0, FrameStatus::Ambiguous);
        let leaf = PlantMeasurement { apart: Some(0.9), ..glimpse(Point::new(1.0, 11.4), None) };
        assert_eq!(gate.gate(leaf, 3_300.0).0, FrameStatus::Ambiguous);
    }

    #[test]
    fn mist_is_told_from_the_clear_photographs_before_it() {
        let mut gate = followed(8);
        let misty = |contrast, tip| PlantMeasurement { contrast, ..glimpse(tip, None) };
        // It comes slowly, and the plant is where it is expected.
        for (step, contrast) in [(8, 15.0), (9, 13.0), (10, 11.0)] {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            assert_eq!(gate.gate(misty(contrast, tip), 300.0 * f64::from(step)).0, FrameStatus::Ok, "{step}");
        }
        // Thick, it shows less of the stem than there is; thin, it shows all of it.
        let low = Point::new(0.7, 9.2);
        assert_eq!(gate.gate(misty(11.0, low), 3_300.0).0, FrameStatus::Ambiguous);
        assert_eq!(gate.gate(misty(11.0, low), 3_600.0).0, FrameStatus::Ambiguous);
        let up = |step| Point::new(0.1 * f64::from(step), 11.8);
        assert_eq!(gate.gate(misty(13.0, up(13)), 3_900.0).0, FrameStatus::Ambiguous);
        assert_eq!(gate.gate(misty(14.0, up(14)), 4_200.0).0, FrameStatus::Ok);
    }

    #[test]
    fn a_leaf_before_the_tip_is_not_believed_for_being_where_the_tip_should_be() {
        let mut gate = followed(8);
        let leaf = |step: u32| {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            PlantMeasurement { apart: Some(0.9), ..glimpse(tip, Some([260.0, 285.0, 350.0, 290.0])) }
        };
        let seen: Vec<FrameStatus> =
            (8..20).map(|step| gate.gate(leaf(step), 300.0 * f64::from(step)).0).collect();
        // Where it stays it is the plant's top.
        assert!(seen[..11].iter().all(|class| *class == FrameStatus::Ambiguous), "{seen:?}");
        assert_eq!(seen[11], FrameStatus::Ok);
    }

    #[test]
    fn of_two_leaves_either_may_be_the_higher() {
        let leaf = [300.0, 300.0, 315.0, 299.0];
        let one = glimpse(Point::new(0.0, 10.0), Some(leaf));
        let other = PlantMeasurement { tip: Point::new(1.5, 10.1), apart: Some(1.5), ..one.clone() };
        let mut gate = TrackGate::default();
        for step in 0..6 {
            assert_eq!(gate.gate(one.clone(), 300.0 * f64::from(step)).0, FrameStatus::Ok, "{step}");
        }
        assert_eq!(gate.gate(other, 1_800.0).0, FrameStatus::Ok);
    }

    #[test]
    fn a_spoiled_beginning_is_outvoted() {
        let good = |step: u32| glimpse(Point::new(0.1 * f64::from(step), 10.0), None);
        let hidden = || glimpse(Point::new(0.0, 11.5), Some([260.0, 285.0, 350.0, 290.0]));
        let mut gate = TrackGate::default();
        let seen: Vec<FrameStatus> = [hidden(), hidden(), good(2), good(3)]
            .into_iter()
            .zip([0.0, 300.0, 600.0, 900.0])
            .map(|(glimpse, time_s)| gate.gate(glimpse, time_s).0)
            .collect();
        assert_eq!(seen, [FrameStatus::Ok, FrameStatus::Ok, FrameStatus::Ambiguous, FrameStatus::Ok]);
        // What lies on the very first tip is seen, and not believed before a second one agrees.
        let mut gate = TrackGate::default();
        let veiled = PlantMeasurement { is_occluded: true, ..good(0) };
        assert_eq!(gate.gate(veiled.clone(), 0.0).0, FrameStatus::Ambiguous);
        assert_eq!(gate.clone().gate(veiled, 300.0).0, FrameStatus::Ok);
        assert_eq!(gate.gate(good(1), 300.0).0, FrameStatus::Ok);
    }

    #[test]
    fn what_is_far_from_the_tip_does_not_matter() {
        let mut gate = followed(8);
        let fallen = glimpse(Point::new(0.8, 10.4), Some([200.0, 390.0, 300.0, 390.0]));
        assert_eq!(gate.gate(fallen, 2_400.0).0, FrameStatus::Ok);
    }

    #[test]
    fn a_jump_is_believed_when_two_agree() {
        let mut gate = followed(8);
        // The highest point goes over from one leaf to the other: both were there all along.
        let wide = |tip| PlantMeasurement {
            tip,
            ..glimpse(Point::new(0.0, 10.0), Some([240.0, 300.0, 340.0, 300.0]))
        };
        gate.accept(Point::new(4.0, 10.0), 2_400.0);
        gate.remember_appearance(wide(Point::default()));
        assert_eq!(gate.gate(wide(Point::new(-6.0, 10.0)), 2_700.0).0, FrameStatus::Jump);
        assert_eq!(gate.gate(wide(Point::new(-6.0, 10.1)), 3_000.0).0, FrameStatus::Ok);
    }

    #[test]
    fn longer_intervals_let_it_move_farther() {
        let far = Point::new(4.0, 10.0);
        let shown = |gate: &mut TrackGate, time_s| {
            gate.gate(PlantMeasurement { tip: far, ..glimpse(Point::new(0.1, 10.05), None) }, time_s).0
        };
        assert_eq!(shown(&mut followed(2), 600.0), FrameStatus::Jump);
        assert_eq!(shown(&mut followed(2), 1_500.0), FrameStatus::Ok);
    }
}
