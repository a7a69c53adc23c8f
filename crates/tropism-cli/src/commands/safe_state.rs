//! `tropism safe-state`: flash off, lamps as they are to be left.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use tropism_lab::safe_state::{DeviceResult, SafeStatePlan, SafeStateResults};

use crate::progress::execute;
use crate::shell::Shell;

/// Switch the flash and all lamps off, now
///
/// Needs no running program: use it after a kill, by hand, or as ExecStopPost= of a systemd unit. Each device is tried
/// three times. A missing device does not stop the others from being switched off. First end the run with `tropism stop`:
/// a run that is still going on lights its lamp again at its next step. With `on_exit = "keep"` in the rig file lamps stay
/// as they are, unless --dark is given.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism safe-state rigs/wled-ipcam.toml\n  \
    tropism stop bean; tropism safe-state bean --dark")]
pub(crate) struct SafeState {
    /// Rig file, or the folder of a run in it
    #[arg(value_name = "RIG.toml|DIR")]
    rig: PathBuf,

    /// Switch all lamps off, whatever the rig file says
    #[arg(long)]
    dark: bool,
}

impl SafeState {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let results = execute(&SafeStatePlan { rig: self.rig, dark: self.dark }, shell)?;
        shell.result(&text(&results), &results)?;
        let unconfirmed = results.devices.iter().filter(|device| !device.is_off).count();
        ensure!(
            unconfirmed == 0,
            "{}: {unconfirmed} of {} devices did not confirm that they are off: pull their plug",
            results.rig.display(),
            results.devices.len()
        );
        Ok(())
    }
}

fn text(results: &SafeStateResults) -> String {
    let line = |DeviceResult { device, problem, .. }: &DeviceResult| match problem {
        None => format!("{device}: off"),
        Some(problem) => format!("{device}: NOT KNOWN TO BE OFF: {problem}"),
    };
    let mut lines: Vec<String> = results.devices.iter().map(line).collect();
    if results.is_virtual {
        lines.push("a virtual tent: nothing is lit".to_owned());
    }
    if results.is_kept {
        lines.push("lamps: left as they are, for on_exit = \"keep\" (--dark puts them out)".to_owned());
    }
    lines.join("\n")
}
