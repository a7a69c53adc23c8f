//! The evolved controller: a network sees the tip and decides the light (section 2.3).

use tropism_neat::{Genome, Network};

use super::Controller;
use crate::light::Light;
use crate::observation::Observation;

/// Inputs of a controller's network: x and y of the tip, in cm, as they are. The bias is the network's own.
pub const INPUTS: usize = 2;

/// Outputs of a controller's network: the light condition C, above 0.5 for right.
pub const OUTPUTS: usize = 1;

/// A network that steers.
#[derive(Clone, Debug)]
pub struct NetworkController {
    network: Network,
}

/// A genome that is no controller.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "found a network with {inputs} inputs and {outputs} outputs, wanted a controller with {INPUTS} inputs (x and y of the tip) and {OUTPUTS} output"
)]
pub struct ShapeError {
    /// Inputs without the bias.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
}

impl NetworkController {
    /// The controller that `genome` describes, with all its neurons at rest.
    ///
    /// # Errors
    /// [`ShapeError`] if the genome has not two inputs and one output.
    pub fn new(genome: &Genome) -> Result<Self, ShapeError> {
        if (genome.inputs(), genome.outputs()) != (INPUTS, OUTPUTS) {
            return Err(ShapeError { inputs: genome.inputs(), outputs: genome.outputs() });
        }
        Ok(Self { network: Network::new(genome) })
    }
}

impl Controller for NetworkController {
    /// One synchronous step of the network: inputs in, one activation, output out; its state is kept.
    fn decide(&mut self, seen: &Observation) -> Light {
        if is_right(self.network.activate(&[seen.tip.x, seen.tip.y])) { Light::Right } else { Light::Left }
    }
}

/// What the output of a controller's network means: the paper's C.
pub(super) fn is_right(output: &[f64]) -> bool {
    output[0] > 0.5
}
