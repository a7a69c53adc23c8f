//! `tropism study`: the paper, end to end.

mod replicates;
mod walls;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use clap::{Args, ValueEnum};
use serde::de::IgnoredAny;
use tropism_lab::files;
use tropism_lab::replicates::{ReplicatesConfig, ReplicatesPlan};
use tropism_lab::study::{StudyConfig, StudyPlan, StudyResults};
use tropism_lab::wall::{WallStudyConfig, WallStudyPlan};
use tropism_lab::{Error, Work};

use crate::options::BeanOption;
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Repeat the whole paper: beans, photographs, model, evolution, and unseen beans
///
/// Six virtual beans are photographed under lamps that switch every six hours. Their photographs give tracks, the
/// tracks a model, and evolution on the model gives controllers. The best controller steers six unseen virtual beans by
/// their photographs. Beyond the paper, a rule that is tuned to arrive at the targets steers the same beans. A report shows figures and numbers beside the paper's. Ctrl-C saves; --resume continues with the
/// same results as without an interruption. `tropism status DIR` shows how far it is.
///
/// A study file with `replicates` compares methods instead: each replicate makes controllers from the tracks of its own
/// plants, and all steer the same unseen plants. studies/robust.toml does this for four kinds of plants. One with `walls` tests
/// nodes that steer together; studies/wall.toml evolves some, too.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism study --quick\n  \
    tropism study studies/paper.toml --out mine --seed 7\n  \
    tropism study --out mine --resume\n  \
    tropism study studies/robust.toml --out robust\n  \
    tropism study studies/wall.toml --out walls")]
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

    /// Continue the study in DIR; no other option is needed
    #[arg(long)]
    resume: bool,

    /// Keep all photographs and the stems of the ground truth of each run: some 700 MB instead of 150
    #[arg(long, value_enum, value_name = "WHAT")]
    keep: Option<Keep>,

    /// Seed of all random numbers, instead of the file's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    #[command(flatten)]
    bean: BeanOption,

    #[command(flatten)]
    units: UnitsOption,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Keep {
    Photographs,
}

impl Study {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let default = if self.quick { "tropism-study-quick" } else { "tropism-study" };
        let keep_photographs = self.keep == Some(Keep::Photographs);
        if self.resumes_alone() {
            let out = self.out.clone().unwrap_or_else(|| default.into());
            if out.join("replicates.toml").exists() {
                self.check_keeps_nothing()?;
                let plan = ReplicatesPlan::of_folder(&out)?;
                return self.units.execute(&plan, shell, |results| replicates::text(results, &plan.out));
            }
            if out.join(WallStudyPlan::RECORD).exists() {
                self.check_keeps_nothing()?;
                let plan = WallStudyPlan::of_folder(&out)?;
                return self.units.execute(&plan, shell, |results| walls::text(results, &plan.out));
            }
            let plan = StudyPlan { keep_photographs, ..StudyPlan::of_folder(&out)? };
            return self.units.execute(&plan, shell, text);
        }
        if let Some(path) = &self.file {
            // Each of these keys says of which kind a study file is, so that a misspelt one is reported as such.
            let keys = keys_of(path);
            let names = |key: &str| keys.contains_key(key);
            if names("walls") {
                return self.test_walls(path, shell);
            }
            if ["replicates", "methods", "scenarios"].into_iter().any(names) {
                return self.compare(path, shell);
            }
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
        let out = self.out.unwrap_or_else(|| default.into());
        let plan = StudyPlan { out, resume: self.resume, keep_photographs, config };
        self.units.execute(&plan, shell, text)
    }
}

impl Study {
    /// Whether the study in the folder goes on with its own settings: no option says otherwise.
    fn resumes_alone(&self) -> bool {
        self.resume && self.file.is_none() && self.seed.is_none() && self.bean.bean.is_none()
    }

    /// Replicates have no photographs to keep.
    fn check_keeps_nothing(&self) -> Result<()> {
        ensure!(
            self.keep.is_none(),
            "--keep does not go with a comparison of methods, which writes no photographs"
        );
        Ok(())
    }

    /// Tests rules of nodes on many walls.
    fn test_walls(&self, path: &Path, shell: &Shell) -> Result<()> {
        ensure!(self.bean.load()?.is_none(), "--bean does not go with a study of walls");
        self.check_keeps_nothing()?;
        let mut config = WallStudyConfig::read(path)?;
        config.seed = self.seed.unwrap_or(config.seed);
        config.check().map_err(Error::at(path.display()))?;
        let out = self.out.clone().unwrap_or_else(|| "tropism-walls".into());
        let plan = WallStudyPlan { out, resume: self.resume, config };
        self.units.execute(&plan, shell, |results| walls::text(results, &plan.out))
    }

    /// Compares methods over replicates.
    fn compare(&self, path: &Path, shell: &Shell) -> Result<()> {
        ensure!(
            self.bean.load()?.is_none(),
            "--bean does not go with {}: write species into its scenarios",
            path.display()
        );
        self.check_keeps_nothing()?;
        let mut config = ReplicatesConfig::read(path)?;
        config.seed = self.seed.unwrap_or(config.seed);
        config.check().map_err(Error::at(path.display()))?;
        let out = self.out.clone().unwrap_or_else(|| "tropism-replicates".into());
        let plan = ReplicatesPlan { out, resume: self.resume, config };
        self.units.execute(&plan, shell, |results| replicates::text(results, &plan.out))
    }
}

/// The keys of a study file; none of one that cannot be read.
fn keys_of(path: &Path) -> BTreeMap<String, IgnoredAny> {
    files::read_toml(path).unwrap_or_default()
}

fn text(results: &StudyResults) -> String {
    let mut text = format!("{:<42}  {:>8}  {:<22}  reproduced\n", "", "paper", "ours (virtual plants)");
    for row in results.rows() {
        let line = format!("{:<42}  {:>8}  {:<22}  {}", row.what, row.paper, row.ours, row.reproduced);
        text += &format!("{}\n", line.trim_end());
    }
    let StudyResults { reality_greedy, reality_rule, .. } = results;
    text += &format!(
        "on the same photographed beans: greedy {:.2}, tuned rule {:.2}\n",
        reality_greedy.mean, reality_rule.mean
    );
    text + &format!("\nreport: {}", results.report.display())
}
