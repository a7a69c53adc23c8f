//! What a plant remembers: means over windows of the past.

use crate::math::Real;

/// From how many steps back to before how many steps back.
pub(super) type Window = [usize; 2];

/// A window of minutes in steps of `period_min` minutes, at least one.
pub(super) fn steps_of_window([newest, oldest]: [f64; 2], period_min: f64) -> Window {
    let newest = (newest / period_min).round() as usize;
    [newest, ((oldest / period_min).round() as usize).max(newest + 1)]
}

/// Numbers of each step so far, along each axis, as sums up to each step (prefix sums): a mean over any window costs one
/// difference. Before the first step all were 0.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct History<const AXES: usize, const N: usize, R = f64> {
    /// A ring of the latest steps, as far back as windows reach.
    sums: Vec<[[R; N]; AXES]>,
    latest: usize,
}

impl<const AXES: usize, const N: usize, R: Real> History<AXES, N, R> {
    /// A history for windows that reach back by `oldest` steps.
    pub(super) fn new(oldest: usize) -> Self {
        Self { sums: vec![[[R::splat(0.0); N]; AXES]; oldest + 1], latest: 0 }
    }

    /// Forgets all steps of the plant in a lane.
    pub(super) fn forget(&mut self, lane: usize) {
        self.sums.iter_mut().flatten().flatten().for_each(|sum| sum.set_lane(lane, 0.0));
    }

    #[inline(always)]
    fn until(&self, steps_back: usize) -> &[[R; N]; AXES] {
        let wrapped = if steps_back > self.latest { self.sums.len() } else { 0 };
        &self.sums[self.latest + wrapped - steps_back]
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, numbers: [[R; N]; AXES]) {
        let mut sums = *self.until(0);
        for axis in 0..AXES {
            for number in 0..N {
                sums[axis][number] += numbers[axis][number];
            }
        }
        self.latest = if self.latest + 1 == self.sums.len() { 0 } else { self.latest + 1 };
        self.sums[self.latest] = sums;
    }

    /// Means over a window; 0 steps back is the latest step.
    #[inline(always)]
    pub(crate) fn mean(&self, [newest, oldest]: Window) -> [[R; N]; AXES] {
        let (mut means, before) = (*self.until(newest), self.until(oldest));
        let share = 1.0 / (oldest - newest) as f64;
        for axis in 0..AXES {
            for number in 0..N {
                means[axis][number] = (means[axis][number] - before[axis][number]) * share;
            }
        }
        means
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_minutes_whatever_the_period() {
        let windows = [[0.0, 5.0], [5.0, 15.0], [15.0, 30.0], [30.0, 50.0], [50.0, 70.0]];
        let windows = |period| windows.map(|window| steps_of_window(window, period));
        assert_eq!(windows(5.0), [[0, 1], [1, 3], [3, 6], [6, 10], [10, 14]]);
        assert_eq!(windows(2.5), [[0, 2], [2, 6], [6, 12], [12, 20], [20, 28]]);
        assert_eq!(windows(30.0), [[0, 1], [0, 1], [1, 2], [1, 2], [2, 3]]);
    }

    #[test]
    fn means_are_those_of_the_steps_in_the_window() {
        for oldest in [7, 8, 100] {
            let mut history = History::<1, 2>::new(oldest);
            (1..=5).for_each(|number| history.add([[f64::from(number), -1.0]]));
            assert_eq!(history.mean([0, 1]), [[5.0, -1.0]]);
            assert_eq!(history.mean([1, 3]), [[3.5, -1.0]]);
            // Two of the four steps lie before the first one.
            assert_eq!(history.mean([3, 7]), [[0.75, -0.5]]);
            (6..=50).for_each(|number| history.add([[f64::from(number), -1.0]]));
            assert_eq!(history.mean([3, 7]), [[45.5, -1.0]]);
            history.forget(0);
            assert_eq!(history.mean([0, 7]), [[0.0, 0.0]]);
        }
    }
}
