//! Linear controllers side by side: the minimal networks that NEAT begins with, one step neuron each.

use tropism_neat::LinearThreshold;

use super::Controllers;
use super::plants::{BatchTask, Plants};
use crate::control::{Controller, TIP_INPUTS as INPUTS};
use crate::lamps::Light;
use crate::observation::Observation;

/// A linear threshold controller: an output neuron that sees the inputs and the bias.
#[derive(Clone, Copy, Debug)]
pub struct LinearController {
    /// Weights of x and y, and what the sum must exceed for the light to be right.
    pub output: LinearThreshold<INPUTS>,
    /// Weight of the bias.
    pub bias: f64,
}

impl LinearController {
    fn is_right(&self, tip: [f64; INPUTS]) -> bool {
        self.output.fires(tip, self.bias)
    }
}

impl Controller for LinearController {
    fn decide(&mut self, seen: &Observation) -> Light {
        if self.is_right([seen.tip.x, seen.tip.y]) { Light::RIGHT } else { Light::LEFT }
    }
}

/// The weights in single precision, and the exact controllers for sums too close to the threshold.
#[repr(C, align(64))]
pub(super) struct LinearControllers<const LANES: usize> {
    weights: [[f32; LANES]; INPUTS],
    /// The threshold of the weighted sum, less the bias.
    threshold: [f32; LANES],
    /// Bound of the rounding error: sums closer to the threshold are computed exactly.
    error: [f32; LANES],
    exact: [LinearController; LANES],
}

impl<const LANES: usize> LinearControllers<LANES> {
    pub(super) const fn empty() -> Self {
        let silent = LinearController {
            output: LinearThreshold { weights: [0.0; INPUTS], threshold: 1.0 },
            bias: 0.0,
        };
        Self {
            weights: [[0.0; LANES]; INPUTS],
            threshold: [1.0; LANES],
            error: [0.0; LANES],
            exact: [silent; LANES],
        }
    }
}

impl<const LANES: usize> Controllers<LinearController, LANES> for LinearControllers<LANES> {
    fn assign<const TARGETS: usize>(
        &mut self,
        lane: usize,
        controller: &LinearController,
        task: &BatchTask<'_, TARGETS>,
    ) -> bool {
        let LinearThreshold { weights, threshold } = controller.output;
        let reduced = threshold - controller.bias;
        for (of_all, weight) in self.weights.iter_mut().zip(weights) {
            of_all[lane] = weight as f32;
        }
        self.threshold[lane] = reduced as f32;
        // Forward error bound: each of three terms is rounded at most four times (weight, product, two sums), by at most
        // 2^-24 of it each; doubled for the rounding of the terms themselves.
        let terms = weights.iter().map(|weight| weight.abs() * task.reach()).sum::<f64>()
            + threshold.abs()
            + controller.bias.abs();
        self.error[lane] = (terms * 8.0 * 2.0_f64.powi(-24)) as f32;
        self.exact[lane] = *controller;
        true
    }

    #[inline(always)]
    fn step<const TARGETS: usize>(&mut self, plants: &mut Plants<LANES>, task: &BatchTask<'_, TARGETS>) {
        let Self { weights: [of_x, of_y], threshold, error, exact } = &*self;
        plants.step(
            task,
            |lane, x, y| {
                let beyond = of_x[lane] * x + of_y[lane] * y - threshold[lane];
                (u32::from(beyond > 0.0), beyond.abs() < error[lane])
            },
            |lane, x, y| u32::from(exact[lane].is_right([x.into(), y.into()])),
        );
    }
}
