//! A wall of nodes as it runs: sensors, controllers, messages and faults, step after step.
//!
//! In: what is before the sensors. Out: the levels of all lamps. All noise is named by seed, node and step, so the order of work
//! changes nothing.

use std::collections::VecDeque;

use serde::Serialize;

use super::controller::{Neighbour, NodeController, NodeMessage, NodeView};
use super::faults::NodeFaults;
use super::sensors::{Draw, Sensors, draws};
use super::wall::NodeWall;
use crate::lamps::Light;
use crate::lighting::Lighting;
use crate::math::statistics::mean;
use crate::random::NoiseStream;

/// Age up to which a sibling's reading counts, in steps. Chosen: a message may be lost now and then.
pub const FRESH_STEPS: u32 = 3;
/// How long a node that will be killed is lit before, in h. Chosen: the plant is on its way, and no decision was made.
const KILLED_AFTER_H: f64 = 2.0;

/// One node at one step: a row of the wall's journal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NodeRow {
    /// Number of the step; the experiment starts at the first step after the learning time.
    pub step: u32,
    /// Number of the node.
    pub node: usize,
    /// What it said.
    pub message: NodeMessage,
}

/// Faults of one node.
#[derive(Clone, Copy, Debug, Default)]
struct Struck {
    is_blind: bool,
    is_silent: bool,
    lamp_is_dead: bool,
    will_die: bool,
    is_dead: bool,
}

/// The nodes of a wall with their controllers, all of one type if `C` says so.
pub struct WallNodes<C: NodeController + ?Sized = dyn NodeController> {
    wall: NodeWall,
    faults: NodeFaults,
    seed: u64,
    period_h: f64,
    learning_steps: u32,
    path: Vec<usize>,
    controllers: Vec<Box<C>>,
    struck: Vec<Struck>,
    /// Latest message that each node has of each other one.
    heard: Vec<Vec<Option<NodeMessage>>>,
    /// Messages of all nodes under way, latest last.
    under_way: VecDeque<Vec<Option<NodeMessage>>>,
    /// What each node said last, as the broker keeps it.
    said: Vec<Option<NodeMessage>>,
    step: u32,
}

impl<C: NodeController + ?Sized> WallNodes<C> {
    /// A wall before the plant of `seed`. `controller` makes the controller of each node; nodes learn for `learning_steps`.
    ///
    /// # Panics
    /// Unless the wall and the faults are checked.
    pub fn new(
        wall: &NodeWall,
        faults: NodeFaults,
        controller: impl Fn() -> Box<C>,
        [period_h, learning_h]: [f64; 2],
        seed: u64,
    ) -> Self {
        wall.check().expect("a checked wall");
        let count = wall.nodes.len();
        let path = wall.path_of(seed);
        let mut nodes = Self {
            wall: wall.clone(),
            faults,
            seed,
            period_h,
            learning_steps: (learning_h / period_h).round() as u32,
            controllers: (0..count).map(|_| controller()).collect(),
            struck: vec![Struck::default(); count],
            heard: vec![vec![None; count]; count],
            under_way: VecDeque::new(),
            said: vec![None; count],
            path,
            step: 0,
        };
        nodes.strike();
        nodes
    }

    /// Draws the nodes that faults strike.
    fn strike(&mut self) {
        let NodeFaults { blind, silent, dead_lamps, killed, .. } = self.faults;
        let marks: [fn(&mut Struck); 4] = [
            |struck| struck.is_blind = true,
            |struck| struck.is_silent = true,
            |struck| struck.lamp_is_dead = true,
            |struck| struck.will_die = true,
        ];
        for (kind, (count, mark)) in [blind, silent, dead_lamps, killed].into_iter().zip(marks).enumerate() {
            let mut left = self.path.clone();
            let mut draws = self.draws(Draw::Struck, kind).at(0);
            for _ in 0..usize::from(count).min(left.len()) {
                let node = left.remove((draws.uniform() * left.len() as f64) as usize);
                mark(&mut self.struck[node]);
            }
        }
    }

    fn draws(&self, what: Draw, number: usize) -> NoiseStream {
        draws(self.seed, what, number)
    }

    /// Numbers of the nodes on the drawn path, lowest first.
    #[must_use]
    pub fn path(&self) -> &[usize] {
        &self.path
    }

    /// Number of learning steps that are left before the plant may be put before the wall.
    #[must_use]
    pub fn learning_steps_left(&self) -> u32 {
        self.learning_steps.saturating_sub(self.step)
    }

    /// Numbers of the nodes whose lamp is dead by a fault.
    pub fn dead_lamps(&self) -> impl Iterator<Item = usize> {
        (0..self.struck.len()).filter(|&node| self.struck[node].lamp_is_dead)
    }

    /// The message of each node at the latest step; none of a node that is dead.
    pub fn rows(&self) -> impl Iterator<Item = NodeRow> {
        let step = self.step.saturating_sub(1);
        let row = move |(node, message): (usize, &Option<NodeMessage>)| {
            message.filter(|message| message.step == step).map(|message| NodeRow { step, node, message })
        };
        self.said.iter().enumerate().filter_map(row)
    }

    /// All nodes take a step before `scene`: [`perceive`](Self::perceive), then [`act`](Self::act). Returns how the lamps are lit.
    pub fn step<S: ?Sized>(&mut self, sensors: &mut impl Sensors<S>, scene: Option<&S>) -> Lighting {
        let messages = self.perceive(sensors, scene, |controller, view| controller.step(view));
        self.act(messages)
    }

    /// First phase of a step: messages arrive, nodes restart by their faults, sensors read `scene` (the empty one without it), and
    /// `see` gives each controller what its node knows. Returns what it makes of that for each node, and nothing for a node that
    /// is dead.
    pub fn perceive<S: ?Sized, T>(
        &mut self,
        sensors: &mut impl Sensors<S>,
        scene: Option<&S>,
        mut see: impl FnMut(&mut C, &NodeView<'_>) -> T,
    ) -> Vec<Option<T>> {
        self.receive();
        (0..self.wall.nodes.len()).for_each(|node| self.restart(node));
        let mut controllers = std::mem::take(&mut self.controllers);
        let perceive = |(node, controller): (usize, &mut Box<C>)| {
            let struck = self.struck[node];
            let before = scene.filter(|_| !struck.is_blind);
            let reading = (!struck.is_silent).then(|| sensors.read(node, self.step, before));
            (!struck.is_dead).then(|| see(controller, &self.view(node, reading)))
        };
        let perceived = controllers.iter_mut().enumerate().map(perceive).collect();
        self.controllers = controllers;
        perceived
    }

    /// The controllers in the order of the nodes, to decide between the two phases of a step.
    pub fn controllers_mut(&mut self) -> impl Iterator<Item = &mut C> {
        self.controllers.iter_mut().map(|controller| &mut **controller)
    }

    /// Second phase of a step: the message of each node goes out, and its level to its lamp. Returns how the lamps are lit.
    ///
    /// # Panics
    /// Unless there is a message, or none, for each node.
    pub fn act(&mut self, messages: Vec<Option<NodeMessage>>) -> Lighting {
        let (found, wanted) = (messages.len(), self.struck.len());
        assert!(found == wanted, "found messages of {found} nodes, wanted {wanted}");
        let mut lighting = Lighting::DARK;
        for (node, message) in messages.iter().enumerate() {
            let Some(message) = message else { continue };
            self.said[node] = Some(*message);
            let struck = &mut self.struck[node];
            if let Some(light) = Light::new(node).filter(|_| !struck.lamp_is_dead) {
                lighting = lighting.with(light, message.level);
            }
            struck.is_dead = struck.will_die && message.lit_h >= KILLED_AFTER_H;
        }
        self.under_way.push_back(messages);
        self.step += 1;
        lighting
    }

    /// What a node knows.
    fn view(&self, node: usize, reading: Option<f64>) -> NodeView<'_> {
        let place = self.path.iter().position(|&other| other == node);
        let neighbour = |number: usize| {
            let other = *self.path.get(number)?;
            let message = self.heard[node][other].as_ref();
            Some(Neighbour { message, is_alive: !self.struck[other].is_dead })
        };
        let siblings: Vec<&NodeMessage> = self
            .wall
            .siblings(node)
            .into_iter()
            .filter_map(|other| self.heard[node][other].as_ref())
            .collect();
        let is_fresh = |message: &&&NodeMessage| self.step - message.step <= FRESH_STEPS;
        let fresh: Vec<f64> =
            siblings.iter().filter(is_fresh).filter_map(|message| message.reading).collect();
        NodeView {
            step: self.step,
            period_h: self.period_h,
            is_started: self.step >= self.learning_steps,
            reading,
            siblings: (!fresh.is_empty()).then(|| mean(fresh)),
            sibling_sees: siblings.iter().any(|message| message.sees),
            is_on_path: place.is_some(),
            previous: place.and_then(|place| place.checked_sub(1)).and_then(neighbour),
            next: place.and_then(|place| neighbour(place + 1)),
            lamp: self.said[node].map(|said| if self.struck[node].lamp_is_dead { 0 } else { said.level }),
        }
    }

    /// Messages arrive, but for those that are lost.
    fn receive(&mut self) {
        let late = (self.faults.late_h / self.period_h).round() as usize;
        while self.under_way.len() > late {
            let Some(messages) = self.under_way.pop_front() else { return };
            for receiver in 0..self.heard.len() {
                let mut draws = self.draws(Draw::Message, receiver).at(self.step);
                for (sender, message) in messages.iter().enumerate() {
                    let is_lost = draws.uniform() < self.faults.lost;
                    if let Some(message) = message.filter(|_| !is_lost) {
                        self.heard[receiver][sender] = Some(message);
                    }
                }
            }
        }
    }

    /// Restarts a node now and then.
    fn restart(&mut self, node: usize) {
        let share = self.faults.restarts_per_day * self.period_h / 24.0;
        if share > 0.0 && self.draws(Draw::Restart, node).at(self.step).uniform() < share {
            let own = self.said[node].filter(|_| !self.faults.forgets);
            self.controllers[node].restart(own.as_ref());
            if self.faults.forgets {
                self.heard[node].fill(None);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nodes::{Baseline, Patch, Proximity, StateMachine, StateMachineSettings};

    /// Levels of a wall whose plant climbs along the nodes of its path, a cm an hour.
    fn climbed(faults: NodeFaults, seed: u64) -> (Vec<Lighting>, Vec<usize>) {
        let wall = NodeWall::three_levels();
        let machine =
            || Box::new(StateMachine::new(StateMachineSettings::default())) as Box<dyn NodeController>;
        let mut nodes = WallNodes::new(&wall, faults, machine, [1.0 / 12.0, 24.0], seed);
        let mut sensors = Proximity::default().sensors(&wall, 1.0 / 12.0, seed);
        let path = nodes.path().to_vec();
        let mut levels = Vec::new();
        while nodes.learning_steps_left() > 0 {
            assert_eq!(nodes.step(&mut sensors, None), Lighting::DARK);
        }
        for step in 0..600_u32 {
            let height = f64::from(step) / 12.0;
            // The stem from the soil up to its tip, which stands before the node of the path that it is about to reach.
            let level = path.iter().position(|&node| wall.nodes[node].at[1] + 1.0 > height).unwrap_or(2);
            let x = wall.nodes[path[level]].at[0];
            let at = |part: u32| [x, height - 0.2 * f64::from(part), -2.0];
            let stem: Vec<Patch> = (0..10).map(|part| Patch { at: at(part), area: 0.2 }).collect();
            levels.push(nodes.step(&mut sensors, Some(&stem[..])));
        }
        (levels, path)
    }

    fn lit(lighting: Lighting) -> Vec<usize> {
        lighting.lit().map(|(light, _)| light.index()).collect()
    }

    #[test]
    fn the_light_goes_up_the_path_one_node_at_a_time() {
        for seed in 0..8 {
            let (levels, path) = climbed(NodeFaults::default(), seed);
            let mut order: Vec<usize> = levels.iter().flat_map(|&lighting| lit(lighting)).collect();
            order.dedup();
            assert_eq!(order, path, "seed {seed}");
            assert!(levels.iter().all(|&lighting| lit(lighting).len() <= 1));
            assert!(lit(levels[599]).is_empty(), "dark at the end");
        }
    }

    #[test]
    fn lost_and_late_messages_and_restarts_only_delay_the_light() {
        for faults in [
            NodeFaults { lost: 0.9, ..NodeFaults::default() },
            NodeFaults { late_h: 1.0, ..NodeFaults::default() },
            NodeFaults { restarts_per_day: 24.0, ..NodeFaults::default() },
        ] {
            for seed in 0..4 {
                let (levels, path) = climbed(faults, seed);
                let first = levels.iter().find_map(|&lighting| lit(lighting).first().copied());
                assert_eq!(first, Some(path[0]));
                let lit_up = |node: usize| levels.iter().any(|&lighting| lit(lighting).contains(&node));
                assert!(path.iter().all(|&node| lit_up(node)), "{faults:?}, seed {seed}");
            }
        }
    }

    #[test]
    fn a_dead_lamp_is_told_and_the_next_node_goes_on() {
        let (levels, path) = climbed(NodeFaults { dead_lamps: 3, ..NodeFaults::default() }, 1);
        assert!(levels.iter().all(|&lighting| lit(lighting).is_empty()));
        assert_eq!(path.len(), 3);
        let (levels, path) = climbed(NodeFaults { dead_lamps: 1, ..NodeFaults::default() }, 2);
        let mut order: Vec<usize> = levels.iter().flat_map(|&lighting| lit(lighting)).collect();
        order.dedup();
        assert_eq!(order.len(), 2);
        assert!(order.iter().all(|node| path.contains(node)));
    }

    #[test]
    fn baselines_light_what_they_say() {
        let wall = NodeWall::three_levels();
        let lit_at = |rule: Baseline| {
            let controller = || Box::new(rule) as Box<dyn NodeController>;
            let mut nodes = WallNodes::new(&wall, NodeFaults::default(), controller, [1.0 / 12.0, 0.0], 3);
            let mut sensors = Proximity::default().sensors(&wall, 1.0 / 12.0, 3);
            (lit(nodes.step(&mut sensors, None)), nodes.path().to_vec())
        };
        assert!(lit_at(Baseline::Dormant).0.is_empty());
        assert_eq!(lit_at(Baseline::AllLit).0.len(), 6);
        let (lit, path) = lit_at(Baseline::PathLit);
        assert_eq!(lit, path);
    }
}
