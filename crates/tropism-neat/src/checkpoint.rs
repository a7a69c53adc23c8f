//! A run as a file: everything that it needs to go on to the same bits, checked when it is read.

use std::collections::BTreeSet;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use thiserror::Error;

use crate::genome::NUMBER_LIMIT;
use crate::genome_file::check_shape;
use crate::neat::{Neat, SCORE_LIMIT};
use crate::{ConfigError, Genome, GenomeError};

/// What a saved run calls itself.
const SCHEMA: &str = "tropism.neat/1";

/// A saved run that cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Not JSON, cut short, or not of a saved run's form.
    #[error("not a saved run: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("schema is \"{found}\": wanted \"{SCHEMA}\"")]
    Schema {
        /// What was found.
        found: String,
    },
    /// Its parameters cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Its shape or one of its genomes cannot be used.
    #[error(transparent)]
    Genome(#[from] GenomeError),
    /// Its parts contradict each other.
    #[error("the saved run contradicts itself: {0}")]
    Contradiction(String),
}

impl Serialize for Neat {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

/// Checks what it reads, like [`Neat::from_json`].
impl<'de> Deserialize<'de> for Neat {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let neat = Self::deserialize(deserializer)?;
        neat.check().map_err(D::Error::custom)?;
        Ok(neat)
    }
}

impl Neat {
    /// The whole run as JSON, with `"schema": "tropism.neat/1"`.
    ///
    /// ```
    /// use tropism_neat::{Config, Neat};
    /// let mut neat = Neat::new(Config::paper(), 2, 1, 42).unwrap();
    /// let mut again = Neat::from_json(&neat.to_json()).unwrap();
    /// let scores: Vec<f64> = (0..50).map(f64::from).collect();
    /// assert_eq!(neat.tell(&scores).unwrap(), again.tell(&scores).unwrap());
    /// assert_eq!(neat.ask(), again.ask());
    /// ```
    #[must_use]
    pub fn to_json(&self) -> String {
        #[derive(Serialize)]
        struct File<'a> {
            schema: &'static str,
            run: &'a Neat,
        }
        let file = File { schema: SCHEMA, run: self };
        serde_json::to_string(&file).expect("a run has no maps and no unwritable values")
    }

    /// Reads a run from JSON and checks all of it.
    ///
    /// # Errors
    ///
    /// Broken JSON, another schema, or the first part that is wrong.
    pub fn from_json(json: &str) -> Result<Self, CheckpointError> {
        #[derive(Deserialize)]
        struct Head {
            schema: String,
        }
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            #[serde(rename = "schema")]
            _schema: String,
            #[serde(with = "Neat")]
            run: Neat,
        }
        // The schema is read first: a file of another one should be called that, not full of unknown fields.
        let head: Head = serde_json::from_str(json)?;
        if head.schema != SCHEMA {
            return Err(CheckpointError::Schema { found: head.schema });
        }
        let neat = serde_json::from_str::<File>(json)?.run;
        neat.check()?;
        Ok(neat)
    }

    /// Whether the run could have come about, as far as going on from it depends on that.
    fn check(&self) -> Result<(), CheckpointError> {
        self.config.check()?;
        check_shape(self.inputs, self.outputs)?;
        let claims = [
            (self.population.len() >= self.config.population, "the population is too small"),
            (self.population.len() < 2 * self.config.population, "the population is too large"),
            (self.ids.len() == self.population.len(), "not one id for each individual"),
            (self.ids.iter().all(|&id| id < self.next_id), "an individual's id is above the last one given"),
            (self.next_id < 1 << 62 && self.evaluations < 1 << 62, "a counter is too large"),
            (self.generation < NUMBER_LIMIT && self.next_species < NUMBER_LIMIT, "a counter is too large"),
            ((0.0..=SCORE_LIMIT).contains(&self.threshold), "the threshold is out of range"),
            ((0.0..=SCORE_LIMIT).contains(&self.record), "the record is out of range"),
            (
                self.members_are_all_in_one_species(),
                "not every individual is a member of exactly one species",
            ),
            (
                self.species.iter().all(|s| (0.0..=SCORE_LIMIT).contains(&s.best)),
                "a species' best is out of range",
            ),
            (
                self.species.iter().all(|s| s.age < NUMBER_LIMIT && s.stagnation < NUMBER_LIMIT),
                "a species is too old",
            ),
            (
                self.species.iter().all(|s| s.id < self.next_species),
                "a species' id is above the last one given",
            ),
            (
                self.champion.as_ref().is_none_or(|c| c.fitness.abs() <= SCORE_LIMIT),
                "the champion's fitness is out of range",
            ),
        ];
        if let Some((_, claim)) = claims.into_iter().find(|(holds, _)| !holds) {
            return Err(CheckpointError::Contradiction(claim.into()));
        }
        self.innovations.check().map_err(CheckpointError::Contradiction)?;
        let champion = self.champion.iter().map(|champion| ("the champion", &champion.genome));
        let representatives = self.species.iter().map(|s| ("a representative", &s.representative));
        let individuals = self.population.iter().map(|genome| ("an individual", genome));
        for (whose, genome) in individuals.chain(representatives).chain(champion) {
            self.check_genome(genome)
                .map_err(|what| CheckpointError::Contradiction(format!("{whose}'s {what}")))?;
        }
        Ok(())
    }

    fn members_are_all_in_one_species(&self) -> bool {
        let members: Vec<u32> = self.species.iter().flat_map(|s| s.members.iter().copied()).collect();
        let distinct: BTreeSet<u32> = members.iter().copied().collect();
        let is_complete = distinct.iter().copied().eq(0..self.population.len() as u32);
        is_complete && distinct.len() == members.len() && self.species.iter().all(|s| !s.members.is_empty())
    }

    fn check_genome(&self, genome: &Genome) -> Result<(), String> {
        if (genome.inputs, genome.outputs) != (self.inputs, self.outputs) {
            return Err("shape is not the run's".into());
        }
        if genome.links.is_empty() || genome.has_dead_ends() {
            return Err("genome has dead ends".into());
        }
        if let Some(link) = genome.links.iter().find(|link| !self.innovations.knows_link(link)) {
            return Err(format!("link {} is not the recorded one", link.innovation));
        }
        if let Some(neuron) = genome.neurons.last().filter(|neuron| !self.innovations.has_numbered(neuron.id))
        {
            return Err(format!("neuron {} was never recorded", neuron.id));
        }
        Ok(())
    }
}
