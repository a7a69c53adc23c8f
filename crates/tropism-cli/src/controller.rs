//! Controllers as the command line names them.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Context, Result};
use tropism::control::Controller;
use tropism::control::Greedy;
use tropism::control::NetworkController;
use tropism::control::Periodic;
use tropism::evolve::Champion;
use tropism::lamps::Layout;
use tropism::task::Targets;
use tropism::track::PAPER_PERIOD_MIN;
use tropism_lab::files;
use tropism_neat::Genome;

use crate::options::{TaskOption, parse_minutes};

/// Steps of the paper's six hours.
pub(crate) const SIX_HOURS: u32 = 72;

/// Steps of the paper's open-loop experiments: 83.3 hours.
const OPEN_LOOP_STEPS: u32 = 1000;

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
                let steps = (parse_minutes(time)? / PAPER_PERIOD_MIN).round();
                if !(1.0..=1e6).contains(&steps) {
                    return Err(format!(
                        "found {time}, wanted at least one step of {PAPER_PERIOD_MIN} minutes"
                    ));
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
                let champion = files::read_as(path, Champion::from_json)?;
                NetworkController::of_tip(&champion.genome).with_context(|| path.display().to_string())?;
                LoadedController::Network(Box::new(champion.genome))
            }
        })
    }
}

impl LoadedController {
    /// A fresh controller, at rest.
    pub(crate) fn build(&self, task: &Targets) -> Box<dyn Controller> {
        match self {
            Self::Periodic(period) => Box::new(Periodic::new(*period, &Layout::default())),
            Self::Chase => Box::new(Greedy::new(task, &Layout::default())),
            Self::Network(genome) => {
                Box::new(NetworkController::of_tip(genome).expect("checked when it was loaded"))
            }
        }
    }

    /// The task that it is given: that of the file, the paper's, or for one that does not look at the plant the 1000
    /// steps of an open-loop experiment; in `steps` at most.
    pub(crate) fn task(&self, file: &TaskOption, steps: Option<u32>) -> Result<Targets> {
        let is_open_loop = matches!(self, Self::Periodic(_)) && file.task.is_none();
        let task = if is_open_loop { Targets::open_loop(OPEN_LOOP_STEPS) } else { file.load()? };
        Ok(Targets { max_steps: steps.unwrap_or(task.max_steps), ..task })
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
