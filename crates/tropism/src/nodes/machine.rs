//! The state machine: the light is handed over from node to node along the path.
//!
//! The same four rules run in each node:
//!
//! 1. Learn the empty scene, then see what is new ([`EchoDetector`]).
//! 2. A node of the path is *called* when the node before it is done; the first one by the user.
//! 3. It is lit while it is called and not done.
//! 4. It is done for good when it sees the plant, when the next node sees it, or when it was lit for `give_up_h`.
//!
//! Faults add three: a node whose lamp stays dark counts as done at once, so that the others still lead the plant. A node takes
//! over from one that died while it was lit. A node that is done stays lit while the next one is dead and was neither lit nor
//! done, for then nobody takes over.

use serde::{Deserialize, Serialize};

use super::controller::{Neighbour, NodeController, NodeMessage, NodeView};
use super::detector::{DetectorSettings, EchoDetector};
use crate::check::{self, OutOfRange};
use crate::lighting::FULL;

/// Steps for which a lamp may report darkness against its command before it counts as dead. Chosen: a slow dimmer has time.
const DARK_STEPS: u32 = 3;

/// Settings of a [`StateMachine`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct StateMachineSettings {
    /// Level of a lit lamp, 1 to 255.
    pub level: u8,
    /// Longest time for which a node is lit, in h: then it takes the plant for arrived; 0.1 to 10000. Twice this after a node that
    /// failed, as the plant has two levels to go.
    ///
    /// 20 h are 1.4 times the 14 h in which the virtual bean grows from one level to the next, 5 cm at 0.36 cm/h.
    pub give_up_h: f64,
    /// How a plant is distinguished from the empty scene.
    pub detector: DetectorSettings,
}

impl Default for StateMachineSettings {
    fn default() -> Self {
        Self { level: FULL, give_up_h: 20.0, detector: DetectorSettings::default() }
    }
}

impl StateMachineSettings {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        check::within("level", self.level, 1..=FULL)?;
        check::within("give_up_h", self.give_up_h, 0.1..=10000.0)?;
        self.detector.check().map_err(|error| error.in_table("detector"))
    }
}

/// The hand-written controller of a node.
#[derive(Clone, Debug, Default)]
pub struct StateMachine {
    settings: StateMachineSettings,
    detector: EchoDetector,
    done: bool,
    lit_h: f64,
    level: u8,
    dark_steps: u32,
    lamp_is_dead: bool,
}

impl StateMachine {
    /// A node that has learnt nothing.
    #[must_use]
    pub fn new(settings: StateMachineSettings) -> Self {
        Self { settings, detector: EchoDetector::new(settings.detector), ..Self::default() }
    }

    /// Watches whether the lamp obeys.
    fn watch_lamp(&mut self, reported: Option<u8>) {
        let is_dark = self.level > 0 && reported == Some(0);
        self.dark_steps = if is_dark { self.dark_steps + 1 } else { 0 };
        let has_lit_up = self.level > 0 && reported.is_some_and(|level| level > 0);
        self.lamp_is_dead = (self.lamp_is_dead || self.dark_steps >= DARK_STEPS) && !has_lit_up;
    }
}

impl NodeController for StateMachine {
    fn step(&mut self, view: &NodeView<'_>) -> NodeMessage {
        self.watch_lamp(view.lamp);
        let echo = self.detector.take(view.reading, view.siblings, view.period_h, !view.is_started);
        let has_died_lit = |node: &Neighbour<'_>| !node.is_alive && node.says(|message| message.level > 0);
        let is_called = view.is_on_path
            && view.is_started
            && view
                .previous
                .is_none_or(|previous| previous.says(|message| message.done) || has_died_lit(&previous));
        let comes_early = view
            .previous
            .is_some_and(|previous| previous.says(|message| message.lamp_is_dead) || has_died_lit(&previous));
        let give_up_h = self.settings.give_up_h * if comes_early { 2.0 } else { 1.0 };
        let has_passed = view.next.is_some_and(|next| next.says(|message| message.sees || message.done));
        self.done |= is_called && (echo.sees || has_passed || self.lit_h >= give_up_h || self.lamp_is_dead);
        let has_begun = |node: &Neighbour<'_>| node.says(|message| message.level > 0 || message.done);
        let holds = self.done && view.next.is_some_and(|next| !next.is_alive && !has_begun(&next));
        let is_lit = is_called && (!self.done || holds);
        if is_lit && !self.done {
            self.lit_h += view.period_h;
        }
        self.level = if is_lit { self.settings.level } else { 0 };
        NodeMessage {
            step: view.step,
            reading: view.reading,
            sees: echo.sees,
            done: self.done,
            level: self.level,
            lamp_is_dead: self.lamp_is_dead,
            lit_h: self.lit_h,
            memory: self.detector.memory(),
        }
    }

    fn restart(&mut self, own: Option<&NodeMessage>) {
        let detector = EchoDetector::new(self.settings.detector);
        *self = Self { settings: self.settings, detector, ..Self::default() };
        if let Some(own) = own {
            self.detector.restart(Some(own.memory));
            (self.done, self.lit_h, self.lamp_is_dead) = (own.done, own.lit_h, own.lamp_is_dead);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALIVE: Neighbour<'static> = Neighbour { message: None, is_alive: true };

    fn view(step: u32) -> NodeView<'static> {
        NodeView {
            step,
            period_h: 1.0 / 12.0,
            is_started: step >= 288,
            reading: Some(0.1 * f64::from(step % 3)),
            siblings: None,
            sibling_sees: false,
            is_on_path: true,
            previous: None,
            next: Some(ALIVE),
            lamp: None,
        }
    }

    /// A node after its day of learning.
    fn learned() -> StateMachine {
        let mut node = StateMachine::new(StateMachineSettings::default());
        assert!((0..288).all(|step| node.step(&view(step)).level == 0), "dark while it learns");
        node
    }

    #[test]
    fn the_first_node_is_lit_until_it_sees_the_plant_and_never_again() {
        let mut node = learned();
        assert_eq!(node.step(&view(288)).level, FULL);
        let near = |step| NodeView { reading: Some(3.0), ..view(step) };
        assert!(!node.step(&near(289)).done);
        let message = node.step(&near(290));
        assert!(message.sees && message.done && message.level == 0);
        assert!((291..900).all(|step| node.step(&view(step)).level == 0));
    }

    #[test]
    fn a_later_node_waits_until_the_one_before_is_done() {
        let mut node = learned();
        let message = |done| NodeMessage { done, level: 255, ..NodeMessage::default() };
        let (waiting, done) = (message(false), message(true));
        let hears = |message, is_alive| Some(Neighbour { message: Some(message), is_alive });
        let level = |node: &mut StateMachine, previous| node.step(&NodeView { previous, ..view(300) }).level;
        assert_eq!(level(&mut node, Some(ALIVE)), 0, "silence calls nobody");
        assert_eq!(level(&mut node, hears(&waiting, true)), 0);
        assert_eq!(
            level(&mut node.clone(), hears(&waiting, false)),
            FULL,
            "it takes over from a node that died lit"
        );
        assert_eq!(level(&mut node, hears(&done, true)), FULL);
        let off = NodeView { is_on_path: false, previous: None, next: None, ..view(301) };
        assert_eq!(node.step(&off).level, 0, "off the path nothing is lit");
    }

    #[test]
    fn a_node_is_done_when_the_next_one_sees_and_holds_the_light_while_it_is_dead() {
        let sees = NodeMessage { sees: true, ..NodeMessage::default() };
        let next = |is_alive| Some(Neighbour { message: Some(&sees), is_alive });
        let mut node = learned();
        let message = node.step(&NodeView { next: next(false), ..view(288) });
        assert!(message.done && message.level == FULL, "done, but nobody goes on");
        assert_eq!(node.step(&NodeView { next: next(true), ..view(289) }).level, 0);
        let dead = |message| Some(Neighbour { message: Some(message), is_alive: false });
        let lit = NodeMessage { level: 255, ..sees };
        let done = NodeMessage { done: true, ..sees };
        let mut level = |next, step| node.step(&NodeView { next, ..view(step) }).level;
        assert_eq!(level(dead(&lit), 290), 0, "the one after it takes over");
        assert_eq!(level(dead(&done), 291), 0, "the plant has passed it");
    }

    #[test]
    fn a_node_that_sees_nothing_gives_up_and_one_whose_lamp_is_dead_does_at_once() {
        let mut node = learned();
        let lit = (288..).take_while(|&step| node.step(&view(step)).level > 0).count();
        assert!((240..=241).contains(&lit), "20 h: {lit} steps");
        let failed = NodeMessage { done: true, lamp_is_dead: true, ..NodeMessage::default() };
        let previous = Some(Neighbour { message: Some(&failed), is_alive: true });
        let mut node = learned();
        let early = |step| NodeView { previous, ..view(step) };
        let lit = (288..).take_while(|&step| node.step(&early(step)).level > 0).count();
        assert!((480..=481).contains(&lit), "40 h: {lit} steps");
        let mut node = learned();
        let dark = |step| NodeView { lamp: Some(0), ..view(step) };
        let steps = (288..).take_while(|&step| !node.step(&dark(step)).done).count();
        assert_eq!(steps, 3);
        let message = node.step(&dark(300));
        assert!(message.lamp_is_dead && message.done && message.level == 0);
    }

    #[test]
    fn a_node_that_restarts_remembers_what_it_said() {
        let mut node = learned();
        node.step(&view(288));
        let said = node.step(&NodeView { reading: Some(3.0), ..view(289) });
        let said = NodeMessage { done: true, ..said };
        node.restart(Some(&said));
        let message = node.step(&view(290));
        assert!(message.done && message.level == 0);
        node.restart(None);
        assert!(!node.step(&view(291)).done);
    }
}
