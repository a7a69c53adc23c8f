//! The evolved controller: a network sees the plant and decides the light (section 2.3).

use serde::{Deserialize, Serialize};
use tropism_neat::{Genome, Network};

use super::{Controller, SensorState, Sensors, TIP_INPUTS};
use crate::lamps::{Layout, Light};
use crate::lighting::{FULL, Lighting};
use crate::observation::Observation;
use crate::plant::PlantModel;
use crate::task::Task;

/// Outputs of a network for the paper's two lamps: the light condition C, above 0.5 for right.
pub const OUTPUTS: usize = 1;

/// How many outputs a network needs for the lamps of `layout`: one for two lamps (paper), else one for each lamp.
#[must_use]
pub const fn outputs(layout: &Layout) -> usize {
    if layout.len() == 2 { OUTPUTS } else { layout.len() }
}

/// How the outputs of a network light the lamps.
///
/// With two lamps the one output is the light condition C: the second lamp of the layout (right) above 0.5. With more lamps each
/// has an output, and the greatest one counts, the first of equals. Outputs are taken from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Dimming {
    /// One lamp at full power, as in the paper.
    #[default]
    Switch,
    /// One lamp, dimmed: of two at 2 |C - 0.5| of full power, of more at its output.
    Level,
    /// All lamps share the power of one: of two the right one has C and the left one the rest, of more each has the share of its
    /// output.
    Ratio,
}

impl Dimming {
    /// Whether it is the paper's.
    #[must_use]
    pub fn is_switch(&self) -> bool {
        *self == Self::Switch
    }

    /// Checks that `model` knows the light that a network asks for.
    ///
    /// # Errors
    /// [`OneLamp`] if it dims lamps, and the model knows one at full power alone.
    pub fn check(self, model: &impl PlantModel) -> Result<(), OneLamp> {
        if self.is_switch() || model.knows_levels() { Ok(()) } else { Err(OneLamp) }
    }

    /// A lighting of `layout` that a network may ask for, with as many lamps as may be lit at once.
    #[must_use]
    pub fn example(self, layout: &Layout) -> Lighting {
        self.lighting(&vec![if outputs(layout) == OUTPUTS { 0.75 } else { 0.5 }; outputs(layout)])
    }

    /// The lighting that `outputs` stand for. One lamp at least is lit: darkness ends a track.
    fn lighting(self, outputs: &[f64]) -> Lighting {
        let lit = decoded(outputs);
        let only = |power: f64| Lighting::DARK.with(lit, level(power).max(1));
        match (self, outputs) {
            (Self::Switch, _) => lit.into(),
            (Self::Level, [c]) => only(2.0 * (c - 0.5).abs()),
            (Self::Level, _) => only(outputs[lit.index()]),
            (Self::Ratio, [c]) => {
                let right = level(*c);
                Lighting::DARK.with(Light::RIGHT, right).with(Light::LEFT, FULL - right)
            }
            (Self::Ratio, _) => {
                let total: f64 = outputs.iter().map(|output| output.clamp(0.0, 1.0)).sum();
                // Rounded down, so that all together are never above the power of one.
                let level = |output: f64| (output.clamp(0.0, 1.0) / total * f64::from(FULL)) as u8;
                let share = |lighting: Lighting, (index, output): (usize, &f64)| {
                    Light::new(index).map_or(lighting, |light| lighting.with(light, level(*output)))
                };
                let shared = outputs.iter().enumerate().fold(Lighting::DARK, share);
                if total > 0.0 { shared } else { lit.into() }
            }
        }
    }
}

/// A network that dims lamps before a model that knows one at full power alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the model knows one lamp at full power alone, and networks dim lamps (`dimming`): fit a model of the stem"
)]
pub struct OneLamp;

/// The level of a lamp at a share of full power.
fn level(power: f64) -> u8 {
    (power.clamp(0.0, 1.0) * f64::from(FULL)).round() as u8
}

/// What stands between a network and the plant: what it sees, and what its outputs mean.
#[derive(Clone, Copy, Debug)]
pub struct Interface<'s> {
    /// What it sees.
    pub sensors: &'s Sensors,
    /// What its outputs mean.
    pub dimming: Dimming,
}

impl<'s> From<&'s Sensors> for Interface<'s> {
    /// With lamps that are switched.
    fn from(sensors: &'s Sensors) -> Self {
        Self { sensors, dimming: Dimming::Switch }
    }
}

/// A controller that is a network.
#[derive(Clone, Debug)]
pub struct NetworkController {
    network: Network,
    sensors: SensorState,
    dimming: Dimming,
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
    /// [`ShapeError`] if the genome has not the inputs of the sensors and the outputs of `layout`.
    pub fn new<'s>(
        genome: &Genome,
        interface: impl Into<Interface<'s>>,
        task: &Task,
        layout: &Layout,
    ) -> Result<Self, ShapeError> {
        let Interface { sensors, dimming } = interface.into();
        ShapeError::check(genome, sensors, layout)?;
        Ok(Self {
            network: Network::new(genome),
            sensors: SensorState::new(sensors, task, layout),
            dimming,
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
    /// The brightest lamp of [`lighting`](Self::lighting).
    fn decide(&mut self, seen: &Observation) -> Light {
        self.lighting(seen).brightest().expect("one lamp at least is lit")
    }

    /// One synchronous step of the network: inputs in, one activation, outputs read; its state is kept.
    fn lighting(&mut self, seen: &Observation) -> Lighting {
        self.sensors.sense(seen, &mut self.inputs);
        let lighting = self.dimming.lighting(self.network.activate(&self.inputs));
        self.sensors.remember(lighting);
        lighting
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
    fn outputs_are_levels_or_shares_of_one_lamp() {
        let lit = |dimming: Dimming, outputs: &[f64]| dimming.lighting(outputs).levels()[..4].to_vec();
        assert_eq!(lit(Dimming::Switch, &[0.6]), [0, 255, 0, 0]);
        assert_eq!(lit(Dimming::Level, &[0.75]), [0, 128, 0, 0]);
        assert_eq!(lit(Dimming::Level, &[0.0]), [255, 0, 0, 0]);
        assert_eq!(lit(Dimming::Level, &[0.5]), [1, 0, 0, 0], "not dark");
        assert_eq!(lit(Dimming::Ratio, &[0.2]), [204, 51, 0, 0]);
        assert_eq!(lit(Dimming::Ratio, &[1.7]), [0, 255, 0, 0], "outputs beyond 1 are 1");
        assert_eq!(lit(Dimming::Level, &[0.1, 0.0, 0.4, 0.0]), [0, 0, 102, 0]);
        assert_eq!(lit(Dimming::Ratio, &[0.5, 0.0, 0.5, 1.0]), [63, 0, 63, 127]);
        assert_eq!(lit(Dimming::Ratio, &[0.0; 4]), [255, 0, 0, 0]);
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
