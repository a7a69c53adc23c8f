//! The tip-motion model straight from the equations: every step reads every shift. The reference of [`super::tip`].

use super::shifts::{self, Shift, Window};
use super::tip::Growth;
use super::{PlantModel, Shoot};
use crate::geometry::Point;
use crate::light::Light;
use crate::observation::Observation;

/// Eqs. (1)-(8) as they are printed: exact windows, no grid, and no movement where a window is empty.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowModel {
    /// Observed shifts, mirror images included.
    pub shifts: Vec<Shift>,
    /// The sliding window.
    pub window: Window,
    /// Growth of a step.
    pub growth: Growth,
}

impl PlantModel for WindowModel {
    type Plant = Shoot;

    fn seedling(&self, tip: Point) -> Shoot {
        Shoot::upright(tip)
    }

    fn step(&self, plant: &Shoot, light: Light, luck: f64) -> Shoot {
        let shift = shifts::window_mean(&self.shifts, self.window, plant.tip, light).unwrap_or(0.0);
        plant.turned(shift, self.growth.draw(luck))
    }

    fn observe(&self, plant: &Shoot) -> Observation {
        Observation::simulated(plant.tip)
    }
}
