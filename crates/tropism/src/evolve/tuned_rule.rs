//! A tuned rule as a JSON file, schema `tropism.rule/1`: it steers as it did when it was tuned wherever the file goes.

use serde::{Deserialize, Serialize};

use super::champion::Trial;
use crate::check::{OutOfRange, ensure};
use crate::control::{PredictiveGreedy, PredictiveRule};
use crate::file::{schema_of, sha256, without_schema};
use crate::lamps::Layout;
use crate::plant::PlantModel;
use crate::task::Task;

/// What a rule file calls itself.
const SCHEMA: &str = "tropism.rule/1";

/// A rule with all that it was tuned for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TunedRule {
    /// The numbers.
    pub rule: PredictiveRule,
    /// The lamps that it lights.
    pub layout: Layout,
    /// Minutes of a step.
    pub period_min: f64,
    /// The task that it was tuned for; `None` for tasks outside this library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub task: Option<Task>,
    /// SHA-256 of the model's JSON, in hexadecimal; `None` if it was tuned on virtual plants themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_sha256: Option<String>,
    /// Whether the model was made of virtual plants.
    pub is_virtual: bool,
    /// Fitness on unseen plants of the model, in cm; `None` where the model allows no expectation for unseen plants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Trial>,
}

/// Why bytes are not a rule.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TunedRuleError {
    /// Not JSON, or not of a rule's form.
    #[error("found no rule: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("found schema {0:?}, wanted {SCHEMA:?}")]
    Schema(String),
    /// A value out of its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
}

impl TunedRule {
    /// A rule that was tuned on `model`, of which `model_json` is the file, without a task.
    #[must_use]
    pub fn of_model<M: PlantModel>(
        rule: PredictiveRule,
        model: &M,
        model_json: &str,
        is_virtual: bool,
        expected: Option<Trial>,
    ) -> Self {
        Self {
            rule,
            layout: model.layout().clone(),
            period_min: model.period_min(),
            task: None,
            model_sha256: Some(sha256(model_json)),
            is_virtual,
            expected,
        }
    }

    /// The controller, at rest, towards the targets of `task`.
    #[must_use]
    pub fn controller(&self, task: &Task) -> PredictiveGreedy {
        PredictiveGreedy::new(self.rule, task, &self.layout)
    }

    /// Checks the numbers and the task.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.rule.check().map_err(|error| error.in_table("rule"))?;
        let is_period = self.period_min > 0.0 && self.period_min.is_finite();
        ensure(is_period, "period_min", self.period_min, "minutes above 0")?;
        self.task.as_ref().map_or(Ok(()), Task::check).map_err(|error| error.in_table("task"))
    }

    /// JSON, schema `tropism.rule/1`; see `docs/reference/controllers.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut file = serde_json::to_value(self).expect("numbers and text are JSON");
        file["schema"] = SCHEMA.into();
        serde_json::to_string_pretty(&file).expect("numbers and text are JSON") + "\n"
    }

    /// Whether `text` calls itself a rule, of any version.
    #[must_use]
    pub fn is_named_in(text: &str) -> bool {
        schema_of(text).is_ok_and(|schema| schema.starts_with("tropism.rule/"))
    }

    /// Reads [`Self::to_json`].
    ///
    /// # Errors
    /// [`TunedRuleError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, TunedRuleError> {
        let schema = schema_of(text)?;
        if schema != SCHEMA {
            return Err(TunedRuleError::Schema(schema));
        }
        let rule: Self = without_schema(text)?;
        rule.check()?;
        Ok(rule)
    }
}
