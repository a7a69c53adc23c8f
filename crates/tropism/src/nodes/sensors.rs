//! The sensors of all nodes of a wall, of whichever kind.

use crate::random::{NoiseStream, Purpose};

/// The sensors of all nodes of a wall before scenes of type `S`.
///
/// Readings are in units of a natural logarithm, higher the nearer the plant is. The same controllers run on all kinds: an
/// [`EchoDetector`](super::EchoDetector) learns what a node reads before the empty scene.
pub trait Sensors<S: ?Sized> {
    /// What the sensor of `node` reads at `step` before `scene`; before the empty scene without one.
    fn read(&mut self, node: usize, step: u32, scene: Option<&S>) -> f64;
}

/// What random numbers of a node are for.
#[derive(Clone, Copy)]
pub(super) enum Draw {
    Reading = 1,
    Day = 2,
    Message = 3,
    Restart = 4,
    Struck = 5,
}

/// Random numbers of one purpose of one node.
pub(super) fn draws(seed: u64, what: Draw, number: usize) -> NoiseStream {
    NoiseStream::new(seed, Purpose::Nodes, [number as u32, what as u32, 0])
}
