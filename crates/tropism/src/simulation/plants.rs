//! Many plants of the model side by side, in arrays of single numbers: one step of all of them, loop by loop, each of which
//! the compiler makes vectors of.

#![allow(clippy::needless_range_loop, reason = "a loop over lanes reads and writes many arrays at one place")]

use crate::plant::PlantModel;
use crate::plant::table::Table;
use crate::plant::tip::{Sprout, TipModel};
use crate::random::{self, Draws, STEP};
use crate::task::Task;

/// Model and task as the plants need them, with room for so many targets.
pub(super) struct Course<'m, const TARGETS: usize> {
    table: &'m Table,
    seedling: Sprout,
    growth: [f32; 2],
    /// From the lowest to the highest; no tip is below those that the task has not.
    targets: [Bounds; TARGETS],
    /// What is to be steered for ends here.
    highest: f32,
    end: f32,
    max_steps: u32,
}

/// A target such that comparing single with double precision is comparing with these.
#[derive(Clone, Copy)]
struct Bounds {
    /// `x < target.x` is `x < below`.
    below: f32,
    /// Whether that is the target's x to the bit, so that a tip can be on it.
    is_exact: bool,
    /// `y < target.y` is `y < height`.
    height: f32,
}

impl<'m, const TARGETS: usize> Course<'m, TARGETS> {
    /// `None` if the task has more targets than that.
    pub(super) fn new(model: &'m TipModel, task: &'m Task) -> Option<Self> {
        let mut targets = [Bounds { below: 0.0, is_exact: false, height: f32::NEG_INFINITY }; TARGETS];
        for (bounds, target) in targets.get_mut(..task.targets.len())?.iter_mut().zip(&task.targets) {
            let below = ceiling(target.x);
            let is_exact = f64::from(below) == target.x;
            *bounds = Bounds { below, is_exact, height: ceiling(target.y) };
        }
        Some(Self {
            table: model.table(),
            seedling: model.seedling(task.start),
            growth: [model.growth(0.0), model.config().growth.sd as f32],
            targets,
            highest: task.targets.last().map_or(f32::NEG_INFINITY, |target| ceiling(target.y)),
            end: ceiling(task.end_height_cm),
            max_steps: task.max_steps,
        })
    }

    /// No plant of the model is longer, in cm: no draw is above 4.05.
    pub(super) fn reach(&self) -> f64 {
        let [mean, sd] = self.growth.map(f64::from);
        f64::from(self.seedling.length) + f64::from(self.max_steps) * (mean + 4.05 * sd)
    }
}

/// The least single-precision number that is not below `value`.
fn ceiling(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

/// The plants, one in each lane.
///
/// One whose experiment is over grows on until another takes its lane, and nothing comes of it.
#[repr(C, align(64))]
pub(super) struct Plants<const LANES: usize> {
    pub(super) x: [f32; LANES],
    pub(super) y: [f32; LANES],
    length: [f32; LANES],
    /// Below this a step does not count: the height of the seedling, and infinity when the experiment is over.
    floor: [f32; LANES],
    /// Where the shift of each is to be looked up, and what stands there.
    place: [u32; LANES],
    shift: [f32; LANES],
    luck: [f32; LANES],
    /// x before and after the step, as it counts: as it is, its opposite, or 0.
    counted: [[f32; LANES]; 2],
    fitness: [f64; LANES],
    /// Steps that are left before the task's last.
    left: [u32; LANES],
    /// 1 where no experiment goes on, else 0.
    is_free: [u8; LANES],
    /// The first half of each key, gone back by the steps that all plants had taken when this one was seated; and the other half.
    key: [[u32; LANES]; 2],
    /// Steps of all plants.
    now: u32,
}

impl<const LANES: usize> Plants<LANES> {
    /// None that goes on.
    pub(super) const fn none() -> Self {
        Self {
            x: [0.0; LANES],
            y: [1.0; LANES],
            length: [1.0; LANES],
            floor: [f32::INFINITY; LANES],
            place: [0; LANES],
            shift: [0.0; LANES],
            luck: [0.0; LANES],
            counted: [[0.0; LANES]; 2],
            fitness: [0.0; LANES],
            left: [u32::MAX; LANES],
            is_free: [1; LANES],
            key: [[0; LANES]; 2],
            now: 0,
        }
    }

    /// Puts a seedling into a lane.
    pub(super) fn seat<const TARGETS: usize>(
        &mut self,
        lane: usize,
        draws: Draws,
        course: &Course<'_, TARGETS>,
    ) {
        let Sprout { x, y, length } = course.seedling;
        (self.x[lane], self.y[lane], self.length[lane]) = (x, y, length);
        self.floor[lane] = if y >= course.end || course.max_steps == 0 { f32::INFINITY } else { y };
        self.left[lane] = course.max_steps;
        self.is_free[lane] = 0;
        self.fitness[lane] = 0.0;
        let [first, second] = draws.key();
        self.key[0][lane] = first.wrapping_sub(self.now.wrapping_mul(STEP));
        self.key[1][lane] = second;
    }

    /// The lanes in which no experiment goes on.
    pub(super) fn free(&self) -> impl Iterator<Item = usize> + use<LANES> {
        lanes_of(self.is_free)
    }

    /// What the plant in a lane came to.
    pub(super) const fn fitness(&self, lane: usize) -> f64 {
        self.fitness[lane]
    }

    /// How many steps can be taken, up to `most`, before the first plant has taken its last.
    #[inline(always)]
    pub(super) fn steps(&self, most: u32) -> u32 {
        self.left.iter().fold(most, |least, &left| if left < least { left } else { least })
    }

    /// After so many steps: finds out which experiments are over.
    #[inline(always)]
    pub(super) fn have_taken(&mut self, steps: u32) {
        for lane in 0..LANES {
            self.left[lane] -= steps;
            self.is_free[lane] = ((self.left[lane] == 0) | (self.floor[lane] == f32::INFINITY)).into();
        }
    }

    /// Leaves a lane free.
    pub(super) const fn leave(&mut self, lane: usize) {
        (self.floor[lane], self.left[lane]) = (f32::INFINITY, u32::MAX);
    }

    /// One step of every plant under its light, eqs. (4)-(8), and of its fitness, eq. (9). `light` is 1 for right; it also
    /// says whether single precision leaves that in doubt, and then `settle` is asked.
    #[inline(always)]
    pub(super) fn step<const TARGETS: usize>(
        &mut self,
        course: &Course<'_, TARGETS>,
        light: impl Fn(usize, f32, f32) -> (u32, bool),
        settle: impl Fn(usize, f32, f32) -> u32,
    ) {
        let table = course.table;
        let mut in_doubt = false;
        for lane in 0..LANES {
            let (x, y) = (self.x[lane], self.y[lane]);
            let (light, is_doubtful) = light(lane, x, y);
            in_doubt |= is_doubtful;
            self.place[lane] = table.place(x, y, light);
        }
        if in_doubt {
            for lane in 0..LANES {
                let (x, y) = (self.x[lane], self.y[lane]);
                if light(lane, x, y).1 {
                    self.place[lane] = table.place(x, y, settle(lane, x, y));
                }
            }
        }
        self.prepare(table);
        self.grow(course);
        for lane in 0..LANES {
            let [before, after] = [self.counted[0][lane], self.counted[1][lane]];
            // What does not count adds a zero to a sum that began with 0, which changes no bit of it.
            self.fitness[lane] += f64::from(after) - f64::from(before);
        }
    }

    /// The luck of the next step, [`Draws::normal`] in every lane, and the mean shift at the node nearest to each tip.
    ///
    /// Sixteen at a time, so that the processor can do the sums of luck, in vectors, while it looks shifts up one by one:
    /// many gather them slower than they load them.
    #[inline(always)]
    fn prepare(&mut self, table: &Table) {
        const PART: usize = 16;
        let (now, shifts) = (self.now, table.shifts());
        let [keys, others] = &self.key;
        let keys = keys.as_chunks::<PART>().0.iter().zip(others.as_chunks::<PART>().0);
        let lucks = self.luck.as_chunks_mut::<PART>().0.iter_mut();
        let places = self.place.as_chunks::<PART>().0.iter();
        let found = self.shift.as_chunks_mut::<PART>().0.iter_mut();
        for (((key, other), luck), (place, found)) in keys.zip(lucks).zip(places.zip(found)) {
            for lane in 0..PART {
                luck[lane] = random::bell(random::bits([key[lane], other[lane]], now));
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

    /// Grows every plant, and finds out what its step counts.
    #[inline(always)]
    fn grow<const TARGETS: usize>(&mut self, course: &Course<'_, TARGETS>) {
        let [mean, sd] = course.growth;
        let (targets, highest, end) = (course.targets, course.highest, course.end);
        let mut is_any_on_it = false;
        for lane in 0..LANES {
            let before = self.x[lane];
            let sprout = Sprout { x: before, y: self.y[lane], length: self.length[lane] };
            let Sprout { x, y, length } = sprout.turned(self.shift[lane], mean + sd * self.luck[lane]);
            (self.x[lane], self.y[lane], self.length[lane]) = (x, y, length);

            let mut below = 0.0;
            for target in targets.iter().rev() {
                below = if y < target.height { target.below } else { below };
            }
            is_any_on_it |= x == below;
            let counts = (y < highest) & (y >= self.floor[lane]);
            let side = if x < below { 1.0 } else { -1.0 };
            let sense = if counts { side } else { 0.0 };
            self.counted[0][lane] = before * sense;
            self.counted[1][lane] = x * sense;
            self.floor[lane] = if y < end { self.floor[lane] } else { f32::INFINITY };
        }
        if is_any_on_it {
            self.turn_on_targets(&targets);
        }
    }

    /// A tip that ends exactly on its target has come the right way, whichever it was.
    #[cold]
    fn turn_on_targets(&mut self, targets: &[Bounds]) {
        for lane in 0..LANES {
            let target = targets.iter().find(|target| self.y[lane] < target.height);
            if target.is_some_and(|target| target.is_exact && self.x[lane] == target.below) {
                let [before, after] = [self.counted[0][lane], self.counted[1][lane]];
                if after < before {
                    (self.counted[0][lane], self.counted[1][lane]) = (-before, -after);
                }
            }
        }
    }
}

/// The lanes whose byte is 1, of 0 and 1.
#[inline(always)]
pub(super) fn lanes_of<const LANES: usize>(bytes: [u8; LANES]) -> impl Iterator<Item = usize> {
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
