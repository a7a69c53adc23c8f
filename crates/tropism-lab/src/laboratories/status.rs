//! How far a comparison of recipes is, read from its folder.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{LaboratoriesPlan, Recipe, World};
use crate::transfer::{self, TransferStatus};
use crate::{Error, holder};

/// What a comparison of recipes does now.
#[derive(Clone, Debug, Serialize)]
pub struct LaboratoriesStatus {
    /// Folder of the comparison.
    pub laboratories: PathBuf,
    /// Whether its results are written.
    pub is_over: bool,
    /// Number of the process that works on it.
    pub process: Option<u32>,
    /// The worlds, in order.
    pub worlds: Vec<WorldStatus>,
}

/// How far a world of a comparison of recipes is.
#[derive(Clone, Debug, Serialize)]
pub struct WorldStatus {
    /// Its name.
    pub world: String,
    /// The world whose controllers and bound are judged here, too; `None` if this world makes its own.
    pub controllers_of: Option<String>,
    /// Whether the bound of this world is found; `None` if none is searched.
    pub has_bound: Option<bool>,
    /// Controllers of this world that are made.
    pub controllers_done: usize,
    /// Controllers that all laboratories make for this world by all recipes; 0 with borrowed controllers.
    pub controllers: usize,
    /// How far their judging is, if it has begun.
    pub judged: Option<TransferStatus>,
}

/// The status of the comparison in `folder`, also while a program works in it.
///
/// # Errors
/// [`Error`] if `laboratories.toml` or the lock cannot be read.
pub(crate) fn status(folder: &Path) -> Result<LaboratoriesStatus, Error> {
    let plan = LaboratoriesPlan::of_folder(folder)?;
    Ok(LaboratoriesStatus {
        laboratories: folder.to_owned(),
        is_over: folder.join("laboratories.json").exists(),
        process: holder(folder)?,
        worlds: plan.config.worlds.iter().map(|world| plan.status_of(world)).collect::<Result<_, _>>()?,
    })
}

impl LaboratoriesPlan {
    fn status_of(&self, world: &World) -> Result<WorldStatus, Error> {
        let is_borrowing = world.controllers_of.is_some();
        let recipes: &[Recipe] = if is_borrowing { &[] } else { &self.config.recipes };
        let all = (0..self.config.laboratories)
            .flat_map(|laboratory| recipes.iter().map(move |recipe| self.made(world, laboratory, recipe)));
        let folder = self.world_folder(world);
        let judged = folder.join("judged");
        let has_begun = judged.join("transfer.toml").exists();
        Ok(WorldStatus {
            world: world.name.clone(),
            controllers_of: world.controllers_of.clone(),
            has_bound: self.config.bound.filter(|_| !is_borrowing).map(|_| self.bound(world).exists()),
            controllers_done: all.filter(|files| files.iter().all(|file| file.exists())).count(),
            controllers: recipes.len() * self.config.laboratories as usize,
            judged: has_begun.then(|| transfer::status(&judged)).transpose()?,
        })
    }
}
