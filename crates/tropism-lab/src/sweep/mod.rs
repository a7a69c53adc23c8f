//! Seeds times settings from one file, in a folder that can be resumed, and one table at the end.
//!
//! In: a [`SweepConfig`]. Out: for each setting the fitness over seeds, and which settings differ. A unit of work is one
//! evolution with all its runs, or one study of replicates, of one setting and one seed. Units are named and independent, and
//! each has a folder of its own: [`UnitPlan`] executes one alone, for clusters. Neither the number of threads, the order of
//! units nor an interruption changes a bit.

mod config;
mod results;
mod units;
mod status;

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use serde::{Deserialize, Serialize};
use toml::Table;
use tropism::math::rank_test;

pub use self::config::{Method, Seeds, Setting, SweepConfig};
use self::results::FinishedUnit;
pub use self::results::{SettingPair, SweepResults, SweepRow, UnitFindings, UnitResults};
pub use self::status::SweepStatus;
pub(crate) use self::status::status;
pub use self::units::SweepUnit;
pub(crate) use self::units::unit_folder;
use self::units::units;
use crate::comparison::SIGNIFICANT;
use crate::lock::{FolderLock, LockError, lock};
use crate::monitor::{NotedOnce, Part, Titled};
use crate::workflow::check_same;
use crate::{Error, Monitor, Workflow, files, model};

/// Schema of the `unit.json` of a unit.
const UNIT_SCHEMA: &str = UnitPlan::SCHEMA;

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

/// Executes one unit of a sweep alone: beside others, also on other machines that share the folder, and in any order. The
/// sweep itself then finds it finished.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UnitPlan {
    /// The sweep.
    pub sweep: SweepPlan,
    /// Number of the unit, from 1.
    pub unit: usize,
}

impl Default for UnitPlan {
    fn default() -> Self {
        Self { sweep: SweepPlan::default(), unit: 1 }
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
struct Sweep<'p> {
    plan: &'p SweepPlan,
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
        let (sweep, _lock) = self.claim()?;
        if let Some(note) = sweep.too_few_seeds() {
            monitor.note(&note);
        }
        let finished = sweep.execute_all(monitor).map_err(|error| error.of_part(&self.out))?;
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

impl Workflow for UnitPlan {
    type Results = UnitResults;

    const SCHEMA: &'static str = "tropism.sweep-unit/1";

    fn check(&self) -> Result<(), Error> {
        self.sweep.check()?;
        let units = self.sweep.units()?.len();
        Error::check_range("unit", self.unit as u64, units as u64)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<UnitResults, Error> {
        let sweep = self.sweep.claim_beside_others()?;
        let unit = &sweep.units[self.unit - 1];
        let finished = sweep.execute_unit(unit, monitor);
        Ok(finished.map_err(|error| error.of_part(&sweep.unit_folder(unit)))?.0)
    }
}

impl SweepPlan {
    /// The plan that goes on with the sweep in the folder `out`, from its `sweep.toml` and `model.json` alone. Files of species
    /// of replicates must still be where they were.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read.
    pub fn of_folder(out: &Path) -> Result<Self, Error> {
        let record: SweepRecord = files::read_toml(&record_path(out))?;
        let SweepRecord { seeds, grid, evolve, replicates, model_sha256, folder, .. } = record;
        let model = model_sha256.map(|_| MODEL.into());
        let config = SweepConfig { model, seeds, grid, evolve, replicates };
        let folder = folder.unwrap_or_else(|| out.to_owned());
        Ok(Self { out: out.to_owned(), resume: true, folder, config })
    }

    /// Whether the plants of the sweep in `folder` are virtual, or models of such.
    pub(crate) fn is_virtual(folder: &Path) -> Result<bool, Error> {
        let record: SweepRecord = files::read_toml(&record_path(folder))?;
        Ok(record.is_virtual)
    }

    /// All units of work, in the order in which they begin.
    ///
    /// # Errors
    /// [`Error::Plan`] as [`SweepConfig::settings`].
    pub fn units(&self) -> Result<Vec<SweepUnit>, Error> {
        Ok(units(&self.config.settings(&self.folder)?, &self.config.seeds.list()))
    }

    /// The model in the folder of the sweep: it needs no other file to go on.
    fn model_copy(&self) -> PathBuf {
        self.out.join(MODEL)
    }

    /// Makes the folder, or checks that the sweep in it is this one, and locks it until the lock is dropped.
    fn claim(&self) -> Result<(Sweep<'_>, FolderLock), Error> {
        let record = record_path(&self.out);
        let (sweep, text, model) = self.prepared()?;
        check_same(&record, &text, self.resume, "a sweep")?;
        files::make_folder(&self.out)?;
        let lock = lock(&self.out)?;
        if !record.exists() {
            self.write_record(&text, model.as_deref())?;
        }
        Ok((sweep, lock))
    }

    /// [`claim`](Self::claim) for one unit: others may do the same at this moment, and none keeps the lock.
    fn claim_beside_others(&self) -> Result<Sweep<'_>, Error> {
        let record = record_path(&self.out);
        let (sweep, text, model) = self.prepared()?;
        files::make_folder(&self.out)?;
        for _ in 0..CLAIM_TRIES {
            if record.exists() {
                break;
            }
            match lock(&self.out) {
                Ok(_lock) => self.write_record(&text, model.as_deref())?,
                // Another unit writes the record.
                Err(LockError::InUse { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        check_same(&record, &text, true, "a sweep")?;
        Ok(sweep)
    }

    /// The sweep, the text of its record, and the bytes of its model.
    fn prepared(&self) -> Result<(Sweep<'_>, String, Option<Vec<u8>>), Error> {
        let SweepConfig { model, seeds, grid, evolve, replicates } = &self.config;
        let model = model.as_ref().map(|model| self.folder.join(model));
        let is_virtual = match &model {
            Some(model) => model::read(model)?.is_virtual(),
            None => true,
        };
        let model = model.as_deref().map(files::read).transpose()?;
        let record = SweepRecord {
            schema: Self::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual,
            model_sha256: model.as_deref().map(files::sha256),
            folder: self.config.is_of_replicates().then(|| self.folder.clone()),
            seeds: seeds.clone(),
            grid: grid.clone(),
            evolve: evolve.clone(),
            replicates: replicates.clone(),
        };
        let text = files::toml_of(&record_path(&self.out), &record)?;
        let settings = self.config.settings(&self.folder)?;
        let units = units(&settings, &seeds.list());
        Ok((Sweep { plan: self, settings, units, is_virtual }, text, model))
    }

    fn write_record(&self, text: &str, model: Option<&[u8]>) -> Result<(), Error> {
        if let Some(model) = model {
            files::write(&self.model_copy(), model)?;
        }
        // Last: a sweep with this file has its model, too.
        Ok(files::write(&record_path(&self.out), text.as_bytes())?)
    }
}

/// The model in the folder of a sweep.
const MODEL: &str = "model.json";

/// How often a unit tries to write the record of the sweep, which takes a moment, while others do; each waits a tenth of a
/// second. Chosen.
const CLAIM_TRIES: u32 = 100;

/// The place of the record of the sweep in `folder`.
fn record_path(folder: &Path) -> PathBuf {
    folder.join("sweep.toml")
}

impl Sweep<'_> {
    /// Executes all units: evolutions side by side, studies of replicates, which use all threads, one after the other.
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

    fn execute_all(&self, monitor: &dyn Monitor) -> Result<Vec<FinishedUnit>, Error> {
        let monitor: &dyn Monitor = &NotedOnce::new(monitor);
        if self.plan.config.is_of_replicates() {
            let one = |unit: &SweepUnit| {
                let title = format!("{}/{}", unit.number, self.units.len());
                self.execute_unit(unit, &Titled { monitor, title })
            };
            return self.units.iter().map(one).collect();
        }
        let generations = |unit: &SweepUnit| self.settings[unit.place].generations();
        monitor.stage("sweep", self.units.iter().map(generations).sum());
        let finished = AtomicUsize::new(0);
        let together = Together { monitor, has_failed: AtomicBool::new(false) };
        let one = |unit: &SweepUnit| {
            if self.finished(unit)?.is_some() {
                monitor.skip(generations(unit));
            }
            let found = self.execute_unit(unit, &Part(&together));
            let found = found.inspect_err(|_| together.has_failed.store(true, Ordering::Relaxed))?;
            let finished = finished.fetch_add(1, Ordering::Relaxed) + 1;
            monitor.status(&format!("{finished} of {} evolutions", self.units.len()));
            Ok(found)
        };
        side_by_side(&self.units, one)
    }
}

/// The monitor of units side by side: where one fails the others are asked to end, and save what they have.
struct Together<'m> {
    monitor: &'m dyn Monitor,
    has_failed: AtomicBool,
}

impl Monitor for Together<'_> {
    fn next(&self) -> Option<&dyn Monitor> {
        Some(self.monitor)
    }

    fn may_go_on(&self) -> bool {
        !self.has_failed.load(Ordering::Relaxed) && self.monitor.may_go_on()
    }
}

/// Does `work` on all `units`, as many at once as the pool has threads, and returns what it found in their order.
///
/// The threads that wait for a unit are none of the pool: one of the pool that waits would take up another unit meanwhile, and
/// in it another.
fn side_by_side<U: Sync, T: Send>(
    units: &[U],
    work: impl Fn(&U) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, Error> {
    let next = AtomicUsize::new(0);
    let worker = || {
        let mut found = Vec::new();
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(unit) = units.get(place) else { return found };
            found.push((place, work(unit)));
        }
    };
    let workers = rayon::current_num_threads().min(units.len());
    let mut found: Vec<(usize, Result<T, Error>)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(worker)).collect();
        let joined =
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic)));
        joined.flatten().collect()
    });
    // What failed comes before what was asked to end for it.
    let is_failure = |(_, result): &(usize, Result<T, Error>)| {
        result.as_ref().is_err_and(|error| !matches!(error, Error::Interrupted { .. }))
    };
    found.sort_by_key(|one| (!is_failure(one), one.0));
    found.into_iter().map(|(_, result)| result).collect()
}
