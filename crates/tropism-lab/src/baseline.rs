//! Baseline: the fitness of random controllers (section 3.1).

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::control::Sensors;
use tropism::evolve::{self, Baseline, Champion};
use tropism::task::Task;
use tropism_neat::Config;

use crate::files::FileError;
use crate::model::Model;
use crate::sequences;
use crate::task::check_goal;
use crate::work::{self, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow, champion, files, model};

/// Evaluates random networks, each drawn as NEAT draws its initial population, on simulated plants of a model,
/// in a folder that can be resumed.
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
    /// Whether to continue a baseline in `out`.
    pub resume: bool,
    /// Folder for the fitness of all and the genome of the best; without one nothing is kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
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
            resume: false,
            out: None,
        }
    }
}

/// Controllers of one unit of work. Chosen: some five seconds, and 8 MB of fitness.
const UNIT: u64 = 1_000_000;

/// The fitness of random controllers: the content of `baseline.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaselineResults {
    /// Number of controllers.
    pub count: u64,
    /// Best fitness, in cm.
    pub best: f64,
    /// Median fitness, in cm.
    pub median: f64,
}

impl Workflow for BaselinePlan {
    type Results = BaselineResults;

    const SCHEMA: &'static str = "tropism.baseline/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        check_goal(&self.task)?;
        self.neat.check().map_err(Error::in_plan("neat"))?;
        Error::check_range("count", self.count, MAX_COUNT)?;
        files::check_outputs(&self.outputs(), std::slice::from_ref(&self.model))
    }

    fn prepare(&mut self) -> Result<(), Error> {
        sequences::draw_for(&mut self.task, &self.model, self.seed)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<BaselineResults, Error> {
        work::perform_in(self.out.as_deref(), |out| Self { out: Some(out), ..self.clone() }, monitor)
    }
}

impl Work for BaselinePlan {
    const WORKFLOW: &'static str = "baseline";
    const NAME: &'static str = "a baseline";
    const RECORD: &'static str = "baseline.toml";
    const RESULTS: &'static [&'static str] = &["baseline.json"];

    type Begun<'p> = Trying<'p>;

    fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        self.out.iter_mut().chain([&mut self.model]).collect()
    }

    fn of_folder(out: &Path) -> Result<Self, Error> {
        let BaselineRecord { seed, count, task, neat, .. } = files::read_toml(&out.join(Self::RECORD))?;
        let (model, out) = (out.join(MODEL), Some(out.to_owned()));
        Ok(Self { model, task, neat, count, seed, resume: true, out })
    }

    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let BaselineRecord { is_virtual, count, .. } = files::read_toml(&folder.join(Self::RECORD))?;
        let sizes = files::list(&folder.join("fitness"), "f64").unwrap_or_default();
        let sizes = sizes.iter().filter_map(|file| file.metadata().ok()).map(|data| data.len() / 8);
        let part = PartStatus::new("random controllers", sizes.sum(), count, "controllers");
        Ok(WorkStatus { is_virtual: Some(is_virtual), ..WorkStatus::of::<Self>(folder, vec![part])? })
    }

    fn begin(&self, monitor: &dyn Monitor) -> Result<Trying<'_>, Error> {
        Ok(Trying { plan: self, model: model::read_for(&self.model, &self.task, monitor)? })
    }

    fn collect(&self, trying: &Trying<'_>, _monitor: &dyn Monitor) -> Result<BaselineResults, Error> {
        let (sensors, model) = (Sensors::default(), &trying.model);
        let scores = (0..trying.units()).map(|unit| {
            let Range { start, end } = trying.controllers(unit);
            read_scores(&trying.path(unit), end - start)
        });
        let scores = scores.collect::<Result<Vec<_>, _>>()?.concat();
        let Baseline { count, best, median, champion } =
            Baseline::of(&scores, model, &sensors, &self.neat, self.seed);
        let champion = Champion {
            task: Some(self.task.clone()),
            is_virtual: Some(model.is_virtual()),
            ..Champion::of_model(champion, (&sensors).into(), model, &model.to_json())
        };
        champion::write(&self.out().join("champion.json"), &champion)?;
        let results = BaselineResults { count, best, median };
        files::write_json(&self.out().join("baseline.json"), &results)?;
        Ok(results)
    }
}

impl BaselinePlan {
    /// The files that are written to [`out`](Self::out), but for those of single units.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        let names = ["baseline.toml", "champion.json", "baseline.json"];
        self.out.iter().flat_map(|out| names.map(|name| out.join(name))).collect()
    }
}

/// The model in the folder of a baseline: it needs no other file to go on.
const MODEL: &str = "model.json";

/// What decides the results of a baseline: the content of `baseline.toml`.
#[derive(Serialize, Deserialize)]
struct BaselineRecord {
    schema: String,
    version: String,
    is_virtual: bool,
    model_sha256: String,
    seed: u64,
    count: u64,
    task: Task,
    neat: Config,
}

/// A baseline at work.
pub struct Trying<'p> {
    plan: &'p BaselinePlan,
    model: Model,
}

impl Trying<'_> {
    fn units(&self) -> u64 {
        self.plan.count.div_ceil(UNIT)
    }

    fn controllers(&self, unit: u64) -> Range<u64> {
        unit * UNIT..self.plan.count.min((unit + 1) * UNIT)
    }

    /// The file with the fitness of a unit.
    fn path(&self, unit: u64) -> PathBuf {
        self.plan.out().join("fitness").join(format!("{:04}.f64", unit + 1))
    }
}

impl Units for Trying<'_> {
    fn record(&self) -> Result<Record, Error> {
        let BaselinePlan { task, neat, count, seed, .. } = self.plan.clone();
        let (json, is_virtual) = (self.model.to_json().into_bytes(), self.model.is_virtual());
        let content = BaselineRecord {
            schema: BaselinePlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual,
            model_sha256: files::sha256(&json),
            seed,
            count,
            task,
            neat,
        };
        Ok(Record { beside: vec![(MODEL, json)], ..Record::of(self.plan, &content)? })
    }

    fn stages(&self) -> Vec<Stage> {
        let unit = |unit| {
            let Range { start, end } = self.controllers(unit);
            let about = format!("controllers {} to {end}", start + 1);
            Unit { size: end - start, ..Unit::new(format!("{:04}", unit + 1), about) }
        };
        let units = (0..self.units()).map(unit).collect();
        vec![Stage { name: "random controllers".to_owned(), pace: Pace::Sequential, units }]
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        Ok(self.path(place.unit as u64).exists())
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        let (BaselinePlan { task, neat, seed, .. }, out) = (self.plan, self.plan.out());
        let unit = place.unit as u64;
        let tick = |count| {
            monitor.advance(count);
            monitor.may_go_on()
        };
        let controllers = self.controllers(unit);
        let scores =
            evolve::random_scores(&self.model, task, &Sensors::default(), neat, *seed, controllers, tick)
                .ok_or_else(|| Error::Interrupted { folder: out.to_owned() })?;
        files::make_folder(&out.join("fitness"))?;
        let bytes: Vec<u8> = scores.into_iter().flat_map(f64::to_le_bytes).collect();
        Ok(files::write(&self.path(unit), &bytes)?)
    }
}

/// The `count` fitness values in a file: eight bytes each, the least significant first.
fn read_scores(path: &Path, count: u64) -> Result<Vec<f64>, Error> {
    let bytes = files::read(path)?;
    let (values, rest) = bytes.as_chunks::<8>();
    if values.len() as u64 != count || !rest.is_empty() {
        let found = format!("found {} bytes, wanted {}: remove the file", bytes.len(), 8 * count);
        return Err(FileError::content(path, found).into());
    }
    Ok(values.iter().map(|value| f64::from_le_bytes(*value)).collect())
}
