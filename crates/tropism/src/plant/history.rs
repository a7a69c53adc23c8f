//! What a plant remembers: means over windows of the past.

/// Windows over which the light is averaged, in minutes before the end of the step: at five minutes a step these are step 1,
/// steps 2-3, 4-6, 7-10 and 11-14 back. The first is the step itself. They stood in the first version of the models with
/// memory; longer ones were no better.
pub(super) const LIGHT_WINDOWS_MIN: [[f64; 2]; 5] =
    [[0.0, 5.0], [5.0, 15.0], [15.0, 30.0], [30.0, 50.0], [50.0, 70.0]];

/// From how many steps back to before how many steps back.
pub(super) type Window = [usize; 2];

/// A window of minutes in steps of `period_min` minutes, at least one.
pub(super) fn steps_of_window([newest, oldest]: [f64; 2], period_min: f64) -> Window {
    let newest = (newest / period_min).round() as usize;
    [newest, ((oldest / period_min).round() as usize).max(newest + 1)]
}

/// Some numbers of each step so far. Before the first step all were 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct History<const N: usize> {
    /// Sums up to each step.
    sums: Vec<[f64; N]>,
}

impl<const N: usize> History<N> {
    pub(super) const fn new() -> Self {
        Self { sums: Vec::new() }
    }

    pub(super) fn add(&mut self, numbers: [f64; N]) {
        let last = self.sums.last().copied().unwrap_or([0.0; N]);
        self.sums.push(core::array::from_fn(|at| last[at] + numbers[at]));
    }

    /// Means over a window; 0 steps back is the latest step.
    pub(super) fn mean(&self, [newest, oldest]: Window) -> [f64; N] {
        let sum_until =
            |back: usize| self.sums.len().checked_sub(back + 1).map_or([0.0; N], |at| self.sums[at]);
        let (until, before) = (sum_until(newest), sum_until(oldest));
        core::array::from_fn(|at| (until[at] - before[at]) / (oldest - newest) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_minutes_whatever_the_period() {
        let windows = |period| LIGHT_WINDOWS_MIN.map(|window| steps_of_window(window, period));
        assert_eq!(windows(5.0), [[0, 1], [1, 3], [3, 6], [6, 10], [10, 14]]);
        assert_eq!(windows(2.5), [[0, 2], [2, 6], [6, 12], [12, 20], [20, 28]]);
        assert_eq!(windows(30.0), [[0, 1], [0, 1], [1, 2], [1, 2], [2, 3]]);
    }

    #[test]
    fn means_are_those_of_the_steps_in_the_window() {
        let mut history = History::new();
        (1..=5).for_each(|number| history.add([f64::from(number), -1.0]));
        assert_eq!(history.mean([0, 1]), [5.0, -1.0]);
        assert_eq!(history.mean([1, 3]), [3.5, -1.0]);
        // Two of the four steps lie before the first one.
        assert_eq!(history.mean([3, 7]), [0.75, -0.5]);
    }
}
