//! `tropism show`: an evolved network and its decisions.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use tropism_lab::files::shell_word;
use tropism_lab::show::{ShowFormat, ShowPlan};

use crate::options::TaskOption;
use crate::progress::{check_outputs, execute_and_print};
use crate::shell::Shell;

/// Show an evolved network, and which lamp it lights where
///
/// Without --out or --format it prints the properties of the network, and its decisions in letters. The picture shows
/// the network and a map: the lamp that is lit when the tip stands still at a place, and the path of a plant that the
/// network steered. This is the plant of a run folder, or one simulated on the model that the network evolved on.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism show evolution/champion.json\n  \
    tropism show tropism-study --out champion.html\n  \
    tropism show evolution --format dot | dot -Tpdf > champion.pdf")]
pub(crate) struct Show {
    /// Genome file; or the folder of an evolution (also one at work), a study or a run, for its champion
    #[arg(value_name = "champion.json|DIR")]
    source: PathBuf,

    /// File to write the drawing to: .html, .svg, .dot (Graphviz) or .txt
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Format of the drawing, printed if there is no --out; that of the file's name by default
    #[arg(long, value_enum)]
    format: Option<FormatName>,

    /// Tip-motion model on which it steers a plant, instead of the one that it evolved on
    #[arg(long, value_name = "model.json")]
    model: Option<PathBuf>,

    #[command(flatten)]
    task: TaskOption,
}

#[derive(Clone, Copy, ValueEnum)]
enum FormatName {
    Text,
    Html,
    Svg,
    Dot,
}

impl From<FormatName> for ShowFormat {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Text => Self::Text,
            FormatName::Html => Self::Html,
            FormatName::Svg => Self::Svg,
            FormatName::Dot => Self::Dot,
        }
    }
}

impl Show {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = ShowPlan {
            source: self.source,
            out: self.out,
            format: self.format.map(ShowFormat::from),
            model: self.model,
            task: self.task.named()?,
        };
        check_outputs(plan.out.as_slice(), [self.task.task.as_ref()])?;
        execute_and_print(&plan, shell, |results| {
            if let Some(path) = &results.out {
                return format!("{}\nwrote {}", results.summary(), path.display());
            }
            let mut text = results.drawing.clone();
            if matches!(plan.format, None | Some(ShowFormat::Text)) {
                let form = if results.is_too_large { "dot" } else { "html" };
                text += &format!("next: tropism show {} --out champion.{form}", shell_word(&plan.source));
            }
            text.trim_end().to_owned()
        })
    }
}
