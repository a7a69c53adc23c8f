//! Controllers that plan, as data and as files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use tropism::control::{Planner, PlannerConfig};
use tropism::evolve::TunedRule;
use tropism::lamps::Layout;
use tropism::plant::PlantModel;
use tropism::task::Task;

use crate::Error;
use crate::files::{self, FileError};
use crate::model::{self, Model};

/// A planner as data, with its whole model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannerSpec {
    /// What it tries, and how often.
    #[serde(default)]
    pub planner: PlannerConfig,
    /// The model of the plant on which it tries it.
    model: PlannerModel,
}

/// A model of any kind; as data, the text of its file.
#[derive(Clone, Debug, PartialEq)]
struct PlannerModel(Arc<Model>);

impl Serialize for PlannerModel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.to_json().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for PlannerModel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Model::from_json(&text).map(Self::from).map_err(de::Error::custom)
    }
}

impl From<Model> for PlannerModel {
    fn from(model: Model) -> Self {
        Self(Arc::new(model))
    }
}

/// A planner file, such as `planner.toml`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlannerFile {
    /// File of the model, from the folder of this file on.
    pub(crate) model: PathBuf,
    /// File of a tuned rule, from that folder on, in place of the rule of `planner`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) rule: Option<PathBuf>,
    #[serde(default)]
    pub(crate) planner: PlannerConfig,
}

impl PlannerSpec {
    /// Reads a planner file, or the model in a file, on which a planner with the default settings plans.
    ///
    /// # Errors
    /// [`Error`] names the file, what was found and what was wanted.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        if path.extension().is_none_or(|extension| extension != "toml") {
            return Ok(Self { planner: PlannerConfig::default(), model: model::read(path)?.into() });
        }
        let PlannerFile { model, rule, mut planner } = files::read_toml(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        if let Some(rule) = rule.map(|rule| folder.join(rule)) {
            planner.rule = files::read_as(&rule, TunedRule::from_json)?.rule;
        }
        planner.check().map_err(|error| FileError::content(path, error.in_table("planner").to_string()))?;
        Ok(Self { planner, model: model::read(&folder.join(model))?.into() })
    }

    pub(crate) fn layout(&self) -> &Layout {
        self.model.0.layout()
    }

    pub(crate) fn period_min(&self) -> f64 {
        self.model.0.period_min()
    }

    /// The controller for `task`.
    ///
    /// # Panics
    /// If the settings were not checked.
    pub(crate) fn controller(&self, task: &Task) -> Planner<Model> {
        Planner::new(Arc::clone(&self.model.0), task.clone(), self.planner.clone())
            .expect("settings that were checked")
    }
}
