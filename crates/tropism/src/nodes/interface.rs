//! What a node senses and what it may decide, for a network or a learning agent that decides for it.
//!
//! In: what the node knows at a step. Out: seven numbers within fixed bounds; and, of two decisions, the message of the node. The
//! idea: sensing and deciding are two phases, so that the decision may come from outside.

use super::controller::{NodeController, NodeMessage, NodeView};
use super::detector::{DetectorSettings, EchoDetector};
use crate::lighting::FULL;

/// Numbers that a node senses: strength of the echo and its trend, whether the node is called, whether the next one is done,
/// whether a sibling sees something, whether the own lamp is lit, and whether the node is done.
pub const NODE_INPUTS: usize = 7;
/// Decisions of a node: whether its lamp is lit, and whether it is done.
pub const NODE_OUTPUTS: usize = 2;
/// Largest strength and trend that are sensed. Chosen: a plant right before the sensor must not drown all else.
const MOST: f64 = 2.0;

/// What a node senses at a step; flags are 0 or 1.
pub type NodeInputs = [f64; NODE_INPUTS];

/// What is decided for a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeDecision {
    /// Whether its lamp is lit.
    pub is_lit: bool,
    /// Whether it says that the plant has reached it, which calls the next node.
    pub done: bool,
}

/// The senses and the lamp of a node without a rule. As a controller it keeps what was decided last: darkness at first.
///
/// Off the path a node hears nobody before or after it.
#[derive(Clone, Debug)]
pub struct NodeInterface {
    settings: DetectorSettings,
    detector: EchoDetector,
    period_h: f64,
    /// What the node says next.
    message: NodeMessage,
}

impl NodeInterface {
    /// Least and largest value of each number that a node senses.
    pub const BOUNDS: [[f64; 2]; NODE_INPUTS] =
        [[-MOST, MOST], [-MOST, MOST], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0]];

    /// A node that has learnt nothing.
    #[must_use]
    pub fn new(settings: DetectorSettings) -> Self {
        let (detector, message) = (EchoDetector::new(settings), NodeMessage::default());
        Self { settings, detector, period_h: 0.0, message }
    }

    /// Takes what the node knows at a step, once a step; until the experiment starts its detector learns the empty scene.
    pub fn sense(&mut self, view: &NodeView<'_>) -> NodeInputs {
        let echo = self.detector.take(view.reading, view.siblings, view.period_h, !view.is_started);
        let NodeMessage { done, level, lit_h, .. } = self.message;
        self.period_h = view.period_h;
        self.message = NodeMessage {
            step: view.step,
            reading: view.reading,
            sees: echo.sees,
            done,
            level,
            lamp_is_dead: false,
            lit_h,
            memory: self.detector.memory(),
        };
        let flag = |is_true: bool| f64::from(u8::from(is_true));
        // The user calls the first node of the path, as a node that is done calls the next one.
        let is_called =
            view.is_on_path && view.previous.is_none_or(|previous| previous.says(|message| message.done));
        let next_done = view.next.is_some_and(|next| next.says(|message| message.done));
        [
            echo.strength.clamp(-MOST, MOST),
            echo.trend.clamp(-MOST, MOST),
            flag(is_called),
            flag(next_done),
            flag(view.sibling_sees),
            flag(level > 0),
            flag(done),
        ]
    }

    /// Takes the decision for the step that was sensed, once a step, when the experiment has started. Returns the node's message.
    pub fn decide(&mut self, decision: NodeDecision) -> NodeMessage {
        self.message.level = if decision.is_lit { FULL } else { 0 };
        self.message.done = decision.done;
        self.message.lit_h += if decision.is_lit { self.period_h } else { 0.0 };
        self.message
    }
}

impl NodeController for NodeInterface {
    fn step(&mut self, view: &NodeView<'_>) -> NodeMessage {
        self.sense(view);
        self.message
    }

    fn restart(&mut self, own: Option<&NodeMessage>) {
        self.detector = EchoDetector::new(self.settings);
        self.message = NodeMessage::default();
        if let Some(own) = own {
            self.detector.restart(Some(own.memory));
            let level = if own.level > 0 { FULL } else { 0 };
            self.message = NodeMessage { done: own.done, level, lit_h: own.lit_h, ..NodeMessage::default() };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nodes::Neighbour;

    #[test]
    fn all_numbers_are_within_their_bounds_and_flags_say_what_was_heard_and_decided() {
        let mut node = NodeInterface::new(DetectorSettings::default());
        let done = NodeMessage { done: true, ..NodeMessage::default() };
        let hears = Some(Neighbour { message: Some(&done), is_alive: true });
        let view = |step: u32| NodeView {
            step,
            period_h: 1.0 / 12.0,
            is_started: step >= 100,
            reading: Some(if step == 100 { 1e9 } else { 0.1 * f64::from(step % 3) }),
            siblings: None,
            sibling_sees: step == 100,
            is_on_path: true,
            previous: hears,
            next: hears.filter(|_| step == 100),
            lamp: None,
        };
        let is_bounded = |inputs: NodeInputs| {
            inputs
                .iter()
                .zip(NodeInterface::BOUNDS)
                .all(|(value, [least, most])| (least..=most).contains(value))
        };
        for step in 0..100 {
            let inputs = node.sense(&view(step));
            assert!(is_bounded(inputs));
            assert_eq!(inputs[2..], [1.0, 0.0, 0.0, 0.0, 0.0]);
        }
        let inputs = node.sense(&view(100));
        assert_eq!(inputs, [MOST, MOST, 1.0, 1.0, 1.0, 0.0, 0.0]);
        let message = node.decide(NodeDecision { is_lit: true, done: true });
        assert_eq!((message.level, message.done, message.lit_h), (FULL, true, 1.0 / 12.0));
        let inputs = node.sense(&view(101));
        assert!(is_bounded(inputs) && inputs[1] == -MOST);
        assert_eq!(inputs[2..], [1.0, 0.0, 0.0, 1.0, 1.0]);
        assert_eq!(node.step(&view(102)).level, FULL, "it keeps what was decided last");
        node.restart(Some(&message));
        assert_eq!(node.sense(&view(103))[5..], [1.0, 1.0]);
        node.restart(None);
        assert_eq!(node.sense(&view(104))[5..], [0.0, 0.0]);
        let off = NodeView { is_on_path: false, previous: None, next: None, ..view(105) };
        assert_eq!(node.sense(&off)[2..], [0.0; 5]);
    }
}
