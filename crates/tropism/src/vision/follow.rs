//! Whether the plant can be where a photograph shows it, given where it was.
//!
//! In: what each photograph shows, in order. Out: what of it is believed. The one idea: a plant moves steadily and by
//! little, and its tissue neither appears nor vanishes, so what a leaf, a fly or a lamp's glare does to a picture gives
//! itself away as soon as the one before is known.

use crate::geometry::Point;
use crate::math;
use crate::vision::shape::Shape;
use crate::vision::{Calibration, Class};

/// Minutes between two photographs unless their times say otherwise (section 2.2.2).
const PERIOD_MIN: f64 = 5.0;

/// How far a tip can move in a period, in cm: no bean was seen to move faster.
const GATE: f64 = 2.2;

/// How far from where it is expected a tip is believed whatever else has changed, in cm, after one period and for each
/// further one, and at most: below half a centimetre nothing is called wrong.
const NEAR: (f64, f64, f64) = (0.3, 0.05, 0.45);

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

/// Photographs that must agree before a jump is believed, and before a plant is believed that looks otherwise.
const AGREE: (usize, usize) = (2, 5);

/// A tip farther than this from where it was expected has jumped, in cm a period.
const STEADY: f64 = 0.8;

/// Deviation of a measured tip, in cm, and of what its velocity gains in a period, in cm per period.
const NOISE: (f64, f64) = (0.05, 0.06);

/// What a photograph shows of a plant, in cm.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Glimpse {
    pub(super) tip: Point,
    pub(super) shape: Shape,
    /// Whether something lies on the tip.
    pub(super) is_veiled: bool,
    pub(super) calibration: Calibration,
}

/// A tip that moves at a constant velocity but for chance: a Kalman filter, the same for both axes (R. E. Kalman 1960,
/// doi:10.1115/1.3662552).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Motion {
    tip: Point,
    /// cm per period.
    velocity: Point,
    /// Covariances: place, place with velocity, velocity.
    spread: [f64; 3],
}

impl Motion {
    fn begin(tip: Point) -> Self {
        Self { tip, velocity: Point::default(), spread: [NOISE.0 * NOISE.0, 0.0, 0.1] }
    }

    /// Where the tip is to be expected after so many periods. Far ahead the velocity says nothing any more.
    fn expected(&self, periods: f64) -> Point {
        let ahead = periods.min(2.0);
        Point::new(self.tip.x + ahead * self.velocity.x, self.tip.y + ahead * self.velocity.y)
    }

    fn measured(&self, tip: Point, periods: f64) -> Self {
        let [pp, pv, vv] = self.spread;
        let gain = NOISE.1 * NOISE.1 * periods;
        let pp = pp + 2.0 * periods * pv + periods * periods * vv + gain * periods * periods / 3.0;
        let (pv, vv) = (pv + periods * vv + gain * periods / 2.0, vv + gain);
        let sum = pp + NOISE.0 * NOISE.0;
        let (place, speed) = (pp / sum, pv / sum);
        let expected =
            Point::new(self.tip.x + periods * self.velocity.x, self.tip.y + periods * self.velocity.y);
        let (dx, dy) = (tip.x - expected.x, tip.y - expected.y);
        Self {
            tip: Point::new(expected.x + place * dx, expected.y + place * dy),
            velocity: Point::new(self.velocity.x + speed * dx, self.velocity.y + speed * dy),
            spread: [pp * (1.0 - place), pv * (1.0 - place), vv - speed * pv],
        }
    }
}

/// What is known of a plant from the photographs so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Follow {
    motion: Option<Motion>,
    /// The plant in the latest photograph that was believed.
    shape: Option<Shape>,
    /// Time of that photograph, in seconds.
    time_s: f64,
    /// What the latest photograph showed if it was not believed, how many before it agree with each other, and it with
    /// them.
    doubted: Option<(Glimpse, usize)>,
}

impl Follow {
    /// Whether what a photograph shows is believed, and how well it fits what is known, 0 to 1.
    pub(super) fn judge(&mut self, glimpse: Glimpse, time_s: f64) -> (Class, f64) {
        let Some(motion) = self.motion else {
            self.believe(glimpse.tip, Some(glimpse.shape), time_s);
            return (Class::Ok, 1.0);
        };
        let periods = self.periods(time_s);
        let miss = motion.expected(periods).distance(glimpse.tip);
        let grows = |(one, more, most): (f64, f64, f64)| (one + more * (periods - 1.0).max(0.0)).min(most);
        let is_otherwise = glimpse.is_veiled
            || self.shape.as_ref().is_some_and(|shape| is_changed(&glimpse, shape, motion.tip));
        let gate = if is_otherwise { grows(NEAR) } else { GATE * periods.max(1.0) };
        let fit = math::exp(-0.5 * (miss / gate.max(0.1)) * (miss / gate.max(0.1)));
        if miss <= gate {
            self.believe(glimpse.tip, Some(glimpse.shape), time_s);
            return (Class::Ok, fit);
        }
        let alike = match &self.doubted {
            Some((before, count)) if !glimpse.is_veiled && agree(&glimpse, before) => count + 1,
            _ => 1,
        };
        if alike >= if is_otherwise { AGREE.1 } else { AGREE.0 } {
            self.believe(glimpse.tip, Some(glimpse.shape), time_s);
            return (Class::Ok, 0.5);
        }
        let class = if miss > GATE * periods.max(1.0) { Class::Jump } else { Class::Ambiguous };
        self.doubted = Some((glimpse, alike));
        (class, fit)
    }

    /// Takes up how the plant looks in the latest photograph that was believed.
    pub(super) fn recognise(&mut self, shape: Shape) {
        self.shape = Some(shape);
    }

    /// Takes a measured tip for true.
    pub(super) fn believe(&mut self, tip: Point, shape: Option<Shape>, time_s: f64) {
        let periods = self.periods(time_s);
        // What is believed after a jump says nothing about velocity.
        let is_steady = |motion: &Motion| motion.expected(periods).distance(tip) <= STEADY * periods.max(1.0);
        let motion = self.motion.filter(is_steady);
        self.motion = Some(motion.map_or_else(|| Motion::begin(tip), |motion| motion.measured(tip, periods)));
        (self.shape, self.time_s, self.doubted) = (shape, time_s, None);
    }

    /// Periods since the latest photograph that was believed; one where times say nothing.
    fn periods(&self, time_s: f64) -> f64 {
        let periods = (time_s - self.time_s) / (60.0 * PERIOD_MIN);
        if periods > 0.0 { periods } else { 1.0 }
    }
}

/// Whether tissue appeared or vanished: some is farther from where some was than the tip has moved, more came than went,
/// or the plant drew back along itself.
fn is_changed(glimpse: &Glimpse, before: &Shape, tip: Point) -> bool {
    let moved = glimpse.tip.distance(tip);
    let square = glimpse.calibration.px_per_cm * glimpse.calibration.px_per_cm;
    let most = CHANGE * square;
    let around = |shape: &Shape, tip: Point| {
        shape.within(glimpse.calibration.pixel(tip), AROUND * glimpse.calibration.px_per_cm)
    };
    let (here, there) = (around(&glimpse.shape, glimpse.tip), around(before, tip));
    let came = |reach: f64| here.beyond(before, reach * glimpse.calibration.px_per_cm);
    let went = |reach: f64| there.beyond(&glimpse.shape, reach * glimpse.calibration.px_per_cm);
    let far = moved.clamp(MOVES, GATE);
    let (new, gone) = (came(MOVES / 2.0), went(MOVES / 2.0));
    let is_at = |shape: &Shape, at: Point| shape.is_near(glimpse.calibration.pixel(at));
    let draws_back = moved > NEAR.0 && is_at(before, glimpse.tip) && !is_at(&glimpse.shape, tip);
    draws_back || came(far).max(went(far)) > most || (new - gone).abs() > most + UNEVEN * new.min(gone)
}

/// Whether two photographs in a row show the same plant.
fn agree(one: &Glimpse, other: &Glimpse) -> bool {
    let moved = one.tip.distance(other.tip);
    let most = ALIKE * one.shape.area().max(other.shape.area());
    let reach = moved.max(MOVES) * one.calibration.px_per_cm;
    moved <= GATE && one.shape.beyond(&other.shape, reach).max(other.shape.beyond(&one.shape, reach)) <= most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pixel;

    /// A stem of 10 px a cm, and whatever else is in the picture, from one place to another.
    fn glimpse(tip: Point, more: Option<[f64; 4]>) -> Glimpse {
        let base = Pixel::new(300.0, 400.0);
        let calibration = Calibration::flat(base, 10.0, 648, 486);
        let line = |from: [f64; 2], to: [f64; 2]| {
            (0..=200).map(move |i| {
                let share = f64::from(i) / 200.0;
                Pixel::new(from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1]))
            })
        };
        let stem = line([300.0, 400.0], [300.0 + 10.0 * tip.x, 400.0 - 10.0 * tip.y]);
        let more = more.into_iter().flat_map(|[a, b, c, d]| line([a, b], [c, d]));
        Glimpse { tip, shape: Shape::of(stem.chain(more), 2.5), is_veiled: false, calibration }
    }

    fn followed(steps: u32) -> Follow {
        let mut follow = Follow::default();
        for step in 0..steps {
            let tip = Point::new(0.1 * f64::from(step), 10.0 + 0.05 * f64::from(step));
            assert_eq!(follow.judge(glimpse(tip, None), 300.0 * f64::from(step)).0, Class::Ok);
        }
        follow
    }

    #[test]
    fn a_leaf_in_front_is_doubted_until_it_has_stayed() {
        let mut follow = followed(8);
        let hidden = || glimpse(Point::new(0.8, 11.5), Some([260.0, 285.0, 350.0, 290.0]));
        for step in 8..12 {
            assert_eq!(follow.judge(hidden(), 300.0 * f64::from(step)).0, Class::Ambiguous, "{step}");
        }
        assert_eq!(follow.judge(hidden(), 3_600.0).0, Class::Ok);
    }

    #[test]
    fn what_is_far_from_the_tip_does_not_matter() {
        let mut follow = followed(8);
        let fallen = glimpse(Point::new(0.8, 10.4), Some([200.0, 390.0, 300.0, 390.0]));
        assert_eq!(follow.judge(fallen, 2_400.0).0, Class::Ok);
    }

    #[test]
    fn a_jump_is_believed_when_two_agree() {
        let mut follow = followed(8);
        // The highest point goes over from one leaf to the other: both were there all along.
        let wide =
            |tip| Glimpse { tip, ..glimpse(Point::new(0.0, 10.0), Some([240.0, 300.0, 340.0, 300.0])) };
        follow.believe(Point::new(4.0, 10.0), Some(wide(Point::default()).shape), 2_400.0);
        assert_eq!(follow.judge(wide(Point::new(-6.0, 10.0)), 2_700.0).0, Class::Jump);
        assert_eq!(follow.judge(wide(Point::new(-6.0, 10.1)), 3_000.0).0, Class::Ok);
    }

    #[test]
    fn longer_intervals_let_it_move_farther() {
        let far = Point::new(4.0, 10.0);
        let shown = |follow: &mut Follow, time_s| {
            follow.judge(Glimpse { tip: far, ..glimpse(Point::new(0.1, 10.05), None) }, time_s).0
        };
        assert_eq!(shown(&mut followed(2), 600.0), Class::Jump);
        assert_eq!(shown(&mut followed(2), 1_500.0), Class::Ok);
    }
}
