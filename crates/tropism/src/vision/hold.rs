//! The history rule, eq. (11): a stem that jumps is replaced by the one before.

use serde::{Deserialize, Serialize};

use crate::geometry::Polyline;

/// The bounds of eq. (11), as shares of the stem's length L at this step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HoldConfig {
    /// A change of L of this share or more is an error: 0.25.
    pub length: f64,
    /// A step of the starting vertex S of this share of L or more is an error: 0.25.
    pub start: f64,
    /// A step of the ending vertex E of this share of L or more is an error: 0.5.
    pub end: f64,
    /// Held steps in a row after which the new stem is believed; `None` never, as in the paper, where one bad picture
    /// can then hold for ever.
    pub release: Option<u32>,
}

impl Default for HoldConfig {
    fn default() -> Self {
        Self { length: 0.25, start: 0.25, end: 0.5, release: None }
    }
}

impl HoldConfig {
    /// Whether eq. (11) calls `now` an error after `before`.
    ///
    /// ```
    /// use tropism::geometry::{Point, Polyline};
    /// use tropism::vision::hold::HoldConfig;
    /// let stem = |top: f64| Polyline(vec![Point::new(0.0, 0.0), Point::new(0.0, top)]);
    /// assert!(!HoldConfig::default().is_error(&stem(10.0), &stem(9.0)));
    /// assert!(HoldConfig::default().is_error(&stem(12.0), &stem(9.0)));
    /// ```
    #[must_use]
    pub fn is_error(&self, now: &Polyline, before: &Polyline) -> bool {
        let (Some(start), Some(end)) = (now.0.first(), now.0.last()) else { return true };
        let (Some(old_start), Some(old_end)) = (before.0.first(), before.0.last()) else { return false };
        let length = now.length();
        (length - before.length()).abs() >= self.length * length
            || start.distance(*old_start) >= self.start * length
            || end.distance(*old_end) >= self.end * length
    }
}

/// The stem of the step before, and how long it has been held.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hold {
    last: Option<Polyline>,
    held: u32,
}

impl Hold {
    /// The stem of this step: the one seen, or "a duplicate of timestep t - 1" where eq. (11) says so or none was seen;
    /// and whether it is a duplicate. Without a `rule` every stem that is seen is believed.
    pub fn settle(&mut self, seen: Option<Polyline>, rule: Option<&HoldConfig>) -> (Option<Polyline>, bool) {
        let is_released = rule.and_then(|rule| rule.release).is_some_and(|steps| self.held >= steps);
        let is_error =
            |now: &Polyline, before: &Polyline| rule.is_some_and(|rule| rule.is_error(now, before));
        let believed =
            seen.filter(|now| is_released || self.last.as_ref().is_none_or(|before| !is_error(now, before)));
        let is_duplicate = believed.is_none();
        self.held = if is_duplicate { self.held.saturating_add(1) } else { 0 };
        self.last = believed.or_else(|| self.last.take());
        (self.last.clone(), is_duplicate)
    }

    /// Takes the stem of a step that was settled before an interruption: one that repeats the step before was held.
    pub fn resume(&mut self, stem: Option<&Polyline>) {
        let is_duplicate = self.last.as_ref() == stem;
        self.held = if is_duplicate { self.held.saturating_add(1) } else { 0 };
        self.last = stem.cloned();
    }
}

/// Photographs in a row in which a held tip may steer; after that nobody knows where the plant is.
///
/// In three periods of five minutes a bean's tip moves by some millimetres, and rarely by more than a centimetre.
pub const STEERS: u32 = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn stem(points: &[(f64, f64)]) -> Polyline {
        Polyline(points.iter().map(|&(x, y)| Point::new(x, y)).collect())
    }

    #[test]
    fn each_clause_of_eq_11_holds_on_its_own() {
        let rule = HoldConfig::default();
        let before = stem(&[(0.0, 0.0), (0.0, 10.0)]);
        assert!(!rule.is_error(&stem(&[(0.0, 0.0), (4.0, 9.0)]), &before));
        // Length: 10 after 7.5 is exactly a quarter of L, and >= holds.
        assert!(rule.is_error(&before, &stem(&[(0.0, 0.0), (0.0, 7.5)])));
        assert!(rule.is_error(&stem(&[(2.5, 0.0), (2.5, 10.0)]), &before));
        // The end moves by 5.06 at a length of 10.
        assert!(rule.is_error(&stem(&[(0.0, 0.0), (4.9, 8.72)]), &before));
    }

    #[test]
    fn an_error_is_replaced_and_released_only_where_told() {
        let (good, jump) = (stem(&[(0.0, 0.0), (0.0, 10.0)]), stem(&[(0.0, 0.0), (0.0, 20.0)]));
        let (mut paper, mut released) = (Hold::default(), Hold::default());
        let (never, twice) =
            (HoldConfig::default(), HoldConfig { release: Some(2), ..HoldConfig::default() });
        assert_eq!(paper.settle(None, Some(&never)), (None, true));
        assert_eq!(paper.settle(Some(good.clone()), Some(&never)), (Some(good.clone()), false));
        released.settle(Some(good.clone()), Some(&twice));
        for _ in 0..2 {
            assert_eq!(paper.settle(Some(jump.clone()), Some(&never)), (Some(good.clone()), true));
            assert_eq!(released.settle(Some(jump.clone()), Some(&twice)), (Some(good.clone()), true));
        }
        assert_eq!(paper.settle(Some(jump.clone()), Some(&never)).0, Some(good));
        assert_eq!(released.settle(Some(jump.clone()), Some(&twice)), (Some(jump.clone()), false));
        assert_eq!(paper.settle(Some(jump.clone()), None), (Some(jump), false));
    }

    #[test]
    fn a_hold_that_is_resumed_goes_on_as_if_it_had_not_been() {
        let rule = HoldConfig { release: Some(2), ..HoldConfig::default() };
        let (good, jump) = (stem(&[(0.0, 0.0), (0.0, 10.0)]), stem(&[(0.0, 0.0), (0.0, 20.0)]));
        let mut hold = Hold::default();
        let seen = [None, Some(good), Some(jump.clone()), None, Some(jump)];
        for interruption in 0..seen.len() {
            let mut resumed = Hold::default();
            let mut hold = hold.clone();
            for (step, now) in seen.iter().enumerate() {
                let settled = hold.settle(now.clone(), Some(&rule));
                if step < interruption {
                    resumed.resume(settled.0.as_ref());
                } else {
                    assert_eq!(resumed.settle(now.clone(), Some(&rule)), settled);
                }
                assert_eq!(resumed, hold);
            }
        }
        hold.resume(None);
        assert_eq!(hold.held, 1);
    }
}
