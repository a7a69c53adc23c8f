//! The evolved controller: a network sees the plant and decides the light (section 2.3).

use tropism_neat::{Genome, Network};

use super::{Controller, SensorState, Sensors, TIP_INPUTS};
use crate::lamps::{Layout, Light};
use crate::observation::Observation;
use crate::task::Task;

/// Outputs of a network for the paper's two lamps: the light condition C, above 0.5 for right.
pub const OUTPUTS: usize = 1;

/// How many outputs a network needs for the lamps of `layout`: one for two lamps (paper), else one for each lamp.
#[must_use]
pub const fn outputs(layout: &Layout) -> usize {
    if layout.len() == 2 { OUTPUTS } else { layout.len() }
}

/// A controller that is a network.
///
/// With two lamps the one output is the light condition C: the second lamp of the layout (right) above 0.5. With more
/// lamps each has an output, and the greatest one is lit, the first of equals.
#[derive(Clone, Debug)]
pub struct NetworkController {
    network: Network,
    sensors: SensorState,
    inputs: Vec<f64>,
}

/// A genome that does not fit sensors and lamps.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "found a network with {inputs} inputs and {outputs} outputs, wanted a controller with {wanted_inputs} inputs \
     (those of its sensors) and {wanted_outputs} output{}", if *wanted_outputs == 1 { "" } else { "s" }
)]
pub struct ShapeError {
    /// Inputs of the genome, without the bias.
    pub inputs: usize,
    /// Outputs of the genome.
    pub outputs: usize,
    /// Inputs that the sensors need.
    pub wanted_inputs: usize,
    /// Outputs that the lamps need.
    pub wanted_outputs: usize,
}

impl ShapeError {
    /// Checks that `genome` has the shape for `sensors` and `layout`.
    ///
    /// # Errors
    /// [`ShapeError`] if it has not.
    pub fn check(genome: &Genome, sensors: &Sensors, layout: &Layout) -> Result<(), Self> {
        let (wanted_inputs, wanted_outputs) = (sensors.inputs(), outputs(layout));
        if (genome.inputs(), genome.outputs()) == (wanted_inputs, wanted_outputs) {
            return Ok(());
        }
        Err(Self { inputs: genome.inputs(), outputs: genome.outputs(), wanted_inputs, wanted_outputs })
    }
}

impl NetworkController {
    /// The controller that `genome` describes, with all its neurons at rest. `task` gives the targets and
    /// the obstacles that [sensors](super::Sensor) refer to.
    ///
    /// # Errors
    /// [`ShapeError`] if the genome has not the inputs of `sensors` and the outputs of `layout`.
    pub fn new(genome: &Genome, sensors: &Sensors, task: &Task, layout: &Layout) -> Result<Self, ShapeError> {
        ShapeError::check(genome, sensors, layout)?;
        Ok(Self {
            network: Network::new(genome),
            sensors: SensorState::new(sensors, task, layout),
            inputs: Vec::with_capacity(sensors.inputs()),
        })
    }

    /// The paper's controller: it sees x and y of the tip and lights one of two lamps.
    ///
    /// # Errors
    /// [`ShapeError`] if the genome has not two inputs and one output.
    pub fn of_tip(genome: &Genome) -> Result<Self, ShapeError> {
        Self::new(genome, &Sensors::default(), &Task::open_loop(1000), &Layout::wahby2016())
    }
}

impl Controller for NetworkController {
    /// One synchronous step of the network: inputs in, one activation, outputs read; its state is kept.
    fn decide(&mut self, seen: &Observation) -> Light {
        self.sensors.sense(seen, &mut self.inputs);
        let light = decoded(self.network.activate(&self.inputs));
        self.sensors.remember(light);
        light
    }
}

/// The light that the outputs of a network stand for.
fn decoded(outputs: &[f64]) -> Light {
    if outputs.len() == OUTPUTS {
        return if is_right(outputs) { Light::RIGHT } else { Light::LEFT };
    }
    let best = (0..outputs.len()).fold(0, |best, at| if outputs[at] > outputs[best] { at } else { best });
    Light::new(best).unwrap_or(Light::LEFT)
}

/// What the output of the paper's network means: the paper's C.
pub(super) fn is_right(output: &[f64]) -> bool {
    output[0] > 0.5
}

/// Whether `genome` has the shape of the paper's network: x and y in, C out.
pub(super) fn is_of_tip(genome: &Genome) -> bool {
    genome.inputs() == TIP_INPUTS && genome.outputs() == OUTPUTS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Sensor;
    use crate::geometry::Point;
    use tropism_neat::{Config, random_genome};

    #[test]
    fn the_greatest_of_many_outputs_is_lit() {
        assert_eq!(decoded(&[0.2, 0.9, 0.9, 0.1]), Light::RIGHT);
        assert_eq!(decoded(&[0.0; 4]), Light::LEFT);
        assert_eq!(decoded(&[0.0, 0.0, 0.0, 1.0]), Light::BACK);
        assert_eq!(decoded(&[0.5]), Light::LEFT);
    }

    #[test]
    fn a_genome_of_another_shape_is_refused() {
        let genome = random_genome(&Config::wahby2016(), 2, 1, 1, 0);
        let layout = Layout::four_sides();
        let error =
            NetworkController::new(&genome, &Sensors::default(), &Task::default(), &layout).unwrap_err();
        assert_eq!((error.wanted_inputs, error.wanted_outputs), (2, 4));
        let sensors = Sensors::new(vec![Sensor::Tip, Sensor::LastShift]).unwrap();
        let genome = random_genome(&Config::wahby2016(), 4, 4, 1, 0);
        let mut controller = NetworkController::new(&genome, &sensors, &Task::default(), &layout).unwrap();
        let light = controller.decide(&Observation::simulated(Point::new(1.0, 5.0)));
        assert!(layout.contains(light));
    }
}
