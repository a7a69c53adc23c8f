//! Errors of runs and of checkpoints.

use thiserror::Error;

use crate::config::ConfigError;
use crate::genome_file::GenomeError;
use crate::limits::SCORE_LIMIT;

/// Schema of checkpoints.
pub(crate) const CHECKPOINT_SCHEMA: &str = "tropism.neat/1";

/// A checkpoint that cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Invalid or truncated JSON, or JSON of another structure.
    #[error("not a saved run: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("found schema \"{found}\", wanted \"{CHECKPOINT_SCHEMA}\"")]
    Schema {
        /// Schema found.
        found: String,
    },
    /// A parameter is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The numbers of inputs and outputs, or a genome, cannot be used.
    #[error(transparent)]
    Genome(#[from] GenomeError),
    /// Parts of the checkpoint contradict each other.
    #[error("the saved run contradicts itself: {0}")]
    Contradiction(String),
}

/// An error of a run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NeatError {
    /// A checkpoint cannot be used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A parameter is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The numbers of inputs and outputs cannot be used.
    #[error(transparent)]
    Genome(#[from] GenomeError),
    /// The number of scores differs from the number of individuals.
    #[error("found {found} scores, wanted {wanted}, one for each individual")]
    ScoreCount {
        /// Number of scores.
        found: usize,
        /// Number of individuals.
        wanted: usize,
    },
    /// A score is not finite or too large.
    #[error("found score {index} = {score}, wanted a magnitude of at most {SCORE_LIMIT:e}")]
    Score {
        /// Index of the individual in the population.
        index: usize,
        /// Its score.
        score: f64,
    },
}
