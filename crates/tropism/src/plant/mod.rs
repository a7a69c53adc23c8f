//! Models of a plant: section 2.2.3.
//!
//! Tracks come in; a [`PlantModel`] comes out: given the state of a plant and the lit lamp, what is its state one step
//! later? [`tip`] is the paper's tip-motion model, eqs. (1)-(8), with a look-up table of constant cost; [`shifts`] is its data,
//! and [`shifts::window_mean`] what its table holds, straight from the equations. [`stem`] is a model of ours of the whole stem,
//! in the plane and in space, which remembers the light and differs from plant to plant.
//!
//! A model of one's own implements [`PlantModel`], and [`FittedModel`] if it is made of measured plants and kept in a file;
//! evolution, simulation and figures take it as they take these.
//!
//! # References
//! Wahby et al. 2016, section 2.2.3, eqs. (1)-(8).

pub mod shifts;
mod config;
mod fitted;
pub(crate) mod table;
pub mod tip;
mod tip_file;
pub mod stem;

use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::lighting::Lighting;
use crate::observation::Observation;
use crate::obstacle::Solid;
use crate::random::StepNoise;
use crate::track::Sample;

pub use fitted::{FittedModel, ModelError};

/// A model of how a plant moves and grows: the model is fixed, the plant is a value.
///
/// ```
/// use tropism::prelude::*;
/// use tropism::random::StepNoise;
///
/// /// Leans 1 mm a step towards the lit lamp and grows 0.3 mm.
/// struct Leaning(Layout);
///
/// impl PlantModel for Leaning {
///     type Plant = Point;
///     fn seedling(&self, start: Point, _noise: &mut StepNoise) -> Point {
///         start
///     }
///     fn step(&self, tip: &mut Point, light: Light, noise: &mut StepNoise) {
///         tip.x += 0.1 * self.0.side(light);
///         tip.y += 0.03 + 0.01 * noise.normal();
///     }
///     fn observe(&self, tip: &Point) -> Observation {
///         Observation::simulated(*tip)
///     }
///     fn layout(&self) -> &Layout {
///         &self.0
///     }
/// }
///
/// let task = Task::default();
/// let track = simulate(&Leaning(Layout::default()), &mut Greedy::new(&task, &Layout::default()), &task, 1);
/// assert!(task.fitness(&track) > 8.0);
/// ```
pub trait PlantModel: Sync {
    /// The state of one plant.
    type Plant: Clone;

    /// The plant at the start of an experiment, with its tip at `start` (cm). `noise` is for individual parameters.
    fn seedling(&self, start: Point, noise: &mut StepNoise) -> Self::Plant;

    /// The plant whose `past` was observed, as it was at the last of these samples: at least one, in order, under lamps of
    /// [`layout`](Self::layout). `noise` is for what the past does not tell. A model that remembers nothing takes the last
    /// tip for a seedling.
    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> Self::Plant {
        self.seedling(past[past.len() - 1].tip, noise)
    }

    /// Puts a plant among `solids`, which its stem cannot pass. A model that knows no contact leaves the plant as it is, and stems
    /// go through solids.
    fn among(&self, _plant: &mut Self::Plant, _solids: &[Solid]) {}

    /// Advances the plant by one step under `light`. `noise` holds the standard normal draws of this step, as many as the
    /// model needs: eq. (4) needs one.
    fn step(&self, plant: &mut Self::Plant, light: Light, noise: &mut StepNoise);

    /// [`step`](Self::step) under the levels of all lamps, of which one at least is lit.
    ///
    /// # Panics
    /// By default for all but one lamp at full power. A model that takes others says so ([`knows_levels`](Self::knows_levels)).
    fn shine(&self, plant: &mut Self::Plant, lighting: Lighting, noise: &mut StepNoise) {
        self.step(plant, lighting.one_lamp(), noise);
    }

    /// Whether [`shine`](Self::shine) takes several lamps, and any levels.
    fn knows_levels(&self) -> bool {
        false
    }

    /// What a camera would see of the plant.
    fn observe(&self, plant: &Self::Plant) -> Observation;

    /// Whether the plant is beyond all data of the model, which there answers as at their edge: what it says is a guess. A model
    /// that does not know where its data end says never.
    fn is_beyond_data(&self, _plant: &Self::Plant) -> bool {
        false
    }

    /// The lamps whose light the model knows.
    fn layout(&self) -> &Layout;

    /// Minutes of a step. Paper: 5 (section 2.2.1).
    fn period_min(&self) -> f64 {
        crate::track::PAPER_PERIOD_MIN
    }
}

/// One plant of a model, whatever the model is: the object-safe face of a [`PlantModel`] and a plant of it.
pub trait Plant: Send + Sync {
    /// [`PlantModel::step`].
    fn step(&mut self, light: Light, noise: &mut StepNoise);

    /// [`PlantModel::shine`].
    fn shine(&mut self, lighting: Lighting, noise: &mut StepNoise);

    /// [`PlantModel::observe`].
    fn observe(&self) -> Observation;

    /// [`PlantModel::is_beyond_data`].
    fn is_beyond_data(&self) -> bool;

    /// [`PlantModel::among`].
    fn among(&mut self, solids: &[Solid]);

    /// The same plant once more.
    fn boxed_clone(&self) -> Box<dyn Plant>;
}

impl Clone for Box<dyn Plant> {
    fn clone(&self) -> Self {
        self.boxed_clone()
    }
}

/// `most` of `all` at most, evenly in their order.
fn evenly<T: Copy>(all: &[T], most: usize) -> impl Iterator<Item = T> {
    let count = all.len().min(most);
    (0..count).map(move |place| all[place * all.len() / count])
}
