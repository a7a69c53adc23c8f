//! How far an evolution is, read from its folder.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::record::checkpoint_path;
use super::{EvolutionRecord, EvolutionRunSummary, EvolveResults};
use crate::{Error, files, holder};

/// What an evolution does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct EvolutionStatus {
    /// Folder of the evolution.
    pub evolution: PathBuf,
    /// Whether its champions are chosen.
    pub is_over: bool,
    /// Whether the model was made from virtual plants.
    pub is_virtual: bool,
    /// Number of the process that works on it.
    pub process: Option<u32>,
    /// Generations of each run.
    pub generations: u32,
    /// Unit of the fitness: `cm`, or `turns` round a pole.
    pub unit: &'static str,
    /// The runs, each as it was saved last.
    pub runs: Vec<RunProgress>,
    /// Seconds since a run was saved last.
    pub saved_ago_s: Option<f64>,
}

/// How far one run of an evolution is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RunProgress {
    /// Generations that are done.
    pub generation: u32,
    /// Best fitness so far.
    pub best_fitness: Option<f64>,
}

impl EvolutionStatus {
    /// Generations that are done, of all runs.
    #[must_use]
    pub fn generations_done(&self) -> u64 {
        self.runs.iter().map(|run| u64::from(run.generation)).sum()
    }
}

/// The status of the evolution in `folder`, also while a program works in it.
///
/// # Errors
/// [`Error`] if `evolution.toml` or the lock cannot be read.
pub(crate) fn status(folder: &Path) -> Result<EvolutionStatus, Error> {
    let record = EvolutionRecord::read(folder)?;
    let progress = |index| {
        let run = record.checkpoint(folder, index)?;
        Some(RunProgress {
            generation: run.search.generation(),
            best_fitness: run.champion().map(|(_, fitness)| fitness),
        })
    };
    let summary = folder.join("summary.json");
    let is_over = summary.exists();
    // A summary is small, and checkpoints are not.
    let results: Option<EvolveResults> =
        is_over.then(|| files::read_as(&summary, |text| serde_json::from_str(text)).ok()).flatten();
    let of_summary = |run: &EvolutionRunSummary| RunProgress {
        generation: run.generations,
        best_fitness: Some(run.best_fitness),
    };
    let runs = match &results {
        Some(results) => results.runs.iter().map(of_summary).collect(),
        None => (0..record.runs()).map(|index| progress(index).unwrap_or_default()).collect(),
    };
    let saved = (0..record.runs()).filter_map(|index| files::age_s(&checkpoint_path(folder, index)));
    Ok(EvolutionStatus {
        evolution: folder.to_owned(),
        is_over,
        is_virtual: record.is_virtual,
        process: holder(folder)?,
        generations: record.generations(),
        unit: record.task.kind.unit(),
        runs,
        saved_ago_s: saved.reduce(f64::min),
    })
}
