//! One plant before its wall, in the phases of a step: judge, perceive, act.

use tropism::lighting::Lighting;
use tropism::math::vector::distance;
use tropism::nodes::{NodeController, NodeMessage, NodeView, ProximitySensors, WallNodes};

use super::{Decision, WallRun, WallTrial, patches};
use crate::pose::Pose;
use crate::render::NodeCameras;

/// The sensors of all nodes.
enum Eyes {
    Proximity(ProximitySensors),
    Cameras(Box<NodeCameras>),
}

/// The nodes before one plant, and what became of it so far. The plant itself is handed over at each step, so that many may grow
/// side by side.
pub struct WallEpisode<C: NodeController + ?Sized = dyn NodeController> {
    nodes: WallNodes<C>,
    eyes: Eyes,
    /// How the lamps are lit since the latest step.
    lighting: Lighting,
    run: WallRun,
    keeps_rows: bool,
}

impl<C: NodeController + ?Sized> WallEpisode<C> {
    /// The nodes before the plant of `seed`, after their learning time. `controller` makes the controller of each node. With
    /// `keeps_rows` the run holds what each node said.
    ///
    /// # Panics
    /// Unless wall, sensor and faults are checked.
    pub fn new(trial: &WallTrial, seed: u64, controller: impl Fn() -> Box<C>, keeps_rows: bool) -> Self {
        let period_h = trial.period_min / 60.0;
        let hours = [period_h, trial.learning_h];
        let mut nodes = WallNodes::new(&trial.wall, trial.faults, controller, hours, seed);
        let mut eyes = match &trial.camera {
            None => Eyes::Proximity(trial.sensor.sensors(&trial.wall, period_h, seed)),
            Some(camera) => Eyes::Cameras(Box::new(camera.cameras(&trial.wall, seed))),
        };
        while nodes.learning_steps_left() > 0 {
            match &mut eyes {
                Eyes::Proximity(sensors) => nodes.step(sensors, None),
                Eyes::Cameras(cameras) => nodes.step(&mut **cameras, None),
            };
        }
        let path = nodes.path().to_vec();
        let run = WallRun {
            seed,
            decisions: Vec::new(),
            nearest_cm: vec![f64::INFINITY; path.len()],
            steps: 0,
            lit_h: 0.0,
            dead_lamps: nodes.dead_lamps().collect(),
            apex: Vec::new(),
            rows: Vec::new(),
            path,
        };
        Self { nodes, eyes, lighting: Lighting::DARK, run, keeps_rows }
    }

    /// What became of the plant so far.
    #[must_use]
    pub const fn run(&self) -> &WallRun {
        &self.run
    }

    /// What became of the plant.
    #[must_use]
    pub fn into_run(self) -> WallRun {
        self.run
    }

    /// Whether all decisions of the path are taken.
    #[must_use]
    pub fn is_decided(&self) -> bool {
        self.run.decisions.len() == self.run.path.len()
    }

    /// Judges the plant as it stands, once a step before the nodes act. Returns whether the experiment is over.
    pub fn judge(&mut self, trial: &WallTrial, pose: &Pose) -> bool {
        let (run, apex) = (&mut self.run, pose.apex());
        run.apex.push(apex);
        for (&node, nearest) in run.path.iter().zip(&mut run.nearest_cm) {
            let at = trial.wall.nodes[node].at;
            *nearest = nearest.min(distance([at[0], at[1]], [apex[0], apex[1]]));
        }
        while let Some(&node) = run.path.get(run.decisions.len()) {
            if apex[1] < trial.wall.nodes[node].at[1] {
                break;
            }
            let is_right = trial.wall.is_nearest(node, apex[0]);
            run.decisions.push(Decision { node, step: run.steps, apex, is_right });
        }
        self.is_decided() || self.run.steps >= trial.max_steps
    }

    /// The nodes take a step before the plant. Returns how the lamps are lit.
    pub fn step(&mut self, trial: &WallTrial, pose: &Pose) -> Lighting {
        let messages = self.perceive(pose, |controller, view| controller.step(view));
        self.act(trial, messages)
    }

    /// First phase of a step: [`WallNodes::perceive`] before the plant.
    pub fn perceive<T>(
        &mut self,
        pose: &Pose,
        see: impl FnMut(&mut C, &NodeView<'_>) -> T,
    ) -> Vec<Option<T>> {
        match &mut self.eyes {
            Eyes::Proximity(sensors) => self.nodes.perceive(sensors, Some(&patches(pose)[..]), see),
            Eyes::Cameras(cameras) => self.nodes.perceive(&mut **cameras, Some(&(pose, self.lighting)), see),
        }
    }

    /// The controllers in the order of the nodes, to decide between the two phases of a step.
    pub fn controllers_mut(&mut self) -> impl Iterator<Item = &mut C> {
        self.nodes.controllers_mut()
    }

    /// Second phase of a step: [`WallNodes::act`]. Returns how the lamps are lit.
    ///
    /// # Panics
    /// Unless there is a message, or none, for each node.
    pub fn act(&mut self, trial: &WallTrial, messages: Vec<Option<NodeMessage>>) -> Lighting {
        self.lighting = self.nodes.act(messages);
        self.run.steps += 1;
        self.run.lit_h += self.lighting.total() * trial.period_min / 60.0;
        if self.keeps_rows {
            self.run.rows.extend(self.nodes.rows());
        }
        self.lighting
    }
}
