//! The names that most programs need: `use tropism::prelude::*;`.

pub use crate::control::{Controller, Greedy, NetworkController, Periodic, Sensor, Sensors};
pub use crate::environment::{Environment, run, unwatched};
pub use crate::evolve::{Champion, Evolution, EvolutionConfig};
pub use crate::geometry::{Pixel, Point, Polyline, Region};
pub use crate::lamps::{Lamp, Layout, Light};
pub use crate::lighting::{Allowed, Lighting};
pub use crate::observation::{Observation, Quality};
pub use crate::photo::Photo;
pub use crate::plant::tip::{TipModel, TipModelConfig};
pub use crate::plant::{FittedModel, PlantModel};
pub use crate::random::{NoiseStream, Purpose, StepNoise};
pub use crate::simulation::{BatchModel, Simulation, fitness_of, simulate};
pub use crate::task::{Past, Score, Task};
pub use crate::track::{Sample, Track};
