//! One run of NEAT: ask for a population, tell how well each member did, and so from generation to generation.
//!
//! [`Neat::tell`] is one generation, in the order in which MultiNEAT does it.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::checkpoint::CheckpointError;
use crate::genome_file::check_shape;
use crate::innovation::Innovations;
use crate::random::{Dice, Purpose};
use crate::reproduce::Parents;
use crate::species::{self, Settlement, Species};
use crate::stats::{self, Generation};
use crate::{Config, ConfigError, Genome, GenomeError};

/// Largest size of a score, so that sums over a population stay finite.
pub const SCORE_LIMIT: f64 = 1e150;

/// A run of NEAT, complete: saved and read again, it goes on to the same bits.
///
/// ```
/// use tropism_neat::{Config, Neat, Network};
///
/// let mut neat = Neat::new(Config::paper(), 2, 1, 42)?;
/// for _ in 0..10 {
///     let scores: Vec<f64> = neat
///         .ask()
///         .iter()
///         .map(|genome| Network::new(genome).activate(&[1.0, -1.0])[0])
///         .collect();
///     neat.tell(&scores)?;
/// }
/// assert_eq!(neat.champion().unwrap().fitness, 1.0);
/// # Ok::<(), tropism_neat::NeatError>(())
/// ```
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(remote = "Self", deny_unknown_fields)]
pub struct Neat {
    pub(crate) config: Config,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    pub(crate) seed: u64,
    pub(crate) generation: u32,
    pub(crate) evaluations: u64,
    pub(crate) population: Vec<Genome>,
    /// Who is who: copies that fill up a generation share a number.
    pub(crate) ids: Vec<u64>,
    pub(crate) next_id: u64,
    pub(crate) species: Vec<Species>,
    pub(crate) next_species: u32,
    pub(crate) innovations: Innovations,
    pub(crate) threshold: f64,
    /// Best fitness so far as selection saw it, at least 0.
    pub(crate) record: f64,
    pub(crate) champion: Option<Champion>,
    /// Genomes of the generation before, which the next one is written over.
    #[serde(skip)]
    pub(crate) nursery: Vec<Genome>,
}

/// The best individual of a run so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Champion {
    /// Its genes.
    pub genome: Genome,
    /// The score that it was told.
    pub fitness: f64,
    /// The generation that it was first seen in.
    pub generation: u32,
}

impl Neat {
    /// A run at its start: `config.population` copies of the smallest genome with random weights, sorted into species.
    ///
    /// `inputs` does not count the bias, which every network has.
    ///
    /// # Errors
    ///
    /// A parameter out of its range, or no inputs or outputs.
    pub fn new(config: Config, inputs: usize, outputs: usize, seed: u64) -> Result<Self, NeatError> {
        config.check()?;
        check_shape(inputs, outputs)?;
        let members = config.population as u64;
        let mut neat = Self {
            inputs,
            outputs,
            seed,
            generation: 0,
            evaluations: 0,
            population: (0..members)
                .map(|index| Genome::random(&config, inputs, outputs, seed, index))
                .collect(),
            ids: (0..members).collect(),
            next_id: members,
            species: Vec::new(),
            next_species: 1,
            innovations: Innovations::new(&Genome::seed(&config, inputs, outputs)),
            threshold: config.compat_threshold,
            record: 0.0,
            champion: None,
            nursery: Vec::new(),
            config,
        };
        let mut settlement =
            Settlement::new(&mut neat.species, &neat.config, neat.threshold, &mut neat.next_species);
        for (index, genome) in (0..).zip(&neat.population) {
            settlement.settle(genome, index);
        }
        Ok(neat)
    }

    /// The population to evaluate, in the order in which [`tell`](Self::tell) wants the scores.
    #[must_use]
    pub fn ask(&self) -> &[Genome] {
        &self.population
    }

    /// Takes the score of every member of the population, larger being better, and breeds the next generation.
    ///
    /// # Errors
    ///
    /// Too few or too many scores, or one that is not finite; the run is then as it was.
    pub fn tell(&mut self, scores: &[f64]) -> Result<Generation, NeatError> {
        self.check_scores(scores)?;
        let fitness = self.fitness(scores);
        let report = self.report(scores);

        species::rank(&mut self.species, &fitness);
        species::grow_older(&mut self.species, self.record);
        let offspring = species::allot(&mut self.species, &fitness, &self.config);
        self.record = fitness.iter().copied().fold(self.record, f64::max);
        if self.generation.is_multiple_of(self.config.compat_threshold_interval) {
            self.threshold = species::next_threshold(self.threshold, self.species.len(), &self.config);
        }
        self.reproduce(&offspring, &fitness);
        self.bury_the_extinct();
        self.fill_up();
        self.generation += 1;
        Ok(report)
    }

    fn check_scores(&self, scores: &[f64]) -> Result<(), NeatError> {
        if scores.len() != self.population.len() {
            return Err(NeatError::ScoreCount { found: scores.len(), wanted: self.population.len() });
        }
        match scores.iter().position(|score| !(-SCORE_LIMIT..=SCORE_LIMIT).contains(score)) {
            Some(index) => Err(NeatError::Score { index, score: scores[index] }),
            None => Ok(()),
        }
    }

    /// What selection sees of the scores.
    fn fitness(&self, scores: &[f64]) -> Vec<f64> {
        let floor = self.config.fitness_floor.unwrap_or(f64::NEG_INFINITY);
        let penalty = self.config.complexity_penalty;
        let individuals = scores.iter().zip(&self.population);
        individuals.map(|(score, genome)| (score - penalty * genome.links.len() as f64).max(floor)).collect()
    }

    /// Counts the evaluations, crowns a new champion if there is one, and describes the generation.
    fn report(&mut self, scores: &[f64]) -> Generation {
        self.evaluations += scores.len() as u64;
        let place = stats::place_of_best(scores);
        let best = scores[place];
        if self.champion.as_ref().is_none_or(|champion| best > champion.fitness) {
            let genome = self.population[place].clone();
            self.champion = Some(Champion { genome, fitness: best, generation: self.generation });
        }
        let (links_mean, hidden_mean) = stats::mean_size(&self.population);
        Generation {
            generation: self.generation,
            best,
            mean: stats::mean(scores.iter().copied()),
            median: stats::median(scores),
            best_ever: self.champion.as_ref().map_or(best, |champion| champion.fitness),
            species: self.species.len(),
            population: self.population.len(),
            links_mean,
            hidden_mean,
            champion_links: self.population[place].links.len(),
            threshold: self.threshold,
            evaluations: self.evaluations,
        }
    }

    /// Replaces the population by its children, each of which joins a species at once.
    fn reproduce(&mut self, offspring: &[usize], fitness: &[f64]) {
        let members: Vec<_> = self.species.iter_mut().map(|s| std::mem::take(&mut s.members)).collect();
        let parents = Parents {
            config: &self.config,
            genomes: &self.population,
            ids: &self.ids,
            fitness,
            species: &members,
        };
        let mut settlement =
            Settlement::new(&mut self.species, &self.config, self.threshold, &mut self.next_species);
        let mut born = 0;
        for (home, &offspring) in offspring.iter().enumerate() {
            let elite = parents.elite(home, offspring);
            for number in 0..offspring {
                if born == self.nursery.len() {
                    self.nursery.push(Genome::seed(&self.config, self.inputs, self.outputs));
                }
                let child = &mut self.nursery[born];
                match elite.get(number) {
                    Some(&place) => child.clone_from(&self.population[place as usize]),
                    None => {
                        let index = u64::from(self.generation) << 32 | born as u64;
                        let mut dice = Dice::new(self.seed, Purpose::Birth, index);
                        parents.breed(home, &mut self.innovations, &mut dice, child);
                    }
                }
                settlement.settle(child, born as u32);
                born += 1;
            }
        }
        self.nursery.truncate(born);
        std::mem::swap(&mut self.population, &mut self.nursery);
        self.ids.clear();
        self.ids.extend(self.next_id..self.next_id + born as u64);
        self.next_id += born as u64;
    }

    /// Drops species without members; in the others the first member, mostly the copied champion, becomes representative.
    fn bury_the_extinct(&mut self) {
        self.species.retain(|s| !s.members.is_empty());
        for s in &mut self.species {
            s.representative.clone_from(&self.population[s.members[0] as usize]);
        }
    }

    /// Makes up for what rounding took from the population, by copies of the first member of the first species.
    fn fill_up(&mut self) {
        let Some(first) = self.species.first_mut() else { return };
        let copied = first.members[0] as usize;
        while self.population.len() < self.config.population {
            first.members.push(self.population.len() as u32);
            self.population.push(self.population[copied].clone());
            self.ids.push(self.ids[copied]);
        }
    }

    /// The parameters of this run.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The seed of this run.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Number of the generation that [`ask`](Self::ask) gives; the initial population is 0.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// Number of scores told so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// The species of the population that [`ask`](Self::ask) gives.
    #[must_use]
    pub fn species(&self) -> &[Species] {
        &self.species
    }

    /// The best individual told so far; `None` before the first [`tell`](Self::tell).
    #[must_use]
    pub fn champion(&self) -> Option<&Champion> {
        self.champion.as_ref()
    }
}

/// What can go wrong in a run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NeatError {
    /// A saved run cannot be used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A parameter cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The shape of the networks cannot be used.
    #[error(transparent)]
    Genome(#[from] GenomeError),
    /// Not one score for each individual.
    #[error("{found} scores: wanted {wanted}, one for each individual")]
    ScoreCount {
        /// Scores found.
        found: usize,
        /// Individuals.
        wanted: usize,
    },
    /// A score is NaN, infinite or absurdly large.
    #[error("score {index} is {score}: wanted a number of size at most {SCORE_LIMIT:e}")]
    Score {
        /// Place of the individual in the population.
        index: usize,
        /// Its score.
        score: f64,
    },
}
