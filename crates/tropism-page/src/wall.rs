//! The wall of nodes on a page: where its nodes are, and a virtual bean that they lead along the drawn path.

use serde::{Deserialize, Serialize};
use tropism::nodes::{Baseline, NodeController, NodeRow, NodeWall, StateMachine, StateMachineSettings};
use tropism_bean::wall::WallTrial;

use crate::rounded;

/// Steps from one picture to the next. Chosen: a quarter of an hour, in which a tip moves some millimetres.
const STRIDE: u32 = 3;

/// What runs in each node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum WallRule {
    /// The hand-written state machine.
    Machine,
    /// The lamps of the path are lit all the time.
    PathLit,
    /// No lamp is ever lit: the control.
    Dormant,
}

/// A node and its place.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ShownNode {
    /// Its name.
    pub name: String,
    /// Its place, in cm to the right of the root and above the soil.
    pub at: [f64; 2],
}

/// A wall as it is drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ShownWall {
    /// Its nodes.
    pub nodes: Vec<ShownNode>,
    /// Pairs of their numbers: from a node to one that may follow it on a path.
    pub links: Vec<[usize; 2]>,
    /// Numbers of the nodes on its path, lowest first; a random path is that of the first plant.
    pub path: Vec<usize>,
}

/// The wall as it is drawn. It must be checked.
#[must_use]
pub fn shown(wall: &NodeWall) -> ShownWall {
    let node = |node: &tropism::nodes::NodeSpec| ShownNode {
        name: node.name.clone(),
        at: [0, 1].map(|axis| rounded(node.at[axis], 3)),
    };
    let number = |name: &String| wall.nodes.iter().position(|node| node.name == *name);
    let link = |[from, to]: &[String; 2]| Some([number(from)?, number(to)?]);
    ShownWall {
        nodes: wall.nodes.iter().map(node).collect(),
        links: wall.links.iter().filter_map(link).collect(),
        path: wall.path_of(0),
    }
}

/// A node at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct NodeState {
    /// Level of its lamp, 0 to 255.
    pub level: u8,
    /// Whether it sees the plant.
    pub sees: bool,
    /// Whether the plant has reached it, or is taken to have.
    pub done: bool,
}

impl From<&NodeRow> for NodeState {
    fn from(NodeRow { message, .. }: &NodeRow) -> Self {
        Self { level: message.level, sees: message.sees, done: message.done }
    }
}

/// Wall and plant at one time.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WallPicture {
    /// When, in words: `12.5 h`, or `step 481`.
    pub when: String,
    /// Points of the stem from the root on, in cm; none where nobody saw it.
    pub stem: Vec<[f64; 2]>,
    /// Each node; `None` of one that said nothing.
    pub nodes: Vec<Option<NodeState>>,
}

/// A plant that grew before a wall, to its end.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct GrownBeforeWall {
    /// Pictures, a quarter of an hour apart at five minutes a step.
    pub pictures: Vec<WallPicture>,
    /// Whether the tip passed each level on the side of the path, lowest first; fewer if it did not get there.
    pub right: Vec<bool>,
}

/// Grows the plant of `seed` before the wall of `trial`, which must be checked.
#[must_use]
pub fn grow_before_wall(
    trial: &WallTrial,
    machine: StateMachineSettings,
    rule: WallRule,
    seed: u64,
) -> GrownBeforeWall {
    let controller = || -> Box<dyn NodeController> {
        match rule {
            WallRule::Machine => Box::new(StateMachine::new(machine)),
            WallRule::PathLit => Box::new(Baseline::PathLit),
            WallRule::Dormant => Box::new(Baseline::Dormant),
        }
    };
    let (mut pictures, mut step) = (Vec::new(), 0);
    let run = trial.watch(seed, &controller, |pose, rows, _| {
        if step % STRIDE == 0 {
            let stem = pose.stem.iter().map(|place| [0, 1].map(|axis| rounded(place.at[axis], 2))).collect();
            let mut nodes = vec![None; trial.wall.nodes.len()];
            rows.iter().for_each(|row| nodes[row.node] = Some(row.into()));
            let when = format!("{:.1} h", f64::from(step) * trial.period_min / 60.0);
            pictures.push(WallPicture { when, stem, nodes });
        }
        step += 1;
    });
    GrownBeforeWall { pictures, right: run.decisions.iter().map(|decision| decision.is_right).collect() }
}

#[cfg(test)]
mod tests {
    use tropism_bean::Species;

    use super::*;

    #[test]
    fn the_state_machine_leads_the_plant_and_dormant_nodes_stay_dark() {
        let trial = WallTrial::new(Species::default());
        let wall = shown(&trial.wall);
        assert_eq!((wall.nodes.len(), wall.links.len(), wall.path.len()), (6, 8, 3));
        let grow = |rule| grow_before_wall(&trial, StateMachineSettings::default(), rule, 1);
        let led = grow(WallRule::Machine);
        assert_eq!(led.right, [true; 3]);
        assert!(led.pictures[0].when == "0.0 h" && led.pictures[4].when == "1.0 h");
        let is_lit = |picture: &WallPicture| picture.nodes.iter().flatten().any(|node| node.level > 0);
        assert!(led.pictures.iter().any(is_lit) && !grow(WallRule::Dormant).pictures.iter().any(is_lit));
    }
}
