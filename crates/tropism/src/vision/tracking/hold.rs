//! Holding the last stem, eq. (11), and the limit for tips carried forward.
//!
//! In: the stem detected at each step. Out: that stem, or "a duplicate of timestep t - 1" where it is an error
//! (section 4).

use crate::geometry::Polyline;
use crate::vision::config::HoldConfig;

impl HoldConfig {
    /// Whether `now` is an error after `before`, by eq. (11).
    ///
    /// ```
    /// use tropism::geometry::{Point, Polyline};
    /// use tropism::vision::config::HoldConfig;
    /// let stem = |top: f64| Polyline(vec![Point::new(0.0, 0.0), Point::new(0.0, top)]);
    /// assert!(!HoldConfig::default().is_error(&stem(10.0), &stem(9.0)));
    /// assert!(HoldConfig::default().is_error(&stem(12.0), &stem(9.0)));
    /// ```
    #[must_use]
    pub fn is_error(&self, now: &Polyline, before: &Polyline) -> bool {
        let (Some(start), Some(end)) = (now.0.first(), now.0.last()) else { return true };
        let (Some(start_before), Some(end_before)) = (before.0.first(), before.0.last()) else {
            return false;
        };
        let length = now.length();
        (length - before.length()).abs() >= self.length * length
            || start.distance(*start_before) >= self.start * length
            || end.distance(*end_before) >= self.end * length
    }
}

/// The stem of the step before, and the number of steps for which it has been held.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StemHold {
    last: Option<Polyline>,
    carried_forward: u32,
}

impl StemHold {
    /// The stem of this step: the detected one, or the one before where none is detected or eq. (11) calls it an error.
    /// Without a `rule` every detected stem is accepted.
    pub fn update(&mut self, detected: Option<Polyline>, rule: Option<&HoldConfig>) -> Option<Polyline> {
        let is_released =
            rule.and_then(|rule| rule.release).is_some_and(|steps| self.carried_forward >= steps);
        let is_error =
            |now: &Polyline, before: &Polyline| rule.is_some_and(|rule| rule.is_error(now, before));
        let is_plausible = |now: &Polyline| self.last.as_ref().is_none_or(|before| !is_error(now, before));
        let accepted = detected.filter(|now| is_released || is_plausible(now));
        self.carried_forward = if accepted.is_none() { self.carried_forward.saturating_add(1) } else { 0 };
        self.last = accepted.or_else(|| self.last.take());
        self.last.clone()
    }

    /// Whether the stem of the latest step is that of a step before, or none.
    pub(in crate::vision) const fn is_carried_forward(&self) -> bool {
        self.carried_forward > 0
    }

    /// Takes the stem of a step from before an interruption: one that repeats the step before was held.
    pub fn resume(&mut self, stem: Option<&Polyline>) {
        let is_carried_forward = stem.is_none() || self.last.as_ref() == stem;
        self.carried_forward = if is_carried_forward { self.carried_forward.saturating_add(1) } else { 0 };
        self.last = stem.cloned();
    }
}

/// Greatest number of photographs in a row in which a tip carried forward may steer the lamps.
///
/// Chosen: 3. In three periods of five minutes a bean's tip moves some millimetres, and rarely more than a
/// centimetre.
pub const MAX_HELD_FRAMES: u32 = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn stem(points: &[(f64, f64)]) -> Polyline {
        Polyline(points.iter().map(|&(x, y)| Point::new(x, y)).collect())
    }

    #[test]
    fn each_clause_of_eq_11_applies_on_its_own() {
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
    fn an_error_is_replaced_and_released_only_where_configured() {
        let (good, jump) = (stem(&[(0.0, 0.0), (0.0, 10.0)]), stem(&[(0.0, 0.0), (0.0, 20.0)]));
        let (mut paper, mut released) = (StemHold::default(), StemHold::default());
        let (never, twice) =
            (HoldConfig::default(), HoldConfig { release: Some(2), ..HoldConfig::default() });
        assert_eq!((paper.update(None, Some(&never)), paper.is_carried_forward()), (None, true));
        for hold in [&mut paper, &mut released] {
            assert_eq!(hold.update(Some(good.clone()), Some(&never)), Some(good.clone()));
        }
        for _ in 0..2 {
            assert_eq!(paper.update(Some(jump.clone()), Some(&never)), Some(good.clone()));
            assert_eq!(released.update(Some(jump.clone()), Some(&twice)), Some(good.clone()));
        }
        assert_eq!(paper.update(Some(jump.clone()), Some(&never)), Some(good));
        assert_eq!(released.update(Some(jump.clone()), Some(&twice)), Some(jump.clone()));
        assert!(paper.is_carried_forward() && !released.is_carried_forward());
        assert_eq!(paper.update(Some(jump.clone()), None), Some(jump));
    }
}
