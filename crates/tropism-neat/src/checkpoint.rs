//! Checkpoints: the whole state of a run as JSON, checked on reading. A restored run continues bit for bit.

use std::collections::BTreeSet;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};

use crate::error::{CHECKPOINT_SCHEMA, CheckpointError};
use crate::genome::Genome;
use crate::genome_file::check_shape;
use crate::limits::{ID_LIMIT, SCORE_LIMIT};
use crate::neat::Neat;

impl Serialize for Neat {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

/// Checks everything that it reads, like [`Neat::from_json`].
impl<'de> Deserialize<'de> for Neat {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let neat = Self::deserialize(deserializer)?;
        neat.check().map_err(D::Error::custom)?;
        Ok(neat)
    }
}

impl Neat {
    /// Writes the whole run as JSON of schema `tropism.neat/1`.
    ///
    /// ```
    /// use tropism_neat::{Config, Neat};
    /// let mut neat = Neat::new(Config::multineat(), 2, 1, 42).unwrap();
    /// let mut restored = Neat::from_json(&neat.to_json()).unwrap();
    /// let scores: Vec<f64> = (0..300).map(f64::from).collect();
    /// assert_eq!(neat.tell(&scores).unwrap(), restored.tell(&scores).unwrap());
    /// assert_eq!(neat.ask(), restored.ask());
    /// ```
    #[must_use]
    pub fn to_json(&self) -> String {
        #[derive(Serialize)]
        struct File<'a> {
            schema: &'static str,
            run: &'a Neat,
        }
        let file = File { schema: CHECKPOINT_SCHEMA, run: self };
        serde_json::to_string(&file).expect("a run has no maps and no unwritable values")
    }

    /// Reads a run from JSON and checks all of it.
    ///
    /// # Errors
    ///
    /// [`CheckpointError`]: invalid JSON, another schema, or the first part that is wrong.
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
        // The schema is read first, so that a file of another schema is reported as such and not for its unknown fields.
        let head: Head = serde_json::from_str(json)?;
        if head.schema != CHECKPOINT_SCHEMA {
            return Err(CheckpointError::Schema { found: head.schema });
        }
        let neat = serde_json::from_str::<File>(json)?.run;
        neat.check()?;
        Ok(neat)
    }

    /// Checks all invariants that the continuation of the run relies on.
    fn check(&self) -> Result<(), CheckpointError> {
        self.config.check()?;
        check_shape(self.inputs, self.outputs)?;
        let conditions = [
            (self.population.len() >= self.config.population, "the population is too small"),
            (self.population.len() < 2 * self.config.population, "the population is too large"),
            (self.ids.len() == self.population.len(), "there is not one id for each individual"),
            (
                self.ids.iter().all(|&id| id < self.next_id),
                "an individual's id is above the last one assigned",
            ),
            (self.next_id < 1 << 62 && self.evaluations < 1 << 62, "a counter is too large"),
            (self.generation < ID_LIMIT && self.next_species < ID_LIMIT, "a counter is too large"),
            ((0.0..=SCORE_LIMIT).contains(&self.threshold), "the threshold is out of range"),
            ((0.0..=SCORE_LIMIT).contains(&self.best_fitness), "the best fitness is out of range"),
            (self.members_are_partitioned(), "not every individual is a member of exactly one species"),
            (
                self.species.iter().all(|s| (0.0..=SCORE_LIMIT).contains(&s.best_fitness)),
                "a species' best fitness is out of range",
            ),
            (
                self.species.iter().all(|s| s.age < ID_LIMIT && s.stagnation < ID_LIMIT),
                "a species is too old",
            ),
            (
                self.species.iter().all(|s| s.id < self.next_species),
                "a species' id is above the last one assigned",
            ),
            (
                self.champion.as_ref().is_none_or(|c| c.fitness.abs() <= SCORE_LIMIT),
                "the champion's fitness is out of range",
            ),
        ];
        if let Some((_, failure)) = conditions.into_iter().find(|(holds, _)| !holds) {
            return Err(CheckpointError::Contradiction(failure.into()));
        }
        self.innovations.check().map_err(CheckpointError::Contradiction)?;
        let champion = self.champion.iter().map(|champion| ("the champion", &champion.genome));
        let representatives = self.species.iter().map(|s| ("a representative", &s.representative));
        let individuals = self.population.iter().map(|genome| ("an individual", genome));
        for (owner, genome) in individuals.chain(representatives).chain(champion) {
            self.check_genome(genome)
                .map_err(|failure| CheckpointError::Contradiction(format!("{owner}'s {failure}")))?;
        }
        Ok(())
    }

    /// Whether every individual is a member of exactly one species, and no species is empty.
    fn members_are_partitioned(&self) -> bool {
        let members: Vec<u32> = self.species.iter().flat_map(|s| s.members.iter().copied()).collect();
        let distinct: BTreeSet<u32> = members.iter().copied().collect();
        let is_complete = distinct.iter().copied().eq(0..self.population.len() as u32);
        is_complete && distinct.len() == members.len() && self.species.iter().all(|s| !s.members.is_empty())
    }

    /// Checks a genome of the run against its shape and its innovations.
    fn check_genome(&self, genome: &Genome) -> Result<(), String> {
        if (genome.inputs, genome.outputs) != (self.inputs, self.outputs) {
            return Err("shape is not the run's".into());
        }
        if genome.links.is_empty() || genome.has_dead_ends() {
            return Err("genome has dead ends".into());
        }
        if let Some(link) = genome.genes().iter().find(|link| !self.innovations.has_link(link)) {
            return Err(format!("link {} does not have the recorded innovation number", link.innovation));
        }
        if let Some(neuron) = genome.neurons.last().filter(|neuron| !self.innovations.has_neuron(neuron.id)) {
            return Err(format!("neuron {} is not recorded", neuron.id));
        }
        Ok(())
    }
}
