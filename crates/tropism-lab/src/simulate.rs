//! A controller on simulated plants of a tip-motion model.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::control::Controller;
use tropism::environment::unwatched;
use tropism::evolve::Trial;
use tropism::math::statistics::mean;
use tropism::observation::Quality;
use tropism::plant::PlantModel;
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation;
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism_bean::Species;

use crate::controller::ControllerSpec;
use crate::journal::{StepRecord, lights_that_acted};
use crate::reach::note_out_of_reach;
use crate::run::RunConfig;
use crate::sequences;
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
    pub task: Task,
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
    task: &Task,
    plants: u32,
    seed: u64,
) -> Result<Vec<Track>, Error> {
    let model = model::read_for(model, task, &Silent)?;
    controller.check_on(&model)?;
    let simulate = |plant| {
        let mut controller = controller.build(task, model.layout(), model.period_min());
        model::simulate(&model, &mut *controller, task, seed, plant, &mut unwatched)
    };
    Ok((0..plants).map(simulate).collect())
}

/// Tracks of `plants` plants of the model in the file `model` that go on where the `steps` of a run have come to, under its
/// controller, until its task is over or after `most_steps` further steps. The first sample of each is the last observation
/// of the run; steps count from the run's begin. The controller has seen what it saw in the run, and a model that remembers
/// takes up the whole past.
///
/// # Errors
/// [`Error`] if the model cannot be read, or does not fit the lamps, the period or the place of the tip; or if nothing was
/// observed yet.
pub fn continued(
    model: &Path,
    config: &RunConfig,
    steps: &[StepRecord],
    plants: u32,
    most_steps: u32,
) -> Result<Vec<Track>, Error> {
    let RunConfig { controller, task, seed, .. } = config;
    let seen = observed(steps);
    let now = seen.last().ok_or_else(|| Error::Plan("there is no photograph yet".to_owned()))?.sample.clone();
    let model = model::read_around(model, now.tip)?;
    let layout = config.rig.layout().map_err(|error| Error::Plan(error.to_string()))?;
    let period_min = config.rig.period_min;
    if *model.layout() != layout || model.period_min() != period_min {
        return Err(Error::Plan(format!(
            "found a model for {} lamps and steps of {} minutes, wanted one for the {} lamps and the steps of {period_min} \
             minutes of the run",
            model.layout().len(),
            model.period_min(),
            layout.len()
        )));
    }
    controller.check_on(&model)?;
    let past = without_gaps(seen.iter().map(|seen| seen.sample.clone()));
    let go_on = |plant| {
        let mut controller = controller.build(task, &layout, period_min);
        replay(&seen[..seen.len() - 1], now.step, &mut *controller);
        let noise = NoiseStream::new(*seed, Purpose::Trial, [plant, 0, 0]);
        let plant = model.resumed(&past, &mut noise.of_seedling());
        simulation::go_on(&model, plant, &mut *controller, task, &now, noise, most_steps)
    };
    Ok((0..plants).map(go_on).collect())
}

/// A recorded step with an observation: as a model takes it up, with the light that acted.
pub(crate) struct Observed {
    pub(crate) sample: Sample,
    /// Whether the controller was asked.
    is_decided: bool,
}

/// The steps of a run in which the plant was seen.
pub(crate) fn observed(steps: &[StepRecord]) -> Vec<Observed> {
    let last = steps.len().saturating_sub(1);
    let sample = |(index, (step, acted)): (usize, (&StepRecord, _))| {
        let seen = step.observation()?.clone();
        let lighting = if index == last { step.commanded().unwrap_or_default() } else { acted };
        let sample = Sample::of(seen, step.step, step.time_s, lighting);
        Some(Observed { sample, is_decided: step.decided.is_some() })
    };
    steps.iter().zip(lights_that_acted(steps)).enumerate().filter_map(sample).collect()
}

/// Shows `controller` what it saw before step `now`.
fn replay(seen: &[Observed], now: u32, controller: &mut dyn Controller) {
    let mut next = 0;
    for Observed { sample, .. } in seen.iter().filter(|seen| seen.is_decided) {
        if sample.step > next {
            controller.miss(sample.step - next);
        }
        controller.lighting(&sample.observation());
        next = sample.step + 1;
    }
    if now > next {
        controller.miss(now - next);
    }
}

/// Samples one step apart: what is missing is carried forward, under no light.
pub(crate) fn without_gaps(samples: impl IntoIterator<Item = Sample>) -> Vec<Sample> {
    let mut all: Vec<Sample> = Vec::new();
    for sample in samples {
        while let Some(before) = all.last().cloned()
            && before.step + 1 < sample.step
        {
            all.push(Sample {
                step: before.step + 1,
                quality: Quality::CarriedForward,
                light: None,
                levels: None,
                ..before
            });
        }
        all.push(sample);
    }
    all
}

impl Default for SimulatePlan {
    fn default() -> Self {
        Self {
            model: "model.json".into(),
            controller: ControllerSpec::default(),
            task: Task::default(),
            episodes: 1,
            seed: 1,
            out: "track.csv".into(),
            replace: false,
        }
    }
}

/// The fitness of the simulated plants, in cm, or in turns round a pole.
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
    /// Mean fitness to the letter of eq. (9) and by approach, in cm; `None` for a task with another score.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub both_readings: Option<[f64; 2]>,
    /// Greatest possible fitness; `None` where it is not known.
    pub best: Option<f64>,
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

    fn prepare(&mut self) -> Result<(), Error> {
        sequences::draw_for(&mut self.task, &self.model, self.seed)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<SimulateResults, Error> {
        let model = model::read_for(&self.model, &self.task, monitor)?;
        self.controller.check_on(&model)?;
        note_out_of_reach(&self.task, &Species::default(), monitor);
        let (mut fitness, mut both_readings) = (Vec::new(), Vec::new());
        let (mut without_data, mut first) = (0.0, None::<Track>);
        for episode in 0..self.episodes {
            let mut controller = self.controller.build(&self.task, model.layout(), model.period_min());
            let mut watch = |_: &Sample| monitor.answer();
            let track = model::simulate(&model, &mut *controller, &self.task, self.seed, episode, &mut watch);
            if !monitor.may_go_on() {
                return Err(Error::cancelled());
            }
            fitness.push(self.task.fitness(&track));
            both_readings.extend(self.task.both_readings(&track));
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
            both_readings: (!both_readings.is_empty())
                .then(|| [0, 1].map(|reading| mean(both_readings.iter().map(|both| both[reading])))),
            best: self.task.best_fitness(),
            steps_without_data: without_data / f64::from(trial.plants),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tropism::lamps::Light;

    #[test]
    fn gaps_are_held_in_the_dark() {
        let sample = |step| Sample {
            step,
            time_s: 0.0,
            tip: tropism::geometry::Point::new(f64::from(step), 4.0),
            light: Some(Light::LEFT),
            levels: None,
            quality: Quality::Measured,
            stem: None,
            depth: None,
        };
        let all = without_gaps([sample(2), sample(5)]);
        assert_eq!(all.iter().map(|sample| sample.step).collect::<Vec<_>>(), [2, 3, 4, 5]);
        assert_eq!((all[2].tip.x, all[2].light, all[2].quality), (2.0, None, Quality::CarriedForward));
    }
}
