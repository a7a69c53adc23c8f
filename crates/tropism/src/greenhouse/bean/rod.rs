//! The stem as a growing, bending rod: what happens in one sub-step.
//!
//! In: what drives every segment alike ([`Drive`]). Out: the rod, a sub-step later. The idea: the rod is a chain of segments
//! that each carry a length, a curvature towards two material directions, and memories; nothing is a function of x and y.
//!
//! A segment's frame (d1, d2, t) is twist-free: it turns about the axis `k1 d2 - k2 d1` and so needs no normal, and straight
//! segments are harmless. At the upright base d1 is x, d2 points away from the camera, and t is up.
//!
//! There is one array per quantity, all of them in one place, and the loops over segments have no calls in them, so that
//! they run several segments at a time. The exponentials of a segment's distance from the apex, and the power of its
//! irradiance, are carried along by short Taylor series and computed anew with every tick.

use core::f64::consts::PI;

use super::Individual;
use crate::greenhouse::view::{Place, WALL};
use crate::lamps::MAX_LAMPS;
use crate::math;

/// A segment longer than this splits, in cm.
const LONGEST: f64 = 0.75;
/// Most places on a stem: segments, and the apex. Where there is no room for more, segments no longer split.
const MOST: usize = 128;
/// Segments of a seedling.
const SEGMENTS: usize = 8;
/// The leaf pair's segment in a seedling: 1 cm below the apex.
const LEAF_SEGMENT: usize = 6;
/// Width of the growing zone's lower edge, in cm.
const GROWTH_EDGE: f64 = 1.0;
/// Distance from the apex at which the stem has its full radius, in cm.
const TAPER: f64 = 15.0;
/// Density of the stem, in g/cm^3.
const DENSITY: f64 = 0.95;
/// Weight of a gram, in dyn.
const GRAVITY: f64 = 981.0;
/// dyn/cm^2 in one MPa.
const MEGAPASCAL: f64 = 1e7;
/// The stem touches the wall this far from it, in cm.
const TOUCH: f64 = 0.5;
/// How hard the wall pushes back, in dyn per cm and segment.
const WALL_STIFFNESS: f64 = 300.0;
/// Distance at which a lamp of power 1 gives the reference irradiance, in cm.
const LAMP_DISTANCE: f64 = 35.0;
/// No part of the plant comes closer to a lamp's centre than this, in cm.
const LAMP_RADIUS: f64 = 1.0;
/// The response to light saturates at this multiple of the response to the reference irradiance.
const SATURATION: f64 = 2.5;
/// Irradiance may change by this share between two sub-steps before its power is computed anew.
const GENTLE: f64 = 0.03;

/// What drives every segment alike during a tick.
#[derive(Clone, Debug)]
pub(super) struct Drive {
    /// Sub-step, in h.
    pub(super) dt: f64,
    /// Places of the lamps, in cm.
    pub(super) lamps: [Place; MAX_LAMPS],
    /// Power of each lamp, 0 to 1; 0 for places without a lamp.
    pub(super) powers: [f64; MAX_LAMPS],
    /// Elongation, in cm/h.
    pub(super) growth: f64,
    /// Motor gain: maturity, fluctuation and pauses.
    pub(super) gain: f64,
    /// Length of the motile zone, in cm.
    pub(super) zone: f64,
    /// Straightening, per h.
    pub(super) straightening: f64,
    /// Mass of the leaf pair, in g.
    pub(super) leaf_mass: f64,
}

/// The stem.
#[derive(Clone, Debug)]
pub(super) struct Rod {
    /// Number of segments, base first.
    count: usize,
    each: Box<Segments>,
    /// Index of the segment that bears the leaf pair.
    leaf: usize,
    /// Orientation of the base.
    base: Turn,
    /// Whether what is carried between sub-steps must be computed anew.
    is_stale: bool,
}

/// One value for each segment.
type Each = [f64; MOST];

#[derive(Clone, Debug)]
struct Segments {
    /// Length, in cm.
    length: Each,
    /// Actual curvature towards d1 and d2, in 1/cm.
    k1: Each,
    k2: Each,
    /// Curvature at rest.
    rest1: Each,
    rest2: Each,
    /// Light memory, first and second stage.
    fresh1: Each,
    fresh2: Each,
    light1: Each,
    light2: Each,
    /// Gravity memory.
    gravity1: Each,
    gravity2: Each,

    // What a sub-step computes on its way.
    /// Distance of the segment's middle from the apex, in cm, and how far it moved by growing.
    below: Each,
    moved: Each,
    /// `e^((below - zone) / edge)` of growth and of motility; the modulus over its mature value.
    grow: Each,
    motile: Each,
    modulus: Each,
    /// Relative elongation.
    growing: Each,
    /// Rotation over half a segment: x and y of a quaternion whose w is 1 and z is 0.
    half_x: Each,
    half_y: Each,
    /// Orientation at the segment's lower end: a quaternion of any length.
    turn: [Each; 4],
    /// Material directions and direction of the stem at the middle, in world coordinates.
    d1: [Each; 3],
    d2: [Each; 3],
    along: [Each; 3],
    /// Middle of the segment, in cm. Here, and in all that is about light, the apex follows the last segment.
    middle: [Each; 3],
    /// Irradiance vector over the reference, its squared length now and at the sub-step before.
    light: [Each; 3],
    power: Each,
    before: Each,
    /// Response per unit of irradiance, and the same where it is saturated.
    response: Each,
    seen: Each,
    /// Moment of the distal loads about the middle, in dyn cm.
    moment: [Each; 3],
}

/// A rotation: a quaternion (w, x, y, z) of any length, in the coordinates (d1, d2, t) of the upright base.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn([f64; 4]);

impl Turn {
    /// This rotation, and after it, in the frame it leads to, the rotation (w, x, y, 0).
    #[inline(always)]
    fn then(self, w: f64, x: f64, y: f64) -> Self {
        let Self([a, b, c, d]) = self;
        Self([a * w - b * x - c * y, a * x + b * w - d * y, a * y + c * w + d * x, d * w + b * y - c * x])
    }

    /// d1, d2 and t in world coordinates: x is d1 of the upright base, y its t, z its d2 reversed.
    #[inline(always)]
    fn frame(self) -> [Place; 3] {
        let Self([w, x, y, z]) = self;
        let twice = 2.0 / (w * w + x * x + y * y + z * z);
        [
            [1.0 - twice * (y * y + z * z), twice * (x * z - w * y), -twice * (x * y + w * z)],
            [twice * (x * y - w * z), twice * (y * z + w * x), twice * (x * x + z * z) - 1.0],
            [twice * (x * z + w * y), 1.0 - twice * (x * x + y * y), twice * (w * x - y * z)],
        ]
    }
}

/// The rotation of a segment with curvatures (k1, k2) over half its length: x and y of a quaternion (1, x, y, 0).
///
/// A series for the tangent of a quarter of the segment's angle: exact to 1e-12 for the curvatures of a stem, and a rotation,
/// if not quite the right one, for any other.
#[inline(always)]
fn half_turn(k1: f64, k2: f64, length: f64) -> [f64; 2] {
    let quarter = 0.25 * length;
    let (x, y) = ((-k2 * quarter).clamp(-1.0, 1.0), (k1 * quarter).clamp(-1.0, 1.0));
    let angle2 = x * x + y * y;
    let tangent = 1.0 + angle2 * (1.0 / 3.0 + angle2 * (2.0 / 15.0 + angle2 * (17.0 / 315.0)));
    [x * tangent, y * tangent]
}

/// A cross-section between two segments, or an end of the stem.
pub(super) struct Section {
    /// Its centre, in cm.
    pub(super) at: Place,
    /// Distance from the apex, in cm.
    pub(super) below: f64,
    /// Direction of the stem there.
    pub(super) along: Place,
}

/// Radius of the stem at a distance from the apex, in cm.
#[inline(always)]
pub(super) fn radius(plant: &Individual, below: f64) -> f64 {
    let stem = &plant.stem;
    stem.radius_apex + (stem.radius_base - stem.radius_apex) * (below / TAPER).min(1.0)
}

impl Rod {
    pub(super) fn seedling(plant: &Individual) -> Self {
        let mut each = Box::new(Segments::zero());
        each.length[..SEGMENTS].fill(plant.growth.start / SEGMENTS as f64);
        let [x, y] = half_turn(2.0 * plant.stem.tilt_x, -2.0 * plant.stem.tilt_z, 1.0);
        let base = Turn([1.0, x, y, 0.0]);
        Self { count: SEGMENTS, each, leaf: LEAF_SEGMENT, base, is_stale: true }
    }

    /// Leans the base by `radians` towards positive x.
    pub(super) fn lean(&mut self, radians: f64) {
        let Turn([w, x, y, z]) = self.base;
        let (cos, sin) = (math::cos(0.5 * radians), math::sin(0.5 * radians));
        self.base = Turn([w * cos - y * sin, x * cos + z * sin, y * cos + w * sin, z * cos - x * sin]);
    }

    /// Length along the stem, in cm.
    pub(super) fn length(&self) -> f64 {
        self.each.length[..self.count].iter().sum()
    }

    /// Calls `visit` with the cross-sections from the base to the apex: one more than there are segments.
    pub(super) fn walk(&self, mut visit: impl FnMut(Section)) {
        let mut turn = self.base;
        let mut at = [0.0; 3];
        let mut below = self.length();
        visit(Section { at, below, along: turn.frame()[2] });
        for i in 0..self.count {
            let length = self.each.length[i];
            let [x, y] = half_turn(self.each.k1[i], self.each.k2[i], length);
            turn = turn.then(1.0, x, y);
            let along = turn.frame()[2];
            at = core::array::from_fn(|axis| at[axis] + length * along[axis]);
            turn = turn.then(1.0, x, y);
            below -= length;
            visit(Section { at, below: below.max(0.0), along: turn.frame()[2] });
        }
    }

    /// Index of the segment that bears the leaves.
    pub(super) fn leaf(&self) -> usize {
        self.leaf
    }

    /// The largest curvature, in 1/cm.
    pub(super) fn peak_curvature(&self) -> f64 {
        let squares = (0..self.count).map(|i| self.each.k1[i].powi(2) + self.each.k2[i].powi(2));
        squares.fold(0.0, f64::max).sqrt()
    }

    /// Begins a tick: what is carried between sub-steps is computed anew.
    pub(super) fn begin(&mut self, plant: &Individual, drive: &Drive) {
        let each = &mut *self.each;
        each.measure(self.count);
        let modulus = plant.stem.modulus_mpa / plant.stem.modulus_mature_mpa;
        for i in 0..self.count {
            each.grow[i] = math::exp((each.below[i] - plant.growth.zone) / GROWTH_EDGE);
            each.motile[i] = math::exp((each.below[i] - drive.zone) / plant.motility.edge);
            each.modulus[i] = modulus * math::exp(each.below[i] / plant.stem.modulus_length);
        }
        self.is_stale = true;
    }

    /// Disturbs the curvature at rest of the motile zone by `noise()` 1/cm, in both directions.
    pub(super) fn disturb(&mut self, mut noise: impl FnMut() -> f64) {
        for i in 0..self.count {
            let motile = 1.0 / (1.0 + self.each.motile[i]);
            self.each.rest1[i] += motile * noise();
            self.each.rest2[i] += motile * noise();
        }
    }

    /// One sub-step, explicit Euler in the order in which the plant would have it: see, bend, settle, grow.
    ///
    /// `turning` is nutation's part in the change of curvature towards d1 and d2, in 1/cm/h.
    pub(super) fn step(&mut self, plant: &Individual, drive: &Drive, turning: [f64; 2]) {
        let (n, each) = (self.count, &mut *self.each);
        assert!(n < MOST);
        each.shape(n, self.base);
        each.illuminate(n, plant, drive, self.is_stale);
        each.perceive(n, plant, drive);
        each.bend(n, plant, drive, turning);
        each.load(n, plant, drive, self.leaf);
        each.settle(n, plant, drive);
        each.grow(n, plant, drive);
        self.is_stale = false;
        if n + 1 < MOST && self.split() {
            self.begin(plant, drive);
        }
    }

    /// Halves the segments that have become too long; whether there were any. The leaves stay with the lower half.
    fn split(&mut self) -> bool {
        let before = self.count;
        let mut i = 0;
        while i < self.count {
            if self.each.length[i] > LONGEST && self.count + 1 < MOST {
                self.each.length[i] *= 0.5;
                for values in self.each.state() {
                    values.copy_within(i..self.count, i + 1);
                }
                self.count += 1;
                if self.leaf > i {
                    self.leaf += 1;
                }
                i += 1;
            }
            i += 1;
        }
        self.count > before
    }
}

impl Segments {
    fn zero() -> Self {
        const NONE: Each = [0.0; MOST];
        Self {
            length: NONE,
            k1: NONE,
            k2: NONE,
            rest1: NONE,
            rest2: NONE,
            fresh1: NONE,
            fresh2: NONE,
            light1: NONE,
            light2: NONE,
            gravity1: NONE,
            gravity2: NONE,
            below: NONE,
            moved: NONE,
            grow: NONE,
            motile: NONE,
            modulus: NONE,
            growing: NONE,
            half_x: NONE,
            half_y: NONE,
            turn: [NONE; 4],
            d1: [NONE; 3],
            d2: [NONE; 3],
            along: [NONE; 3],
            middle: [NONE; 3],
            light: [NONE; 3],
            power: NONE,
            before: NONE,
            response: NONE,
            seen: NONE,
            moment: [NONE; 3],
        }
    }

    /// What a segment hands on when it splits; the rest is computed from it.
    fn state(&mut self) -> [&mut Each; 11] {
        let Self { length, k1, k2, rest1, rest2, fresh1, fresh2, light1, light2, gravity1, gravity2, .. } =
            self;
        [length, k1, k2, rest1, rest2, fresh1, fresh2, light1, light2, gravity1, gravity2]
    }

    /// Distances of the segments' middles from the apex, in cm, and how far they moved since the last measurement.
    fn measure(&mut self, n: usize) {
        let mut above = 0.0;
        for i in (0..n).rev() {
            let below = above + 0.5 * self.length[i];
            self.moved[i] = below - self.below[i];
            self.below[i] = below;
            above += self.length[i];
        }
    }

    /// Where the segments are, and how they stand.
    fn shape(&mut self, n: usize, base: Turn) {
        for i in 0..n {
            [self.half_x[i], self.half_y[i]] = half_turn(self.k1[i], self.k2[i], self.length[i]);
        }
        let mut turn = base;
        for i in 0..n {
            for (values, value) in self.turn.iter_mut().zip(turn.0) {
                values[i] = value;
            }
            let (x, y) = (self.half_x[i], self.half_y[i]);
            turn = turn.then(1.0 - x * x - y * y, 2.0 * x, 2.0 * y);
        }
        for i in 0..n {
            let lower = Turn([self.turn[0][i], self.turn[1][i], self.turn[2][i], self.turn[3][i]]);
            let [d1, d2, along] = lower.then(1.0, self.half_x[i], self.half_y[i]).frame();
            for axis in 0..3 {
                self.d1[axis][i] = d1[axis];
                self.d2[axis][i] = d2[axis];
                self.along[axis][i] = along[axis];
            }
        }
        let mut at = [0.0; 3];
        for i in 0..n {
            let half = 0.5 * self.length[i];
            for (axis, at) in at.iter_mut().enumerate() {
                let way = half * self.along[axis][i];
                self.middle[axis][i] = *at + way;
                *at = self.middle[axis][i] + way;
            }
        }
        for (middle, at) in self.middle.iter_mut().zip(at) {
            middle[n] = at;
        }
    }

    /// The light that reaches every segment and the apex, and their response to it.
    fn illuminate(&mut self, n: usize, plant: &Individual, drive: &Drive, is_stale: bool) {
        for axis in 0..3 {
            self.light[axis][..=n].fill(0.0);
        }
        for (lamp, power) in drive.lamps.iter().zip(drive.powers).filter(|(_, power)| *power > 0.0) {
            let strength = power * LAMP_DISTANCE * LAMP_DISTANCE;
            for i in 0..=n {
                let x = lamp[0] - self.middle[0][i];
                let y = lamp[1] - self.middle[1][i];
                let z = lamp[2] - self.middle[2][i];
                let distance2 = (x * x + y * y + z * z).max(LAMP_RADIUS * LAMP_RADIUS);
                let share = strength / (distance2 * distance2.sqrt());
                self.light[0][i] += x * share;
                self.light[1][i] += y * share;
                self.light[2][i] += z * share;
            }
        }
        let (mut is_gentle, mut brightest) = (!is_stale, 0.0_f64);
        for i in 0..=n {
            let [x, y, z] = [self.light[0][i], self.light[1][i], self.light[2][i]];
            self.power[i] = x * x + y * y + z * z;
            is_gentle &= (self.power[i] - self.before[i]).abs() < GENTLE * self.before[i];
            brightest = brightest.max(self.power[i]);
        }
        // The response is the irradiance to some power: per unit of irradiance, to one less; of its square, to half of that.
        let exponent = 0.5 * (plant.tropism.light_exponent - 1.0);
        if is_gentle {
            let (second, third, fourth) =
                (0.5 * (exponent - 1.0), (exponent - 2.0) / 3.0, (exponent - 3.0) / 4.0);
            for i in 0..=n {
                let change = self.power[i] / self.before[i] - 1.0;
                let series = 1.0 + second * change * (1.0 + third * change * (1.0 + fourth * change));
                self.response[i] *= 1.0 + exponent * change * series;
            }
        } else {
            for i in 0..=n {
                self.response[i] = if self.power[i] > 0.0 { math::pow(self.power[i], exponent) } else { 0.0 };
            }
        }
        self.before[..=n].copy_from_slice(&self.power[..=n]);
        self.seen[..=n].copy_from_slice(&self.response[..=n]);
        if brightest > SATURATION {
            for i in 0..=n {
                self.seen[i] = self.response[i].min(SATURATION / self.power[i].sqrt());
            }
        }
    }

    /// Light and gravity become memories, each segment in its own cross-section.
    fn perceive(&mut self, n: usize, plant: &Individual, drive: &Drive) {
        let tropism = &plant.tropism;
        let light_share = (drive.dt / tropism.light_memory_h).min(1.0);
        let gravity_share = (drive.dt / tropism.gravity_memory_h).min(1.0);
        let (local, apical) = (1.0 - tropism.apical, tropism.apical * self.seen[n]);
        let apex: Place = core::array::from_fn(|axis| apical * self.light[axis][n]);
        for i in 0..n {
            let seen = local * self.seen[i];
            let x = seen * self.light[0][i] + apex[0];
            let y = seen * self.light[1][i] + apex[1];
            let z = seen * self.light[2][i] + apex[2];
            let signal1 = x * self.d1[0][i] + y * self.d1[1][i] + z * self.d1[2][i];
            let signal2 = x * self.d2[0][i] + y * self.d2[1][i] + z * self.d2[2][i];
            self.fresh1[i] += light_share * (signal1 - self.fresh1[i]);
            self.fresh2[i] += light_share * (signal2 - self.fresh2[i]);
            self.light1[i] += light_share * (self.fresh1[i] - self.light1[i]);
            self.light2[i] += light_share * (self.fresh2[i] - self.light2[i]);
            self.gravity1[i] += gravity_share * (self.d1[1][i] - self.gravity1[i]);
            self.gravity2[i] += gravity_share * (self.d2[1][i] - self.gravity2[i]);
        }
    }

    /// Differential growth changes the curvature at rest.
    fn bend(&mut self, n: usize, plant: &Individual, drive: &Drive, turning: [f64; 2]) {
        let tropism = &plant.tropism;
        let rate = drive.dt * drive.gain;
        let [steady1, steady2] = [turning[0] + tropism.bias_x, turning[1] - tropism.bias_z];
        for i in 0..n {
            let motility = rate / (1.0 + self.motile[i]);
            let wanted1 = tropism.light * self.light1[i] + tropism.gravity * self.gravity1[i] + steady1;
            let wanted2 = tropism.light * self.light2[i] + tropism.gravity * self.gravity2[i] + steady2;
            self.rest1[i] += motility * (wanted1 - drive.straightening * self.k1[i]);
            self.rest2[i] += motility * (wanted2 - drive.straightening * self.k2[i]);
        }
    }

    /// The moments of everything that hangs on a segment: bud, leaves, stem and wall.
    fn load(&mut self, n: usize, plant: &Individual, drive: &Drive, leaf: usize) {
        let mut mass = plant.stem.tip_g;
        let (mut mass_x, mut mass_z) = (mass * self.middle[0][n], mass * self.middle[2][n]);
        let mut nearest = self.middle[2][n];
        for i in (0..n).rev() {
            let (x, z) = (self.middle[0][i], self.middle[2][i]);
            if i == leaf {
                mass += drive.leaf_mass;
                mass_x += drive.leaf_mass * x;
                mass_z += drive.leaf_mass * z;
            }
            self.moment[0][i] = GRAVITY * (mass_z - z * mass);
            self.moment[1][i] = 0.0;
            self.moment[2][i] = GRAVITY * (x * mass - mass_x);
            let radius = radius(plant, self.below[i]);
            let own = DENSITY * PI * radius * radius * self.length[i];
            mass += own;
            mass_x += own * x;
            mass_z += own * z;
            nearest = nearest.min(z);
        }
        if nearest < WALL + TOUCH {
            self.lean_on_wall(n);
        }
    }

    fn lean_on_wall(&mut self, n: usize) {
        let (mut push, mut push_x, mut push_y) = (0.0, 0.0, 0.0);
        for i in (0..n).rev() {
            let [x, y, z] = [self.middle[0][i], self.middle[1][i], self.middle[2][i]];
            self.moment[0][i] += push_y - y * push;
            self.moment[1][i] -= push_x - x * push;
            let own = WALL_STIFFNESS * (WALL + TOUCH - z).max(0.0);
            push += own;
            push_x += own * x;
            push_y += own * y;
        }
    }

    /// The actual curvature settles towards that at rest and what the loads add to it.
    fn settle(&mut self, n: usize, plant: &Individual, drive: &Drive) {
        let settling = 1.0 - math::exp(-drive.dt / plant.stem.lag_h);
        let mature = plant.stem.modulus_mature_mpa * MEGAPASCAL * PI / 4.0;
        for i in 0..n {
            let radius = radius(plant, self.below[i]);
            let area = radius * radius;
            let yielding = 1.0 / (mature * self.modulus[i].min(1.0) * area * area);
            let [x, y, z] = [self.moment[0][i], self.moment[1][i], self.moment[2][i]];
            let towards1 = x * self.d2[0][i] + y * self.d2[1][i] + z * self.d2[2][i];
            let towards2 = x * self.d1[0][i] + y * self.d1[1][i] + z * self.d1[2][i];
            self.k1[i] += settling * (self.rest1[i] + yielding * towards1 - self.k1[i]);
            self.k2[i] += settling * (self.rest2[i] - yielding * towards2 - self.k2[i]);
        }
    }

    /// Elongation of the growing zone, and what is carried along with it.
    fn grow(&mut self, n: usize, plant: &Individual, drive: &Drive) {
        let mut weight = 0.0;
        for i in 0..n {
            self.growing[i] = self.length[i] / (1.0 + self.grow[i]);
        }
        for i in 0..n {
            weight += self.growing[i];
        }
        let rate = drive.dt * drive.growth / weight;
        for i in 0..n {
            self.length[i] += rate * self.growing[i];
        }
        self.measure(n);
        let [grow, motile, modulus] =
            [GROWTH_EDGE, plant.motility.edge, plant.stem.modulus_length].map(|length| 1.0 / length);
        for i in 0..n {
            let moved = self.moved[i];
            self.grow[i] *= small_exp(moved * grow);
            self.motile[i] *= small_exp(moved * motile);
            self.modulus[i] *= small_exp(moved * modulus);
        }
    }
}

/// `e^x` for |x| below 0.01, to 1e-12.
#[inline(always)]
fn small_exp(x: f64) -> f64 {
    1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0))))
}
