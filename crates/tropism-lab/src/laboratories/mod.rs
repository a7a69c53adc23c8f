//! Recipes for controllers, compared over several laboratories and worlds.
//!
//! In: recipes, such as "six tracks, a model of the stem, a tuned rule", and worlds, each a species with its variation. Out:
//! how well controllers that were made from the tracks of a few plants steer other plants, with intervals over laboratories
//! and plants. Each laboratory grows plants of its own, and makes everything from their tracks alone. All controllers of a
//! world steer the same unseen plants. Each stage executes the plan of another workflow; one whose file is there is not
//! repeated. Without recipes the rules by hand alone are judged, and nothing is grown, fitted or searched for beforehand:
//! that is for tasks that no model knows. `docs/how-to/compare-controllers.md` has the protocol.

mod results;
mod status;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::control::PlannerConfig;
use tropism::evolve::{EvolutionConfig, RuleSearch};
use tropism::lamps::Light;
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::Species;
use tropism_bean::tent::Greenhouse;

pub use self::results::{
    BaselineResults, LaboratoriesResults, LaboratoryResults, MeanAndInterval, RecipeResults, WorldResults,
};
pub(crate) use self::status::status;
pub use self::status::{LaboratoriesStatus, WorldStatus};
use crate::controller::ControllerSpec;
use crate::evolve::{EvolvePlan, TRIAL_PLANTS};
use crate::files::{self, FileError};
use crate::fit::{FitPlan, ModelKind};
use crate::grow::GrowPlan;
use crate::lock::{FolderLock, lock};
use crate::planner::PlannerFile;
use crate::sequences;
use crate::task::check_goal;
use crate::transfer::{JUDGING_PLANTS, NamedController, TransferPlan, TransferResults, check_name};
use crate::tune::TunePlan;
use crate::workflow::check_same;
use crate::{Error, Monitor, Workflow};

/// Name of the greedy rule among the controllers of a world.
const CHASE: &str = "chase";

/// Name of the dormant control: one lamp that stays lit.
const CONSTANT: &str = "constant";

/// Minutes for which the lamp of the dormant control stays lit: longer than any experiment.
const ALWAYS_MIN: f64 = 1e6;

/// Name of the rule that was tuned on virtual plants themselves.
const BOUND: &str = "bound";

/// How a laboratory makes a controller from its tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "lowercase", deny_unknown_fields)]
pub enum Method {
    /// NEAT, by default on the paper's tip-motion model: the champion is the best on models of single plants.
    Evolve {
        /// Which model.
        #[serde(default, skip_serializing_if = "is_tip")]
        model: ModelKind,
        /// The recipe before this one from whose champion evolution starts, with its sensors.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        from: Option<String>,
        /// Number of runs, generations and episodes, and NEAT's parameters.
        #[serde(default)]
        evolution: Box<EvolutionConfig>,
    },
    /// A rule of nine numbers, tuned on a model.
    Tune {
        /// Which model.
        model: ModelKind,
        /// Generations, rules a generation, and plants a rule.
        #[serde(default)]
        search: RuleSearch,
    },
    /// A planner on a model; nothing is searched for.
    Plan {
        /// Which model.
        model: ModelKind,
        /// What the planner tries, and how often.
        #[serde(default)]
        planner: Box<PlannerConfig>,
    },
}

/// A recipe with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Its name: letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// How it makes a controller.
    #[serde(flatten)]
    pub method: Method,
}

/// Plants of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// Its name: letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// File of the species; the common bean by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bean: Option<PathBuf>,
    /// Individual variation of the plants as a multiple of that of the species.
    #[serde(default = "one")]
    pub scale: f64,
    /// File of the task of this world; that of the study by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub task: Option<PathBuf>,
    /// Steps of an open-loop experiment, 1 to 1000000; those of the study by default. A slow species needs more of them to grow
    /// as high. None beside `controllers_of`: no open-loop experiment is made then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// Plants that judge the controllers of this world, 1 to 100000; those of the study by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub judging_plants: Option<u32>,
    /// Whether the judged tip of this world is measured in photographs; as in the study by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photographs: Option<bool>,
    /// Name of a world before this one, whose controllers and bound are judged here, too: none is made for this world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controllers_of: Option<String>,
}

impl World {
    /// A world of common beans with the task of the study.
    #[must_use]
    pub fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            bean: None,
            scale: one(),
            task: None,
            steps: None,
            judging_plants: None,
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
#[serde(default, deny_unknown_fields)]
pub struct LaboratoriesConfig {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of laboratories, 1 to 1000.
    pub laboratories: u32,
    /// Plants whose tracks a laboratory has, 1 to 1000. Paper: 6 (section 2.2.1).
    pub plants: u32,
    /// Steps of an open-loop experiment. Paper: 1000 (section 2.2.1).
    pub steps: u32,
    /// Plants that judge the controllers of a world, 1 to 100000.
    pub judging_plants: u32,
    /// Task of the controllers; it has targets.
    pub task: Task,
    /// Whether the judged tip is measured in photographs.
    pub photographs: bool,
    /// The search for the bound: a rule that is tuned on virtual plants themselves. Left out, there is no bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<RuleSearch>,
    /// The recipes. With an empty list the rules by hand alone are judged, and `laboratories`, `plants` and `steps` count for
    /// nothing.
    pub recipes: Vec<Recipe>,
    /// The worlds.
    pub worlds: Vec<World>,
}

impl Default for LaboratoriesConfig {
    fn default() -> Self {
        let rule = Method::Tune { model: ModelKind::STEM, search: RuleSearch::default() };
        Self {
            seed: 1,
            laboratories: 5,
            plants: 6,
            steps: 1000,
            judging_plants: JUDGING_PLANTS,
            task: Task::default(),
            photographs: false,
            bound: None,
            recipes: vec![Recipe { name: "rule".to_owned(), method: rule }],
            worlds: vec![World::named("common-bean")],
        }
    }
}

/// Compares recipes over laboratories and worlds, in a folder that can be resumed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LaboratoriesPlan {
    /// Folder for tracks, models, controllers and results.
    pub out: PathBuf,
    /// Whether to continue in `out`.
    pub resume: bool,
    /// Everything that decides the results.
    pub config: LaboratoriesConfig,
}

impl Default for LaboratoriesPlan {
    fn default() -> Self {
        Self { out: "laboratories".into(), resume: false, config: LaboratoriesConfig::default() }
    }
}

/// What decides the results: the content of `laboratories.toml`.
#[derive(Serialize)]
struct LaboratoriesRecord<'p> {
    schema: &'static str,
    version: &'static str,
    is_virtual: bool,
    config: &'p LaboratoriesConfig,
    species: Vec<Species>,
    tasks: Vec<Task>,
}

impl LaboratoriesConfig {
    /// Reads a study file. Files that it names are looked for from its own folder.
    ///
    /// # Errors
    /// [`Error`] names the file, the key, what was found and what was wanted.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let mut config: Self = files::read_toml(path)?;
        config.find_files_in(path.parent().unwrap_or(Path::new("")));
        Ok(config)
    }

    /// Laboratories that make controllers: none without recipes.
    fn laboratories_at_work(&self) -> u32 {
        if self.recipes.is_empty() { 0 } else { self.laboratories }
    }

    /// Plants that judge the controllers of a world.
    fn judging_plants_of(&self, world: &World) -> u32 {
        world.judging_plants.unwrap_or(self.judging_plants)
    }

    /// Whether the judged tip of a world is measured in photographs.
    fn photographs_of(&self, world: &World) -> bool {
        world.photographs.unwrap_or(self.photographs)
    }

    /// Looks for the files that it names from `folder` on.
    pub(crate) fn find_files_in(&mut self, folder: &Path) {
        for file in self.worlds.iter_mut().flat_map(|world| [&mut world.bean, &mut world.task]).flatten() {
            *file = folder.join(&*file);
        }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key, what was found and what was wanted.
    pub fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        check_goal(&self.task)?;
        Error::check_range("laboratories", self.laboratories, 1000)?;
        Error::check_range("plants", self.plants, 1000)?;
        Error::check_range("steps", self.steps, 1_000_000)?;
        Error::check_range("judging_plants", self.judging_plants, 100_000)?;
        if let Some(search) = &self.bound {
            search.check().map_err(Error::in_plan("bound"))?;
        }
        check_names("recipes", self.recipes.iter().map(|recipe| recipe.name.as_str()))?;
        check_names("worlds", self.worlds.iter().map(|world| world.name.as_str()))?;
        for (number, Recipe { name, method }) in self.recipes.iter().enumerate() {
            if let Method::Evolve { from: Some(from), .. } = method {
                check_from(name, from, &self.recipes[..number])?;
            }
            match method {
                Method::Evolve { evolution, .. } => evolution.check().map_err(Error::in_plan(name))?,
                Method::Tune { search, .. } => search.check().map_err(Error::in_plan(name))?,
                Method::Plan { planner, .. } => planner.check().map_err(Error::in_plan(name))?,
            }
        }
        if self.worlds.is_empty() {
            return Err(Error::Plan("`worlds`: found none, wanted at least one".to_owned()));
        }
        for (number, world) in self.worlds.iter().enumerate() {
            let World { name, steps, judging_plants, controllers_of, .. } = world;
            if let Some(other) = controllers_of {
                check_controllers_of(name, other, &self.worlds[..number])?;
                if let Some(steps) = steps {
                    return Err(Error::Plan(format!(
                        "world {name}: found steps = {steps} beside controllers_of = {other:?}, wanted one of the two: \
                         a world that borrows its controllers has no open-loop experiments"
                    )));
                }
            }
            let plants = judging_plants.unwrap_or(self.judging_plants);
            Error::check_range("judging_plants", plants, 100_000)
                .and_then(|()| Error::check_range("steps", steps.unwrap_or(self.steps), 1_000_000))
                .map_err(Error::at(format!("world {name}")))?;
        }
        let is_scale = |world: &&World| !(0.0..=2.0).contains(&world.scale);
        match self.worlds.iter().find(is_scale) {
            Some(World { name, scale, .. }) => {
                Err(Error::Plan(format!("world {name}: found scale = {scale}, wanted 0 to 2")))
            }
            None => Ok(()),
        }
    }
}

/// Checks that names are parts of file names, and that each comes once.
fn check_names<'n>(key: &str, names: impl Iterator<Item = &'n str>) -> Result<(), Error> {
    let reserved = [CHASE, BOUND, CONSTANT];
    let mut known = reserved.to_vec();
    for name in names {
        check_name(key, name)?;
        if known.contains(&name) {
            return Err(Error::Plan(format!(
                "`{key}`: found the name {name:?} twice, wanted each name once, and none of {}",
                reserved.join(", ")
            )));
        }
        known.push(name);
    }
    Ok(())
}

/// Checks that the recipe `name` starts from the champion of one of those `before` it.
fn check_from(name: &str, from: &str, before: &[Recipe]) -> Result<(), Error> {
    let is_found = |recipe: &Recipe| recipe.name == from && matches!(recipe.method, Method::Evolve { .. });
    if before.iter().any(is_found) {
        return Ok(());
    }
    Err(Error::Plan(format!(
        "{name}: found from = {from:?}, wanted the name of a recipe of method \"evolve\" before this one"
    )))
}

/// Checks that the controllers of the world `name` are made in one of those `before` it.
fn check_controllers_of(name: &str, other: &str, before: &[World]) -> Result<(), Error> {
    if before.iter().any(|world| world.name == other && world.controllers_of.is_none()) {
        return Ok(());
    }
    Err(Error::Plan(format!(
        "world {name}: found controllers_of = {other:?}, wanted the name of a world before this one that has controllers \
         of its own"
    )))
}

impl Workflow for LaboratoriesPlan {
    type Results = LaboratoriesResults;

    const SCHEMA: &'static str = "tropism.laboratories/1";

    fn check(&self) -> Result<(), Error> {
        self.config.check()
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<LaboratoriesResults, Error> {
        let tasks = self.tasks()?;
        let greenhouses = self.greenhouses(&tasks)?;
        let _lock = self.claim(&greenhouses, &tasks)?;
        monitor.note("virtual plants: nothing here is a measurement of a living plant");
        if self.config.recipes.is_empty() {
            monitor.note(
                "no recipes: rules by hand alone are judged, without open-loop experiments, models or search",
            );
        }
        let worlds =
            self.config.worlds.iter().zip(greenhouses).zip(tasks).enumerate().map(|(number, world)| {
                let ((world, greenhouse), task) = world;
                let stages = Stages { plan: self, world, number: number as u64, greenhouse, task, monitor };
                stages.execute().map_err(|error| error.of_part(&self.out))
            });
        let results = LaboratoriesResults::new(&self.config, worlds.collect::<Result<_, _>>()?);
        files::write_json(&self.out.join("laboratories.json"), &results)?;
        Ok(results)
    }
}

impl LaboratoriesPlan {
    /// The plan that goes on with the comparison in the folder `out`, from its `laboratories.toml`. Files of species must
    /// still be where they were.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read.
    pub fn of_folder(out: &Path) -> Result<Self, Error> {
        #[derive(Deserialize)]
        struct Record {
            config: LaboratoriesConfig,
        }
        let Record { config } = files::read_toml(&out.join("laboratories.toml"))?;
        Ok(Self { out: out.to_owned(), resume: true, config })
    }

    fn world_folder(&self, world: &World) -> PathBuf {
        self.out.join(&world.name)
    }

    /// The folder of the world in which the controllers of `world` are made.
    fn made_in(&self, world: &World) -> PathBuf {
        self.out.join(world.controllers_of.as_ref().unwrap_or(&world.name))
    }

    /// The file of the bound.
    fn bound(&self, world: &World) -> PathBuf {
        self.made_in(world).join("bound.json")
    }

    /// The files of what a laboratory, from 0, made by a recipe: its controller, and the time that it took.
    fn made(&self, world: &World, laboratory: u32, recipe: &Recipe) -> [PathBuf; 2] {
        let folder = laboratory_folder(&self.made_in(world), laboratory);
        let kind = if matches!(recipe.method, Method::Plan { .. }) { "toml" } else { "json" };
        [kind, "seconds"].map(|end| folder.join(format!("{}.{end}", recipe.name)))
    }

    /// The task of each world.
    fn tasks(&self) -> Result<Vec<Task>, Error> {
        let drawn = |mut task: Task| -> Result<Task, Error> {
            sequences::draw(&mut task, &Greenhouse::default(), PAPER_PERIOD_MIN, self.config.seed)?;
            Ok(task)
        };
        let task = |world: &World| {
            let Some(file) = &world.task else { return drawn(self.config.task.clone()) };
            let task = crate::task::read(file)?;
            if task.has_goal() {
                return drawn(task);
            }
            Err(FileError::content(
                file,
                "found no targets, wanted a task with something to reach".to_owned(),
            )
            .into())
        };
        self.config.worlds.iter().map(task).collect()
    }

    /// The tent of each world, with what its task needs.
    fn greenhouses(&self, tasks: &[Task]) -> Result<Vec<Greenhouse>, Error> {
        let greenhouse = |(world, task): (&World, &Task)| {
            let bean: Species = world.bean.as_deref().map(files::read_toml).transpose()?.unwrap_or_default();
            let greenhouse = Greenhouse { bean, scale: world.scale, ..Greenhouse::default() }.for_task(task);
            let file = world.bean.clone().unwrap_or_default();
            greenhouse.check().map_err(|error| FileError::content(&file, error.to_string()))?;
            Ok(greenhouse)
        };
        self.config.worlds.iter().zip(tasks).map(greenhouse).collect()
    }

    /// Makes the folder, or checks that the comparison in it is this one, and locks it until the result is dropped.
    fn claim(&self, greenhouses: &[Greenhouse], tasks: &[Task]) -> Result<FolderLock, Error> {
        let path = self.out.join("laboratories.toml");
        let record = LaboratoriesRecord {
            schema: Self::SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            is_virtual: true,
            config: &self.config,
            species: greenhouses.iter().map(|greenhouse| greenhouse.bean.clone()).collect(),
            tasks: tasks.to_vec(),
        };
        let text = files::toml_of(&path, &record)?;
        check_same(&path, &text, self.resume, "a comparison")?;
        files::make_folder(&self.out)?;
        let lock = lock(&self.out)?;
        files::write(&path, text.as_bytes())?;
        Ok(lock)
    }
}

/// A world at work.
struct Stages<'p> {
    plan: &'p LaboratoriesPlan,
    world: &'p World,
    /// Its number, from 0.
    number: u64,
    greenhouse: Greenhouse,
    task: Task,
    monitor: &'p dyn Monitor,
}

impl Stages<'_> {
    fn execute(&self) -> Result<WorldResults, Error> {
        let config = &self.plan.config;
        let constant = ControllerSpec::Periodic { minutes: ALWAYS_MIN, first: Light::LEFT };
        let mut controllers = vec![
            NamedController { name: CHASE.to_owned(), controller: ControllerSpec::Greedy },
            NamedController { name: CONSTANT.to_owned(), controller: constant },
        ];
        let mut costs = Vec::new();
        if let Some(search) = &config.bound {
            let file = self.plan.bound(self.world);
            if !file.exists() {
                self.monitor.note(&format!("{}: the bound", self.world.name));
                self.tune(&file, None, search, self.seed(u64::from(config.laboratories)))?;
            }
            controllers.push(named(BOUND, &file)?);
        }
        for laboratory in 0..config.laboratories_at_work() {
            if self.world.controllers_of.is_none() {
                self.monitor.note(&format!("{}: laboratory {}", self.world.name, laboratory + 1));
            }
            for recipe in &config.recipes {
                let (file, cost) = self.make(laboratory, recipe)?;
                controllers.push(named(&controller_name(recipe, laboratory), &file)?);
                costs.push(cost);
            }
        }
        self.monitor.note(&format!("{}: judging", self.world.name));
        let judged = self.judge(controllers)?;
        Ok(WorldResults::new(config, self.world, &self.greenhouse, &judged, &costs, &self.task))
    }

    fn folder(&self) -> PathBuf {
        self.plan.world_folder(self.world)
    }

    /// The seed of a laboratory of this world.
    fn seed(&self, laboratory: u64) -> u64 {
        // A thousand laboratories at most.
        random::derive(self.plan.config.seed, Purpose::Run, self.number << 32 | laboratory) >> 1
    }

    /// The controller of a laboratory by a recipe: its file, and the processor time that it took, in s.
    fn make(&self, laboratory: u32, recipe: &Recipe) -> Result<(PathBuf, f64), Error> {
        let [file, cost] = self.plan.made(self.world, laboratory, recipe);
        let folder = laboratory_folder(&self.folder(), laboratory);
        if file.exists() && cost.exists() {
            return Ok((file, files::read_as(&cost, |text| text.trim().parse::<f64>())?));
        }
        let seed = self.seed(laboratory.into());
        let (Method::Evolve { model: kind, .. }
        | Method::Tune { model: kind, .. }
        | Method::Plan { model: kind, .. }) = &recipe.method;
        let kind = *kind;
        let model = self.model(&folder, kind, seed)?;
        let seconds = match &recipe.method {
            Method::Tune { search, .. } => self.tune(&file, Some(&model), search, seed)?,
            Method::Plan { planner, .. } => {
                // Both lie in the folder of the laboratory.
                let model = PathBuf::from(model.file_name().unwrap_or_default());
                let text =
                    files::toml_of(&file, &PlannerFile { model, rule: None, planner: (**planner).clone() })?;
                files::write(&file, text.as_bytes())?;
                0.0
            }
            Method::Evolve { from, evolution, .. } => {
                let out = folder.join(format!("{}-evolution", recipe.name));
                let mut plan = EvolvePlan {
                    model,
                    out: out.clone(),
                    task: self.task.clone(),
                    evolution: (**evolution).clone(),
                    trial_plants: TRIAL_PLANTS,
                    seed,
                    resume: true,
                    ..EvolvePlan::default()
                };
                if let Some(from) = from {
                    plan.start_from(&folder.join(format!("{from}.json")))?;
                }
                let seconds = plan.execute(self.monitor)?.cpu_seconds;
                files::write(&file, files::read_text(&out.join("champion.json"))?.as_bytes())?;
                seconds
            }
        };
        files::write(&cost, format!("{seconds:.1}\n").as_bytes())?;
        Ok((file, seconds))
    }

    /// The model of a laboratory, which grows its plants first.
    fn model(&self, folder: &Path, kind: ModelKind, seed: u64) -> Result<PathBuf, Error> {
        let out = folder.join(format!("{}-model.json", kind.name()));
        if out.exists() {
            return Ok(out);
        }
        let config = &self.plan.config;
        let grow = GrowPlan {
            plants: config.plants,
            task: Task::open_loop(self.world.steps.unwrap_or(config.steps)),
            seed,
            // Those of an interrupted stage grow again.
            replace: true,
            ..self.open_loop(kind, folder)
        };
        let tracks = grow.execute(self.monitor)?.tracks;
        let fit =
            FitPlan { tracks, kind, out: out.clone(), anyway: true, replace: true, ..FitPlan::default() };
        fit.execute(self.monitor)?;
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
        let Greenhouse { bean, scale, .. } = self.greenhouse.clone();
        GrowPlan {
            greenhouse: Greenhouse { bean, scale, ..Greenhouse::default() },
            out: folder.join("open-loop"),
            ..GrowPlan::default()
        }
    }

    /// Tunes a rule on a model, or without one on virtual plants themselves; returns its processor time, in s.
    fn tune(&self, out: &Path, model: Option<&Path>, search: &RuleSearch, seed: u64) -> Result<f64, Error> {
        let plan = TunePlan {
            model: model.unwrap_or(Path::new("")).to_owned(),
            beans: model.is_none().then(|| self.greenhouse.clone()),
            task: self.task.clone(),
            search: *search,
            seed,
            out: out.to_owned(),
            resume: true,
            ..TunePlan::default()
        };
        files::make_folder(&self.folder())?;
        Ok(plan.execute(self.monitor)?.cpu_seconds)
    }

    /// All controllers steer the same unseen plants.
    fn judge(&self, controllers: Vec<NamedController>) -> Result<TransferResults, Error> {
        let config = &self.plan.config;
        let plan = TransferPlan {
            controllers,
            plants: config.judging_plants_of(self.world),
            task: self.task.clone(),
            greenhouse: self.greenhouse.clone(),
            photographs: config.photographs_of(self.world),
            bound: config.bound.map(|_| BOUND.to_owned()),
            seed: self.seed(u64::from(config.laboratories) + 1),
            resume: true,
            out: self.folder().join("judged"),
            ..TransferPlan::default()
        };
        plan.execute(self.monitor)
    }
}

fn laboratory_folder(world: &Path, laboratory: u32) -> PathBuf {
    world.join(format!("laboratory-{}", laboratory + 1))
}

/// The name of a laboratory's controller among those that are judged.
fn controller_name(recipe: &Recipe, laboratory: u32) -> String {
    format!("{}-{}", recipe.name, laboratory + 1)
}

fn named(name: &str, file: &Path) -> Result<NamedController, Error> {
    Ok(NamedController { name: name.to_owned(), controller: ControllerSpec::read(file)? })
}
