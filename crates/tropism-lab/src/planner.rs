//! Controllers that plan, as data and as files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tropism::control::{Planner, PlannerConfig, TargetOutlook, outlook};
use tropism::evolve::TunedRule;
use tropism::lamps::Layout;
use tropism::plant::PlantModel;
use tropism::task::Task;
use tropism::track::Sample;

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
    /// The model of the plant on which it tries it; as data, the text of its file.
    model: Model,
}

/// A planner file, such as `planner.toml`.
#[derive(Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PlannerFile {
    /// File of the model, from the folder of this file on.
    pub model: PathBuf,
    /// File of a tuned rule, from that folder on, in place of the rule of `planner`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rule: Option<PathBuf>,
    #[serde(default)]
    /// What the planner tries, and how often.
    pub planner: PlannerConfig,
}

impl PlannerSpec {
    /// Reads a planner file, or the model in a file, on which a planner with the default settings plans.
    ///
    /// # Errors
    /// [`Error`] names the file, what was found and what was wanted.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        if path.extension().is_none_or(|extension| extension != "toml") {
            return Ok(Self { planner: PlannerConfig::default(), model: model::read(path)? });
        }
        let PlannerFile { model, rule, mut planner } = files::read_toml(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        if let Some(rule) = rule.map(|rule| folder.join(rule)) {
            planner.rule = files::read_as(&rule, TunedRule::from_json)?.rule;
        }
        planner.check().map_err(|error| FileError::content(path, error.in_table("planner").to_string()))?;
        Ok(Self { planner, model: model::read(&folder.join(model))? })
    }

    pub(crate) fn layout(&self) -> &Layout {
        self.model.layout()
    }

    pub(crate) fn period_min(&self) -> f64 {
        self.model.period_min()
    }

    /// What is known of each target of `task` of the plant whose past is `samples`, at least one, on so many simulated `plants`.
    pub(crate) fn outlook(&self, task: &Task, samples: &[Sample], plants: u32) -> Vec<TargetOutlook> {
        outlook(&self.model, task, self.planner.rule, samples, plants, self.planner.seed)
    }

    /// The controller for `task`.
    ///
    /// # Panics
    /// If the settings were not checked.
    pub(crate) fn controller(&self, task: &Task) -> Planner<Model> {
        Planner::new(Arc::new(self.model.clone()), task.clone(), self.planner.clone())
            .expect("settings that were checked")
    }
}
