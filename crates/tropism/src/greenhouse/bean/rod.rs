//! The stem as a growing, bending rod: what happens in one sub-step.
//!
//! In: what drives every segment alike ([`Drive`]). Out: the rod, a sub-step later. The idea: the rod is a chain of segments
//! that each carry a length, a curvature towards two material directions, and memories; nothing is a function of x and y.
//!
//! A segment's frame (d1, d2, t) is twist-free: it turns about the axis `k1 d2 - k2 d1` and so needs no normal, and straight
//! segments are harmless. At the upright base d1 is x, d2 points away from the camera, and t is up.
//!
//! Everything is kept in one array per quantity, and the loops over segments have no calls in them, so that they run several
//! segments at a time. The exponentials of a segment's distance from the apex, and the power of its irradiance, are
//! carried along by short Taylor series between two ticks.

use core::f64::consts::PI;

use super::species::Individual;
use crate::greenhouse::view::{LAMPS, Place, WALL};
use crate::math;

/// A segment longer than this splits, in cm.
const LONGEST: f64 = 0.75;
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
    /// Power of the left and of the right lamp, 0 to 1.
    pub(super) lamps: [f64; 2],
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

/// The segments, base first.
#[derive(Clone, Debug)]
pub(super) struct Rod {
    /// Length, in cm.
    pub(super) length: Vec<f64>,
    /// Actual curvature towards d1 and d2, in 1/cm.
    k1: Vec<f64>,
    k2: Vec<f64>,
    /// Curvature at rest.
    rest1: Vec<f64>,
    rest2: Vec<f64>,
    /// Light memory, first and second stage.
    fresh1: Vec<f64>,
    fresh2: Vec<f64>,
    light1: Vec<f64>,
    light2: Vec<f64>,
    /// Gravity memory.
    gravity1: Vec<f64>,
    gravity2: Vec<f64>,
    /// Index of the segment that bears the leaf pair.
    leaf: usize,
    /// Orientation of the base.
    base: Turn,
    work: Work,
}

/// What a sub-step computes on its way; kept to spare the allocations.
#[derive(Clone, Debug, Default)]
struct Work {
    /// Whether the carried exponentials and powers must be computed anew.
    is_stale: bool,
    /// Distance of the segment's middle from the apex, in cm.
    below: Vec<f64>,
    below_before: Vec<f64>,
    /// `e^((below - zone) / edge)` of growth, of motility, and the modulus over its mature value.
    grow: Vec<f64>,
    motile: Vec<f64>,
    modulus: Vec<f64>,
    /// Half turn of each segment: (w, x, y) of a quaternion whose z is 0.
    half_w: Vec<f64>,
    half_x: Vec<f64>,
    half_y: Vec<f64>,
    /// Orientation at the segment's lower end, then at its middle.
    turn: [Vec<f64>; 4],
    /// Material directions at the middle, in world coordinates.
    d1: [Vec<f64>; 3],
    d2: [Vec<f64>; 3],
    /// Direction of the stem at the middle, in world coordinates.
    along: [Vec<f64>; 3],
    /// Middle of the segment, in cm.
    middle: [Vec<f64>; 3],
    /// The apex, in cm.
    apex: Place,
    /// Irradiance vector over the reference.
    light: [Vec<f64>; 3],
    /// Its squared length now and at the sub-step before, and its response per unit of irradiance.
    power: Vec<f64>,
    power_before: Vec<f64>,
    response: Vec<f64>,
    /// Moment of the distal loads about the middle, in dyn cm.
    moment: [Vec<f64>; 3],
}

/// A rotation: a unit quaternion (w, x, y, z) in the coordinates (d1, d2, t) of the upright base.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn([f64; 4]);

impl Turn {
    /// This rotation, and after it, in the frame it leads to, the rotation (w, x, y, 0).
    fn then(self, w: f64, x: f64, y: f64) -> Self {
        let Self([a, b, c, d]) = self;
        Self([a * w - b * x - c * y, a * x + b * w - d * y, a * y + c * w + d * x, d * w + b * y - c * x])
    }

    /// d1, d2 and t in world coordinates: x is d1 of the upright base, y its t, z its d2 reversed.
    fn frame(self) -> [Place; 3] {
        let Self([w, x, y, z]) = self;
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * z - w * y), -2.0 * (x * y + w * z)],
            [2.0 * (x * y - w * z), 2.0 * (y * z + w * x), 2.0 * (x * x + z * z) - 1.0],
            [2.0 * (x * z + w * y), 1.0 - 2.0 * (x * x + y * y), 2.0 * (w * x - y * z)],
        ]
    }
}

/// The rotation of a segment with curvatures (k1, k2) over half its length: (w, x, y) of a unit quaternion, z being 0.
///
/// A series for the tangent of a quarter of the segment's angle: exact to 1e-12 for the curvatures of a stem, and a rotation,
/// if not quite the right one, for any other.
#[inline(always)]
fn half_turn(k1: f64, k2: f64, length: f64) -> (f64, f64, f64) {
    let quarter = 0.25 * length;
    let (x, y) = (-k2 * quarter, k1 * quarter);
    let angle2 = x * x + y * y;
    let tangent = 1.0 + angle2 * (1.0 / 3.0 + angle2 * (2.0 / 15.0 + angle2 * (17.0 / 315.0)));
    let (x, y) = (x * tangent, y * tangent);
    let w = 1.0 / (1.0 + x * x + y * y).sqrt();
    (w, x * w, y * w)
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
pub(super) fn radius(plant: &Individual, below: f64) -> f64 {
    let stem = &plant.stem;
    stem.radius_apex + (stem.radius_base - stem.radius_apex) * (below / TAPER).min(1.0)
}

impl Rod {
    pub(super) fn seedling(plant: &Individual) -> Self {
        let still = || {
            let mut values = Vec::with_capacity(128);
            values.resize(SEGMENTS, 0.0);
            values
        };
        let tilt = half_turn(2.0 * plant.stem.tilt_x, -2.0 * plant.stem.tilt_z, 1.0);
        Self {
            length: vec![plant.growth.start / SEGMENTS as f64; SEGMENTS],
            k1: still(),
            k2: still(),
            rest1: still(),
            rest2: still(),
            fresh1: still(),
            fresh2: still(),
            light1: still(),
            light2: still(),
            gravity1: still(),
            gravity2: still(),
            leaf: LEAF_SEGMENT,
            base: Turn([tilt.0, tilt.1, tilt.2, 0.0]),
            work: Work::default(),
        }
    }

    /// Leans the base by `radians` towards positive x.
    pub(super) fn lean(&mut self, radians: f64) {
        let Turn([w, x, y, z]) = self.base;
        let (cos, sin) = (math::cos(0.5 * radians), math::sin(0.5 * radians));
        self.base = Turn([w * cos - y * sin, x * cos + z * sin, y * cos + w * sin, z * cos - x * sin]);
    }

    pub(super) fn segments(&self) -> usize {
        self.length.len()
    }

    /// The cross-sections from the base to the apex: one more than there are segments.
    pub(super) fn sections(&self) -> Vec<Section> {
        let mut turn = self.base;
        let mut at = [0.0; 3];
        let mut below: f64 = self.length.iter().sum();
        let mut sections = Vec::with_capacity(self.segments() + 1);
        sections.push(Section { at, below, along: turn.frame()[2] });
        for i in 0..self.segments() {
            let (w, x, y) = half_turn(self.k1[i], self.k2[i], self.length[i]);
            turn = turn.then(w, x, y);
            let along = turn.frame()[2];
            at = core::array::from_fn(|axis| at[axis] + self.length[i] * along[axis]);
            turn = turn.then(w, x, y);
            below -= self.length[i];
            sections.push(Section { at, below: below.max(0.0), along: turn.frame()[2] });
        }
        sections
    }

    /// Index of the segment that bears the leaves.
    pub(super) fn leaf(&self) -> usize {
        self.leaf
    }

    /// Curvature of every segment, in 1/cm.
    pub(super) fn curvatures(&self) -> impl Iterator<Item = f64> {
        self.k1.iter().zip(&self.k2).map(|(k1, k2)| math::hypot(*k1, *k2))
    }

    /// Begins a tick: what is carried between sub-steps is computed anew.
    pub(super) fn begin(&mut self, plant: &Individual, drive: &Drive) {
        let work = &mut self.work;
        work.resize(self.length.len());
        measure_below(&self.length, &mut work.below);
        let modulus = plant.stem.modulus_mpa / plant.stem.modulus_mature_mpa;
        for i in 0..self.length.len() {
            work.grow[i] = math::exp((work.below[i] - plant.growth.zone) / GROWTH_EDGE);
            work.motile[i] = math::exp((work.below[i] - drive.zone) / plant.motility.edge);
            work.modulus[i] = modulus * math::exp(work.below[i] / plant.stem.modulus_length);
        }
        work.is_stale = true;
    }

    /// Disturbs the curvature at rest of the motile zone by `noise()` 1/cm, in both directions.
    pub(super) fn disturb(&mut self, mut noise: impl FnMut() -> f64) {
        for i in 0..self.length.len() {
            let motile = 1.0 / (1.0 + self.work.motile[i]);
            self.rest1[i] += motile * noise();
            self.rest2[i] += motile * noise();
        }
    }

    /// One sub-step, explicit Euler in the order in which the plant would have it: see, bend, settle, grow.
    ///
    /// `turning` is nutation's part in the change of curvature towards d1 and d2, in 1/cm/h.
    pub(super) fn step(&mut self, plant: &Individual, drive: &Drive, turning: [f64; 2]) {
        self.shape();
        self.illuminate(plant, drive);
        self.load(plant, drive);
        self.bend(plant, drive, turning);
        self.grow(drive);
        self.carry(plant);
        if self.length.iter().any(|&length| length > LONGEST) {
            self.split();
            self.begin(plant, drive);
        }
    }

    /// Where the segments are, and how they stand.
    fn shape(&mut self) {
        let n = self.length.len();
        let work = &mut self.work;
        let (length, k1, k2) = (&self.length[..n], &self.k1[..n], &self.k2[..n]);
        let (half_w, half_x, half_y) = (&mut work.half_w[..n], &mut work.half_x[..n], &mut work.half_y[..n]);
        for i in 0..n {
            (half_w[i], half_x[i], half_y[i]) = half_turn(k1[i], k2[i], length[i]);
        }
        let [qw, qx, qy, qz] = &mut work.turn;
        let (qw, qx, qy, qz) = (&mut qw[..n], &mut qx[..n], &mut qy[..n], &mut qz[..n]);
        let mut turn = self.base;
        for i in 0..n {
            let Turn([w, x, y, z]) = turn;
            (qw[i], qx[i], qy[i], qz[i]) = (w, x, y, z);
            let (w, x, y) = (half_w[i], half_x[i], half_y[i]);
            turn = turn.then(w * w - x * x - y * y, 2.0 * w * x, 2.0 * w * y);
        }
        let [d1x, d1y, d1z] = work.d1.each_mut().map(|axis| &mut axis[..n]);
        let [d2x, d2y, d2z] = work.d2.each_mut().map(|axis| &mut axis[..n]);
        let [tx, ty, tz] = work.along.each_mut().map(|axis| &mut axis[..n]);
        for i in 0..n {
            let middle = Turn([qw[i], qx[i], qy[i], qz[i]]).then(half_w[i], half_x[i], half_y[i]);
            let [d1, d2, t] = middle.frame();
            (d1x[i], d1y[i], d1z[i]) = (d1[0], d1[1], d1[2]);
            (d2x[i], d2y[i], d2z[i]) = (d2[0], d2[1], d2[2]);
            (tx[i], ty[i], tz[i]) = (t[0], t[1], t[2]);
        }
        let [mx, my, mz] = work.middle.each_mut().map(|axis| &mut axis[..n]);
        let mut at = [0.0; 3];
        for i in 0..n {
            let half = 0.5 * length[i];
            let (sx, sy, sz) = (half * tx[i], half * ty[i], half * tz[i]);
            (mx[i], my[i], mz[i]) = (at[0] + sx, at[1] + sy, at[2] + sz);
            at = [mx[i] + sx, my[i] + sy, mz[i] + sz];
        }
        work.apex = at;
    }

    /// The light that reaches every segment, and its response to it.
    fn illuminate(&mut self, plant: &Individual, drive: &Drive) {
        let n = self.length.len();
        let work = &mut self.work;
        let [mx, my, mz] = work.middle.each_ref().map(|axis| &axis[..n]);
        let [ex, ey, ez] = work.light.each_mut().map(|axis| &mut axis[..n]);
        ex.fill(0.0);
        ey.fill(0.0);
        ez.fill(0.0);
        for (lamp, watt) in LAMPS.iter().zip(drive.lamps).filter(|(_, power)| *power > 0.0) {
            let strength = watt * LAMP_DISTANCE * LAMP_DISTANCE;
            for i in 0..n {
                let (x, y, z) = (lamp[0] - mx[i], lamp[1] - my[i], lamp[2] - mz[i]);
                let distance2 = (x * x + y * y + z * z).max(LAMP_RADIUS * LAMP_RADIUS);
                let share = strength / (distance2 * distance2.sqrt());
                ex[i] += x * share;
                ey[i] += y * share;
                ez[i] += z * share;
            }
        }
        let exponent = 0.5 * (plant.tropism.light_exponent - 1.0);
        let (power, before) = (&mut work.power[..n], &mut work.power_before[..n]);
        let response = &mut work.response[..n];
        let mut change: f64 = if work.is_stale { 1.0 } else { -1.0 };
        for i in 0..n {
            power[i] = ex[i] * ex[i] + ey[i] * ey[i] + ez[i] * ez[i];
            change = change.max((power[i] - before[i]).abs() - GENTLE * before[i]);
        }
        let is_gentle = change < 0.0;
        let second = 0.5 * (exponent - 1.0);
        let third = (exponent - 2.0) / 3.0;
        let fourth = (exponent - 3.0) / 4.0;
        if is_gentle {
            for i in 0..n {
                let d = power[i] / before[i] - 1.0;
                response[i] *=
                    1.0 + exponent * d * (1.0 + second * d * (1.0 + third * d * (1.0 + fourth * d)));
                before[i] = power[i];
            }
        } else {
            for i in 0..n {
                response[i] = if power[i] > 0.0 { math::pow(power[i], exponent) } else { 0.0 };
                before[i] = power[i];
            }
        }
        work.is_stale = false;
    }

    /// The moments of everything that hangs on a segment: bud, leaves, stem and wall.
    fn load(&mut self, plant: &Individual, drive: &Drive) {
        let n = self.length.len();
        let work = &mut self.work;
        let [mx, my, mz] = work.middle.each_ref().map(|axis| &axis[..n]);
        let [tx, ty, tz] = work.moment.each_mut().map(|axis| &mut axis[..n]);
        let (below, length) = (&work.below[..n], &self.length[..n]);
        let mut mass = plant.stem.tip_g;
        let (mut mass_x, mut mass_z) = (mass * work.apex[0], mass * work.apex[2]);
        let mut nearest = work.apex[2];
        for i in (0..n).rev() {
            if i == self.leaf {
                mass += drive.leaf_mass;
                mass_x += drive.leaf_mass * mx[i];
                mass_z += drive.leaf_mass * mz[i];
            }
            tx[i] = GRAVITY * (mass_z - mz[i] * mass);
            ty[i] = 0.0;
            tz[i] = GRAVITY * (mx[i] * mass - mass_x);
            let radius = radius(plant, below[i]);
            let own = DENSITY * PI * radius * radius * length[i];
            mass += own;
            mass_x += own * mx[i];
            mass_z += own * mz[i];
            nearest = nearest.min(mz[i]);
        }
        if nearest < WALL + TOUCH {
            let (mut push, mut push_x, mut push_y) = (0.0, 0.0, 0.0);
            for i in (0..n).rev() {
                tx[i] += push_y - my[i] * push;
                ty[i] -= push_x - mx[i] * push;
                let own = WALL_STIFFNESS * (WALL + TOUCH - mz[i]).max(0.0);
                push += own;
                push_x += own * mx[i];
                push_y += own * my[i];
            }
        }
    }

    /// The change of curvature: at rest by perception, actually by settling under the loads.
    fn bend(&mut self, plant: &Individual, drive: &Drive, turning: [f64; 2]) {
        let n = self.length.len();
        let tropism = &plant.tropism;
        let work = &self.work;
        let (local, apical) = (1.0 - tropism.apical, tropism.apical);
        let at_apex = signal(work.apex, drive.lamps, tropism.light_exponent).map(|axis| apical * axis);
        let light_share = (drive.dt / tropism.light_memory_h).min(1.0);
        let gravity_share = (drive.dt / tropism.gravity_memory_h).min(1.0);
        let settling = 1.0 - math::exp(-drive.dt / plant.stem.lag_h);
        let rate = drive.dt * drive.gain;
        let turning = [turning[0] + tropism.bias_x, turning[1] - tropism.bias_z];
        let mature = plant.stem.modulus_mature_mpa * MEGAPASCAL * PI / 4.0;
        let [d1x, d1y, d1z] = work.d1.each_ref().map(|axis| &axis[..n]);
        let [d2x, d2y, d2z] = work.d2.each_ref().map(|axis| &axis[..n]);
        let [ex, ey, ez] = work.light.each_ref().map(|axis| &axis[..n]);
        let [tx, ty, tz] = work.moment.each_ref().map(|axis| &axis[..n]);
        let (power, response) = (&work.power[..n], &work.response[..n]);
        let (below, motile, modulus) = (&work.below[..n], &work.motile[..n], &work.modulus[..n]);
        let (k1, k2) = (&mut self.k1[..n], &mut self.k2[..n]);
        let (rest1, rest2) = (&mut self.rest1[..n], &mut self.rest2[..n]);
        let (fresh1, fresh2) = (&mut self.fresh1[..n], &mut self.fresh2[..n]);
        let (light1, light2) = (&mut self.light1[..n], &mut self.light2[..n]);
        let (gravity1, gravity2) = (&mut self.gravity1[..n], &mut self.gravity2[..n]);
        for i in 0..n {
            let seen = local * response[i].min(SATURATION / power[i].sqrt());
            let (sx, sy, sz) =
                (seen * ex[i] + at_apex[0], seen * ey[i] + at_apex[1], seen * ez[i] + at_apex[2]);
            fresh1[i] += light_share * (sx * d1x[i] + sy * d1y[i] + sz * d1z[i] - fresh1[i]);
            fresh2[i] += light_share * (sx * d2x[i] + sy * d2y[i] + sz * d2z[i] - fresh2[i]);
            light1[i] += light_share * (fresh1[i] - light1[i]);
            light2[i] += light_share * (fresh2[i] - light2[i]);
            gravity1[i] += gravity_share * (d1y[i] - gravity1[i]);
            gravity2[i] += gravity_share * (d2y[i] - gravity2[i]);

            let motility = rate / (1.0 + motile[i]);
            let wanted1 = tropism.light * light1[i] + tropism.gravity * gravity1[i] + turning[0];
            let wanted2 = tropism.light * light2[i] + tropism.gravity * gravity2[i] + turning[1];
            rest1[i] += motility * (wanted1 - drive.straightening * k1[i]);
            rest2[i] += motility * (wanted2 - drive.straightening * k2[i]);

            let radius2 = radius(plant, below[i]) * radius(plant, below[i]);
            let yielding = 1.0 / (mature * modulus[i].min(1.0) * radius2 * radius2);
            let elastic1 = yielding * (tx[i] * d2x[i] + ty[i] * d2y[i] + tz[i] * d2z[i]);
            let elastic2 = -yielding * (tx[i] * d1x[i] + ty[i] * d1y[i] + tz[i] * d1z[i]);
            k1[i] += settling * (rest1[i] + elastic1 - k1[i]);
            k2[i] += settling * (rest2[i] + elastic2 - k2[i]);
        }
    }

    /// Elongation of the growing zone.
    fn grow(&mut self, drive: &Drive) {
        let n = self.length.len();
        let work = &self.work;
        let length = &mut self.length[..n];
        let growing = &work.grow[..n];
        let weight: f64 = length.iter().zip(growing).map(|(length, grow)| length / (1.0 + grow)).sum();
        let rate = drive.dt * drive.growth / weight;
        for i in 0..n {
            length[i] += length[i] * rate / (1.0 + growing[i]);
        }
    }

    /// Distances from the apex after growth, and what is carried along with them.
    fn carry(&mut self, plant: &Individual) {
        let n = self.length.len();
        let work = &mut self.work;
        let before = &mut work.below_before[..n];
        before.copy_from_slice(&work.below[..n]);
        measure_below(&self.length, &mut work.below);
        let below = &work.below[..n];
        let (grow, motile, modulus) = (&mut work.grow[..n], &mut work.motile[..n], &mut work.modulus[..n]);
        let per_growth = 1.0 / GROWTH_EDGE;
        let per_motile = 1.0 / plant.motility.edge;
        let per_modulus = 1.0 / plant.stem.modulus_length;
        for i in 0..n {
            let moved = below[i] - before[i];
            grow[i] *= small_exp(moved * per_growth);
            motile[i] *= small_exp(moved * per_motile);
            modulus[i] *= small_exp(moved * per_modulus);
        }
    }

    /// Halves the segments that have become too long. The leaves stay with the lower half.
    fn split(&mut self) {
        let mut i = 0;
        while i < self.length.len() {
            if self.length[i] > LONGEST {
                self.length[i] *= 0.5;
                for values in [
                    &mut self.length,
                    &mut self.k1,
                    &mut self.k2,
                    &mut self.rest1,
                    &mut self.rest2,
                    &mut self.fresh1,
                    &mut self.fresh2,
                    &mut self.light1,
                    &mut self.light2,
                    &mut self.gravity1,
                    &mut self.gravity2,
                ] {
                    values.insert(i, values[i]);
                }
                if self.leaf > i {
                    self.leaf += 1;
                }
                i += 1;
            }
            i += 1;
        }
    }
}

impl Work {
    fn resize(&mut self, segments: usize) {
        let vectors = [&mut self.d1, &mut self.d2, &mut self.along, &mut self.middle, &mut self.light];
        let single = [
            &mut self.below,
            &mut self.below_before,
            &mut self.grow,
            &mut self.motile,
            &mut self.modulus,
            &mut self.half_w,
            &mut self.half_x,
            &mut self.half_y,
            &mut self.power,
            &mut self.power_before,
            &mut self.response,
        ];
        for values in
            vectors.into_iter().flatten().chain(&mut self.moment).chain(&mut self.turn).chain(single)
        {
            values.resize(segments, 0.0);
        }
    }
}

/// `e^x` for |x| below 0.01, to 1e-11.
#[inline(always)]
fn small_exp(x: f64) -> f64 {
    1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0))))
}

/// Distances of the segments' middles from the apex, in cm.
fn measure_below(length: &[f64], below: &mut [f64]) {
    let mut above = 0.0;
    for (length, below) in length.iter().zip(below).rev() {
        *below = above + 0.5 * length;
        above += length;
    }
}

/// The response to light at one place: the irradiance vector with its length raised to the exponent, saturated.
fn signal(at: Place, lamps: [f64; 2], exponent: f64) -> Place {
    let mut light = [0.0; 3];
    for (lamp, watt) in LAMPS.iter().zip(lamps).filter(|(_, power)| *power > 0.0) {
        let to_lamp: Place = core::array::from_fn(|axis| lamp[axis] - at[axis]);
        let distance2 = to_lamp.iter().map(|axis| axis * axis).sum::<f64>().max(LAMP_RADIUS * LAMP_RADIUS);
        let share = watt * LAMP_DISTANCE * LAMP_DISTANCE / (distance2 * distance2.sqrt());
        light = core::array::from_fn(|axis| light[axis] + share * to_lamp[axis]);
    }
    let irradiance = light.iter().map(|axis| axis * axis).sum::<f64>().sqrt();
    if irradiance == 0.0 {
        return [0.0; 3];
    }
    let response = math::pow(irradiance, exponent).min(SATURATION) / irradiance;
    light.map(|axis| response * axis)
}
