//! `tropism man`: manual pages.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use clap_mangen::Man as Page;
use serde::Serialize;
use tropism_lab::files;

use crate::shell::Shell;

/// Write manual pages: one for the program and one for each command
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism man --out ~/.local/share/man/man1 && man tropism-run\n  \
    tropism man --out pages")]
pub(crate) struct Man {
    /// Folder to write to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// The pages that were written.
#[derive(Serialize)]
struct Pages {
    pages: Vec<PathBuf>,
}

impl Man {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let mut program = crate::visible_command().disable_help_subcommand(true);
        program.build();
        files::make_folder(&self.out)?;
        let mut pages = Vec::new();
        for command in std::iter::once(&program).chain(program.get_subcommands()) {
            let page = Page::new(command.clone());
            let path = self.out.join(page.get_filename());
            let mut text = Vec::new();
            page.render(&mut text)?;
            files::write(&path, &text)?;
            pages.push(path);
        }
        let text = format!("wrote {} pages to {}", pages.len(), self.out.display());
        shell.result(&text, &Pages { pages })
    }
}
