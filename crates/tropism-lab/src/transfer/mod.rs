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
mod status;

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::environment::unwatched;
use tropism::parallel;
use tropism::random::{self, Purpose};
use tropism::task::{Reading, Task};
use tropism::track::{PAPER_PERIOD_MIN, Track};
use tropism_bean::tent::Greenhouse;

pub use self::causes::Cause;
use self::causes::{Reference, Response};
pub(crate) use self::controllers::check_name;
pub use self::controllers::{ControllerSource, NamedController, read_controllers};
pub use self::results::{
    ArrivalResults, ControllerPair, ControllerResults, OverPlants, SeenTurns, Share, TargetResults,
    TransferResults,
};
use self::results::{Judge, Optimum, PlantResult, Scores};
pub(crate) use self::status::status;
pub use self::status::{SteeredPlants, TransferStatus};
use crate::controller::ControllerSpec;
use crate::lock::{FolderLock, lock};
use crate::model::{self, Model};
use crate::reach::note_out_of_reach;
use crate::sequences;
pub use crate::statistics::PairedDifference;
use crate::task::check_goal;
use crate::workflow::{check_same, other_settings};
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
    /// File of the tip-motion model on which the controllers were made: misses where it has no data are then told apart.
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
    plant_seeds: Vec<u64>,
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
        let model = self.model.as_deref().map(model::read).transpose()?;
        let _lock = self.claim()?;
        monitor.note("virtual plants: nothing here is a measurement of a living plant");
        if !self.random_targets {
            note_out_of_reach(&self.task, &self.greenhouse.bean, monitor);
        }
        let scores = self.scores(model.as_ref(), monitor)?;
        let results = scores.results(self);
        let table = scores.csv(self).map_err(Error::at("plants.csv"))?;
        files::write(&self.out.join("plants.csv"), &table)?;
        files::write_json(&self.out.join("transfer.json"), &results)?;
        let page = self.page(&scores, &results)?;
        files::write(&self.out.join("report.html"), page.html().as_bytes())?;
        Ok(results)
    }
}

impl TransferPlan {
    /// The files that are written to [`out`](Self::out), but for the tracks.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        ["transfer.toml", "plants.csv", "transfer.json", "report.html"].map(|name| self.out.join(name)).into()
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

    /// Makes the folder, or checks that the comparison in it is this one, and locks it until the result is dropped.
    fn claim(&self) -> Result<FolderLock, Error> {
        let path = self.out.join("transfer.toml");
        let record = TransferRecord {
            schema: Self::SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            is_virtual: true,
            period_min: self.period_min,
            photographs: self.photographs,
            plant_seeds: self.seeds(),
            task: &self.task,
            random_targets: self.random_targets,
            greenhouse: self.tent(),
            controllers: &self.controllers,
        };
        let text = files::toml_of(&path, &record)?;
        check_same(&path, &text, self.resume, "a comparison")
            .map_err(|error| self.other_plan().unwrap_or(error))?;
        for NamedController { name, .. } in &self.controllers {
            files::make_folder(&self.out.join("tracks").join(name))?;
        }
        let lock = lock(&self.out)?;
        let plan = Self { out: PathBuf::new(), resume: true, ..self.clone() };
        files::write_json(&self.out.join(PLAN), &plan)?;
        // Last: a comparison with its record has all that it needs.
        files::write(&path, text.as_bytes())?;
        Ok(lock)
    }

    /// The error that the plan in the folder differs in what decides the tracks. The record would say the same in the seeds of all
    /// plants.
    fn other_plan(&self) -> Option<Error> {
        let found = Self::of_folder(&self.out).ok().filter(|_| self.resume)?;
        let deciding = |plan: &Self| {
            serde_json::to_value(Self { model: None, optimum: false, reference: None, ..plan.clone() }).ok()
        };
        let (found, wanted) = (deciding(&found)?, deciding(self)?);
        (found != wanted).then(|| other_settings(&self.out.join(PLAN), "a comparison", &found, &wanted))
    }

    /// The plan that goes on with the comparison in the folder `out`, from its `plan.json` alone. The model that it names, if
    /// it does, must still be where it was.
    ///
    /// # Errors
    /// [`Error::File`] if there is none, or it cannot be read.
    pub fn of_folder(out: &Path) -> Result<Self, Error> {
        let plan: Self = files::read_as(&out.join(PLAN), |text| serde_json::from_str(text))?;
        Ok(Self { out: out.to_owned(), ..plan })
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

    /// The task of each plant, in order.
    pub(super) fn tasks(&self, monitor: &dyn Monitor) -> Result<Vec<Task>, Error> {
        let plants = self.seeds().len();
        let to_draw = self.task.to_draw().filter(|_| self.random_targets);
        let Some(task) = to_draw else { return Ok(vec![self.task.clone(); plants]) };
        parallel::try_map(plants, |index| {
            if !monitor.may_go_on() {
                return Err(self.interrupted());
            }
            sequences::sequence(&task, &self.trial(), self.seed, index as u64)
        })
    }

    /// Steers all plants with all controllers, and judges the tracks.
    fn scores(&self, model: Option<&Model>, monitor: &dyn Monitor) -> Result<Scores, Error> {
        let seeds = self.seeds();
        let optima = if self.optimum { seeds.len() } else { 0 };
        let tasks = self.tasks(monitor)?;
        let units: Vec<(usize, usize)> = (0..self.controllers.len())
            .flat_map(|controller| (0..seeds.len()).map(move |plant| (controller, plant)))
            .collect();
        monitor.stage("steering unseen beans", units.len() as u64);
        let Greenhouse { bean, variation, .. } = &self.greenhouse;
        let steps = self.task.max_steps;
        let reference = Reference::of(bean, *variation, steps, self.period_min, &|| monitor.may_go_on());
        let reference = reference.ok_or_else(|| self.interrupted())?;
        let judge = Judge { reference: &reference, model };
        let unit = |&(controller, plant): &(usize, usize)| {
            let Some(track) = self.track(controller, plant, seeds[plant], &tasks[plant], monitor)? else {
                return Ok(None);
            };
            let response = Response::of(bean, *variation, seeds[plant], steps, self.period_min);
            Ok(Some(judge.judge(&track, &tasks[plant], &response)))
        };
        let judged: Option<Vec<PlantResult>> = all(&units, unit)?;
        let judged = judged.ok_or_else(|| self.interrupted())?;
        let plants: Vec<Vec<PlantResult>> = judged.chunks(seeds.len()).map(<[_]>::to_vec).collect();
        if optima == 0 {
            return Ok(Scores { tasks, plants, optima: None });
        }
        monitor.stage("searching schedules", optima as u64);
        let numbers: Vec<usize> = (0..optima).collect();
        let found = all(&numbers, |&plant| self.optimum_of(plant, seeds[plant], &tasks[plant], monitor))?;
        let mut optima: Vec<Optimum> = found.ok_or_else(|| self.interrupted())?;
        if !self.photographs {
            for (plant, optimum) in optima.iter_mut().enumerate() {
                plants.iter().for_each(|plants| optimum.raise(&plants[plant]));
            }
        }
        Ok(Scores { tasks, plants, optima: Some(optima) })
    }

    fn interrupted(&self) -> Error {
        Error::Interrupted { folder: self.out.clone() }
    }

    /// The track of a plant under a controller: from its file if it is there, else steered; `None` if interrupted.
    fn track(
        &self,
        controller: usize,
        plant: usize,
        seed: u64,
        task: &Task,
        monitor: &dyn Monitor,
    ) -> Result<Option<Track>, Error> {
        let path = self.track_path(controller, plant);
        if path.exists() {
            monitor.skip(1);
            return self.read_track(&path).map(Some);
        }
        if !monitor.may_go_on() {
            return Ok(None);
        }
        let track = self.steer(&self.controllers[controller].controller, seed, task, &path, monitor)?;
        monitor.advance(u64::from(track.is_some()));
        Ok(track)
    }

    /// The optimum of a plant, from its file if it is there, else searched; `None` if interrupted.
    fn optimum_of(
        &self,
        plant: usize,
        seed: u64,
        task: &Task,
        monitor: &dyn Monitor,
    ) -> Result<Option<Optimum>, Error> {
        let path = self.optimum_path(plant);
        if path.exists() {
            monitor.skip(1);
        } else {
            let trial = self.trial();
            let found = optimum::search(&trial.specimen(seed), task, &|| monitor.may_go_on());
            let Some(mut schedule) = found else { return Ok(None) };
            files::make_folder(&self.out.join("optima"))?;
            files::write_track(&path, &trial.grow(seed, &mut schedule, task, &mut unwatched))?;
            monitor.advance(1);
        }
        let track = self.read_track(&path)?;
        Ok(Some(Optimum { fitness: task.fitness(&track), is_done: task.is_done(&track) }))
    }
}

/// Does all `units` in parallel, each as a task of its own; `None` if one was interrupted.
fn all<U: Sync, T: Send>(
    units: &[U],
    unit: impl Fn(&U) -> Result<Option<T>, Error> + Send + Sync,
) -> Result<Option<Vec<T>>, Error> {
    let done: Vec<Option<T>> = parallel::try_map(units.len(), |number| unit(&units[number]))?;
    Ok(done.into_iter().collect())
}
