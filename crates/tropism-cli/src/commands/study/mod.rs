//! `tropism study`: the paper, end to end.

mod laboratories;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::Args;
use serde::de::IgnoredAny;
use tropism_lab::Error;
use tropism_lab::files;
use tropism_lab::laboratories::{LaboratoriesConfig, LaboratoriesPlan};
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
///
/// A study file with `laboratories` compares recipes instead: each laboratory makes controllers from the tracks of its own
/// plants, and all steer the same unseen plants. studies/robust.toml does this for three kinds of plants.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism study --quick\n  \
    tropism study studies/paper.toml --out mine --seed 7\n  \
    tropism study studies/robust.toml --out robust")]
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
        if let Some(path) = self.file.as_deref().filter(|path| names_laboratories(path)) {
            return self.compare(path, shell);
        }
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

impl Study {
    /// Compares recipes over laboratories.
    fn compare(&self, path: &Path, shell: &Shell) -> Result<()> {
        ensure!(
            self.bean.load()?.is_none(),
            "found --bean, wanted species in the worlds of {}",
            path.display()
        );
        let mut config: LaboratoriesConfig = files::read_toml(path)?;
        config.seed = self.seed.unwrap_or(config.seed);
        let folder = path.parent().unwrap_or(Path::new(""));
        for bean in config.worlds.iter_mut().filter_map(|world| world.bean.as_mut()) {
            *bean = folder.join(&*bean);
        }
        config.check().map_err(Error::at(path.display()))?;
        let out = self.out.clone().unwrap_or_else(|| "tropism-laboratories".into());
        let plan = LaboratoriesPlan { out, resume: self.resume, config };
        execute_and_print(&plan, shell, |results| laboratories::text(results, &plan.out))
    }
}

/// Whether a study file compares laboratories: each of these keys says so, that a misspelt one is told as such. What cannot
/// be read is not said to.
fn names_laboratories(path: &Path) -> bool {
    let table = files::read_toml::<BTreeMap<String, IgnoredAny>>(path);
    table.is_ok_and(|table| ["laboratories", "recipes", "worlds"].iter().any(|key| table.contains_key(*key)))
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
