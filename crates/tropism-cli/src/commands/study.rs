//! `tropism study`: the paper, end to end.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::Error;
use tropism_lab::files;
use tropism_lab::study::{StudyConfig, StudyPlan, StudyResults};

use crate::options::BeanOption;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Repeat the whole paper: beans, photographs, model, evolution, and unseen beans
///
/// Six virtual beans are photographed under lamps that switch every six hours. Their photographs give tracks, the
/// tracks a model, and evolution on the model gives controllers. The best controller steers six unseen virtual beans by
/// their photographs. A report shows figures and numbers beside the paper's. Ctrl-C saves; --resume continues with the
/// same results as without an interruption.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism study --quick\n  \
    tropism study studies/paper.toml --out mine --seed 7")]
pub(crate) struct Study {
    /// Study file; the paper by default
    #[arg(value_name = "STUDY.toml")]
    file: Option<PathBuf>,

    /// Run a small study that takes about a minute
    #[arg(long, conflicts_with = "file")]
    quick: bool,

    /// Folder to write to
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Continue the study in DIR
    #[arg(long)]
    resume: bool,

    /// Seed of all random numbers, instead of the file's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    #[command(flatten)]
    bean: BeanOption,
}

impl Study {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let mut config = match (&self.file, self.quick) {
            (Some(path), _) => files::read_toml(path)?,
            (None, true) => StudyConfig::quick(),
            (None, false) => StudyConfig::default(),
        };
        config.seed = self.seed.unwrap_or(config.seed);
        if let Some(bean) = self.bean.load()? {
            config.greenhouse.bean = bean;
        }
        if let Some(path) = &self.file {
            config.check().map_err(Error::at(path.display()))?;
        }
        let default = if self.quick { "tropism-study-quick" } else { "tropism-study" };
        let out = self.out.unwrap_or_else(|| default.into());
        execute_and_print(&StudyPlan { out, resume: self.resume, config }, shell, text)
    }
}

fn text(results: &StudyResults) -> String {
    let mut text = format!("{:<42}  {:>8}  ours (virtual plants)\n", "", "paper");
    for row in results.rows() {
        text += &format!("{:<42}  {:>8}  {}\n", row.what, row.paper, row.ours);
    }
    let StudyResults { reality_random, reality_periodic, reality_chase, .. } = results;
    text += &format!(
        "on the same unseen beans: random {:.2}, periodic {:.2}, chase {:.2}\n",
        reality_random.mean, reality_periodic.mean, reality_chase.mean
    );
    text + &format!("\nreport: {}", results.report.display())
}
