//! Diagram of reliability: how often answers of a confidence are right.

use std::fmt;

use crate::share::Share;

/// Upper ends of the bins of confidence, the last with 1.
const BINS: [f64; 7] = [0.5, 0.7, 0.8, 0.9, 0.95, 0.98, f64::INFINITY];

/// Answers as pairs of confidence and whether each is right.
#[derive(Default)]
pub(crate) struct Reliability(Vec<(f64, bool)>);

impl Extend<(f64, bool)> for Reliability {
    fn extend<T: IntoIterator<Item = (f64, bool)>>(&mut self, answers: T) {
        self.0.extend(answers);
    }
}

impl fmt::Display for Reliability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut low = 0.0;
        for high in BINS {
            let within: Vec<_> = self.0.iter().filter(|(p, _)| (low..high).contains(p)).collect();
            let mean = within.iter().map(|(p, _)| p).sum::<f64>() / within.len().max(1) as f64;
            write!(
                f,
                "from {low} (mean {mean:.2}) right {}; ",
                Share::of(within.iter().map(|(_, is_right)| *is_right))
            )?;
            low = high;
        }
        Ok(())
    }
}
