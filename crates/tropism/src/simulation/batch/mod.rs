//! Many simulated plants at once: the fast twin of [`fitness_of`], with the same bits.
//!
//! A step of one plant is a dependent chain of a look-up, a division and a square root, and the processor waits for each.
//! Here one plant per lane takes the same step side by side, and the compiler vectorises the controllers' decisions, the
//! growth and the fitness. A lane whose plant is done is refilled with the next episode, every few steps.
//!
//! Episodes come from a `dyn` iterator, which is asked once an episode: so the hot loop is compiled here, and not in each
//! crate that evolves.
//!
//! Grown networks, whose state transitions are scalar, do best in few lanes; minimal networks, a few operations each, in
//! many.

mod plants;
mod linear;
mod networks;
mod rules;

use std::cell::Cell;
use std::marker::PhantomData;

use tropism_neat::Genome;

use linear::LinearControllers;
use networks::Networks;
use plants::{BatchTask, Plants};

use super::{Episode, fitness_of};
use crate::control::NetworkController;
use crate::plant::tip::TipModel;
use crate::random::NoiseStream;
use crate::simd::{Kernel, dispatch};
use crate::task::Task;

pub use linear::LinearController;
pub(super) use rules::fitness_of_rules;

/// Lanes for networks of any size. Chosen by hand for speed.
const NETWORK_LANES: usize = 32;

/// Lanes for linear controllers. Chosen by hand for speed; faster than 128.
const LINEAR_LANES: usize = 256;

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
    episodes: &mut dyn Iterator<Item = Episode<&Genome>>,
) -> Vec<f64> {
    let mut batch = KEPT.take().unwrap_or_else(|| Box::new(Batch::new(Networks::default())));
    let plain = |genome: &&Genome, noise| {
        let mut controller =
            NetworkController::of_tip(genome).expect("a genome of two inputs and one output");
        fitness_of(model, &mut controller, task, noise)
    };
    let fitness = batch.run_with_room(model, task, episodes, plain);
    KEPT.set(Some(batch));
    fitness
}

/// The fitness of each episode's linear controller on `model`, eq. (9), in order: what [`fitness_of`] gives, to the bit.
#[must_use]
pub(super) fn fitness_of_linear(
    model: &TipModel,
    task: &Task,
    episodes: &mut dyn Iterator<Item = Episode<LinearController>>,
) -> Vec<f64> {
    let plain = |controller: &LinearController, noise| fitness_of(model, &mut { *controller }, task, noise);
    Batch::<_, LINEAR_LANES>::new(LinearControllers::empty()).run_with_room(model, task, episodes, plain)
}

thread_local! {
    /// Reused from one generation to the next, so that its buffers are allocated once.
    static KEPT: Cell<Option<Box<Batch<Networks<NETWORK_LANES>, NETWORK_LANES>>>> = const { Cell::new(None) };
}

/// Controllers side by side, one for each lane.
trait Controllers<One, const LANES: usize> {
    /// Prepares for a new set of episodes: all lanes are free.
    fn begin(&mut self) {}

    /// Puts a controller into a lane, at rest; `false` if it cannot be run in lanes.
    fn assign<const TARGETS: usize>(&mut self, lane: usize, one: &One, task: &BatchTask<'_, TARGETS>)
    -> bool;

    /// One step of every plant, under the light that its controller decides on.
    fn step<const TARGETS: usize>(&mut self, plants: &mut Plants<LANES>, task: &BatchTask<'_, TARGETS>);

    /// Marks the controller of a lane as no longer needed.
    fn retire(&mut self, _lane: usize) {}
}

struct Batch<C, const LANES: usize> {
    plants: Plants<LANES>,
    controllers: C,
    /// Number of the episode in each lane.
    number: [Option<usize>; LANES],
}

impl<C, const LANES: usize> Batch<C, LANES> {
    const fn new(controllers: C) -> Self {
        Self { plants: Plants::empty(), controllers, number: [None; LANES] }
    }

    /// [`Self::run`] with room for the paper's three targets or for 36; tasks with more targets run by `plain`.
    fn run_with_room<One>(
        &mut self,
        model: &TipModel,
        task: &Task,
        episodes: &mut dyn Iterator<Item = Episode<One>>,
        plain: impl Fn(&One, NoiseStream) -> f64,
    ) -> Vec<f64>
    where
        C: Controllers<One, LANES>,
    {
        if let Some(task) = BatchTask::<3>::new(model, task) {
            self.run(&task, episodes, plain)
        } else if let Some(task) = BatchTask::<36>::new(model, task) {
            self.run(&task, episodes, plain)
        } else {
            episodes.map(|Episode { controller, noise }| plain(&controller, noise)).collect()
        }
    }

    /// The fitness of each episode, in order; those that cannot run in lanes run by `plain`.
    fn run<One, const TARGETS: usize>(
        &mut self,
        task: &BatchTask<'_, TARGETS>,
        episodes: &mut dyn Iterator<Item = Episode<One>>,
        plain: impl Fn(&One, NoiseStream) -> f64,
    ) -> Vec<f64>
    where
        C: Controllers<One, LANES>,
    {
        self.controllers.begin();
        let mut fitness = Vec::with_capacity(episodes.size_hint().0);
        let mut running = 0;
        loop {
            for lane in self.plants.free_lanes() {
                if let Some(number) = self.number[lane].take() {
                    fitness[number] = self.plants.fitness(lane);
                    self.controllers.retire(lane);
                    running -= 1;
                }
                self.plants.empty_lane(lane);
                for Episode { controller, noise } in &mut *episodes {
                    let number = fitness.len();
                    if self.controllers.assign(lane, &controller, task) {
                        fitness.push(0.0);
                        self.plants.refill(lane, noise, task);
                        self.number[lane] = Some(number);
                        running += 1;
                        break;
                    }
                    fitness.push(plain(&controller, noise));
                }
            }
            if running == 0 {
                return fitness;
            }
            dispatch(Stride { batch: self, task, of: PhantomData });
        }
    }

    /// Up to [`STRIDE`] steps of every plant.
    #[inline(always)]
    fn stride<One, const TARGETS: usize>(&mut self, task: &BatchTask<'_, TARGETS>)
    where
        C: Controllers<One, LANES>,
    {
        let steps = self.plants.steps_before_refill(STRIDE);
        for _ in 0..steps {
            self.controllers.step(&mut self.plants, task);
        }
        self.plants.count_steps(steps);
    }
}

/// [`Batch::stride`] as a kernel.
struct Stride<'a, C, One, const LANES: usize, const TARGETS: usize> {
    batch: &'a mut Batch<C, LANES>,
    task: &'a BatchTask<'a, TARGETS>,
    of: PhantomData<One>,
}

impl<C, One, const LANES: usize, const TARGETS: usize> Kernel for Stride<'_, C, One, LANES, TARGETS>
where
    C: Controllers<One, LANES>,
{
    type Result = ();

    #[inline(always)]
    fn run(self) {
        self.batch.stride(self.task);
    }
}
