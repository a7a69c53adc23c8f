//! Virtual plants before a wall of nodes: do the nodes lead them along the drawn path?
//!
//! In: a wall with its sensors or cameras, faults, rules for the nodes, and a seed. Out: for each rule the share of right decisions and of
//! whole paths over the same unseen plants. Plants are judged by their true apex; nodes know their sensors and messages only.
//! [`EvolveNodesPlan`] makes a rule by evolution, [`WallStudyPlan`] tests rules, evolved ones too, on many walls, and
//! [`WatchWallPlan`] watches a real wall.

mod evolve;
mod study;
mod watch;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::check;
use tropism::math::statistics::{mean, wilson_interval};
use tropism::nodes::{
    Baseline, NetworkNode, NodeController, NodeFaults, NodeMessage, NodeRow, NodeWall, Proximity,
    StateMachine, StateMachineSettings, WallPath,
};
use tropism::parallel;
use tropism::random::{self, Purpose};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::Species;
use tropism_bean::render::NodeCamera;
use tropism_bean::wall::{WallRun, WallTrial};
use tropism_report::{Plants, WallPlant, files as figure_files, wall as wall_figure};
use tropism_rig::node::NodeProcess;

pub use self::evolve::{EvolveNodesPlan, NodesFile};
pub use self::study::{
    EvolvedRule, WallScenario, WallScenarioResults, WallStudyConfig, WallStudyPlan, WallStudyResults,
};
pub use self::watch::{WatchWallPlan, WatchWallResults, WatchedNode};
use crate::transfer::repeated;
use crate::{Error, Monitor, Workflow, files};

/// Plants that a thread grows side by side. Chosen: two groups of vector lanes, few enough for several threads.
const SIDE_BY_SIDE: usize = 8;
/// Distance of the apex from a node of the path within which it counts as near, in cm.
const NEAR_CM: f64 = 2.0;
/// Share of the distance between columns that the range of a sensor should not exceed (docs/validation/nodes.md).
const MOST_RANGE: f64 = 0.6;

/// A wall file: nodes, sensors, and the settings of the state machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WallFile {
    /// Nodes, links and path.
    pub wall: NodeWall,
    /// The proximity sensor of each node.
    #[serde(default)]
    pub sensor: Proximity,
    /// A camera in each node instead. Evolution keeps to the proximity sensor: its models have no pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<NodeCamera>,
    /// The state machine of each node.
    #[serde(default)]
    pub machine: StateMachineSettings,
}

impl Default for WallFile {
    fn default() -> Self {
        Self {
            wall: NodeWall::three_levels(),
            sensor: Proximity::default(),
            camera: None,
            machine: StateMachineSettings::default(),
        }
    }
}

impl WallFile {
    /// Reads a wall file.
    ///
    /// # Errors
    /// [`Error`] names file, place and remedy.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let file: Self = files::read_toml(path)?;
        file.check().map_err(|error| match error {
            Error::Plan(text) => Error::Plan(format!("{}: {text}", path.display())),
            other => other,
        })?;
        Ok(file)
    }

    /// Checks all settings.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key.
    pub fn check(&self) -> Result<(), Error> {
        self.wall.check().map_err(Error::in_plan("wall"))?;
        self.sensor.check().map_err(Error::in_plan("sensor"))?;
        self.camera.iter().try_for_each(NodeCamera::check).map_err(Error::in_plan("camera"))?;
        self.machine.check().map_err(Error::in_plan("machine"))
    }

    /// What the process of the node `name` needs to know of the wall, whose path is drawn.
    ///
    /// # Errors
    /// [`Error::Plan`] if the wall has no such node or its path is random, or a name cannot stand in a topic.
    pub fn node_process(
        &self,
        name: &str,
        experiment: &str,
        tasmota: Option<String>,
        period: Duration,
    ) -> Result<NodeProcess, Error> {
        let nodes = &self.wall.nodes;
        let of = |number: usize| nodes[number].name.clone();
        let known = || nodes.iter().map(|node| node.name.as_str()).collect::<Vec<_>>().join(", ");
        let unknown = || Error::Plan(format!("found node {name:?}, wanted {}", known()));
        let number = nodes.iter().position(|node| node.name == name).ok_or_else(unknown)?;
        let path = self.drawn_path()?;
        let place = path.iter().position(|&other| other == number);
        let at = |place: usize| path.get(place).map(|&other| of(other));
        let process = NodeProcess {
            experiment: experiment.to_owned(),
            name: name.to_owned(),
            is_on_path: place.is_some(),
            previous: place.and_then(|place| place.checked_sub(1)).and_then(at),
            next: place.and_then(|place| at(place + 1)),
            siblings: self.wall.siblings(number).into_iter().map(of).collect(),
            period,
            tasmota,
        };
        process.check().map_err(Error::Plan)?;
        Ok(process)
    }

    /// Numbers of the nodes on the path, lowest first.
    ///
    /// # Errors
    /// [`Error::Plan`] if the path is random.
    pub fn drawn_path(&self) -> Result<Vec<usize>, Error> {
        if self.wall.path == WallPath::Random {
            return Err(Error::Plan("wall.path: found \"random\", wanted the names of its nodes".to_owned()));
        }
        Ok(self.wall.path_of(0))
    }

    /// What may go wrong on this wall, in words.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let range = self.sensor.range_cm;
        let far = self.wall.column_distance_cm().filter(|distance| range > MOST_RANGE * distance);
        let warn = |distance| {
            format!(
                "sensor.range_cm = {range}: more than {MOST_RANGE} of the {distance} cm between nodes of one level; nodes may \
                 take a plant on the other side for arrived"
            )
        };
        far.map(warn).into_iter().collect()
    }
}

/// A rule that runs in every node.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum NodeRule {
    /// The hand-written state machine.
    Machine,
    /// No lamp is ever lit: the control.
    Dormant,
    /// All lamps are lit all the time.
    AllLit,
    /// The lamps of the path are lit all the time.
    PathLit,
    /// The evolved network of a file.
    Evolved(PathBuf),
}

/// Checks that each rule has a name of its own, as its files do.
pub(super) fn check_rules(rules: &[NodeRule]) -> Result<(), Error> {
    let names: Vec<String> = rules.iter().map(NodeRule::name).collect();
    match repeated(&names) {
        Some(name) => {
            Err(Error::Plan(format!("`rules`: two are called {name:?}, and so are their files: rename one")))
        }
        None => Ok(()),
    }
}

/// Makes the controller of each node.
type MakeController<'a> = Box<dyn Fn() -> Box<dyn NodeController> + Sync + 'a>;

impl NodeRule {
    /// Its name in commands and files.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Machine => "machine".to_owned(),
            Self::Dormant => "dormant".to_owned(),
            Self::AllLit => "all-lit".to_owned(),
            Self::PathLit => "path-lit".to_owned(),
            Self::Evolved(path) => path.file_stem().map_or_else(String::new, files::name_text),
        }
    }

    fn load(&self, machine: StateMachineSettings) -> Result<MakeController<'static>, Error> {
        Ok(match self {
            Self::Machine => Box::new(move || Box::new(StateMachine::new(machine))),
            Self::Dormant => Box::new(|| Box::new(Baseline::Dormant)),
            Self::AllLit => Box::new(|| Box::new(Baseline::AllLit)),
            Self::PathLit => Box::new(|| Box::new(Baseline::PathLit)),
            Self::Evolved(path) => {
                let nodes = NodesFile::read(path)?.nodes;
                let node = NetworkNode::new(&nodes.genome, nodes.detector).ok_or_else(|| {
                    Error::Plan(format!(
                        "{}: found a network with other inputs or outputs than a node has",
                        path.display()
                    ))
                })?;
                Box::new(move || Box::new(node.clone()))
            }
        })
    }
}

/// Grows virtual plants before a wall under each rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WallPlan {
    /// The wall.
    pub file: WallFile,
    /// Rules that run in the nodes, each with the same plants.
    pub rules: Vec<NodeRule>,
    /// Number of plants, 1 to 100000.
    pub plants: u32,
    /// Species of the plants.
    pub species: Species,
    /// Individual variation as a multiple of that of the species, 0 to 2.
    pub variation: f64,
    /// Faults of nodes and messages.
    pub faults: NodeFaults,
    /// For how long the nodes learn the empty scene, in h: 2 to 1000.
    pub learning_h: f64,
    /// Time from one step to the next, in min: 0.1 to 60. Paper: 5 (section 2.1).
    pub period_min: f64,
    /// Largest number of steps with the plant, 1 to 100000.
    pub max_steps: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Folder for figure and journals; none writes nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
    /// Whether files that are there are replaced.
    pub replace: bool,
}

impl Default for WallPlan {
    fn default() -> Self {
        Self {
            file: WallFile::default(),
            rules: vec![NodeRule::Machine, NodeRule::Dormant],
            plants: 90,
            species: Species::default(),
            variation: 1.0,
            faults: NodeFaults::default(),
            learning_h: 24.0,
            period_min: PAPER_PERIOD_MIN,
            max_steps: 1000,
            seed: 1,
            out: None,
            replace: false,
        }
    }
}

/// A count out of a number, with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CountedShare {
    /// How many.
    pub count: u32,
    /// Out of how many.
    pub of: u32,
    /// The share, 0 to 1; 0 of none.
    pub share: f64,
    /// Its 95 % interval (Wilson). Decisions of one plant depend on each other, so a share of decisions has the interval of the
    /// same share of plants: rather too wide than too narrow.
    pub interval: [f64; 2],
}

impl CountedShare {
    fn of(all: impl Iterator<Item = bool> + Clone, plants: u32) -> Self {
        let (count, of) = (all.clone().filter(|&holds| holds).count() as u32, all.count() as u32);
        let trials = f64::from(of.min(plants));
        let share = if of == 0 { 0.0 } else { f64::from(count) / f64::from(of) };
        let interval = if of == 0 { [0.0, 1.0] } else { wilson_interval(share * trials, trials) };
        Self { count, of, share, interval }
    }

    /// `269 of 270, 100 % (98 to 100)`.
    #[must_use]
    pub fn in_words(&self) -> String {
        let [low, high] = self.interval.map(|share| 100.0 * share);
        format!("{} of {}, {:.0} % ({low:.0} to {high:.0})", self.count, self.of, 100.0 * self.share)
    }
}

/// What became of the plants under one rule.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeRuleResults {
    /// The rule.
    pub rule: NodeRule,
    /// Right decisions of those taken: the apex first reached the height of a node of the path on its side.
    pub right: CountedShare,
    /// Plants that took all decisions of their path, and all rightly.
    pub whole: CountedShare,
    /// Nodes of the path to which the apex came within 2 cm in the plane.
    pub near: CountedShare,
    /// Right decisions of those taken above the lowest dead lamp; only with dead lamps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub above_dead_lamp: Option<CountedShare>,
    /// Mean hours of lamp light a plant, at level 255.
    pub lit_h: f64,
    /// Mean hours that a plant took.
    pub hours: f64,
    /// Each plant.
    pub plants: Vec<PlantOnWall>,
}

/// One plant before the wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlantOnWall {
    /// Its seed.
    pub seed: u64,
    /// Names of the nodes on its path.
    pub path: Vec<String>,
    /// Whether each decision taken was right.
    pub right: Vec<bool>,
    /// Steps with the plant.
    pub steps: u32,
    /// Nodes whose lamp was dead.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dead_lamps: Vec<String>,
}

/// The results of a [`WallPlan`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WallResults {
    /// Always true.
    pub is_virtual: bool,
    /// Each rule, in the order of the plan.
    pub rules: Vec<NodeRuleResults>,
    /// What may go wrong on this wall.
    pub warnings: Vec<String>,
    /// Files that were written.
    pub files: Vec<PathBuf>,
}

impl Workflow for WallPlan {
    type Results = WallResults;

    const SCHEMA: &'static str = "tropism.wall/1";

    fn check(&self) -> Result<(), Error> {
        self.file.check()?;
        self.species.check().map_err(Error::in_plan("species"))?;
        self.faults.check().map_err(Error::in_plan("faults"))?;
        Error::check_range("plants", self.plants, 100_000)?;
        Error::check_range("max_steps", self.max_steps, 100_000)?;
        check::within("variation", self.variation, 0.0..=2.0)
            .and_then(|()| check::within("learning_h", self.learning_h, 2.0..=1000.0))
            .and_then(|()| check::within("period_min", self.period_min, 0.1..=60.0))
            .map_err(|error| Error::Plan(error.to_string()))?;
        if self.rules.is_empty() {
            return Err(Error::Plan("`rules` is empty: name at least one".to_owned()));
        }
        check_rules(&self.rules)?;
        if let (Some(out), false) = (&self.out, self.replace) {
            let there = self.paths(out).into_iter().find(|path| path.exists());
            if let Some(path) = there {
                return Err(Error::Plan(format!(
                    "{}: a file is here already: choose a new folder (`out`), or replace it by `replace`",
                    path.display()
                )));
            }
        }
        Ok(())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<WallResults, Error> {
        let mut results = WallResults {
            is_virtual: true,
            rules: Vec::new(),
            warnings: self.file.warnings(),
            files: Vec::new(),
        };
        for rule in &self.rules {
            monitor.stage(&rule.name(), self.plants.into());
            let runs = self.grow(rule, monitor)?;
            if let Some(out) = &self.out {
                results.files.extend(self.write(out, rule, &runs)?);
            }
            results.rules.push(self.judge(rule, &runs));
        }
        Ok(results)
    }
}

impl WallPlan {
    /// The experiment on each plant.
    #[must_use]
    pub fn trial(&self) -> WallTrial {
        WallTrial {
            wall: self.file.wall.clone(),
            sensor: self.file.sensor.clone(),
            camera: self.file.camera.clone(),
            faults: self.faults,
            scale: self.variation,
            period_min: self.period_min,
            learning_h: self.learning_h,
            max_steps: self.max_steps,
            ..WallTrial::new(self.species.clone())
        }
    }

    /// Seed of a plant, counted from 0.
    #[must_use]
    pub fn plant_seed(&self, plant: u32) -> u64 {
        random::derive(self.seed, Purpose::Judge, plant.into())
    }

    fn grow(&self, rule: &NodeRule, monitor: &dyn Monitor) -> Result<Vec<WallRun>, Error> {
        let trial = self.trial();
        let seeds: Vec<u64> = (0..self.plants).map(|plant| self.plant_seed(plant)).collect();
        let groups: Vec<&[u64]> = seeds.chunks(SIDE_BY_SIDE).collect();
        let controller = rule.load(self.file.machine)?;
        let grown = parallel::try_map(groups.len(), |group| {
            let keeps_rows = group == 0 && self.out.is_some();
            let runs = trial.grow(groups[group], &*controller, keeps_rows);
            monitor.advance(runs.len() as u64);
            if monitor.may_go_on() { Ok(runs) } else { Err(Error::cancelled()) }
        })?;
        Ok(grown.concat())
    }

    fn judge(&self, rule: &NodeRule, runs: &[WallRun]) -> NodeRuleResults {
        let name = |&node: &usize| self.file.wall.nodes[node].name.clone();
        let decisions = runs.iter().flat_map(|run| run.decisions.iter().map(|decision| decision.is_right));
        let nearest = runs.iter().flat_map(|run| run.nearest_cm.iter().map(|&far| far <= NEAR_CM));
        let above = runs.iter().flat_map(|run| {
            let dead = run.path.iter().position(|node| run.dead_lamps.contains(node));
            let from = dead.map_or(run.path.len(), |dead| dead + 1);
            run.decisions.iter().skip(from).map(|decision| decision.is_right)
        });
        NodeRuleResults {
            rule: rule.clone(),
            right: CountedShare::of(decisions, self.plants),
            whole: CountedShare::of(runs.iter().map(WallRun::is_whole), self.plants),
            near: CountedShare::of(nearest, self.plants),
            above_dead_lamp: (self.faults.dead_lamps > 0).then(|| CountedShare::of(above, self.plants)),
            lit_h: mean(runs.iter().map(|run| run.lit_h)),
            hours: mean(runs.iter().map(|run| f64::from(run.steps) * self.period_min / 60.0)),
            plants: runs
                .iter()
                .map(|run| PlantOnWall {
                    seed: run.seed,
                    path: run.path.iter().map(name).collect(),
                    right: run.decisions.iter().map(|decision| decision.is_right).collect(),
                    steps: run.steps,
                    dead_lamps: run.dead_lamps.iter().map(name).collect(),
                })
                .collect(),
        }
    }

    /// All files that the plan may write, but for pictures in other formats.
    fn paths(&self, out: &Path) -> Vec<PathBuf> {
        let of = |rule: &NodeRule| {
            [format!("{}-nodes.csv", rule.name()), format!("{}-wall.svg", rule.name())]
                .map(|name| out.join(name))
        };
        self.rules.iter().flat_map(of).collect()
    }

    /// Writes the figure of the first plants, and what each node said before the first one.
    fn write(&self, out: &Path, rule: &NodeRule, runs: &[WallRun]) -> Result<Vec<PathBuf>, Error> {
        files::make_folder(out)?;
        let places: Vec<[f64; 3]> = self.file.wall.nodes.iter().map(|node| node.at).collect();
        let plants: Vec<WallPlant> = (1..).zip(runs).map(plant).collect();
        let figure = wall_figure(&places, &plants, Plants::Virtual);
        let mut written = Vec::new();
        for (name, bytes) in figure_files(std::slice::from_ref(&figure)) {
            let path = out.join(name.replace("figure-wall", &format!("{}-wall", rule.name())));
            files::write(&path, &bytes)?;
            written.push(path);
        }
        let path = out.join(format!("{}-nodes.csv", rule.name()));
        files::write(&path, self.journal(&runs[0].rows).as_bytes())?;
        written.push(path);
        Ok(written)
    }

    /// A row for each node and step.
    fn journal(&self, rows: &[NodeRow]) -> String {
        let mut text = JOURNAL_HEAD.to_owned();
        for row in rows {
            let _ = writeln!(text, "{}", journal_row(&self.file.wall, row));
        }
        text
    }
}

/// The head of a journal of nodes.
const JOURNAL_HEAD: &str = "step,node,reading,level,sees,done,lamp_is_dead\n";

/// What a node said, as a row of a journal.
fn journal_row(wall: &NodeWall, NodeRow { step, node, message }: &NodeRow) -> String {
    let NodeMessage { reading, level, sees, done, lamp_is_dead, .. } = message;
    let reading = reading.map_or(String::new(), |reading| format!("{reading:.4}"));
    let [sees, done, lamp_is_dead] = [sees, done, lamp_is_dead].map(|&is| u8::from(is));
    format!("{step},{},{reading},{level},{sees},{done},{lamp_is_dead}", wall.nodes[*node].name)
}

fn plant((number, run): (u32, &WallRun)) -> WallPlant {
    WallPlant {
        title: format!("plant {number}"),
        path: run.path.clone(),
        apex: run.apex.clone(),
        decisions: run
            .decisions
            .iter()
            .map(|decision| ([decision.apex[0], decision.apex[1]], decision.is_right))
            .collect(),
    }
}
