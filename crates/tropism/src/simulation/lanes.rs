//! Many simulated plants at once: the fast twin of [`fitness_of`], and the same bits.
//!
//! A step of one plant is a chain of a look-up, a division and a square root, and the processor waits for each. Here as
//! many plants as there are lanes take the same step side by side, in arrays of single numbers, and the compiler makes
//! vectors of them: what each network senses, how each plant grows, and what it is worth. A network that is then in
//! another state than before goes on by itself. A plant that is done leaves its lane to the next one; lanes are refilled
//! every eight steps, when new luck is drawn.

#![allow(clippy::needless_range_loop, reason = "a loop over lanes reads and writes many arrays at one place")]

use std::cell::Cell;

use tropism_neat::{Genome, StepNetwork};

use super::fitness_of;
use crate::control::network::{INPUTS, NetworkController};
use crate::plant::PlantModel;
use crate::plant::table::Table;
use crate::plant::tip::{Sprout, TipModel};
use crate::random::{self, Draws, NORMALS};
use crate::task::Task;

/// Plants that are stepped side by side.
const LANES: usize = 32;

/// Steps for which luck is drawn at once.
const STRIDE: usize = Draws::STRIDE;

/// A controller, and the luck in growth of the plant that it steers.
#[derive(Clone, Debug)]
pub struct Episode<'g> {
    /// The controller, at rest.
    pub controller: Candidate<'g>,
    /// The plant's luck.
    pub draws: Draws,
}

/// A controller to be tried.
#[derive(Clone, Debug)]
pub enum Candidate<'g> {
    /// The network of a genome.
    Genome(&'g Genome),
    /// A network such as NEAT begins with, one step neuron.
    Seed {
        /// Weights of x and y.
        weights: [f64; INPUTS],
        /// Weight of the bias.
        bias: f64,
        /// What their sum must exceed for the light to be right.
        threshold: f64,
    },
}

/// The fitness of each episode's controller on `model`, eq. (9), in order: for each, what
/// [`fitness_of`] says, to the bit.
///
/// Networks that are not of step neurons are run by that, one by one.
///
/// # Panics
/// If a genome has not two inputs and one output.
#[must_use]
pub fn fitness_of_all<'g>(
    model: &TipModel,
    task: &Task,
    episodes: impl IntoIterator<Item = Episode<'g>>,
) -> Vec<f64> {
    let mut lanes = KEPT.take().unwrap_or_default();
    let fitness = lanes.run(&Course::new(model, task), episodes);
    KEPT.set(Some(lanes));
    fitness
}

thread_local! {
    /// Kept from one generation to the next, for the room in it.
    static KEPT: Cell<Option<Box<Lanes>>> = const { Cell::new(None) };
}

/// Model and task as the lanes need them.
struct Course<'m> {
    model: &'m TipModel,
    task: &'m Task,
    table: &'m Table,
    seedling: Sprout,
    growth: [f32; 2],
    /// Of each target: bounds of x and y such that comparing single with double precision is comparing with these.
    targets: Vec<Bounds>,
    end: f32,
    max_steps: i32,
}

/// A target in single precision.
#[derive(Clone, Copy)]
struct Bounds {
    /// `x < target.x` is `x < below`.
    below: f32,
    /// `x > target.x` is `x > above`.
    above: f32,
    /// `y < target.y` is `y < height`.
    height: f32,
}

impl<'m> Course<'m> {
    fn new(model: &'m TipModel, task: &'m Task) -> Self {
        let bounds = |target: &crate::geometry::Point| Bounds {
            below: ceiling(target.x),
            above: -ceiling(-target.x),
            height: ceiling(target.y),
        };
        Self {
            model,
            task,
            table: model.table(),
            seedling: model.seedling(task.start),
            growth: [model.growth(0.0), model.config().growth.sd as f32],
            targets: task.targets.iter().map(bounds).collect(),
            end: ceiling(task.end_height_cm),
            // A task has at most a million.
            max_steps: task.max_steps.min(i32::MAX as u32) as i32,
        }
    }
}

/// The least single-precision number that is not below `value`.
fn ceiling(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

#[repr(C, align(64))]
struct Lanes {
    x: [f32; LANES],
    y: [f32; LANES],
    length: [f32; LANES],
    /// The tip in double precision, as networks see it.
    seen: [[f64; LANES]; 2],
    fitness: [f64; LANES],
    /// Steps that are left before the task's last.
    left: [i32; LANES],
    /// All ones while the plant's experiment goes on, else 0.
    is_alive: [u32; LANES],
    /// The light: 1 for right.
    light: [u32; LANES],
    /// Which sensors of each network fire, one bit each; the first is the light.
    fired: [u64; LANES],
    /// Those that matter for what comes next, and which of them fire if the network stays in the state that it is in.
    watched: [u64; LANES],
    stay: [u64; LANES],
    /// Whether the network goes on to another state.
    goes_on: [u8; LANES],
    luck: [[f32; LANES]; STRIDE],
    /// Strides since the episode began; the numbers that name its luck; and the seed.
    counter: [[u32; LANES]; 4],
    key: [[u32; LANES]; 2],
    /// The first sensor of each network, the second, and so on.
    sensors: Vec<Sensors>,
    /// What other links than those of the inputs bring to them.
    rest: Vec<[f64; LANES]>,
    networks: Vec<StepNetwork<INPUTS>>,
    /// Number of the episode in each lane.
    number: [Option<usize>; LANES],
}

/// One sensor of each network.
#[repr(C, align(64))]
struct Sensors {
    weights: [[f64; LANES]; INPUTS],
    threshold: [f64; LANES],
}

impl Default for Lanes {
    fn default() -> Self {
        Self {
            x: [0.0; LANES],
            y: [1.0; LANES],
            length: [1.0; LANES],
            seen: [[0.0; LANES]; 2],
            fitness: [0.0; LANES],
            left: [0; LANES],
            is_alive: [0; LANES],
            light: [0; LANES],
            fired: [0; LANES],
            watched: [0; LANES],
            stay: [0; LANES],
            goes_on: [0; LANES],
            luck: [[0.0; LANES]; STRIDE],
            counter: [[0; LANES]; 4],
            key: [[0; LANES]; 2],
            sensors: Vec::new(),
            rest: Vec::new(),
            networks: vec![StepNetwork::default(); LANES],
            number: [None; LANES],
        }
    }
}

impl Lanes {
    /// The fitness of each episode, in order.
    fn run<'g>(&mut self, course: &Course<'_>, episodes: impl IntoIterator<Item = Episode<'g>>) -> Vec<f64> {
        // No more sensors than these episodes need.
        self.sensors.clear();
        self.rest.clear();
        let mut fitness = Vec::new();
        let mut queue = episodes.into_iter();
        loop {
            for lane in 0..LANES {
                if self.is_alive[lane] != 0 {
                    continue;
                }
                if let Some(number) = self.number[lane].take() {
                    fitness[number] = self.fitness[lane];
                    // Nothing that it senses matters any longer: the network stays as it is.
                    (self.watched[lane], self.stay[lane]) = (0, 0);
                }
                for Episode { controller, draws } in queue.by_ref() {
                    let number = fitness.len();
                    fitness.push(0.0);
                    let network = &mut self.networks[lane];
                    let is_step = match controller {
                        Candidate::Seed { weights, bias, threshold } => {
                            network.assign_seed(weights, bias, threshold);
                            true
                        }
                        Candidate::Genome(genome) => network.assign(genome),
                    };
                    if is_step {
                        self.seat(lane, number, draws, course);
                        break;
                    }
                    if let Candidate::Genome(genome) = controller {
                        let plain = NetworkController::new(genome);
                        let mut plain = plain.expect("a genome of two inputs and one output");
                        fitness[number] = fitness_of(course.model, &mut plain, course.task, draws);
                    }
                }
            }
            if self.number == [None; LANES] {
                return fitness;
            }
            dispatch::stride(self, course);
        }
    }

    /// Begins episode `number` with the network that was put into `lane`.
    fn seat(&mut self, lane: usize, number: usize, draws: Draws, course: &Course<'_>) {
        let Sprout { x, y, length } = course.seedling;
        (self.x[lane], self.y[lane], self.length[lane]) = (x, y, length);
        (self.seen[0][lane], self.seen[1][lane]) = (x.into(), y.into());
        self.fitness[lane] = 0.0;
        self.left[lane] = course.max_steps;
        self.is_alive[lane] = if y >= course.end || course.max_steps == 0 { 0 } else { !0 };
        let (key, [first, second, third]) = draws.names();
        for (row, value) in self.counter.iter_mut().zip([0, first, second, third]) {
            row[lane] = value;
        }
        for (row, value) in self.key.iter_mut().zip(key) {
            row[lane] = value;
        }
        let network = &self.networks[lane];
        for (place, sensor) in network.sensors().iter().enumerate() {
            if place == self.sensors.len() {
                self.sensors.push(Sensors::still());
            }
            let row = &mut self.sensors[place];
            row.threshold[lane] = sensor.threshold;
            for (weights, weight) in row.weights.iter_mut().zip(sensor.weights) {
                weights[lane] = weight;
            }
        }
        while self.rest.len() < 4 * network.rest().len() {
            self.rest.push([0.0; LANES]);
        }
        self.watched[lane] = network.watched();
        self.refresh(lane);
        self.number[lane] = Some(number);
    }

    /// Takes over what the state of the network in `lane` brings to its sensors.
    #[inline(always)]
    fn refresh(&mut self, lane: usize) {
        let network = &self.networks[lane];
        let (rows, _) = self.rest.as_chunks_mut::<4>();
        for (rows, rest) in rows.iter_mut().zip(network.rest()) {
            rows.iter_mut().zip(rest).for_each(|(row, rest)| row[lane] = rest);
        }
        self.stay[lane] = network.stay();
    }

    /// As many steps as luck is drawn for at once.
    #[inline(always)]
    fn stride(&mut self, course: &Course<'_>) {
        self.draw();
        for step in 0..STRIDE {
            self.decide();
            self.advance(course, step);
            self.go_on();
        }
    }

    /// Draws the luck of the next steps: [`Draws::normal`] in every lane.
    #[inline(always)]
    fn draw(&mut self) {
        let normals: &[f32; 4096] = NORMALS.first_chunk().expect("4096 values");
        let words = random::philox_of_all(&self.counter, &self.key);
        for (word, words) in words.iter().enumerate() {
            for lane in 0..LANES {
                self.luck[2 * word][lane] = normals[(words[lane] >> 4 & 4095) as usize];
                self.luck[2 * word + 1][lane] = normals[(words[lane] >> 20) as usize];
            }
        }
        for lane in 0..LANES {
            self.counter[0][lane] = self.counter[0][lane].wrapping_add(1);
        }
    }

    /// Lets every controller decide.
    #[inline(always)]
    fn decide(&mut self) {
        self.fired = [0; LANES];
        for (place, (row, rest)) in self.sensors.iter().zip(&self.rest).enumerate() {
            let bit = 1 << place;
            for lane in 0..LANES {
                let [of_x, of_y] = [row.weights[0][lane], row.weights[1][lane]];
                let sensed = self.seen[0][lane] * of_x + self.seen[1][lane] * of_y;
                let fires = sensed + rest[lane] > row.threshold[lane];
                self.fired[lane] |= if fires { bit } else { 0 };
            }
        }
        for lane in 0..LANES {
            self.light[lane] = self.fired[lane] as u32 & 1;
            self.goes_on[lane] = u8::from(self.fired[lane] & self.watched[lane] != self.stay[lane]);
        }
    }

    /// Lets every network go on to its next state.
    ///
    /// This comes after the plants have grown, although it could come before: which networks change is hard to guess, and
    /// the processor finds out while the plants' long sums are under way.
    #[inline(always)]
    fn go_on(&mut self) {
        let mut lanes = bits(&self.goes_on);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            self.networks[lane].go_on(self.fired[lane] & self.watched[lane]);
            self.refresh(lane);
        }
    }

    /// One step of every plant, eqs. (4)-(8), and of its fitness, eq. (9). Each loop is one that becomes vectors.
    ///
    /// A plant whose experiment is over grows on until its lane is refilled, and nothing comes of it.
    #[inline(always)]
    fn advance(&mut self, course: &Course<'_>, step: usize) {
        let shift = self.shifts(course.table);
        let [mean, sd] = course.growth;
        let before = self.x;
        for lane in 0..LANES {
            let sprout = Sprout { x: self.x[lane], y: self.y[lane], length: self.length[lane] };
            let sprout = sprout.turned(shift[lane], mean + sd * self.luck[step][lane]);
            (self.x[lane], self.y[lane], self.length[lane]) = (sprout.x, sprout.y, sprout.length);
        }
        let sense = self.senses(course, &before);
        for lane in 0..LANES {
            let (x, y) = (f64::from(self.x[lane]), f64::from(self.y[lane]));
            // Adding a zero to a sum that began with 0 changes no bit of it.
            self.fitness[lane] += (x - self.seen[0][lane]) * f64::from(sense[lane]);
            (self.seen[0][lane], self.seen[1][lane]) = (x, y);
        }
        for lane in 0..LANES {
            self.left[lane] -= 1;
            let goes_on = (self.y[lane] < course.end) & (self.left[lane] > 0);
            self.is_alive[lane] &= u32::from(goes_on).wrapping_neg();
        }
    }

    /// What the movement of each tip from `before` counts, eq. (9): 1 as it is, -1 its opposite, 0 nothing.
    #[inline(always)]
    fn senses(&self, course: &Course<'_>, before: &[f32; LANES]) -> [f32; LANES] {
        let mut sense = [0.0_f32; LANES];
        for target in course.targets.iter().rev() {
            for lane in 0..LANES {
                let (x, y) = (self.x[lane], self.y[lane]);
                // On the target itself, any way that it came was right.
                let on_it = if x < before[lane] { -1.0 } else { 1.0 };
                let not_right = if x < target.below { 1.0 } else { on_it };
                let side = if x > target.above { -1.0 } else { not_right };
                sense[lane] = if y < target.height { side } else { sense[lane] };
            }
        }
        for lane in 0..LANES {
            let counts = (self.y[lane] >= course.seedling.y) & (self.is_alive[lane] != 0);
            sense[lane] = if counts { sense[lane] } else { 0.0 };
        }
        sense
    }

    /// The mean shift at the node nearest to each tip.
    #[inline(always)]
    fn shifts(&self, table: &Table) -> [f32; LANES] {
        let mut places = [0; LANES];
        for lane in 0..LANES {
            places[lane] = 2 * table.node(self.x[lane], self.y[lane]) as u32 + self.light[lane];
        }
        let mut shifts = [0.0; LANES];
        for lane in 0..LANES {
            shifts[lane] = table.shifts[places[lane] as usize];
        }
        shifts
    }
}

/// One bit for each lane, from its byte of 0 or 1.
#[inline(always)]
fn bits(bytes: &[u8; LANES]) -> u64 {
    let (groups, _) = bytes.as_chunks::<8>();
    groups.iter().rev().fold(0, |bits, group| {
        // Byte n is moved to bit 56 + n, and no two meet on the way.
        bits << 8 | u64::from_le_bytes(*group).wrapping_mul(0x0102_0408_1020_4080) >> 56
    })
}

impl Sensors {
    const fn still() -> Self {
        Self { weights: [[0.0; LANES]; INPUTS], threshold: [0.0; LANES] }
    }
}

/// The widest vectors that this processor has, chosen when the program runs. All give the same bits: nothing is fused or
/// summed in another order.
#[allow(
    unsafe_code,
    reason = "calling a function that is compiled for a processor which was found to be here"
)]
mod dispatch {
    use super::{Course, Lanes};

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw")]
    fn stride_avx512(lanes: &mut Lanes, course: &Course<'_>) {
        lanes.stride(course);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn stride_avx2(lanes: &mut Lanes, course: &Course<'_>) {
        lanes.stride(course);
    }

    /// [`Lanes::stride`].
    pub(super) fn stride(lanes: &mut Lanes, course: &Course<'_>) {
        #[cfg(target_arch = "x86_64")]
        {
            let has_avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw");
            if has_avx512 {
                // SAFETY: the processor has the features that the function is compiled for.
                return unsafe { stride_avx512(lanes, course) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: as above.
                return unsafe { stride_avx2(lanes, course) };
            }
        }
        lanes.stride(course);
    }
}

#[cfg(test)]
mod tests {
    use super::super::fitness_of;
    use super::*;
    use crate::control::network::NetworkController;
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
            let config = Config { mutate_add_neuron_prob: 0.2, mutate_add_link_prob: 0.4, ..Config::paper() };
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
        ] {
            let episode =
                |(number, genome)| Episode { controller: Candidate::Genome(genome), draws: draws(number) };
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

    #[test]
    fn no_episodes_are_no_work() {
        assert!(fitness_of_all(&model(), &Task::default(), []).is_empty());
    }
}
