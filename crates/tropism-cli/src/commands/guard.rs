//! `tropism guard`: what `tropism run` starts beside itself.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::guard::{GuardPlan, GuardResults, RunEnd};

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Put the light off when the run on the other end of stdin dies or falls silent
///
/// `tropism run` starts it beside every run in a real tent. It writes what it does into guard.log of the run folder.
#[derive(Args)]
pub(crate) struct Guard {
    /// Run folder
    #[arg(value_name = "DIR")]
    run: PathBuf,

    /// Seconds for which the run may be silent
    #[arg(long, value_name = "SECONDS")]
    silence: f64,
}

impl Guard {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        // What ends the run must not end its guard.
        Shell::end_in_order();
        execute_and_print(&GuardPlan { run: self.run, silence_s: self.silence }, shell, text)
    }
}

fn text(results: &GuardResults) -> String {
    let run = match results.run {
        RunEnd::Ended => "the run ended",
        RunEnd::Lit => "the run ended with a device that did not confirm",
        RunEnd::Died => "the run died",
        RunEnd::Silent => "the run was silent for too long and was killed",
    };
    format!("{run}; its light is {}", if results.is_dark { "off" } else { "NOT KNOWN TO BE OFF" })
}
