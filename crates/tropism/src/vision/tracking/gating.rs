//! Gating: whether a plant can be where a photograph shows it, given the photographs before.
//!
//! In: measurements in the order of their times. Out: which of them are accepted. The one idea: a tip lies near where a
//! Kalman filter extrapolates it, and tissue neither appears nor vanishes. A measurement outside its gate is accepted
//! after M consecutive photographs agree. The more it looks like an occlusion, the narrower the gate and the greater M.
//!
//! The camera's scale does not enter, because it may be wrong or assumed. Distances are in pixels, and the plant gives the
//! scale: its stem is [`STEM_WIDTH`] wide.
//!
//! Where no other source is given, constants were chosen by hand on rendered frames (`benches/src/bin/accuracy`, seeds below
//! 100 000).
//!
//! # References
//! Bar-Shalom and Fortmann 1988, *Tracking and Data Association*: gates, and confirmation by M consecutive
//! measurements.

use std::collections::VecDeque;

use crate::geometry::Pixel;
use crate::lamps::Light;
use crate::math;
use crate::vision::detect::curve::median;
use crate::vision::detect::occupancy::OccupancyGrid;
use crate::vision::frame_status::FrameStatus;
use crate::vision::tracking::hold::MAX_HELD_FRAMES;
use crate::vision::tracking::kalman::{KalmanState, MAX_STEADY_MOTION};

/// Period of the constants of tracking, in minutes: the paper's interval of photographs (section 2.2.2). Rates are per
/// period and scale to another [`Interval`].
pub(in crate::vision) const PERIOD_MIN: f64 = 5.0;

/// Greatest factor of the counts of photographs at intervals shorter than the paper's. Chosen: a resumed run reads as many
/// photographs again.
const MAX_COUNT_SCALE: f64 = 3.0;

/// The interval at which the photographs of a series follow each other, in minutes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::vision) struct Interval(pub(in crate::vision) f64);

impl Default for Interval {
    /// The paper's.
    fn default() -> Self {
        Self(PERIOD_MIN)
    }
}

impl Interval {
    /// The interval in periods, at least one: within a period a plant moves less than the errors of measurement.
    fn periods(self) -> f64 {
        (self.0 / PERIOD_MIN).max(1.0)
    }

    /// The number of photographs that take as long as `count` of the paper's; at least two.
    pub(in crate::vision) fn count(self, count: usize) -> usize {
        let scaled = count as f64 * (PERIOD_MIN / self.0).min(MAX_COUNT_SCALE);
        (scaled.round() as usize).max(count.min(2))
    }

    /// Number of photographs that gating depends on.
    pub(in crate::vision) fn memory(self) -> usize {
        self.count(MEMORY)
    }
}

/// Assumed width of a stem, in cm. Chosen: the virtual rows of `benches/src/bin/accuracy` keep the figures of the camera's
/// true scale.
const STEM_WIDTH: f64 = 0.35;

/// Number of accepted photographs from which the width of the stem is learned. Chosen: half an hour.
const WIDTHS: usize = 6;

/// Radius of the full gate, in cm per period. Chosen: no bean of the real sets moves faster.
const GATE: f64 = 2.2;

/// Radius of the narrow gate, in cm: after one period, its growth for each further one, and its maximum. Chosen: below half
/// a centimetre, from which on `benches/src/bin/accuracy` counts a tip as wrong.
const NARROW_GATE: f64 = 0.25;
const NARROW_GATE_GROWTH: f64 = 0.05;
const MAX_NARROW_GATE: f64 = 0.4;

/// Least radius of a gate, in pixels: in a small picture a tip moves by whole ones.
const LEAST_GATE: f64 = 1.5;

/// Least distance that tissue may move between two photographs, in cm; it may move as far as the tip.
const TISSUE_MOTION: f64 = 0.5;

/// Radius around the tip in which changes of tissue count, in cm.
const CHANGE_RADIUS: f64 = 3.0;

/// Area of tissue that may appear or vanish there, in square cm.
const MAX_CHANGE: f64 = 0.12;

/// Greatest difference of the areas that appeared and vanished, as a share of the smaller: a moving plant conserves its
/// area.
const MAX_IMBALANCE: f64 = 0.3;

/// Greatest area in which two photographs that agree differ, as a share of the plant's.
const MAX_DISAGREEMENT: f64 = 0.1;

/// Number of photographs in a row that must agree before a measurement outside its gate is accepted: without an
/// anomaly, with changed tissue, and with an occluded tip. With two dozen instead of one, good plants were held for
/// two hours.
const CONFIRM_JUMP: usize = 2;
const CONFIRM_CHANGE: usize = 5;
const CONFIRM_OCCLUSION: usize = 12;

/// Number of accepted photographs up to which two that agree are enough, because the first few may all be wrong.
const YOUNG_TRACK: usize = 2;

/// Number of photographs that gating depends on: the latest accepted ones for their appearance, and the rejected ones since,
/// of which at most so many agree before they are accepted.
const MEMORY: usize = CONFIRM_OCCLUSION;

/// Contrasts below which mist or a shadow dims the plant, and below which even its tip may have vanished, as shares of the
/// greatest in memory.
const DIMMED: f64 = 0.85;
const STRONGLY_DIMMED: f64 = 0.7;

/// Width of the stem, as a multiple of that in the first accepted photographs, above which a photograph is blurred by mist.
/// Chosen on condensed frames of the seeds from 5 000 000 and 8 000 000; no answer to a real photograph changes.
const BLURRED: f64 = 2.0;

/// Greatest change of a stem's length from the median of the latest accepted photographs, as a share per period, and the
/// number of these. Chosen on the first halves of the bean and of the sunflowers (the rows `real/` of
/// `benches/src/bin/accuracy`): of 110 marked ends 99 were right, and of the 102 that stay 98 are.
const MAX_LENGTH_CHANGE: f64 = 0.2;
const STEM_LENGTHS: usize = 9;

/// Most by which a tip that a pole has hidden comes out below where it was last seen, in cm. Chosen on photographs of
/// the beans 100 to 107 beside poles.
const MAX_RETURN_DROP: f64 = 0.4;

/// Distance of a tip from the stem, in cm, above which it is a leaf's.
const LEAF_DISTANCE: f64 = 0.4;

/// What gating uses of a detection, in pixels of the reference picture: the camera's shift is undone.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::vision) struct PlantMeasurement {
    /// Tip.
    pub(in crate::vision) tip: Pixel,
    /// Cells of the plant.
    pub(in crate::vision) tissue: OccupancyGrid,
    /// Contrast, in standard deviations of the background.
    pub(in crate::vision) contrast: f64,
    /// The lamp that is lit.
    pub(in crate::vision) light: Option<Light>,
    /// Distance from the tip to the nearest point of the stem, where there is one.
    pub(in crate::vision) tip_to_stem: Option<f64>,
    /// Width of the stem, where there is one.
    pub(in crate::vision) stem_width: Option<f64>,
    /// Length of the stem, where there is one.
    pub(in crate::vision) stem_length: Option<f64>,
    /// Whether something may lie on the tip.
    pub(in crate::vision) is_occluded: bool,
}

/// Appearance of an accepted plant.
#[derive(Clone, Copy, Debug)]
struct Appearance {
    contrast: f64,
    light: Option<Light>,
    tip_to_stem: Option<f64>,
    stem_length: Option<f64>,
}

/// Whether a tip that is so far from the stem is a leaf's.
fn is_leaf_tip(tip_to_stem: Option<f64>, cm: f64) -> bool {
    tip_to_stem.is_some_and(|distance| distance > LEAF_DISTANCE * cm)
}

/// State of a gate after the photographs so far.
#[derive(Clone, Debug, Default)]
pub(in crate::vision) struct TrackGate {
    interval: Interval,
    /// Scale of the camera, in pixels per cm, until a stem is detected.
    px_per_cm: f64,
    /// Widths of the stem in the first accepted photographs with a stem, in pixels.
    widths: Vec<f64>,
    /// Kalman state in pixels instead of cm: the gains depend on ratios of the deviations only.
    state: Option<KalmanState>,
    /// Number of accepted measurements.
    accepted: usize,
    /// The latest accepted measurement, once its appearance is known.
    last: Option<PlantMeasurement>,
    /// Time of the latest accepted measurement, in seconds.
    time_s: f64,
    /// Appearances of the latest accepted measurements, newest first, at most [`Interval::memory`]: mist comes slowly.
    appearances: VecDeque<Appearance>,
    /// Whether a pole has hidden the tip since the latest accepted measurement, so that it may reappear elsewhere.
    is_returning: bool,
    /// The latest measurement if it was rejected, and the number of rejected ones up to it that agree.
    rejected: Option<(PlantMeasurement, usize)>,
}

impl TrackGate {
    /// A gate for photographs at an `interval`. The camera's scale is used until a stem is detected.
    pub(in crate::vision) fn new(interval: Interval, px_per_cm: f64) -> Self {
        Self { interval, px_per_cm, ..Self::default() }
    }

    /// Whether the width of the stem is still being learned.
    pub(in crate::vision) fn is_learning(&self) -> bool {
        self.widths.len() < WIDTHS
    }

    /// Learns from the width of the stem in an accepted photograph.
    pub(in crate::vision) fn learn(&mut self, stem_width: Option<f64>) {
        self.widths.extend(stem_width.filter(|_| self.is_learning()));
    }

    /// A centimetre of the plant, in pixels: by the median width of its stem, before that by the width in `measurement`, and
    /// without a stem by the camera's scale.
    fn centimetre(&self, measurement: Option<&PlantMeasurement>) -> f64 {
        let known = (!self.widths.is_empty()).then(|| median(self.widths.iter().copied()));
        let width = known.or_else(|| measurement?.stem_width);
        width.map_or(self.px_per_cm, |width| width / STEM_WIDTH)
    }

    /// Whether the stem is about as long as in the accepted photographs before. Where it is not, its end was found in a leaf
    /// or below one.
    pub(in crate::vision) fn has_steady_stem(&self, measurement: &PlantMeasurement) -> bool {
        let latest = self.appearances.iter().take(self.interval.count(STEM_LENGTHS));
        let lengths: Vec<f64> = latest.filter_map(|before| before.stem_length).collect();
        let Some(length) = measurement.stem_length.filter(|_| !lengths.is_empty()) else { return true };
        let usual = median(lengths);
        (length - usual).abs() <= MAX_LENGTH_CHANGE * self.interval.periods() * usual
    }

    /// Gates a measurement: its status, and its fit to the prediction, 0 to 1.
    pub(in crate::vision) fn gate(
        &mut self,
        measurement: PlantMeasurement,
        time_s: f64,
    ) -> (FrameStatus, f64) {
        let (periods, usual) = (self.periods(time_s), self.interval.periods());
        let cm = self.centimetre(Some(&measurement));
        let full_gate = cm * GATE * periods.max(1.0);
        let steps = periods / usual;
        let narrow_gate =
            cm * usual * (NARROW_GATE + NARROW_GATE_GROWTH * (steps - 1.0).max(0.0)).min(MAX_NARROW_GATE);
        let narrow_gate = narrow_gate.max(LEAST_GATE);
        let anomaly = self.anomaly(&measurement, cm);
        let radius = match anomaly {
            Anomaly::None => full_gate,
            Anomaly::Dimmed => (cm * NARROW_GATE * periods.max(1.0)).max(LEAST_GATE),
            Anomaly::HiddenByLeaf => 0.0,
            // An occluded tip is accepted near the expected one, but only for as long as a tip carried forward may steer.
            Anomaly::Occluded if steps > f64::from(MAX_HELD_FRAMES) + 1.5 => 0.0,
            Anomaly::TissueChanged | Anomaly::Occluded => narrow_gate,
        };
        // The first measurement is accepted if it has no anomaly.
        let unknown = if anomaly == Anomaly::None { 0.0 } else { full_gate };
        let expected = self.state.map(|state| Pixel::from(state.extrapolate(periods)));
        let distance = expected.map_or(unknown, |expected| expected.distance(measurement.tip));
        // The fit is a Gaussian of the innovation whose deviation is the gate's radius.
        let deviations = distance / radius.max(0.1 * cm);
        let fit = math::exp(-0.5 * deviations * deviations);
        let agreeing = match &self.rejected {
            Some((before, count)) if agree(&measurement, before, cm * usual) => count + 1,
            _ => 1,
        };
        let confirmations = if self.accepted <= YOUNG_TRACK {
            CONFIRM_JUMP
        } else {
            self.interval.count(anomaly.confirmations())
        };
        if distance <= radius || agreeing >= confirmations {
            self.learn(measurement.stem_width);
            self.accept(measurement.tip, time_s);
            self.remember_appearance(measurement);
            return (FrameStatus::Ok, if distance <= radius { fit } else { 0.5 });
        }
        let status = if distance > full_gate { FrameStatus::Jump } else { FrameStatus::Ambiguous };
        self.rejected = Some((measurement, agreeing));
        (status, fit)
    }

    /// Takes note of a photograph in which a pole hides the tip.
    pub(in crate::vision) const fn hide(&mut self) {
        self.is_returning = true;
    }

    /// The anomaly of a measurement, compared with those accepted before. `cm` is a centimetre of the plant, in pixels.
    fn anomaly(&self, measurement: &PlantMeasurement, cm: f64) -> Anomaly {
        match (&self.last, self.state) {
            (Some(_), Some(state)) if self.is_returning => {
                // A tip below the last one is another part of the plant that the pole does not hide.
                let is_lower = measurement.tip.y > state.tip[1] + MAX_RETURN_DROP * cm;
                if is_lower { Anomaly::HiddenByLeaf } else { Anomaly::None }
            }
            (Some(last), Some(state)) => {
                let before = Pixel::from(state.tip);
                let scale = cm * self.interval.periods();
                // Contrast depends on the lamp.
                let alike = self.appearances.iter().filter(|before| before.light == measurement.light);
                let clearest = alike.map(|before| before.contrast).fold(0.0, f64::max);
                let is_below = |share: f64| measurement.contrast < share * clearest;
                // No clear photograph exists of a lamp that was first lit in mist, but mist widens the stem, too.
                let is_wide = |width: f64| width > BLURRED * median(self.widths.iter().copied());
                let is_blurred = !self.is_learning() && measurement.stem_width.is_some_and(is_wide);
                let leaf_tips =
                    self.appearances.iter().filter(|before| is_leaf_tip(before.tip_to_stem, cm)).count();
                // Of two leaves of about the same height either may be the higher; both were there before.
                let was_there = measurement.tip.distance(before) > scale * MAX_NARROW_GATE
                    && last.tissue.is_near(measurement.tip);
                let is_changed = has_changed(measurement, &last.tissue, before, cm, scale);
                // Without changed tissue, a stem of another length means that another end of it was found.
                let has_new_leaf_tip = (is_changed || self.has_steady_stem(measurement))
                    && is_leaf_tip(measurement.tip_to_stem, cm)
                    && 2 * leaf_tips < self.appearances.len()
                    && !was_there;
                match () {
                    () if has_new_leaf_tip && !is_below(DIMMED) && is_changed => Anomaly::HiddenByLeaf,
                    () if measurement.is_occluded
                        || has_new_leaf_tip
                        || is_blurred
                        || is_below(STRONGLY_DIMMED) =>
                    {
                        Anomaly::Occluded
                    }
                    () if is_below(DIMMED) => Anomaly::Dimmed,
                    () if is_changed => Anomaly::TissueChanged,
                    () => Anomaly::None,
                }
            }
            _ if measurement.is_occluded => Anomaly::Occluded,
            _ => Anomaly::None,
        }
    }

    /// Adds the appearance of the latest accepted measurement.
    pub(in crate::vision) fn remember_appearance(&mut self, measurement: PlantMeasurement) {
        self.appearances.truncate(self.interval.memory() - 1);
        let PlantMeasurement { contrast, light, tip_to_stem, stem_length, .. } = measurement;
        self.appearances.push_front(Appearance { contrast, light, tip_to_stem, stem_length });
        self.last = Some(measurement);
    }

    /// Accepts a measured tip. Its appearance is unknown until it is [remembered](Self::remember_appearance).
    pub(in crate::vision) fn accept(&mut self, tip: Pixel, time_s: f64) {
        let periods = self.periods(time_s);
        // A jump gives no velocity: the filter is initialised anew.
        let radius = self.centimetre(None) * MAX_STEADY_MOTION * periods.max(1.0);
        let is_steady = |state: &KalmanState| tip.distance(state.extrapolate(periods).into()) <= radius;
        let state = self.state.filter(is_steady).map(|state| state.predict(periods).update(tip.into()));
        self.state = Some(state.unwrap_or_else(|| KalmanState::initial(tip.into())));
        self.accepted += 1;
        (self.last, self.time_s, self.rejected) = (None, time_s, None);
        self.is_returning = false;
    }

    /// Interval since the latest accepted measurement, in periods; one where it is not positive.
    fn periods(&self, time_s: f64) -> f64 {
        let periods = (time_s - self.time_s) / (60.0 * PERIOD_MIN);
        if periods > 0.0 { periods } else { 1.0 }
    }
}

/// Why a measurement has a narrower gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Anomaly {
    None,
    /// The contrast is lower than before, but the tip is still visible.
    Dimmed,
    /// Tissue appeared or vanished.
    TissueChanged,
    /// Something may lie on the tip.
    Occluded,
    /// A leaf has appeared with its tip in plain view: it hides the stem's, wherever that is.
    HiddenByLeaf,
}

impl Anomaly {
    /// Number of photographs in a row that must agree before one outside its gate is accepted.
    const fn confirmations(self) -> usize {
        match self {
            Self::None | Self::Dimmed => CONFIRM_JUMP,
            Self::TissueChanged => CONFIRM_CHANGE,
            Self::Occluded | Self::HiddenByLeaf => CONFIRM_OCCLUSION,
        }
    }
}

/// Whether tissue appeared or vanished since the photograph `before`, whose tip was at `tip`.
///
/// It did if some lies farther from earlier tissue than the tip has moved, if more appeared than vanished, or if the
/// plant drew back along itself. `cm` is a centimetre of the plant, and `scale` that times the interval of the series in
/// periods, in pixels.
fn has_changed(
    measurement: &PlantMeasurement,
    before: &OccupancyGrid,
    tip: Pixel,
    cm: f64,
    scale: f64,
) -> bool {
    let now = &measurement.tissue;
    let moved = measurement.tip.distance(tip);
    let max_area = MAX_CHANGE * cm * cm;
    let around_tip = |grid: &OccupancyGrid, tip: Pixel| grid.around(tip, CHANGE_RADIUS * cm);
    let (now_at_tip, before_at_tip) = (around_tip(now, measurement.tip), around_tip(before, tip));
    let appeared = |radius: f64| now_at_tip.area_beyond(before, radius);
    let vanished = |radius: f64| before_at_tip.area_beyond(now, radius);
    let tissue_motion = scale * TISSUE_MOTION;
    let far = moved.clamp(tissue_motion, scale * GATE);
    // A plant that moves leaves as much area as it takes; one that is covered or uncovered does not.
    let (new, gone) = (appeared(tissue_motion / 2.0), vanished(tissue_motion / 2.0));
    let draws_back = moved > scale * NARROW_GATE && before.is_near(measurement.tip) && !now.is_near(tip);
    draws_back
        || appeared(far).max(vanished(far)) > max_area
        || (new - gone).abs() > max_area + MAX_IMBALANCE * new.min(gone)
}

/// Whether two photographs in a row show the same plant. `scale` is a centimetre of the plant times the interval of the
/// series in periods, in pixels.
fn agree(one: &PlantMeasurement, other: &PlantMeasurement, scale: f64) -> bool {
    let moved = one.tip.distance(other.tip);
    let max_area = MAX_DISAGREEMENT * one.tissue.area().max(other.tissue.area());
    let radius = moved.max(scale * TISSUE_MOTION);
    let difference = one.tissue.area_beyond(&other.tissue, radius);
    moved <= scale * GATE && difference.max(other.tissue.area_beyond(&one.tissue, radius)) <= max_area
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// A plant whose tip is at `tip` cm: a stem at 10 px per cm, with another line of tissue between two pixels.
    fn measurement(tip: Point, more: Option<[f64; 4]>) -> PlantMeasurement {
        let tip = in_pixels(tip);
        let line = |from: [f64; 2], to: [f64; 2]| {
            (0..=200).map(move |i| {
                let share = f64::from(i) / 200.0;
                Pixel::new(from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]))
            })
        };
        let stem = line([300.0, 400.0], [tip.x, tip.y]);
        let more = more.into_iter().flat_map(|[a, b, c, d]| line([a, b], [c, d]));
        let tissue = OccupancyGrid::from_pixels(stem.chain(more), 2.5);
        PlantMeasurement {
            tip,
            tissue,
            contrast: 20.0,
            light: Some(Light::LEFT),
            tip_to_stem: Some(1.0),
            stem_width: Some(10.0 * STEM_WIDTH),
            stem_length: Some(100.0),
            is_occluded: false,
        }
    }

    fn in_pixels(tip: Point) -> Pixel {
        Pixel::new(300.0 + 10.0 * tip.x, 400.0 - 10.0 * tip.y)
    }

    fn tracked(steps: u32) -> TrackGate {
        let mut track = TrackGate::default();
        for step in 0..steps {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            assert_eq!(track.gate(measurement(tip, None), 300.0 * f64::from(step)).0, FrameStatus::Ok);
        }
        track
    }

    #[test]
    fn a_leaf_in_front_is_rejected_until_it_has_stayed() {
        let mut track = tracked(8);
        let hidden = || measurement(Point::new(0.8, 11.5), Some([260.0, 285.0, 350.0, 290.0]));
        for step in 8..12 {
            assert_eq!(track.gate(hidden(), 300.0 * f64::from(step)).0, FrameStatus::Ambiguous, "{step}");
        }
        assert_eq!(track.gate(hidden(), 3_600.0).0, FrameStatus::Ok);
    }

    #[test]
    fn an_occluded_tip_is_rejected_unless_it_is_where_expected() {
        let mut track = tracked(8);
        let occluded = |tip| PlantMeasurement { is_occluded: true, ..measurement(tip, None) };
        assert_eq!(track.gate(occluded(Point::new(0.8, 9.8)), 2_400.0).0, FrameStatus::Ambiguous);
        assert_eq!(track.gate(occluded(Point::new(0.9, 10.45)), 2_700.0).0, FrameStatus::Ok);
        let misty = PlantMeasurement { contrast: 12.0, ..measurement(Point::new(1.0, 9.9), None) };
        assert_eq!(track.gate(misty, 3_000.0).0, FrameStatus::Ambiguous);
        let leaf = PlantMeasurement { tip_to_stem: Some(9.0), ..measurement(Point::new(1.0, 11.4), None) };
        assert_eq!(track.gate(leaf, 3_300.0).0, FrameStatus::Ambiguous);
    }

    #[test]
    fn mist_is_recognised_by_the_clear_photographs_before_it() {
        let mut track = tracked(8);
        let misty = |contrast, tip| PlantMeasurement { contrast, ..measurement(tip, None) };
        // Mist comes slowly, and the plant is where it is expected.
        for (step, contrast) in [(8, 15.0), (9, 13.0), (10, 11.0)] {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            assert_eq!(
                track.gate(misty(contrast, tip), 300.0 * f64::from(step)).0,
                FrameStatus::Ok,
                "{step}"
            );
        }
        // Thick mist hides the end of the stem, thin mist does not.
        let low = Point::new(0.7, 9.2);
        assert_eq!(track.gate(misty(11.0, low), 3_300.0).0, FrameStatus::Ambiguous);
        assert_eq!(track.gate(misty(11.0, low), 3_600.0).0, FrameStatus::Ambiguous);
        let up = |step| Point::new(0.1 * f64::from(step), 11.8);
        assert_eq!(track.gate(misty(13.0, up(13)), 3_900.0).0, FrameStatus::Ambiguous);
        assert_eq!(track.gate(misty(14.0, up(14)), 4_200.0).0, FrameStatus::Ok);
    }

    #[test]
    fn a_stem_that_ends_elsewhere_is_not_steady_until_it_stays() {
        let mut track = tracked(8);
        let shorter = |step: u32| {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            PlantMeasurement { stem_length: Some(70.0), ..measurement(tip, None) }
        };
        let steady: Vec<bool> = (8..16)
            .map(|step| {
                let is_steady = track.has_steady_stem(&shorter(step));
                track.gate(shorter(step), 300.0 * f64::from(step));
                is_steady
            })
            .collect();
        assert_eq!(steady, [false, false, false, false, false, true, true, true]);
    }

    #[test]
    fn another_lamp_is_no_mist() {
        let mut track = tracked(8);
        for (step, light) in (8..20).map(|step| (step, if step < 14 { Light::RIGHT } else { Light::LEFT })) {
            let tip = Point::new(0.1 * f64::from(step) + 0.3, 10.0 + 0.05 * f64::from(step));
            let contrast = if light == Light::RIGHT { 12.0 } else { 20.0 };
            let dimmer = PlantMeasurement { contrast, light: Some(light), ..measurement(tip, None) };
            assert_eq!(track.gate(dimmer, 300.0 * f64::from(step)).0, FrameStatus::Ok, "{step}");
        }
    }

    #[test]
    fn mist_under_another_lamp_is_recognised_by_its_blur() {
        let mut track = tracked(8);
        let right = |widths: f64, step: u32| {
            let tip = Point::new(0.1 * f64::from(step) + 0.4, 10.0 + 0.05 * f64::from(step));
            let stem_width = Some(widths * 10.0 * STEM_WIDTH);
            PlantMeasurement {
                light: Some(Light::RIGHT),
                contrast: 12.0,
                stem_width,
                ..measurement(tip, None)
            }
        };
        assert_eq!(track.clone().gate(right(1.5, 8), 2_400.0).0, FrameStatus::Ok);
        for step in 8..11 {
            let status = track.gate(right(2.5, step), 300.0 * f64::from(step)).0;
            assert_eq!(status, FrameStatus::Ambiguous, "{step}");
        }
    }

    #[test]
    fn another_end_of_the_stem_is_no_leaf_where_no_tissue_has_changed() {
        let mut track = tracked(8);
        let tip = Point::new(1.15, 10.4);
        let ends = |stem_length| PlantMeasurement {
            tip_to_stem: Some(20.0),
            stem_length: Some(stem_length),
            ..measurement(tip, None)
        };
        assert_eq!(track.clone().gate(ends(60.0), 2_400.0).0, FrameStatus::Ok);
        assert_eq!(track.gate(ends(90.0), 2_400.0).0, FrameStatus::Ambiguous);
    }

    #[test]
    fn a_leaf_before_the_tip_is_rejected_even_where_the_tip_is_expected() {
        let mut track = tracked(8);
        let leaf = |step: u32| {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            PlantMeasurement {
                tip_to_stem: Some(9.0),
                ..measurement(tip, Some([260.0, 285.0, 350.0, 290.0]))
            }
        };
        let statuses: Vec<FrameStatus> =
            (8..20).map(|step| track.gate(leaf(step), 300.0 * f64::from(step)).0).collect();
        // A leaf that stays is the top of the plant.
        assert!(statuses[..11].iter().all(|status| *status == FrameStatus::Ambiguous), "{statuses:?}");
        assert_eq!(statuses[11], FrameStatus::Ok);
    }

    #[test]
    fn of_two_leaves_either_may_be_the_higher() {
        let leaf = [300.0, 300.0, 315.0, 299.0];
        let one = measurement(Point::new(0.0, 10.0), Some(leaf));
        let other = PlantMeasurement {
            tip: in_pixels(Point::new(1.5, 10.1)),
            tip_to_stem: Some(15.0),
            ..one.clone()
        };
        let mut track = TrackGate::default();
        for step in 0..6 {
            assert_eq!(track.gate(one.clone(), 300.0 * f64::from(step)).0, FrameStatus::Ok, "{step}");
        }
        assert_eq!(track.gate(other, 1_800.0).0, FrameStatus::Ok);
    }

    #[test]
    fn a_wrong_beginning_is_outvoted() {
        let good = |step: u32| measurement(Point::new(0.1 * f64::from(step), 10.0), None);
        let hidden = || measurement(Point::new(0.0, 11.5), Some([260.0, 285.0, 350.0, 290.0]));
        let mut track = TrackGate::default();
        let statuses: Vec<FrameStatus> = [hidden(), hidden(), good(2), good(3)]
            .into_iter()
            .zip([0.0, 300.0, 600.0, 900.0])
            .map(|(measurement, time_s)| track.gate(measurement, time_s).0)
            .collect();
        assert_eq!(statuses, [FrameStatus::Ok, FrameStatus::Ok, FrameStatus::Ambiguous, FrameStatus::Ok]);
        // A first tip that is occluded is rejected until a second one agrees.
        let mut track = TrackGate::default();
        let occluded = PlantMeasurement { is_occluded: true, ..good(0) };
        assert_eq!(track.gate(occluded.clone(), 0.0).0, FrameStatus::Ambiguous);
        assert_eq!(track.clone().gate(occluded, 300.0).0, FrameStatus::Ok);
        assert_eq!(track.gate(good(1), 300.0).0, FrameStatus::Ok);
    }

    #[test]
    fn changes_far_from_the_tip_do_not_count() {
        let mut track = tracked(8);
        let fallen = measurement(Point::new(0.8, 10.4), Some([200.0, 390.0, 300.0, 390.0]));
        assert_eq!(track.gate(fallen, 2_400.0).0, FrameStatus::Ok);
    }

    #[test]
    fn a_jump_is_accepted_when_two_agree() {
        let mut track = tracked(8);
        // The highest point changes from one leaf to another; both were there all along.
        let wide = |tip| PlantMeasurement {
            tip: in_pixels(tip),
            ..measurement(Point::new(0.0, 10.0), Some([240.0, 300.0, 340.0, 300.0]))
        };
        track.accept(in_pixels(Point::new(4.0, 10.0)), 2_400.0);
        track.remember_appearance(wide(Point::default()));
        assert_eq!(track.gate(wide(Point::new(-6.0, 10.0)), 2_700.0).0, FrameStatus::Jump);
        assert_eq!(track.gate(wide(Point::new(-6.0, 10.1)), 3_000.0).0, FrameStatus::Ok);
    }

    #[test]
    fn longer_intervals_widen_the_gate() {
        let far = Point::new(4.0, 10.0);
        let status = |track: &mut TrackGate, time_s| {
            track
                .gate(
                    PlantMeasurement { tip: in_pixels(far), ..measurement(Point::new(0.1, 10.05), None) },
                    time_s,
                )
                .0
        };
        assert_eq!(status(&mut tracked(2), 600.0), FrameStatus::Jump);
        assert_eq!(status(&mut tracked(2), 1_500.0), FrameStatus::Ok);
    }
}
