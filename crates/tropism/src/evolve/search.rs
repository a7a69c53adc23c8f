//! What a run of an evolution searches with: NEAT, or CMA-ES on the weights of one topology.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use tropism_neat::{Generation, Genome, Neat};

use super::weight_search::WeightSearch;

/// How networks are searched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// NEAT: topology and weights. Paper (section 2.3.2).
    #[default]
    Neat,
    /// CMA-ES on the weights of the network that evolution starts from: by default all inputs and the bias linked to all outputs.
    CmaEs,
}

impl Method {
    /// Whether it is the paper's.
    #[must_use]
    pub fn is_neat(&self) -> bool {
        *self == Self::Neat
    }
}

/// The state of the search of one run.
#[derive(Clone, Debug)]
pub enum Search {
    /// NEAT.
    Neat(Box<Neat>),
    /// CMA-ES on weights.
    Weights(Box<WeightSearch>),
}

impl Search {
    /// The networks to evaluate.
    #[must_use]
    pub fn ask(&self) -> Cow<'_, [Genome]> {
        match self {
            Self::Neat(neat) => neat.ask().into(),
            Self::Weights(search) => search.ask().into(),
        }
    }

    /// Takes as many finite scores, in order, and goes on to the next generation.
    pub(super) fn tell(&mut self, scores: &[f64]) -> Generation {
        match self {
            Self::Neat(neat) => neat.tell(scores).expect("as many finite scores as genomes"),
            Self::Weights(search) => search.tell(scores),
        }
    }

    /// Number of the present generation.
    #[must_use]
    pub fn generation(&self) -> u32 {
        match self {
            Self::Neat(neat) => neat.generation(),
            Self::Weights(search) => search.generation(),
        }
    }

    /// Number of evaluated networks.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        match self {
            Self::Neat(neat) => neat.evaluations(),
            Self::Weights(search) => search.evaluations(),
        }
    }

    /// The best network so far and its score; `None` before the first generation.
    #[must_use]
    pub fn best(&self) -> Option<(&Genome, f64)> {
        match self {
            Self::Neat(neat) => neat.champion().map(|champion| (&champion.genome, champion.fitness)),
            Self::Weights(search) => search.best(),
        }
    }
}
