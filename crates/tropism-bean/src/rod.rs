//! One sub-step of the stem: a growing elastic rod with differential growth.
//!
//! In: the values that act on all segments alike ([`Forcing`]). Out: the rod one sub-step later. The idea: the rod is a chain
//! of segments that follow the tissue (Lagrangian). Each carries a length, a curvature towards two material directions, and
//! memories of light and gravity.
//!
//! The material frame (d1, d2, t) of a segment is twist-free (Bishop 1975): it rotates about `k1 d2 - k2 d1`, so straight
//! segments need no special case as with a Frenet frame. At an upright base d1 is x, d2 points away from the camera, t is up.
//!
//! Each quantity is one array (structure of arrays), and loops over segments contain no calls, so that the compiler vectorises
//! them. Between two ticks, short Taylor series update the exponentials of the distance from the apex and the power law of
//! irradiance.
//!
//! # References
//! Bishop 1975, doi:10.1080/00029890.1975.11993807: frames without twist. Bastien, Bohr, Moulia, Douady 2013,
//! doi:10.1073/pnas.1214301109: gravitropism balanced by proprioception. Bastien, Douady, Moulia 2015,
//! doi:10.1371/journal.pcbi.1004037: phototropism and its power law of irradiance.

mod contact;
mod lanes;

use core::f64::consts::PI;

use tropism::lamps::MAX_LAMPS;
use tropism::math;
use tropism::math::vector::Vec3;
use tropism::obstacle::Solid;

use super::internodal::{Internodal, Tissue};
use super::{ContactPoint, Individual};
use crate::view::WALL;
use contact::Contact;
pub(super) use lanes::{LANES, RodLanes};

/// A segment longer than this splits, in cm. Chosen by hand: 8 to some 65 segments a stem.
const MAX_SEGMENT_CM: f64 = 0.75;
/// Capacity of the arrays: segments and the apex. A full rod no longer splits. Chosen by hand: twice what a bean needs.
const MAX_NODES: usize = 128;
/// Segments of a seedling. Chosen by hand: 0.5 cm each.
const SEEDLING_SEGMENTS: usize = 8;
/// Index of the segment that bears the leaf pair of a seedling: 1 cm below the apex. Chosen by hand.
const LEAF_SEGMENT: usize = 6;
/// Width of the logistic lower edge of the growing zone, in cm. Chosen by hand.
const GROWTH_EDGE_CM: f64 = 1.0;
/// Distance from the apex at which the stem has its full radius, in cm. Chosen by hand.
const TAPER_CM: f64 = 15.0;
/// Density of the stem, in g/cm^3. Chosen by hand: a little below water.
const DENSITY: f64 = 0.95;
/// Gravitational acceleration, in cm/s^2.
const GRAVITY: f64 = 981.0;
/// dyn/cm^2 in one MPa.
const MEGAPASCAL: f64 = 1e7;
/// Distance between the wall and the midline of a stem that touches it, in cm. Chosen by hand.
const TOUCH_CM: f64 = 0.5;
/// Stiffness of the contact with the wall, in dyn per cm and segment. Chosen by hand.
const WALL_STIFFNESS: f64 = 300.0;
/// Distance at which a lamp of power 1 gives the reference irradiance, in cm: the lamps' distance along x (section 2.1).
const LAMP_DISTANCE: f64 = 35.0;
/// Shortest distance from the centre of a lamp that counts, in cm. Chosen by hand: it bounds the inverse-square law.
const LAMP_RADIUS: f64 = 1.0;
/// Saturation of the phototropic response, as a multiple of the response to the reference irradiance. Chosen by hand.
const SATURATION: f64 = 2.5;
/// Relative change of squared irradiance up to which a Taylor series updates its power. Chosen by hand: the fourth-order
/// series errs by less than 1e-7.
const SERIES_LIMIT: f64 = 0.03;

/// Values that act on all segments alike during a tick.
#[derive(Clone, Debug)]
pub(super) struct Forcing {
    /// Sub-step, in h.
    pub(super) dt: f64,
    /// Age of the plant, in h.
    pub(super) age_h: f64,
    /// Places of the lamps, in cm.
    pub(super) lamps: [Vec3; MAX_LAMPS],
    /// Power of each lamp, 0 to 1; 0 for places without a lamp.
    pub(super) powers: [f64; MAX_LAMPS],
    /// Elongation, in cm/h.
    pub(super) growth: f64,
    /// Motor gain on differential growth: maturity, fluctuation and pauses.
    pub(super) gain: f64,
    /// Length of the motile zone, in cm.
    pub(super) zone: f64,
    /// Rate of autotropic straightening (proprioception), gamma, per h.
    pub(super) straightening: f64,
    /// Mass of the leaf pair, in g.
    pub(super) leaf_mass: f64,
    /// Share of the way to elastic equilibrium that the stem goes in a sub-step.
    pub(super) relaxed_share: f64,
}

/// The stem as a chain of segments, base first.
#[derive(Clone, Debug)]
pub(super) struct Rod {
    /// Number of segments.
    count: usize,
    segments: Box<Segments>,
    /// Tissue of the second physiology; `None` for the first.
    tissue: Option<Tissue>,
    /// Index of the segment that bears the leaf pair.
    leaf: usize,
    /// Orientation of the base.
    base: Rotation,
    /// Solids and contacts with them; `None` without solids.
    contact: Option<Box<Contact>>,
    /// Whether the Taylor series must start from fresh values.
    is_stale: bool,
    /// Place of the apex, in cm, where the vector lanes have computed it; `None` after any other change.
    apex: Option<Vec3>,
}

/// Number of the quantities that are the state of a segment.
const STATE: usize = 11;

/// These quantities of [`Segments`], or of a row of [`lanes`], in one order: `state_of!(&segments)`, `state_of!(&mut row)`.
macro_rules! state_of {
    (& $of:ident) => { state_of!(all [&] $of) };
    (&mut $of:ident) => { state_of!(all [&mut] $of) };
    (all $borrow:tt $of:ident) => {
        state_of!(some $borrow $of: length k1 k2 rest1 rest2 light_stage1 light_stage2 light_memory1 light_memory2
            gravity_memory1 gravity_memory2)
    };
    (some $borrow:tt $of:ident: $($quantity:ident)+) => { [$(state_of!(one $borrow $of.$quantity)),+] };
    (one [$($borrow:tt)+] $of:ident.$quantity:ident) => { $($borrow)+ $of.$quantity };
}
use state_of;

/// One value for each segment.
type PerSegment = [f64; MAX_NODES];

/// State and working arrays of the segments.
#[derive(Clone, Debug)]
struct Segments {
    /// Length, in cm.
    length: PerSegment,
    /// Actual curvature towards d1 and d2, in 1/cm.
    k1: PerSegment,
    k2: PerSegment,
    /// Rest curvature, which differential growth changes, in 1/cm.
    rest1: PerSegment,
    rest2: PerSegment,
    /// Photic memory: two low-pass stages, towards d1 and d2.
    light_stage1: PerSegment,
    light_stage2: PerSegment,
    light_memory1: PerSegment,
    light_memory2: PerSegment,
    /// Gravity memory: one low-pass stage, towards d1 and d2.
    gravity_memory1: PerSegment,
    gravity_memory2: PerSegment,

    // Working values of a sub-step.
    /// Distance of the middle of the segment from the apex, in cm, and its change by growth.
    from_apex: PerSegment,
    moved: PerSegment,
    /// `e^((from_apex - zone) / edge)` of growth and of motility; Young's modulus over its mature value.
    growth_exp: PerSegment,
    motility_exp: PerSegment,
    modulus_ratio: PerSegment,
    /// Elongation, before it is scaled to that of the whole stem.
    growing: PerSegment,
    /// Rotation over half a segment: x and y of a quaternion whose w is 1 and z is 0.
    half_x: PerSegment,
    half_y: PerSegment,
    /// Orientation at the lower end of the segment: a quaternion of any length.
    rotation: [PerSegment; 4],
    /// Material frame at the middle of the segment, in world coordinates.
    d1: [PerSegment; 3],
    d2: [PerSegment; 3],
    along: [PerSegment; 3],
    /// Middle of the segment, in cm. Here and in the arrays of light, the apex follows the last segment.
    middle: [PerSegment; 3],
    /// Irradiance vector over the reference, its squared length, and that of the sub-step before.
    light: [PerSegment; 3],
    intensity2: PerSegment,
    last_intensity2: PerSegment,
    /// Response per unit of irradiance, without and with saturation.
    response: PerSegment,
    effective: PerSegment,
    /// Moment of the distal loads about the middle of the segment, in dyn cm.
    moment: [PerSegment; 3],
    /// Change of curvature in this sub-step by a unit moment, in 1/cm for each dyn cm, and by elastic relaxation, in 1/cm.
    softness: PerSegment,
    relaxing1: PerSegment,
    relaxing2: PerSegment,
}

/// A rotation: a quaternion (w, x, y, z) of any length, in the coordinates (d1, d2, t) of the upright base.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rotation([f64; 4]);

impl Rotation {
    /// The product with (w, x, y, 0): a further rotation in the rotated frame.
    #[inline(always)]
    fn then(self, w: f64, x: f64, y: f64) -> Self {
        let Self([a, b, c, d]) = self;
        Self([a * w - b * x - c * y, a * x + b * w - d * y, a * y + c * w + d * x, d * w + b * y - c * x])
    }

    /// d1, d2 and t in world coordinates: x is d1 of the upright base, y its t, z its d2 reversed.
    #[inline(always)]
    fn frame(self) -> [Vec3; 3] {
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
/// Taylor series for the tangent of a quarter of the angle of the segment: exact to 1e-12 for curvatures of a stem. Beyond
/// them the result still is a rotation.
#[inline(always)]
fn half_rotation(k1: f64, k2: f64, length: f64) -> [f64; 2] {
    let quarter = 0.25 * length;
    let (x, y) = ((-k2 * quarter).clamp(-1.0, 1.0), (k1 * quarter).clamp(-1.0, 1.0));
    let angle2 = x * x + y * y;
    let tangent = 1.0 + angle2 * (1.0 / 3.0 + angle2 * (2.0 / 15.0 + angle2 * (17.0 / 315.0)));
    [x * tangent, y * tangent]
}

/// A cross-section between two segments, or an end of the stem.
pub(super) struct Section {
    /// Its centre, in cm.
    pub(super) at: Vec3,
    /// Distance from the apex, in cm.
    pub(super) from_apex: f64,
    rotation: Rotation,
}

impl Section {
    /// Direction of the stem there.
    pub(super) fn along(&self) -> Vec3 {
        self.rotation.frame()[2]
    }
}

/// Radius of the stem at a distance from the apex, in cm.
#[inline(always)]
pub(super) fn radius(plant: &Individual, from_apex: f64) -> f64 {
    let stem = &plant.stem;
    stem.radius_apex + (stem.radius_base - stem.radius_apex) * (from_apex / TAPER_CM).min(1.0)
}

impl Rod {
    /// The straight stem of a seedling.
    pub(super) fn seedling(plant: &Individual) -> Self {
        let mut segments = Box::new(Segments::zero());
        segments.length[..SEEDLING_SEGMENTS].fill(plant.growth.start / SEEDLING_SEGMENTS as f64);
        let [x, y] = half_rotation(2.0 * plant.stem.tilt_x, -2.0 * plant.stem.tilt_z, 1.0);
        let base = Rotation([1.0, x, y, 0.0]);
        let tissue = plant.internodal.as_ref().map(|_| Tissue::seedling(SEEDLING_SEGMENTS, LEAF_SEGMENT));
        Self {
            count: SEEDLING_SEGMENTS,
            segments,
            tissue,
            leaf: LEAF_SEGMENT,
            base,
            contact: None,
            is_stale: true,
            apex: None,
        }
    }

    /// Puts the rod among solids.
    pub(super) fn set_solids(&mut self, solids: &[Solid]) {
        self.contact = (!solids.is_empty()).then(|| Box::new(Contact::new(solids, contact::FRICTION)));
    }

    /// Sets the coefficient of friction on the solids.
    pub(super) fn set_friction(&mut self, coefficient: f64) {
        if let Some(contact) = &mut self.contact {
            contact.friction = coefficient;
        }
    }

    /// Where the rod touches solids.
    pub(super) fn contacts(&self) -> Vec<ContactPoint> {
        self.contact.as_ref().map_or_else(Vec::new, |contact| contact.points().collect())
    }

    /// Tilts the base by `radians` towards positive x.
    pub(super) fn tilt_base(&mut self, radians: f64) {
        self.apex = None;
        let Rotation([w, x, y, z]) = self.base;
        let (cos, sin) = (math::cos(0.5 * radians), math::sin(0.5 * radians));
        self.base = Rotation([w * cos - y * sin, x * cos + z * sin, y * cos + w * sin, z * cos - x * sin]);
    }

    /// Length along the stem, in cm.
    pub(super) fn length(&self) -> f64 {
        self.segments.length[..self.count].iter().sum()
    }

    /// Place of the apex, in cm.
    pub(super) fn apex(&self) -> Vec3 {
        self.apex.unwrap_or_else(|| {
            let mut apex = [0.0; 3];
            self.for_each_section(|section| apex = section.at);
            apex
        })
    }

    /// Calls `visit` with the cross-sections from the base to the apex: one more than there are segments.
    pub(super) fn for_each_section(&self, mut visit: impl FnMut(Section)) {
        let mut rotation = self.base;
        let mut at = [0.0; 3];
        let mut from_apex = self.length();
        visit(Section { at, from_apex, rotation });
        for i in 0..self.count {
            let length = self.segments.length[i];
            let [x, y] = half_rotation(self.segments.k1[i], self.segments.k2[i], length);
            rotation = rotation.then(1.0, x, y);
            let along = rotation.frame()[2];
            at = core::array::from_fn(|axis| at[axis] + length * along[axis]);
            rotation = rotation.then(1.0, x, y);
            from_apex -= length;
            visit(Section { at, from_apex: from_apex.max(0.0), rotation });
        }
    }

    /// Index of the segment that bears the leaves.
    pub(super) fn leaf(&self) -> usize {
        self.leaf
    }

    /// The largest curvature, in 1/cm.
    pub(super) fn peak_curvature(&self) -> f64 {
        let squares = (0..self.count).map(|i| self.segments.k1[i].powi(2) + self.segments.k2[i].powi(2));
        squares.fold(0.0, f64::max).sqrt()
    }

    /// Computes the exponentials anew; the Taylor series of a tick start from them.
    pub(super) fn refresh(&mut self, plant: &Individual, forcing: &Forcing) {
        let segments = &mut *self.segments;
        segments.measure(self.count);
        let modulus = plant.stem.modulus_mpa / plant.stem.modulus_mature_mpa;
        for i in 0..self.count {
            segments.growth_exp[i] = math::exp((segments.from_apex[i] - plant.growth.zone) / GROWTH_EDGE_CM);
            segments.motility_exp[i] =
                math::exp((segments.from_apex[i] - forcing.zone) / plant.motility.edge);
            segments.modulus_ratio[i] =
                modulus * math::exp(segments.from_apex[i] / plant.stem.modulus_length);
        }
        if let Some((tissue, internodal)) = self.tissue.as_mut().zip(plant.internodal.as_ref()) {
            let middle = |i: usize| segments.from_apex[i];
            tissue.mature(internodal, forcing.age_h, |i| middle(i) - 0.5 * segments.length[i], middle);
        }
        self.is_stale = true;
    }

    /// Adds `noise()`, in 1/cm, to both rest curvatures of each segment, weighted by motility.
    pub(super) fn disturb(&mut self, mut noise: impl FnMut() -> f64) {
        for i in 0..self.count {
            let motility = match &self.tissue {
                Some(tissue) => tissue.motility(i),
                None => 1.0 / (1.0 + self.segments.motility_exp[i]),
            };
            self.segments.rest1[i] += motility * noise();
            self.segments.rest2[i] += motility * noise();
        }
    }

    /// One explicit Euler sub-step: perception, differential growth, elastic relaxation, elongation.
    ///
    /// `nutation` is the rate of curvature of circumnutation towards d1 and d2, in 1/cm/h.
    pub(super) fn step(&mut self, plant: &Individual, forcing: &Forcing, nutation: [f64; 2]) {
        self.apex = None;
        let (n, segments) = (self.count, &mut *self.segments);
        assert!(n < MAX_NODES);
        segments.orient(n, self.base);
        segments.illuminate(n, plant, forcing, self.is_stale);
        match (&mut self.tissue, &plant.internodal) {
            (Some(tissue), Some(internodal)) => {
                segments.respond(n, plant, forcing, nutation, (internodal, tissue));
            }
            _ => {
                segments.perceive(n, plant, forcing);
                segments.grow_differentially(n, plant, forcing, nutation);
            }
        }
        segments.load_moments(n, plant, forcing, self.leaf);
        segments.find_relaxation(n, plant, forcing);
        let weight = segments.weigh_growth(n);
        let is_pressed = self.contact.as_mut().is_some_and(|contact| {
            let last = if contact.is_due() { contact.find(n, segments, plant, forcing) } else { None };
            last.is_some_and(|last| contact.solve(last, segments, weight, plant, forcing))
        });
        segments.relax_elastically(n);
        if let Some(contact) = self.contact.as_ref().filter(|_| is_pressed) {
            let Segments { k1, k2, rest1, rest2, .. } = segments;
            for (values, bent) in [k1, k2, rest1, rest2].into_iter().zip(contact.bending()) {
                values.iter_mut().zip(bent).for_each(|(value, bent)| *value += bent);
            }
        }
        segments.elongate(n, weight, plant, forcing);
        self.is_stale = false;
        self.split_overlong(plant, forcing);
    }

    /// Splits segments that have become too long, and then computes the exponentials anew.
    pub(super) fn split_overlong(&mut self, plant: &Individual, forcing: &Forcing) {
        if self.count + 1 < MAX_NODES && self.split() {
            self.refresh(plant, forcing);
        }
    }

    /// Number of segments.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Halves segments longer than [`MAX_SEGMENT_CM`]; returns whether there were any. Leaves stay with the lower half.
    fn split(&mut self) -> bool {
        let before = self.count;
        let mut i = 0;
        while i < self.count {
            if self.segments.length[i] > MAX_SEGMENT_CM && self.count + 1 < MAX_NODES {
                self.segments.length[i] *= 0.5;
                for values in self.segments.state_mut() {
                    values.copy_within(i..self.count, i + 1);
                }
                if let Some(tissue) = &mut self.tissue {
                    tissue.split(i);
                }
                if let Some(contact) = &mut self.contact {
                    contact.split(i);
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
        const NONE: PerSegment = [0.0; MAX_NODES];
        Self {
            length: NONE,
            k1: NONE,
            k2: NONE,
            rest1: NONE,
            rest2: NONE,
            light_stage1: NONE,
            light_stage2: NONE,
            light_memory1: NONE,
            light_memory2: NONE,
            gravity_memory1: NONE,
            gravity_memory2: NONE,
            from_apex: NONE,
            moved: NONE,
            growth_exp: NONE,
            motility_exp: NONE,
            modulus_ratio: NONE,
            growing: NONE,
            half_x: NONE,
            half_y: NONE,
            rotation: [NONE; 4],
            d1: [NONE; 3],
            d2: [NONE; 3],
            along: [NONE; 3],
            middle: [NONE; 3],
            light: [NONE; 3],
            intensity2: NONE,
            last_intensity2: NONE,
            response: NONE,
            effective: NONE,
            moment: [NONE; 3],
            softness: NONE,
            relaxing1: NONE,
            relaxing2: NONE,
        }
    }

    /// The state: what stays from one tick to the next. Both halves of a split segment inherit it.
    fn state(&self) -> [&PerSegment; STATE] {
        state_of!(&self)
    }

    /// [`Self::state`], to be changed.
    fn state_mut(&mut self) -> [&mut PerSegment; STATE] {
        state_of!(&mut self)
    }

    /// Updates the distances from the apex, and their changes since the last call.
    fn measure(&mut self, n: usize) {
        let mut above = 0.0;
        for i in (0..n).rev() {
            let from_apex = above + 0.5 * self.length[i];
            self.moved[i] = from_apex - self.from_apex[i];
            self.from_apex[i] = from_apex;
            above += self.length[i];
        }
    }

    /// Integrates curvature along the rod to frames and places.
    fn orient(&mut self, n: usize, base: Rotation) {
        for i in 0..n {
            [self.half_x[i], self.half_y[i]] = half_rotation(self.k1[i], self.k2[i], self.length[i]);
        }
        let mut rotation = base;
        for i in 0..n {
            for (values, value) in self.rotation.iter_mut().zip(rotation.0) {
                values[i] = value;
            }
            let (x, y) = (self.half_x[i], self.half_y[i]);
            rotation = rotation.then(1.0 - x * x - y * y, 2.0 * x, 2.0 * y);
        }
        for i in 0..n {
            let lower = Rotation([
                self.rotation[0][i],
                self.rotation[1][i],
                self.rotation[2][i],
                self.rotation[3][i],
            ]);
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

    /// Irradiance at each segment and the apex, and the response: a power law with saturation.
    ///
    /// Lamps are point sources (inverse-square law) whose irradiance vectors add up.
    fn illuminate(&mut self, n: usize, plant: &Individual, forcing: &Forcing, is_stale: bool) {
        for axis in 0..3 {
            self.light[axis][..=n].fill(0.0);
        }
        for (lamp, power) in forcing.lamps.iter().zip(forcing.powers).filter(|(_, power)| *power > 0.0) {
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
        let (mut is_slow, mut brightest) = (!is_stale, 0.0_f64);
        for i in 0..=n {
            let [x, y, z] = [self.light[0][i], self.light[1][i], self.light[2][i]];
            self.intensity2[i] = x * x + y * y + z * z;
            is_slow &=
                (self.intensity2[i] - self.last_intensity2[i]).abs() < SERIES_LIMIT * self.last_intensity2[i];
            brightest = brightest.max(self.intensity2[i]);
        }
        // Response I^q, so I^(q-1) per unit of irradiance: (I^2)^((q-1)/2).
        let exponent = 0.5 * (plant.tropism.light_exponent - 1.0);
        if is_slow {
            let (second, third, fourth) =
                (0.5 * (exponent - 1.0), (exponent - 2.0) / 3.0, (exponent - 3.0) / 4.0);
            for i in 0..=n {
                let change = self.intensity2[i] / self.last_intensity2[i] - 1.0;
                let series = 1.0 + second * change * (1.0 + third * change * (1.0 + fourth * change));
                self.response[i] *= 1.0 + exponent * change * series;
            }
        } else {
            for i in 0..=n {
                self.response[i] =
                    if self.intensity2[i] > 0.0 { math::pow(self.intensity2[i], exponent) } else { 0.0 };
            }
        }
        self.last_intensity2[..=n].copy_from_slice(&self.intensity2[..=n]);
        self.effective[..=n].copy_from_slice(&self.response[..=n]);
        if brightest > SATURATION {
            for i in 0..=n {
                self.effective[i] = self.response[i].min(SATURATION / self.intensity2[i].sqrt());
            }
        }
    }

    /// The light at the apex that all segments perceive.
    fn light_at_apex(&self, n: usize, plant: &Individual) -> Vec3 {
        let apical = plant.tropism.apical * self.effective[n];
        core::array::from_fn(|axis| apical * self.light[axis][n])
    }

    /// Light at a segment, of which the share `local` counts, and at the apex, projected on the cross-section (sine law).
    #[inline(always)]
    fn light_signal(&self, i: usize, local: f64, apex: Vec3) -> [f64; 2] {
        let effective = local * self.effective[i];
        let x = effective * self.light[0][i] + apex[0];
        let y = effective * self.light[1][i] + apex[1];
        let z = effective * self.light[2][i] + apex[2];
        [
            x * self.d1[0][i] + y * self.d1[1][i] + z * self.d1[2][i],
            x * self.d2[0][i] + y * self.d2[1][i] + z * self.d2[2][i],
        ]
    }

    /// Low-pass filters light and gravity, projected on the cross-section of each segment (sine law).
    fn perceive(&mut self, n: usize, plant: &Individual, forcing: &Forcing) {
        let tropism = &plant.tropism;
        let light_share = (forcing.dt / tropism.light_memory_h).min(1.0);
        let gravity_share = (forcing.dt / tropism.gravity_memory_h).min(1.0);
        let apex = self.light_at_apex(n, plant);
        for i in 0..n {
            let [signal1, signal2] = self.light_signal(i, 1.0 - tropism.apical, apex);
            self.light_stage1[i] += light_share * (signal1 - self.light_stage1[i]);
            self.light_stage2[i] += light_share * (signal2 - self.light_stage2[i]);
            self.light_memory1[i] += light_share * (self.light_stage1[i] - self.light_memory1[i]);
            self.light_memory2[i] += light_share * (self.light_stage2[i] - self.light_memory2[i]);
            self.gravity_memory1[i] += gravity_share * (self.d1[1][i] - self.gravity_memory1[i]);
            self.gravity_memory2[i] += gravity_share * (self.d2[1][i] - self.gravity_memory2[i]);
        }
    }

    /// Differential growth: phototropism, gravitropism, straightening, circumnutation and bias change the rest curvature.
    fn grow_differentially(&mut self, n: usize, plant: &Individual, forcing: &Forcing, nutation: [f64; 2]) {
        let tropism = &plant.tropism;
        let growth_step = forcing.dt * forcing.gain;
        let [steady1, steady2] = [nutation[0] + tropism.bias_x, nutation[1] - tropism.bias_z];
        for i in 0..n {
            let motile_step = growth_step / (1.0 + self.motility_exp[i]);
            let rate1 =
                tropism.light * self.light_memory1[i] + tropism.gravity * self.gravity_memory1[i] + steady1;
            let rate2 =
                tropism.light * self.light_memory2[i] + tropism.gravity * self.gravity_memory2[i] + steady2;
            self.rest1[i] += motile_step * (rate1 - forcing.straightening * self.k1[i]);
            self.rest2[i] += motile_step * (rate2 - forcing.straightening * self.k2[i]);
        }
    }

    /// Perception and differential growth of the second physiology.
    fn respond(
        &mut self,
        n: usize,
        plant: &Individual,
        forcing: &Forcing,
        nutation: [f64; 2],
        (internodal, tissue): (&Internodal, &mut Tissue),
    ) {
        let tropism = &plant.tropism;
        let growth_step = forcing.dt * forcing.gain;
        let [steady1, steady2] = [nutation[0] + tropism.bias_x, nutation[1] - tropism.bias_z];
        let apex = self.light_at_apex(n, plant);
        for i in 0..n {
            let [light1, light2] = self.light_signal(i, 1.0 - tropism.apical, apex);
            let stimulus = [
                tropism.light * light1 + tropism.gravity * self.d1[1][i],
                tropism.light * light2 + tropism.gravity * self.d2[1][i],
            ];
            let [response1, response2] = tissue.respond(internodal, i, stimulus, forcing.dt);
            let motile_step = growth_step * tissue.motility(i);
            self.rest1[i] += motile_step * (response1 + steady1 - forcing.straightening * self.k1[i]);
            self.rest2[i] += motile_step * (response2 + steady2 - forcing.straightening * self.k2[i]);
        }
    }

    /// Moments of all distal loads on each segment: bud, leaves, stem and wall.
    fn load_moments(&mut self, n: usize, plant: &Individual, forcing: &Forcing, leaf: usize) {
        let mut mass = plant.stem.tip_g;
        let (mut mass_x, mut mass_z) = (mass * self.middle[0][n], mass * self.middle[2][n]);
        let mut nearest = self.middle[2][n];
        for i in (0..n).rev() {
            let (x, z) = (self.middle[0][i], self.middle[2][i]);
            if i == leaf {
                mass += forcing.leaf_mass;
                mass_x += forcing.leaf_mass * x;
                mass_z += forcing.leaf_mass * z;
            }
            self.moment[0][i] = GRAVITY * (mass_z - z * mass);
            self.moment[1][i] = 0.0;
            self.moment[2][i] = GRAVITY * (x * mass - mass_x);
            let radius = radius(plant, self.from_apex[i]);
            let own = DENSITY * PI * radius * radius * self.length[i];
            mass += own;
            mass_x += own * x;
            mass_z += own * z;
            nearest = nearest.min(z);
        }
        if nearest < WALL + TOUCH_CM {
            self.push_from_wall(n);
        }
    }

    /// Adds the moments of the contact forces of the back wall.
    fn push_from_wall(&mut self, n: usize) {
        let (mut push, mut push_x, mut push_y) = (0.0, 0.0, 0.0);
        for i in (0..n).rev() {
            let [x, y, z] = [self.middle[0][i], self.middle[1][i], self.middle[2][i]];
            self.moment[0][i] += push_y - y * push;
            self.moment[1][i] -= push_x - x * push;
            let own = WALL_STIFFNESS * (WALL + TOUCH_CM - z).max(0.0);
            push += own;
            push_x += own * x;
            push_y += own * y;
        }
    }

    /// Elastic rod: the curvature relaxes to the rest curvature plus moment over flexural rigidity (overdamped). Computes by how
    /// much in this sub-step.
    fn find_relaxation(&mut self, n: usize, plant: &Individual, forcing: &Forcing) {
        let relaxed_share = forcing.relaxed_share;
        let mature = plant.stem.modulus_mature_mpa * MEGAPASCAL * PI / 4.0;
        for i in 0..n {
            let radius = radius(plant, self.from_apex[i]);
            let area = radius * radius;
            // 1 over the flexural rigidity, in 1/(dyn cm^2).
            let compliance = 1.0 / (mature * self.modulus_ratio[i].min(1.0) * area * area);
            let [x, y, z] = [self.moment[0][i], self.moment[1][i], self.moment[2][i]];
            let bending_moment1 = x * self.d2[0][i] + y * self.d2[1][i] + z * self.d2[2][i];
            let bending_moment2 = x * self.d1[0][i] + y * self.d1[1][i] + z * self.d1[2][i];
            self.softness[i] = relaxed_share * compliance;
            self.relaxing1[i] = relaxed_share * (self.rest1[i] + compliance * bending_moment1 - self.k1[i]);
            self.relaxing2[i] = relaxed_share * (self.rest2[i] - compliance * bending_moment2 - self.k2[i]);
        }
    }

    fn relax_elastically(&mut self, n: usize) {
        for i in 0..n {
            self.k1[i] += self.relaxing1[i];
            self.k2[i] += self.relaxing2[i];
        }
    }

    /// Computes the elongation of each segment before it is scaled to that of the whole stem. Returns the sum.
    fn weigh_growth(&mut self, n: usize) -> f64 {
        let mut weight = 0.0;
        for i in 0..n {
            self.growing[i] = self.length[i] / (1.0 + self.growth_exp[i]);
        }
        for i in 0..n {
            weight += self.growing[i];
        }
        weight
    }

    /// Elongates the growing zone, and updates the exponentials by Taylor series.
    fn elongate(&mut self, n: usize, weight: f64, plant: &Individual, forcing: &Forcing) {
        let rate = forcing.dt * forcing.growth / weight;
        for i in 0..n {
            self.length[i] += rate * self.growing[i];
        }
        self.measure(n);
        let [grow, motile, modulus] =
            [GROWTH_EDGE_CM, plant.motility.edge, plant.stem.modulus_length].map(|length| 1.0 / length);
        for i in 0..n {
            let moved = self.moved[i];
            self.growth_exp[i] *= small_exp(moved * grow);
            self.motility_exp[i] *= small_exp(moved * motile);
            self.modulus_ratio[i] *= small_exp(moved * modulus);
        }
    }
}

/// `e^x` for |x| below 0.01, to 1e-12.
#[inline(always)]
fn small_exp(x: f64) -> f64 {
    1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0))))
}
