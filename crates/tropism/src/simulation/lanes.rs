//! Many simulated plants at once: the fast twin of [`fitness_of`], and the same bits.
//!
//! A step of one plant is a chain of a look-up, a division and a square root, and the processor waits for each. Here as
//! many plants as there are lanes take the same step side by side, and the compiler makes vectors of them: what each
//! controller decides, how each plant grows, and what it is worth. A plant that is done leaves its lane to the next one; lanes
//! are refilled every few steps.
//!
//! Networks of any size, of which each goes on from state to state by itself, do best in few lanes; networks such as NEAT
//! begins with, which take a few operations, in many.

use std::cell::Cell;
use std::marker::PhantomData;

use tropism_neat::Genome;

use super::fitness_of;
use super::networks::Networks;
use super::plants::{Course, Plants};
use super::seeds::{Seed, Seeds};
use crate::control::network::NetworkController;
use crate::plant::tip::TipModel;
use crate::random::Draws;
use crate::task::Task;
use crate::wide::{Work, widest};

/// Plants side by side that are steered by any networks.
const OF_NETWORKS: usize = 32;

/// Plants side by side that are steered by the smallest ones.
const OF_SEEDS: usize = 256;

/// Steps after which lanes are refilled.
const STRIDE: u32 = 16;

/// A controller, and the luck in growth of the plant that it steers.
#[derive(Clone, Debug)]
pub struct Episode<C> {
    /// The controller, at rest.
    pub controller: C,
    /// The plant's luck.
    pub draws: Draws,
}

/// The fitness of each episode's genome on `model`, eq. (9), in order: for each, what [`fitness_of`] says of its network,
/// to the bit.
///
/// Networks that are not of step neurons are run by that, one by one.
///
/// # Panics
/// If a genome has not two inputs and one output.
#[must_use]
pub fn fitness_of_all<'g>(
    model: &TipModel,
    task: &Task,
    episodes: impl IntoIterator<Item = Episode<&'g Genome>>,
) -> Vec<f64> {
    let mut lanes = KEPT.take().unwrap_or_else(|| Box::new(Lanes::new(Networks::default())));
    let plain = |genome: &&Genome, draws| {
        let mut controller = NetworkController::new(genome).expect("a genome of two inputs and one output");
        fitness_of(model, &mut controller, task, draws)
    };
    let fitness = lanes.run_with_room(model, task, episodes, plain);
    KEPT.set(Some(lanes));
    fitness
}

/// The fitness of each episode's seed on `model`, eq. (9), in order: for each, what [`fitness_of`] says of it, to the bit.
#[must_use]
pub fn fitness_of_seeds(
    model: &TipModel,
    task: &Task,
    episodes: impl IntoIterator<Item = Episode<Seed>>,
) -> Vec<f64> {
    let plain = |seed: &Seed, draws| fitness_of(model, &mut { *seed }, task, draws);
    Lanes::<_, OF_SEEDS>::new(Seeds::none()).run_with_room(model, task, episodes, plain)
}

thread_local! {
    /// Kept from one generation to the next, for the room in it.
    static KEPT: Cell<Option<Box<Lanes<Networks<OF_NETWORKS>, OF_NETWORKS>>>> = const { Cell::new(None) };
}

/// Controllers side by side, one for each lane.
pub(super) trait Controllers<One, const LANES: usize> {
    /// Episodes begin: all lanes are free.
    fn begin(&mut self) {}

    /// Puts a controller into a lane, at rest; `false` if it is none for lanes.
    fn assign<const TARGETS: usize>(&mut self, lane: usize, one: &One, course: &Course<'_, TARGETS>) -> bool;

    /// One step of every plant, under the light that its controller decides on.
    fn step<const TARGETS: usize>(&mut self, plants: &mut Plants<LANES>, course: &Course<'_, TARGETS>);

    /// The plant of a lane is done: nothing that its controller senses matters any longer.
    fn rest(&mut self, _lane: usize) {}
}

struct Lanes<C, const LANES: usize> {
    plants: Plants<LANES>,
    controllers: C,
    /// Number of the episode in each lane.
    number: [Option<usize>; LANES],
}

impl<C, const LANES: usize> Lanes<C, LANES> {
    const fn new(controllers: C) -> Self {
        Self { plants: Plants::none(), controllers, number: [None; LANES] }
    }

    /// [`Self::run`] with room for the paper's three targets, for three dozen, or, of tasks with more, all by `plain`.
    fn run_with_room<One>(
        &mut self,
        model: &TipModel,
        task: &Task,
        episodes: impl IntoIterator<Item = Episode<One>>,
        plain: impl Fn(&One, Draws) -> f64,
    ) -> Vec<f64>
    where
        C: Controllers<One, LANES>,
    {
        let episodes = episodes.into_iter();
        if let Some(course) = Course::<3>::new(model, task) {
            self.run(&course, episodes, plain)
        } else if let Some(course) = Course::<36>::new(model, task) {
            self.run(&course, episodes, plain)
        } else {
            episodes.map(|Episode { controller, draws }| plain(&controller, draws)).collect()
        }
    }

    /// The fitness of each episode, in order; of those that are none for lanes, by `plain`.
    fn run<One, const TARGETS: usize>(
        &mut self,
        course: &Course<'_, TARGETS>,
        mut episodes: impl Iterator<Item = Episode<One>>,
        plain: impl Fn(&One, Draws) -> f64,
    ) -> Vec<f64>
    where
        C: Controllers<One, LANES>,
    {
        self.controllers.begin();
        let mut fitness = Vec::with_capacity(episodes.size_hint().0);
        let mut seated = 0;
        loop {
            for lane in self.plants.free() {
                if let Some(number) = self.number[lane].take() {
                    fitness[number] = self.plants.fitness(lane);
                    self.controllers.rest(lane);
                    seated -= 1;
                }
                self.plants.leave(lane);
                for Episode { controller, draws } in episodes.by_ref() {
                    let number = fitness.len();
                    if self.controllers.assign(lane, &controller, course) {
                        fitness.push(0.0);
                        self.plants.seat(lane, draws, course);
                        self.number[lane] = Some(number);
                        seated += 1;
                        break;
                    }
                    fitness.push(plain(&controller, draws));
                }
            }
            if seated == 0 {
                return fitness;
            }
            widest(Stride { lanes: self, course, of: PhantomData });
        }
    }

    /// A few steps of every plant.
    #[inline(always)]
    fn stride<One, const TARGETS: usize>(&mut self, course: &Course<'_, TARGETS>)
    where
        C: Controllers<One, LANES>,
    {
        let steps = self.plants.steps(STRIDE);
        for _ in 0..steps {
            self.controllers.step(&mut self.plants, course);
        }
        self.plants.have_taken(steps);
    }
}

/// [`Lanes::stride`].
struct Stride<'a, C, One, const LANES: usize, const TARGETS: usize> {
    lanes: &'a mut Lanes<C, LANES>,
    course: &'a Course<'a, TARGETS>,
    of: PhantomData<One>,
}

impl<C, One, const LANES: usize, const TARGETS: usize> Work for Stride<'_, C, One, LANES, TARGETS>
where
    C: Controllers<One, LANES>,
{
    type Result = ();

    #[inline(always)]
    fn work(self) {
        self.lanes.stride(self.course);
    }
}

#[cfg(test)]
mod tests {
    use super::super::fitness_of;
    use super::*;
    use crate::geometry::Point;
    use crate::plant::tip::TipModelConfig;
    use crate::random::{self, Purpose};
    use crate::track::Track;
    use tropism_neat::{Config, Genome, Neat};

    fn model() -> TipModel {
        let mut rng = random::stream(5, Purpose::Growth, 0);
        let mut text = "tip_x_cm,tip_y_cm,light\n".to_owned();
        let (mut x, mut y) = (0.0_f64, 4.0);
        for step in 0..3000 {
            let right = step / 70 % 2 == 0;
            text += &format!("{x:.4},{y:.4},{}\n", if right { "right" } else { "left" });
            x += (if right { 0.12 } else { -0.12 }) - 0.01 * x + 0.05 * random::normal(&mut rng);
            y = 4.0 + f64::from(step % 1000) * 0.012 - 0.02 * x.abs();
        }
        TipModel::fit([&Track::read_csv(text.as_bytes()).unwrap()], TipModelConfig::default()).unwrap()
    }

    /// Genomes from seeds to networks of over a hundred links.
    fn genomes(count: usize) -> Vec<Genome> {
        let mut genomes = Vec::new();
        for seed in 0.. {
            let config =
                Config { mutate_add_neuron_prob: 0.2, mutate_add_link_prob: 0.4, ..Config::wahby2016() };
            let mut neat = Neat::new(config, 2, 1, seed).unwrap();
            for _ in 0..150 {
                genomes.extend_from_slice(neat.ask());
                let scores: Vec<f64> = neat.ask().iter().map(|genome| genome.links().len() as f64).collect();
                neat.tell(&scores).unwrap();
                if genomes.len() >= count {
                    genomes.truncate(count);
                    return genomes;
                }
            }
        }
        unreachable!()
    }

    #[test]
    fn ten_thousand_genomes_of_all_sizes_have_the_fitness_of_the_plain_path_to_the_bit() {
        let (model, genomes) = (model(), genomes(10_000));
        assert!(genomes.iter().map(|genome| genome.links().len()).max().unwrap() > 80);
        let draws = |episode: usize| Draws::new(9, Purpose::Trial, [episode as u32, 0, 0]);
        for (task, part) in [
            (Task::default(), &genomes[..]),
            (Task { max_steps: 37, ..Task::default() }, &genomes[..300]),
            (Task { end_height_cm: 60.0, max_steps: 123, ..Task::default() }, &genomes[5000..5300]),
            (Task { targets: Vec::new(), ..Task::default() }, &genomes[9000..9100]),
            (many_targets(7), &genomes[8000..8100]),
            (many_targets(50), &genomes[8100..8140]),
        ] {
            let episode = |(number, genome)| Episode { controller: genome, draws: draws(number) };
            let fast = fitness_of_all(&model, &task, part.iter().enumerate().map(episode));
            for (number, genome) in part.iter().enumerate() {
                let mut plain = NetworkController::new(genome).unwrap();
                let exact = fitness_of(&model, &mut plain, &task, draws(number));
                assert_eq!(
                    fast[number].to_bits(),
                    exact.to_bits(),
                    "genome {number}: {} {exact}",
                    fast[number]
                );
            }
        }
    }

    fn many_targets(count: u32) -> Task {
        let place = |number: u32| {
            Point::new(if number.is_multiple_of(2) { 0.7 } else { -0.3 }, 4.1 + 0.18 * f64::from(number))
        };
        Task { targets: (0..count).map(place).collect(), ..Task::default() }
    }

    #[test]
    fn seeds_of_any_size_have_the_fitness_of_their_genomes_to_the_bit() {
        let model = model();
        for (task, range, count) in [
            (Task::default(), 1.0, 3000),
            // Weights such that single precision is in doubt at every step.
            (Task::default(), 1e5, 300),
            (Task { max_steps: 37, ..Task::default() }, 0.1, 300),
            (many_targets(7), 1.0, 300),
            (many_targets(50), 1.0, 20),
        ] {
            let config = Config { initial_weight_range: range, ..Config::wahby2016() };
            let draws = |index: u64| Draws::new(9, Purpose::Trial, [index as u32, 0, 0]);
            let genome = |index| tropism_neat::random_genome(&config, 2, 1, 4, index);
            let seeds = (0..count).map(|index| {
                let genome = genome(index);
                let [of_x, of_y, bias] = [0, 1, 2].map(|link| genome.links()[link].weight);
                let output = tropism_neat::LinearThreshold { weights: [of_x, of_y], threshold: 0.5 };
                Episode { controller: Seed { output, bias }, draws: draws(index) }
            });
            let fast = fitness_of_seeds(&model, &task, seeds);
            for (index, fast) in (0..).zip(fast) {
                let mut plain = NetworkController::new(&genome(index)).unwrap();
                let exact = fitness_of(&model, &mut plain, &task, draws(index));
                assert_eq!(fast.to_bits(), exact.to_bits(), "range {range}, seed {index}: {fast} {exact}");
            }
        }
    }

    #[test]
    fn no_episodes_are_no_work() {
        assert!(fitness_of_all(&model(), &Task::default(), []).is_empty());
    }
}
