//! Many simulated plants at once: the fast twin of [`fitness_of`], with the same bits.
//!
//! A step of one plant is a dependent chain of a look-up, a division and a square root, and the processor waits for each.
//! Here one plant per lane takes the same step side by side, and the compiler vectorises the controllers' decisions, the
//! growth and the fitness. A lane whose plant is done is refilled with the next episode, every few steps.
//!
//! Episodes come from a `dyn` iterator, which is asked once an episode: so the hot loop is compiled here, and not in each
//! crate that evolves.
//!

mod plants;
mod networks;
mod rules;

use std::cell::Cell;

use tropism_neat::Genome;

use networks::Networks;
use plants::{BatchTask, LANES, Plants};

use super::{Episode, fitness_of};
use crate::control::NetworkController;
use crate::plant::tip::TipModel;
use crate::simd::{Kernel, dispatch};
use crate::task::Task;
use crate::task::targets::Reading;

pub(super) use rules::fitness_of_rules;

/// Steps between two refills of lanes. Chosen by hand for speed.
const STRIDE: u32 = 16;

/// The fitness of each episode's genome on `model`, eq. (9), in order: what [`fitness_of`] gives for its network, to the bit.
///
/// Networks whose neurons are not step neurons are run by that, one by one.
///
/// # Panics
/// If a genome has not two inputs and one output.
#[must_use]
pub(super) fn fitness_of_networks(
    model: &TipModel,
    task: &Task,
    reading: Reading,
    episodes: &mut dyn Iterator<Item = Episode<&Genome>>,
) -> Vec<f64> {
    let mut batch = KEPT.take().unwrap_or_default();
    let one_by_one = |Episode { controller, noise }: Episode<&Genome>| {
        let mut controller =
            NetworkController::of_tip(controller).expect("a genome of two inputs and one output");
        fitness_of(model, &mut controller, task, noise)
    };
    let fitness = batch.run(&BatchTask::new(model, task, reading), episodes, one_by_one);
    KEPT.set(Some(batch));
    fitness
}

thread_local! {
    /// Reused from one generation to the next, so that its buffers are allocated once.
    static KEPT: Cell<Option<Box<Batch>>> = const { Cell::new(None) };
}

/// Plants and their networks, one of each in every lane.
#[derive(Default)]
struct Batch {
    plants: Plants,
    networks: Networks,
    /// Number of the episode in each lane.
    number: [Option<usize>; LANES],
}

impl Batch {
    /// The fitness of each episode, in order; networks that cannot run in lanes run by `one_by_one`.
    fn run(
        &mut self,
        task: &BatchTask<'_>,
        episodes: &mut dyn Iterator<Item = Episode<&Genome>>,
        one_by_one: impl Fn(Episode<&Genome>) -> f64,
    ) -> Vec<f64> {
        self.networks.begin();
        let mut fitness = Vec::with_capacity(episodes.size_hint().0);
        let mut running = 0;
        loop {
            for lane in self.plants.free_lanes() {
                if let Some(number) = self.number[lane].take() {
                    fitness[number] = self.plants.fitness(lane);
                    self.networks.retire(lane);
                    running -= 1;
                }
                self.plants.empty_lane(lane);
                for episode in &mut *episodes {
                    let number = fitness.len();
                    if self.networks.assign(lane, episode.controller) {
                        fitness.push(0.0);
                        self.plants.refill(lane, episode.noise, task);
                        self.number[lane] = Some(number);
                        running += 1;
                        break;
                    }
                    fitness.push(one_by_one(episode));
                }
            }
            if running == 0 {
                return fitness;
            }
            dispatch(Stride { batch: self, task });
        }
    }
}

/// Up to [`STRIDE`] steps of every plant.
struct Stride<'a> {
    batch: &'a mut Batch,
    task: &'a BatchTask<'a>,
}

impl Kernel for Stride<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Batch { plants, networks, .. } = self.batch;
        let steps = plants.steps_before_refill(STRIDE);
        for _ in 0..steps {
            plants.step(self.task, networks.decide(plants));
            networks.advance();
        }
        plants.count_steps(steps);
    }
}
