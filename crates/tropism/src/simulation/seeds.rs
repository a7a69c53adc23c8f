//! Networks such as NEAT begins with, side by side: one step neuron each.

use tropism_neat::LinearThreshold;

use super::lanes::Controllers;
use super::plants::{Course, Plants};
use crate::control::Controller;
use crate::control::network::INPUTS;
use crate::light::Light;
use crate::observation::Observation;

/// A network of nothing but an output that sees the inputs and the bias.
#[derive(Clone, Copy, Debug)]
pub struct Seed {
    /// Weights of x and y, and what the sum must exceed for the light to be right.
    pub output: LinearThreshold<INPUTS>,
    /// Weight of the bias.
    pub bias: f64,
}

impl Seed {
    fn is_right(&self, tip: [f64; INPUTS]) -> bool {
        self.output.fires(tip, self.bias)
    }
}

impl Controller for Seed {
    fn decide(&mut self, seen: &Observation) -> Light {
        if self.is_right([seen.tip.x, seen.tip.y]) { Light::Right } else { Light::Left }
    }
}

/// What each network senses, in single precision; and where that may not be good enough, the network itself.
#[repr(C, align(64))]
pub(super) struct Seeds<const LANES: usize> {
    weights: [[f32; LANES]; INPUTS],
    /// What the weighted sum must exceed.
    least: [f32; LANES],
    /// By how much it must be above or below that to be beyond doubt.
    doubt: [f32; LANES],
    exact: [Seed; LANES],
}

impl<const LANES: usize> Seeds<LANES> {
    pub(super) const fn none() -> Self {
        let still = Seed { output: LinearThreshold { weights: [0.0; INPUTS], threshold: 1.0 }, bias: 0.0 };
        Self {
            weights: [[0.0; LANES]; INPUTS],
            least: [1.0; LANES],
            doubt: [0.0; LANES],
            exact: [still; LANES],
        }
    }
}

impl<const LANES: usize> Controllers<Seed, LANES> for Seeds<LANES> {
    fn assign<const TARGETS: usize>(
        &mut self,
        lane: usize,
        seed: &Seed,
        course: &Course<'_, TARGETS>,
    ) -> bool {
        let LinearThreshold { weights, threshold } = seed.output;
        let least = threshold - seed.bias;
        for (of_all, weight) in self.weights.iter_mut().zip(weights) {
            of_all[lane] = weight as f32;
        }
        self.least[lane] = least as f32;
        // Each of three terms is rounded at most four times, by at most 2^-24 of it: a weight, its product, two sums. Twice that,
        // for what the terms are themselves rounded by.
        let terms = weights.iter().map(|weight| weight.abs() * course.reach()).sum::<f64>()
            + threshold.abs()
            + seed.bias.abs();
        self.doubt[lane] = (terms * 8.0 * 2.0_f64.powi(-24)) as f32;
        self.exact[lane] = *seed;
        true
    }

    #[inline(always)]
    fn step<const TARGETS: usize>(&mut self, plants: &mut Plants<LANES>, course: &Course<'_, TARGETS>) {
        let Self { weights: [of_x, of_y], least, doubt, exact } = &*self;
        plants.step(
            course,
            |lane, x, y| {
                let beyond = of_x[lane] * x + of_y[lane] * y - least[lane];
                (u32::from(beyond > 0.0), beyond.abs() < doubt[lane])
            },
            |lane, x, y| u32::from(exact[lane].is_right([x.into(), y.into()])),
        );
    }
}
