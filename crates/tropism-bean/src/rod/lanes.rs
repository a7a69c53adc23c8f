//! Rods side by side, one plant a vector lane: the fast twin of [`super::Rod::step`], with the same bits.
//!
//! In: the rods of some plants, and what is held constant over a tick for each. Out: the rods after the tick. The idea: a rod is
//! a chain, and the processor waits for one segment before it computes the next. Here the same segment of [`LANES`] plants is
//! one row of vectors. Each lane takes the operations of [`super::Rod::step`] in the same order, and nothing is fused. `loading` puts
//! rods into lanes and back.
//!
//! Plants have different numbers of segments. Rows beyond the apex of a plant have length 0, so they lie at its apex, weigh
//! nothing and need no mask. A plant whose segment has become too long is stored, split as a plain rod, and loaded again.
//! Contacts with solids are few: they are computed plant by plant, by the code of the plain rod.

#![allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays at once")]

mod loading;

use core::f64::consts::PI;
use core::ops::Range;

use rand_chacha::ChaCha8Rng;
use tropism::lamps::MAX_LAMPS;
pub(crate) use tropism::math::lanes::LANES;
use tropism::math::lanes::Row as PerPlant;
use tropism::math::vector::{Vec3, cross};
use tropism::math::{self, Lanes};
use tropism::random::lanes::{DRAWS, Streams, normal};
use tropism::simd::{Kernel, dispatch};

use super::contact::{Contact, Shape};
use super::{
    DENSITY, Forcing, GRAVITY, GROWTH_EDGE_CM, LAMP_RADIUS, MAX_NODES, MAX_SEGMENT_CM, Rotation, SATURATION,
    SERIES_LIMIT, Segments, TAPER_CM, TOUCH_CM, WALL_STIFFNESS, half_rotation, small_exp,
};
use crate::Individual;
use crate::view::WALL;

/// Rows that go through all loops of a pass before the next ones. Chosen by measurement: they fit into the fastest cache of the
/// processor.
const BLOCK: usize = 8;

/// The same segment of all plants; the arrays are those of [`Segments`](super::Segments).
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Row {
    length: PerPlant,
    k1: PerPlant,
    k2: PerPlant,
    rest1: PerPlant,
    rest2: PerPlant,
    light_stage1: PerPlant,
    light_stage2: PerPlant,
    light_memory1: PerPlant,
    light_memory2: PerPlant,
    gravity_memory1: PerPlant,
    gravity_memory2: PerPlant,
    from_apex: PerPlant,
    growth_exp: PerPlant,
    motility_exp: PerPlant,
    modulus_ratio: PerPlant,
    growing: PerPlant,
    d1: [PerPlant; 3],
    d2: [PerPlant; 3],
    middle: [PerPlant; 3],
    light: [PerPlant; 3],
    /// Squared irradiance, which the next sub-step compares with its own.
    intensity2: PerPlant,
    response: PerPlant,
}

impl Row {
    /// A row beyond the apex.
    const BEYOND: Self = Self {
        length: [0.0; LANES],
        k1: [0.0; LANES],
        k2: [0.0; LANES],
        rest1: [0.0; LANES],
        rest2: [0.0; LANES],
        light_stage1: [0.0; LANES],
        light_stage2: [0.0; LANES],
        light_memory1: [0.0; LANES],
        light_memory2: [0.0; LANES],
        gravity_memory1: [0.0; LANES],
        gravity_memory2: [0.0; LANES],
        from_apex: [0.0; LANES],
        growth_exp: [0.0; LANES],
        motility_exp: [0.0; LANES],
        modulus_ratio: [1.0; LANES],
        growing: [0.0; LANES],
        d1: [[0.0; LANES]; 3],
        d2: [[0.0; LANES]; 3],
        middle: [[0.0; LANES]; 3],
        light: [[0.0; LANES]; 3],
        intensity2: [0.0; LANES],
        response: [0.0; LANES],
    };
}

/// What is held constant over a tick for each plant.
#[derive(Clone)]
#[repr(C, align(64))]
struct Constants {
    base: [PerPlant; 4],
    /// Place and strength of the lit lamps of each plant; a plant with fewer has lamps of strength 0.
    lamps: [[PerPlant; 4]; MAX_LAMPS],
    /// Exponent of the squared irradiance, and the factors of its Taylor series.
    series: [PerPlant; 4],
    light_share: PerPlant,
    gravity_share: PerPlant,
    local: PerPlant,
    apical: PerPlant,
    sensitivity: [PerPlant; 2],
    bias: [PerPlant; 2],
    growth_step: PerPlant,
    straightening: PerPlant,
    tip_mass: PerPlant,
    leaf_mass: PerPlant,
    radius_apex: PerPlant,
    widening: PerPlant,
    relaxed_share: PerPlant,
    mature: PerPlant,
    elongation: PerPlant,
    per_edge: PerPlant,
    per_modulus_length: PerPlant,
    /// Lengths of the zones of growth and of motility, width of the edge of the latter, and those of the modulus.
    growth_zone: PerPlant,
    motile_zone: PerPlant,
    edge: PerPlant,
    modulus: PerPlant,
    modulus_length: PerPlant,
    /// Standard deviation of the noise of curvature over a tick.
    curvature_sigma: PerPlant,
}

/// Up to [`LANES`] rods side by side during a tick.
pub(crate) struct RodLanes {
    rows: Box<[Row; MAX_NODES]>,
    constants: Box<Constants>,
    /// 1 for plants with noise of curvature, 0 for others.
    are_disturbed: PerPlant,
    /// The random streams of this noise, and what this tick takes of them, row by row.
    streams: Streams,
    draws: Vec<[PerPlant; DRAWS]>,
    /// Number of lamps in [`Constants::lamps`] that are lit for some plant.
    lit: usize,
    /// Number of segments of each plant, and the greatest.
    counts: [usize; LANES],
    most: usize,
    /// Index of the segment that bears the leaves of each plant.
    leaves: [usize; LANES],
    /// Whether the Taylor series of the response must start from fresh values.
    is_stale: [bool; LANES],
    /// Saturation of the response of each plant; infinite where all its segments are far from the lamps.
    saturation: PerPlant,
    /// Length of the longest segment of each plant.
    longest: PerPlant,
    /// Sum of [`Row::growing`] over the segments of each plant.
    weight: PerPlant,
    /// The least z of each plant.
    nearest: PerPlant,
    /// Plants among solids, and memory for the segments of one of them.
    guests: [Option<Guest>; LANES],
    segments: Option<Box<Segments>>,
}

/// The segments of the plant in a lane.
struct Lane<'a> {
    rows: &'a [Row],
    lane: usize,
}

impl Shape for Lane<'_> {
    fn length(&self, i: usize) -> f64 {
        self.rows[i].length[self.lane]
    }

    fn middle(&self, i: usize) -> Vec3 {
        self.rows[i].middle.map(|axis| axis[self.lane])
    }

    fn along(&self, i: usize) -> Vec3 {
        let Row { d1, d2, .. } = &self.rows[i];
        cross(d1.map(|axis| axis[self.lane]), d2.map(|axis| axis[self.lane]))
    }

    fn apex_distance(&self, i: usize) -> f64 {
        self.rows[i].from_apex[self.lane]
    }
}

/// What a plant among solids needs beside its lane.
struct Guest {
    plant: Individual,
    forcing: Forcing,
    /// `None` while the plant splits a segment as a plain rod.
    contact: Option<Box<Contact>>,
    /// Whether contacts bend the plant in this sub-step.
    is_pressed: bool,
}

impl RodLanes {
    pub(crate) fn new() -> Self {
        const NONE: PerPlant = [0.0; LANES];
        let rows = vec![Row::BEYOND; MAX_NODES].into_boxed_slice();
        Self {
            rows: rows.try_into().map_err(drop).expect("as many rows"),
            constants: Box::new(Constants {
                base: [NONE; 4],
                lamps: [[NONE; 4]; MAX_LAMPS],
                series: [NONE; 4],
                light_share: NONE,
                gravity_share: NONE,
                local: NONE,
                apical: NONE,
                sensitivity: [NONE; 2],
                bias: [NONE; 2],
                growth_step: NONE,
                straightening: NONE,
                tip_mass: NONE,
                leaf_mass: NONE,
                radius_apex: NONE,
                widening: NONE,
                relaxed_share: NONE,
                mature: NONE,
                elongation: NONE,
                per_edge: NONE,
                per_modulus_length: NONE,
                growth_zone: NONE,
                motile_zone: NONE,
                edge: NONE,
                modulus: NONE,
                modulus_length: NONE,
                curvature_sigma: NONE,
            }),
            are_disturbed: NONE,
            streams: Streams::new(),
            draws: vec![[NONE; DRAWS]; MAX_NODES],
            lit: 0,
            counts: [0; LANES],
            most: 0,
            leaves: [0; LANES],
            is_stale: [true; LANES],
            saturation: NONE,
            longest: NONE,
            weight: NONE,
            nearest: NONE,
            guests: [const { None }; LANES],
            segments: None,
        }
    }

    /// Draws the noise of curvature of a tick for the plant in a lane from `rng`, as [`super::Rod::disturb`] does.
    pub(crate) fn draw_curvature(&mut self, lane: usize, sigma: f64, rng: &mut ChaCha8Rng) {
        self.constants.curvature_sigma[lane] = sigma;
        self.are_disturbed[lane] = 1.0;
        self.streams.take(lane, rng, self.counts[lane]);
    }

    /// Begins a tick of all plants: [`super::Rod::refresh`], and [`super::Rod::disturb`] with what was drawn.
    pub(crate) fn begin_tick(&mut self) {
        dispatch(Begin { rods: self });
    }

    /// Whether a segment of the plant in a lane must split.
    pub(crate) fn must_split(&self, lane: usize) -> bool {
        self.longest[lane] > MAX_SEGMENT_CM && self.counts[lane] + 1 < MAX_NODES
    }

    /// One sub-step of all plants: [`super::Rod::step`] without the splitting of segments.
    ///
    /// `nutation` is the rate of curvature of circumnutation of each plant towards d1 and d2, in 1/cm/h.
    pub(crate) fn step(&mut self, nutation: &[[f64; 2]; LANES]) {
        dispatch(Substep { rods: self, nutation });
    }

    /// Finds the contacts of the plants among solids, and their forces.
    #[inline(never)]
    fn press(&mut self) {
        for lane in 0..LANES {
            let Some(guest) = &mut self.guests[lane] else { continue };
            let Some(contact) = guest.contact.as_deref_mut() else { continue };
            guest.is_pressed = false;
            if !contact.is_due() {
                continue;
            }
            let (n, rows) = (self.counts[lane], &self.rows[..]);
            let Some(last) = contact.find(n, &Lane { rows, lane }, &guest.plant, &guest.forcing) else {
                continue;
            };
            let segments = self.segments.get_or_insert_with(|| Box::new(Segments::zero()));
            for (i, row) in rows[..=n].iter().enumerate() {
                row.copy_loads_to(segments, i, lane);
            }
            for (i, row) in rows[..=last].iter().enumerate() {
                row.copy_to(segments, i, lane);
            }
            segments.load_moments(n, &guest.plant, &guest.forcing, self.leaves[lane]);
            segments.find_relaxation(last + 1, &guest.plant, &guest.forcing);
            guest.is_pressed = contact.solve(last, segments, self.weight[lane], &guest.plant, &guest.forcing);
        }
    }

    /// Adds the bending by contacts to the relaxed curvatures.
    #[inline(never)]
    fn bend_by_contacts(&mut self) {
        for lane in 0..LANES {
            let Some(guest) = self.guests[lane].as_ref().filter(|guest| guest.is_pressed) else { continue };
            let Some(contact) = &guest.contact else { continue };
            let [actual1, actual2, rest1, rest2] = contact.bending();
            for (i, row) in self.rows[..actual1.len()].iter_mut().enumerate() {
                row.k1[lane] += actual1[i];
                row.k2[lane] += actual2[i];
                row.rest1[lane] += rest1[i];
                row.rest2[lane] += rest2[i];
            }
        }
    }

    /// From the base up: frames and places, irradiance at each segment and the apex, and the response to it.
    ///
    /// Loops are short, so that the processor begins the next row before it has ended this one.
    #[inline(always)]
    fn rise(&mut self) {
        let lamps = &self.constants.lamps[..self.lit];
        let mut end = Ends {
            rotation: self.constants.base,
            at: [[0.0; LANES]; 3],
            weight: [0.0; LANES],
            nearest: [f64::INFINITY; LANES],
        };
        let mut seen = Irradiance {
            slow: self.is_stale.map(|is_stale| if is_stale { 0.0 } else { 1.0 }),
            brightest: [0.0; LANES],
        };
        let mut middles = [[[0.0; LANES]; 4]; BLOCK];
        for block in self.rows[..=self.most].chunks_mut(BLOCK) {
            for (row, middle) in block.iter().zip(&mut middles) {
                row.rotate(&mut end.rotation, middle);
            }
            for (row, middle) in block.iter_mut().zip(&middles) {
                row.orient(middle, &mut end);
            }
            for row in block.iter_mut() {
                let mut light = [[0.0; LANES]; 3];
                for lamp in lamps {
                    row.add_light(lamp, &mut light);
                }
                row.light = light;
            }
            for row in block.iter_mut() {
                row.respond(&self.constants.series, &mut seen);
            }
        }
        (self.weight, self.nearest) = (end.weight, end.nearest);
        self.is_stale = seen.slow.map(|slow| slow == 0.0);
        self.saturation =
            seen.brightest.map(|most| if most > SATURATION { SATURATION } else { f64::INFINITY });
    }

    /// Computes the response anew for plants whose irradiance has changed too much for the Taylor series.
    #[inline(always)]
    fn respond_anew(&mut self) {
        let exponents = &self.constants.series[0];
        for row in &mut self.rows[..=self.most] {
            row.respond_anew(exponents, &self.is_stale);
        }
        self.is_stale = [false; LANES];
    }

    /// From the apex down: perception, differential growth, elastic relaxation and elongation.
    ///
    /// `SATURATES` says whether a plant is near enough to a lamp, `TOUCHES` whether one touches the wall, and `HAS_GUESTS`
    /// whether one stands among solids.
    #[inline(always)]
    fn descend<const SATURATES: bool, const TOUCHES: bool, const HAS_GUESTS: bool>(
        &mut self,
        nutation: &[[f64; 2]; LANES],
    ) {
        let common = self.common::<SATURATES>(nutation);
        let mut above = self.above();
        if HAS_GUESTS {
            // Contacts are found between the two.
            self.bend::<SATURATES>(0..self.most, &common);
            self.press();
            self.relax::<TOUCHES>(0..self.most, &mut above);
            self.bend_by_contacts();
        } else {
            let mut end = self.most;
            while end > 0 {
                let block = end.saturating_sub(BLOCK)..end;
                self.bend::<SATURATES>(block.clone(), &common);
                self.relax::<TOUCHES>(block.clone(), &mut above);
                end = block.start;
            }
        }
        self.longest = above.longest;
    }

    /// What is the same for all segments of a plant in perception and differential growth.
    #[inline(always)]
    fn common<const SATURATES: bool>(&self, nutation: &[[f64; 2]; LANES]) -> Common {
        let of = &*self.constants;
        let mut common = Common { light: [[0.0; LANES]; 3], steady: [[0.0; LANES]; 2] };
        self.rows[self.most].perceive_at_apex::<SATURATES>(of, &self.saturation, &mut common.light);
        for (lane, &[towards1, towards2]) in nutation.iter().enumerate() {
            common.steady[0][lane] = towards1 + of.bias[0][lane];
            common.steady[1][lane] = towards2 - of.bias[1][lane];
        }
        common
    }

    /// Perception and differential growth of some rows.
    #[inline(always)]
    fn bend<const SATURATES: bool>(&mut self, rows: Range<usize>, common: &Common) {
        for row in &mut self.rows[rows] {
            row.bend::<SATURATES>(&self.constants, &self.saturation, common);
        }
    }

    /// What [`Self::relax`] begins with at the apex.
    #[inline(always)]
    fn above(&self) -> Above {
        const NONE: PerPlant = [0.0; LANES];
        let of = &*self.constants;
        let apex = &self.rows[self.most].middle;
        let mut above = Above {
            mass: of.tip_mass,
            mass_x: NONE,
            mass_z: NONE,
            push: [NONE; 3],
            rate: NONE,
            length: NONE,
            longest: NONE,
            touches: self.nearest.map(|nearest| if nearest < WALL + TOUCH_CM { 1.0 } else { 0.0 }),
        };
        for lane in 0..LANES {
            above.mass_x[lane] = above.mass[lane] * apex[0][lane];
            above.mass_z[lane] = above.mass[lane] * apex[2][lane];
            above.rate[lane] = of.elongation[lane] / self.weight[lane];
        }
        above
    }

    /// Loads, elastic relaxation, and elongation of some rows, the highest one first.
    #[inline(always)]
    fn relax<const TOUCHES: bool>(&mut self, rows: Range<usize>, above: &mut Above) {
        let of = &*self.constants;
        let [lowest, highest] = self
            .leaves
            .iter()
            .fold([usize::MAX, 0], |[lowest, highest], &leaf| [lowest.min(leaf), highest.max(leaf)]);
        let leaf_rows = lowest..=highest;
        for i in rows.rev() {
            let row = &mut self.rows[i];
            if leaf_rows.contains(&i) {
                above.add_leaves(&self.leaves.map(|leaf| leaf == i), row, of);
            }
            if TOUCHES {
                // Rows beyond the apex are no part of the plant: the wall does not push them.
                let is_pushed = pushed(&above.touches, &self.counts, i);
                row.relax::<true>(of, above, &is_pushed);
            } else {
                row.relax::<false>(of, above, &[0.0; LANES]);
            }
        }
    }
}

/// The end of the rows so far, from the base up.
struct Ends {
    rotation: [PerPlant; 4],
    at: [PerPlant; 3],
    weight: PerPlant,
    nearest: PerPlant,
}

/// What the irradiance of all rows says.
struct Irradiance {
    /// 1 where the Taylor series may go on, else 0.
    slow: PerPlant,
    brightest: PerPlant,
}

/// What is the same for all segments of a plant.
struct Common {
    light: [PerPlant; 3],
    steady: [PerPlant; 2],
}

/// Sums over the rows above, and what is the same for all rows.
struct Above {
    mass: PerPlant,
    mass_x: PerPlant,
    mass_z: PerPlant,
    /// Force of the wall, and its moments.
    push: [PerPlant; 3],
    rate: PerPlant,
    length: PerPlant,
    longest: PerPlant,
    /// 1 for plants that touch the wall, 0 for others.
    touches: PerPlant,
}

impl Above {
    /// Adds the leaves of the plants that bear them at `row`.
    #[inline(always)]
    fn add_leaves(&mut self, bears: &[bool; LANES], row: &Row, of: &Constants) {
        for lane in 0..LANES {
            let leaf = of.leaf_mass[lane];
            let mass = self.mass[lane] + leaf;
            let mass_x = self.mass_x[lane] + leaf * row.middle[0][lane];
            let mass_z = self.mass_z[lane] + leaf * row.middle[2][lane];
            self.mass[lane] = if bears[lane] { mass } else { self.mass[lane] };
            self.mass_x[lane] = if bears[lane] { mass_x } else { self.mass_x[lane] };
            self.mass_z[lane] = if bears[lane] { mass_z } else { self.mass_z[lane] };
        }
    }
}

/// The work on one row. Each loop is a function of its own: what it writes and what it reads are then known to be apart, and
/// the compiler makes vectors of it.
impl Row {
    /// Copies what [`Segments::load_moments`] reads of a plant.
    fn copy_loads_to(&self, segments: &mut Segments, i: usize, lane: usize) {
        segments.length[i] = self.length[lane];
        segments.from_apex[i] = self.from_apex[lane];
        for axis in 0..3 {
            segments.middle[axis][i] = self.middle[axis][lane];
        }
    }

    /// Copies what contacts read of a plant besides.
    fn copy_to(&self, segments: &mut Segments, i: usize, lane: usize) {
        segments.k1[i] = self.k1[lane];
        segments.k2[i] = self.k2[lane];
        segments.rest1[i] = self.rest1[lane];
        segments.rest2[i] = self.rest2[lane];
        segments.growing[i] = self.growing[lane];
        segments.modulus_ratio[i] = self.modulus_ratio[lane];
        for axis in 0..3 {
            segments.d1[axis][i] = self.d1[axis][lane];
            segments.d2[axis][i] = self.d2[axis][lane];
        }
    }

    /// Exponentials of the distance from the apex; `above` is the length of the stem above this row.
    #[inline(always)]
    fn refresh(&mut self, of: &Constants, above: &mut PerPlant) {
        let [mut growth, mut motility, mut modulus] = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let from_apex = above[lane] + 0.5 * self.length[lane];
            self.from_apex[lane] = from_apex;
            above[lane] += self.length[lane];
            growth[lane] = (from_apex - of.growth_zone[lane]) / GROWTH_EDGE_CM;
            motility[lane] = (from_apex - of.motile_zone[lane]) / of.edge[lane];
            modulus[lane] = from_apex / of.modulus_length[lane];
        }
        self.growth_exp = math::exp(Lanes(growth)).0;
        self.motility_exp = math::exp(Lanes(motility)).0;
        self.modulus_ratio = math::exp(Lanes(modulus)).0;
        for lane in 0..LANES {
            self.modulus_ratio[lane] *= of.modulus[lane];
        }
    }

    /// Adds the noise of a tick to the rest curvature, weighted by motility.
    #[inline(always)]
    fn disturb(&mut self, of: &Constants, are_disturbed: &PerPlant, draws: &[PerPlant; DRAWS]) {
        let [of_radius1, of_angle1, of_radius2, of_angle2] = draws;
        let (noise1, noise2) = (normal(of_radius1, of_angle1), normal(of_radius2, of_angle2));
        for lane in 0..LANES {
            let motility = 1.0 / (1.0 + self.motility_exp[lane]);
            let rest1 = self.rest1[lane] + motility * (of.curvature_sigma[lane] * noise1[lane]);
            let rest2 = self.rest2[lane] + motility * (of.curvature_sigma[lane] * noise2[lane]);
            self.rest1[lane] = if are_disturbed[lane] == 1.0 { rest1 } else { self.rest1[lane] };
            self.rest2[lane] = if are_disturbed[lane] == 1.0 { rest2 } else { self.rest2[lane] };
        }
    }

    /// Computes the response per unit of irradiance anew where it is stale.
    #[inline(always)]
    fn respond_anew(&mut self, exponents: &PerPlant, is_stale: &[bool; LANES]) {
        let fresh = math::pow(Lanes(self.intensity2), Lanes(*exponents)).0;
        for lane in 0..LANES {
            let fresh = if self.intensity2[lane] > 0.0 { fresh[lane] } else { 0.0 };
            self.response[lane] = if is_stale[lane] { fresh } else { self.response[lane] };
        }
    }

    /// Turns `rotation` from the lower end of the segments to the upper one; `middle` is the rotation between.
    #[inline(always)]
    fn rotate(&self, rotation: &mut [PerPlant; 4], middle: &mut [PerPlant; 4]) {
        for lane in 0..LANES {
            let [x, y] = half_rotation(self.k1[lane], self.k2[lane], self.length[lane]);
            let lower =
                Rotation([rotation[0][lane], rotation[1][lane], rotation[2][lane], rotation[3][lane]]);
            let Rotation(half_way) = lower.then(1.0, x, y);
            let Rotation(upper) = lower.then(1.0 - x * x - y * y, 2.0 * x, 2.0 * y);
            for part in 0..4 {
                middle[part][lane] = half_way[part];
                rotation[part][lane] = upper[part];
            }
        }
    }

    /// Frames and places from the rotation at the middle of the segments, and the elongation before it is scaled.
    #[inline(always)]
    fn orient(&mut self, middle: &[PerPlant; 4], end: &mut Ends) {
        for lane in 0..LANES {
            let length = self.length[lane];
            let rotation = Rotation([middle[0][lane], middle[1][lane], middle[2][lane], middle[3][lane]]);
            let [d1, d2, along] = rotation.frame();
            let half = 0.5 * length;
            for axis in 0..3 {
                self.d1[axis][lane] = d1[axis];
                self.d2[axis][lane] = d2[axis];
                let way = half * along[axis];
                let middle = end.at[axis][lane] + way;
                self.middle[axis][lane] = middle;
                end.at[axis][lane] = middle + way;
            }
            let z = self.middle[2][lane];
            end.nearest[lane] = if z < end.nearest[lane] { z } else { end.nearest[lane] };
            let growing = length / (1.0 + self.growth_exp[lane]);
            self.growing[lane] = growing;
            end.weight[lane] += growing;
        }
    }

    /// Goes to the upper end of the segments, in the steps of [`super::Rod::for_each_section`].
    #[inline(always)]
    fn pass(&self, rotation: &mut [PerPlant; 4], at: &mut [PerPlant; 3]) {
        for lane in 0..LANES {
            let length = self.length[lane];
            let [x, y] = half_rotation(self.k1[lane], self.k2[lane], length);
            let lower =
                Rotation([rotation[0][lane], rotation[1][lane], rotation[2][lane], rotation[3][lane]]);
            let middle = lower.then(1.0, x, y);
            let along = middle.frame()[2];
            for axis in 0..3 {
                at[axis][lane] += length * along[axis];
            }
            let Rotation(upper) = middle.then(1.0, x, y);
            for part in 0..4 {
                rotation[part][lane] = upper[part];
            }
        }
    }

    /// Adds the irradiance of a lamp to `light`.
    #[inline(always)]
    fn add_light(&self, [lamp_x, lamp_y, lamp_z, strength]: &[PerPlant; 4], light: &mut [PerPlant; 3]) {
        let (x, y, z) =
            (minus(lamp_x, &self.middle[0]), minus(lamp_y, &self.middle[1]), minus(lamp_z, &self.middle[2]));
        let mut share = [0.0; LANES];
        for lane in 0..LANES {
            let distance2 = x[lane] * x[lane] + y[lane] * y[lane] + z[lane] * z[lane];
            let distance2 = distance2.max(LAMP_RADIUS * LAMP_RADIUS);
            share[lane] = strength[lane] / (distance2 * distance2.sqrt());
        }
        // One loop an axis: the compiler makes poor vectors of the three in one.
        for lane in 0..LANES {
            light[0][lane] += x[lane] * share[lane];
        }
        for lane in 0..LANES {
            light[1][lane] += y[lane] * share[lane];
        }
        for lane in 0..LANES {
            light[2][lane] += z[lane] * share[lane];
        }
    }

    /// Updates the response per unit of irradiance by its Taylor series, from the irradiance of the sub-step before.
    #[inline(always)]
    fn respond(&mut self, [exponent, second, third, fourth]: &[PerPlant; 4], seen: &mut Irradiance) {
        for lane in 0..LANES {
            let [x, y, z] = [self.light[0][lane], self.light[1][lane], self.light[2][lane]];
            let (now, last) = (x * x + y * y + z * z, self.intensity2[lane]);
            seen.slow[lane] = if (now - last).abs() < SERIES_LIMIT * last { seen.slow[lane] } else { 0.0 };
            seen.brightest[lane] = if now > seen.brightest[lane] { now } else { seen.brightest[lane] };
            let change = now / last - 1.0;
            let series =
                1.0 + second[lane] * change * (1.0 + third[lane] * change * (1.0 + fourth[lane] * change));
            self.response[lane] *= 1.0 + exponent[lane] * change * series;
            self.intensity2[lane] = now;
        }
    }

    /// Whether a response may saturate: the response, that is the irradiance times [`Self::response`], is near [`SATURATION`].
    #[inline(always)]
    fn is_bright(&self) -> bool {
        const NEAR: f64 = 0.8 * SATURATION;
        let mut is_bright = false;
        for lane in 0..LANES {
            let response = self.response[lane];
            is_bright |= response * response * self.intensity2[lane] > NEAR * NEAR;
        }
        is_bright
    }

    /// The response per unit of irradiance with saturation.
    #[inline(always)]
    fn effective<const SATURATES: bool>(&self, saturation: &PerPlant) -> PerPlant {
        let mut effective = self.response;
        if SATURATES && self.is_bright() {
            for lane in 0..LANES {
                effective[lane] = effective[lane].min(saturation[lane] / self.intensity2[lane].sqrt());
            }
        }
        effective
    }

    #[inline(always)]
    fn perceive_at_apex<const SATURATES: bool>(
        &self,
        of: &Constants,
        saturation: &PerPlant,
        light: &mut [PerPlant; 3],
    ) {
        let response = self.effective::<SATURATES>(saturation);
        for lane in 0..LANES {
            let apical = of.apical[lane] * response[lane];
            for (light, at_apex) in light.iter_mut().zip(&self.light) {
                light[lane] = apical * at_apex[lane];
            }
        }
    }

    #[inline(always)]
    fn bend<const SATURATES: bool>(&mut self, of: &Constants, saturation: &PerPlant, common: &Common) {
        let response = self.effective::<SATURATES>(saturation);
        self.bend_by(&response, of, common);
    }

    #[inline(always)]
    fn bend_by(&mut self, response: &PerPlant, of: &Constants, Common { light, steady }: &Common) {
        for lane in 0..LANES {
            let effective = of.local[lane] * response[lane];
            let x = effective * self.light[0][lane] + light[0][lane];
            let y = effective * self.light[1][lane] + light[1][lane];
            let z = effective * self.light[2][lane] + light[2][lane];
            let signal1 = x * self.d1[0][lane] + y * self.d1[1][lane] + z * self.d1[2][lane];
            let signal2 = x * self.d2[0][lane] + y * self.d2[1][lane] + z * self.d2[2][lane];
            let (light_share, gravity_share) = (of.light_share[lane], of.gravity_share[lane]);
            let stage1 = low_pass(self.light_stage1[lane], light_share, signal1);
            let stage2 = low_pass(self.light_stage2[lane], light_share, signal2);
            let light1 = low_pass(self.light_memory1[lane], light_share, stage1);
            let light2 = low_pass(self.light_memory2[lane], light_share, stage2);
            let gravity1 = low_pass(self.gravity_memory1[lane], gravity_share, self.d1[1][lane]);
            let gravity2 = low_pass(self.gravity_memory2[lane], gravity_share, self.d2[1][lane]);
            let motile_step = of.growth_step[lane] / (1.0 + self.motility_exp[lane]);
            let (to_light, to_gravity) = (of.sensitivity[0][lane], of.sensitivity[1][lane]);
            let rate1 = to_light * light1 + to_gravity * gravity1 + steady[0][lane];
            let rate2 = to_light * light2 + to_gravity * gravity2 + steady[1][lane];
            let straightening = of.straightening[lane];
            self.rest1[lane] += motile_step * (rate1 - straightening * self.k1[lane]);
            self.rest2[lane] += motile_step * (rate2 - straightening * self.k2[lane]);
            (self.light_stage1[lane], self.light_stage2[lane]) = (stage1, stage2);
            (self.light_memory1[lane], self.light_memory2[lane]) = (light1, light2);
            (self.gravity_memory1[lane], self.gravity_memory2[lane]) = (gravity1, gravity2);
        }
    }

    #[inline(always)]
    fn relax<const TOUCHES: bool>(&mut self, of: &Constants, above: &mut Above, is_pushed: &PerPlant) {
        let touch = WALL + TOUCH_CM;
        for lane in 0..LANES {
            let [x, y, z] = [self.middle[0][lane], self.middle[1][lane], self.middle[2][lane]];
            let mut moment_x = GRAVITY * (above.mass_z[lane] - z * above.mass[lane]);
            let mut moment_y = 0.0;
            let moment_z = GRAVITY * (x * above.mass[lane] - above.mass_x[lane]);
            if TOUCHES {
                let [push, push_x, push_y] = &mut above.push;
                let (pushed_x, pushed_y) =
                    (moment_x + (push_y[lane] - y * push[lane]), moment_y - (push_x[lane] - x * push[lane]));
                moment_x = if above.touches[lane] == 1.0 { pushed_x } else { moment_x };
                moment_y = if above.touches[lane] == 1.0 { pushed_y } else { moment_y };
                let own = WALL_STIFFNESS * (touch - z).max(0.0);
                let own = if is_pushed[lane] == 1.0 { own } else { 0.0 };
                push[lane] += own;
                push_x[lane] += own * x;
                push_y[lane] += own * y;
            }
            let (length, from_apex) = (self.length[lane], self.from_apex[lane]);
            let radius = of.radius_apex[lane] + of.widening[lane] * (from_apex / TAPER_CM).min(1.0);
            let own = DENSITY * PI * radius * radius * length;
            above.mass[lane] += own;
            above.mass_x[lane] += own * x;
            above.mass_z[lane] += own * z;

            let area = radius * radius;
            let compliance = 1.0 / (of.mature[lane] * self.modulus_ratio[lane].min(1.0) * area * area);
            let bending_moment1 =
                moment_x * self.d2[0][lane] + moment_y * self.d2[1][lane] + moment_z * self.d2[2][lane];
            let bending_moment2 =
                moment_x * self.d1[0][lane] + moment_y * self.d1[1][lane] + moment_z * self.d1[2][lane];
            let (k1, k2, relaxed_share) = (self.k1[lane], self.k2[lane], of.relaxed_share[lane]);
            self.k1[lane] = k1 + relaxed_share * (self.rest1[lane] + compliance * bending_moment1 - k1);
            self.k2[lane] = k2 + relaxed_share * (self.rest2[lane] - compliance * bending_moment2 - k2);

            let length = length + above.rate[lane] * self.growing[lane];
            let measured = above.length[lane] + 0.5 * length;
            let moved = measured - from_apex;
            above.length[lane] += length;
            above.longest[lane] = if length > above.longest[lane] { length } else { above.longest[lane] };
            self.growth_exp[lane] *= small_exp(moved * (1.0 / GROWTH_EDGE_CM));
            self.motility_exp[lane] *= small_exp(moved * of.per_edge[lane]);
            self.modulus_ratio[lane] *= small_exp(moved * of.per_modulus_length[lane]);
            (self.length[lane], self.from_apex[lane]) = (length, measured);
        }
    }
}

/// The differences of all lanes.
#[inline(always)]
fn minus(x: &PerPlant, y: &PerPlant) -> PerPlant {
    let mut result = [0.0; LANES];
    for lane in 0..LANES {
        result[lane] = x[lane] - y[lane];
    }
    result
}

/// 1 for plants that touch the wall and have a segment `i`, 0 for others.
#[inline(always)]
fn pushed(touches: &PerPlant, counts: &[usize; LANES], i: usize) -> PerPlant {
    let mut pushed = [0.0; LANES];
    for lane in 0..LANES {
        pushed[lane] = if i < counts[lane] { touches[lane] } else { 0.0 };
    }
    pushed
}

/// A low-pass filter after a sub-step.
#[inline(always)]
fn low_pass(memory: f64, share: f64, signal: f64) -> f64 {
    memory + share * (signal - memory)
}

/// [`RodLanes::begin_tick`] as a kernel.
struct Begin<'a> {
    rods: &'a mut RodLanes,
}

impl Kernel for Begin<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let RodLanes { rows, constants, are_disturbed, streams, draws, most, .. } = self.rods;
        let mut above = [0.0; LANES];
        for row in rows[..*most].iter_mut().rev() {
            row.refresh(constants, &mut above);
        }
        if are_disturbed.contains(&1.0) {
            let draws = &mut draws[..*most];
            streams.draw(draws);
            for (row, draws) in rows.iter_mut().zip(draws) {
                row.disturb(constants, are_disturbed, draws);
            }
        }
    }
}

/// The apex of each lane as a kernel: x, y and z.
struct Apexes<'a> {
    rods: &'a RodLanes,
}

impl Kernel for Apexes<'_> {
    type Result = [PerPlant; 3];

    #[inline(always)]
    fn run(self) -> [PerPlant; 3] {
        let mut rotation = self.rods.constants.base;
        let mut at = [[0.0; LANES]; 3];
        for row in &self.rods.rows[..self.rods.most] {
            row.pass(&mut rotation, &mut at);
        }
        at
    }
}

/// [`RodLanes::step`] as a kernel.
struct Substep<'a> {
    rods: &'a mut RodLanes,
    nutation: &'a [[f64; 2]; LANES],
}

impl Kernel for Substep<'_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Self { rods, nutation } = self;
        rods.rise();
        if rods.is_stale.contains(&true) {
            rods.respond_anew();
        }
        let saturates = rods.saturation.iter().any(|saturation| saturation.is_finite());
        let touches = rods.nearest.iter().any(|&nearest| nearest < WALL + TOUCH_CM);
        let has_guests = rods.guests.iter().any(Option::is_some);
        match (saturates, touches, has_guests) {
            (false, false, false) => rods.descend::<false, false, false>(nutation),
            (false, true, false) => rods.descend::<false, true, false>(nutation),
            (true, false, false) => rods.descend::<true, false, false>(nutation),
            (true, true, false) => rods.descend::<true, true, false>(nutation),
            (_, _, true) => rods.descend::<true, true, true>(nutation),
        }
    }
}
