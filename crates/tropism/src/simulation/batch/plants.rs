//! Many plants of the tip model side by side, as a structure of arrays: each loop over the lanes is one step of all plants,
//! and the compiler vectorises it.

#![allow(clippy::needless_range_loop, reason = "a loop over lanes reads and writes many arrays at one place")]

use crate::plant::table::Table;
use crate::plant::tip::{TipModel, TipState};
use crate::random::{self, NoiseStream, STEP_INCREMENT};
use crate::task::Task;

/// Plants side by side. Chosen for speed: state transitions of networks are scalar, and do best in few lanes.
pub(super) const LANES: usize = 32;

/// Model and task in the form that the lanes need, with room for `TARGETS` targets.
pub(super) struct BatchTask<'m, const TARGETS: usize> {
    table: &'m Table,
    seedling: TipState,
    /// Mean and standard deviation of the growth of a step, in cm.
    growth: [f32; 2],
    /// From the lowest to the highest; unused places have a height below every tip.
    targets: [Bounds; TARGETS],
    /// Height of the last target: above it no step counts.
    last: f32,
    /// Height at which the experiment ends.
    end: f32,
    max_steps: u32,
}

/// A target in single precision, rounded so that comparisons decide as in double precision.
#[derive(Clone, Copy)]
struct Bounds {
    /// `x < target.x` is `x < below`.
    below: f32,
    /// Whether that is the target's x to the bit, so that a tip can be on it.
    is_exact: bool,
    /// `highest < target.y` is `highest < height`.
    height: f32,
}

impl<'m, const TARGETS: usize> BatchTask<'m, TARGETS> {
    /// `None` if the task has more than `TARGETS` targets.
    pub(super) fn new(model: &'m TipModel, task: &Task) -> Option<Self> {
        let mut targets = [Bounds { below: 0.0, is_exact: false, height: f32::NEG_INFINITY }; TARGETS];
        for (bounds, target) in targets.get_mut(..task.targets.len())?.iter_mut().zip(&task.targets) {
            let below = ceiling(target.x);
            let is_exact = f64::from(below) == target.x;
            *bounds = Bounds { below, is_exact, height: ceiling(target.y) };
        }
        Some(Self {
            table: model.table(),
            seedling: model.seedling_at(task.start),
            growth: [model.growth(0.0), model.config().growth.sd as f32],
            targets,
            last: task.targets.last().map_or(f32::NEG_INFINITY, |target| ceiling(target.y)),
            end: ceiling(task.end_height_cm),
            max_steps: task.max_steps,
        })
    }
}

/// The least single-precision number that is not below `value`.
fn ceiling(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

/// The state of the plants, one in each lane.
///
/// A plant whose experiment is over grows on until its lane is refilled; it no longer adds to the fitness.
#[repr(C, align(64))]
pub(super) struct Plants {
    pub(super) x: [f32; LANES],
    pub(super) y: [f32; LANES],
    length: [f32; LANES],
    /// Greatest height of the tip so far, by which the next target is found; infinity when the experiment is over.
    highest: [f32; LANES],
    /// Index of each plant's shift in the table, and the shift, in cm.
    place: [u32; LANES],
    shift: [f32; LANES],
    /// Standard normal draw of the step.
    growth_noise: [f32; LANES],
    /// x before and after the step, times the sign with which movement counts in eq. (9): 1, -1 or 0.
    signed_x: [[f32; LANES]; 2],
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
            highest: [f32::INFINITY; LANES],
            place: [0; LANES],
            shift: [0.0; LANES],
            growth_noise: [0.0; LANES],
            signed_x: [[0.0; LANES]; 2],
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
    pub(super) fn refill<const TARGETS: usize>(
        &mut self,
        lane: usize,
        noise: NoiseStream,
        task: &BatchTask<'_, TARGETS>,
    ) {
        let TipState { x, y, length } = task.seedling;
        (self.x[lane], self.y[lane], self.length[lane]) = (x, y, length);
        self.highest[lane] = if y >= task.end || task.max_steps == 0 { f32::INFINITY } else { y };
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
                ((self.steps_left[lane] == 0) | (self.highest[lane] == f32::INFINITY)).into();
        }
    }

    /// Empties a lane.
    pub(super) const fn empty_lane(&mut self, lane: usize) {
        (self.highest[lane], self.steps_left[lane]) = (f32::INFINITY, u32::MAX);
    }

    /// One step of every plant under its light, 1 for right, eqs. (4)-(8), and of its fitness, eq. (9).
    #[inline(always)]
    pub(super) fn step<const TARGETS: usize>(&mut self, task: &BatchTask<'_, TARGETS>, light: &[u32; LANES]) {
        let table = task.table;
        for lane in 0..LANES {
            self.place[lane] = table.place(self.x[lane], self.y[lane], light[lane]);
        }
        self.draw_and_look_up(table);
        self.grow(task);
        for lane in 0..LANES {
            let [before, after] = [self.signed_x[0][lane], self.signed_x[1][lane]];
            // A step that does not count adds a zero, which changes no bit of a sum that began with 0.
            self.fitness[lane] += f64::from(after) - f64::from(before);
        }
    }

    /// Draws the growth noise of the step, [`NoiseStream::normal`] in every lane, and looks up the mean shift at the node
    /// nearest to each tip.
    ///
    /// Sixteen lanes at a time, so that the processor draws noise in vectors while scalar loads fetch the shifts: on many
    /// processors gather instructions are slower than loads.
    #[inline(always)]
    fn draw_and_look_up(&mut self, table: &Table) {
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

    /// Grows every plant, eqs. (4)-(8), and finds the sign with which its step counts, eq. (9).
    #[inline(always)]
    fn grow<const TARGETS: usize>(&mut self, task: &BatchTask<'_, TARGETS>) {
        let [mean, sd] = task.growth;
        let (targets, last, end) = (task.targets, task.last, task.end);
        let mut is_any_on_target = false;
        for lane in 0..LANES {
            let before = self.x[lane];
            let plant = TipState { x: before, y: self.y[lane], length: self.length[lane] };
            let TipState { x, y, length } =
                plant.stepped(self.shift[lane], mean + sd * self.growth_noise[lane]);
            (self.x[lane], self.y[lane], self.length[lane]) = (x, y, length);

            let highest = if y > self.highest[lane] { y } else { self.highest[lane] };
            let mut below = 0.0;
            for target in targets.iter().rev() {
                below = if highest < target.height { target.below } else { below };
            }
            is_any_on_target |= x == below;
            let counts = highest < last;
            let side = if x < below { 1.0 } else { -1.0 };
            let sign = if counts { side } else { 0.0 };
            self.signed_x[0][lane] = before * sign;
            self.signed_x[1][lane] = x * sign;
            self.highest[lane] = if y < end { highest } else { f32::INFINITY };
        }
        if is_any_on_target {
            self.count_on_targets(&targets);
        }
    }

    /// Eq. (9) where x = x*: a tip that ends exactly on its target counts |Δx|.
    #[cold]
    fn count_on_targets(&mut self, targets: &[Bounds]) {
        for lane in 0..LANES {
            let target = targets.iter().find(|target| self.highest[lane] < target.height);
            if target.is_some_and(|target| target.is_exact && self.x[lane] == target.below) {
                let [before, after] = [self.signed_x[0][lane], self.signed_x[1][lane]];
                if after < before {
                    (self.signed_x[0][lane], self.signed_x[1][lane]) = (-before, -after);
                }
            }
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
