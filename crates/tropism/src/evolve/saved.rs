//! An evolutionary run as a file: its checkpoint, checked when it is read.

use serde::{Deserialize, Serialize};
use tropism_neat::{Generation, Neat};

use super::{EvolutionConfig, EvolutionRun, Method, Search, WeightSearch, run_seed};
use crate::file::{schema_of, sha256};

/// What a saved run calls itself.
const SCHEMA: &str = "tropism.evolution-run/1";

/// A saved run that cannot be resumed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SavedRunError {
    /// Not JSON, cut short, or not of a saved run's form.
    #[error("not a saved run: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("found schema \"{found}\", wanted \"{SCHEMA}\"")]
    Schema {
        /// What was found.
        found: String,
    },
    /// Some value is not what was written.
    #[error("found a run with the check sum {found}, wanted {wanted}: the file was changed or damaged")]
    Damaged {
        /// First digits of the check sum of what was read.
        found: String,
        /// First digits of the one in the file.
        wanted: String,
    },
    /// Its parts contradict each other.
    #[error("found {history} generations in its history, wanted {generations}")]
    History {
        /// Generations in its history.
        history: usize,
        /// Generations of its population.
        generations: u32,
    },
    /// A run of other settings, or another one of the same evolution.
    #[error("found a run with seed {found}, wanted seed {wanted} and the evolution's settings")]
    OtherRun {
        /// Its seed.
        found: u64,
        /// The seed of the run that was asked for.
        wanted: u64,
    },
}

/// A run as it stands in its file. Its search is either `neat` or `weights`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Run {
    seed: u64,
    episodes: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    neat: Option<Box<Neat>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weights: Option<Box<WeightSearch>>,
    history: Vec<Generation>,
}

impl From<EvolutionRun> for Run {
    fn from(EvolutionRun { seed, episodes, search, history }: EvolutionRun) -> Self {
        let (neat, weights) = match search {
            Search::Neat(neat) => (Some(neat), None),
            Search::Weights(weights) => (None, Some(weights)),
        };
        Self { seed, episodes, neat, weights, history }
    }
}

impl TryFrom<Run> for EvolutionRun {
    type Error = &'static str;

    fn try_from(Run { seed, episodes, neat, weights, history }: Run) -> Result<Self, &'static str> {
        let search = match (neat, weights) {
            (Some(neat), None) => Search::Neat(neat),
            (None, Some(weights)) => Search::Weights(weights),
            (None, None) => return Err("it has neither `neat` nor `weights`"),
            (Some(_), Some(_)) => return Err("it has both `neat` and `weights`"),
        };
        Ok(Self { seed, episodes, search, history })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "schema")]
    _schema: String,
    sha256: String,
    run: EvolutionRun,
}

impl EvolutionRun {
    /// The whole run as JSON, with `"schema": "tropism.evolution-run/1"` and a check sum.
    #[must_use]
    pub fn to_json(&self) -> String {
        let (text, sum) = self.summed();
        format!("{{\"schema\":\"{SCHEMA}\",\"sha256\":\"{sum}\",\"run\":{text}}}\n")
    }

    fn summed(&self) -> (String, String) {
        let text = serde_json::to_string(self).expect("a run has no maps and no unwritable values");
        let sum = sha256(&text);
        (text, sum)
    }

    /// Reads run number `index` of an evolution with `seed`, as [`to_json`](Self::to_json) wrote it.
    ///
    /// # Errors
    /// [`SavedRunError`]: broken JSON, another schema, a value that is not what was written, or another run.
    pub fn from_json(
        json: &str,
        config: &EvolutionConfig,
        seed: u64,
        index: u32,
    ) -> Result<Self, SavedRunError> {
        let schema = schema_of(json)?;
        if schema != SCHEMA {
            return Err(SavedRunError::Schema { found: schema });
        }
        let File { sha256, run, .. } = serde_json::from_str(json)?;
        let (_, sum) = run.summed();
        if sum != sha256 {
            let start = |sum: &str| sum.chars().take(12).collect();
            return Err(SavedRunError::Damaged { found: start(&sum), wanted: start(&sha256) });
        }
        if run.history.len() != run.search.generation() as usize {
            return Err(SavedRunError::History {
                history: run.history.len(),
                generations: run.search.generation(),
            });
        }
        let wanted = run_seed(seed, index);
        let is_search = match (&run.search, config.method) {
            (Search::Neat(neat), Method::Neat) => neat.seed() == wanted && *neat.config() == config.neat,
            (Search::Weights(search), Method::CmaEs) => search.is_of(config.neat.population, wanted),
            _ => false,
        };
        if (run.seed, run.episodes) != (wanted, config.episodes) || !is_search {
            return Err(SavedRunError::OtherRun { found: run.seed, wanted });
        }
        Ok(run)
    }
}
