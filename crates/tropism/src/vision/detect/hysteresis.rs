//! How surely each sample is plant, by two thresholds.

use crate::wide::Work;

/// How surely a sample is plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Belief {
    /// Background.
    No,
    /// Plant if it hangs together with what surely is.
    Perhaps,
    /// Plant.
    Sure,
}

/// What is believed of each sample, by what its value must exceed.
pub(super) struct Believing<'a> {
    pub(super) values: &'a [f32],
    pub(super) perhaps: f32,
    pub(super) sure: f32,
}

impl Work for Believing<'_> {
    type Result = Vec<Belief>;

    #[inline(always)]
    fn work(self) -> Vec<Belief> {
        let Self { values, perhaps, sure } = self;
        let mut belief = vec![Belief::No; values.len()];
        for (belief, &value) in belief.iter_mut().zip(values) {
            let perhaps = if value > perhaps { Belief::Perhaps } else { Belief::No };
            *belief = if value > sure { Belief::Sure } else { perhaps };
        }
        belief
    }
}
