//! How far a comparison of controllers is, read from its folder.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::TransferPlan;
use crate::{Error, Work, holder};

/// What a comparison of controllers does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TransferStatus {
    /// Folder of the comparison.
    pub transfer: PathBuf,
    /// Whether its results are written.
    pub is_over: bool,
    /// Number of the process that works on it.
    pub process: Option<u32>,
    /// Number of plants.
    pub plants: usize,
    /// The controllers.
    pub controllers: Vec<SteeredPlants>,
    /// Plants whose best schedule is found; `None` if none is searched.
    pub optima: Option<usize>,
}

/// How far a controller of a comparison is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SteeredPlants {
    /// Its name.
    pub name: String,
    /// Plants that it has steered.
    pub plants: usize,
}

impl TransferStatus {
    /// Plants that are steered, of all controllers.
    #[must_use]
    pub fn done(&self) -> usize {
        self.controllers.iter().map(|one| one.plants).sum()
    }

    /// Plants that are to be steered, of all controllers.
    #[must_use]
    pub fn total(&self) -> usize {
        self.plants * self.controllers.len()
    }
}

/// The status of the comparison in `folder`, also while a program works in it.
///
/// # Errors
/// [`Error`] if `plan.json` or the lock cannot be read.
pub(crate) fn status(folder: &Path) -> Result<TransferStatus, Error> {
    let plan = TransferPlan::of_folder(folder)?;
    let plants = plan.seeds().len();
    let count = |is_there: &dyn Fn(usize) -> bool| (0..plants).filter(|&plant| is_there(plant)).count();
    let controllers = plan.controllers.iter().enumerate().map(|(number, one)| SteeredPlants {
        name: one.name.clone(),
        plants: count(&|plant| plan.track_path(number, plant).exists()),
    });
    Ok(TransferStatus {
        transfer: folder.to_owned(),
        is_over: folder.join("transfer.json").exists(),
        process: holder(folder)?,
        plants,
        controllers: controllers.collect(),
        optima: plan.optimum.then(|| count(&|plant| plan.optimum_path(plant).exists())),
    })
}
