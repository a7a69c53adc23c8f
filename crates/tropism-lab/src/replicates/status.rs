//! How far a comparison of methods is, read from its folder.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Method, ReplicatesPlan, Scenario};
use crate::transfer::{self, TransferStatus};
use crate::{Error, Work, holder};

/// What a comparison of methods does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReplicatesStatus {
    /// Folder of the comparison.
    pub replicates: PathBuf,
    /// Whether its results are written.
    pub is_over: bool,
    /// Number of the process that works on it.
    pub process: Option<u32>,
    /// The scenarios, in order.
    pub scenarios: Vec<ScenarioStatus>,
}

/// How far a scenario of a comparison of methods is.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ScenarioStatus {
    /// Its name.
    pub scenario: String,
    /// The scenario whose controllers and reference are judged here, too; `None` if this scenario makes its own.
    pub controllers_of: Option<String>,
    /// Whether the reference controller of this scenario is found; `None` if none is searched.
    pub has_reference: Option<bool>,
    /// Controllers of this scenario that are made.
    pub controllers_done: usize,
    /// Controllers that all replicates make for this scenario by all methods; 0 with borrowed controllers.
    pub controllers: usize,
    /// How far their comparison on test plants is, if it has begun.
    pub judged: Option<TransferStatus>,
}

/// The status of the comparison in `folder`, also while a program works in it.
///
/// # Errors
/// [`Error`] if `replicates.toml` or the lock cannot be read.
pub(crate) fn status(folder: &Path) -> Result<ReplicatesStatus, Error> {
    let plan = ReplicatesPlan::of_folder(folder)?;
    Ok(ReplicatesStatus {
        replicates: folder.to_owned(),
        is_over: folder.join("replicates.json").exists(),
        process: holder(folder)?,
        scenarios: plan
            .config
            .scenarios
            .iter()
            .map(|scenario| plan.status_of(scenario))
            .collect::<Result<_, _>>()?,
    })
}

impl ReplicatesPlan {
    fn status_of(&self, scenario: &Scenario) -> Result<ScenarioStatus, Error> {
        let is_borrowing = scenario.controllers_of.is_some();
        let methods: &[Method] = if is_borrowing { &[] } else { &self.config.methods };
        let all = (0..self.config.replicates)
            .flat_map(|replicate| methods.iter().map(move |method| self.made(scenario, replicate, method)));
        let folder = self.scenario_folder(scenario);
        let judged = folder.join("judged");
        let has_begun = judged.join("transfer.toml").exists();
        Ok(ScenarioStatus {
            scenario: scenario.name.clone(),
            controllers_of: scenario.controllers_of.clone(),
            has_reference: self
                .config
                .reference
                .filter(|_| !is_borrowing)
                .map(|_| self.reference(scenario).exists()),
            controllers_done: all.filter(|files| files.iter().all(|file| file.exists())).count(),
            controllers: methods.len() * self.config.replicates as usize,
            judged: has_begun.then(|| transfer::status(&judged)).transpose()?,
        })
    }
}
