//! `tropism note`: what was done to a plant, or seen of it.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::note::{NotePlan, NoteResults};

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Write down what was done to a plant, or seen of it, in the journal of its run
///
/// Also while the run goes on: it takes the note into its journal within seconds, in a virtual tent at its next step. Reports
/// and figures show it.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism note bean \"pot moved by 1 cm\"\n  \
    tropism note bean --step 120 \"first true leaf\"")]
pub(crate) struct Note {
    /// Run folder
    #[arg(value_name = "DIR")]
    run: PathBuf,

    /// What happened, in one line
    #[arg(value_name = "TEXT")]
    text: String,

    /// The step that it is about; the latest one by default
    #[arg(long, value_name = "N")]
    step: Option<u32>,
}

impl Note {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let Self { run, text, step } = self;
        execute_and_print(&NotePlan { run, text, step }, shell, said)
    }
}

fn said(NoteResults { run, step, process }: &NoteResults) -> String {
    let run = run.display();
    match (step, process) {
        (Some(step), _) => format!("{run}: noted at step {step}"),
        (None, Some(process)) => {
            format!("{run}: left for the run, process {process}, which notes it within seconds")
        }
        (None, None) => format!("{run}: left for the run, which notes it within seconds"),
    }
}
