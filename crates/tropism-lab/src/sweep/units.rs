//! One unit of work of a sweep: an evolution or a study of replicates, of one setting and one seed, in its own folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Sweep;
use super::config::{Method, Setting};
use super::results::{FinishedUnit, UnitFindings, UnitRecord};
use crate::evolve::{EvolutionHistory, EvolvePlan};
use crate::files::{self, FileError};
use crate::monitor::Part;
use crate::replicates::ReplicatesPlan;
use crate::stopwatch::Stopwatch;
use crate::{Error, Monitor, Workflow};

/// Schema of the `unit.json` of a unit.
const UNIT_SCHEMA: &str = "tropism.sweep-unit/1";

/// A unit of work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SweepUnit {
    /// Its name, and that of its folder in `units`.
    pub(crate) name: String,
    /// Name of its setting.
    pub(crate) setting: String,
    /// Its seed.
    pub(crate) seed: u64,
    /// Number of its setting, from 0.
    pub(crate) place: usize,
}

/// All units: for each seed one of each setting, so that what is done of a sweep compares all settings.
pub(super) fn units(settings: &[Setting], seeds: &[u64]) -> Vec<SweepUnit> {
    let of_seed =
        |&seed: &u64| settings.iter().enumerate().map(move |(place, setting)| (place, setting, seed));
    let unit = |(place, setting, seed): (usize, &Setting, u64)| SweepUnit {
        name: format!("setting-{}-seed-{seed}", place + 1),
        setting: setting.name.clone(),
        seed,
        place,
    };
    seeds.iter().flat_map(of_seed).map(unit).collect()
}

/// What a unit took: the content of its `seconds.json`.
#[derive(Serialize, Deserialize)]
struct UnitSeconds {
    cpu_seconds: f64,
}

impl Sweep<'_> {
    pub(super) fn unit_folder(&self, unit: &SweepUnit) -> PathBuf {
        unit_folder(&self.plan.out, unit)
    }

    /// The results of `unit`; `None` if it is not finished.
    pub(super) fn finished(&self, unit: &SweepUnit) -> Result<Option<FinishedUnit>, Error> {
        let folder = self.unit_folder(unit);
        let Some(results) = unit.read(&folder)? else { return Ok(None) };
        let seconds = files::read_as(&folder.join("seconds.json"), |text| serde_json::from_str(text));
        Ok(Some((results, seconds.ok().map(|seconds: UnitSeconds| seconds.cpu_seconds))))
    }

    /// Executes `unit` from where it is.
    pub(super) fn execute_unit(&self, unit: &SweepUnit, monitor: &dyn Monitor) -> Result<(), Error> {
        let folder = self.unit_folder(unit);
        let is_whole = !folder.exists();
        files::make_folder(&folder)?;
        let (is_virtual, found, kept, seconds) = match &self.settings[unit.place].method {
            Method::Evolve(config) => {
                let plan = EvolvePlan {
                    model: self.plan.model_copy(),
                    out: folder.clone(),
                    seed: unit.seed,
                    resume: true,
                    ..(**config).clone().plan()
                };
                let results = plan.execute(&Part(monitor))?;
                let history = EvolutionHistory::read(&folder.join("history.csv"))?;
                let found = vec![UnitFindings::of_evolution(&results, &history)];
                let kept = ["champion.json", "history.csv"].map(str::to_owned).to_vec();
                (self.is_virtual, found, kept, results.cpu_seconds)
            }
            Method::Replicates(config) => {
                let stopwatch = Stopwatch::start();
                let mut config = (**config).clone();
                config.seed = unit.seed;
                let scenarios =
                    config.scenarios.iter().map(|scenario| format!("{}/judged/plants.csv", scenario.name));
                let kept = scenarios.collect();
                let plan = ReplicatesPlan { out: folder.clone(), resume: true, config };
                let results = plan.execute(monitor)?;
                (true, UnitFindings::of_replicates(&results), kept, stopwatch.cpu_seconds())
            }
        };
        let seconds = is_whole.then_some(seconds);
        if let Some(cpu_seconds) = seconds {
            files::write_json(&folder.join("seconds.json"), &UnitSeconds { cpu_seconds })?;
        }
        let results = UnitRecord {
            schema: UNIT_SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            unit: unit.name.clone(),
            setting: unit.setting.clone(),
            seed: unit.seed,
            is_virtual,
            found,
            sha256: digests(&folder, kept)?,
        };
        // Last: a unit with this file is finished.
        Ok(files::write_json(&folder.join("unit.json"), &results)?)
    }
}

/// The folder of a unit of the sweep in `out`.
pub(crate) fn unit_folder(out: &Path, unit: &SweepUnit) -> PathBuf {
    out.join("units").join(&unit.name)
}

impl SweepUnit {
    /// What it found, from its folder; `None` if it is not finished.
    ///
    /// # Errors
    /// [`Error`] if its file cannot be read, or is of another unit.
    pub(crate) fn read(&self, folder: &Path) -> Result<Option<UnitRecord>, Error> {
        let path = folder.join("unit.json");
        if !path.exists() {
            return Ok(None);
        }
        let results: UnitRecord = files::read_as(&path, |text| serde_json::from_str(text))?;
        if results.setting == self.setting && results.seed == self.seed {
            return Ok(Some(results));
        }
        let found = format!("found the setting {} with seed {}", results.setting, results.seed);
        let wanted = format!("wanted {} with seed {}", self.setting, self.seed);
        Err(FileError::content(&path, format!("{found}, {wanted}")).into())
    }
}

fn digests(folder: &Path, names: Vec<String>) -> Result<BTreeMap<String, String>, Error> {
    let digest = |name: String| {
        let digest = files::sha256(&files::read(&folder.join(&name))?);
        Ok((name, digest))
    };
    names.into_iter().map(digest).collect()
}
