//! From which networks evolution starts: random ones, one that decides as the greedy rule does, or a given one.

use serde::{Deserialize, Serialize};
use tropism_neat::{Activation, Config, Genome};

use crate::control::{OUTPUTS, Sensor, Sensors, outputs};
use crate::lamps::{Layout, Light};
use crate::task::Task;

/// From which networks evolution starts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// Random minimal networks. Paper (section 3.1).
    #[default]
    Random,
    /// A network that decides as the [greedy rule](crate::control::Greedy) does, and mutants of it.
    Greedy,
    /// A given network, such as the champion of another evolution, and mutants of it.
    Network(#[cfg_attr(feature = "schema", schemars(with = "serde_json::Value"))] Box<Genome>),
}

impl Start {
    /// Whether it is the paper's.
    #[must_use]
    pub fn is_random(&self) -> bool {
        *self == Self::Random
    }
}

/// A network that evolution cannot start from.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("start = {start}: found {found}, wanted {wanted}")]
pub struct StartError {
    /// Which start.
    start: &'static str,
    /// What stands there.
    pub found: String,
    /// What should stand there.
    pub wanted: String,
}

impl StartError {
    /// Something that the greedy network cannot do with.
    fn greedy(found: String, wanted: &str) -> Self {
        Self { start: "\"greedy\"", found, wanted: wanted.to_owned() }
    }
}

/// Checks that `network` takes what `sensors` see.
pub(super) fn check_inputs(network: &Genome, sensors: &Sensors) -> Result<(), StartError> {
    check_count(network.inputs(), sensors.inputs(), "inputs, as the sensors give")
}

/// Checks that `network` decides between the lamps of `layout`.
pub(super) fn check_outputs(network: &Genome, layout: &Layout) -> Result<(), StartError> {
    check_count(network.outputs(), outputs(layout), "outputs, as the lamps need")
}

fn check_count(found: usize, wanted: usize, of: &str) -> Result<(), StartError> {
    if found == wanted {
        return Ok(());
    }
    Err(StartError { start: "{ network }", found: found.to_string(), wanted: format!("{wanted} {of}") })
}

/// The input that is the sideways offset to the next target, if `sensors` and the activation function of `neat` can express the
/// greedy rule.
pub(super) fn offset_input(sensors: &Sensors, neat: &Config) -> Result<usize, StartError> {
    greedy_bias(neat)?;
    let offset = |sensor: &Sensor| *sensor == Sensor::ToTarget { ahead: 0 };
    let place = sensors.sensors().iter().position(offset).ok_or_else(|| {
        let found = format!("the sensors {}", serde_json::to_string(sensors).unwrap_or_default());
        StartError::greedy(found, "one that is { to_target = { ahead = 0 } }")
    })?;
    Ok(sensors.sensors()[..place].iter().map(|sensor| sensor.inputs()).sum())
}

/// The bias at which an output neuron is above 0.5 where all else is above 0.
fn greedy_bias(neat: &Config) -> Result<f64, StartError> {
    match neat.output_activation {
        Activation::UnsignedStep => Ok(0.5 + neat.activation_b),
        Activation::UnsignedSigmoid => Ok(-neat.activation_b / neat.activation_a),
        other => Err(StartError::greedy(
            format!("output_activation {other:?}"),
            "unsigned_step or unsigned_sigmoid",
        )),
    }
}

/// The minimal genome that lights the lamp on the side of the next target: weight 1 for the sideways offset, and a bias at which
/// the output passes 0.5 where the offset is above 0. All other weights are 0.
///
/// With a weight of 1 a later link from another input counts in cm per unit of that input, as the numbers of a
/// [rule](crate::control::PredictiveRule) do. Offsets of at most 2^-54 cm are lost beside the bias.
///
/// All inputs are linked. NEAT from the two links that decide ended lower: it adds links too rarely
/// (`docs/validation/searches.md`).
pub(super) fn greedy_genome(
    sensors: &Sensors,
    neat: &Config,
    task: &Task,
    layout: &Layout,
) -> Result<Genome, StartError> {
    let input = offset_input(sensors, neat)?;
    if task.is_in_space() {
        return Err(StartError::greedy("a task in space".to_owned(), "one in the plane"));
    }
    if outputs(layout) != OUTPUTS || layout.towards(true) != Light::RIGHT {
        let names: Vec<&str> = layout.lamps().iter().map(|lamp| lamp.name.as_str()).collect();
        let found = format!("the lamps {}", names.join(", "));
        return Err(StartError::greedy(found, "two lamps, the left one first"));
    }
    let mut weights = vec![0.0; sensors.inputs() + 1];
    weights[input] = 1.0;
    weights[sensors.inputs()] = greedy_bias(neat)?;
    Genome::linear(neat, sensors.inputs(), &weights)
        .map_err(|error| StartError::greedy(error.to_string(), "sensors and parameters of a network"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Controller, Greedy, NetworkController};
    use crate::geometry::Point;
    use crate::lamps::Lamp;
    use crate::observation::Observation;

    fn sensors() -> Sensors {
        let memory = Sensor::LightMemory { steps: 7 };
        Sensors::new(vec![Sensor::Tip, Sensor::LastShift, Sensor::ToTarget { ahead: 0 }, memory]).unwrap()
    }

    #[test]
    fn the_greedy_genome_decides_as_the_greedy_rule() {
        let (task, layout) = (Task::default(), Layout::default());
        let mut greedy = Greedy::new(&task, &layout);
        let network = |neat: &Config| {
            let genome = greedy_genome(&sensors(), neat, &task, &layout).unwrap();
            NetworkController::new(&genome, &sensors(), &task, &layout).unwrap()
        };
        let smooth = Config { output_activation: Activation::UnsignedSigmoid, ..Config::wahby2016() };
        let mut networks = [network(&Config::wahby2016()), network(&smooth)];
        // Targets are at x = 3, -5 and -1. Numbers next to 3 are farther from it than the 2^-54 that the bias rounds away.
        let near = 2.0 * f64::EPSILON;
        for y in [4.0, 6.0, 8.9, 13.4, 14.0] {
            for x in [-9.0, -5.0, -1.0, 0.0, 2.9, 3.0 - near, 3.0, 3.0 + near, 9.0] {
                let seen = Observation::simulated(Point::new(x, y));
                let wanted = greedy.decide(&seen);
                assert_eq!(networks.each_mut().map(|network| network.decide(&seen)), [wanted; 2], "{x} {y}");
            }
        }
    }

    #[test]
    fn what_cannot_be_greedy_is_refused() {
        let neat = Config::wahby2016();
        let error = |sensors: &Sensors, neat: &Config, task: &Task, layout: &Layout| {
            greedy_genome(sensors, neat, task, layout).unwrap_err().to_string()
        };
        let (plane, two) = (Task::default(), Layout::default());
        let found = error(&Sensors::default(), &neat, &plane, &two);
        assert_eq!(
            found,
            "start = \"greedy\": found the sensors [\"tip\"], wanted one that is { to_target = { ahead = 0 } }"
        );
        let tanh = Config { output_activation: Activation::Tanh, ..neat.clone() };
        assert!(error(&sensors(), &tanh, &plane, &two).contains("wanted unsigned_step"));
        assert!(error(&sensors(), &neat, &plane, &Layout::four_sides()).contains("wanted two lamps"));
        let lamp = |name, x| Lamp::new(name, [x, 20.0, 0.0]);
        let turned = Layout::new(vec![lamp("right", 20.0), lamp("left", -20.0)]).unwrap();
        assert!(error(&sensors(), &neat, &plane, &turned).contains("found the lamps right, left"));
        assert!(error(&sensors(), &neat, &Task::space(), &two).contains("found a task in space"));
    }
}
