//! What a unit of work found, and the table of a sweep.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Value;
use tropism::math::statistics::{five_numbers, mean, median, standard_deviation};
use tropism::text::csv_cell;

use super::config::{Method, Setting};
use crate::comparison::{self, NamedSample, SamplePair};
use crate::evolve::{EvolutionHistory, EvolveResults};
use crate::replicates::ReplicatesResults;
use crate::study::SATURATION_SHARE;

/// What one unit of work found: the content of its `unit.json`. The same bits on every machine. Fitness is in cm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitRecord {
    /// `tropism.sweep-unit/1`.
    pub schema: String,
    /// Version of the software.
    pub version: String,
    /// Its name, which is that of its folder: `setting-1-seed-1`.
    pub unit: String,
    /// Name of its setting.
    pub setting: String,
    /// Its seed.
    pub seed: u64,
    /// Whether the plants were virtual, or a model of such.
    pub is_virtual: bool,
    /// What it found: one entry for an evolution, one for each method in each scenario for replicates.
    pub found: Vec<UnitFindings>,
    /// SHA-256 of the files that hold it, in hexadecimal.
    pub sha256: BTreeMap<String, String>,
}

/// What one unit of work found of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnitFindings {
    /// Scenario and method of replicates, such as `common-bean/rule`; empty for an evolution.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub case: String,
    /// Of an evolution the best fitness of each run; of a method its mean fitness over replicates and plants.
    pub fitness: Vec<f64>,
    /// Of an evolution the mean fitness of each run's champion on unseen plants of the model.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mean_in_model: Vec<f64>,
    /// Generation at which the median over runs of the best fitness of a generation comes within 2 % of its final value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturation_generation: Option<usize>,
    /// Evaluated genomes of all runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evaluations: Option<u64>,
    /// Of a method the mean sum of the distances at the crossings of all targets, in cm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distances: Option<f64>,
    /// Of a method the share of plants on which the whole task was done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done: Option<f64>,
}

impl UnitFindings {
    /// The values by which settings are compared. Of an evolution those on unseen plants: the best fitness of a run is that of
    /// as few plants as its setting says, so the greatest of many is chosen by chance as well.
    pub(crate) fn compared(&self) -> &[f64] {
        if self.mean_in_model.is_empty() { &self.fitness } else { &self.mean_in_model }
    }

    pub(super) fn of_evolution(results: &EvolveResults, history: &EvolutionHistory) -> Self {
        Self {
            case: String::new(),
            fitness: results.runs.iter().map(|run| run.best_fitness).collect(),
            mean_in_model: results.runs.iter().map(|run| run.trial.mean).collect(),
            saturation_generation: history.saturation(SATURATION_SHARE),
            evaluations: Some(results.evaluations),
            distances: None,
            done: None,
        }
    }

    pub(super) fn of_replicates(results: &ReplicatesResults) -> Vec<Self> {
        let of_scenario = results.scenarios.iter().flat_map(|scenario| {
            scenario.methods.iter().map(|method| Self {
                case: format!("{}/{}", scenario.name, method.name),
                fitness: vec![method.measures.fitness.mean],
                mean_in_model: Vec::new(),
                saturation_generation: None,
                evaluations: None,
                distances: method.measures.distances.map(|distances| distances.mean),
                done: method.measures.done.map(|done| done.mean),
            })
        });
        of_scenario.collect()
    }
}

/// A finished unit, with the processor time that it took, in s; `None` if it was interrupted on its way.
pub(super) type FinishedUnit = (UnitRecord, Option<f64>);

/// The table of a sweep: the content of `sweep.json`. Fitness is in cm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepResults {
    /// `tropism.sweep/1`.
    pub schema: String,
    /// Version of the software.
    pub version: String,
    /// Whether the plants were virtual, or models of such.
    pub is_virtual: bool,
    /// The seeds.
    pub seeds: Vec<u64>,
    /// One row a setting; with replicates one a setting, scenario and method.
    pub rows: Vec<SweepRow>,
    /// Each two settings compared by the mean fitness of each run's champion on unseen plants of the model; with replicates by
    /// the fitness of each seed, within a scenario and method. None where tasks differ, whose fitness is not alike.
    pub pairs: Vec<SettingPair>,
}

/// A setting over all seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRow {
    /// Name of the setting.
    pub setting: String,
    /// Its value for each key of the grid.
    pub values: BTreeMap<String, Value>,
    /// Scenario and method of replicates; empty for evolutions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub case: String,
    /// Number of seeds.
    pub seeds: usize,
    /// Number of values that the next ones summarize: runs of all seeds, or with replicates one a seed.
    pub runs: usize,
    /// Mean of the best fitness of each run; with replicates of the fitness of each seed.
    pub mean: f64,
    /// Sample standard deviation.
    pub sd: f64,
    /// Least value, lower quartile, median, upper quartile and greatest value.
    pub five_numbers: [f64; 5],
    /// Mean fitness of the champions of the runs on unseen plants of the model; `None` for replicates.
    pub mean_in_model: Option<f64>,
    /// Median over seeds of the generation of saturation; `None` for replicates.
    pub saturation_generation: Option<f64>,
    /// Mean number of evaluated genomes of a seed; `None` for replicates.
    pub evaluations: Option<f64>,
    /// Mean over seeds of the sum of the distances at the crossings of all targets, in cm; `None` for evolutions and without targets.
    pub distances: Option<f64>,
    /// Mean over seeds of the share of plants on which the whole task was done; `None` for evolutions, and where the task does not say
    /// what that is.
    pub done: Option<f64>,
    /// Mean processor time of a seed, in s, over those that were not interrupted; `None` if all were.
    pub cpu_seconds: Option<f64>,
}

/// Two settings compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingPair {
    /// Scenario and method of replicates; empty for evolutions.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub case: String,
    /// The comparison.
    #[serde(flatten)]
    pub pair: SamplePair,
}

/// The finished units of one setting, of one scenario and method.
struct Group<'u> {
    setting: &'u Setting,
    case: String,
    found: Vec<(&'u UnitFindings, Option<f64>)>,
}

impl Group<'_> {
    fn values(&self, of: fn(&UnitFindings) -> &[f64]) -> Vec<f64> {
        self.found.iter().flat_map(|(found, _)| of(found).iter().copied()).collect()
    }

    fn row(&self) -> SweepRow {
        let fitness = self.values(|found| &found.fitness);
        let in_model = self.values(|found| &found.mean_in_model);
        let of = |value: fn(&UnitFindings) -> Option<f64>| {
            let values: Vec<f64> = self.found.iter().filter_map(|(found, _)| value(found)).collect();
            (!values.is_empty()).then_some(values)
        };
        let seconds: Vec<f64> = self.found.iter().filter_map(|(_, seconds)| *seconds).collect();
        SweepRow {
            setting: self.setting.name.clone(),
            values: self.setting.values.iter().cloned().collect(),
            case: self.case.clone(),
            seeds: self.found.len(),
            runs: fitness.len(),
            mean: mean(fitness.iter().copied()),
            sd: standard_deviation(&fitness),
            five_numbers: five_numbers(&fitness).unwrap_or([f64::NAN; 5]),
            mean_in_model: (!in_model.is_empty()).then(|| mean(in_model)),
            saturation_generation: of(|found| found.saturation_generation.map(|at| at as f64))
                .map(|values| median(&values)),
            evaluations: of(|found| found.evaluations.map(|count| count as f64)).map(mean),
            distances: of(|found| found.distances).map(mean),
            done: of(|found| found.done).map(mean),
            cpu_seconds: (!seconds.is_empty()).then(|| mean(seconds)),
        }
    }
}

impl SweepResults {
    /// The table of `units`, given in the order of the plan: for each seed one of each of `settings`.
    pub(super) fn new(schema: &str, seeds: Vec<u64>, settings: &[Setting], units: &[FinishedUnit]) -> Self {
        let cases: Vec<&str> = units
            .first()
            .map_or_else(Vec::new, |(unit, _)| unit.found.iter().map(|found| found.case.as_str()).collect());
        let group = |place: usize, case: usize| Group {
            setting: &settings[place],
            case: cases[case].to_owned(),
            found: (units.iter().skip(place).step_by(settings.len()))
                .filter_map(|(unit, seconds)| Some((unit.found.get(case)?, *seconds)))
                .collect(),
        };
        let cases: Vec<Vec<Group<'_>>> = (0..cases.len())
            .map(|case| (0..settings.len()).map(|place| group(place, case)).collect())
            .collect();
        let pairs = if has_one_task(settings) {
            cases.iter().flat_map(|groups| compared(groups)).collect()
        } else {
            Vec::new()
        };
        Self {
            schema: schema.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: units.iter().any(|(unit, _)| unit.is_virtual),
            seeds,
            rows: cases.iter().flatten().map(Group::row).collect(),
            pairs,
        }
    }

    /// The rows as CSV, one column a key of the grid.
    pub(super) fn csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let keys: Vec<&String> = self.rows.first().map_or_else(Vec::new, |row| row.values.keys().collect());
        let head = [
            "setting",
            "case",
            "seeds",
            "runs",
            "mean_cm",
            "sd_cm",
            "least_cm",
            "quartile_1_cm",
            "median_cm",
        ];
        let further = [
            "quartile_3_cm",
            "greatest_cm",
            "mean_in_model_cm",
            "saturation_generation",
            "evaluations",
            "distances_cm",
            "done_share",
            "cpu_seconds",
        ];
        table
            .write_record(head.iter().chain(&further).copied().chain(keys.iter().map(|key| key.as_str())))?;
        let or_empty = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        for row in &self.rows {
            let start = [csv_cell(&row.setting).into_owned(), csv_cell(&row.case).into_owned()];
            let counts = [row.seeds.to_string(), row.runs.to_string()];
            let spread =
                [row.mean, row.sd].into_iter().chain(row.five_numbers).map(|value| value.to_string());
            let further = [
                row.mean_in_model,
                row.saturation_generation,
                row.evaluations,
                row.distances,
                row.done,
                row.cpu_seconds,
            ];
            let values = keys.iter().map(|key| match &row.values[*key] {
                Value::String(text) => csv_cell(text).into_owned(),
                other => csv_cell(&other.to_string()).into_owned(),
            });
            let cells =
                start.into_iter().chain(counts).chain(spread).chain(further.map(or_empty)).chain(values);
            table.write_record(cells)?;
        }
        table.into_inner().map_err(|error| error.into_error().into())
    }
}

/// Whether the fitness of all settings is of one task.
pub(super) fn has_one_task(settings: &[Setting]) -> bool {
    let tasks = settings.iter().map(|setting| match &setting.method {
        Method::Evolve(config) => &config.task,
        Method::Replicates(config) => &config.task,
    });
    tasks.clone().zip(tasks.skip(1)).all(|(one, other)| one == other)
}

fn compared(groups: &[Group<'_>]) -> Vec<SettingPair> {
    let sample = |group: &Group<'_>| NamedSample {
        name: group.setting.name.clone(),
        values: group.values(UnitFindings::compared),
    };
    let pairs = comparison::all_pairs(&groups.iter().map(sample).collect::<Vec<_>>());
    let case = groups.first().map_or("", |group| group.case.as_str());
    pairs.into_iter().map(|pair| SettingPair { case: case.to_owned(), pair }).collect()
}
