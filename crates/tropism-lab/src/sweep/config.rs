//! A sweep file: seeds, settings that vary, and what all settings share.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::evolve::{EvolveConfig, EvolvePlan};
use crate::replicates::ReplicatesConfig;
use crate::{Error, Workflow, files};

/// The most settings and the most seeds; chosen, against mistyped grids.
const MOST: usize = 10_000;

/// Longest value in the name of a setting, in characters; a longer one is named by its number. Chosen by hand.
const LONGEST_VALUE: usize = 24;

/// The seeds of a sweep: each setting has one unit of work with each of them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Seeds {
    /// The seeds 1 to this number.
    Count(u32),
    /// These seeds.
    List(Vec<u64>),
}

impl Seeds {
    /// How many there are.
    fn count(&self) -> usize {
        match self {
            Self::Count(count) => *count as usize,
            Self::List(seeds) => seeds.len(),
        }
    }

    /// The seeds in order.
    #[must_use]
    pub fn list(&self) -> Vec<u64> {
        match self {
            Self::Count(count) => (1..=u64::from(*count)).collect(),
            Self::List(seeds) => seeds.clone(),
        }
    }
}

/// Everything that decides the results of a sweep: the content of a file such as `studies/sweep.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct SweepConfig {
    /// File of the model on which controllers evolve.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// The seeds.
    pub seeds: Seeds,
    /// Settings that vary: for each key a list of values. All combinations are tried, in the order of the keys'
    /// letters and of the values in the file.
    #[cfg_attr(feature = "schema", schemars(with = "std::collections::BTreeMap<String, serde_json::Value>"))]
    pub grid: Table,
    /// What all evolutions share: keys of `studies/evolution.toml` but the seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<EvolveConfig>"))]
    pub evolve: Option<Table>,
    /// What all studies of replicates share, instead of evolutions: keys of `studies/robust.toml` but the seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schema", schemars(with = "Option<ReplicatesConfig>"))]
    pub replicates: Option<Table>,
}

impl Default for SweepConfig {
    fn default() -> Self {
        Self { model: None, seeds: Seeds::Count(10), grid: Table::new(), evolve: None, replicates: None }
    }
}

/// What a unit of work executes, but for its seed and its folder.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// An evolution with all its runs.
    Evolve(Box<EvolveConfig>),
    /// A study of replicates.
    Replicates(Box<ReplicatesConfig>),
}

/// One combination of the values that vary.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Its values in a few words, such as `population=50, episodes=4`.
    pub name: String,
    /// Keys and values, in the order of the grid.
    pub values: Vec<(String, Value)>,
    /// What is executed under it.
    pub method: Method,
}

impl Setting {
    /// Generations of all runs of an evolution under it; 0 for replicates.
    pub(super) fn generations(&self) -> u64 {
        match &self.method {
            Method::Evolve(config) => {
                u64::from(config.evolution.runs) * u64::from(config.evolution.generations)
            }
            Method::Replicates(_) => 0,
        }
    }
}

impl SweepConfig {
    /// Reads a sweep file.
    ///
    /// # Errors
    /// [`Error`] names the file, the key, what was found and what was wanted.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let config: Self = files::read_toml(path)?;
        config.settings(path.parent().unwrap_or(Path::new(""))).map_err(Error::at(path.display()))?;
        Ok(config)
    }

    /// Whether the units of work are studies of replicates, and no evolutions.
    #[must_use]
    pub const fn is_of_replicates(&self) -> bool {
        self.replicates.is_some()
    }

    /// All settings, the values of the last key of the grid varying first. `folder` is where the files lie that it names.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key and the value that are refused.
    pub fn settings(&self, folder: &Path) -> Result<Vec<Setting>, Error> {
        self.check_shape()?;
        let grid = self.varied()?;
        for (key, values) in &grid {
            for value in values {
                // Each value by itself first: what is refused then is this one.
                self.method(&[(key.clone(), value.clone())], folder)
                    .map_err(Error::in_plan(&format!("grid: {key} = {value}")))?;
            }
        }
        let mut all: Vec<Vec<usize>> = vec![Vec::new()];
        for (_, values) in &grid {
            let longer = |chosen: &Vec<usize>, value: usize| [&chosen[..], &[value]].concat();
            all = all
                .iter()
                .flat_map(|chosen| (0..values.len()).map(move |value| longer(chosen, value)))
                .collect();
        }
        all.iter().map(|chosen| self.setting(&grid, chosen, folder)).collect()
    }

    /// The keys of the grid, with dots from table to table, and the values of each.
    fn varied(&self) -> Result<Vec<(String, Vec<Value>)>, Error> {
        let mut found = Vec::new();
        flatten(&self.grid, "", &mut found)?;
        // TOML is written in another order than it was read in: units must keep their settings.
        found.sort_by(|(one, _), (other, _)| one.cmp(other));
        let settings =
            found.iter().fold(1_usize, |settings, (_, values)| settings.saturating_mul(values.len()));
        if settings > MOST {
            return Err(Error::Plan(format!("grid: found {settings} combinations, wanted at most {MOST}")));
        }
        Ok(found)
    }

    fn check_shape(&self) -> Result<(), Error> {
        let refuse = |text: String| Err(Error::Plan(text));
        if self.evolve.is_some() && self.replicates.is_some() {
            return refuse("[evolve] and [replicates] stand both here: keep one".to_owned());
        }
        if self.is_of_replicates() && self.model.is_some() {
            return refuse("found `model` with [replicates], which make models of their own".to_owned());
        }
        // Before they are listed: the number of a file may be any.
        let count = self.seeds.count();
        if count == 0 || count > MOST {
            return refuse(format!("found {count} seeds, wanted 1 to {MOST}"));
        }
        let seeds = self.seeds.list();
        if let Some(seed) = seeds.iter().find(|seed| seeds.iter().filter(|other| other == seed).count() > 1) {
            return refuse(format!("seed {seed} stands twice in seeds"));
        }
        if let Some(seed) = seeds.iter().find(|&&seed| i64::try_from(seed).is_err()) {
            return refuse(format!("found seed {seed}, wanted at most {}", i64::MAX));
        }
        let base = self.evolve.as_ref().or(self.replicates.as_ref());
        if self.grid.contains_key("seed") || base.is_some_and(|base| base.contains_key("seed")) {
            return refuse("the key seed stands among the settings: write `seeds`".to_owned());
        }
        Ok(())
    }

    /// The setting with the value of this number for each key of the grid.
    fn setting(
        &self,
        grid: &[(String, Vec<Value>)],
        chosen: &[usize],
        folder: &Path,
    ) -> Result<Setting, Error> {
        let choices =
            || grid.iter().zip(chosen).map(|((key, values), &number)| (key, number, &values[number]));
        let values: Vec<(String, Value)> =
            choices().map(|(key, _, value)| (key.clone(), value.clone())).collect();
        let words = choices().map(|(key, number, value)| {
            let text = match value {
                Value::String(text) => text.clone(),
                other => other.to_string(),
            };
            let is_short = text.chars().count() <= LONGEST_VALUE;
            format!("{}={}", short(grid, key), if is_short { text } else { format!("#{}", number + 1) })
        });
        let name = words.collect::<Vec<_>>().join(", ");
        let name = if name.is_empty() { "as given".to_owned() } else { name };
        let method = self.method(&values, folder).map_err(Error::in_plan(&name))?;
        Ok(Setting { name, values, method })
    }

    /// What is executed with these values.
    fn method(&self, values: &[(String, Value)], folder: &Path) -> Result<Method, Error> {
        let mut table = self.evolve.clone().or_else(|| self.replicates.clone()).unwrap_or_default();
        for (key, value) in values {
            set(&mut table, key, value)?;
        }
        if self.is_of_replicates() {
            let mut config: ReplicatesConfig = parsed(table)?;
            config.find_files_in(folder);
            config.check()?;
            if config.methods.is_empty() {
                return Err(Error::Plan("`methods` is empty: name at least one to compare".to_owned()));
            }
            return Ok(Method::Replicates(Box::new(config)));
        }
        let config: EvolveConfig = parsed(table)?;
        EvolvePlan { model: PathBuf::new(), ..config.clone().plan() }.check()?;
        Ok(Method::Evolve(Box::new(config)))
    }
}

/// Adds the lists of values in `table` to `found`, each with its key after `start`.
fn flatten(table: &Table, start: &str, found: &mut Vec<(String, Vec<Value>)>) -> Result<(), Error> {
    for (key, value) in table {
        let key = format!("{start}{key}");
        match value {
            Value::Table(inner) => flatten(inner, &format!("{key}."), found)?,
            Value::Array(values) if !values.is_empty() => {
                if let Some(twice) = repeated(values) {
                    let wanted = "wanted each value once";
                    return Err(Error::Plan(format!("grid: found {twice} twice for {key}, {wanted}")));
                }
                found.push((key, values.clone()));
            }
            other => {
                let wanted = "wanted a list of values, such as [25, 50, 100]";
                return Err(Error::Plan(format!("grid: found {key} = {other}, {wanted}")));
            }
        }
    }
    Ok(())
}

/// The last part of a key of the grid, or all of it where another key ends alike.
fn short<'k>(grid: &[(String, Vec<Value>)], key: &'k str) -> &'k str {
    let last = |key: &str| key.rfind('.').map_or(0, |dot| dot + 1);
    let alike = grid.iter().filter(|(other, _)| other[last(other)..] == key[last(key)..]).count();
    if alike > 1 { key } else { &key[last(key)..] }
}

fn repeated(values: &[Value]) -> Option<&Value> {
    values.iter().enumerate().find(|(place, value)| values[..*place].contains(value)).map(|(_, value)| value)
}

fn parsed<T: DeserializeOwned>(table: Table) -> Result<T, Error> {
    Value::Table(table)
        .try_into()
        .map_err(|error: toml::de::Error| Error::Plan(error.to_string().trim_end().replace("\n", " ")))
}

/// Sets the value at `key`, whose parts stand for tables in tables; in a list of tables the part is the name of one.
fn set(table: &mut Table, key: &str, value: &Value) -> Result<(), Error> {
    let Some((first, rest)) = key.split_once('.') else {
        table.insert(key.to_owned(), value.clone());
        return Ok(());
    };
    let inner = table.entry(first).or_insert_with(|| Value::Table(Table::new()));
    match inner {
        Value::Table(inner) => set(inner, rest, value),
        Value::Array(list) => {
            let Some((name, rest)) = rest.split_once('.') else {
                return Err(Error::Plan(format!("found {first}, a list of tables, wanted {first}.NAME.KEY")));
            };
            let is_named = |item: &&mut Table| item.get("name").and_then(Value::as_str) == Some(name);
            let named = list.iter_mut().filter_map(Value::as_table_mut).find(is_named);
            let named = named.ok_or_else(|| Error::Plan(format!("there is no table {name} in {first}")))?;
            set(named, rest, value)
        }
        other => {
            Err(Error::Plan(format!("found {first} = {other}, wanted a table, for it stands before a dot")))
        }
    }
}
