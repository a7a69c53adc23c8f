//! `tropism safe-state`: flash off, lamps as they are to be left.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use serde::{Deserialize, Serialize};
use tropism::rig::OnExit;
use tropism_lab::files;
use tropism_rig::file::RigFile;
use tropism_rig::shutdown::{DeviceShutdown, shut_down};

use crate::shell::Shell;

/// Put the flash off and both lamps dark, now
///
/// Works without the program that lit them: after a kill, by hand, or as ExecStopPost= of a systemd unit. Each device is
/// tried three times, and one that is gone keeps no other lit. A run that still goes on lights its lamp again at its next
/// step: `tropism stop` comes first. Lamps whose file says `on_exit = "keep"` stay as they are, unless --dark is given.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism safe-state rigs/wled-ipcam.toml\n  \
    tropism stop bean; tropism safe-state bean --dark")]
pub(crate) struct SafeState {
    /// Rig file, or the folder of a run in it
    #[arg(value_name = "RIG.toml|DIR")]
    rig: PathBuf,

    /// Lamps dark whatever the file says
    #[arg(long)]
    dark: bool,
}

/// The rig of a rig file or of a run folder.
pub(crate) fn load_rig(path: &Path) -> Result<RigFile> {
    #[derive(Deserialize)]
    struct Plan {
        rig: RigFile,
    }
    let rig = if path.is_dir() {
        files::read_toml::<Plan>(&path.join("run.toml"))?.rig
    } else {
        files::read_toml(path)?
    };
    rig.check().with_context(|| path.display().to_string())?;
    Ok(rig)
}

#[derive(Serialize)]
struct Outcome {
    rig: PathBuf,
    is_virtual: bool,
    /// Whether the lamps were left as they are.
    is_kept: bool,
    devices: Vec<DeviceOutcome>,
}

#[derive(Serialize)]
struct DeviceOutcome {
    device: String,
    is_off: bool,
    problem: Option<String>,
}

impl SafeState {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let rig = load_rig(&self.rig)?;
        let outcome = |DeviceShutdown { device, result }: DeviceShutdown| DeviceOutcome {
            device,
            is_off: result.is_ok(),
            problem: result.err().map(|error| error.to_string()),
        };
        let devices: Vec<_> = shut_down(&rig, self.dark).into_iter().map(outcome).collect();
        let line = |device: &DeviceOutcome| match &device.problem {
            None => format!("{}: off", device.device),
            Some(problem) => format!("{}: NOT KNOWN TO BE OFF: {problem}", device.device),
        };
        let mut lines: Vec<String> = devices.iter().map(line).collect();
        if rig.is_virtual() {
            lines.push("a virtual tent: nothing is lit".to_owned());
        }
        let is_kept = !self.dark && rig.lamps.as_ref().is_some_and(|lamps| lamps.on_exit == OnExit::Keep);
        if is_kept {
            lines.push("lamps: left as they are, for on_exit = \"keep\" (--dark puts them out)".to_owned());
        }
        let failed = devices.iter().filter(|device| !device.is_off).count();
        let outcome = Outcome { rig: self.rig, is_virtual: rig.is_virtual(), is_kept, devices };
        shell.result(&lines.join("\n"), &outcome)?;
        if failed > 0 {
            bail!(
                "{}: found {failed} of {} devices that did not confirm, wanted all off: pull their plug",
                outcome.rig.display(),
                outcome.devices.len()
            );
        }
        Ok(())
    }
}
