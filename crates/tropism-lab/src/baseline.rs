//! Baseline: the fitness of random controllers (section 3.1).

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::control::Sensors;
use tropism::evolve::{self, Champion};
use tropism::task::Task;
use tropism_neat::Config;

use crate::sequences;
use crate::stopwatch::Stopwatch;
use crate::task::check_goal;
use crate::{Error, Monitor, Workflow, champion, files, model};

/// Evaluates random networks, each drawn as NEAT draws its initial population, on simulated plants of a model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BaselinePlan {
    /// File of the tip-motion model.
    pub model: PathBuf,
    /// Task of the controllers.
    pub task: Task,
    /// NEAT's parameters, for the distribution of the weights.
    pub neat: Config,
    /// Number of controllers, 1 to 1000000000. Paper: two million.
    pub count: u64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// File for the genome of the best controller.
    pub out: Option<PathBuf>,
    /// Whether a file that is there is replaced.
    pub replace: bool,
}

/// The largest [`BaselinePlan::count`]: the fitness of each controller is kept, 8 bytes each.
const MAX_COUNT: u64 = 1_000_000_000;

impl Default for BaselinePlan {
    fn default() -> Self {
        Self {
            model: "model.json".into(),
            task: Task::default(),
            neat: Config::wahby2016(),
            count: 2_000_000,
            seed: 1,
            out: None,
            replace: false,
        }
    }
}

/// The fitness of random controllers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaselineResults {
    /// Number of controllers.
    pub count: u64,
    /// Best fitness, in cm.
    pub best: f64,
    /// Median fitness, in cm.
    pub median: f64,
    /// Processor time, in s.
    pub cpu_seconds: f64,
}

impl Workflow for BaselinePlan {
    type Results = BaselineResults;

    const SCHEMA: &'static str = "tropism.baseline/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        check_goal(&self.task)?;
        self.neat.check().map_err(Error::in_plan("neat"))?;
        Error::check_range("count", self.count, MAX_COUNT)?;
        files::check_outputs(self.out.as_slice(), std::slice::from_ref(&self.model))?;
        self.out.iter().try_for_each(|out| files::check_free(out, self.replace || out.is_dir()))
    }

    fn prepare(&mut self) -> Result<(), Error> {
        sequences::draw_for(&mut self.task, &self.model, self.seed)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<BaselineResults, Error> {
        let stopwatch = Stopwatch::start();
        let model = model::read_for(&self.model, &self.task, monitor)?;
        monitor.stage("random controllers", self.count);
        let tick = |count| {
            monitor.advance(count);
            monitor.may_go_on()
        };
        let baseline = evolve::baseline(
            &model,
            &self.task,
            &Sensors::default(),
            &self.neat,
            self.seed,
            self.count,
            tick,
        )
        .ok_or_else(Error::cancelled)?;
        if let Some(path) = &self.out {
            let json = model.to_json();
            let genome = baseline.champion.clone();
            let champion = Champion {
                task: Some(self.task.clone()),
                is_virtual: Some(model.is_virtual()),
                ..Champion::of_model(genome, &Sensors::default(), &model, &json)
            };
            champion::write(path, &champion)?;
        }
        Ok(BaselineResults {
            count: baseline.count,
            best: baseline.best,
            median: baseline.median,
            cpu_seconds: stopwatch.cpu_seconds(),
        })
    }
}
