//! `tropism sweep`: seeds times settings, in one table.

mod table;

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use tropism_lab::Work;
use tropism_lab::sweep::{SweepConfig, SweepPlan};

use crate::progress::for_user;
use crate::python::is_address;
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Compare settings over seeds: evolutions or studies of replicates, in one table
///
/// A sweep file names seeds, a grid of settings, and what all settings share. Each setting has one evolution, with all its
/// runs, for each seed; or one study of replicates. The table has the fitness of each setting over runs and seeds,
/// generations to saturation, evaluations and processor time. It says which settings differ, by a rank test of their champions
/// on unseen plants of the model, corrected for all pairs. Ctrl-C saves; --resume continues with the same results as without an
/// interruption.
///
/// The units of work are independent: on a cluster each of them can be executed alone by --unit, on any machine that shares
/// DIR and in any order. The sweep then finds them finished and prints the table. --engine ray leaves that to a Ray cluster,
/// and needs Python with tropism and Ray. --out takes an fsspec address in place of a folder (docs/how-to/use-many-machines.md).
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism sweep studies/sweep.toml --model model.json --out sweep\n  \
    tropism sweep --out sweep --resume\n  \
    tropism sweep studies/sweep.toml --model model.json --out sweep --unit 3\n  \
    tropism sweep studies/sweep.toml --model model.json --out s3://bucket/sweep --engine ray\n  \
    tropism report sweep --out report.html --figures figures\n\n\
    A sweep file, here of two population sizes and three seeds each, 2 x 3 evolutions of 4 runs:\n  \
    seeds = 3\n  \
    [grid]\n  \
    evolution.neat.population = [50, 150]\n  \
    [evolve]\n  \
    evolution.runs = 4\n\
    Keys are those of studies/evolution.toml, or with [replicates] those of studies/robust.toml.")]
pub(crate) struct Sweep {
    /// Sweep file; with --resume alone that of the sweep in DIR
    #[arg(value_name = "SWEEP.toml", required_unless_present = "resume")]
    file: Option<PathBuf>,

    /// Model on which controllers evolve, from `tropism fit`, instead of the file's
    #[arg(long, value_name = "model.json", requires = "file")]
    model: Option<PathBuf>,

    /// Folder to write to, or an fsspec address
    #[arg(long, value_name = "DIR", default_value = "sweep")]
    out: PathBuf,

    /// Continue the sweep in DIR; it needs no file
    #[arg(long)]
    resume: bool,

    #[command(flatten)]
    units: UnitsOption,
}

impl Sweep {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let is_at_address = is_address(&self.out);
        if is_at_address && (self.units.unit.is_some() || self.units.list && self.file.is_none()) {
            bail!("--out {} must be a folder with --unit or --list", self.out.display());
        }
        if is_at_address && !self.units.list {
            // What is at an address only Python can read.
            let plan = self.file.is_some().then(|| self.plan()).transpose()?;
            let results = self.units.order(plan.as_ref(), &self.out).execute_all()?;
            return shell.result(&table::sweep(&results, &self.out), &results);
        }
        self.units.execute(&self.plan()?, shell, |results| table::sweep(results, &self.out))
    }

    fn plan(&self) -> Result<SweepPlan> {
        let Some(file) = &self.file else {
            return SweepPlan::of_folder(&self.out).map_err(for_user);
        };
        let mut config = SweepConfig::read(file).map_err(for_user)?;
        let folder = file.parent().map(PathBuf::from).unwrap_or_default();
        if let Some(model) = &self.model {
            if config.is_of_replicates() {
                bail!("--model does not go with replicates, which make models of their own");
            }
            // From here on, and not from the folder of the file.
            config.model = Some(std::path::absolute(model)?);
        }
        Ok(SweepPlan { out: self.out.clone(), resume: self.resume, folder, config })
    }
}
