//! An evolved network as the controller of a node: the same network in each node.

use tropism_neat::{Genome, Network};

use super::controller::{NodeController, NodeMessage, NodeView};
use super::detector::DetectorSettings;
use super::interface::{NODE_INPUTS, NODE_OUTPUTS, NodeDecision, NodeInterface};

/// A network that decides for one node, by what [`NodeInterface`] senses. Its outputs mean yes from 0.5 on.
#[derive(Clone, Debug)]
pub struct NetworkNode {
    network: Network,
    interface: NodeInterface,
}

impl NetworkNode {
    /// A node with the network of `genome`; `None` unless it has [`NODE_INPUTS`] and [`NODE_OUTPUTS`].
    #[must_use]
    pub fn new(genome: &Genome, settings: DetectorSettings) -> Option<Self> {
        (genome.inputs() == NODE_INPUTS && genome.outputs() == NODE_OUTPUTS)
            .then(|| Self { network: Network::new(genome), interface: NodeInterface::new(settings) })
    }
}

impl NodeController for NetworkNode {
    fn step(&mut self, view: &NodeView<'_>) -> NodeMessage {
        if !view.is_started {
            return self.interface.step(view);
        }
        let outputs = self.network.run(&self.interface.sense(view));
        self.interface.decide(NodeDecision { is_lit: outputs[0] >= 0.5, done: outputs[1] >= 0.5 })
    }

    fn restart(&mut self, own: Option<&NodeMessage>) {
        self.network.flush();
        self.interface.restart(own);
    }
}
