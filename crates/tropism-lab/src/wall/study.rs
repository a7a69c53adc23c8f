//! Nodes on many walls: rules by hand and evolved ones, under other sensors, daylight and faults.
//!
//! In: walls, rules, and seeds of evolutions. Out: for each wall and rule the share of right decisions and of whole paths. The same
//! unseen plants stand before all walls. Each stage executes the plan of another workflow; one whose file is there is not repeated.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::nodes::{NodeEvolutionConfig, NodeFaults, NodeScore, NodeWall, Proximity, StateMachineSettings};
use tropism_bean::render::NodeCamera;

use super::{
    EvolveNodesPlan, NodeRule, NodeRuleResults, NodesFile, WallFile, WallPlan, WallResults, check_rules,
};
use crate::transfer::check_names;
use crate::work::{self, Milestone, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow, files};

/// A wall of a study.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WallScenario {
    /// Its name: letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// Heights of pairs of nodes 6 cm to the left and right, in cm; 8, 13 and 18 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<Vec<f64>>,
    /// Wall file instead of `levels`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The proximity sensors, instead of those of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<Proximity>,
    /// A camera in each node, instead of its sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<NodeCamera>,
    /// The state machine, instead of that of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<StateMachineSettings>,
    /// Faults of nodes and messages.
    #[serde(default)]
    pub faults: NodeFaults,
    /// Rules that run in the nodes; those of the study by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rules: Option<Vec<NodeRule>>,
    /// Whether the evolved networks of the study run in the nodes, too.
    #[serde(default)]
    pub evolved: bool,
}

/// Everything that decides the results: the content of a study file such as `studies/wall.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct WallStudyConfig {
    /// Seed of the plants, which are the same before all walls.
    pub seed: u64,
    /// Number of plants, 1 to 100000.
    pub plants: u32,
    /// Rules that run in the nodes: `"machine"`, `"dormant"`, `"all-lit"`, `"path-lit"`, or `{ evolved = "nodes.json" }`.
    pub rules: Vec<NodeRule>,
    /// Seeds of evolutions, each of which makes one more rule; none by default.
    pub evolve: Vec<u64>,
    /// Heights of the pairs of nodes on whose wall networks are evolved, in cm.
    pub evolve_levels: Vec<f64>,
    /// Settings of the evolutions.
    pub evolution: NodeEvolutionConfig,
    /// The walls.
    pub walls: Vec<WallScenario>,
}

impl Default for WallStudyConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            plants: 90,
            rules: vec![NodeRule::Machine],
            evolve: Vec::new(),
            evolve_levels: vec![8.0, 13.0],
            evolution: NodeEvolutionConfig::default(),
            walls: vec![WallScenario { name: "six-nodes".to_owned(), ..WallScenario::default() }],
        }
    }
}

impl WallStudyConfig {
    /// Reads a study file. Files that it names are looked for from its own folder.
    ///
    /// # Errors
    /// [`Error`] names the file, the key, what was found and what was wanted.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let mut config: Self = files::read_toml(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        config.files_mut().into_iter().for_each(|file| *file = folder.join(&*file));
        Ok(config)
    }

    /// The files that it names.
    fn files_mut(&mut self) -> Vec<&mut PathBuf> {
        let Self { rules, walls, .. } = self;
        let mut found: Vec<&mut PathBuf> = Vec::new();
        let mut all: Vec<&mut NodeRule> = rules.iter_mut().collect();
        for wall in walls {
            found.extend(&mut wall.file);
            all.extend(wall.rules.iter_mut().flatten());
        }
        found.extend(all.into_iter().filter_map(|rule| match rule {
            NodeRule::Evolved(file) => Some(file),
            _ => None,
        }));
        found
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key, what was found and what was wanted.
    pub fn check(&self) -> Result<(), Error> {
        Error::check_range("plants", self.plants, 100_000)?;
        self.evolution.check().map_err(Error::in_plan("evolution"))?;
        NodeWall::levels(&self.evolve_levels).check().map_err(Error::in_plan("evolve_levels"))?;
        if self.walls.is_empty() {
            return Err(Error::Plan("`walls` is empty: name at least one".to_owned()));
        }
        // A wall is a folder beside the files of the study.
        let networks: Vec<String> = self.evolve.iter().map(|&seed| network_name(seed)).collect();
        let mut files = vec!["run.lock", WallStudyPlan::RECORD];
        files.extend(WallStudyPlan::RESULTS);
        files.extend(networks.iter().map(String::as_str));
        check_names("walls", &files, self.walls.iter().map(|wall| wall.name.as_str()))?;
        // Each network is a file that is called by its seed.
        let seeds: Vec<String> = self.evolve.iter().map(u64::to_string).collect();
        check_names("evolve", &[], seeds.iter().map(String::as_str))?;
        for wall in &self.walls {
            let rules = wall.rules.as_ref().unwrap_or(&self.rules);
            let has_evolved = wall.evolved && !self.evolve.is_empty();
            let problem = if wall.file.is_some() && wall.levels.is_some() {
                "found `levels` beside `file`, wanted one of the two"
            } else if rules.is_empty() && !has_evolved {
                "no rule runs in its nodes: name at least one"
            } else {
                continue;
            };
            return Err(Error::Plan(format!("wall {}: {problem}", wall.name)));
        }
        self.walls.iter().try_for_each(|wall| check_rules(wall.rules.as_ref().unwrap_or(&self.rules)))
    }
}

/// Tests rules of nodes on many walls, in a folder that can be resumed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WallStudyPlan {
    /// Folder for networks, figures and results.
    pub out: PathBuf,
    /// Whether to continue in `out`.
    pub resume: bool,
    /// Everything that decides the results.
    pub config: WallStudyConfig,
}

impl Default for WallStudyPlan {
    fn default() -> Self {
        Self { out: "walls".into(), resume: false, config: WallStudyConfig::default() }
    }
}

/// What decides the results: the content of `walls.toml`.
#[derive(Serialize)]
struct WallStudyRecord<'p> {
    schema: &'static str,
    version: &'static str,
    is_virtual: bool,
    config: &'p WallStudyConfig,
    files: Vec<WallFile>,
}

/// A rule that an evolution made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvolvedRule {
    /// Name of the rule.
    pub name: String,
    /// Seed of the evolution.
    pub seed: u64,
    /// What its network did on fresh plants of the model.
    pub test: NodeScore,
}

/// What became of the plants before one wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallScenarioResults {
    /// Name of the wall.
    pub name: String,
    /// Number of its nodes.
    pub nodes: u32,
    /// Each rule.
    pub rules: Vec<NodeRuleResults>,
}

/// The results of a [`WallStudyPlan`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallStudyResults {
    /// Always true.
    pub is_virtual: bool,
    /// Number of plants before each wall.
    pub plants: u32,
    /// The rules that evolutions made.
    pub evolved: Vec<EvolvedRule>,
    /// Each wall, in the order of the study.
    pub walls: Vec<WallScenarioResults>,
}

impl Workflow for WallStudyPlan {
    type Results = WallStudyResults;

    const SCHEMA: &'static str = "tropism.wall-study/1";

    fn check(&self) -> Result<(), Error> {
        self.config.check()
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<WallStudyResults, Error> {
        work::perform(self, monitor)
    }
}

impl Work for WallStudyPlan {
    const WORKFLOW: &'static str = "wall_study";
    const NAME: &'static str = "a study of walls";
    const RECORD: &'static str = "walls.toml";
    const RESULTS: &'static [&'static str] = &["walls.json"];

    type Begun<'p> = Walls<'p>;

    fn out(&self) -> &Path {
        &self.out
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        [&mut self.out].into_iter().chain(self.config.files_mut()).collect()
    }

    /// Files of walls and rules must still be where they were.
    fn of_folder(out: &Path) -> Result<Self, Error> {
        #[derive(Deserialize)]
        struct Record {
            config: WallStudyConfig,
        }
        let Record { config } = files::read_toml(&out.join(Self::RECORD))?;
        Ok(Self { out: out.to_owned(), resume: true, config })
    }

    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let plan = Self::of_folder(folder)?;
        let done = |files: Vec<PathBuf>| {
            (files.iter().filter(|file| file.exists()).count() as u64, files.len() as u64)
        };
        let (evolved, evolutions) = done(plan.config.evolve.iter().map(|&seed| plan.network(seed)).collect());
        let (tested, walls) = done(plan.config.walls.iter().map(|wall| plan.results_file(wall)).collect());
        let evolution =
            (evolutions > 0).then(|| PartStatus::new("evolutions", evolved, evolutions, "networks"));
        let test = PartStatus::new("walls", tested, walls, "walls");
        WorkStatus::of::<Self>(folder, evolution.into_iter().chain([test]).collect())
    }

    fn begin(&self, _monitor: &dyn Monitor) -> Result<Walls<'_>, Error> {
        let file = |wall: &WallScenario| {
            let mut file = match (&wall.file, &wall.levels) {
                (Some(path), _) => WallFile::read(path)?,
                (None, levels) => {
                    let wall = levels.as_deref().map_or_else(NodeWall::three_levels, NodeWall::levels);
                    WallFile { wall, ..WallFile::default() }
                }
            };
            let WallScenario { sensor, camera, machine, .. } = wall.clone();
            file.sensor = sensor.unwrap_or(file.sensor);
            file.camera = camera.or(file.camera);
            file.machine = machine.unwrap_or(file.machine);
            file.check()
                .and_then(|()| wall.faults.check().map_err(Error::in_plan("faults")))
                .map_err(Error::at(format!("wall {}", wall.name)))?;
            Ok(file)
        };
        let files = self.config.walls.iter().map(file).collect::<Result<_, Error>>()?;
        Ok(Walls { plan: self, files })
    }

    fn collect(&self, begun: &Walls<'_>, _monitor: &dyn Monitor) -> Result<WallStudyResults, Error> {
        let evolved = self.config.evolve.iter().map(|&seed| {
            let path = self.network(seed);
            let rule = NodeRule::Evolved(path.clone());
            Ok(EvolvedRule { name: rule.name(), seed, test: NodesFile::read(&path)?.nodes.test })
        });
        let walls = self.config.walls.iter().zip(&begun.files).map(|(wall, file)| {
            let results: WallResults =
                files::read_as(&self.results_file(wall), |text| serde_json::from_str(text))?;
            let nodes = file.wall.nodes.len() as u32;
            Ok(WallScenarioResults { name: wall.name.clone(), nodes, rules: results.rules })
        });
        let results = WallStudyResults {
            is_virtual: true,
            plants: self.config.plants,
            evolved: evolved.collect::<Result<_, Error>>()?,
            walls: walls.collect::<Result<_, Error>>()?,
        };
        files::write_json(&self.out.join("walls.json"), &results)?;
        Ok(results)
    }
}

/// The name of the file of the network of an evolution.
fn network_name(seed: u64) -> String {
    format!("evolved-{seed}.json")
}

impl WallStudyPlan {
    /// The file of the network of an evolution.
    fn network(&self, seed: u64) -> PathBuf {
        self.out.join(network_name(seed))
    }

    /// The file with the results of a wall.
    fn results_file(&self, wall: &WallScenario) -> PathBuf {
        self.out.join(&wall.name).join("wall.json")
    }
}

/// A study of walls at work.
pub struct Walls<'p> {
    plan: &'p WallStudyPlan,
    /// What the file of each wall says, with what the study changes.
    files: Vec<WallFile>,
}

/// What a unit does.
enum At<'p> {
    Evolution(u64),
    Wall(&'p WallScenario, &'p WallFile),
}

impl Walls<'_> {
    fn at(&self, Place { stage, unit }: Place) -> At<'_> {
        let WallStudyConfig { evolve, walls, .. } = &self.plan.config;
        match evolve.get(unit) {
            Some(&seed) if stage == 0 => At::Evolution(seed),
            _ => At::Wall(&walls[unit], &self.files[unit]),
        }
    }
}

impl Units for Walls<'_> {
    fn record(&self) -> Result<Record, Error> {
        let absolute = self.plan.clone().with_absolute_paths()?;
        let content = WallStudyRecord {
            schema: WallStudyPlan::SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            is_virtual: true,
            config: &absolute.config,
            files: self.files.clone(),
        };
        Record::of(self.plan, &content)
    }

    fn stages(&self) -> Vec<Stage> {
        let WallStudyConfig { evolve, walls, .. } = &self.plan.config;
        let evolutions = evolve
            .iter()
            .map(|seed| Unit::new(format!("evolved-{seed}"), format!("evolution of nodes with seed {seed}")));
        let walls = walls.iter().map(|wall| Unit::new(&wall.name, format!("plants before {}", wall.name)));
        let stage = |name: &str, units: Vec<Unit>| Stage { name: name.to_owned(), pace: Pace::Nested, units };
        let stages = [stage("evolutions", evolutions.collect()), stage("walls", walls.collect())];
        stages.into_iter().filter(|stage| !stage.units.is_empty()).collect()
    }

    fn is_done(&self, place: Place) -> Result<bool, Error> {
        Ok(match self.at(place) {
            At::Evolution(seed) => self.plan.network(seed).exists(),
            At::Wall(wall, _) => self.plan.results_file(wall).exists(),
        })
    }

    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        let config = &self.plan.config;
        match self.at(place) {
            At::Evolution(seed) => {
                let wall = NodeWall::levels(&config.evolve_levels);
                let plan = EvolveNodesPlan {
                    file: WallFile { wall, ..WallFile::default() },
                    config: config.evolution.clone(),
                    seed,
                    out: self.plan.network(seed),
                    ..EvolveNodesPlan::default()
                };
                plan.execute(monitor).map(drop)
            }
            At::Wall(wall, file) => {
                let mut rules = wall.rules.as_ref().unwrap_or(&config.rules).clone();
                if wall.evolved {
                    rules
                        .extend(config.evolve.iter().map(|&seed| NodeRule::Evolved(self.plan.network(seed))));
                }
                let plan = WallPlan {
                    file: file.clone(),
                    rules,
                    plants: config.plants,
                    faults: wall.faults,
                    seed: config.seed,
                    out: Some(self.plan.out.join(&wall.name)),
                    // Those of an interrupted wall are written again.
                    replace: true,
                    ..WallPlan::default()
                };
                let results = plan.execute(monitor)?;
                Ok(files::write_json(&self.plan.results_file(wall), &results)?)
            }
        }
    }

    fn reached(&self, milestone: &Milestone, monitor: &dyn Monitor) -> Result<(), Error> {
        if *milestone == Milestone::Begun {
            monitor.note("virtual plants: nothing here is a measurement of a living plant");
        }
        Ok(())
    }
}
