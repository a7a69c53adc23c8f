//! The transfer of controllers to unseen plants: many controllers on the same many virtual beans.
//!
//! In: controllers, a virtual tent, the seeds of its plants and a task. Out: the fitness of each controller on each plant,
//! how near the tip came to each target, likely causes of missed targets, differences between controllers with intervals,
//! and a report. Each plant under each controller is a unit of work with a file of its own: neither the number of threads nor
//! an interruption changes a result. `docs/how-to/compare-controllers.md` says how to judge fairly.

mod controllers;
mod optimum;
mod steer;
mod causes;
mod results;
mod page;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};
use tropism::environment::unwatched;
use tropism::parallel;
use tropism::random::{self, Purpose};
use tropism::task::{Reading, Task};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::tent::Greenhouse;

pub use self::causes::Cause;
use self::causes::{Reference, Response};
pub use self::controllers::{ControllerSource, NamedController, read_controllers};
pub(crate) use self::controllers::{check_names, repeated};
pub use self::results::{
    ArrivalResults, ControllerPair, ControllerResults, OverPlants, SeenTurns, Share, TargetResults,
    TransferResults,
};
use self::results::{Judge, Optimum, PlantResult, Scores};
use crate::controller::ControllerSpec;
use crate::model::{self, Model};
use crate::reach::note_out_of_reach;
use crate::sequences;
pub use crate::statistics::PairedDifference;
use crate::task::check_goal;
use crate::work::{self, Milestone, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow, files};

/// Number of plants that a claim on a controller takes (`docs/how-to/compare-controllers.md`): the standard error of the mean is
/// then 0.3 cm.
pub const TEST_PLANTS: u32 = 90;

/// The latest plan, in the folder of a comparison: it needs no other file to go on.
const PLAN: &str = "plan.json";

/// The most plants; chosen, against mistyped numbers.
const MAX_PLANTS: u64 = 100_000;

/// Lets each of several controllers steer the same unseen virtual plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TransferPlan {
    /// The controllers.
    pub controllers: Vec<NamedController>,
    /// Number of plants, 1 to 100000. Their seeds follow from `seed`; none is a plant of an experiment under any seed.
    pub plants: u32,
    /// Seeds of the plants, from the first to the one before the last, instead of `plants`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plant_seeds: Option<Range<u64>>,
    /// Task of the controllers; it has targets.
    pub task: Task,
    /// Whether each plant has a random sequence of targets of its own, as many as `task` has and as high at most
    /// (`docs/how-to/draw-a-task.md` states the rule).
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub random_targets: bool,
    /// Species, lamps and tent.
    pub greenhouse: Greenhouse,
    /// Time from one step to the next, in min. Paper: 5 (section 2.1).
    pub period_min: f64,
    /// Whether the tip is measured in photographs.
    pub photographs: bool,
    /// File of the tip-motion model on which the controllers were made: misses where it has no data are then distinguished.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// Whether to search the best schedule of lamps for each plant.
    pub optimum: bool,
    /// Name of the controller that stands for what a rule without knowledge of the future can reach.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Seed of the plants and of the bootstrap.
    pub seed: u64,
    /// Whether to continue a comparison in `out`.
    pub resume: bool,
    /// Folder for tracks and results.
    pub out: PathBuf,
}

impl Default for TransferPlan {
    fn default() -> Self {
        let named = |name: &str, controller| NamedController { name: name.to_owned(), controller };
        Self {
            controllers: vec![
                named("greedy", ControllerSpec::Greedy),
                named("periodic", ControllerSpec::default()),
            ],
            plants: TEST_PLANTS,
            plant_seeds: None,
            task: Task::default(),
            random_targets: false,
            greenhouse: Greenhouse::default(),
            period_min: PAPER_PERIOD_MIN,
            photographs: false,
            model: None,
            optimum: false,
            reference: None,
            seed: 1,
            resume: false,
            out: "transfer".into(),
        }
    }
}

/// What decides the tracks of a comparison: the content of `transfer.toml`. All else is computed anew from the tracks.
#[derive(Serialize)]
struct TransferRecord<'p> {
    schema: &'static str,
    version: &'static str,
    is_virtual: bool,
    period_min: f64,
    photographs: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    plants: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plant_seeds: Option<Range<u64>>,
    seed: u64,
    task: &'p Task,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    random_targets: bool,
    greenhouse: Greenhouse,
    controllers: &'p [NamedController],
}

impl Workflow for TransferPlan {
    type Results = TransferResults;

    const SCHEMA: &'static str = "tropism.transfer/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        check_goal(&self.task)?;
        if self.task.is_in_space() && self.greenhouse.scene.cameras < 2 {
            return Err(Error::Plan(
                "`task`: its targets are in space, which takes two cameras: `greenhouse.scene.cameras` = 2"
                    .to_owned(),
            ));
        }
        self.rig().check().map_err(|error| Error::Plan(error.to_string()))?;
        controllers::check(&self.controllers, &self.greenhouse.layout, self.period_min)?;
        match &self.plant_seeds {
            None => Error::check_range("plants", self.plants, MAX_PLANTS)?,
            Some(Range { start, end }) if start >= end || end - start > MAX_PLANTS => {
                return Err(Error::Plan(format!(
                    "found `plant_seeds` {start}..{end}, wanted a first seed below the end and at most {MAX_PLANTS} seeds, \
                     such as 1000..1090"
                )));
            }
            Some(_) => {}
        }
        match &self.reference {
            Some(reference) if !self.controllers.iter().any(|one| one.name == *reference) => {
                let names: Vec<&str> = self.controllers.iter().map(|one| one.name.as_str()).collect();
                return Err(Error::Plan(format!(
                    "found `reference` {reference}, wanted one of {}",
                    names.join(", ")
                )));
            }
            _ => {}
        }
        files::check_outputs(&self.outputs(), self.model.as_slice())
    }

    /// Random targets are drawn for each plant: those straight up stand for them in the plan.
    fn prepare(&mut self) -> Result<(), Error> {
        if self.task.is_to_draw() {
            self.task = self.task.straight_up();
            self.random_targets = true;
        }
        Ok(())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<TransferResults, Error> {
        work::perform(self, monitor)
    }
}

impl Work for TransferPlan {
    const WORKFLOW: &'static str = "transfer";
    const NAME: &'static str = "a comparison";
    const RECORD: &'static str = "transfer.toml";
    const RESULTS: &'static [&'static str] = &["transfer.json"];

    type Begun<'p> = Steering<'p>;

    fn out(&self) -> &Path {
        &self.out
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        [&mut self.out].into_iter().chain(&mut self.model).collect()
    }

    /// The model that the plan names, if it does, must still be where it was.
    fn of_folder(out: &Path) -> Result<Self, Error> {
        let plan: Self = files::read_as(&out.join(PLAN), |text| serde_json::from_str(text))?;
        Ok(Self { out: out.to_owned(), ..plan })
    }

    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let plan = Self::of_folder(folder)?;
        let plants = plan.seeds().len();
        let part = |name: &str, is_there: &dyn Fn(usize) -> bool| {
            let done = (0..plants).filter(|&plant| is_there(plant)).count();
            PartStatus::new(name, done as u64, plants as u64, "plants")
        };
        let steered = plan
            .controllers
            .iter()
            .enumerate()
            .map(|(number, one)| part(&one.name, &|plant| plan.track_path(number, plant).exists()));
        let searched =
            plan.optimum.then(|| part("best schedules", &|plant| plan.optimum_path(plant).exists()));
        WorkStatus::of::<Self>(folder, steered.chain(searched).collect())
    }

    fn begin(&self, _monitor: &dyn Monitor) -> Result<Steering<'_>, Error> {
        let model = self.model.as_deref().map(model::read).transpose()?;
        let seeds = self.seeds();
        let tasks = seeds.iter().map(|_| OnceLock::new()).collect();
        Ok(Steering { plan: self, model, seeds, tasks })
    }

    fn collect(&self, steering: &Steering<'_>, monitor: &dyn Monitor) -> Result<TransferResults, Error> {
        let scores = steering.scores(monitor)?;
        let results = scores.results(self);
        let table = scores.csv(self).map_err(Error::at("plants.csv"))?;
        files::write(&self.out.join("plants.csv"), &table)?;
        let page = self.page(&scores, &results)?;
        files::write(&self.out.join("report.html"), page.html().as_bytes())?;
        // Last: with it the comparison is over.
        files::write_json(&self.out.join("transfer.json"), &results)?;
        Ok(results)
    }
}

impl TransferPlan {
    /// The files that are written to [`out`](Self::out), but for the tracks.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        [Self::RECORD, "plants.csv", "transfer.json", "report.html"].map(|name| self.out.join(name)).into()
    }

    /// Whether the task is such as the paper's and scored by eq. (9): the shares of plants with a fitness under 9 and 6 cm mean
    /// nothing for others.
    #[must_use]
    pub fn has_low_shares(&self) -> bool {
        self.task.to_draw().is_some() && self.task.score != Reading::Arrival
    }

    /// The seeds of the plants, in order. They fit into TOML, so that `run` with such a seed grows the same plant.
    #[must_use]
    pub fn seeds(&self) -> Vec<u64> {
        match &self.plant_seeds {
            Some(seeds) => seeds.clone().collect(),
            None => (0..self.plants)
                .map(|plant| random::derive(self.seed, Purpose::Judge, plant.into()) >> 1)
                .collect(),
        }
    }

    /// The track file of a plant, from 0, under the best schedule that was found.
    fn optimum_path(&self, plant: usize) -> PathBuf {
        self.out.join("optima").join(format!("plant-{:04}.csv", plant + 1))
    }

    /// The track file of a plant, from 0, under controller number `controller`.
    fn track_path(&self, controller: usize, plant: usize) -> PathBuf {
        let name = &self.controllers[controller].name;
        self.out.join("tracks").join(name).join(format!("plant-{:04}.csv", plant + 1))
    }

    fn interrupted(&self) -> Error {
        Error::Interrupted { folder: self.out.clone() }
    }
}

/// A comparison at work.
pub struct Steering<'p> {
    plan: &'p TransferPlan,
    model: Option<Model>,
    seeds: Vec<u64>,
    /// The task of each plant, once it is drawn.
    tasks: Vec<OnceLock<Task>>,
}

impl Units for Steering<'_> {
    fn record(&self) -> Result<Record, Error> {
        let plan = self.plan;
        let content = TransferRecord {
            schema: TransferPlan::SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            is_virtual: true,
            period_min: plan.period_min,
            photographs: plan.photographs,
            plants: plan.plant_seeds.is_none().then_some(plan.plants),
            plant_seeds: plan.plant_seeds.clone(),
            seed: plan.seed,
            task: &plan.task,
            random_targets: plan.random_targets,
            greenhouse: plan.tent(),
            controllers: &plan.controllers,
        };
        let saved = TransferPlan { out: PathBuf::new(), resume: true, ..plan.clone() };
        let saved = files::json_of(&plan.out.join(PLAN), &saved)? + "\n";
        Ok(Record { beside: vec![(PLAN, saved.into_bytes())], ..Record::of(plan, &content)? })
    }

    /// Each plant under each controller; then, if it is asked for, the best schedule for each plant.
    fn stages(&self) -> Vec<Stage> {
        let plants = || 1..=self.seeds.len();
        let steered = self.plan.controllers.iter().flat_map(|NamedController { name, .. }| {
            plants().map(move |plant| {
                Unit::new(format!("{name}/plant-{plant:04}"), format!("{name} steers plant {plant}"))
            })
        });
        let mut stages = vec![Stage {
            name: "steering unseen beans".to_owned(),
            pace: Pace::Parallel,
            units: steered.collect(),
        }];
        if self.plan.optimum {
            let searched = plants().map(|plant| {
                Unit::new(format!("optima/plant-{plant:04}"), format!("best schedule for plant {plant}"))
            });
            stages.push(Stage {
                name: "searching schedules".to_owned(),
                pace: Pace::Parallel,
                units: searched.collect(),
            });
        }
        stages
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        Ok(self.path(place).exists())
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        let (plan, path) = (self.plan, self.path(place));
        files::make_folder(path.parent().unwrap_or(&plan.out))?;
        let plants = self.seeds.len();
        let plant = place.unit % plants;
        let (seed, task) = (self.seeds[plant], self.task(plant)?);
        if place.stage == 0 {
            let controller = &plan.controllers[place.unit / plants].controller;
            plan.steer(controller, seed, task, &path, monitor)?;
        } else {
            let trial = plan.trial();
            let found = optimum::search(&trial.specimen(seed), task, &|| monitor.may_go_on());
            let mut schedule = found.ok_or_else(|| plan.interrupted())?;
            files::write_track(&path, &trial.grow(seed, &mut schedule, task, &mut unwatched))?;
        }
        monitor.advance(1);
        Ok(())
    }

    fn reached(&self, milestone: &Milestone, monitor: &dyn Monitor) -> Result<(), Error> {
        if *milestone == Milestone::Begun {
            monitor.note("virtual plants: nothing here is a measurement of a living plant");
            if !self.plan.random_targets {
                note_out_of_reach(&self.plan.task, &self.plan.greenhouse.bean, monitor);
            }
        }
        Ok(())
    }
}

impl Steering<'_> {
    /// The task of a plant, from 0: a random one is drawn where somebody asks first.
    fn task(&self, plant: usize) -> Result<&Task, Error> {
        let (plan, cell) = (self.plan, &self.tasks[plant]);
        if let Some(task) = cell.get() {
            return Ok(task);
        }
        let task = match plan.task.to_draw().filter(|_| plan.random_targets) {
            Some(task) => sequences::sequence(&task, &plan.trial(), plan.seed, plant as u64)?,
            None => plan.task.clone(),
        };
        Ok(cell.get_or_init(|| task))
    }

    /// The track file of a unit.
    fn path(&self, place: Place) -> PathBuf {
        let (controller, plant) = (place.unit / self.seeds.len(), place.unit % self.seeds.len());
        if place.stage == 0 { self.plan.track_path(controller, plant) } else { self.plan.optimum_path(plant) }
    }

    /// Judges the tracks of all plants.
    fn scores(&self, monitor: &dyn Monitor) -> Result<Scores, Error> {
        let (plan, plants) = (self.plan, self.seeds.len());
        let (bean, variation) = (&plan.greenhouse.bean, plan.greenhouse.variation);
        let (steps, period_min) = (plan.task.max_steps, plan.period_min);
        monitor.stage("comparing", plants as u64);
        let reference = Reference::of(bean, variation, steps, period_min, &|| monitor.may_go_on());
        let reference = reference.ok_or_else(|| plan.interrupted())?;
        let judge = Judge { reference: &reference, model: self.model.as_ref() };
        let of_plant = |plant: usize| {
            if !monitor.may_go_on() {
                return Err(plan.interrupted());
            }
            let response = Response::of(bean, variation, self.seeds[plant], steps, period_min);
            let of_controller = |controller| {
                let track = plan.read_track(&plan.track_path(controller, plant))?;
                Ok(judge.judge(&track, self.task(plant)?, &response))
            };
            let judged = (0..plan.controllers.len()).map(of_controller).collect();
            monitor.advance(1);
            judged
        };
        let judged: Vec<Vec<PlantResult>> = parallel::try_map(plants, of_plant)?;
        let optimum = |plant: usize| {
            let (task, track) = (self.task(plant)?, plan.read_track(&plan.optimum_path(plant))?);
            let mut optimum = Optimum { fitness: task.fitness(&track), is_done: task.is_done(&track) };
            if !plan.photographs {
                judged[plant].iter().for_each(|result| optimum.raise(result));
            }
            Ok::<_, Error>(optimum)
        };
        let optima = plan.optimum.then(|| parallel::try_map(plants, optimum)).transpose()?;
        let of_controller = |controller: usize| judged.iter().map(|one| one[controller].clone()).collect();
        let plants = (0..plan.controllers.len()).map(of_controller).collect();
        let tasks = (0..self.seeds.len()).map(|plant| self.task(plant).cloned()).collect::<Result<_, _>>()?;
        Ok(Scores { tasks, plants, optima })
    }
}
