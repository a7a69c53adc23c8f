//! Nodes that steer together: lamps with a sensor each, which hear their neighbours and nobody else.
//!
//! A [`NodeWall`] says where the nodes are, which are linked, and which path is drawn. Each node sees the echo of what is
//! near ([`Proximity`]) or how green its surroundings are ([`green_reading`]), distinguishes a plant from daylight and noise ([`EchoDetector`]), and decides on its own lamp
//! ([`NodeController`]): [`StateMachine`] hands the light over from node to node along the path, and [`NodeEvolution`] evolves a
//! [network](NetworkNode) that does, on a model of plants that
//! knows the wall's lamps. Whoever decides from outside, such as a learning
//! agent, has the network's inputs and outputs ([`NodeInterface`]). [`WallNodes`] steps all nodes of a wall with their messages and
//! faults. No node knows where the plant is, and there is no central process.
//!
//! The idea is that of the decentralised set-up in section 5 of Wahby et al. 2016 and its successors. The state machine, the
//! model of the sensor and all numbers are ours.
//!
//! # References
//! Wahby et al. 2018, doi:10.1098/rsos.180296, and Wahby et al. 2019, doi:10.3791/59835 (both by their abstracts).

mod wall;
mod sensors;
mod proximity;
mod greenness;
mod detector;
mod controller;
mod machine;
mod interface;
mod network;
mod faults;
mod running;
mod search;

pub use controller::{Baseline, Neighbour, NodeController, NodeMessage, NodeView};
pub use detector::{DetectorMemory, DetectorSettings, Echo, EchoDetector, Learned};
pub use faults::NodeFaults;
pub use greenness::{green_excess, green_reading};
pub use interface::{NODE_INPUTS, NODE_OUTPUTS, NodeDecision, NodeInputs, NodeInterface};
pub use machine::{StateMachine, StateMachineSettings};
pub use network::NetworkNode;
pub use proximity::{Optics, Patch, Proximity, ProximitySensors, READING_AT_RANGE, STEM_RADIUS_CM};
pub use running::{FRESH_STEPS, NodeRow, WallNodes};
pub use search::{EvolvedNodes, NodeEvolution, NodeEvolutionConfig, NodeScore};
pub use sensors::Sensors;
pub use wall::{NodeSpec, NodeWall, WallError, WallPath};
