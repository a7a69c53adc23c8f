//! Evolution of the network of all nodes on a model of plants.
//!
//! In: a wall, and a model of plants before it or none. Out: a file with the network. Without a model, virtual plants grow open loop
//! before the wall, and one in space is made of their tracks.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::check;
use tropism::nodes::{EvolvedNodes, NodeEvolution, NodeEvolutionConfig};
use tropism::parallel;
use tropism::plant::PlantModel;
use tropism::plant::tip::TipModelConfig;
use tropism::random::{self, Purpose};
use tropism::simulation::ModelKind;
use tropism::track::Track;
use tropism_bean::Species;
use tropism_bean::wall::WallTrial;

use super::WallFile;
use crate::model::{self, Model};
use crate::{Error, Monitor, Workflow, files};

/// A file of evolved nodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NodesFile {
    /// `tropism.nodes/1`.
    pub schema: String,
    /// Whether the model is of virtual plants.
    pub is_virtual: bool,
    /// SHA-256 of the model on which the nodes were evolved, in hexadecimal.
    pub model_sha256: String,
    /// The nodes.
    pub nodes: EvolvedNodes,
}

/// Schema of a [`NodesFile`].
const NODES_SCHEMA: &str = "tropism.nodes/1";

impl NodesFile {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error`] names the file and what is wrong.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let problem = |problem: String| Error::Plan(format!("{}: {problem}", path.display()));
        let text = files::read_text(path)?;
        let file: Self = serde_json::from_str(&text).map_err(|error| problem(error.to_string()))?;
        if file.schema != NODES_SCHEMA {
            return Err(problem(format!("found schema {:?}, wanted {NODES_SCHEMA:?}", file.schema)));
        }
        file.nodes.detector.check().map_err(|error| problem(error.to_string()))?;
        Ok(file)
    }
}

/// Evolves the network of all nodes: plants before the wall, a model of them in space, evolution on the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvolveNodesPlan {
    /// The wall.
    pub file: WallFile,
    /// File of a model in space of plants before this wall; none makes one of virtual plants.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<PathBuf>,
    /// Settings of the evolution.
    pub config: NodeEvolutionConfig,
    /// Virtual plants of which a model is made, 2 to 10000.
    pub open_loop_plants: u32,
    /// Species of the plants.
    pub species: Species,
    /// Individual variation as a multiple of that of the species, 0 to 2.
    pub variation: f64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// File for the nodes.
    pub out: PathBuf,
    /// Whether a file that is there is replaced.
    pub replace: bool,
}

impl Default for EvolveNodesPlan {
    fn default() -> Self {
        Self {
            file: WallFile::default(),
            model: None,
            config: NodeEvolutionConfig::default(),
            open_loop_plants: 24,
            species: Species::default(),
            variation: 1.0,
            seed: 1,
            out: "nodes.json".into(),
            replace: false,
        }
    }
}

/// Steps of an open-loop plant before the wall, and hours between two changes of its lamps. Chosen: 50 h, in which the bean
/// grows past three levels; and the paper's six hours (section 2.2.1).
const OPEN_LOOP: (u32, f64) = (600, 6.0);

impl Workflow for EvolveNodesPlan {
    type Results = NodesFile;

    const SCHEMA: &'static str = "tropism.evolve-nodes/1";

    fn check(&self) -> Result<(), Error> {
        self.file.check()?;
        self.species.check().map_err(Error::in_plan("species"))?;
        self.config.check().map_err(Error::in_plan("config"))?;
        check::within("open_loop_plants", self.open_loop_plants, 2..=10_000)
            .and_then(|()| check::within("variation", self.variation, 0.0..=2.0))
            .map_err(|error| Error::Plan(error.to_string()))?;
        if self.out.exists() && !self.replace {
            return Err(Error::Plan(format!(
                "{}: a file is here already: choose a new one (`out`), or replace it by `replace`",
                self.out.display()
            )));
        }
        Ok(())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<NodesFile, Error> {
        let model = match &self.model {
            Some(path) => self.read_model(path)?,
            None => self.fit_model(monitor)?,
        };
        let evolution = NodeEvolution {
            wall: &self.file.wall,
            sensor: &self.file.sensor,
            detector: self.file.machine.detector,
            model: &model,
            config: &self.config,
        };
        monitor.stage("generations", u64::from(self.config.runs) * u64::from(self.config.generations));
        let watch = |best: f64| {
            monitor.advance(1);
            monitor.status(&format!("best {best:.2}"));
            if monitor.may_go_on() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        let evolved = evolution.evolve(self.seed, &watch).map_err(|error| Error::Plan(error.to_string()))?;
        let nodes = evolved.ok_or_else(Error::cancelled)?;
        let model_sha256 = files::sha256(model.to_json().as_bytes());
        let is_virtual = model.is_virtual();
        let file = NodesFile { schema: NODES_SCHEMA.to_owned(), is_virtual, model_sha256, nodes };
        let text = serde_json::to_string_pretty(&file).expect("numbers and texts");
        files::write(&self.out, text.as_bytes())?;
        Ok(file)
    }
}

impl EvolveNodesPlan {
    /// The model in `path`, which must be of stems in space before this wall.
    fn read_model(&self, path: &Path) -> Result<Model, Error> {
        let model = model::read(path)?;
        let layout = self.file.wall.layout().map_err(|error| Error::Plan(error.to_string()))?;
        let problem = if !model.kind().is_in_space() {
            "a model that is not in space: fit one with `tropism fit --kind space`"
        } else if *model.layout() != layout {
            "a model of other lamps, wanted one whose lamps have the names and places of the wall's nodes"
        } else {
            return Ok(model);
        };
        Err(Error::Plan(format!("found {problem} ({})", path.display())))
    }

    /// A model of virtual plants that grow open loop before the wall.
    fn fit_model(&self, monitor: &dyn Monitor) -> Result<Model, Error> {
        let trial = WallTrial {
            wall: self.file.wall.clone(),
            scale: self.variation,
            ..WallTrial::new(self.species.clone())
        };
        monitor.stage("open-loop plants", self.open_loop_plants.into());
        let tracks = parallel::try_map(self.open_loop_plants as usize, |plant| {
            let seed = random::derive(self.seed, Purpose::Plant, plant as u64);
            let track = trial.open_loop(seed, OPEN_LOOP.0, OPEN_LOOP.1);
            monitor.advance(1);
            if monitor.may_go_on() { Ok(track) } else { Err(Error::cancelled()) }
        })?;
        let tracks: Vec<&Track> = tracks.iter().collect();
        Ok(ModelKind::SPACE.fit(&tracks, &TipModelConfig::default(), true)?)
    }
}
