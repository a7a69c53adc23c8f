//! Which units of a long work a command executes, and where.

use std::path::Path;
use std::str::FromStr;

use anyhow::Result;
use clap::Args;
use tropism_lab::Work;
use tropism_lab::files::shell_word;
use tropism_lab::work::{ListedUnit, UnitPlan, UnitResults, units_of};

use crate::progress::{ProgressMonitor, execute_with, for_user};
use crate::python::Order;
use crate::shell::Shell;

/// What executes the units of a work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Engine {
    /// The threads of this program.
    Local,
    /// The workers of a Ray cluster, at an address; without one it is started on this machine.
    Ray(Option<String>),
}

impl FromStr for Engine {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("ray:")) {
            ("local", _) => Ok(Self::Local),
            ("ray", _) => Ok(Self::Ray(None)),
            // The address of a Ray Client is whole.
            (_, Some(address)) if address.starts_with("//") => Ok(Self::Ray(Some(text.to_owned()))),
            (_, Some(address)) => Ok(Self::Ray(Some(address.to_owned()))),
            _ => Err("wanted local, ray, or ray:HOST:PORT".to_owned()),
        }
    }
}

/// The options of every long work: its units are independent, and may be executed by several programs
/// (docs/how-to/use-many-machines.md).
#[derive(Args)]
pub(crate) struct UnitsOption {
    /// Execute unit K of --list alone, beside others in DIR
    #[arg(long, value_name = "K")]
    pub(crate) unit: Option<usize>,

    /// List the units: number, stage, name; do nothing
    #[arg(long, conflicts_with = "unit")]
    pub(crate) list: bool,

    /// What executes the units: local, or ray[:HOST:PORT], a cluster that shares DIR
    #[arg(long, value_name = "ENGINE", default_value = "local", conflicts_with_all = ["unit", "list"])]
    pub(crate) engine: Engine,
}

impl UnitsOption {
    /// Executes `work`, or those of its units that are asked for, and prints what comes out: the results by `text`.
    pub(crate) fn execute<W: Work>(
        &self,
        work: &W,
        shell: &Shell,
        text: impl FnOnce(&W::Results) -> String,
    ) -> Result<()> {
        match self.results(work, shell)? {
            Some(results) => shell.result(&text(&results), &results),
            None => Ok(()),
        }
    }

    /// The results of `work`; `None` if units were listed or executed alone, which are printed then.
    pub(crate) fn results<W: Work>(&self, work: &W, shell: &Shell) -> Result<Option<W::Results>> {
        if self.list {
            let units = units_of(work).map_err(for_user)?;
            return shell.result(&listed(&units), &units).map(|()| None);
        }
        let monitor = ProgressMonitor::new(shell);
        if let Some(unit) = self.unit {
            let done = execute_with(&UnitPlan { work: work.clone(), unit }, &monitor)?;
            drop(monitor);
            return shell.result(&one_done(&done), &done).map(|()| None);
        }
        let mut work = work.clone();
        if self.engine != Engine::Local {
            // Says before any work what is missing.
            units_of(&work).map_err(for_user)?;
            let absolute = work.clone().with_absolute_paths().map_err(for_user)?;
            self.order(Some(&absolute), absolute.out()).execute_units()?;
            // All units are done: what is left is the collection of the results.
            work = work.to_resume();
        }
        execute_with(&work, &monitor).map(Some)
    }

    /// What Python is to do with `work`.
    pub(crate) fn order<'a, W: Work>(&'a self, plan: Option<&'a W>, out: &'a Path) -> Order<'a, W> {
        let (engine, address) = match &self.engine {
            Engine::Local => ("local", None),
            Engine::Ray(address) => ("ray", address.as_deref()),
        };
        let threads = rayon::current_num_threads();
        Order { workflow: W::WORKFLOW, plan, out, engine, address, threads }
    }
}

fn listed(units: &[ListedUnit]) -> String {
    let line = |ListedUnit { number, stage, unit, about, is_done }: &ListedUnit| {
        let done = if *is_done { "done  " } else { "" };
        format!("{number:>5}  {stage}  {unit:<24} {done}{about}")
    };
    units.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn one_done(UnitResults { folder, number, total, unit, about }: &UnitResults) -> String {
    format!(
        "unit {number} of {total}, {unit}: {about}\nnext: the other units; then the same command without --unit, with --out {} \
         --resume, which collects the results",
        shell_word(folder)
    )
}
