//! Controllers: from what is seen of the plant to which lamp is lit.
//!
//! [`periodic`] sees nothing and switches by the clock, as in the paper's open-loop experiments; [`network`] is what
//! evolution makes, and [`anatomy`] looks into it; [`chase`] is the rule that a person would write by hand, a baseline for
//! both.

pub mod anatomy;
pub mod chase;
pub mod network;
pub mod periodic;

use crate::light::Light;
use crate::observation::Observation;

/// Decides which lamp is lit until the next observation.
pub trait Controller {
    /// The light for what is `seen` now. Called once a step, in order: a controller may remember.
    fn decide(&mut self, seen: &Observation) -> Light;
}

impl<C: Controller + ?Sized> Controller for Box<C> {
    fn decide(&mut self, seen: &Observation) -> Light {
        (**self).decide(seen)
    }
}
