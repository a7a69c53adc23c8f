//! Controllers as the command line names them.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::Result;
use tropism::task::TaskSpec;
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
    /// The controller; a file is read.
    pub(crate) fn load(&self) -> Result<ControllerSpec> {
        Ok(match self {
            Self::Periodic(minutes) => ControllerSpec::periodic(*minutes),
            Self::Chase => ControllerSpec::Greedy,
            Self::File(path) => ControllerSpec::read_network(path)?,
        })
    }
}

/// The task for `controller`: that of the file, or the paper's for such a controller; in `steps` at most.
pub(crate) fn task_for(
    controller: &ControllerSpec,
    file: &TaskOption,
    steps: Option<u32>,
) -> Result<TaskSpec> {
    let task = if file.task.is_some() { file.load()? } else { controller.default_task() };
    Ok(match steps {
        Some(steps) => task.with_max_steps(steps),
        None => task,
    })
}

/// The task of the file; else the one that a champion was evolved for, or the paper's three targets.
pub(crate) fn task_of_champion(controller: &ControllerSpec, file: &TaskOption) -> Result<TaskSpec> {
    let own = controller.champion().and_then(|champion| champion.task.clone());
    match own.filter(|_| file.task.is_none()) {
        Some(task) => Ok(task),
        None => file.load(),
    }
}
