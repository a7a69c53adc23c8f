//! Seeds times settings from one file, in a folder that can be resumed, and one table at the end.
//!
//! In: a [`SweepConfig`]. Out: for each setting the fitness over seeds, and which settings differ. A unit of work is one
//! evolution with all its runs, or one study of replicates, of one setting and one seed. Units are named and independent, and
//! each has a folder of its own. Neither the number of threads, the order of
//! units nor an interruption changes a bit.

mod config;
mod results;
mod units;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use toml::Table;
use tropism::math::rank_test;

pub use self::config::{Method, Seeds, Setting, SweepConfig};
use self::results::FinishedUnit;
pub use self::results::{SettingPair, SweepResults, SweepRow, UnitFindings, UnitRecord};
use self::units::SweepUnit;
pub(crate) use self::units::unit_folder;
use self::units::units;
use crate::comparison::SIGNIFICANT;
use crate::evolve::EvolvePlan;
use crate::work::{self, Milestone, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow, files, model};

/// Executes all units of a sweep, and summarizes them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SweepPlan {
    /// Folder for units and results.
    pub out: PathBuf,
    /// Whether to continue a sweep in `out`.
    pub resume: bool,
    /// Folder from which the files lie that `config` names.
    pub folder: PathBuf,
    /// Everything that decides the results.
    pub config: SweepConfig,
}

impl Default for SweepPlan {
    fn default() -> Self {
        Self { out: "sweep".into(), resume: false, folder: PathBuf::new(), config: SweepConfig::default() }
    }
}

/// The content of `sweep.toml`: all that decides the results.
#[derive(Serialize, Deserialize)]
struct SweepRecord {
    schema: String,
    version: String,
    is_virtual: bool,
    /// Digest of the `model.json` beside it, of evolutions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    model_sha256: Option<String>,
    /// Folder from which the files lie that replicates name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    folder: Option<PathBuf>,
    seeds: Seeds,
    #[serde(default)]
    grid: Table,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    evolve: Option<Table>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    replicates: Option<Table>,
}

/// A sweep at work.
pub struct Sweep<'p> {
    plan: &'p SweepPlan,
    /// The file of its model, of evolutions.
    model: Option<Vec<u8>>,
    settings: Vec<Setting>,
    units: Vec<SweepUnit>,
    is_virtual: bool,
}

impl Workflow for SweepPlan {
    type Results = SweepResults;

    const SCHEMA: &'static str = "tropism.sweep/1";

    fn check(&self) -> Result<(), Error> {
        self.config.settings(&self.folder)?;
        if !self.config.is_of_replicates() && self.config.model.is_none() {
            return Err(Error::Plan("`model` is missing: name that on which controllers evolve".to_owned()));
        }
        Ok(())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<SweepResults, Error> {
        work::perform(self, monitor)
    }
}

impl Work for SweepPlan {
    const WORKFLOW: &'static str = "sweep";
    const NAME: &'static str = "a sweep";
    const RECORD: &'static str = "sweep.toml";
    const RESULTS: &'static [&'static str] = &["sweep.json"];

    type Begun<'p> = Sweep<'p>;

    fn out(&self) -> &Path {
        &self.out
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        // An empty path, the working folder, has no absolute one.
        if self.folder.as_os_str().is_empty() {
            self.folder = PathBuf::from(".");
        }
        vec![&mut self.out, &mut self.folder]
    }

    /// Files of species of replicates must still be where they were.
    fn of_folder(out: &Path) -> Result<Self, Error> {
        let SweepRecord { seeds, grid, evolve, replicates, model_sha256, folder, .. } = record_of(out)?;
        let model = model_sha256.map(|_| MODEL.into());
        let config = SweepConfig { model, seeds, grid, evolve, replicates };
        let folder = folder.unwrap_or_else(|| out.to_owned());
        Ok(Self { out: out.to_owned(), resume: true, folder, config })
    }

    /// A part is a setting.
    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let plan = Self::of_folder(folder)?;
        let settings = plan.config.settings(&plan.folder)?;
        let unit = if plan.config.is_of_replicates() { "comparisons" } else { "generations" };
        let part = |setting: &Setting| PartStatus::new(&setting.name, 0, 0, unit);
        let mut parts: Vec<PartStatus> = settings.iter().map(part).collect();
        for unit in plan.units()? {
            let (part, size) = (&mut parts[unit.place], settings[unit.place].generations().max(1));
            let own = unit_folder(folder, &unit);
            part.total += size;
            if own.join("unit.json").exists() {
                part.done += size;
            } else if own.join(EvolvePlan::RECORD).exists() {
                part.done += EvolvePlan::status(&own)?.progress().0;
            }
        }
        let is_virtual = Some(Self::is_virtual(folder)?);
        Ok(WorkStatus { is_virtual, ..WorkStatus::of::<Self>(folder, parts)? })
    }

    fn begin(&self, _monitor: &dyn Monitor) -> Result<Sweep<'_>, Error> {
        let model = self.config.model.as_ref().map(|model| self.folder.join(model));
        let is_virtual = match &model {
            Some(model) => model::read(model)?.is_virtual(),
            None => true,
        };
        let model = model.as_deref().map(files::read).transpose()?;
        let settings = self.config.settings(&self.folder)?;
        let units = units(&settings, &self.config.seeds.list());
        Ok(Sweep { plan: self, model, settings, units, is_virtual })
    }

    fn collect(&self, sweep: &Sweep<'_>, monitor: &dyn Monitor) -> Result<SweepResults, Error> {
        let finished = sweep.units.iter().filter_map(|unit| sweep.finished(unit).transpose());
        let finished: Vec<FinishedUnit> = finished.collect::<Result<_, _>>()?;
        let results = SweepResults::new(Self::SCHEMA, self.config.seeds.list(), &sweep.settings, &finished);
        let table = results.csv().map_err(Error::at("sweep.csv"))?;
        files::write(&self.out.join("sweep.csv"), &table)?;
        files::write_json(&self.out.join("sweep.json"), &results)?;
        if !results::has_one_task(&sweep.settings) {
            monitor.note("settings have different tasks, whose fitness is not alike: they are not compared");
        }
        Ok(results)
    }
}

fn record_of(folder: &Path) -> Result<SweepRecord, Error> {
    Ok(files::read_toml(&folder.join(SweepPlan::RECORD))?)
}

impl SweepPlan {
    /// Whether the plants of the sweep in `folder` are virtual, or models of such.
    pub(crate) fn is_virtual(folder: &Path) -> Result<bool, Error> {
        Ok(record_of(folder)?.is_virtual)
    }

    /// All units, in the order in which they begin.
    ///
    /// # Errors
    /// [`Error::Plan`] as [`SweepConfig::settings`].
    pub(crate) fn units(&self) -> Result<Vec<SweepUnit>, Error> {
        Ok(units(&self.config.settings(&self.folder)?, &self.config.seeds.list()))
    }

    /// The model in the folder of the sweep: it needs no other file to go on.
    fn model_copy(&self) -> PathBuf {
        self.out.join(MODEL)
    }
}

/// The model in the folder of a sweep.
const MODEL: &str = "model.json";

impl Units for Sweep<'_> {
    fn record(&self) -> Result<Record, Error> {
        let SweepConfig { seeds, grid, evolve, replicates, .. } = &self.plan.config;
        let content = SweepRecord {
            schema: SweepPlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: self.is_virtual,
            model_sha256: self.model.as_deref().map(files::sha256),
            folder: self.plan.config.is_of_replicates().then(|| self.plan.folder.clone()),
            seeds: seeds.clone(),
            grid: grid.clone(),
            evolve: evolve.clone(),
            replicates: replicates.clone(),
        };
        let beside = self.model.iter().map(|model| (MODEL, model.clone())).collect();
        Ok(Record { beside, ..Record::of(self.plan, &content)? })
    }

    /// Evolutions work side by side; studies of replicates, which use all threads, one after the other.
    fn stages(&self) -> Vec<Stage> {
        let pace = if self.plan.config.is_of_replicates() { Pace::Nested } else { Pace::SideBySide };
        let unit = |unit: &SweepUnit| Unit {
            name: unit.name.clone(),
            about: format!("{}; seed {}", self.settings[unit.place].name, unit.seed),
            size: self.settings[unit.place].generations(),
        };
        vec![Stage { name: "sweep".to_owned(), pace, units: self.units.iter().map(unit).collect() }]
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        Ok(self.finished(&self.units[place.unit])?.is_some())
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        self.execute_unit(&self.units[place.unit], monitor)
    }

    fn reached(&self, milestone: &Milestone, monitor: &dyn Monitor) -> Result<(), Error> {
        if let (Milestone::Begun, Some(note)) = (milestone, self.too_few_seeds()) {
            monitor.note(&note);
        }
        Ok(())
    }
}

impl Sweep<'_> {
    /// Says how many seeds are needed where those of the plan can show no difference between settings, however large.
    fn too_few_seeds(&self) -> Option<String> {
        let (settings, seeds) = (self.settings.len(), self.plan.config.seeds.list().len());
        let values = match &self.settings.first()?.method {
            config::Method::Evolve(config) => config.evolution.runs as usize,
            config::Method::Replicates(_) => 1,
        };
        let pairs = settings * (settings - 1) / 2;
        let least = rank_test::least_size(pairs.max(1), SIGNIFICANT);
        let wanted = least.div_ceil(values.max(1));
        (pairs > 0 && seeds < wanted).then(|| {
            format!(
                "with {settings} settings, a rank test finds no difference in fewer than {wanted} seeds, however large; \
                 this sweep has {seeds}"
            )
        })
    }
}
