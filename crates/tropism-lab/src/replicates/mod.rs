//! Methods for controllers, compared over several replicates and scenarios.
//!
//! In: methods, such as "six tracks, a model of the stem, a tuned rule", and scenarios, each a species with its variation. Out:
//! how well controllers that were made from the tracks of a few plants steer other plants, with intervals over replicates
//! and plants. Each replicate grows plants of its own, and makes everything from their tracks alone. All controllers of a
//! scenario steer the same unseen plants. Each stage executes the plan of another workflow; one whose file is there is not
//! repeated. Without methods the greedy controller and one lamp that stays lit are tested alone, and nothing is grown, fitted or searched for beforehand:
//! that is for tasks that no model knows. `docs/how-to/compare-controllers.md` has the protocol.

mod results;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::evolve::{EvolutionConfig, RuleSearch};
use tropism::lamps::Light;
use tropism::random::{self, Purpose};
use tropism::task::{Reading, Task};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::Species;
use tropism_bean::tent::Greenhouse;

pub use self::results::{
    BaselineResults, MeanAndInterval, Measures, MethodResults, ReplicateResults, ReplicatesResults,
    ScenarioResults,
};
use crate::controller::ControllerSpec;
use crate::evolve::{EvolvePlan, TRIAL_PLANTS};
use crate::files::{self, FileError};
use crate::fit::{FitPlan, ModelKind};
use crate::grow::GrowPlan;
use crate::sequences;
use crate::task::check_goal;
use crate::transfer::{NamedController, TEST_PLANTS, TransferPlan, TransferResults, check_names};
use crate::tune::TunePlan;
use crate::work::{self, Milestone, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow};

/// Name of the greedy rule among the controllers of a scenario.
const GREEDY: &str = "greedy";

/// Name of the dormant control: one lamp that stays lit.
const CONSTANT: &str = "constant";

/// Minutes for which the lamp of the dormant control stays lit: longer than any experiment.
const ALWAYS_MIN: f64 = 1e6;

/// Name of the rule that was tuned on virtual plants themselves.
const REFERENCE: &str = "reference";

/// Names that methods and scenarios may not have.
const RESERVED: [&str; 3] = [GREEDY, REFERENCE, CONSTANT];

/// How a replicate makes a controller from its tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum MethodKind {
    /// NEAT, by default on the paper's tip-motion model: the champion is the best on models of single plants.
    Evolve {
        /// Which model.
        #[serde(default, skip_serializing_if = "is_tip")]
        model: ModelKind,
        /// The method before this one from whose champion evolution starts, with its sensors.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        from: Option<String>,
        /// By which score of targets the networks are evolved, if not by that of the task.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        score: Option<Reading>,
        /// Number of runs, generations and episodes, and NEAT's parameters.
        #[serde(default)]
        evolution: Box<EvolutionConfig>,
    },
    /// A rule with nine parameters, tuned on a model.
    Tune {
        /// Which model.
        model: ModelKind,
        /// By which score of targets the rule is tuned, if not by that of the task.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        score: Option<Reading>,
        /// Generations, rules a generation, and plants a rule.
        #[serde(default)]
        search: RuleSearch,
    },
}

/// A method with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Method {
    /// Its name: letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// How it makes a controller.
    #[serde(flatten)]
    pub kind: MethodKind,
}

/// Plants of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Its name: letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// File of the species; the common bean by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bean: Option<PathBuf>,
    /// Individual variation of the plants as a multiple of that of the species.
    #[serde(default = "one")]
    pub variation: f64,
    /// File of the task of this scenario; that of the study by default. Random targets are drawn for each scenario anew.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub task: Option<PathBuf>,
    /// Steps of an open-loop experiment, 1 to 1000000; those of the study by default. A slow species needs more of them to grow
    /// as high. Left out beside `controllers_of`: no open-loop experiment is made then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// Test plants of this scenario, 1 to 100000; those of the study by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test_plants: Option<u32>,
    /// Whether the tips of the test plants of this scenario are measured in photographs; as in the study by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photographs: Option<bool>,
    /// Name of a scenario before this one, whose controllers and reference are tested here, too: none is made for this scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controllers_of: Option<String>,
}

impl Scenario {
    /// A scenario of common beans with the task of the study.
    #[must_use]
    pub fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            bean: None,
            variation: one(),
            task: None,
            steps: None,
            test_plants: None,
            photographs: None,
            controllers_of: None,
        }
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_tip(kind: &ModelKind) -> bool {
    *kind == ModelKind::TIP
}

const fn one() -> f64 {
    1.0
}

/// Everything that decides the results: the content of a study file such as `studies/robust.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct ReplicatesConfig {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of replicates, 1 to 1000.
    pub replicates: u32,
    /// Plants whose tracks a replicate has, 1 to 1000. Paper: 6 (section 2.2.1).
    pub plants: u32,
    /// Steps of an open-loop experiment. Paper: 1000 (section 2.2.1).
    pub steps: u32,
    /// Test plants of a scenario, 1 to 100000.
    pub test_plants: u32,
    /// Task of the controllers; it has targets.
    pub task: Task,
    /// Whether the tips of the test plants are measured in photographs.
    pub photographs: bool,
    /// The search for the reference controller: a rule that is tuned on virtual plants themselves. Left out, there is no reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<RuleSearch>,
    /// The methods. With an empty list the greedy controller and one lamp that stays lit are tested alone, and `replicates`, `plants` and `steps` count for
    /// nothing.
    pub methods: Vec<Method>,
    /// The scenarios.
    pub scenarios: Vec<Scenario>,
}

impl Default for ReplicatesConfig {
    fn default() -> Self {
        let rule = MethodKind::Tune { model: ModelKind::STEM, score: None, search: RuleSearch::default() };
        Self {
            seed: 1,
            replicates: 5,
            plants: 6,
            steps: 1000,
            test_plants: TEST_PLANTS,
            task: Task::default(),
            photographs: false,
            reference: None,
            methods: vec![Method { name: "rule".to_owned(), kind: rule }],
            scenarios: vec![Scenario::named("common-bean")],
        }
    }
}

/// Compares methods over replicates and scenarios, in a folder that can be resumed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReplicatesPlan {
    /// Folder for tracks, models, controllers and results.
    pub out: PathBuf,
    /// Whether to continue in `out`.
    pub resume: bool,
    /// Everything that decides the results.
    pub config: ReplicatesConfig,
}

impl Default for ReplicatesPlan {
    fn default() -> Self {
        Self { out: "replicates".into(), resume: false, config: ReplicatesConfig::default() }
    }
}

/// What decides the results: the content of `replicates.toml`.
#[derive(Serialize)]
struct ReplicatesRecord<'p> {
    schema: &'static str,
    version: &'static str,
    is_virtual: bool,
    config: &'p ReplicatesConfig,
    species: Vec<Species>,
    tasks: Vec<Task>,
}

impl ReplicatesConfig {
    /// Reads a study file. Files that it names are looked for from its own folder.
    ///
    /// # Errors
    /// [`Error`] names the file, the key, what was found and what was wanted.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let mut config: Self = files::read_toml(path)?;
        config.find_files_in(path.parent().unwrap_or(Path::new("")));
        Ok(config)
    }

    /// Replicates that make controllers: none without methods.
    fn replicates_at_work(&self) -> u32 {
        if self.methods.is_empty() { 0 } else { self.replicates }
    }

    /// Plants that judge the controllers of a scenario.
    fn test_plants_of(&self, scenario: &Scenario) -> u32 {
        scenario.test_plants.unwrap_or(self.test_plants)
    }

    /// Whether the judged tip of a scenario is measured in photographs.
    fn photographs_of(&self, scenario: &Scenario) -> bool {
        scenario.photographs.unwrap_or(self.photographs)
    }

    /// Looks for the files that it names from `folder` on.
    pub(crate) fn find_files_in(&mut self, folder: &Path) {
        self.files_mut().for_each(|file| *file = folder.join(&*file));
    }

    /// The files that it names.
    fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.scenarios.iter_mut().flat_map(|scenario| [&mut scenario.bean, &mut scenario.task]).flatten()
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key, what was found and what was wanted.
    pub fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        check_goal(&self.task)?;
        Error::check_range("replicates", self.replicates, 1000)?;
        Error::check_range("plants", self.plants, 1000)?;
        Error::check_range("steps", self.steps, 1_000_000)?;
        Error::check_range("test_plants", self.test_plants, 100_000)?;
        if let Some(search) = &self.reference {
            search.check().map_err(Error::in_plan("reference"))?;
        }
        check_names("methods", &RESERVED, self.methods.iter().map(|method| method.name.as_str()))?;
        check_names("scenarios", &RESERVED, self.scenarios.iter().map(|scenario| scenario.name.as_str()))?;
        for (number, Method { name, kind }) in self.methods.iter().enumerate() {
            if let MethodKind::Evolve { from: Some(from), .. } = kind {
                check_from(name, from, &self.methods[..number])?;
            }
            match kind {
                MethodKind::Evolve { evolution, .. } => evolution.check().map_err(Error::in_plan(name))?,
                MethodKind::Tune { search, .. } => search.check().map_err(Error::in_plan(name))?,
            }
        }
        if self.scenarios.is_empty() {
            return Err(Error::Plan("`scenarios` is empty: name at least one".to_owned()));
        }
        for (number, scenario) in self.scenarios.iter().enumerate() {
            let Scenario { name, steps, test_plants, controllers_of, .. } = scenario;
            if let Some(other) = controllers_of {
                check_controllers_of(name, other, &self.scenarios[..number])?;
                if let Some(steps) = steps {
                    return Err(Error::Plan(format!(
                        "scenario {name}: found steps = {steps} beside controllers_of = {other:?}, wanted one of the two: \
                         a scenario that borrows its controllers has no open-loop experiments"
                    )));
                }
            }
            let plants = test_plants.unwrap_or(self.test_plants);
            Error::check_range("test_plants", plants, 100_000)
                .and_then(|()| Error::check_range("steps", steps.unwrap_or(self.steps), 1_000_000))
                .map_err(Error::at(format!("scenario {name}")))?;
        }
        let is_varied = |scenario: &&Scenario| !(0.0..=2.0).contains(&scenario.variation);
        match self.scenarios.iter().find(is_varied) {
            Some(Scenario { name, variation, .. }) => {
                Err(Error::Plan(format!("scenario {name}: found variation = {variation}, wanted 0 to 2")))
            }
            None => Ok(()),
        }
    }
}

/// Checks that the method `name` starts from the champion of one of those `before` it.
fn check_from(name: &str, from: &str, before: &[Method]) -> Result<(), Error> {
    let is_found = |method: &Method| method.name == from && matches!(method.kind, MethodKind::Evolve { .. });
    if before.iter().any(is_found) {
        return Ok(());
    }
    Err(Error::Plan(format!(
        "{name}: found from = {from:?}, wanted the name of a method of kind \"evolve\" before this one"
    )))
}

/// Checks that the controllers of the scenario `name` are made in one of those `before` it.
fn check_controllers_of(name: &str, other: &str, before: &[Scenario]) -> Result<(), Error> {
    if before.iter().any(|scenario| scenario.name == other && scenario.controllers_of.is_none()) {
        return Ok(());
    }
    Err(Error::Plan(format!(
        "scenario {name}: found controllers_of = {other:?}, wanted the name of a scenario before this one that has controllers \
         of its own"
    )))
}

impl Workflow for ReplicatesPlan {
    type Results = ReplicatesResults;

    const SCHEMA: &'static str = "tropism.replicates/1";

    fn check(&self) -> Result<(), Error> {
        self.config.check()
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<ReplicatesResults, Error> {
        work::perform(self, monitor)
    }
}

impl Work for ReplicatesPlan {
    const WORKFLOW: &'static str = "replicates";
    const NAME: &'static str = "a comparison";
    const RECORD: &'static str = "replicates.toml";
    const RESULTS: &'static [&'static str] = &["replicates.json"];

    type Begun<'p> = Comparing<'p>;

    fn out(&self) -> &Path {
        &self.out
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        [&mut self.out].into_iter().chain(self.config.files_mut()).collect()
    }

    /// Files of species must still be where they were.
    fn of_folder(out: &Path) -> Result<Self, Error> {
        #[derive(Deserialize)]
        struct Record {
            config: ReplicatesConfig,
        }
        let Record { config } = files::read_toml(&out.join(Self::RECORD))?;
        Ok(Self { out: out.to_owned(), resume: true, config })
    }

    /// Each scenario has a part for its reference controller, its controllers and their test.
    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let plan = Self::of_folder(folder)?;
        let parts = plan.config.scenarios.iter().map(|scenario| plan.status_of(scenario));
        let parts = parts.collect::<Result<Vec<_>, _>>()?.concat();
        WorkStatus::of::<Self>(folder, parts)
    }

    fn begin(&self, _monitor: &dyn Monitor) -> Result<Comparing<'_>, Error> {
        let tasks = self.tasks()?;
        self.check_scores(&tasks)?;
        let greenhouses = self.greenhouses(&tasks)?;
        let scenarios = (self.config.scenarios.iter().zip(greenhouses).zip(tasks).zip(0..)).map(
            |(((scenario, greenhouse), task), number)| AtWork {
                plan: self,
                scenario,
                number,
                greenhouse,
                task,
            },
        );
        Ok(Comparing { plan: self, scenarios: scenarios.collect() })
    }

    fn collect(&self, comparing: &Comparing<'_>, _monitor: &dyn Monitor) -> Result<ReplicatesResults, Error> {
        let scenarios = comparing.scenarios.iter().map(|scenario| scenario.results());
        let results = ReplicatesResults::new(&self.config, scenarios.collect::<Result<_, _>>()?);
        files::write_json(&self.out.join("replicates.json"), &results)?;
        Ok(results)
    }
}

impl ReplicatesPlan {
    /// The task of each scenario of the comparison in the folder `out`, by the scenario's name.
    ///
    /// # Errors
    /// [`Error`] names the file and what is wrong with it.
    pub fn tasks_of_folder(out: &Path) -> Result<BTreeMap<String, Task>, Error> {
        #[derive(Deserialize)]
        struct Record {
            config: ReplicatesConfig,
            tasks: Vec<Task>,
        }
        let Record { config, tasks } = files::read_toml(&out.join(Self::RECORD))?;
        Ok(config.scenarios.into_iter().map(|scenario| scenario.name).zip(tasks).collect())
    }

    fn status_of(&self, scenario: &Scenario) -> Result<Vec<PartStatus>, Error> {
        let config = &self.config;
        let name = |what: &str| format!("{}: {what}", scenario.name);
        let mut parts = Vec::new();
        if scenario.controllers_of.is_none() {
            if config.reference.is_some() {
                let is_found = u64::from(self.reference(scenario).exists());
                parts.push(PartStatus::new(name("reference"), is_found, 1, "rules"));
            }
            let all = (0..config.replicates_at_work()).flat_map(|replicate| {
                config.methods.iter().map(move |method| self.made(scenario, replicate, method))
            });
            let (mut done, mut total) = (0, 0);
            for files in all {
                total += 1;
                done += u64::from(files.iter().all(|file| file.exists()));
            }
            if total > 0 {
                parts.push(PartStatus::new(name("controllers"), done, total, "controllers"));
            }
        }
        let judged = self.scenario_folder(scenario).join("judged");
        let has_begun = judged.join(TransferPlan::RECORD).exists();
        let done = if has_begun { TransferPlan::status(&judged)?.progress().0 } else { 0 };
        let methods = config.methods.len() as u64 * u64::from(config.replicates_at_work());
        // Greedy and the lamp that stays lit, too.
        let controllers = 2 + u64::from(config.reference.is_some()) + methods;
        let plants = u64::from(config.test_plants_of(scenario));
        parts.push(PartStatus::new(name("test plants"), done, controllers * plants, "plants"));
        Ok(parts)
    }

    fn scenario_folder(&self, scenario: &Scenario) -> PathBuf {
        self.out.join(&scenario.name)
    }

    /// The folder of the scenario in which the controllers of `scenario` are made.
    fn made_in(&self, scenario: &Scenario) -> PathBuf {
        self.out.join(scenario.controllers_of.as_ref().unwrap_or(&scenario.name))
    }

    /// The file of the reference controller.
    fn reference(&self, scenario: &Scenario) -> PathBuf {
        self.made_in(scenario).join("reference.json")
    }

    /// The files of what a replicate, from 0, made by a method: its controller, and the time that it took.
    fn made(&self, scenario: &Scenario, replicate: u32, method: &Method) -> [PathBuf; 2] {
        let folder = replicate_folder(&self.made_in(scenario), replicate);
        ["json", "seconds"].map(|end| folder.join(format!("{}.{end}", method.name)))
    }

    /// The task of each scenario.
    fn tasks(&self) -> Result<Vec<Task>, Error> {
        let tent = Greenhouse::default();
        let scenarios = &self.config.scenarios;
        let task = |scenario: &Scenario| {
            let task = match &scenario.task {
                None => self.config.task.clone(),
                Some(file) => crate::task::read(file)?,
            };
            if let (false, Some(file)) = (task.has_goal(), &scenario.task) {
                let problem = "the task has no targets: there is nothing to reach";
                return Err(FileError::content(file, problem.to_owned()).into());
            }
            if !task.is_to_draw() {
                return Ok(task);
            }
            // Controllers that another scenario made steer for the targets that they were made for.
            let maker = scenario.controllers_of.as_ref().unwrap_or(&scenario.name);
            let number = scenarios.iter().position(|other| other.name == *maker).unwrap_or(0);
            sequences::sequence(&task, &tent.trial(PAPER_PERIOD_MIN), self.config.seed, number as u64)
        };
        scenarios.iter().map(task).collect()
    }

    /// Checks that a method which names a score finds targets to be scored by it in each task.
    fn check_scores(&self, tasks: &[Task]) -> Result<(), Error> {
        for Method { name, kind } in &self.config.methods {
            let (MethodKind::Evolve { score: Some(score), .. } | MethodKind::Tune { score: Some(score), .. }) =
                kind
            else {
                continue;
            };
            let is_without = |task: &&Task| task.by(*score).score != *score;
            if let Some(task) = tasks.iter().find(is_without) {
                return Err(Error::Plan(format!(
                    "method {name}: found a score beside the task {:?}, which has none to choose from: leave it out",
                    task.title()
                )));
            }
        }
        Ok(())
    }

    /// The tent of each scenario, with what its task needs.
    fn greenhouses(&self, tasks: &[Task]) -> Result<Vec<Greenhouse>, Error> {
        let greenhouse = |(scenario, task): (&Scenario, &Task)| {
            let bean: Species =
                scenario.bean.as_deref().map(files::read_toml).transpose()?.unwrap_or_default();
            let greenhouse =
                Greenhouse { bean, variation: scenario.variation, ..Greenhouse::default() }.for_task(task);
            let file = scenario.bean.clone().unwrap_or_default();
            greenhouse.check().map_err(|error| FileError::content(&file, error.to_string()))?;
            Ok(greenhouse)
        };
        self.config.scenarios.iter().zip(tasks).map(greenhouse).collect()
    }
}

/// A comparison at work.
pub struct Comparing<'p> {
    plan: &'p ReplicatesPlan,
    scenarios: Vec<AtWork<'p>>,
}

impl Comparing<'_> {
    /// What is made before the test, in order: the number of a scenario that makes controllers, and of the replicate; `None` for the
    /// reference controller.
    fn made(&self) -> Vec<(usize, Option<u32>)> {
        let config = &self.plan.config;
        let of_scenario = |(number, at_work): (usize, &AtWork<'_>)| {
            let makes = at_work.scenario.controllers_of.is_none();
            let reference = config.reference.filter(|_| makes).map(|_| None);
            let replicates = if makes { config.replicates_at_work() } else { 0 };
            reference.into_iter().chain((0..replicates).map(Some)).map(move |replicate| (number, replicate))
        };
        self.scenarios.iter().enumerate().flat_map(of_scenario).collect()
    }
}

impl Units for Comparing<'_> {
    fn record(&self) -> Result<Record, Error> {
        let absolute = self.plan.clone().with_absolute_paths()?;
        let content = ReplicatesRecord {
            schema: ReplicatesPlan::SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            is_virtual: true,
            config: &absolute.config,
            species: self.scenarios.iter().map(|scenario| scenario.greenhouse.bean.clone()).collect(),
            tasks: self.scenarios.iter().map(|scenario| scenario.task.clone()).collect(),
        };
        Record::of(self.plan, &content)
    }

    /// The controllers of each scenario, replicate by replicate; then each scenario's test.
    fn stages(&self) -> Vec<Stage> {
        let name = |number: usize| &self.scenarios[number].scenario.name;
        let made = self.made().into_iter().map(|(number, replicate)| match replicate {
            None => Unit::new(
                format!("{}/reference", name(number)),
                format!("{}: the reference controller", name(number)),
            ),
            Some(replicate) => Unit::new(
                format!("{}/replicate-{}", name(number), replicate + 1),
                format!("{}: replicate {}", name(number), replicate + 1),
            ),
        });
        let tested = (0..self.scenarios.len()).map(|number| {
            Unit::new(format!("{}/judged", name(number)), format!("{}: test plants", name(number)))
        });
        let stage = |name: &str, units: Vec<Unit>| Stage { name: name.to_owned(), pace: Pace::Nested, units };
        let stages = [stage("controllers", made.collect()), stage("test plants", tested.collect())];
        stages.into_iter().filter(|stage| !stage.units.is_empty()).collect()
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        let config = &self.plan.config;
        Ok(match self.at(place) {
            At::Reference(number) => self.plan.reference(self.scenarios[number].scenario).exists(),
            At::Replicate(number, replicate) => {
                let scenario = self.scenarios[number].scenario;
                let files = config.methods.iter().flat_map(|one| self.plan.made(scenario, replicate, one));
                files.into_iter().all(|file| file.exists())
            }
            At::Test(number) => self.scenarios[number].tested().exists(),
        })
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        match self.at(place) {
            At::Reference(number) => self.scenarios[number].make_reference(monitor),
            At::Replicate(number, replicate) => self.scenarios[number].make_all(replicate, monitor),
            At::Test(number) => self.scenarios[number].test(monitor),
        }
    }

    fn reached(&self, milestone: &Milestone, monitor: &dyn Monitor) -> Result<(), Error> {
        if *milestone == Milestone::Begun {
            monitor.note("virtual plants: nothing here is a measurement of a living plant");
            if self.plan.config.methods.is_empty() {
                monitor.note(
                    "no methods: rules by hand alone are judged, without open-loop experiments, models or search",
                );
            }
        }
        Ok(())
    }
}

/// What a unit does, and for which scenario.
enum At {
    Reference(usize),
    Replicate(usize, u32),
    Test(usize),
}

impl Comparing<'_> {
    fn at(&self, Place { stage, unit }: Place) -> At {
        match self.made().get(unit) {
            Some(&(number, replicate)) if stage == 0 => {
                replicate.map_or(At::Reference(number), |replicate| At::Replicate(number, replicate))
            }
            _ => At::Test(unit),
        }
    }
}

/// A scenario at work.
struct AtWork<'p> {
    plan: &'p ReplicatesPlan,
    scenario: &'p Scenario,
    /// Its number, from 0.
    number: u64,
    greenhouse: Greenhouse,
    task: Task,
}

impl AtWork<'_> {
    fn make_reference(&self, monitor: &dyn Monitor) -> Result<(), Error> {
        let config = &self.plan.config;
        let Some(search) = &config.reference else { return Ok(()) };
        monitor.note(&format!("{}: the reference controller", self.scenario.name));
        let file = self.plan.reference(self.scenario);
        self.tune(&file, None, None, search, self.seed(u64::from(config.replicates)), monitor).map(drop)
    }

    /// The controllers of a replicate by all methods.
    fn make_all(&self, replicate: u32, monitor: &dyn Monitor) -> Result<(), Error> {
        monitor.note(&format!("{}: replicate {}", self.scenario.name, replicate + 1));
        self.plan.config.methods.iter().try_for_each(|method| self.make(replicate, method, monitor))
    }

    /// All controllers that are tested in this scenario, from their files.
    fn controllers(&self) -> Result<Vec<NamedController>, Error> {
        let (plan, config) = (self.plan, &self.plan.config);
        let constant = ControllerSpec::Periodic { minutes: ALWAYS_MIN, first: Light::LEFT };
        let mut controllers = vec![
            NamedController { name: GREEDY.to_owned(), controller: ControllerSpec::Greedy },
            NamedController { name: CONSTANT.to_owned(), controller: constant },
        ];
        if config.reference.is_some() {
            controllers.push(named(REFERENCE, &plan.reference(self.scenario))?);
        }
        for replicate in 0..config.replicates_at_work() {
            for method in &config.methods {
                let [file, _] = plan.made(self.scenario, replicate, method);
                controllers.push(named(&controller_name(method, replicate), &file)?);
            }
        }
        Ok(controllers)
    }

    /// The file with the results of the test.
    fn tested(&self) -> PathBuf {
        self.folder().join("judged/transfer.json")
    }

    /// The results of the scenario, from its folder.
    fn results(&self) -> Result<ScenarioResults, Error> {
        let (plan, config) = (self.plan, &self.plan.config);
        let judged: TransferResults = files::read_as(&self.tested(), |text| serde_json::from_str(text))?;
        let costs = (0..config.replicates_at_work()).flat_map(|replicate| {
            config.methods.iter().map(move |method| {
                let [_, cost] = plan.made(self.scenario, replicate, method);
                files::read_as(&cost, |text| text.trim().parse::<f64>())
            })
        });
        let costs: Vec<f64> = costs.collect::<Result<_, _>>()?;
        Ok(ScenarioResults::new(config, self.scenario, &self.greenhouse, &judged, &costs, &self.task))
    }

    /// The task, by another score of its targets.
    fn task_by(&self, score: Option<Reading>) -> Task {
        score.map_or_else(|| self.task.clone(), |score| self.task.by(score))
    }

    fn folder(&self) -> PathBuf {
        self.plan.scenario_folder(self.scenario)
    }

    /// The seed of a replicate of this scenario.
    fn seed(&self, replicate: u64) -> u64 {
        // A thousand replicates at most.
        random::derive(self.plan.config.seed, Purpose::Run, self.number << 32 | replicate) >> 1
    }

    /// Makes the controller of a replicate by a method, if it is not there, and writes the processor time that it took.
    fn make(&self, replicate: u32, method: &Method, monitor: &dyn Monitor) -> Result<(), Error> {
        let [file, cost] = self.plan.made(self.scenario, replicate, method);
        let folder = replicate_folder(&self.folder(), replicate);
        if file.exists() && cost.exists() {
            return Ok(());
        }
        let seed = self.seed(replicate.into());
        let (MethodKind::Evolve { model: kind, .. } | MethodKind::Tune { model: kind, .. }) = &method.kind;
        let model = self.model(&folder, *kind, seed, monitor)?;
        let seconds = match &method.kind {
            MethodKind::Tune { search, score, .. } => {
                self.tune(&file, Some(&model), *score, search, seed, monitor)?
            }
            MethodKind::Evolve { from, score, evolution, .. } => {
                let out = folder.join(format!("{}-evolution", method.name));
                let mut plan = EvolvePlan {
                    model,
                    out: out.clone(),
                    task: self.task_by(*score),
                    evolution: (**evolution).clone(),
                    trial_plants: TRIAL_PLANTS,
                    seed,
                    resume: true,
                    ..EvolvePlan::default()
                };
                if let Some(from) = from {
                    plan.start_from(&folder.join(format!("{from}.json")))?;
                }
                let seconds = plan.execute(monitor)?.cpu_seconds;
                files::write(&file, files::read_text(&out.join("champion.json"))?.as_bytes())?;
                seconds
            }
        };
        Ok(files::write(&cost, format!("{seconds:.1}\n").as_bytes())?)
    }

    /// The model of a replicate, which grows its plants first.
    fn model(
        &self,
        folder: &Path,
        kind: ModelKind,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<PathBuf, Error> {
        let out = folder.join(format!("{}-model.json", kind.name()));
        if out.exists() {
            return Ok(out);
        }
        let config = &self.plan.config;
        let grow = GrowPlan {
            plants: config.plants,
            task: Task::open_loop(self.scenario.steps.unwrap_or(config.steps)),
            seed,
            // Those of an interrupted stage grow again.
            replace: true,
            ..self.open_loop(kind, folder)
        };
        let tracks = grow.execute(monitor)?.tracks;
        let fit =
            FitPlan { tracks, kind, out: out.clone(), anyway: true, replace: true, ..FitPlan::default() };
        fit.execute(monitor)?;
        Ok(out)
    }

    /// The open-loop experiments for a kind of model. Only one in space knows more than the plane of the front camera and its two
    /// lamps.
    fn open_loop(&self, kind: ModelKind, folder: &Path) -> GrowPlan {
        if kind.is_in_space() {
            return GrowPlan {
                greenhouse: self.greenhouse.clone(),
                out: folder.join("open-loop-in-space"),
                ..GrowPlan::default()
            };
        }
        let Greenhouse { bean, variation, .. } = self.greenhouse.clone();
        GrowPlan {
            greenhouse: Greenhouse { bean, variation, ..Greenhouse::default() },
            out: folder.join("open-loop"),
            ..GrowPlan::default()
        }
    }

    /// Tunes a rule on a model, or without one on virtual plants themselves; returns its processor time, in s.
    fn tune(
        &self,
        out: &Path,
        model: Option<&Path>,
        score: Option<Reading>,
        search: &RuleSearch,
        seed: u64,
        monitor: &dyn Monitor,
    ) -> Result<f64, Error> {
        let plan = TunePlan {
            model: model.unwrap_or(Path::new("")).to_owned(),
            beans: model.is_none().then(|| self.greenhouse.clone()),
            task: self.task_by(score),
            search: *search,
            seed,
            out: out.to_owned(),
            resume: true,
            ..TunePlan::default()
        };
        files::make_folder(&self.folder())?;
        Ok(plan.execute(monitor)?.cpu_seconds)
    }

    /// All controllers steer the same unseen plants.
    fn test(&self, monitor: &dyn Monitor) -> Result<(), Error> {
        monitor.note(&format!("{}: test plants", self.scenario.name));
        let config = &self.plan.config;
        let plan = TransferPlan {
            controllers: self.controllers()?,
            plants: config.test_plants_of(self.scenario),
            task: self.task.clone(),
            greenhouse: self.greenhouse.clone(),
            photographs: config.photographs_of(self.scenario),
            reference: config.reference.map(|_| REFERENCE.to_owned()),
            seed: self.seed(u64::from(config.replicates) + 1),
            resume: true,
            out: self.folder().join("judged"),
            ..TransferPlan::default()
        };
        plan.execute(monitor).map(drop)
    }
}

fn replicate_folder(scenario: &Path, replicate: u32) -> PathBuf {
    scenario.join(format!("replicate-{}", replicate + 1))
}

/// The name of a replicate's controller among those that are judged.
fn controller_name(method: &Method, replicate: u32) -> String {
    format!("{}-{}", method.name, replicate + 1)
}

fn named(name: &str, file: &Path) -> Result<NamedController, Error> {
    Ok(NamedController { name: name.to_owned(), controller: ControllerSpec::read(file)? })
}
