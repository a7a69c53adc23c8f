//! A rule for a task, tuned on a model.

use std::ops::ControlFlow;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::control::PredictiveRule;
use tropism::evolve::{RuleSearch, Trial, TunedRule};
use tropism::task::TaskSpec;

use crate::stopwatch::Stopwatch;
use crate::{Error, Monitor, Workflow, files, model};

/// Tunes the nine numbers of a rule on simulated plants of a model, and writes the rule to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TunePlan {
    /// File of the model.
    pub model: PathBuf,
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
    /// Whether the model was made of virtual plants.
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
        self.search.check().map_err(Error::in_plan("search"))
    }

    fn execute(&self, monitor: &dyn Monitor) -> Result<TuneResults, Error> {
        self.check()?;
        let stopwatch = Stopwatch::start();
        let model = model::read_for(&self.model, &self.task, monitor)?;
        monitor.stage("tune", self.search.generations.into());
        let found = self.search.tune(&model, &self.task, self.seed, &mut |generation| {
            monitor.advance(1);
            monitor.status(&format!("best {:.2} cm", generation.best));
            if monitor.may_go_on() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        let found = found.ok_or_else(Error::cancelled)?;
        let is_virtual = model.is_virtual();
        let tuned = TunedRule {
            task: Some(self.task.clone()),
            ..TunedRule::of_model(found.rule, &model, &model.to_json(), is_virtual, found.expected)
        };
        files::write(&self.out, tuned.to_json().as_bytes())?;
        if is_virtual {
            monitor.note("the model was made from virtual plants");
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
