//! The workflow `safe_state`: switches the flash off and the lamps as they are to be left, without the program that lit
//! them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::rig::OnExit;
use tropism_rig::shutdown::{DeviceShutdown, shut_down};

use crate::error::Error;
use crate::monitor::Monitor;
use crate::run::read_rig;
use crate::workflow::Workflow;

/// The rig to switch off.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SafeStatePlan {
    /// Rig file, or the folder of a run in the rig.
    pub rig: PathBuf,
    /// Whether lamps go dark even if their rig says `on_exit = "keep"`.
    #[serde(default)]
    pub dark: bool,
}

/// What was switched off.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SafeStateResults {
    /// Rig file or run folder.
    pub rig: PathBuf,
    /// Whether the tent is virtual: then nothing is lit.
    pub is_virtual: bool,
    /// Whether the lamps were left as they are.
    pub is_kept: bool,
    /// Each device that was printed.
    pub devices: Vec<DeviceResult>,
}

/// What one device answered.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DeviceResult {
    /// `flash`, `lamps`, or a lamp by its name, such as `left lamp`.
    pub device: String,
    /// Whether it confirmed that it is off.
    pub is_off: bool,
    /// Why it is not known to be off.
    pub problem: Option<String>,
}

impl Workflow for SafeStatePlan {
    type Results = SafeStateResults;
    const SCHEMA: &'static str = "tropism.safe-state/1";

    fn check(&self) -> Result<(), Error> {
        Ok(())
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<SafeStateResults, Error> {
        let rig = read_rig(&self.rig)?;
        let result = |DeviceShutdown { device, result }: DeviceShutdown| DeviceResult {
            device,
            is_off: result.is_ok(),
            problem: result.err().map(|error| error.to_string()),
        };
        Ok(SafeStateResults {
            rig: self.rig.clone(),
            is_virtual: rig.is_virtual(),
            is_kept: !self.dark && rig.lamps.as_ref().is_some_and(|lamps| lamps.on_exit == OnExit::Keep),
            devices: shut_down(&rig, self.dark).into_iter().map(result).collect(),
        })
    }
}
