//! Controllers as data: what a plan and a run folder keep of a controller, from which it is built again.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::control::{Controller, Greedy, NetworkController, Periodic};
use tropism::evolve::Champion;
use tropism::lamps::{Layout, Light};
use tropism::task::Targets;
use tropism_neat::Genome;

use crate::error::Error;
use crate::files;

/// Minutes between two switches of the paper's periodic controller: six hours (section 2.2.1).
pub const PAPER_SWITCH_MIN: f64 = 360.0;

/// Steps of the paper's open-loop experiments: 83.3 hours (section 2.2.1).
pub const OPEN_LOOP_STEPS: u32 = 1000;

/// The most steps between two switches of a periodic controller: as many as a task may have.
const MAX_SWITCH_STEPS: f64 = 1e6;

/// A controller as data, complete: [`build`](Self::build) needs no file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum ControllerSpec {
    /// Lights each lamp in turn, whatever the plant does.
    Periodic {
        /// Minutes until the other lamp is lit, rounded to whole steps. Paper: 360.
        minutes: f64,
        /// The lamp that is lit first.
        #[serde(default = "left")]
        first: Light,
    },
    /// Lights the lamp towards the next target: the baseline without a model.
    Greedy,
    /// Lights what an evolved network decides.
    Network {
        /// The network's genome.
        genome: Box<Genome>,
    },
}

const fn left() -> Light {
    Light::LEFT
}

impl Default for ControllerSpec {
    /// The paper's open-loop controller.
    fn default() -> Self {
        Self::periodic(PAPER_SWITCH_MIN)
    }
}

impl ControllerSpec {
    /// A periodic controller that lights the left lamp first and switches every `minutes`.
    #[must_use]
    pub const fn periodic(minutes: f64) -> Self {
        Self::Periodic { minutes, first: left() }
    }

    /// A controller that obeys the network of `genome`.
    ///
    /// # Errors
    /// [`Error::Plan`] if the network has not the inputs and outputs of a controller.
    pub fn network(genome: Genome) -> Result<Self, Error> {
        let spec = Self::Network { genome: Box::new(genome) };
        spec.check_network()?;
        Ok(spec)
    }

    /// Reads the network of a genome file, such as `champion.json`.
    ///
    /// # Errors
    /// [`Error`] names the file.
    pub fn read_network(path: &Path) -> Result<Self, Error> {
        let champion = files::read_as(path, Champion::from_json)?;
        Self::network(champion.genome).map_err(Error::at(path.display()))
    }

    /// The genome of the network that decides; `None` if none does.
    #[must_use]
    pub fn genome(&self) -> Option<&Genome> {
        match self {
            Self::Network { genome } => Some(genome),
            Self::Periodic { .. } | Self::Greedy => None,
        }
    }

    /// Whether it decides without looking at the plant.
    #[must_use]
    pub const fn is_open_loop(&self) -> bool {
        matches!(self, Self::Periodic { .. })
    }

    /// The task of the paper for such a controller: the 1000 steps of an open-loop experiment, or the three targets.
    #[must_use]
    pub fn default_task(&self) -> Targets {
        if self.is_open_loop() { Targets::open_loop(OPEN_LOOP_STEPS) } else { Targets::default() }
    }

    /// Checks that the controller can be built for steps of `period_min` minutes.
    ///
    /// # Errors
    /// [`Error::Plan`] says what was found and what was wanted.
    pub fn check(&self, period_min: f64) -> Result<(), Error> {
        let Self::Periodic { minutes, .. } = *self else { return self.check_network() };
        if (1.0..=MAX_SWITCH_STEPS).contains(&switch_steps(minutes, period_min)) {
            return Ok(());
        }
        Err(Error::Plan(format!(
            "controller: found a switch every {minutes} minutes, wanted one to a million steps of {period_min} minutes"
        )))
    }

    fn check_network(&self) -> Result<(), Error> {
        match self.genome().map(NetworkController::of_tip) {
            Some(Err(error)) => Err(Error::Plan(error.to_string())),
            _ => Ok(()),
        }
    }

    /// Builds the controller for `task`, with all its neurons at rest, for steps of `period_min` minutes.
    ///
    /// # Panics
    /// If [`check`](Self::check) refuses it.
    #[must_use]
    pub fn build(&self, task: &Targets, period_min: f64) -> Box<dyn Controller> {
        match self {
            Self::Periodic { minutes, first } => {
                let steps_each = switch_steps(*minutes, period_min) as u32;
                Box::new(Periodic::new(steps_each, &Layout::default()).starting_with(*first))
            }
            Self::Greedy => Box::new(Greedy::new(task, &Layout::default())),
            Self::Network { genome } => {
                Box::new(NetworkController::of_tip(genome).expect("a controller that was checked"))
            }
        }
    }

    /// A few words for people: `periodic, 72 steps`, `chase`, or the size of the network.
    #[must_use]
    pub fn description(&self, period_min: f64) -> String {
        match self {
            Self::Periodic { minutes, .. } => {
                format!("periodic, {} steps", switch_steps(*minutes, period_min))
            }
            Self::Greedy => "chase".to_owned(),
            Self::Network { genome } => {
                format!("network, {} neurons, {} links", genome.neurons().len(), genome.links().len())
            }
        }
    }
}

/// Whole steps between two switches.
fn switch_steps(minutes: f64, period_min: f64) -> f64 {
    (minutes / period_min).round()
}

#[cfg(test)]
mod tests {
    use tropism::observation::Observation;

    use super::*;

    #[test]
    fn six_hours_are_72_steps_of_five_minutes() {
        let spec = ControllerSpec::default();
        assert_eq!(spec.description(5.0), "periodic, 72 steps");
        let mut controller = spec.build(&Targets::default(), 5.0);
        let seen = Observation::simulated(Targets::default().start);
        let lights: Vec<Light> = (0..144).map(|_| controller.decide(&seen)).collect();
        assert!(lights[..72].iter().all(|&light| light == Light::LEFT));
        assert!(lights[72..].iter().all(|&light| light == Light::RIGHT));
    }

    #[test]
    fn a_switch_takes_at_least_one_step() {
        assert!(ControllerSpec::periodic(2.5).check(5.0).is_ok());
        for (minutes, period_min) in [(2.4, 5.0), (6e6, 5.0), (f64::NAN, 5.0), (-5.0, 5.0)] {
            let error = ControllerSpec::periodic(minutes).check(period_min).unwrap_err().to_string();
            assert!(error.contains("wanted one to a million steps"), "{error}");
        }
    }

    #[test]
    fn a_controller_comes_back_from_toml_and_json() {
        let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 2, 1, 1, 0);
        let network = ControllerSpec::network(genome).unwrap();
        for spec in [ControllerSpec::default(), ControllerSpec::Greedy, network] {
            let toml = toml::to_string(&spec).unwrap();
            assert_eq!(toml::from_str::<ControllerSpec>(&toml).unwrap(), spec, "{toml}");
            let json = serde_json::to_string(&spec).unwrap();
            assert_eq!(serde_json::from_str::<ControllerSpec>(&json).unwrap(), spec, "{json}");
        }
        let spec: ControllerSpec = toml::from_str("kind = \"periodic\"\nminutes = 60").unwrap();
        assert_eq!(spec, ControllerSpec::periodic(60.0));
        assert!(toml::from_str::<ControllerSpec>("kind = \"periodic\"\nminuts = 60").is_err());
    }

    #[test]
    fn a_network_of_another_shape_is_refused() {
        let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 3, 2, 1, 0);
        let error = ControllerSpec::network(genome).unwrap_err().to_string();
        assert!(error.contains("3 inputs and 2 outputs"), "{error}");
    }
}
