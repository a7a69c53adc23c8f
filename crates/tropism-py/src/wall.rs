//! A plant before a wall of nodes, an agent a node: what the environment of multi-agent learning steps through.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyReadonlyArray2};
use pyo3::prelude::*;
use tropism::geometry::space::SpacePoint;
use tropism::nodes::{NODE_OUTPUTS, NodeDecision, NodeInterface};
use tropism_bean::render::Renderer;
use tropism_bean::scene::Scene;
use tropism_bean::view::View;
use tropism_bean::wall::WallEnvironment;
use tropism_lab::Workflow;
use tropism_lab::wall::{WallFile, WallPlan};

use crate::error::{parsed, refused};
use crate::workflow::of_lab;

/// What nodes sense: (nodes, numbers); the reward; whether the episode terminated; whether it was truncated.
type WallStep<'py> = (Bound<'py, PyArray2<f64>>, f64, bool, bool);

/// A decision of a plant: the node, the step, the apex in cm, and whether it was right.
type PlantDecision = (String, u32, SpacePoint, bool);

/// A wall with the plant before it.
#[pyclass(module = "tropism._core")]
pub(crate) struct Wall {
    plan: WallPlan,
    environment: Option<WallEnvironment>,
    is_over: bool,
}

impl Wall {
    fn begun(&self) -> PyResult<&WallEnvironment> {
        self.environment.as_ref().ok_or_else(not_begun)
    }

    fn name(&self, node: usize) -> String {
        self.plan.file.wall.nodes[node].name.clone()
    }
}

fn not_begun() -> PyErr {
    refused("no episode has begun: call reset before step")
}

fn rows<'py>(py: Python<'py>, environment: &WallEnvironment) -> Bound<'py, PyArray2<f64>> {
    Array2::from(environment.sensed()).into_pyarray(py)
}

#[pymethods]
impl Wall {
    /// `wall` (keys of a wall file), `faults` and `bean` are JSON. A wall file without nodes has those of the default wall.
    #[new]
    fn new(
        wall: &str,
        faults: &str,
        bean: &str,
        variation: f64,
        period_min: f64,
        max_steps: u32,
        learning_h: f64,
    ) -> PyResult<Self> {
        let mut settings: serde_json::Map<_, _> = parsed("wall", wall)?;
        if !settings.contains_key("wall") {
            let nodes = serde_json::to_value(WallFile::default().wall).map_err(refused)?;
            settings.insert("wall".to_owned(), nodes);
        }
        let plan = WallPlan {
            file: parsed("wall", &serde_json::Value::from(settings).to_string())?,
            faults: parsed("faults", faults)?,
            species: parsed("bean", bean)?,
            variation,
            period_min,
            max_steps,
            learning_h,
            ..WallPlan::default()
        };
        plan.check().map_err(of_lab)?;
        Ok(Self { plan, environment: None, is_over: true })
    }

    /// Names of the nodes.
    #[getter]
    fn nodes(&self) -> Vec<String> {
        (0..self.plan.file.wall.nodes.len()).map(|node| self.name(node)).collect()
    }

    /// Places of the nodes: x, y, z in cm.
    #[getter]
    fn places(&self) -> Vec<SpacePoint> {
        self.plan.file.wall.nodes.iter().map(|node| node.at).collect()
    }

    /// The wall file with all its keys, as JSON.
    #[getter]
    fn file(&self) -> PyResult<String> {
        serde_json::to_string(&self.plan.file).map_err(refused)
    }

    /// Least and largest value of each number that a node senses.
    #[classattr]
    fn bounds() -> Vec<(f64, f64)> {
        NodeInterface::BOUNDS.map(<(f64, f64)>::from).to_vec()
    }

    /// Number of decisions of a node, each yes or no.
    #[classattr]
    fn outputs() -> usize {
        NODE_OUTPUTS
    }

    /// Begins the episode of a plant, by its number under a seed; what the nodes sense. The learning time of the nodes passes.
    fn begin<'py>(&mut self, py: Python<'py>, seed: u64, plant: u32) -> Bound<'py, PyArray2<f64>> {
        let plan = WallPlan { seed, ..self.plan.clone() };
        let detector = plan.file.machine.detector;
        let environment = py.detach(|| WallEnvironment::new(plan.trial(), detector, plan.plant_seed(plant)));
        self.is_over = false;
        rows(py, self.environment.insert(environment))
    }

    /// Takes the decisions of all nodes, (nodes, 2), and lets the plant grow for a step.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        decisions: PyReadonlyArray2<'py, i64>,
    ) -> PyResult<WallStep<'py>> {
        let environment = self.environment.as_mut().ok_or_else(not_begun)?;
        if self.is_over {
            return Err(refused("the episode is over: call reset before step"));
        }
        let decisions = decisions.as_array();
        let (found, wanted) = (decisions.dim(), (self.plan.file.wall.nodes.len(), NODE_OUTPUTS));
        if found != wanted {
            return Err(refused(format!("found decisions of shape {found:?}, wanted {wanted:?}")));
        }
        if let Some(value) = decisions.iter().find(|value| !(0..=1).contains(*value)) {
            return Err(refused(format!("found action {value}, wanted 0 or 1")));
        }
        let decision = |row: numpy::ndarray::ArrayView1<'_, i64>| NodeDecision {
            is_lit: row[0] == 1,
            done: row[1] == 1,
        };
        let decisions: Vec<NodeDecision> = decisions.outer_iter().map(decision).collect();
        let reward = py.detach(|| environment.step(&decisions));
        let is_done = environment.is_decided();
        let is_truncated = !is_done && environment.is_out_of_time();
        self.is_over = is_done || is_truncated;
        Ok((rows(py, environment), reward, is_done, is_truncated))
    }

    /// Names of the nodes on the path, lowest first.
    fn path(&self) -> PyResult<Vec<String>> {
        Ok(self.begun()?.run().path.iter().map(|&node| self.name(node)).collect())
    }

    /// The decisions that the plant has taken, lowest first.
    fn decisions(&self) -> PyResult<Vec<PlantDecision>> {
        let taken = self.begun()?.run().decisions.iter();
        let words =
            |one: &tropism_bean::wall::Decision| (self.name(one.node), one.step, one.apex, one.is_right);
        Ok(taken.map(words).collect())
    }

    /// The true apex, in cm.
    fn apex(&self) -> PyResult<SpacePoint> {
        Ok(self.begun()?.pose().apex())
    }

    /// Hours of lamp light, summed over all lamps.
    fn lit_h(&self) -> PyResult<f64> {
        Ok(self.begun()?.run().lit_h)
    }

    /// Whether the lamp of each node was lit in the last step.
    fn lit(&self) -> PyResult<Vec<bool>> {
        let levels = self.begun()?.lighting().levels();
        Ok(levels[..self.plan.file.wall.nodes.len()].iter().map(|&level| level > 0).collect())
    }

    /// Whether each node is alive.
    fn alive(&self) -> PyResult<Vec<bool>> {
        Ok(self.begun()?.alive().collect())
    }

    /// A photograph of the plant by the front camera, with flash and without the nodes: (height, width, 3).
    fn photograph<'py>(
        &self,
        py: Python<'py>,
        width: u32,
        height: u32,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let environment = self.begun()?;
        let scene = Scene { width, height, ..Scene::default() };
        scene.check().map_err(refused)?;
        let run = environment.run();
        let image = py.detach(|| {
            let mut renderer = Renderer::at(View::Front, &scene, run.seed);
            renderer.draw(environment.pose(), None, true, u64::from(run.steps))
        });
        crate::tent::pixels(py, image)
    }
}
