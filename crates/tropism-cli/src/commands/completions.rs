//! `tropism completions`: what a shell completes.

use anyhow::Result;
use clap::Args;
use clap_complete::Shell as Language;

use crate::shell::Shell;

/// Print a completion script for a shell: commands and options after the tab key
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism completions bash > ~/.local/share/bash-completion/completions/tropism\n  \
    tropism completions zsh > ~/.zfunc/_tropism\n  \
    tropism completions fish > ~/.config/fish/completions/tropism.fish")]
pub(crate) struct Completions {
    /// Shell
    #[arg(value_enum, value_name = "SHELL")]
    language: Language,
}

impl Completions {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let mut script = Vec::new();
        clap_complete::generate(self.language, &mut crate::visible_command(), "tropism", &mut script);
        let script = String::from_utf8(script)?;
        shell.result(script.trim_end(), &serde_json::json!({ "script": script }))
    }
}
