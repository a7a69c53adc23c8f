//! `tropism watchdog`: what `tropism run` starts beside itself.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::shell::Shell;

/// Put the light off when the run on the other end of stdin dies or falls silent
///
/// `tropism run` starts it beside every run in a real tent. What it does stands in watchdog.log of the run folder.
#[derive(Args)]
pub(crate) struct Watchdog {
    /// Run folder, for those who list processes
    #[arg(value_name = "DIR")]
    _run: PathBuf,
}

impl Watchdog {
    pub(crate) fn execute(self) -> Result<()> {
        // What ends the run must not end its watchdog.
        Shell::end_in_order();
        Ok(tropism_lab::watchdog::watch(std::io::stdin(), std::io::stdout(), std::io::stderr())?)
    }
}
