//! A plant before a wall whose nodes are decided for from outside: an environment of multi-agent learning, one agent a node.
//!
//! In: a trial, the seed of a plant, and at each step a decision for each node. Out: what each node senses, and a reward that all
//! share. Agents know their sensors and messages only; the reward is of the true apex.

use tropism::lighting::Lighting;
use tropism::nodes::{DetectorSettings, NODE_INPUTS, NodeDecision, NodeInputs, NodeInterface};

use super::{WallEpisode, WallRun, WallTrial};
use crate::Bean;
use crate::pose::Pose;

/// One plant before its wall, step by step under decisions from outside.
///
/// ```
/// use tropism::nodes::{DetectorSettings, NodeDecision};
/// use tropism_bean::{Species, wall::{WallEnvironment, WallTrial}};
/// let mut wall = WallEnvironment::new(WallTrial::new(Species::default()), DetectorSettings::default(), 1);
/// assert_eq!(wall.sensed().len(), 6);
/// // The first node of the path senses that it is called: third of its numbers.
/// assert_eq!(wall.sensed()[wall.run().path[0]][2], 1.0);
/// let dark = [NodeDecision::default(); 6];
/// let reward = wall.step(&dark);
/// assert!(reward == 0.0 && !wall.is_decided() && !wall.is_out_of_time());
/// ```
pub struct WallEnvironment {
    trial: WallTrial,
    bean: Bean,
    pose: Pose,
    episode: WallEpisode<NodeInterface>,
    lighting: Lighting,
    /// What each node senses now; nothing of a node that is dead.
    sensed: Vec<Option<NodeInputs>>,
    /// Sum of the rewards so far.
    score: i32,
}

impl WallEnvironment {
    /// The plant of `seed` before the nodes, which have learnt the empty scene and sensed the plant once. Lamps are dark.
    ///
    /// # Panics
    /// Unless wall, sensor and faults of the trial are checked.
    #[must_use]
    pub fn new(trial: WallTrial, detector: DetectorSettings, seed: u64) -> Self {
        let episode = WallEpisode::new(&trial, seed, || Box::new(NodeInterface::new(detector)), false);
        let bean = trial.seedling(seed);
        let pose = bean.pose();
        let (lighting, sensed) = (Lighting::DARK, Vec::new());
        let mut wall = Self { trial, bean, pose, episode, lighting, sensed, score: 0 };
        wall.observe();
        wall
    }

    /// Judges the plant as it stands, and lets the nodes sense it.
    fn observe(&mut self) {
        self.pose = self.bean.pose();
        self.episode.judge(&self.trial, &self.pose);
        self.sensed = self.episode.perceive(&self.pose, NodeInterface::sense);
    }

    /// What each node senses now; zeros of a node that is dead.
    #[must_use]
    pub fn sensed(&self) -> Vec<NodeInputs> {
        self.sensed.iter().map(|inputs| inputs.unwrap_or([0.0; NODE_INPUTS])).collect()
    }

    /// Whether each node is alive.
    pub fn alive(&self) -> impl Iterator<Item = bool> {
        self.sensed.iter().map(Option::is_some)
    }

    /// Takes a decision for each node, and lets the plant grow for one step. Decisions for dead nodes are ignored. Returns the
    /// reward: 1 for each decision of the plant that was right, -1 for each that was wrong. What a seedling had decided before
    /// the first step counts in the first step.
    ///
    /// # Panics
    /// Unless there is a decision for each node.
    pub fn step(&mut self, decisions: &[NodeDecision]) -> f64 {
        let (found, wanted) = (decisions.len(), self.sensed.len());
        assert!(found == wanted, "found decisions for {found} nodes, wanted {wanted}");
        let nodes = self.episode.controllers_mut().zip(decisions).zip(&self.sensed);
        let messages =
            nodes.map(|((node, decision), sensed)| sensed.map(|_| node.decide(*decision))).collect();
        self.lighting = self.episode.act(&self.trial, messages);
        self.bean.advance(&self.trial.powers(self.lighting), self.trial.period_min);
        self.observe();
        let score = self.run().decisions.iter().map(|decision| if decision.is_right { 1 } else { -1 }).sum();
        f64::from(score - std::mem::replace(&mut self.score, score))
    }

    /// Whether the plant has taken all decisions of the path: the episode terminates.
    #[must_use]
    pub fn is_decided(&self) -> bool {
        self.episode.is_decided()
    }

    /// Whether the last step of the trial was made: the episode is truncated, unless all decisions are taken.
    #[must_use]
    pub fn is_out_of_time(&self) -> bool {
        self.run().steps >= self.trial.max_steps
    }

    /// What became of the plant so far.
    #[must_use]
    pub const fn run(&self) -> &WallRun {
        self.episode.run()
    }

    /// The plant as it stands.
    #[must_use]
    pub const fn pose(&self) -> &Pose {
        &self.pose
    }

    /// How the lamps were lit in the latest step.
    #[must_use]
    pub const fn lighting(&self) -> Lighting {
        self.lighting
    }
}

#[cfg(test)]
mod tests {
    use tropism::nodes::{NODE_OUTPUTS, NetworkNode, NodeController, NodeFaults};
    use tropism_neat::{Config, Genome, Neat, Network};

    use super::*;
    use crate::Species;

    /// Networks of a first generation.
    fn genomes() -> Vec<Genome> {
        let neat = Neat::new(Config::default(), NODE_INPUTS, NODE_OUTPUTS, 5).unwrap();
        neat.ask().iter().take(4).cloned().collect()
    }

    /// What becomes of the plant of `seed` if a copy of a network decides for each node.
    fn rollout(trial: &WallTrial, genome: &Genome, seed: u64) -> (WallRun, f64) {
        let mut wall = WallEnvironment::new(trial.clone(), DetectorSettings::default(), seed);
        let mut networks = vec![Network::new(genome); wall.sensed().len()];
        let mut fitness = 0.0;
        while !wall.is_decided() && !wall.is_out_of_time() {
            let decide = |(network, inputs): (&mut Network, &NodeInputs)| {
                let outputs = network.run(inputs);
                NodeDecision { is_lit: outputs[0] >= 0.5, done: outputs[1] >= 0.5 }
            };
            let decisions: Vec<NodeDecision> = networks.iter_mut().zip(&wall.sensed()).map(decide).collect();
            fitness += wall.step(&decisions);
        }
        (wall.run().clone(), fitness)
    }

    #[test]
    fn networks_as_agents_do_what_they_do_as_controllers() {
        let trials = [
            NodeFaults::default(),
            NodeFaults { lost: 0.3, late_h: 0.5, silent: 1, dead_lamps: 1, killed: 1, ..Default::default() },
        ]
        .map(|faults| WallTrial { faults, max_steps: 600, ..WallTrial::new(Species::default()) });
        let mut lit_h = Vec::new();
        for (trial, genome) in
            trials.iter().flat_map(|trial| genomes().into_iter().map(move |one| (trial, one)))
        {
            let node = NetworkNode::new(&genome, DetectorSettings::default()).unwrap();
            let controller = || Box::new(node.clone()) as Box<dyn NodeController>;
            for wanted in trial.grow(&[3, 4], &controller, false) {
                let (found, fitness) = rollout(trial, &genome, wanted.seed);
                let right = wanted.decisions.iter().filter(|decision| decision.is_right).count();
                assert_eq!(fitness, 2.0 * right as f64 - wanted.decisions.len() as f64);
                assert_eq!(found, wanted);
                lit_h.push(wanted.lit_h);
            }
        }
        assert!(lit_h.iter().any(|&hours| hours > 5.0), "{lit_h:?}");
    }
}
