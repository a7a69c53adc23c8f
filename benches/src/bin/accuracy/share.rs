//! Shares with their uncertainty.

use std::fmt;

use tropism::math::statistics::wilson_interval;

/// A share of cases, with its 95 % interval.
#[derive(Clone, Copy)]
pub(crate) struct Share {
    count: usize,
    all: usize,
}

impl Share {
    /// The share of cases that are `true`.
    pub(crate) fn of(cases: impl IntoIterator<Item = bool>) -> Self {
        let add = |Self { count, all }, is_one| Self { count: count + usize::from(is_one), all: all + 1 };
        cases.into_iter().fold(Self { count: 0, all: 0 }, add)
    }

    /// The share in %, and the ends of its interval.
    fn percent(self) -> [f64; 3] {
        let (count, all) = (self.count as f64, self.all as f64);
        let [low, high] = wilson_interval(count, all);
        [count / all, low, high].map(|value| 100.0 * value)
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.all == 0 {
            return f.pad("0 of 0");
        }
        let [share, low, high] = self.percent();
        f.pad(&format!("{} of {}: {share:.0} % ({low:.0} to {high:.0})", self.count, self.all))
    }
}
