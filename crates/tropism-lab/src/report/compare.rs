//! Evolutions, studies, controllers, methods or the settings of a sweep beside each other: figures, tables and rank tests.

use std::path::Path;

use serde::de::DeserializeOwned;
use tropism::math::statistics::{five_numbers, mean, standard_deviation};
use tropism::task::Task;
use tropism_report::{self as report, ComparedRuns, Figure, Plants, Table};

use super::ReportComparison;
use crate::comparison::{self, NamedSample};
use crate::evolve::{EvolutionHistory, EvolutionRecord, EvolveResults};
use crate::files;
use crate::replicates::{Measures, ReplicatesPlan, ReplicatesResults};
use crate::statistics::Bootstrap;
use crate::study::StudyPlan;
use crate::sweep::{Method, Setting, SweepPlan, UnitFindings, unit_folder};
use crate::transfer::{TransferPlan, TransferResults};
use crate::{Error, Work};

/// Seed of the bootstrap of intervals: they are to be the same in each report.
const SEED: u64 = 1;

/// What evolutions are compared by: the best fitness of a run is that of few plants, so the greatest of many is chosen by chance as well.
const IN_MODEL: &str = "the mean fitness of each run's champion on unseen plants of its model";

/// Things of one kind that are compared.
pub(super) struct Comparison {
    title: String,
    /// What a value is, such as `a run`.
    value: &'static str,
    /// What the values are, such as [`IN_MODEL`].
    values: String,
    plants: Plants,
    groups: Vec<Group>,
}

/// One of the things that are compared.
struct Group {
    name: String,
    /// Best fitness of each generation of each run.
    best: Vec<Vec<f64>>,
    values: Vec<f64>,
    /// Of methods: the mean sum of distances at all targets, in cm, and the share of plants on which the whole task was done, of each
    /// value.
    arrival: [Vec<f64>; 2],
    task: Task,
    /// Digest of the model on which the controllers evolved, where there is one for all.
    model: Option<String>,
}

impl Comparison {
    fn new(title: &str, value: &'static str, values: &str, plants: Plants) -> Self {
        Self { title: title.to_owned(), value, values: values.to_owned(), plants, groups: Vec::new() }
    }

    /// The evolutions in `folders`, by their final values.
    pub(super) fn of_evolutions(folders: &[&Path]) -> Result<Self, Error> {
        let records = folders.iter().map(|folder| EvolutionRecord::read(folder));
        let records: Vec<EvolutionRecord> = records.collect::<Result<_, _>>()?;
        let plants = plants_of(records.iter().any(|record| record.is_virtual));
        let mut all = Self::new("Evolutions compared", "a run", IN_MODEL, plants);
        for ((folder, record), name) in folders.iter().zip(records).zip(short_names(folders)) {
            let history = EvolutionHistory::read(&folder.join("history.csv"))?;
            let values =
                in_model(&files::read_as(&folder.join("summary.json"), |text| serde_json::from_str(text))?);
            let model = Some(record.model_sha256().to_owned());
            all.groups.push(Group { best: history.best, model, ..Group::new(name, values, record.task) });
        }
        Ok(all)
    }

    /// The studies in `folders`: their evolutions, and their champions on unseen virtual plants.
    pub(super) fn of_studies(folders: &[&Path]) -> Result<[Self; 2], Error> {
        let evolutions: Vec<_> = folders.iter().map(|folder| folder.join("evolution")).collect();
        let mut evolutions = Self::of_evolutions(&evolutions.iter().map(AsRef::as_ref).collect::<Vec<_>>())?;
        let mut champions = Self::new(
            "Champions compared",
            "a plant",
            "the fitness of the champion on each unseen plant. Studies of one seed have the same plants, which these tests do \
             not make use of",
            Plants::Virtual,
        );
        for ((folder, name), group) in folders.iter().zip(short_names(folders)).zip(&mut evolutions.groups) {
            group.name.clone_from(&name);
            let path = folder.join("many-plants/transfer.json");
            let many: TransferResults = files::read_as(&path, |text| serde_json::from_str(text))?;
            let champion = many.controllers.into_iter().find(|one| one.name == "champion");
            let values = champion.map(|champion| champion.fitness).unwrap_or_default();
            let task = StudyPlan::of_folder(folder)?.config.task;
            champions.groups.push(Group::new(name, values, task));
        }
        Ok([evolutions, champions])
    }

    /// The settings of the finished sweep in `folder`; of replicates one comparison for each scenario and method.
    pub(super) fn of_sweep(folder: &Path) -> Result<Vec<Self>, Error> {
        let plan = SweepPlan::of_folder(folder)?;
        let settings = plan.config.settings(&plan.folder)?;
        let mut all: Vec<(String, Self)> = Vec::new();
        for unit in plan.units()? {
            let own = unit_folder(folder, &unit);
            let Some(results) = unit.read(&own)? else {
                return Err(Error::Plan(format!(
                    "{}: this sweep is not finished: go on with it by --resume",
                    folder.display()
                )));
            };
            let place = unit.place;
            for found in &results.found {
                if !all.iter().any(|(case, _)| *case == found.case) {
                    all.push((
                        found.case.clone(),
                        Self::of_settings(&found.case, &settings, results.is_virtual),
                    ));
                }
                let comparison = all.iter_mut().find(|(case, _)| *case == found.case);
                let Some((_, comparison)) = comparison else { continue };
                comparison.groups[place].add(found, &settings[place], &own)?;
            }
        }
        Ok(all.into_iter().map(|(_, comparison)| comparison).collect())
    }

    /// The controllers of all transfers in `folders`, by their fitness on each plant.
    pub(super) fn of_transfers(folders: &[&Path]) -> Result<Self, Error> {
        let mut all = Self::new(
            "Controllers compared",
            "a plant",
            "the fitness of each controller on each unseen plant. Controllers of one transfer have the same plants, which these \
             tests do not make use of; its own report does",
            Plants::Virtual,
        );
        for (folder, name) in folders.iter().zip(short_names(folders)) {
            let results: TransferResults = read_results(folder, "transfer.json", "transfer")?;
            let task = TransferPlan::of_folder(folder)?.task;
            for controller in results.controllers {
                let name = if folders.len() > 1 {
                    format!("{} of {name}", controller.name)
                } else {
                    controller.name
                };
                all.groups.push(Group::new(name, controller.fitness, task.clone()));
            }
        }
        Ok(all)
    }

    /// The methods of all comparisons over replicates in `folders`, by the means of their replicates: one comparison for
    /// each scenario. Where a comparison has no methods, the rules by hand of each scenario, by their fitness on each plant.
    pub(super) fn of_replicates(folders: &[&Path]) -> Result<Vec<Self>, Error> {
        let mut all: Vec<(String, Self)> = Vec::new();
        let mut by_hand = Vec::new();
        for (folder, name) in folders.iter().zip(short_names(folders)) {
            let results: ReplicatesResults = read_results(folder, "replicates.json", "study")?;
            let mut tasks = ReplicatesPlan::tasks_of_folder(folder)?;
            for scenario in results.scenarios {
                if scenario.methods.is_empty() {
                    let mut rules = Self::of_transfers(&[&folder.join(&scenario.name).join("judged")])?;
                    rules.title = format!("Rules by hand compared: {}", scenario.name);
                    by_hand.push(rules);
                    continue;
                }
                if !all.iter().any(|(known, _)| *known == scenario.name) {
                    let title = format!("Methods compared: {}", scenario.name);
                    let values = "the mean fitness of each replicate's controller over its test plants";
                    all.push((
                        scenario.name.clone(),
                        Self::new(&title, "a replicate", values, Plants::Virtual),
                    ));
                }
                let comparison = all.iter_mut().find(|(known, _)| *known == scenario.name);
                let (Some((_, comparison)), Some(task)) = (comparison, tasks.remove(&scenario.name)) else {
                    continue;
                };
                for method in scenario.methods {
                    let name =
                        if folders.len() > 1 { format!("{} of {name}", method.name) } else { method.name };
                    let values =
                        method.replicates.iter().map(|replicate| replicate.measures.fitness.mean).collect();
                    let arrival = method.replicates.iter().map(|replicate| {
                        let Measures { distances, done, .. } = replicate.measures;
                        [distances, done].map(|measure| measure.map(|measure| measure.mean))
                    });
                    let mut group = Group::new(name, values, task.clone());
                    arrival.for_each(|values| group.add_arrival(values));
                    comparison.groups.push(group);
                }
            }
        }
        Ok(all.into_iter().map(|(_, comparison)| comparison).chain(by_hand).collect())
    }

    /// A comparison of all `settings`, still without values.
    fn of_settings(case: &str, settings: &[Setting], is_virtual: bool) -> Self {
        let mut comparison = if case.is_empty() {
            Self::new("Settings compared", "a run of a seed", IN_MODEL, plants_of(is_virtual))
        } else {
            let title = format!("Settings compared: {case}");
            Self::new(
                &title,
                "a seed",
                "the mean fitness of each seed over replicates and plants",
                Plants::Virtual,
            )
        };
        let group = |setting: &Setting| {
            let task = match &setting.method {
                Method::Evolve(config) => config.task.clone(),
                Method::Replicates(config) => config.task.clone(),
            };
            Group::new(setting.name.clone(), Vec::new(), task)
        };
        comparison.groups = settings.iter().map(group).collect();
        comparison
    }

    /// Whether all fitness is of one task.
    fn is_alike(&self) -> bool {
        self.groups.windows(2).all(|pair| pair[0].task == pair[1].task)
    }

    /// The unit of all fitness; of tasks with different ones all of them.
    fn unit(&self) -> String {
        let mut units: Vec<&str> = self.groups.iter().map(|group| group.task.kind.unit()).collect();
        units.sort_unstable();
        units.dedup();
        units.join(" or ")
    }

    fn compared(&self) -> Vec<ComparedRuns> {
        let one = |group: &Group| ComparedRuns {
            name: group.name.clone(),
            best: group.best.clone(),
            interval: match group.values.len() {
                0 => [f64::NAN; 2],
                count => Bootstrap::new(SEED, count).interval_of_mean(&group.values),
            },
            values: group.values.clone(),
        };
        self.groups.iter().map(one).collect()
    }

    /// Fitness over the generations, where there are any, and the values.
    pub(super) fn figures(&self) -> Vec<Figure> {
        let (compared, unit) = (self.compared(), self.unit());
        let best =
            self.groups.first().filter(|_| self.is_alike()).and_then(|group| group.task.best_fitness());
        let values = report::values_compared(&compared, &unit, best.unwrap_or(1.0), self.value, self.plants);
        let has_generations = self.groups.iter().any(|group| !group.best.is_empty());
        let over_time =
            has_generations.then(|| report::fitness_compared(&compared, &unit, best, self.plants));
        over_time.into_iter().chain([values]).collect()
    }

    /// The rank tests between each two; none where tasks differ, whose fitness is not alike.
    pub(super) fn results(&self) -> ReportComparison {
        let sample = |group: &Group| NamedSample { name: group.name.clone(), values: group.values.clone() };
        let samples: Vec<NamedSample> = self.groups.iter().map(sample).collect();
        let pairs = if self.is_alike() { comparison::all_pairs(&samples) } else { Vec::new() };
        ReportComparison { title: self.title.clone(), unit: self.unit(), pairs }
    }

    pub(super) fn tables(&self, results: &ReportComparison) -> Vec<Table> {
        let mut tables = vec![self.table()];
        if !results.pairs.is_empty() {
            tables.push(comparison::pair_table(&results.pairs, &self.values, &results.unit));
        }
        tables
    }

    fn table(&self) -> Table {
        // Methods know how near the targets were; evolutions when they saturated.
        let [has_distances, has_done] =
            [0, 1].map(|which| self.groups.iter().any(|group| !group.arrival[which].is_empty()));
        let has_generations = self.groups.iter().any(|group| !group.best.is_empty());
        let row = |group: &Group| {
            let numbers = five_numbers(&group.values).unwrap_or([f64::NAN; 5]);
            let spread = [mean(group.values.iter().copied()), standard_deviation(&group.values)];
            let cells = spread.into_iter().chain(numbers).map(|value| format!("{value:.2}"));
            let saturation = EvolutionHistory { best: group.best.clone(), ..EvolutionHistory::default() };
            let saturation = saturation.saturation(crate::study::SATURATION_SHARE);
            let saturation = saturation.map_or_else(|| "-".to_owned(), |generation| generation.to_string());
            let [distances, done] = group.arrival.each_ref().map(|values| mean(values.iter().copied()));
            [group.name.clone(), group.values.len().to_string()]
                .into_iter()
                .chain(cells)
                .chain(has_distances.then(|| format!("{distances:.2}")))
                .chain(has_done.then(|| format!("{:.0} %", 100.0 * done)))
                .chain(has_generations.then_some(saturation))
                .collect()
        };
        let head = ["", "Values", "Mean", "sd", "Least", "Quartile", "Median", "Quartile", "Greatest"];
        let further = [
            has_distances.then_some("Distances (cm)"),
            has_done.then_some("Whole task"),
            has_generations.then_some("Saturates"),
        ];
        let mut notes = String::new();
        if has_distances {
            notes += " Distances: the sum of those at the crossings of all targets, 10 cm for one whose height was never reached.";
        }
        if has_done {
            notes += " Whole task: the share of plants on which all of it was done. Both are means over plants and values.";
        }
        if has_generations {
            notes += " Saturates: the generation at which the median over runs of the best fitness of a generation comes within 2 % of \
                      its final value.";
        }
        let has_one_model = self.groups.windows(2).all(|pair| pair[0].model == pair[1].model);
        let warning = match (self.is_alike(), has_one_model) {
            (false, _) => " Their tasks differ: this fitness is not alike, and is not tested.",
            (true, false) => " Their models differ: what differs may be the models.",
            (true, true) => "",
        };
        Table {
            title: self.title.clone(),
            caption: format!(
                "In {}: {}.{warning}{notes} {}",
                self.unit(),
                self.values,
                self.plants.sentence()
            ),
            head: head.into_iter().chain(further.into_iter().flatten()).map(str::to_owned).collect(),
            rows: self.groups.iter().map(row).collect(),
        }
    }
}

impl Group {
    fn new(name: String, values: Vec<f64>, task: Task) -> Self {
        Self { name, best: Vec::new(), values, arrival: [Vec::new(), Vec::new()], task, model: None }
    }

    /// Adds distances and share, where they are known.
    fn add_arrival(&mut self, values: [Option<f64>; 2]) {
        self.arrival.iter_mut().zip(values).for_each(|(known, value)| known.extend(value));
    }

    /// Adds what one seed found, whose folder is `own`.
    fn add(&mut self, found: &UnitFindings, setting: &Setting, own: &Path) -> Result<(), Error> {
        self.values.extend(found.compared());
        self.add_arrival([found.distances, found.done]);
        if matches!(setting.method, Method::Evolve(_)) {
            self.best.extend(EvolutionHistory::read(&own.join("history.csv"))?.best);
        }
        Ok(())
    }
}

/// The results in `folder`, whose `command` may not have ended yet.
fn read_results<T: DeserializeOwned>(folder: &Path, name: &str, command: &str) -> Result<T, Error> {
    let path = folder.join(name);
    if !path.exists() {
        return Err(Error::Plan(format!(
            "{}: there is no {name} yet: finish the comparison by `tropism {command} --out {} --resume`",
            folder.display(),
            files::shell_word(folder)
        )));
    }
    Ok(files::read_as(&path, |text| serde_json::from_str(text))?)
}

const fn plants_of(is_virtual: bool) -> Plants {
    if is_virtual { Plants::ModelOfVirtual } else { Plants::ModelOfReal }
}

fn in_model(results: &EvolveResults) -> Vec<f64> {
    results.runs.iter().map(|run| run.trial.mean).collect()
}

/// The last parts of the folders' paths, as many as tell them apart.
fn short_names(folders: &[&Path]) -> Vec<String> {
    let name = |folder: &Path, count: usize| {
        let parts: Vec<_> = folder.iter().map(|part| part.to_string_lossy()).collect();
        parts[parts.len().saturating_sub(count)..].join("/")
    };
    let longest = folders.iter().map(|folder| folder.iter().count()).max().unwrap_or(1);
    let named = |count| folders.iter().map(|folder| name(folder, count)).collect::<Vec<_>>();
    let tells_apart =
        |names: &Vec<String>| names.iter().enumerate().all(|(place, name)| !names[..place].contains(name));
    (1..=longest).map(named).find(tells_apart).unwrap_or_else(|| named(longest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_as_long_as_tells_folders_apart() {
        let names = |folders: &[&str]| short_names(&folders.iter().map(Path::new).collect::<Vec<_>>());
        assert_eq!(names(&["work/a", "work/b"]), ["a", "b"]);
        assert_eq!(names(&["one/evolution", "two/evolution"]), ["one/evolution", "two/evolution"]);
        assert_eq!(names(&["same", "same"]), ["same", "same"]);
    }
}
