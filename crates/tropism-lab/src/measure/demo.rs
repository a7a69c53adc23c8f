//! Virtual beans that are tipped in the dark: what `--demo` measures.
//!
//! They are not rods of the model of the fit: their gains wander, gravity is remembered, the zone lengthens, and they sag.

use tropism::control::Periodic;
use tropism::measure::StemRecord;
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism_bean::{Species, Trial};

use super::{Data, Plant};

/// Tilt of the pots, in degrees.
pub(super) const TILT_DEG: f64 = 60.0;
/// Number of plants, as the paper's; and their steps of five minutes: 12 h.
const PLANTS: u64 = 6;
const STEPS: u32 = 144;

/// The species: a bean of 10 cm without phototropism, whose balance number of gravity and straightening is 3.
fn species() -> Species {
    let mut species = Species::default();
    species.typical.tropism.light = 0.0;
    species.typical.tropism.gravity = 0.18;
    species.typical.tropism.balance = 3.0;
    species.typical.growth.start = 10.0;
    species
}

pub(super) fn plants(seed: u64) -> (Vec<Plant>, Vec<String>) {
    let species = species();
    let trial = Trial { tilt_deg: TILT_DEG, is_dark: true, ..Trial::new(&species) };
    let task = Task::open_loop(STEPS);
    let seeds: Vec<u64> = (0..PLANTS).map(|plant| random::derive(seed, Purpose::Plant, plant)).collect();
    let controller = |_| Periodic::new(STEPS, &trial.layout);
    let tracks = trial.grow_all(&seeds, controller, &task, &mut |_, _| std::ops::ControlFlow::Continue(()));
    let plant = |(number, track)| Plant {
        name: format!("bean-{number}"),
        group: String::new(),
        is_virtual: true,
        data: Data::Stems(StemRecord::of(&track).expect("virtual beans have stems")),
    };
    ((1..).zip(tracks).map(plant).collect::<Vec<Plant>>(), Vec::new())
}
