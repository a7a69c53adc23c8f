//! How far a study is, read from its folder.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::config::{PHOTOGRAPHED, StudyConfig};
use super::results::read_seconds;
use super::{STAGES, StudyPlan};
use crate::evolve::{self, EvolutionStatus};
use crate::{Error, Work, holder};

/// What a study does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StudyStatus {
    /// Folder of the study.
    pub study: PathBuf,
    /// Whether its report is written.
    pub is_over: bool,
    /// Number of the process that works on it.
    pub process: Option<u32>,
    /// Its stages, in order.
    pub stages: Vec<StageStatus>,
    /// The evolution, if it has begun.
    pub evolution: Option<EvolutionStatus>,
}

/// How far a stage of a study is.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StageStatus {
    /// Name of the stage.
    pub name: &'static str,
    /// Units that are done.
    pub done: u64,
    /// Units in all.
    pub total: u64,
    /// What a unit is, in the plural.
    pub unit: &'static str,
    /// Seconds that were spent on it so far.
    pub seconds: Option<f64>,
}

/// The status of the study in `folder`.
///
/// # Errors
/// [`Error`] if `study.toml` or the lock cannot be read.
pub(crate) fn status(folder: &Path) -> Result<StudyStatus, Error> {
    let StudyPlan { config, .. } = StudyPlan::of_folder(folder)?;
    let is_there = |name: &str| u64::from(folder.join(name).exists());
    let evolution =
        folder.join("evolution/evolution.toml").exists().then(|| evolve::status(&folder.join("evolution")));
    let evolution = evolution.transpose()?;
    let generations = u64::from(config.evolution.runs) * u64::from(config.evolution.generations);
    let done = evolution.as_ref().map_or(0, EvolutionStatus::generations_done);
    let counts = [
        (over(&folder.join("open-loop"), config.experiments), config.experiments.into(), "experiments"),
        (is_there("model.json"), 1, "models"),
        (done, generations, "generations"),
        (is_there("random/baseline.json"), 1, "baselines"),
        (is_there("rule.json"), 1, "rules"),
        (
            in_reality(folder, &config),
            PHOTOGRAPHED.len() as u64 * u64::from(config.reality_plants),
            "experiments",
        ),
        (is_there("many-plants/transfer.json"), 1, "comparisons"),
        (is_there("numbers.json"), 1, "reports"),
    ];
    let seconds = read_seconds(folder);
    let stage = |(name, (done, total, unit)): (&'static str, (u64, u64, &'static str))| StageStatus {
        name,
        done,
        total,
        unit,
        seconds: seconds.get(name).copied(),
    };
    Ok(StudyStatus {
        study: folder.to_owned(),
        is_over: is_there("numbers.json") == 1,
        process: holder(folder)?,
        stages: STAGES.into_iter().zip(counts).map(stage).collect(),
        evolution,
    })
}

/// How many of the runs `1` to `count` in `folder` are over.
fn over(folder: &Path, count: u32) -> u64 {
    let is_over = |number: &u32| folder.join(number.to_string()).join("track.csv").exists();
    (1..=count).filter(is_over).count() as u64
}

fn in_reality(folder: &Path, config: &StudyConfig) -> u64 {
    let reality = folder.join("reality");
    PHOTOGRAPHED.iter().map(|name| over(&reality.join(name), config.reality_plants)).sum()
}
