//! `tropism lamp`: a lamp or the flash by hand.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::by_hand::{LampPlan, LampResults};

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Light one lamp of a rig, or its flash, for some seconds
///
/// All other lamps go dark before. It goes off after its time, at Ctrl-C, and when this program is killed. A rig
/// that a run drives is refused.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism lamp rig.toml left\n  \
    tropism lamp rig.toml flash --seconds 2")]
pub(crate) struct Lamp {
    /// Rig file
    #[arg(value_name = "RIG.toml")]
    rig: PathBuf,

    /// Name of a lamp, or `flash`
    #[arg(value_name = "LAMP")]
    lamp: String,

    /// Seconds for which it is lit, at most 3600
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    seconds: f64,
}

impl Lamp {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        Shell::end_in_order();
        let Self { rig, lamp, seconds } = self;
        let plan = LampPlan { rig, lamp, seconds, watchdog: std::env::current_exe().ok() };
        execute_and_print(&plan, shell, text)
    }
}

fn text(LampResults { lamp, seconds, is_virtual, .. }: &LampResults) -> String {
    let of = if *is_virtual { ", in a virtual tent" } else { "" };
    format!("{lamp}: lit for {seconds:.1} s, and off again{of}")
}
