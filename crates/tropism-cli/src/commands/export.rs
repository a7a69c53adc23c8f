//! `tropism export`: a run as one archive or folder that others can read and check.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::export::{ExportPlan, ExportResults, LeftOut};
use tropism_lab::units;

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Write a run as an archive or folder: track, events, photographs, settings, and a manifest with checksums
///
/// Each photograph is compared with its checksum in the journal. All written files are read back and compared. No existing
/// file is overwritten. A run that is still going on is exported up to its latest step.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism export bean --out bean.tar\n  \
    tropism export bean --out /media/stick/bean\n  \
    tropism export bean --out bean.tar --keep-going     although photographs are lost")]
pub(crate) struct Export {
    /// Run folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// New archive, if it ends in .tar, or new folder
    #[arg(long, value_name = "FILE.tar|DIR")]
    out: PathBuf,

    /// Leave out missing or changed photographs and list them, instead of failing
    #[arg(long)]
    keep_going: bool,
}

impl Export {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = ExportPlan { folder: self.folder, out: self.out, keep_going: self.keep_going };
        execute_and_print(&plan, shell, text)
    }
}

fn text(results: &ExportResults) -> String {
    let kind = if results.is_virtual { "a virtual plant" } else { "a plant" };
    let yet = if results.is_over { "" } else { ", which is not over" };
    let mut text = format!("{} of {kind}{yet}\n", units::plural(results.steps, "step"));
    for LeftOut { path, problem } in &results.left_out {
        text += &format!("left out: {path}: {problem}\n");
    }
    let (out, size) = (results.out.display(), units::bytes(results.bytes));
    text + &format!("wrote {out}: {}, {size}, read back and compared", units::plural(results.files, "file"))
}
