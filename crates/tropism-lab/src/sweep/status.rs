//! How far a sweep is, read from its folder.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::SweepPlan;
use super::units::unit_folder;
use crate::evolve::{self, EvolutionStatus};
use crate::{Error, Work, holder};

/// What a sweep does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SweepStatus {
    /// Folder of the sweep.
    pub sweep: PathBuf,
    /// Whether its table is written.
    pub is_over: bool,
    /// Number of the process that works on all of it.
    pub process: Option<u32>,
    /// Number of settings.
    pub settings: usize,
    /// Number of seeds.
    pub seeds: usize,
    /// Units of work that are finished.
    pub done: usize,
    /// Units of work in all.
    pub total: usize,
    /// Names of the units that have begun and are not finished.
    pub begun: Vec<String>,
    /// Generations that are done, of all evolutions; `None` for replicates.
    pub generations_done: Option<u64>,
    /// Generations of all evolutions.
    pub generations: Option<u64>,
}

/// The status of the sweep in `folder`, also while programs work in it.
///
/// # Errors
/// [`Error`] if `sweep.toml` or the lock cannot be read.
pub(crate) fn status(folder: &Path) -> Result<SweepStatus, Error> {
    let plan = SweepPlan::of_folder(folder)?;
    let settings = plan.config.settings(&plan.folder)?;
    let units = plan.units()?;
    let (mut done, mut begun) = (0, Vec::new());
    let (mut generations_done, mut generations) = (0, 0);
    for unit in &units {
        let own = unit_folder(folder, unit);
        let of_unit = settings[unit.place].generations();
        generations += of_unit;
        if own.join("unit.json").exists() {
            done += 1;
            generations_done += of_unit;
        } else if own.exists() {
            begun.push(unit.name.clone());
            let has_record = own.join("evolution.toml").exists();
            let evolution = has_record.then(|| evolve::status(&own)).transpose()?;
            generations_done += evolution.as_ref().map_or(0, EvolutionStatus::generations_done);
        }
    }
    let is_evolution = !plan.config.is_of_replicates();
    Ok(SweepStatus {
        sweep: folder.to_owned(),
        is_over: folder.join("sweep.json").exists(),
        process: holder(folder)?,
        settings: settings.len(),
        seeds: plan.config.seeds.list().len(),
        done,
        total: units.len(),
        begun,
        generations_done: is_evolution.then_some(generations_done),
        generations: is_evolution.then_some(generations),
    })
}
