//! Controllers as the command line names them.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::Result;
use tropism::task::Targets;
use tropism_lab::ControllerSpec;
use tropism_lab::controller::PAPER_SWITCH_MIN;

use crate::options::{TaskOption, parse_minutes};

/// A controller by name: `periodic`, `periodic:6h`, `chase`, or the file of an evolved network.
#[derive(Clone, Debug)]
pub(crate) enum ControllerName {
    /// Each lamp in turn for so many minutes.
    Periodic(f64),
    /// The lamp towards the next target.
    Chase,
    /// A genome as JSON.
    File(PathBuf),
}

impl FromStr for ControllerName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            _ if text == "periodic" => Ok(Self::Periodic(PAPER_SWITCH_MIN)),
            _ if text == "chase" => Ok(Self::Chase),
            Some(("periodic", time)) => Ok(Self::Periodic(parse_minutes(time)?)),
            _ => Ok(Self::File(text.into())),
        }
    }
}

impl ControllerName {
    /// Reads the file, if it is one, and checks that the controller can be built for steps of `period_min` minutes.
    pub(crate) fn load(&self, period_min: f64) -> Result<ControllerSpec> {
        let controller = match self {
            Self::Periodic(minutes) => ControllerSpec::periodic(*minutes),
            Self::Chase => ControllerSpec::Greedy,
            Self::File(path) => ControllerSpec::read_network(path)?,
        };
        controller.check(period_min)?;
        Ok(controller)
    }
}

/// The task for `controller`: that of the file, or the paper's for such a controller; in `steps` at most.
pub(crate) fn task_for(
    controller: &ControllerSpec,
    file: &TaskOption,
    steps: Option<u32>,
) -> Result<Targets> {
    let task = if file.task.is_some() { file.load()? } else { controller.default_task() };
    Ok(Targets { max_steps: steps.unwrap_or(task.max_steps), ..task })
}
