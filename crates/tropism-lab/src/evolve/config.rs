//! A file with the settings of an evolution.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::evolve::EvolutionConfig;
use tropism::task::Task;

use super::{EvolvePlan, TRIAL_PLANTS};
use crate::files::{self, FileError};
use crate::{Error, Workflow};

/// The settings of an evolution, without its model and its folder: the content of `studies/evolution.toml`. What is left out
/// is the paper's. The `evolution.toml` of another evolution can be read, too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct EvolveConfig {
    /// Schema of the `evolution.toml` of an evolution.
    #[serde(skip_serializing)]
    schema: Option<String>,
    /// Version that wrote it.
    #[serde(skip_serializing)]
    version: Option<String>,
    /// Whether its model was made from virtual plants: decides nothing here.
    #[serde(skip_serializing)]
    is_virtual: Option<bool>,
    /// Digest of its model: decides nothing here.
    #[serde(skip_serializing)]
    model_sha256: Option<String>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Unseen simulated plants of each model on which champions are compared.
    pub trial_plants: u32,
    /// Task of the controllers.
    pub task: Task,
    /// Number of runs, generations and episodes, and NEAT's parameters.
    pub evolution: EvolutionConfig,
}

impl Default for EvolveConfig {
    fn default() -> Self {
        Self {
            schema: None,
            version: None,
            is_virtual: None,
            model_sha256: None,
            seed: 1,
            trial_plants: TRIAL_PLANTS,
            task: Task::default(),
            evolution: EvolutionConfig::default(),
        }
    }
}

impl EvolveConfig {
    /// Reads the settings of a file.
    ///
    /// # Errors
    /// [`Error`] names the file, the key, what was found and what was wanted.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let config: Self = files::read_toml(path).map_err(|error| match error {
            FileError::Content { path, problem } if problem.contains("unknown field `neat`") => {
                let mend = "NEAT's parameters belong in [evolution.neat]";
                FileError::Content { path, problem: format!("{problem}: {mend}") }
            }
            error => error,
        })?;
        config.clone().plan().check().map_err(Error::at(path.display()))?;
        Ok(config)
    }

    /// A plan with these settings.
    #[must_use]
    pub fn plan(self) -> EvolvePlan {
        let Self { seed, trial_plants, task, evolution, .. } = self;
        EvolvePlan { seed, trial_plants, task, evolution, ..EvolvePlan::default() }
    }
}
