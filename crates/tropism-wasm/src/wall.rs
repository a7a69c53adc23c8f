//! The wall of nodes: a virtual bean that they lead along a drawn path.

use serde::Deserialize;
use serde_json::{Value, json};
use tropism::geometry::Point;
use tropism::nodes::{
    Baseline, NodeController, NodeRow, NodeWall, StateMachine, StateMachineSettings, WallPath,
};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::Species;
use tropism_bean::wall::WallTrial;

use crate::SessionError;

/// Steps from one picture to the next. Chosen: a quarter of an hour, in which a tip moves some millimetres.
const STRIDE: u32 = 3;

/// What runs in each node.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallRule {
    /// The hand-written state machine.
    Machine,
    /// The lamps of the path are lit all the time.
    PathLit,
    /// No lamp is ever lit: the control.
    Dormant,
}

/// Where the nodes are, as the page draws them.
pub(crate) fn places() -> Value {
    let wall = NodeWall::three_levels();
    json!(wall.nodes.iter().map(|node| json!({ "name": node.name, "at": node.at })).collect::<Vec<_>>())
}

/// Grows the plant of `seed` before the wall, with the nodes of `path` on its path, lowest first.
pub(crate) fn grow(path: Vec<String>, rule: WallRule, seed: u64) -> Result<Value, SessionError> {
    let wall = NodeWall { path: WallPath::Drawn(path), ..NodeWall::three_levels() };
    wall.check()?;
    let trial = WallTrial { wall, ..WallTrial::new(Species::default()) };
    let controller = || -> Box<dyn NodeController> {
        match rule {
            WallRule::Machine => Box::new(StateMachine::new(StateMachineSettings::default())),
            WallRule::PathLit => Box::new(Baseline::PathLit),
            WallRule::Dormant => Box::new(Baseline::Dormant),
        }
    };
    let (mut pictures, mut step) = (Vec::new(), 0);
    let run = trial.watch(seed, &controller, |pose, rows, _| {
        if step % STRIDE == 0 {
            let stem: Vec<Point> =
                pose.stem.iter().map(|place| Point::new(place.at[0], place.at[1])).collect();
            let nodes: Vec<Value> = rows.iter().map(node).collect();
            pictures.push(
                json!({ "hours": f64::from(step) * PAPER_PERIOD_MIN / 60.0, "stem": stem, "nodes": nodes }),
            );
        }
        step += 1;
    });
    let decisions: Vec<Value> = run
        .decisions
        .iter()
        .map(|decision| json!({ "node": decision.node, "is_right": decision.is_right }))
        .collect();
    Ok(json!({ "pictures": pictures, "decisions": decisions }))
}

/// A node as it is drawn.
fn node(NodeRow { message, .. }: &NodeRow) -> Value {
    json!({ "level": message.level, "sees": message.sees, "done": message.done })
}
