//! Many plants of the tip model side by side, as a structure of arrays: each loop over the lanes is one step of all plants,
//! and the compiler vectorises it.

#![allow(clippy::needless_range_loop, reason = "a loop over lanes reads and writes many arrays at one place")]

use crate::math::{Lanes, Real};
use crate::plant::table::Table;
use crate::plant::tip::{TipModel, TipState};
use crate::random::{self, NoiseStream, STEP_INCREMENT};
use crate::task::Reading;
use crate::task::Task;

/// Plants side by side. Chosen for speed: state transitions of networks are scalar, and do best in few lanes.
pub(super) const LANES: usize = 32;

/// Plants whose step is scored at once. Chosen: a vector of AVX2.
const SCORED: usize = 4;

/// Model and task in the form that the lanes need.
pub(super) struct BatchTask<'m> {
    table: &'m Table,
    seedling: TipState,
    /// Mean and standard deviation of the growth of a step, in cm.
    growth: [f32; 2],
    task: &'m Task,
    reading: Reading,
}

impl<'m> BatchTask<'m> {
    pub(super) fn new(model: &'m TipModel, task: &'m Task, reading: Reading) -> Self {
        let growth = [model.growth(0.0), model.config().growth.sd as f32];
        Self { table: model.table(), seedling: model.seedling_at(task.start), growth, task, reading }
    }
}

/// The state of the plants, one in each lane.
///
/// A plant whose experiment is over grows on until its lane is refilled; it no longer adds to the fitness.
#[repr(C, align(64))]
pub(super) struct Plants {
    x: [f32; LANES],
    y: [f32; LANES],
    length: [f32; LANES],
    /// x and y in double precision, as networks and scores take them.
    pub(super) tip: [[f64; LANES]; 2],
    /// Greatest height of the tip so far, by which the next target is found; infinity when the experiment is over.
    highest: [f64; LANES],
    /// Index of each plant's shift in the table, and the shift, in cm.
    place: [u32; LANES],
    shift: [f32; LANES],
    /// Standard normal draw of the step.
    growth_noise: [f32; LANES],
    fitness: [f64; LANES],
    /// Steps that remain before the task's last.
    steps_left: [u32; LANES],
    /// 1 where the lane is free, else 0.
    is_free: [u8; LANES],
    /// Noise key of each lane, in two halves. The first half is shifted back by the step at which the lane was refilled, so
    /// that one counter serves all lanes.
    key: [[u32; LANES]; 2],
    /// Steps taken by the batch: the counter of the noise.
    now: u32,
}

impl Default for Plants {
    /// No plants: all lanes are free.
    fn default() -> Self {
        Self {
            x: [0.0; LANES],
            y: [1.0; LANES],
            length: [1.0; LANES],
            tip: [[0.0; LANES], [1.0; LANES]],
            highest: [f64::INFINITY; LANES],
            place: [0; LANES],
            shift: [0.0; LANES],
            growth_noise: [0.0; LANES],
            fitness: [0.0; LANES],
            steps_left: [u32::MAX; LANES],
            is_free: [1; LANES],
            key: [[0; LANES]; 2],
            now: 0,
        }
    }
}

impl Plants {
    /// Puts a seedling into a lane.
    pub(super) fn refill(&mut self, lane: usize, noise: NoiseStream, batch: &BatchTask<'_>) {
        let BatchTask { seedling, task, .. } = batch;
        (self.x[lane], self.y[lane], self.length[lane]) = (seedling.x, seedling.y, seedling.length);
        let [x, y] = [seedling.x, seedling.y].map(f64::from);
        (self.tip[0][lane], self.tip[1][lane]) = (x, y);
        self.highest[lane] = if y >= task.end_height_cm || task.max_steps == 0 { f64::INFINITY } else { y };
        self.steps_left[lane] = task.max_steps;
        self.is_free[lane] = 0;
        self.fitness[lane] = 0.0;
        let [first, second] = noise.key();
        self.key[0][lane] = first.wrapping_sub(self.now.wrapping_mul(STEP_INCREMENT));
        self.key[1][lane] = second;
    }

    /// The free lanes.
    pub(super) fn free_lanes(&self) -> impl Iterator<Item = usize> + use<> {
        lanes_of(self.is_free)
    }

    /// The fitness of the plant in a lane.
    pub(super) const fn fitness(&self, lane: usize) -> f64 {
        self.fitness[lane]
    }

    /// How many steps all plants can take, up to `most`, before the first one has taken its last.
    #[inline(always)]
    pub(super) fn steps_before_refill(&self, most: u32) -> u32 {
        self.steps_left.iter().fold(most, |least, &left| if left < least { left } else { least })
    }

    /// Counts `steps` that were taken, and frees the lanes whose experiment is over.
    #[inline(always)]
    pub(super) fn count_steps(&mut self, steps: u32) {
        for lane in 0..LANES {
            self.steps_left[lane] -= steps;
            self.is_free[lane] =
                ((self.steps_left[lane] == 0) | (self.highest[lane] == f64::INFINITY)).into();
        }
    }

    /// Empties a lane.
    pub(super) const fn empty_lane(&mut self, lane: usize) {
        (self.highest[lane], self.steps_left[lane]) = (f64::INFINITY, u32::MAX);
    }

    /// One step of every plant under its light, 1 for right, eqs. (4)-(8), and of its fitness, eq. (9).
    #[inline(always)]
    pub(super) fn step(&mut self, batch: &BatchTask<'_>, light: &[u32; LANES]) {
        let table = batch.table;
        for lane in 0..LANES {
            self.place[lane] = table.place(self.x[lane], self.y[lane], light[lane]);
        }
        self.draw_and_look_up(table);
        self.grow(batch.growth);
        self.score(batch);
    }

    /// Draws the growth noise of the step, [`NoiseStream::normal`] in every lane, and looks up the mean shift at the node
    /// nearest to each tip.
    ///
    /// Sixteen lanes at a time, so that the processor draws noise in vectors while scalar loads fetch the shifts: on many
    /// processors gather instructions are slower than loads.
    #[inline(always)]
    fn draw_and_look_up(&mut self, table: &Table) {
        /// Chosen: two vectors of AVX2.
        const PART: usize = 16;
        let (now, shifts) = (self.now, table.shifts());
        let [keys, others] = &self.key;
        let keys = keys.as_chunks::<PART>().0.iter().zip(others.as_chunks::<PART>().0);
        let noises = self.growth_noise.as_chunks_mut::<PART>().0.iter_mut();
        let places = self.place.as_chunks::<PART>().0.iter();
        let found = self.shift.as_chunks_mut::<PART>().0.iter_mut();
        for (((key, other), noise), (place, found)) in keys.zip(noises).zip(places.zip(found)) {
            for lane in 0..PART {
                noise[lane] = random::approx_normal(random::noise_bits([key[lane], other[lane]], now));
            }
            let (places, _) = place.as_chunks::<8>();
            let (found, _) = found.as_chunks_mut::<8>();
            for (found, place) in found.iter_mut().zip(places) {
                let [a, b, c, d, e, f, g, h] = place.map(|place| place as usize);
                *found =
                    [shifts[a], shifts[b], shifts[c], shifts[d], shifts[e], shifts[f], shifts[g], shifts[h]];
            }
        }
        self.now = now.wrapping_add(1);
    }

    /// Grows every plant, eqs. (4)-(8).
    #[inline(always)]
    fn grow(&mut self, [mean, sd]: [f32; 2]) {
        for lane in 0..LANES {
            let plant = TipState { x: self.x[lane], y: self.y[lane], length: self.length[lane] };
            let TipState { x, y, length } =
                plant.stepped(self.shift[lane], mean + sd * self.growth_noise[lane]);
            (self.x[lane], self.y[lane], self.length[lane]) = (x, y, length);
        }
    }

    /// Adds what the step is worth, eq. (9), and ends the experiments of plants that are high enough.
    #[inline(always)]
    fn score(&mut self, BatchTask { task, reading, .. }: &BatchTask<'_>) {
        let [end, over] = [task.end_height_cm, f64::INFINITY].map(Lanes::splat);
        for lanes in 0..LANES / SCORED {
            let first = SCORED * lanes;
            let [x, y] = [&self.x, &self.y].map(|of| Lanes::from_fn(|lane| of[first + lane].into()));
            let [tip_x, tip_y] = &mut self.tip;
            let [from_x, tip_y, highest, fitness] = [tip_x, tip_y, &mut self.highest, &mut self.fitness]
                .map(|of| &mut of.as_chunks_mut::<SCORED>().0[lanes]);
            let before_cm = Lanes(*highest);
            let highest_cm = before_cm.max(y);
            let worth = reading.step_fitness(&task.targets, [before_cm, highest_cm], Lanes(*from_x), x);
            // A step that does not count adds a zero, which changes no bit of a sum that began with 0.
            *fitness = (Lanes(*fitness) + worth).0;
            *highest = Lanes::select(y.lt(end), highest_cm, over).0;
            (*from_x, *tip_y) = (x.0, y.0);
        }
    }
}

/// The lanes whose byte is 1; the others are 0.
#[inline(always)]
fn lanes_of(bytes: [u8; LANES]) -> impl Iterator<Item = usize> {
    (0..LANES / 8).flat_map(move |word| {
        let mut left = u64::from_le_bytes(core::array::from_fn(|byte| bytes[8 * word + byte]));
        std::iter::from_fn(move || {
            let first = left.trailing_zeros();
            (left != 0).then(|| {
                left &= left - 1;
                8 * word + first as usize / 8
            })
        })
    })
}
