//! Evolution of controllers on a model (section 2.3.2), the paper's random baseline (section 3.1), and the choice of the
//! champion that goes on to a real plant.
//!
//! A model, a task and sensors go in; champions come out. [`Evolution`] takes any [`BatchModel`], any [`Task`] and any
//! [`Sensors`](crate::control::Sensors). Runs share nothing, and the growth noise of every evaluation is named by run,
//! generation, individual and episode: neither threads nor interruptions change a result.
//!
//! [`Method::CmaEs`] searches the weights of one network instead; all its networks of some generations steer the same plants.
//! [`Start::Greedy`] begins at a network that decides as the greedy rule does, [`Start::Network`] at a given one. [`RuleSearch`] tunes the nine parameters of a
//! [rule](crate::control::PredictiveRule) by [`CmaEs`](crate::CmaEs), too.
//!
//! # References
//! Wahby et al. 2016, sections 2.3.2 and 3.1, Table 1. Stanley and Miikkulainen 2002, doi:10.1162/106365602320169811.

mod baseline;
mod champion;
mod weight_search;
mod search;
mod start;
mod config;
mod saved;
mod rule_search;
mod tuned_rule;

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use tropism_neat::{Generation, Genome, Neat, NeatError, random_genome};

use crate::control::outputs;
use crate::math::statistics;
use crate::parallel;
use crate::random::{self, NoiseStream, Purpose};
use crate::simulation::{BatchModel, Episode};
use crate::task::Task;

pub use baseline::{Baseline, random_scores};
pub use champion::{Champion, ChampionError, Choice, Trial, reason_to_withhold, trial, trial_of_genome};
pub use config::{EvolutionConfig, EvolutionError};
pub use rule_search::{RuleGeneration, RuleSearch, RuleSearchResult, RuleTrial};
pub use saved::SavedRunError;
pub use search::{Method, Search};
pub use start::{Start, StartError};
pub use tuned_rule::{TunedRule, TunedRuleError};
pub use weight_search::WeightSearch;

/// Evolution of controllers for one task on one model.
///
/// ```
/// use tropism::prelude::*;
/// # let measured = "tip_x_cm,tip_y_cm,light\n0,4,left\n-0.1,4.03,right\n0,4.06,right\n0.1,4.1,dark\n";
/// # let model = TipModel::fit([&Track::read_csv(measured.as_bytes())?], TipModelConfig::default())?;
/// let task = Task { max_steps: 20, ..Task::default() };
/// let config = EvolutionConfig { runs: 2, generations: 3, ..EvolutionConfig::default() };
/// let evolution = Evolution::new(&model, &task, config, 1)?;
/// let runs = evolution.evolve(&|_run, _generation| std::ops::ControlFlow::Continue(()))?;
/// let choice = evolution.choose(&runs.expect("no interruption"), std::slice::from_ref(&model), 10);
/// assert!(choice.run < 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Evolution<'p, M> {
    model: &'p M,
    task: &'p Task,
    config: EvolutionConfig,
    /// The genome from which evolution starts; `None` for random ones.
    start: Option<Genome>,
    seed: u64,
}

/// One evolutionary run: its population and its history, all that is needed to resume it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "saved::Run", into = "saved::Run")]
pub struct EvolutionRun {
    /// Seed of this run.
    pub seed: u64,
    /// Episodes of each evaluation.
    pub episodes: u32,
    /// The state of the search.
    pub search: Search,
    /// Statistics of each generation so far.
    pub history: Vec<Generation>,
}

impl EvolutionRun {
    /// The best genome so far and its fitness; `None` before the first generation.
    #[must_use]
    pub fn champion(&self) -> Option<(&Genome, f64)> {
        self.search.best()
    }
}

impl<'p, M: BatchModel> Evolution<'p, M> {
    /// Evolution for `task` on `model`, with all that `config` says, under `seed`.
    ///
    /// # Errors
    /// [`EvolutionError`] names the key of `config`, its value and its range, or says why evolution cannot start where `config`
    /// says.
    pub fn new(
        model: &'p M,
        task: &'p Task,
        config: EvolutionConfig,
        seed: u64,
    ) -> Result<Self, EvolutionError> {
        config.check()?;
        config.dimming.check(model)?;
        let start = match &config.start {
            Start::Random => None,
            Start::Greedy => Some(start::greedy_genome(&config.sensors, &config.neat, task, model.layout())?),
            Start::Network(network) => {
                start::check_outputs(network, model.layout())?;
                Some((**network).clone())
            }
        };
        Ok(Self { model, task, config, start, seed })
    }

    /// Its settings.
    #[must_use]
    pub const fn config(&self) -> &EvolutionConfig {
        &self.config
    }

    /// The genome from which evolution starts; `None` for random ones.
    #[must_use]
    pub const fn start(&self) -> Option<&Genome> {
        self.start.as_ref()
    }

    /// Run number `index` (from 0) at its beginning.
    ///
    /// # Errors
    /// [`NeatError`] if NEAT's parameters are out of range.
    pub fn begin(&self, index: u32) -> Result<EvolutionRun, NeatError> {
        let (config, seed) = (self.config.neat.clone(), run_seed(self.seed, index));
        let (inputs, outputs) = (self.config.sensors.inputs(), outputs(self.model.layout()));
        let search = match (self.config.method, &self.start) {
            (Method::Neat, None) => Search::Neat(Neat::new(config, inputs, outputs, seed)?.into()),
            (Method::Neat, Some(start)) => Search::Neat(Neat::from_genome(config, start, seed)?.into()),
            (Method::CmaEs, start) => {
                let random = || random_genome(&config, inputs, outputs, seed, 0);
                let start = start.clone().unwrap_or_else(random);
                Search::Weights(WeightSearch::new(start, config.population, seed).into())
            }
        };
        Ok(EvolutionRun { seed, episodes: self.config.episodes, search, history: Vec::new() })
    }

    /// Run number `index` as [`EvolutionRun::to_json`] saved it. It continues to the same bits as one that was never saved.
    ///
    /// # Errors
    /// [`SavedRunError`]: broken JSON, another schema, a value that is not what was written, or another run.
    pub fn resume(&self, index: u32, json: &str) -> Result<EvolutionRun, SavedRunError> {
        EvolutionRun::from_json(json, &self.config, self.seed, index)
    }

    /// Evaluates the present population of `run` and breeds the next one.
    pub fn advance<'r>(&self, run: &'r mut EvolutionRun) -> &'r Generation {
        let generation = run.search.generation();
        let (seed, count) = (run.seed, run.episodes);
        let method = self.config.method;
        let noise = move |individual: usize, episode| {
            let place = match method {
                Method::Neat => [generation, individual as u32, episode],
                // Common plants, as in a rule search.
                Method::CmaEs => [generation / rule_search::GENERATIONS_OF_PLANTS, 0, episode],
            };
            NoiseStream::new(seed, Purpose::Growth, place)
        };
        let genomes = run.search.ask();
        let individuals = genomes.iter().enumerate();
        let episodes = individuals.flat_map(|(individual, genome)| {
            (0..count).map(move |episode| Episode { controller: genome, noise: noise(individual, episode) })
        });
        let fitness = self.model.score(self.task, self.config.interface(), episodes);
        let count = count as usize;
        let scores: Vec<f64> =
            fitness.chunks_exact(count).map(|own| statistics::mean(own.iter().copied())).collect();
        drop(genomes);
        run.history.push(run.search.tell(&scores));
        &run.history[run.history.len() - 1]
    }

    /// Advances `run` to its last generation, unless `watch`, which sees every generation, breaks off.
    pub fn finish(
        &self,
        run: &mut EvolutionRun,
        watch: &mut dyn FnMut(&Generation) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        while (run.history.len() as u32) < self.config.generations {
            watch(self.advance(run))?;
        }
        ControlFlow::Continue(())
    }

    /// All runs from the first to the last generation, on all threads. `watch` sees every generation with the number of its
    /// run; `None` if it broke off.
    ///
    /// # Errors
    /// [`NeatError`] if NEAT's parameters are out of range.
    pub fn evolve(
        &self,
        watch: &(dyn Fn(u32, &Generation) -> ControlFlow<()> + Sync),
    ) -> Result<Option<Vec<EvolutionRun>>, NeatError> {
        let runs = parallel::map(self.config.runs as usize, |index| {
            let index = index as u32;
            let mut run = self.begin(index)?;
            let flow = self.finish(&mut run, &mut |generation| watch(index, generation));
            Ok(flow.is_continue().then_some(run))
        });
        runs.into_iter().collect()
    }

    /// What may become the champion of `run`: its best genome, those at which CMA-ES ended, and the one from which evolution
    /// started if it was not random.
    ///
    /// # Panics
    /// If the run has no generation yet.
    #[must_use]
    pub fn candidates<'r>(&'r self, run: &'r EvolutionRun) -> Vec<&'r Genome> {
        let (best, _) = run.champion().expect("a run of at least one generation has a champion");
        let centres = match &run.search {
            Search::Neat(_) => &[],
            Search::Weights(search) => search.centres(),
        };
        [best].into_iter().chain(centres).chain(&self.start).collect()
    }

    /// The champion of `run`, and its trial: the [candidate](Self::candidates) with the highest mean fitness on `plants` fresh
    /// plants of each of `judges`. So on these plants it is never worse than what evolution started from.
    ///
    /// # Panics
    /// If the run has no generation yet.
    #[must_use]
    pub fn champion_of<'r, 'm>(
        &'r self,
        run: &'r EvolutionRun,
        judges: impl IntoIterator<Item = &'m M> + Clone,
        plants: u32,
    ) -> (&'r Genome, Trial)
    where
        M: 'm,
    {
        let candidates = self.candidates(run);
        let (interface, seed) = (self.config.interface(), self.seed);
        let trial =
            |genome: &&Genome| trial_of_genome(judges.clone(), self.task, interface, genome, seed, plants);
        let choice = Choice::of(candidates.iter().map(trial).collect());
        (candidates[choice.run], choice.trials[choice.run])
    }

    /// Chooses among the [champions](Self::champion_of) of `runs`: the one with the highest mean fitness on `plants` fresh plants
    /// of each of `judges`.
    ///
    /// Best fitness is no measure of that: a single evaluation selects for lucky growth noise. Judges that are
    /// [models of single plants](crate::plant::FittedModel::of_each_plant) estimate the fitness on unseen plants.
    ///
    /// # Panics
    /// Without runs of at least one generation, judges or plants.
    #[must_use]
    pub fn choose(&self, runs: &[EvolutionRun], judges: &[M], plants: u32) -> Choice {
        Choice::of(parallel::map(runs.len(), |run| self.champion_of(&runs[run], judges, plants).1))
    }
}

/// Seed of run number `index` of an evolution with `seed`.
fn run_seed(seed: u64, index: u32) -> u64 {
    random::derive(seed, Purpose::Run, u64::from(index))
}
