//! `tropism stop`: ends a run or an evolution in order.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::stop::{StopPlan, StopResults};

use crate::options::parse_minutes;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// End the run or evolution in a folder, and wait until it has ended
///
/// It ends as by Ctrl-C: what was done is saved, the flash is off, the lamps are dark unless the rig file keeps them, and
/// the same command with --resume goes on. Where nothing runs it says so, and that is no error.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism stop bean\n  \
    tropism stop bean --wait 10m && tropism export bean --out bean.tar")]
pub(crate) struct Stop {
    /// Run folder, or the folder of an evolution
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// How long it may take to end, such as 2m
    #[arg(long, value_name = "TIME", default_value = "2m", value_parser = parse_minutes)]
    wait: f64,
}

impl Stop {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        execute_and_print(&StopPlan { folder: self.folder, wait_min: self.wait }, shell, text)
    }
}

fn text(StopResults { folder, process, seconds, .. }: &StopResults) -> String {
    let folder = folder.display();
    match process {
        None => format!("{folder}: nothing runs here"),
        Some(process) => format!(
            "{folder}: process {process} has ended, after {seconds:.1} s; the same command with --resume goes on"
        ),
    }
}
