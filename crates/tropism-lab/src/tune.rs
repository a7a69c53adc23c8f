//! A rule for a task, tuned on a model or on virtual beans themselves.

use std::ops::ControlFlow;
use std::path::PathBuf;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tropism::control::{PredictiveGreedy, PredictiveRule};
use tropism::environment;
use tropism::evolve::{RuleGeneration, RuleSearch, RuleSearchResult, RuleTrial, Trial, TunedRule};
use tropism::greenhouse::bean;
use tropism::greenhouse::tent::Greenhouse;
use tropism::random::{self, Purpose};
use tropism::task::{Task, TaskSpec};
use tropism::track::PAPER_PERIOD_MIN;

use crate::stopwatch::Stopwatch;
use crate::{Error, Monitor, Workflow, files, model};

/// Plants that grow side by side in a thread: some milliseconds of work.
const PLANTS_AT_ONCE: usize = 64;

/// Tunes the nine numbers of a rule on simulated plants of a model, and writes the rule to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TunePlan {
    /// File of the model.
    pub model: PathBuf,
    /// Virtual beans to tune on instead of a model: species, variation and lamps count. What is found is the best that such a
    /// rule can be expected to reach on them, which no laboratory could know.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beans: Option<Greenhouse>,
    /// Time from one step of virtual beans to the next, in min. A model has its own.
    pub period_min: f64,
    /// Task of the rule.
    pub task: TaskSpec,
    /// Generations, rules a generation, and plants a rule.
    pub search: RuleSearch,
    /// Seed of all random numbers.
    pub seed: u64,
    /// File for the rule.
    pub out: PathBuf,
}

impl Default for TunePlan {
    fn default() -> Self {
        Self {
            model: "model.json".into(),
            beans: None,
            period_min: PAPER_PERIOD_MIN,
            task: TaskSpec::default(),
            search: RuleSearch::default(),
            seed: 1,
            out: "rule.json".into(),
        }
    }
}

/// A tuned rule, and what to expect of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TuneResults {
    /// File of the rule.
    pub out: PathBuf,
    /// Whether the plants were virtual.
    pub is_virtual: bool,
    /// The numbers.
    pub rule: PredictiveRule,
    /// Its fitness on simulated plants that had no part in the search.
    pub expected: Trial,
    /// Fitness of the greedy rule on the same plants.
    pub chase: Trial,
    /// Processor time, in s.
    pub cpu_seconds: f64,
}

impl Workflow for TunePlan {
    type Results = TuneResults;

    const SCHEMA: &'static str = "tropism.tune/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        if let Some(beans) = &self.beans {
            beans.check().map_err(Error::in_plan("beans"))?;
        }
        self.search.check().map_err(Error::in_plan("search"))?;
        let inputs = if self.beans.is_some() { &[][..] } else { std::slice::from_ref(&self.model) };
        files::check_outputs(std::slice::from_ref(&self.out), inputs)
    }

    fn execute(&self, monitor: &dyn Monitor) -> Result<TuneResults, Error> {
        self.check()?;
        let stopwatch = Stopwatch::start();
        monitor.stage("tune", self.search.generations.into());
        let mut watch = |generation: &RuleGeneration| {
            monitor.advance(1);
            monitor.status(&format!("best {:.2} cm", generation.best));
            monitor.answer()
        };
        let (found, tuned) = match &self.beans {
            None => {
                let model = model::read_for(&self.model, &self.task, monitor)?;
                let found = self.search.tune(&model, &self.task, self.seed, &mut watch);
                let found = found.ok_or_else(Error::cancelled)?;
                let json = model.to_json();
                (found, TunedRule::of_model(found.rule, &model, &json, model.is_virtual(), found.expected))
            }
            Some(greenhouse) => {
                let found =
                    self.tune_on_beans(greenhouse, &mut watch, monitor).ok_or_else(Error::cancelled)?;
                let tuned = TunedRule {
                    rule: found.rule,
                    layout: greenhouse.layout.clone(),
                    period_min: self.period_min,
                    task: None,
                    model_sha256: None,
                    is_virtual: true,
                    expected: found.expected,
                };
                (found, tuned)
            }
        };
        let tuned = TunedRule { task: Some(self.task.clone()), ..tuned };
        files::write(&self.out, tuned.to_json().as_bytes())?;
        let is_virtual = tuned.is_virtual;
        if is_virtual {
            monitor.note("the rule was tuned on virtual plants, or on a model of such");
        }
        Ok(TuneResults {
            out: self.out.clone(),
            is_virtual,
            rule: found.rule,
            expected: found.expected,
            chase: found.greedy,
            cpu_seconds: stopwatch.cpu_seconds(),
        })
    }
}

impl TunePlan {
    /// Searches on virtual beans, which grow side by side in all threads.
    fn tune_on_beans(
        &self,
        greenhouse: &Greenhouse,
        watch: &mut dyn FnMut(&RuleGeneration) -> ControlFlow<()>,
        monitor: &dyn Monitor,
    ) -> Option<RuleSearchResult> {
        let Greenhouse { bean: species, scale, layout, .. } = greenhouse;
        let trial =
            bean::Trial { species, scale: *scale, layout: layout.clone(), period_min: self.period_min };
        let seed = |trial: &RuleTrial| {
            let plant = u64::from(trial.set) << 32 | u64::from(trial.plant);
            random::derive(self.seed, Purpose::Tuning, plant) >> 1
        };
        let grow = |trials: &[RuleTrial]| {
            // What is left out here counts for nothing: the search hears of the end, too.
            if !monitor.may_go_on() {
                return vec![0.0; trials.len()];
            }
            let seeds: Vec<u64> = trials.iter().map(seed).collect();
            let controller = |place: usize| PredictiveGreedy::new(trials[place].rule, &self.task, layout);
            let tracks = trial
                .grow_all(&seeds, controller, &self.task, &mut |_, sample| environment::unwatched(sample));
            tracks.iter().map(|track| self.task.fitness(track)).collect::<Vec<f64>>()
        };
        let scores = |trials: &[RuleTrial]| trials.par_chunks(PLANTS_AT_ONCE).flat_map_iter(grow).collect();
        self.search.tune_by(scores, self.seed, watch).filter(|_| monitor.may_go_on())
    }
}
