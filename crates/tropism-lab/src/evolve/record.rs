//! `evolution.toml`: everything that decides the results of an evolution, kept in its folder.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::evolve::{Champion, EvolutionConfig, EvolutionRun};
use tropism::task::Task;
use tropism_neat::Genome;

use super::EvolvePlan;
use crate::model::Model;
use crate::{Error, files};

/// Everything that decides the results of an evolution: the content of `evolution.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvolutionRecord {
    schema: String,
    version: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether the model was made from virtual plants.
    pub is_virtual: bool,
    /// SHA-256 of the model's JSON, in hexadecimal.
    model_sha256: String,
    pub(super) trial_plants: u32,
    /// Task of the controllers.
    pub task: Task,
    /// Number of runs, generations and episodes, and NEAT's parameters.
    pub evolution: EvolutionConfig,
}

fn digest(model: &Model) -> String {
    files::sha256(model.to_json().as_bytes())
}

impl EvolutionRecord {
    /// The record of `plan` on `model`.
    pub(super) fn new(plan: &EvolvePlan, model: &Model) -> Self {
        Self {
            schema: "tropism.evolution/1".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: plan.seed,
            is_virtual: model.is_virtual(),
            model_sha256: digest(model),
            trial_plants: plan.trial_plants,
            task: plan.task.clone(),
            evolution: plan.evolution.clone(),
        }
    }

    /// Reads the record of the evolution in `folder`.
    ///
    /// # Errors
    /// [`Error::File`] if there is none, or it cannot be read.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        Ok(files::read_toml(&Self::path(folder))?)
    }

    /// Whether the record in `folder` is that of an evolution: settings for one may have the same name, but have no schema.
    pub(crate) fn is_in(folder: &Path) -> bool {
        let record: Result<toml::Table, _> = files::read_toml(&Self::path(folder));
        record.map_or_else(|_| Self::path(folder).exists(), |record| record.contains_key("schema"))
    }

    /// The place of the record in `folder`.
    pub(crate) fn path(folder: &Path) -> PathBuf {
        folder.join("evolution.toml")
    }

    /// The champion that `genome` is in this evolution.
    #[must_use]
    pub fn champion_of(&self, genome: Genome) -> Champion {
        Champion {
            sensors: self.evolution.sensors.clone(),
            dimming: self.evolution.dimming,
            task: Some(self.task.clone()),
            model_sha256: Some(self.model_sha256.clone()),
            is_virtual: Some(self.is_virtual),
            ..Champion::of_genome(genome)
        }
    }

    /// Digest of the model on which the controllers evolved.
    pub(crate) fn model_sha256(&self) -> &str {
        &self.model_sha256
    }

    /// Whether the controllers evolved on `model`.
    pub(crate) fn is_on(&self, model: &Model) -> bool {
        self.model_sha256 == digest(model)
    }

    /// Whether this is the evolution `known` with more generations: the first of them are the same to the bit.
    pub(super) fn extends(&self, known: &Self) -> bool {
        let generations = known.evolution.generations;
        let shortened = EvolutionConfig { generations, ..self.evolution.clone() };
        self.evolution.generations > generations && Self { evolution: shortened, ..self.clone() } == *known
    }

    /// Number of runs.
    pub(super) const fn runs(&self) -> u32 {
        self.evolution.runs
    }

    /// Generations of each run.
    pub(super) const fn generations(&self) -> u32 {
        self.evolution.generations
    }

    /// Run `index` as it was saved in `folder`; `None` without a readable checkpoint. Reads only: the evolution may be at
    /// work.
    #[must_use]
    pub fn checkpoint(&self, folder: &Path, index: u32) -> Option<EvolutionRun> {
        let parse = |text: &str| EvolutionRun::from_json(text, &self.evolution, self.seed, index);
        files::read_as(&checkpoint_path(folder, index), parse).ok()
    }

    /// Among the checkpoints in the `folder` of an unfinished evolution, the run with the best champion, and its
    /// number; `None` without a readable checkpoint. Reads only: the evolution may be at work.
    pub(crate) fn best_so_far(&self, folder: &Path) -> Option<(u32, EvolutionRun)> {
        let read = |index| Some((index, self.checkpoint(folder, index)?));
        let fitness = |run: &EvolutionRun| run.champion().map_or(f64::NEG_INFINITY, |(_, fitness)| fitness);
        let begun = (0..self.evolution.runs).filter_map(read).filter(|(_, run)| run.champion().is_some());
        begun.max_by(|(_, a), (_, b)| fitness(a).total_cmp(&fitness(b)))
    }
}

/// The checkpoint of run `index` of the evolution in `folder`.
pub(super) fn checkpoint_path(folder: &Path, index: u32) -> PathBuf {
    folder.join(format!("run-{index:02}.json"))
}

/// The champion of run `index` of the evolution in `folder`.
pub(crate) fn champion_path(folder: &Path, index: usize) -> PathBuf {
    folder.join("champions").join(format!("run-{index:02}.json"))
}
