//! Settings of an evolution.

use serde::{Deserialize, Serialize};
use tropism_neat::{Activation, Config, NeatError};

use super::search::Method;
use super::start::{self, Start, StartError};
use crate::check::{OutOfRange, within};
use crate::control::{Dimming, Interface, OneLamp, Sensors};

/// How controllers are evolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct EvolutionConfig {
    /// Independent runs, 1 to 10000. Paper: 20 (section 3.1).
    pub runs: u32,
    /// Generations of a run, 1 to 10000000. Paper: 2000.
    pub generations: u32,
    /// Simulated plants that each genome steers, 1 to 10000; its fitness is their mean. Paper: 1, as far as it says.
    pub episodes: u32,
    /// What the networks see. Paper: x and y of the tip.
    #[serde(skip_serializing_if = "Sensors::is_tip")]
    pub sensors: Sensors,
    /// How the networks light the lamps. Paper: one lamp at full power. Else output neurons must be smooth, and the model one of
    /// the stem.
    #[serde(skip_serializing_if = "Dimming::is_switch")]
    pub dimming: Dimming,
    /// From which networks evolution starts. Paper: random ones.
    #[serde(skip_serializing_if = "Start::is_random")]
    pub start: Start,
    /// How networks are searched. Paper: NEAT.
    #[serde(skip_serializing_if = "Method::is_neat")]
    pub method: Method,
    /// NEAT's parameters. Paper: Table 1. CMA-ES uses the population and the activation functions.
    pub neat: Config,
}

impl Default for EvolutionConfig {
    fn default() -> Self {
        Self {
            runs: 20,
            generations: 2000,
            episodes: 1,
            sensors: Sensors::default(),
            dimming: Dimming::default(),
            start: Start::default(),
            method: Method::default(),
            neat: Config::wahby2016(),
        }
    }
}

/// An evolution that cannot be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvolutionError {
    /// A number out of its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// NEAT's own.
    #[error(transparent)]
    Neat(#[from] NeatError),
    /// Lamps that are dimmed before a model that cannot.
    #[error(transparent)]
    OneLamp(#[from] OneLamp),
    /// Lamps that are dimmed by neurons that cannot.
    #[error(
        "found step neurons as outputs (`neat.output_activation`), wanted smooth ones, such as UnsignedSigmoid: they dim lamps \
         (`dimming`)"
    )]
    Step,
    /// A start that sensors, lamps or task cannot express.
    #[error(transparent)]
    Start(#[from] StartError),
}

impl EvolutionConfig {
    /// What stands between the networks and the plants.
    #[must_use]
    pub const fn interface(&self) -> Interface<'_> {
        Interface { sensors: &self.sensors, dimming: self.dimming }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`EvolutionError`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), EvolutionError> {
        within("runs", self.runs, 1..=10_000)?;
        within("generations", self.generations, 1..=10_000_000)?;
        within("episodes", self.episodes, 1..=10_000)?;
        self.neat.check().map_err(NeatError::from)?;
        let is_step =
            matches!(self.neat.output_activation, Activation::UnsignedStep | Activation::SignedStep);
        if is_step && !self.dimming.is_switch() {
            return Err(EvolutionError::Step);
        }
        if self.method == Method::CmaEs {
            within("neat.population", self.neat.population, 4..=10_000)?;
        }
        match &self.start {
            Start::Random => {}
            Start::Greedy => {
                start::offset_input(&self.sensors, &self.neat)?;
            }
            Start::Network(network) => start::check_inputs(network, &self.sensors)?,
        }
        Ok(())
    }
}
