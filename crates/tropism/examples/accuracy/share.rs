//! Shares with their uncertainty.

use std::fmt;

/// 97.5 % quantile of the normal distribution: the interval holds 95 %.
const Z: f64 = 1.959_964;

/// A share of cases, with its 95 % interval.
///
/// # References
/// Wilson 1927, *Probable inference, the law of succession, and statistical inference*, doi:10.2307/2276774.
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
        let (n, share) = (self.all as f64, self.count as f64 / self.all as f64);
        let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        [share, middle - half, middle + half].map(|value| 100.0 * value)
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
