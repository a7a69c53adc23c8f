//! Controllers: from what is seen of the plant to the lamp that is lit.
//!
//! An [`Observation`] comes in, a [`Light`] goes out, once a step. [`Periodic`] sees nothing and switches at regular
//! intervals, as in the paper's open-loop experiments; [`Schedule`] plays back a list of lights; [`Greedy`] is the rule that a person would write by hand;
//! [`PredictiveGreedy`] is the same rule with nine parameters that are tuned on a model;
//! [`NetworkController`] is what evolution makes, and [`Sensors`] say what its network sees. [`network_analysis`] reads
//! from a network what it can do.
//!
//! A controller of one's own implements [`Controller`].

mod steering;
mod greedy;
mod network;
pub mod network_analysis;
mod periodic;
pub(crate) mod rule;
mod schedule;
mod sensors;

use crate::lamps::Light;
use crate::lighting::Lighting;
use crate::observation::Observation;

pub use greedy::Greedy;
pub use network::{Dimming, Interface, NetworkController, OUTPUTS, OneLamp, ShapeError, outputs};
pub use periodic::Periodic;
pub use rule::{Avoidance, PredictiveGreedy, PredictiveRule};
pub use schedule::Schedule;
pub use sensors::{Sensor, SensorState, Sensors, SensorsError, TIP_INPUTS};

/// Decides which lamp is lit until the next observation.
///
/// ```
/// use tropism::prelude::*;
///
/// /// Lights the lamp on the other side of the tip: keeps a plant upright.
/// struct Upright;
///
/// impl Controller for Upright {
///     fn decide(&mut self, seen: &Observation) -> Light {
///         if seen.tip.x > 0.0 { Light::LEFT } else { Light::RIGHT }
///     }
/// }
/// ```
pub trait Controller {
    /// The light for what is `seen` now. Called once a step, in order: a controller may remember.
    fn decide(&mut self, seen: &Observation) -> Light;

    /// The levels of all lamps for what is `seen` now. The loop asks this, once a step, instead of [`decide`](Self::decide):
    /// by default the decided lamp at full power. At least one lamp is lit: darkness stands for the end of a track.
    fn lighting(&mut self, seen: &Observation) -> Lighting {
        self.decide(seen).into()
    }

    /// Reports that `steps` steps have passed since the last decision at which nothing was decided: their photographs were
    /// missed, or no plant was seen for too long. One that goes by the clock counts them; by default they are ignored.
    fn miss(&mut self, steps: u32) {
        let _ = steps;
    }
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn decide(&mut self, seen: &Observation) -> Light {
        (**self).decide(seen)
    }

    fn lighting(&mut self, seen: &Observation) -> Lighting {
        (**self).lighting(seen)
    }

    fn miss(&mut self, steps: u32) {
        (**self).miss(steps);
    }
}
