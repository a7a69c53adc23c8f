//! `study.toml`: everything that decides the results of a study.

use serde::{Deserialize, Serialize};
use tropism::evolve::{EvolutionConfig, RuleSearch};
use tropism::plant::tip::TipModelConfig;
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::vision::VisionConfig;
use tropism_bean::tent::Greenhouse;
use tropism_rig::file::RigFile;

use crate::Error;
use crate::controller::ControllerSpec;
use crate::evolve::TRIAL_PLANTS;
use crate::transfer::TEST_PLANTS;

/// The controllers that steer unseen plants.
pub(super) const CONTROLLERS: [&str; 5] = ["champion", "random", "periodic", "greedy", "rule"];

/// Those that steer plants by their photographs, by the names of their folders in `reality`: the paper tried no others on plants
/// than its champions.
pub(super) const PHOTOGRAPHED: [&str; 3] = ["champion", "greedy", "rule"];

/// Everything that decides the results of a study: the content of `study.toml`. The default is the paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct StudyConfig {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of open-loop experiments. Paper: 6 (section 2.2.1).
    pub experiments: u32,
    /// Steps of each open-loop experiment. Paper: 1000, 83.3 hours.
    pub steps: u32,
    /// Steps between two switches of the lamps in these experiments. Paper: 72, six hours.
    pub switch_steps: u32,
    /// Number of random controllers. Paper: two million (section 3.1).
    pub random_controllers: u64,
    /// Simulated plants of each model on which controllers are compared.
    pub trial_plants: u32,
    /// Unseen plants that the champion, greedy and the rule steer by photographs. Paper: 6 (section 3.2).
    pub reality_plants: u32,
    /// Further unseen plants that all controllers steer without photographs, 1 to 100000: six say little.
    pub test_plants: u32,
    /// Task of the controllers.
    pub task: Task,
    /// Settings of the tip-motion model.
    pub model: TipModelConfig,
    /// Settings of the evolution.
    pub evolution: EvolutionConfig,
    /// Settings of the search of a rule, which is tuned for arrival on a model of the whole stem.
    pub rule: RuleSearch,
    /// Settings of the plant detector.
    pub vision: VisionConfig,
    /// The virtual tent.
    pub greenhouse: Greenhouse,
}

impl Default for StudyConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            experiments: 6,
            steps: 1000,
            switch_steps: 72,
            random_controllers: 2_000_000,
            trial_plants: TRIAL_PLANTS,
            reality_plants: 6,
            test_plants: TEST_PLANTS,
            task: Task::default(),
            model: TipModelConfig::default(),
            evolution: EvolutionConfig::default(),
            rule: RuleSearch::default(),
            vision: VisionConfig::default(),
            greenhouse: Greenhouse::default(),
        }
    }
}

/// The text of `studies/quick.toml`, a link to the file beside this one: a package holds only files of its crate.
const QUICK: &str = include_str!("quick.toml");

impl StudyConfig {
    /// A small study that takes about a minute: `studies/quick.toml`.
    ///
    /// # Panics
    /// Never: the file is part of the program, and a test reads it.
    #[must_use]
    pub fn quick() -> Self {
        toml::from_str(QUICK).expect("studies/quick.toml is a study")
    }

    /// Checks the ranges of all settings.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), Error> {
        Error::check_range("experiments", self.experiments, 1000)?;
        Error::check_range("steps", self.steps, 100_000)?;
        Error::check_range("switch_steps", self.switch_steps, 100_000)?;
        Error::check_range("random_controllers", self.random_controllers, 1_000_000_000)?;
        Error::check_range("trial_plants", self.trial_plants, 1_000_000)?;
        Error::check_range("reality_plants", self.reality_plants, 10_000)?;
        Error::check_range("test_plants", self.test_plants, 100_000)?;
        self.task.check().map_err(Error::in_plan("task"))?;
        if self.task.is_in_space() || self.task.is_about_stem() {
            return Err(Error::Plan(format!(
                "`task`: a study evolves on the paper's model of the tip, which knows no stem and no depth, as {} wants: grow \
                 plants, fit a model of the stem, and `tropism evolve` on it",
                self.task.title()
            )));
        }
        self.evolution.check().map_err(Error::in_plan("evolution"))?;
        self.rule.check().map_err(Error::in_plan("rule"))?;
        self.rig().check().map_err(|error| Error::Plan(error.to_string()))
    }

    /// The virtual tent as a rig.
    pub(super) fn rig(&self) -> RigFile {
        RigFile::greenhouse(self.greenhouse.clone(), self.vision.clone())
    }

    /// The controller of the open-loop experiments.
    pub(super) fn periodic(&self) -> ControllerSpec {
        ControllerSpec::periodic(f64::from(self.switch_steps) * self.rig().period_min)
    }

    /// The seed of a plant: first those of the open-loop experiments, then the unseen ones.
    pub(super) fn plant_seed(&self, number: u32) -> u64 {
        random::derive(self.seed, Purpose::Plant, number.into())
    }
}
