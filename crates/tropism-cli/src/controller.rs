//! Controllers as the command line names them.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Context, Result};
use tropism::control::Controller;
use tropism::control::chase::Chase;
use tropism::control::network::NetworkController;
use tropism::control::periodic::Periodic;
use tropism::experiment::files;
use tropism::light::Light;
use tropism::task::Task;
use tropism::track::PERIOD_MIN;
use tropism_neat::Genome;

use crate::options::parse_minutes;

/// Steps of the paper's six hours.
pub(crate) const SIX_HOURS: u32 = 72;

/// A controller by name: `periodic`, `periodic:6h`, `chase`, or the file of an evolved network.
#[derive(Clone, Debug)]
pub(crate) enum ControllerName {
    /// Each lamp in turn for so many steps.
    Periodic(u32),
    /// The lamp towards the next target.
    Chase,
    /// A genome as JSON.
    File(PathBuf),
}

impl FromStr for ControllerName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            _ if text == "periodic" => Ok(Self::Periodic(SIX_HOURS)),
            _ if text == "chase" => Ok(Self::Chase),
            Some(("periodic", time)) => {
                let steps = (parse_minutes(time)? / PERIOD_MIN).round();
                if !(1.0..=1e6).contains(&steps) {
                    return Err(format!("found {time}, wanted at least one step of {PERIOD_MIN} minutes"));
                }
                Ok(Self::Periodic(steps as u32))
            }
            _ => Ok(Self::File(text.into())),
        }
    }
}

/// A controller that is loaded and can be built as often as there are plants.
#[derive(Clone)]
pub(crate) enum LoadedController {
    /// Each lamp in turn for so many steps.
    Periodic(u32),
    /// The lamp towards the next target.
    Chase,
    /// An evolved network.
    Network(Box<Genome>),
}

impl ControllerName {
    /// Reads the file, if it is one, and checks that it is a controller.
    pub(crate) fn load(&self) -> Result<LoadedController> {
        Ok(match self {
            Self::Periodic(period) => LoadedController::Periodic(*period),
            Self::Chase => LoadedController::Chase,
            Self::File(path) => {
                let genome = files::read_as(path, Genome::from_json)?;
                NetworkController::new(&genome).with_context(|| path.display().to_string())?;
                LoadedController::Network(Box::new(genome))
            }
        })
    }
}

impl LoadedController {
    /// A fresh controller, at rest.
    pub(crate) fn build(&self, task: &Task) -> Box<dyn Controller> {
        match self {
            Self::Periodic(period) => Box::new(Periodic::new(*period, Light::Left)),
            Self::Chase => Box::new(Chase::new(task.targets.clone())),
            Self::Network(genome) => {
                Box::new(NetworkController::new(genome).expect("checked when it was loaded"))
            }
        }
    }

    /// Whether it looks at the plant at all.
    pub(crate) const fn is_open_loop(&self) -> bool {
        matches!(self, Self::Periodic(_))
    }

    /// What a run folder says of it.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Periodic(period) => format!("periodic, {period} steps"),
            Self::Chase => "chase".to_owned(),
            Self::Network(genome) => {
                let links = genome.links().len();
                let neurons = genome.neurons().len();
                format!("network, {neurons} neurons, {links} links")
            }
        }
    }
}
