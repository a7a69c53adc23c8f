//! A run of NEAT by ask and tell: [`Neat::ask`] gives the population, [`Neat::tell`] takes its scores.
//!
//! [`Neat::tell`] is one generation. Its steps are MultiNEAT's, in MultiNEAT's order.

use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::error::NeatError;
use crate::generation::{Generation, mean_size};
use crate::genome::Genome;
use crate::genome_file::check_shape;
use crate::innovation::Innovations;
use crate::limits::SCORE_LIMIT;
use crate::mutate::mutate;
use crate::random::{Purpose, Rng};
use crate::reproduce::Parents;
use crate::species::{self, Speciation, Species};
use crate::statistics::{index_of_greatest, mean, median};

/// The complete state of a run of NEAT.
///
/// A run that is saved by [`to_json`](Self::to_json) and restored by [`from_json`](Self::from_json) continues bit for bit.
///
/// ```
/// use tropism_neat::{Config, Neat, Network};
///
/// let mut neat = Neat::new(Config::multineat(), 2, 1, 42)?;
/// for _ in 0..10 {
///     let scores: Vec<f64> = neat
///         .ask()
///         .iter()
///         .map(|genome| Network::new(genome).activate(&[1.0, -1.0])[0])
///         .collect();
///     neat.tell(&scores)?;
/// }
/// assert!(neat.champion().unwrap().fitness > 0.9);
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
    /// Ids of the individuals. Copies that fill up a generation share the id of their original.
    pub(crate) ids: Vec<u64>,
    pub(crate) next_id: u64,
    pub(crate) species: Vec<Species>,
    pub(crate) next_species: u32,
    pub(crate) innovations: Innovations,
    pub(crate) threshold: f64,
    /// Best fitness so far as selection saw it, at least 0.
    #[serde(rename = "record")]
    pub(crate) best_fitness: f64,
    pub(crate) champion: Option<Champion>,
    /// Genomes of the previous generation, whose allocations the next one reuses.
    #[serde(skip)]
    pub(crate) spare_genomes: Vec<Genome>,
}

/// The best individual of a run so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Champion {
    /// Its genome.
    pub genome: Genome,
    /// Its score.
    pub fitness: f64,
    /// Number of the generation in which it had this score.
    pub generation: u32,
}

impl Neat {
    /// Starts a run: `config.population` minimal genomes with random weights, assigned to species.
    ///
    /// `inputs` excludes the bias, which every network has.
    ///
    /// # Errors
    ///
    /// [`NeatError::Config`] if a parameter is out of range, [`NeatError::Genome`] if there are no inputs, no outputs or too
    /// many.
    pub fn new(config: Config, inputs: usize, outputs: usize, seed: u64) -> Result<Self, NeatError> {
        config.check()?;
        check_shape(inputs, outputs)?;
        let random = |index| Genome::random(&config, inputs, outputs, seed, index);
        let population = (0..config.population as u64).map(random).collect();
        let innovations = Innovations::new(&Genome::minimal(&config, inputs, outputs));
        Ok(Self::with_population(config, population, innovations, seed))
    }

    /// Starts a run from `start`: the first population is this genome and mutants of it, each mutated once.
    ///
    /// ```
    /// use tropism_neat::{Config, Genome, Neat};
    /// let config = Config::wahby2016();
    /// let start = Genome::linear(&config, 2, &[1.0, 0.0, 0.5])?;
    /// let neat = Neat::from_genome(config, &start, 42)?;
    /// assert_eq!((neat.ask().len(), &neat.ask()[0]), (50, &start));
    /// # Ok::<(), tropism_neat::NeatError>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`NeatError::Config`] if a parameter is out of range, [`NeatError::Genome`] if a gene is wrong.
    pub fn from_genome(config: Config, start: &Genome, seed: u64) -> Result<Self, NeatError> {
        config.check()?;
        start.check()?;
        let mut innovations = Innovations::new(start);
        let mut member = |index| {
            let mut genome = start.clone();
            if index > 0 {
                let mut rng = Rng::new(seed, Purpose::Mutants, index);
                mutate(&mut genome, &config, &mut innovations, &mut rng);
            }
            genome
        };
        let population = (0..config.population as u64).map(&mut member).collect();
        Ok(Self::with_population(config, population, innovations, seed))
    }

    /// A run before its first generation, with its first population assigned to species.
    fn with_population(config: Config, population: Vec<Genome>, innovations: Innovations, seed: u64) -> Self {
        let members = population.len() as u64;
        let mut neat = Self {
            inputs: population[0].inputs,
            outputs: population[0].outputs,
            seed,
            generation: 0,
            evaluations: 0,
            population,
            ids: (0..members).collect(),
            next_id: members,
            species: Vec::new(),
            next_species: 1,
            innovations,
            threshold: config.compat_threshold,
            best_fitness: 0.0,
            champion: None,
            spare_genomes: Vec::new(),
            config,
        };
        let mut speciation =
            Speciation::new(&mut neat.species, &neat.config, neat.threshold, &mut neat.next_species);
        for (index, genome) in (0..).zip(&neat.population) {
            speciation.assign(genome, index);
        }
        neat
    }

    /// The population to evaluate. [`tell`](Self::tell) takes the scores in the same order.
    #[must_use]
    pub fn ask(&self) -> &[Genome] {
        &self.population
    }

    /// Takes the score of each individual and breeds the next generation. Larger scores are better.
    ///
    /// # Errors
    ///
    /// [`NeatError::ScoreCount`] if there is not one score for each individual, [`NeatError::Score`] if a score is not
    /// finite or exceeds [`SCORE_LIMIT`]. The run is then unchanged.
    pub fn tell(&mut self, scores: &[f64]) -> Result<Generation, NeatError> {
        self.check_scores(scores)?;
        let fitness = self.fitness(scores);
        let report = self.report(scores);

        species::sort_by_fitness(&mut self.species, &fitness);
        species::update_ages(&mut self.species, self.best_fitness);
        let offspring = species::allocate_offspring(&mut self.species, &fitness, &self.config);
        self.best_fitness = fitness.iter().copied().fold(self.best_fitness, f64::max);
        if self.generation.is_multiple_of(self.config.compat_threshold_interval) {
            self.threshold = species::next_threshold(self.threshold, self.species.len(), &self.config);
        }
        self.reproduce(&offspring, &fitness);
        self.remove_empty_species();
        self.fill_population();
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

    /// Fitness as selection sees it: scores with complexity penalty and fitness floor.
    fn fitness(&self, scores: &[f64]) -> Vec<f64> {
        let floor = self.config.fitness_floor.unwrap_or(f64::NEG_INFINITY);
        let penalty = self.config.complexity_penalty;
        let individuals = scores.iter().zip(&self.population);
        individuals.map(|(score, genome)| (score - penalty * genome.links.len() as f64).max(floor)).collect()
    }

    /// Computes the statistics of the generation; updates the number of evaluations and the champion.
    fn report(&mut self, scores: &[f64]) -> Generation {
        self.evaluations += scores.len() as u64;
        let index = index_of_greatest(scores);
        let best = scores[index];
        if self.champion.as_ref().is_none_or(|champion| best > champion.fitness) {
            let genome = self.population[index].clone();
            self.champion = Some(Champion { genome, fitness: best, generation: self.generation });
        }
        let (links_mean, hidden_mean) = mean_size(&self.population);
        Generation {
            generation: self.generation,
            best,
            mean: mean(scores.iter().copied()),
            median: median(scores),
            best_ever: self.champion.as_ref().map_or(best, |champion| champion.fitness),
            species: self.species.len(),
            population: self.population.len(),
            links_mean,
            hidden_mean,
            champion_links: self.population[index].links.len(),
            threshold: self.threshold,
            evaluations: self.evaluations,
        }
    }

    /// Replaces the population by its children, each of which is assigned to a species at once.
    fn reproduce(&mut self, offspring: &[usize], fitness: &[f64]) {
        let members: Vec<_> = self.species.iter_mut().map(|s| std::mem::take(&mut s.members)).collect();
        let parents = Parents {
            config: &self.config,
            genomes: &self.population,
            ids: &self.ids,
            fitness,
            species: &members,
        };
        let mut speciation =
            Speciation::new(&mut self.species, &self.config, self.threshold, &mut self.next_species);
        let mut born = 0;
        for (species, &offspring) in offspring.iter().enumerate() {
            let elite = parents.elite(species, offspring);
            for number in 0..offspring {
                if born == self.spare_genomes.len() {
                    self.spare_genomes.push(Genome::minimal(&self.config, self.inputs, self.outputs));
                }
                let child = &mut self.spare_genomes[born];
                match elite.get(number) {
                    Some(&index) => child.clone_from(&self.population[index as usize]),
                    None => {
                        let stream = u64::from(self.generation) << 32 | born as u64;
                        let mut rng = Rng::new(self.seed, Purpose::Offspring, stream);
                        parents.breed(species, &mut self.innovations, &mut rng, child);
                    }
                }
                speciation.assign(child, born as u32);
                born += 1;
            }
        }
        self.spare_genomes.truncate(born);
        std::mem::swap(&mut self.population, &mut self.spare_genomes);
        self.ids.clear();
        self.ids.extend(self.next_id..self.next_id + born as u64);
        self.next_id += born as u64;
    }

    /// Removes species without members. In the others the first member becomes the representative: mostly the copied
    /// champion.
    fn remove_empty_species(&mut self) {
        self.species.retain(|s| !s.members.is_empty());
        for s in &mut self.species {
            s.representative.clone_from(&self.population[s.members[0] as usize]);
        }
    }

    /// Fills the population up to its configured size with copies of the first member of the first species.
    fn fill_population(&mut self) {
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

    /// Number of the present generation; the initial population is 0.
    #[must_use]
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// Number of scores taken so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// The species of the present population.
    #[must_use]
    pub fn species(&self) -> &[Species] {
        &self.species
    }

    /// The best individual so far; `None` before the first [`tell`](Self::tell).
    #[must_use]
    pub fn champion(&self) -> Option<&Champion> {
        self.champion.as_ref()
    }
}
