//! What a node sees, says and does.

use serde::{Deserialize, Serialize};

use super::detector::DetectorMemory;
use crate::lighting::FULL;

/// What a node sends to its neighbours after each step: its whole state, so that a lost or doubled message does no harm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeMessage {
    /// Number of the step. Receivers drop what is not newer.
    pub step: u32,
    /// Its reading; none if the sensor is silent.
    pub reading: Option<f64>,
    /// Whether something is near.
    pub sees: bool,
    /// Whether the plant has reached this node, or is taken to have: the next one is called.
    pub done: bool,
    /// Level of its lamp, 0 to 255.
    pub level: u8,
    /// Whether the lamp does not light up: tell the user.
    pub lamp_is_dead: bool,
    /// For how long the lamp has been lit since the node was called, in h.
    pub lit_h: f64,
    /// What its detector has learnt.
    pub memory: DetectorMemory,
}

/// A neighbour as a node hears it.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour<'a> {
    /// Its latest message; none so far, or after a restart.
    pub message: Option<&'a NodeMessage>,
    /// Whether it is alive, as the broker reports by its last will.
    pub is_alive: bool,
}

impl Neighbour<'_> {
    /// Whether its latest message says so.
    #[must_use]
    pub fn says(&self, what: impl Fn(&NodeMessage) -> bool) -> bool {
        self.message.is_some_and(what)
    }
}

/// All that a node knows at a step.
#[derive(Clone, Copy, Debug)]
pub struct NodeView<'a> {
    /// Number of the step.
    pub step: u32,
    /// Time from one step to the next, in h.
    pub period_h: f64,
    /// Whether the user has started the experiment: until then no plant is there, and nodes learn the empty scene.
    pub is_started: bool,
    /// Its own reading; none if the sensor is silent.
    pub reading: Option<f64>,
    /// Mean reading of the siblings that were heard of lately.
    pub siblings: Option<f64>,
    /// Whether a sibling sees something.
    pub sibling_sees: bool,
    /// Whether the node is on the drawn path.
    pub is_on_path: bool,
    /// The node before this one on the path; none for the first one, and off the path.
    pub previous: Option<Neighbour<'a>>,
    /// The node after this one on the path; none for the last one, and off the path.
    pub next: Option<Neighbour<'a>>,
    /// Level that the lamp itself reports, 0 to 255; none if it reports nothing.
    pub lamp: Option<u8>,
}

/// Decides on the lamp of one node.
pub trait NodeController: Send {
    /// Takes a step. The message goes to all neighbours, and its level to the lamp.
    fn step(&mut self, view: &NodeView<'_>) -> NodeMessage;

    /// The node restarts: it forgets everything but its own last message, if that is kept.
    fn restart(&mut self, own: Option<&NodeMessage>);
}

/// Rules to compare with: they see nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Baseline {
    /// No lamp is ever lit.
    Dormant,
    /// All lamps are lit all the time.
    AllLit,
    /// The lamps of the path are lit all the time.
    PathLit,
}

impl NodeController for Baseline {
    fn step(&mut self, view: &NodeView<'_>) -> NodeMessage {
        let is_lit = match self {
            Self::Dormant => false,
            Self::AllLit => true,
            Self::PathLit => view.is_on_path,
        };
        let level = if is_lit && view.is_started { FULL } else { 0 };
        NodeMessage { step: view.step, reading: view.reading, level, ..NodeMessage::default() }
    }

    fn restart(&mut self, _own: Option<&NodeMessage>) {}
}
