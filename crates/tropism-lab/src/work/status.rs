//! How far a long work is, read from its folder without disturbing it.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Work;
use crate::lock::is_shared;
use crate::{Error, holder};

/// What a long work does now.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WorkStatus {
    /// Its workflow: `study`.
    pub work: &'static str,
    /// Its folder, or the file of a rule.
    pub folder: PathBuf,
    /// Whether its results are written.
    pub is_over: bool,
    /// Whether its plants are virtual, or it works on a model of such; `None` where that is not known.
    pub is_virtual: Option<bool>,
    /// Number of the process that works on all of it.
    pub process: Option<u32>,
    /// Whether programs work on units of it.
    pub is_shared: bool,
    /// How far each of its parts is, in order: stages, runs, settings, controllers, scenarios.
    pub parts: Vec<PartStatus>,
    /// Seconds since something was saved last, where it is not over.
    pub saved_ago_s: Option<f64>,
}

/// How far a part of a long work is.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PartStatus {
    /// Its name.
    pub name: String,
    /// How much is done.
    pub done: u64,
    /// How much there is to do.
    pub total: u64,
    /// What is counted, in the plural: `generations`.
    pub unit: &'static str,
    /// The best fitness so far, where something is searched for.
    pub best: Option<f64>,
    /// Unit of the fitness: `cm`, or `turns` round a pole.
    pub best_unit: Option<&'static str>,
    /// Wall-clock seconds that were spent on it, where they are kept.
    pub seconds: Option<f64>,
}

impl PartStatus {
    /// A part without a fitness and seconds.
    pub(crate) fn new(name: impl Into<String>, done: u64, total: u64, unit: &'static str) -> Self {
        Self { name: name.into(), done, total, unit, best: None, best_unit: None, seconds: None }
    }

    /// Whether all of it is done.
    #[must_use]
    pub const fn is_done(&self) -> bool {
        self.done >= self.total
    }
}

impl WorkStatus {
    /// The status of the work in `folder`, whose parts are known.
    ///
    /// # Errors
    /// [`Error`] if the lock cannot be read.
    pub(crate) fn of<W: Work>(folder: &Path, parts: Vec<PartStatus>) -> Result<Self, Error> {
        Ok(Self {
            work: W::WORKFLOW,
            folder: folder.to_owned(),
            is_over: folder.join(W::RESULTS[0]).exists(),
            is_virtual: Some(true),
            process: holder(folder)?,
            is_shared: is_shared(folder),
            parts,
            saved_ago_s: None,
        })
    }

    /// How much is done, of how much, and of what: over all parts where they count the same, else the parts that are done.
    #[must_use]
    pub fn progress(&self) -> (u64, u64, &'static str) {
        let unit = self.parts.first().map_or("parts", |part| part.unit);
        if self.parts.iter().all(|part| part.unit == unit) {
            let sum = |of: fn(&PartStatus) -> u64| self.parts.iter().map(of).sum();
            return (sum(|part| part.done), sum(|part| part.total), unit);
        }
        let done = self.parts.iter().filter(|part| part.is_done()).count();
        (done as u64, self.parts.len() as u64, "stages")
    }

    /// The best fitness of all parts.
    #[must_use]
    pub fn best(&self) -> Option<f64> {
        self.parts.iter().filter_map(|part| part.best).reduce(f64::max)
    }
}
