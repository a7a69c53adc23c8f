//! A controller on simulated plants of a tip-motion model.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::environment::unwatched;
use tropism::evolve::Trial;
use tropism::plant::PlantModel;
use tropism::task::{Task, TaskSpec};
use tropism::track::{Sample, Track};

use crate::controller::ControllerSpec;
use crate::{Error, Monitor, Silent, Workflow, files, model};

/// Simulates plants that a controller steers, and writes the track of the first one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimulatePlan {
    /// File of the tip-motion model.
    pub model: PathBuf,
    /// The controller.
    pub controller: ControllerSpec,
    /// Its task.
    pub task: TaskSpec,
    /// Number of plants, 1 to 10000000.
    pub episodes: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// File for the track of the first plant.
    pub out: PathBuf,
    /// Whether a file that is there is replaced.
    pub replace: bool,
}

/// Tracks of `plants` plants of the model in the file `model`, steered by `controller`: the first plants of a
/// [`SimulatePlan`] with this seed. Nothing is written.
///
/// # Errors
/// [`Error`] if the model cannot be read, or the controller does not fit its lamps and its period.
pub fn tracks(
    model: &Path,
    controller: &ControllerSpec,
    task: &TaskSpec,
    plants: u32,
    seed: u64,
) -> Result<Vec<Track>, Error> {
    let model = model::read_for(model, task, &Silent)?;
    controller.check(model.layout(), model.period_min())?;
    let simulate = |plant| {
        let mut controller = controller.build(task, model.layout(), model.period_min());
        model::simulate(&model, &mut *controller, task, seed, plant, &mut unwatched)
    };
    Ok((0..plants).map(simulate).collect())
}

impl Default for SimulatePlan {
    fn default() -> Self {
        Self {
            model: "model.json".into(),
            controller: ControllerSpec::default(),
            task: TaskSpec::default(),
            episodes: 1,
            seed: 1,
            out: "track.csv".into(),
            replace: false,
        }
    }
}

/// The fitness of the simulated plants, in cm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimulateResults {
    /// File of the track of the first plant.
    pub track: PathBuf,
    /// Number of plants.
    pub episodes: u32,
    /// Mean fitness.
    pub mean_fitness: f64,
    /// Standard deviation of the fitness.
    pub sd_fitness: f64,
    /// Greatest possible fitness.
    pub best: f64,
    /// Share of steps at which the model has no data, 0 to 1.
    pub steps_without_data: f64,
}

impl Workflow for SimulatePlan {
    type Results = SimulateResults;

    const SCHEMA: &'static str = "tropism.simulate/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        Error::check_range("episodes", self.episodes, 10_000_000)?;
        files::check_outputs(std::slice::from_ref(&self.out), std::slice::from_ref(&self.model))?;
        files::check_free(&self.out, self.replace || self.out.is_dir())
    }

    fn execute(&self, monitor: &dyn Monitor) -> Result<SimulateResults, Error> {
        self.check()?;
        let model = model::read_for(&self.model, &self.task, monitor)?;
        self.controller.check(model.layout(), model.period_min())?;
        let (mut fitness, mut without_data, mut first) = (Vec::new(), 0.0, None::<Track>);
        for episode in 0..self.episodes {
            let mut controller = self.controller.build(&self.task, model.layout(), model.period_min());
            let mut watch = |_: &Sample| monitor.answer();
            let track = model::simulate(&model, &mut *controller, &self.task, self.seed, episode, &mut watch);
            if !monitor.may_go_on() {
                return Err(Error::cancelled());
            }
            fitness.push(self.task.fitness(&track));
            without_data += model.share_without_data(&track.samples);
            first.get_or_insert(track);
        }
        let trial = Trial::of(&fitness);
        files::write_track(&self.out, &first.expect("at least one episode"))?;
        Ok(SimulateResults {
            track: self.out.clone(),
            episodes: self.episodes,
            mean_fitness: trial.mean,
            sd_fitness: trial.sd,
            best: self.task.best(),
            steps_without_data: without_data / f64::from(trial.plants),
        })
    }
}
