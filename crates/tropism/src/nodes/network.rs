//! An evolved network as the controller of a node: the same network in each node.

use tropism_neat::{Genome, Network};

use super::controller::{NodeController, NodeMessage, NodeView};
use super::detector::{DetectorSettings, EchoDetector};
use crate::lighting::FULL;

/// Inputs of the network: strength of the echo and its trend, whether the node before is done, whether the next one is done,
/// whether a sibling sees something, whether the own lamp is lit, and whether the node is done.
pub const NETWORK_INPUTS: usize = 7;
/// Outputs of the network: whether the lamp is lit, and whether the node is done. From 0.5 on they mean yes.
pub const NETWORK_OUTPUTS: usize = 2;
/// Largest strength and trend that a network sees. Chosen: a plant right before the sensor must not drown all else.
const MOST: f64 = 2.0;

/// A network that decides for one node. Off the path it hears nobody before or after it.
#[derive(Clone, Debug)]
pub struct NetworkNode {
    network: Network,
    settings: DetectorSettings,
    detector: EchoDetector,
    is_lit: bool,
    done: bool,
    lit_h: f64,
}

impl NetworkNode {
    /// A node with the network of `genome`; `None` unless it has [`NETWORK_INPUTS`] and [`NETWORK_OUTPUTS`].
    #[must_use]
    pub fn new(genome: &Genome, settings: DetectorSettings) -> Option<Self> {
        (genome.inputs() == NETWORK_INPUTS && genome.outputs() == NETWORK_OUTPUTS).then(|| Self {
            network: Network::new(genome),
            settings,
            detector: EchoDetector::new(settings),
            is_lit: false,
            done: false,
            lit_h: 0.0,
        })
    }
}

impl NodeController for NetworkNode {
    fn step(&mut self, view: &NodeView<'_>) -> NodeMessage {
        let echo = self.detector.take(view.reading, view.siblings, view.period_h, !view.is_started);
        if view.is_started {
            let flag = |is_true: bool| f64::from(u8::from(is_true));
            // The user calls the first node of the path, as a node that is done calls the next one.
            let is_called =
                view.is_on_path && view.previous.is_none_or(|previous| previous.says(|message| message.done));
            let next_done = view.next.is_some_and(|next| next.says(|message| message.done));
            let outputs = self.network.run(&[
                echo.strength.clamp(-MOST, MOST),
                echo.trend.clamp(-MOST, MOST),
                flag(is_called),
                flag(next_done),
                flag(view.sibling_sees),
                flag(self.is_lit),
                flag(self.done),
            ]);
            (self.is_lit, self.done) = (outputs[0] >= 0.5, outputs[1] >= 0.5);
            self.lit_h += if self.is_lit { view.period_h } else { 0.0 };
        }
        NodeMessage {
            step: view.step,
            reading: view.reading,
            sees: echo.sees,
            done: self.done,
            level: if self.is_lit { FULL } else { 0 },
            lamp_is_dead: false,
            lit_h: self.lit_h,
            memory: self.detector.memory(),
        }
    }

    fn restart(&mut self, own: Option<&NodeMessage>) {
        self.network.flush();
        self.detector = EchoDetector::new(self.settings);
        (self.is_lit, self.done, self.lit_h) = (false, false, 0.0);
        if let Some(own) = own {
            self.detector.restart(Some(own.memory));
            (self.is_lit, self.done, self.lit_h) = (own.level > 0, own.done, own.lit_h);
        }
    }
}
