//! The terms of the line: what the change of a score depends on.
//!
//! The line is linear in these terms, along each axis alone:
//!
//! | place | terms |
//! |---|---|
//! | [`LIGHT`] | mean light over five windows, these times L, and these times L² |
//! | [`SCORES`] | three scores, these times L, and these times L² |
//! | [`CUBES`] | each score times the square of its size |
//! | [`CHANGES`] | mean change of the three scores over four windows |
//!
//! L is the length of the stem, from -1 to 1 over the range of lengths. In a mirror, or turned about the vertical, the terms
//! turn as the light and the scores do.

use super::history::{History, Window, steps_of_window};
use super::shape::{MODES, Scores};
use crate::math::Real;

/// Windows over which the light is averaged, in minutes before the end of the step: at five minutes a step these are step 1,
/// steps 2-3, 4-6, 7-10 and 11-14 back. The first is the step itself. Chosen: longer ones were no better.
const LIGHT_WINDOWS_MIN: [[f64; 2]; 5] = [[0.0, 5.0], [5.0, 15.0], [15.0, 30.0], [30.0, 50.0], [50.0, 70.0]];

/// Windows over which past changes of the scores are averaged, in minutes before the step. Chosen with those of the light.
const CHANGE_WINDOWS_MIN: [[f64; 2]; 4] = [[0.0, 5.0], [5.0, 15.0], [15.0, 30.0], [30.0, 60.0]];

/// Minutes of light by which a block of residuals is chosen to be like the plant now. Chosen: see
/// [`LIKE_LIGHT_WEIGHT`](super::replay::LIKE_LIGHT_WEIGHT).
const LIKE_LIGHT_MIN: f64 = 50.0;

/// Length around which the response is expanded, in cm, and the scale of its change: the middle and half of the range of
/// lengths, 4 to 14 cm.
pub(super) const MIDDLE_LENGTH_CM: f64 = 9.0;
const LENGTH_SCALE_CM: f64 = 5.0;

/// Place of the terms of the light, to which the gain of a plant applies.
const LIGHT: usize = 0;
/// Place of the terms of the scores.
const SCORES: usize = LIGHT + 3 * LIGHT_WINDOWS_MIN.len();
/// Place of the cubes of the scores.
const CUBES: usize = SCORES + 3 * MODES;
/// Place of the past changes.
const CHANGES: usize = CUBES + MODES;
/// Number of terms: 39.
pub(crate) const TERMS: usize = CHANGES + CHANGE_WINDOWS_MIN.len() * MODES;

/// The windows in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Windows {
    pub(super) like: Window,
    light: [Window; LIGHT_WINDOWS_MIN.len()],
    changes: [Window; CHANGE_WINDOWS_MIN.len()],
}

impl Windows {
    pub(super) fn of(period_min: f64) -> Self {
        let steps = |window| steps_of_window(window, period_min);
        Self {
            like: steps([0.0, LIKE_LIGHT_MIN]),
            light: LIGHT_WINDOWS_MIN.map(steps),
            changes: CHANGE_WINDOWS_MIN.map(steps),
        }
    }

    /// Steps for which the light is remembered.
    pub(super) fn oldest_light(&self) -> usize {
        self.light[self.light.len() - 1][1].max(self.like[1])
    }

    /// Steps for which changes are remembered.
    pub(super) fn oldest_change(&self) -> usize {
        self.changes[self.changes.len() - 1][1]
    }

    /// The terms along each axis.
    #[inline(always)]
    pub(super) fn terms<const AXES: usize, R: Real>(
        &self,
        light: &History<AXES, 1, R>,
        length_cm: R,
        scores: [Scores<R>; AXES],
        changes: &History<AXES, MODES, R>,
    ) -> [[R; TERMS]; AXES] {
        let length = (length_cm - MIDDLE_LENGTH_CM) / LENGTH_SCALE_CM;
        let powers = [R::splat(1.0), length, length * length];
        let mut terms = [[R::splat(0.0); TERMS]; AXES];
        for window in 0..self.light.len() {
            let means = light.mean(self.light[window]);
            for axis in 0..AXES {
                for power in 0..3 {
                    terms[axis][LIGHT + power * self.light.len() + window] = powers[power] * means[axis][0];
                }
            }
        }
        for mode in 0..MODES {
            let mut square = R::splat(0.0);
            for axis in 0..AXES {
                square += scores[axis][mode] * scores[axis][mode];
            }
            for axis in 0..AXES {
                for power in 0..3 {
                    terms[axis][SCORES + power * MODES + mode] = powers[power] * scores[axis][mode];
                }
                terms[axis][CUBES + mode] = square * scores[axis][mode];
            }
        }
        for window in 0..self.changes.len() {
            let means = changes.mean(self.changes[window]);
            for axis in 0..AXES {
                for mode in 0..MODES {
                    terms[axis][CHANGES + window * MODES + mode] = means[axis][mode];
                }
            }
        }
        terms
    }
}

/// The products of weights and terms; those of the light apply with a gain.
#[inline(always)]
pub(super) fn expected<R: Real>(weights: &[R; TERMS], terms: &[R; TERMS], gain: R) -> R {
    let (mut of_light, mut others) = (R::splat(0.0), R::splat(0.0));
    for term in LIGHT..SCORES {
        of_light += weights[term] * terms[term];
    }
    for term in SCORES..TERMS {
        others += weights[term] * terms[term];
    }
    gain * of_light + others
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_term_has_a_place_of_its_own() {
        let windows = Windows::of(5.0);
        let (mut light, mut changes) = (History::new(14), History::new(12));
        for step in 0..20 {
            light.add([[0.1 + f64::from(step)]]);
            changes.add([[1.0, 2.0, 3.0].map(|factor| factor * (0.3 + f64::from(step * step)))]);
        }
        let [terms] = windows.terms(&light, 13.0, [[0.5, 0.7, 1.1]], &changes);
        let mut sorted = terms;
        sorted.sort_by(f64::total_cmp);
        assert!(sorted[0] > 0.0 && sorted.windows(2).all(|pair| pair[0] < pair[1]), "{terms:?}");
        assert_eq!((TERMS, terms[CUBES]), (39, 0.125));
        assert!((terms[LIGHT] - 19.1).abs() < 1e-9);
    }
}
