//! Many simulated plants at once: the fast twin of [`fitness_of`](super::fitness_of), and the same bits.
//!
//! A step of one plant is a chain of a look-up, a division and a square root, and the processor waits for each. Here as
//! many plants as there are lanes take the same step side by side, in arrays of single numbers, and the compiler makes
//! vectors of them. A plant that is done leaves its lane to the next one; lanes are refilled every eight steps, when new
//! luck is drawn.

#![allow(clippy::needless_range_loop, reason = "a loop over lanes reads and writes many arrays at one place")]

use tropism_neat::StepNetwork;

use crate::plant::PlantModel;
use crate::plant::table::Table;
use crate::plant::tip::{Sprout, TipModel};
use crate::random::{Draws, NORMALS};
use crate::task::Task;

/// Plants that are stepped side by side.
const LANES: usize = 32;

/// Steps for which luck is drawn at once.
const STRIDE: usize = Draws::STRIDE;

/// A controller and the luck in growth of the plant that it steers.
#[derive(Clone, Debug)]
pub struct Episode {
    /// The controller, at rest.
    pub network: StepNetwork<2>,
    /// The plant's luck.
    pub draws: Draws,
}

/// The fitness of each episode's controller on `model`, eq. (9), in order: for each, what
/// [`fitness_of`](super::fitness_of) says, to the bit.
#[must_use]
pub fn fitness_of_all(model: &TipModel, task: &Task, episodes: Vec<Episode>) -> Vec<f64> {
    let course = Course::new(model, task);
    let mut fitness = vec![0.0; episodes.len()];
    let mut queue = episodes.into_iter().enumerate();
    let mut lanes = Lanes::new();
    loop {
        let mut is_idle = true;
        for lane in 0..LANES {
            if !lanes.is_done(lane) {
                is_idle = false;
                continue;
            }
            if let Some((episode, _)) = lanes.episodes[lane].take() {
                fitness[episode] = lanes.fitness[lane];
            }
            if let Some((number, episode)) = queue.next() {
                lanes.seat(lane, number, episode, &course);
                is_idle = false;
            }
        }
        if is_idle {
            return fitness;
        }
        lanes.draw();
        dispatch::stride(&mut lanes, &course);
    }
}

/// Model and task as the lanes need them.
struct Course<'m> {
    table: &'m Table,
    seedling: Sprout,
    growth: [f32; 2],
    /// Of each target: bounds of x and y such that comparing single with double precision is comparing with these.
    targets: Vec<Bounds>,
    end: f32,
    max_steps: u32,
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
    fn new(model: &'m TipModel, task: &Task) -> Self {
        let bounds = |target: &crate::geometry::Point| Bounds {
            below: ceiling(target.x),
            above: -ceiling(-target.x),
            height: ceiling(target.y),
        };
        Self {
            table: model.table(),
            seedling: model.seedling(task.start),
            growth: [model.growth(0.0), model.config().growth.sd as f32],
            targets: task.targets.iter().map(bounds).collect(),
            end: ceiling(task.end_height_cm),
            max_steps: task.max_steps,
        }
    }
}

/// The least single-precision number that is not below `value`.
fn ceiling(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

struct Lanes {
    x: [f32; LANES],
    y: [f32; LANES],
    length: [f32; LANES],
    fitness: [f64; LANES],
    /// Steps that are left before the task's last.
    left: [u32; LANES],
    /// All ones while the plant's experiment goes on, else 0.
    is_alive: [u32; LANES],
    /// The light: 1 for right.
    light: [u32; LANES],
    /// Weights of x, y and bias, and threshold, of controllers that are a single neuron.
    linear: [[f64; LANES]; 4],
    is_linear: [bool; LANES],
    /// Number and controller of the episode in each lane.
    episodes: [Option<(usize, Episode)>; LANES],
    /// Steps since the episode began, in strides.
    stride: [u32; LANES],
    luck: [[f32; LANES]; STRIDE],
}

impl Lanes {
    fn new() -> Self {
        Self {
            x: [0.0; LANES],
            y: [1.0; LANES],
            length: [1.0; LANES],
            fitness: [0.0; LANES],
            left: [0; LANES],
            is_alive: [0; LANES],
            light: [0; LANES],
            linear: [[0.0; LANES]; 4],
            is_linear: [true; LANES],
            episodes: [const { None }; LANES],
            stride: [0; LANES],
            luck: [[0.0; LANES]; STRIDE],
        }
    }

    const fn is_done(&self, lane: usize) -> bool {
        self.is_alive[lane] == 0
    }

    fn seat(&mut self, lane: usize, number: usize, episode: Episode, course: &Course<'_>) {
        let Sprout { x, y, length } = course.seedling;
        (self.x[lane], self.y[lane], self.length[lane]) = (x, y, length);
        self.fitness[lane] = 0.0;
        self.left[lane] = course.max_steps;
        self.is_alive[lane] = if y >= course.end || course.max_steps == 0 { 0 } else { !0 };
        self.stride[lane] = 0;
        let linear = episode.network.linear();
        self.is_linear[lane] = linear.is_some();
        let ([of_x, of_y], bias, threshold) = linear.unwrap_or(([0.0; 2], 0.0, 0.0));
        for (row, value) in self.linear.iter_mut().zip([of_x, of_y, bias, threshold]) {
            row[lane] = value;
        }
        self.episodes[lane] = Some((number, episode));
    }

    /// Draws the luck of the next steps.
    fn draw(&mut self) {
        let normals: &[f32; 4096] = NORMALS.first_chunk().expect("4096 values");
        for lane in 0..LANES {
            if let (false, Some((_, episode))) = (self.is_done(lane), &self.episodes[lane]) {
                let ranks = episode.draws.ranks(self.stride[lane]);
                for (luck, rank) in self.luck.iter_mut().zip(ranks) {
                    luck[lane] = normals[usize::from(rank) & 4095];
                }
                self.stride[lane] += 1;
            }
        }
    }

    /// As many steps as luck was drawn for.
    #[inline(always)]
    fn stride(&mut self, course: &Course<'_>) {
        for step in 0..STRIDE {
            self.decide();
            self.advance(course, step);
        }
    }

    /// Lets every controller decide.
    #[inline(always)]
    fn decide(&mut self) {
        let [of_x, of_y, bias, threshold] = &self.linear;
        for lane in 0..LANES {
            let sensed = f64::from(self.x[lane]) * of_x[lane] + f64::from(self.y[lane]) * of_y[lane];
            self.light[lane] = u32::from(sensed + bias[lane] > threshold[lane]);
        }
        for lane in 0..LANES {
            if !self.is_linear[lane] && self.is_alive[lane] != 0 {
                let (x, y) = (f64::from(self.x[lane]), f64::from(self.y[lane]));
                if let Some((_, episode)) = &mut self.episodes[lane] {
                    self.light[lane] = u32::from(episode.network.activate([x, y]));
                }
            }
        }
    }

    /// One step of every plant, eqs. (4)-(8), and of its fitness, eq. (9). Each loop is one that becomes vectors.
    #[inline(always)]
    fn advance(&mut self, course: &Course<'_>, step: usize) {
        let shift = self.shifts(course.table);
        let [mean, sd] = course.growth;
        let (mut x, mut y, mut length) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let before = Sprout { x: self.x[lane], y: self.y[lane], length: self.length[lane] };
            let after = before.turned(shift[lane], mean + sd * self.luck[step][lane]);
            (x[lane], y[lane], length[lane]) = (after.x, after.y, after.length);
        }
        let gain = self.gains(course, &x, &y);
        for lane in 0..LANES {
            // Adding 0 to a sum that began with 0 changes no bit of it.
            self.fitness[lane] += if self.is_alive[lane] != 0 { gain[lane] } else { 0.0 };
        }
        for lane in 0..LANES {
            let is_alive = self.is_alive[lane] != 0;
            self.x[lane] = if is_alive { x[lane] } else { self.x[lane] };
            self.y[lane] = if is_alive { y[lane] } else { self.y[lane] };
            self.length[lane] = if is_alive { length[lane] } else { self.length[lane] };
            self.left[lane] = self.left[lane].wrapping_sub(self.is_alive[lane] & 1);
            let goes_on = (self.y[lane] < course.end) & (self.left[lane] > 0);
            self.is_alive[lane] &= if goes_on { !0 } else { 0 };
        }
    }

    /// The discrete fitness of the step to `x` and `y`, eq. (9).
    #[inline(always)]
    fn gains(&self, course: &Course<'_>, x: &[f32; LANES], y: &[f32; LANES]) -> [f64; LANES] {
        // 1 towards the next target, -1 away from it, 2 for the target itself, and 0 where no target counts.
        let mut sense = [0.0_f32; LANES];
        for target in course.targets.iter().rev() {
            for lane in 0..LANES {
                let not_right = if x[lane] < target.below { 1.0 } else { 2.0 };
                let side = if x[lane] > target.above { -1.0 } else { not_right };
                sense[lane] = if y[lane] < target.height { side } else { sense[lane] };
            }
        }
        let mut gain = [0.0; LANES];
        for lane in 0..LANES {
            let counts = if y[lane] < course.seedling.y { 0.0 } else { sense[lane] };
            let moved = f64::from(x[lane]) - f64::from(self.x[lane]);
            let towards = if counts == 2.0 { moved.abs() } else { moved * f64::from(counts) };
            gain[lane] = towards;
        }
        gain
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
            let episode = |(number, genome)| Episode {
                network: StepNetwork::new(genome).unwrap(),
                draws: draws(number),
            };
            let fast = fitness_of_all(&model, &task, part.iter().enumerate().map(episode).collect());
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
        assert!(fitness_of_all(&model(), &Task::default(), Vec::new()).is_empty());
    }
}
