//! Controllers that plan, as data and as files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use tropism::control::{Planner, PlannerConfig};
use tropism::evolve::TunedRule;
use tropism::lamps::Layout;
use tropism::plant::PlantModel;
use tropism::task::TaskSpec;

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
    pub(crate) fn controller(&self, task: &TaskSpec) -> Planner<Model, TaskSpec> {
        Planner::new(Arc::clone(&self.model.0), task.clone(), self.planner.clone())
            .expect("settings that were checked")
    }
}

#[cfg(test)]
mod tests {
    use tropism::control::{Controller, PredictiveRule};
    use tropism::environment::unwatched;
    use tropism::geometry::Point;
    use tropism::greenhouse::bean::{Species, Trial};
    use tropism::observation::Observation;
    use tropism::plant::memory::MemoryModel;
    use tropism::task::{OpenLoop, Task};

    use super::*;
    use crate::ControllerSpec;

    /// A folder with `model.json`, the model of a virtual bean's tip.
    fn folder_of_model() -> (tempfile::TempDir, MemoryModel) {
        let species = Species::default();
        let trial = Trial::new(&species);
        let task = OpenLoop { steps: 300, ..OpenLoop::default() };
        let mut controller = ControllerSpec::periodic(90.0).build(&task.clone().into(), &trial.layout, 5.0);
        let tracks = [trial.grow(1, &mut controller, &task, &mut unwatched)];
        let model = MemoryModel::fit(&tracks).unwrap();
        let folder = tempfile::tempdir().unwrap();
        files::write(&folder.path().join("model.json"), model.to_json().as_bytes()).unwrap();
        (folder, model)
    }

    #[test]
    fn a_planner_comes_back_with_its_model_and_decides_as_before() {
        let (folder, _) = folder_of_model();
        let spec = ControllerSpec::read(&folder.path().join("model.json")).unwrap();
        assert_eq!((spec.description(), spec.own_period_min()), ("planner".to_owned(), Some(5.0)));
        let again: ControllerSpec = toml::from_str(&toml::to_string(&spec).unwrap()).unwrap();
        assert_eq!(again, spec);
        let task = TaskSpec::default();
        let decided = |spec: &ControllerSpec| {
            let mut controller = spec.build(&task, &Layout::default(), 5.0);
            let tips = (0..5).map(|step| Point::new(0.1 * f64::from(step), 5.0 + 0.03 * f64::from(step)));
            tips.map(|tip| controller.decide(&Observation::simulated(tip))).collect::<Vec<_>>()
        };
        assert_eq!(decided(&again), decided(&spec));
        assert!(task.has_goal());
    }

    #[test]
    fn a_planner_file_names_its_model_and_its_rule() {
        let (folder, model) = folder_of_model();
        let path = folder.path().join("planner.toml");
        let rule = PredictiveRule { shift_steps: 4.0, ..PredictiveRule::default() };
        let tuned = TunedRule::of_model(rule, &model, &model.to_json(), true, None);
        files::write(&folder.path().join("rule.json"), tuned.to_json().as_bytes()).unwrap();
        let text = "model = \"model.json\"\nrule = \"rule.json\"\n[planner]\nplants = 7\n";
        files::write(&path, text.as_bytes()).unwrap();
        let ControllerSpec::Plan(spec) = ControllerSpec::read(&path).unwrap() else { panic!("a planner") };
        assert_eq!((spec.planner.plants, spec.planner.rule), (7, rule));

        for (text, words) in [
            ("model = \"absent.json\"", "absent.json"),
            ("model = \"rule.json\"", "rule.json"),
            ("model = \"model.json\"\nrule = \"model.json\"", "wanted \"tropism.rule/1\""),
            ("model = \"model.json\"\n[planner]\nplants = 1", "planner.plants = 1"),
            ("model = \"model.json\"\nplnner = 1", "plnner"),
        ] {
            files::write(&path, text.as_bytes()).unwrap();
            let error = ControllerSpec::read(&path).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_planner_is_for_the_lamps_and_the_interval_of_its_model() {
        let (folder, _) = folder_of_model();
        let spec = ControllerSpec::read(&folder.path().join("model.json")).unwrap();
        spec.check(&Layout::default(), 5.0).unwrap();
        for (layout, period_min) in [(Layout::four_sides(), 5.0), (Layout::default(), 10.0)] {
            let error = spec.check(&layout, period_min).unwrap_err().to_string();
            assert!(
                error.contains("found a planner with a model of the lamps left, right and steps of 5"),
                "{error}"
            );
        }
    }
}
