//! Stems side by side during a tick: perception, differential growth, elastic relaxation and elongation.
//!
//! In: the rods of some plants, and what is held constant over the tick for each. Out: the rods after the tick. The idea: a
//! rod is a chain, and the processor waits for one segment before it computes the next. Here the same segment of all plants is
//! one [`Row`] of vector lanes. The text is generic over [`Real`]: one plant alone is the same with rows of one number.
//!
//! The integrator is a midpoint rule. Geometry, light and loads are those in the middle of a sub-step, to which the curvatures
//! are extrapolated; each stage of memory relaxes exponentially towards the mean of the stage before it. Motility, bending
//! stiffness and the share of elongation of a segment are those in the middle of the tick.
//!
//! Plants have different numbers of segments. Rows beyond the apex of a plant have length 0 and no weight, so they lie at its
//! apex and need no mask. Contacts with solids are few: they are computed plant by plant, between the two halves of a sub-step.

use core::f64::consts::PI;

use tropism::lamps::MAX_LAMPS;
use tropism::math::vector::{Vec3, cross};
use tropism::math::{self, Mask, Real};
use tropism::random::NoiseStream;
use tropism::simd::{Kernel, dispatch};

use super::MEGAPASCAL;
use super::contact::Chain;
use super::exposure;
use super::rotation::{self, Rotation};
use super::{Forcing, Rod, Segment, TAPER_CM};
use crate::individual::Individual;
use crate::view::WALL;

/// Most plants side by side: a vector of AVX2. Chosen by measurement: eight were not faster.
pub(crate) const LANES: usize = 4;
/// Rows that go through all loops of a pass before the next ones. Chosen by measurement: they fit into the fastest cache of the
/// processor.
const BLOCK: usize = 8;
/// Width of the logistic lower edge of the growing zone, in cm. Chosen by hand.
const GROWTH_EDGE_CM: f64 = 1.0;
/// Density of the stem, in g/cm^3. Chosen by hand: a little below water.
const DENSITY: f64 = 0.95;
/// Gravitational acceleration (standard gravity), in cm/s^2.
const GRAVITY: f64 = 981.0;
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
/// Relative change of squared irradiance up to which a Taylor series updates its power. Chosen: the fourth-order series then
/// errs by less than 1e-6.
const SERIES_LIMIT: f64 = 0.1;

/// The same segment of all plants. Vectors are towards d1 and d2, or x, y and z.
#[derive(Clone, Copy, Default)]
struct Row<R> {
    /// The state of the segments.
    state: Segment<R>,

    // Held over a tick.
    /// 0 in a rigid segment, else 1.
    mobility: R,
    /// Distance of the middle from the apex, in cm.
    from_apex: R,
    /// Elongation in a sub-step, in cm.
    elongation: R,
    /// Motility as a share, and then times the sub-step and the motor gain.
    motility: R,
    /// Mass of the segment and of its leaves, in g.
    mass: R,
    /// Curvature by a unit moment, in 1/cm for each dyn cm.
    compliance: R,

    // Working values of a sub-step.
    /// Material frame at the middle of the segment, in world coordinates, and its place, in cm.
    d1: [R; 3],
    d2: [R; 3],
    middle: [R; 3],
    /// Irradiance vector over the reference.
    light: [R; 3],
    /// Squared irradiance from which the Taylor series starts, inverted, and the response there per unit of irradiance.
    per_intensity2: R,
    first_response: R,
    /// Response per unit of irradiance.
    response: R,
    /// Mean of the rest curvature over the sub-step; then what the curvature relaxes by.
    relaxing: [R; 2],
}

/// How a segment turns its stimuli into a rate of bending: two low-pass stages of light, and a third one.
///
/// `first` follows `light L + gravity[0] g`, the second follows `first`, and the third follows `gravity[1] g + second * s` with
/// the second stage `s`; the rate is the sum of the second and the third. The bean of [`Tropism`](crate::Tropism) filters
/// gravity by the third stage; an [`Internodal`](crate::Internodal) one filters the sum of light and gravity twice, and subtracts
/// what the third stage holds of it.
#[derive(Clone, Copy, Default)]
pub(super) struct Filter<R> {
    light: R,
    gravity: [R; 2],
    second: R,
    /// Share of the way that a stage goes in a sub-step: the first and second, and the third.
    shares: [R; 2],
}

/// What is held constant over a tick for each plant.
#[derive(Clone, Copy, Default)]
struct Held<R> {
    /// Rotation and place of the lower end of the lowest row.
    base: [R; 4],
    base_at: [R; 3],
    /// Place and strength of the lit lamps of each plant; a plant with fewer has lamps of strength 0.
    lamps: [[R; 4]; MAX_LAMPS],
    /// Exponent of the squared irradiance, and the factors of its Taylor series.
    series: [R; 4],
    filter: Filter<R>,
    /// Weights of the light at the segment and at the apex.
    local: R,
    apical: R,
    bias: [R; 2],
    straightening: R,
    tip_mass: R,
    radius_apex: R,
    widening: R,
    /// Share of the way to elastic equilibrium that the stem goes in a sub-step.
    relaxed_share: R,
    /// Flexural rigidity of a mature stem of radius 1, in dyn cm^2.
    mature: R,
    /// Young's modulus at the apex over the mature one, and the distance over which it grows, inverted.
    modulus: R,
    per_modulus_length: R,
    growth_zone: R,
    motile_zone: R,
    per_edge: R,
    /// Elongation of the stem in a sub-step, in cm.
    elongation: R,
    growth_step: R,
    /// 1 over the sub-step, in 1/h, and the time by which the curvature is extrapolated, in h: half a sub-step, or 0 among
    /// solids, whose contacts are found where the stem is.
    per_dt: R,
    ahead: R,
    /// Half the number of sub-steps.
    half_tick: R,
    /// 1 where internodes decide on motility, else 0.
    is_internodal: R,
    /// Standard deviation of the noise of curvature over a tick, in 1/cm.
    noise: R,
}

impl Filter<f64> {
    /// The filter of a plant at sub-steps of `dt` hours.
    fn of(plant: &Individual, dt: f64) -> Self {
        let tropism = &plant.tropism;
        let [light, gravity] = [tropism.light, tropism.gravity];
        match &plant.internodal {
            None => {
                let shares =
                    [tropism.light_memory_h, tropism.gravity_memory_h].map(|time_h| share(dt, time_h));
                Self { light, gravity: [0.0, gravity], second: 0.0, shares }
            }
            Some(of) => {
                let shares = [of.summing_h, of.subtracting_h].map(|time_h| share(dt, time_h));
                Self { light, gravity: [gravity, 0.0], second: -of.subtracted, shares }
            }
        }
    }
}

impl<R: Real> Filter<R> {
    /// The rate of bending towards one direction by the light and gravity across it, in the middle of a sub-step.
    #[inline(always)]
    fn respond(&self, [first, second, third]: [&mut R; 3], light: R, gravity: R) -> R {
        let [share, last_share] = self.shares;
        let mean = relax(first, share, self.light * light + self.gravity[0] * gravity);
        let mean = relax(second, share, mean);
        mean + relax(third, last_share, self.gravity[1] * gravity + self.second * mean)
    }
}

/// Lets a stage go a share of the way to its target. Returns its mean meanwhile.
#[inline(always)]
fn relax<R: Real>(stage: &mut R, share: R, target: R) -> R {
    let before = *stage;
    let change = share * (target - before);
    *stage = before + change;
    before + change * 0.5
}

/// The share of the way to its equilibrium that a process of first order goes in `dt`.
fn share(dt: f64, time_h: f64) -> f64 {
    1.0 - math::exp(-dt / time_h)
}

impl<R: Real> Held<R> {
    /// Takes over what is held for the plant in a lane.
    fn set(&mut self, lane: usize, member: &Member<'_>) {
        let (forcing, base, dt) = (member.forcing, &member.rod.base, member.forcing.dt);
        let Individual { motility, tropism, stem, growth, internodal, .. } = member.plant;
        let filter = Filter::of(member.plant, dt);
        let exponent = 0.5 * (tropism.light_exponent - 1.0);
        let series = [exponent, 0.5 * (exponent - 1.0), (exponent - 2.0) / 3.0, (exponent - 3.0) / 4.0];
        let mut lamps = [[0.0; 4]; MAX_LAMPS];
        for (lamp, ([x, y, z], power)) in lamps.iter_mut().zip(lit(forcing)) {
            *lamp = [x, y, z, power * LAMP_DISTANCE * LAMP_DISTANCE];
        }
        let (noise, ahead) = (
            member.noise.map_or(0.0, |(_, sigma)| sigma),
            if member.rod.is_among_solids() { 0.0 } else { 0.5 * dt },
        );
        let put = |of_lanes: &mut [R], values: &[f64]| {
            of_lanes.iter_mut().zip(values).for_each(|(of_lanes, value)| of_lanes.set_lane(lane, *value));
        };
        put(&mut self.base, &base.rotation.0);
        put(&mut self.base_at, &base.at);
        put(self.lamps.as_flattened_mut(), lamps.as_flattened());
        put(&mut self.series, &series);
        put(&mut self.filter.gravity, &filter.gravity);
        put(&mut self.filter.shares, &filter.shares);
        put(&mut self.bias, &[tropism.bias_x, -tropism.bias_z]);
        for (of_lanes, value) in [
            (&mut self.filter.light, filter.light),
            (&mut self.filter.second, filter.second),
            (&mut self.local, 1.0 - tropism.apical),
            (&mut self.apical, tropism.apical),
            (&mut self.straightening, forcing.straightening),
            (&mut self.tip_mass, stem.tip_g),
            (&mut self.radius_apex, stem.radius_apex),
            (&mut self.widening, stem.radius_base - stem.radius_apex),
            (&mut self.relaxed_share, share(dt, stem.lag_h)),
            (&mut self.mature, stem.modulus_mature_mpa * MEGAPASCAL * PI / 4.0),
            (&mut self.modulus, stem.modulus_mpa / stem.modulus_mature_mpa),
            (&mut self.per_modulus_length, 1.0 / stem.modulus_length),
            (&mut self.growth_zone, growth.zone),
            (&mut self.motile_zone, forcing.zone),
            (&mut self.per_edge, 1.0 / motility.edge),
            (&mut self.elongation, dt * forcing.growth),
            (&mut self.growth_step, dt * forcing.gain),
            (&mut self.per_dt, if dt > 0.0 { 1.0 / dt } else { 0.0 }),
            (&mut self.half_tick, 0.5 * f64::from(forcing.substeps)),
            (&mut self.is_internodal, f64::from(u8::from(internodal.is_some()))),
            (&mut self.ahead, ahead),
            (&mut self.noise, noise),
        ] {
            of_lanes.set_lane(lane, value);
        }
    }
}

/// The lit lamps: place and power.
fn lit(forcing: &Forcing) -> impl Iterator<Item = (Vec3, f64)> {
    forcing.lit().map(|number| (forcing.lamps[number], forcing.powers[number]))
}

/// A plant whose rod is integrated over a tick.
pub(crate) struct Member<'a> {
    pub(crate) rod: &'a mut Rod,
    pub(crate) plant: &'a Individual,
    pub(crate) forcing: &'a Forcing,
    /// Noise of curvature: its stream of this tick, and its standard deviation, in 1/cm.
    pub(crate) noise: Option<(NoiseStream, f64)>,
}

/// The rods of up to [`Real::LANES`] plants during a tick.
pub(crate) struct Chains<R> {
    /// The segments, and at least one row beyond.
    rows: Vec<Row<R>>,
    /// Number of segments of the plant that has most.
    most: usize,
    held: Box<Held<R>>,
    /// Number of lamps in [`Held::lamps`] that are lit for some plant.
    lit: usize,
    /// Share of the light of each lamp in [`Held::lamps`] that reaches each row; empty where all light reaches all rows.
    exposures: Vec<[R; MAX_LAMPS]>,
    streams: [NoiseStream; LANES],
    /// Number of segments of each plant below its lowest row.
    below: [u32; LANES],
    /// Working memory for the contacts of one plant.
    chain: Option<Box<Chain>>,
}

impl<R: Real> Chains<R> {
    pub(crate) fn new() -> Self {
        let streams = [NoiseStream::new(0, tropism::random::Purpose::SegmentNoise, [0; 3]); LANES];
        Self {
            rows: Vec::new(),
            most: 0,
            held: Box::default(),
            lit: 0,
            exposures: Vec::new(),
            streams,
            below: [0; LANES],
            chain: None,
        }
    }

    /// Integrates the rods of all members over a tick: as many sub-steps as the first member has. Long segments split before.
    ///
    /// `nutation` gives the rate of curvature of circumnutation of each plant in a sub-step towards d1 and d2, in 1/cm/h.
    pub(crate) fn advance(&mut self, members: &mut [Member<'_>], mut nutation: impl FnMut() -> [R; 2]) {
        self.load(members);
        run::<R, _>(Begin { chains: self });
        let has_contacts = members.iter().any(|member| member.rod.contact.is_some());
        for substep in 0..members[0].forcing.substeps {
            run::<R, _>(Substep { chains: self, nutation: nutation(), is_first: substep == 0 });
            if has_contacts {
                self.press(members);
            }
        }
        self.store(members);
    }

    /// Puts rods into lanes. Lanes without a plant repeat the first one; nothing comes of them.
    fn load(&mut self, members: &mut [Member<'_>]) {
        for member in members.iter_mut() {
            member.rod.split();
            member.rod.stiffen(member.plant.stem.rigid_cm);
        }
        self.most = members.iter().map(|member| member.rod.segments.len()).max().unwrap_or(0);
        let wanted = self.rows.len().max(self.most + 1);
        self.rows.resize(wanted, Row::default());
        self.lit = members.iter().map(|member| lit(member.forcing).count()).max().unwrap_or(0);
        for lane in 0..R::LANES {
            let member = members.get(lane).unwrap_or(&members[0]);
            let rod = &*member.rod;
            self.held.set(lane, member);
            self.below[lane] = rod.foot.len() as u32;
            if let Some((stream, _)) = member.noise {
                self.streams[lane] = stream;
            }
        }
        let beyond = Segment::default();
        for (i, row) in self.rows[..=self.most].iter_mut().enumerate() {
            for lane in 0..R::LANES {
                let member = members.get(lane).unwrap_or(&members[0]);
                let segment = member.rod.segments.get(i).unwrap_or(&beyond);
                for (of_lanes, value) in row.state.numbers_mut().into_iter().zip(segment.numbers()) {
                    of_lanes.set_lane(lane, value);
                }
                row.mass.set_lane(
                    lane,
                    if i + member.rod.foot.len() == member.rod.leaf { member.forcing.leaf_mass } else { 0.0 },
                );
                row.mobility.set_lane(lane, if i < member.rod.rigid { 0.0 } else { 1.0 });
            }
        }
        self.expose(members);
        for (lane, member) in members.iter_mut().enumerate() {
            if let Some(internodal) = &member.plant.internodal {
                let put = |i: usize, motility| self.rows[i].motility.set_lane(lane, motility);
                member.rod.mature(internodal, member.forcing.age_h, put);
            }
        }
    }

    /// Finds how much of each lamp reaches each row, where lamps have cones or solids cast shadows. Held over the tick.
    fn expose(&mut self, members: &[Member<'_>]) {
        self.exposures.clear();
        if members.iter().all(|member| !exposure::is_limited(member.forcing)) {
            return;
        }
        self.exposures.resize(self.most + 1, [R::splat(1.0); MAX_LAMPS]);
        for (lane, member) in members.iter().enumerate() {
            let middles = exposure::middles(member.rod);
            for (i, row) in self.exposures.iter_mut().enumerate() {
                // Rows beyond the apex lie at the apex.
                let middle = middles[i.min(middles.len() - 1)];
                let shares = exposure::shares(member.rod, member.forcing, middle);
                for (of_lanes, share) in row.iter_mut().zip(shares) {
                    of_lanes.set_lane(lane, share);
                }
            }
        }
    }

    /// Puts lanes back into their rods.
    fn store(&self, members: &mut [Member<'_>]) {
        for (i, row) in self.rows[..self.most].iter().enumerate() {
            for (lane, member) in members.iter_mut().enumerate() {
                if let Some(segment) = member.rod.segments.get_mut(i) {
                    for (value, of_lanes) in segment.numbers_mut().into_iter().zip(row.state.numbers()) {
                        *value = of_lanes.lane(lane);
                    }
                }
            }
        }
    }

    /// Adds the forces of solids to the sub-step, plant by plant.
    #[inline(never)]
    fn press(&mut self, members: &mut [Member<'_>]) {
        let chain = self.chain.get_or_insert_with(|| Box::new(Chain::new()));
        for (lane, Member { rod, plant, forcing, .. }) in members.iter_mut().enumerate() {
            let n = rod.segments.len();
            let Some(contact) = &mut rod.contact else { continue };
            if !contact.is_due() {
                continue;
            }
            for (i, row) in self.rows[..n].iter().enumerate() {
                row.copy_to(chain, i, lane, self.held.relaxed_share.lane(lane));
            }
            if !contact.press(rod.rigid..n, chain, plant, forcing.dt) {
                continue;
            }
            let [actual1, actual2, rest1, rest2] = contact.bending();
            for (i, row) in self.rows[..actual1.len()].iter_mut().enumerate() {
                let add =
                    |of_lanes: &mut R, change: f64| of_lanes.set_lane(lane, of_lanes.lane(lane) + change);
                add(&mut row.state.curvature[0], actual1[i]);
                add(&mut row.state.curvature[1], actual2[i]);
                add(&mut row.state.rest[0], rest1[i]);
                add(&mut row.state.rest[1], rest2[i]);
            }
        }
    }

    /// From the base up: frames and places in the middle of the sub-step, irradiance, and the response to it.
    ///
    /// Loops are short, so that the processor begins the next row before it has ended this one.
    #[inline(always)]
    fn rise(&mut self, is_first: bool) -> R {
        let zero = R::splat(0.0);
        let Self { rows, held, lit, exposures, most, .. } = self;
        let rows = &mut rows[..=*most];
        let (mut rotation, mut at) = (Rotation(held.base), held.base_at);
        let (mut drift, mut brightest, mut nearest) = (zero, zero, R::splat(f64::INFINITY));
        let mut halfway = [Rotation(held.base); BLOCK];
        for (number, block) in rows.chunks_mut(BLOCK).enumerate() {
            for (row, halfway) in block.iter().zip(&mut halfway) {
                [*halfway, rotation] = rotation.through(row.curvature_ahead(held), row.state.length);
            }
            for (row, halfway) in block.iter_mut().zip(halfway) {
                row.orient(halfway, &mut at);
                nearest = nearest.min(row.middle[2]);
            }
            if exposures.is_empty() {
                for row in block.iter_mut() {
                    row.illuminate(&held.lamps[..*lit], None);
                }
            } else {
                for (row, exposure) in block.iter_mut().zip(&exposures[number * BLOCK..]) {
                    row.illuminate(&held.lamps[..*lit], Some(exposure));
                }
            }
            for row in block.iter_mut() {
                let (change, intensity2) = row.respond(&held.series);
                (drift, brightest) = (drift.max(change), brightest.max(intensity2));
            }
        }
        if is_first || drift.gt(R::splat(SERIES_LIMIT)).any() {
            let is_stale = if is_first { zero.eq(zero) } else { drift.gt(R::splat(SERIES_LIMIT)) };
            for row in rows.iter_mut() {
                row.respond_anew(is_stale, held.series[0]);
            }
        }
        if brightest.gt(R::splat(SATURATION)).any() {
            for row in rows.iter_mut() {
                row.saturate();
            }
        }
        nearest
    }

    /// From the apex down: perception, differential growth, elastic relaxation and elongation.
    #[inline(always)]
    fn descend<const TOUCHES: bool>(&mut self, nutation: [R; 2]) {
        let Self { rows, held, most, .. } = self;
        let held = &**held;
        let apex = &rows[*most];
        let apical = held.apical * apex.response;
        let light = apex.light.map(|axis| apical * axis);
        let steady = [nutation[0] + held.bias[0], nutation[1] + held.bias[1]];
        let mut above = Loads {
            mass: held.tip_mass,
            mass_x: held.tip_mass * apex.middle[0],
            mass_z: held.tip_mass * apex.middle[2],
            push: [R::splat(0.0); 3],
        };
        for block in rows[..*most].rchunks_mut(BLOCK) {
            for row in block.iter_mut() {
                row.bend(held, light, steady);
            }
            for row in block.iter_mut().rev() {
                row.relax::<TOUCHES>(held, &mut above);
            }
        }
    }
}

/// Sums over the segments above.
struct Loads<R> {
    mass: R,
    mass_x: R,
    mass_z: R,
    /// Force of the wall, and its moments.
    push: [R; 3],
}

impl<R: Real> Row<R> {
    /// Copies what contacts read of the plant in a lane.
    fn copy_to(&self, chain: &mut Chain, i: usize, lane: usize, relaxed_share: f64) {
        let of_lane = |axes: [R; 3]| axes.map(|axis| axis.lane(lane));
        let (d1, d2) = (of_lane(self.d1), of_lane(self.d2));
        for (values, vector) in [
            (&mut chain.d1, d1),
            (&mut chain.d2, d2),
            (&mut chain.along, cross(d1, d2)),
            (&mut chain.middle, of_lane(self.middle)),
        ] {
            values.iter_mut().zip(vector).for_each(|(values, value)| values[i] = value);
        }
        // The segment has grown since.
        chain.length[i] = self.state.length.lane(lane) - self.elongation.lane(lane);
        chain.from_apex[i] = self.from_apex.lane(lane);
        chain.elongation[i] = self.elongation.lane(lane);
        chain.softness[i] = relaxed_share * self.compliance.lane(lane);
        chain.relaxing[0][i] = self.relaxing[0].lane(lane);
        chain.relaxing[1][i] = self.relaxing[1].lane(lane);
    }

    /// The curvature in the middle of the sub-step.
    #[inline(always)]
    fn curvature_ahead(&self, held: &Held<R>) -> [R; 2] {
        [0, 1].map(|towards| self.state.curvature[towards] + held.ahead * self.state.bending[towards])
    }

    /// Frame and place from the rotation at the middle of the segments; `at` goes from their lower ends to the upper ones.
    #[inline(always)]
    fn orient(&mut self, halfway: Rotation<R>, at: &mut [R; 3]) {
        let [d1, d2, along] = halfway.frame();
        (self.d1, self.d2) = (d1, d2);
        self.middle = rotation::pass(at, along, self.state.length);
    }

    /// Irradiance: lamps are point sources (inverse-square law) whose irradiance vectors add up. `exposure` is the share of
    /// each lamp that cones and shadows leave.
    #[inline(always)]
    fn illuminate(&mut self, lamps: &[[R; 4]], exposure: Option<&[R; MAX_LAMPS]>) {
        self.light = [R::splat(0.0); 3];
        for (number, [lamp_x, lamp_y, lamp_z, strength]) in lamps.iter().enumerate() {
            let (x, y, z) = (*lamp_x - self.middle[0], *lamp_y - self.middle[1], *lamp_z - self.middle[2]);
            let distance2 = (x * x + y * y + z * z).max(R::splat(LAMP_RADIUS * LAMP_RADIUS));
            let mut share = *strength / (distance2 * distance2.sqrt());
            if let Some(exposure) = exposure {
                share *= exposure[number];
            }
            self.light[0] += x * share;
            self.light[1] += y * share;
            self.light[2] += z * share;
        }
    }

    /// The response per unit of irradiance by its Taylor series. Returns how far it goes, and the squared irradiance.
    #[inline(always)]
    fn respond(&mut self, [exponent, second, third, fourth]: &[R; 4]) -> (R, R) {
        let [x, y, z] = self.light;
        let intensity2 = x * x + y * y + z * z;
        let change = intensity2 * self.per_intensity2 - 1.0;
        let series = (*fourth * change + 1.0) * *third * change + 1.0;
        let series = series * *second * change + 1.0;
        self.response = self.first_response * (series * *exponent * change + 1.0);
        // In the dark there is nothing to respond to.
        (R::select(intensity2.gt(R::splat(0.0)), change.abs(), R::splat(0.0)), intensity2)
    }

    /// Starts the series anew where it is stale: the response to an irradiance I is I^q, so I^(q-1) per unit of irradiance.
    #[inline(always)]
    fn respond_anew(&mut self, is_stale: R::Mask, exponent: R) {
        let zero = R::splat(0.0);
        let [x, y, z] = self.light;
        let intensity2 = x * x + y * y + z * z;
        let is_lit = intensity2.gt(zero);
        let bright = R::select(is_lit, intensity2, R::splat(1.0));
        let response = R::select(is_lit, math::exp(exponent * math::ln(bright)), zero);
        let per_intensity2 = R::select(is_lit, R::splat(1.0) / bright, zero);
        self.first_response = R::select(is_stale, response, self.first_response);
        self.per_intensity2 = R::select(is_stale, per_intensity2, self.per_intensity2);
        self.response = R::select(is_stale, response, self.response);
    }

    /// Bounds the response near a lamp.
    #[inline(always)]
    fn saturate(&mut self) {
        let [x, y, z] = self.light;
        self.response = self.response.min(R::splat(SATURATION) / (x * x + y * y + z * z).sqrt());
    }

    /// Perception of light and gravity, projected on the cross-section (sine law), and differential growth: the rest curvature
    /// changes by phototropism, gravitropism, straightening, circumnutation and bias. `at_apex` is the light that all segments
    /// perceive from the apex.
    #[inline(always)]
    fn bend(&mut self, held: &Held<R>, at_apex: [R; 3], steady: [R; 2]) {
        let effective = held.local * self.response;
        let seen = [0, 1, 2].map(|axis| effective * self.light[axis] + at_apex[axis]);
        let curvature = self.curvature_ahead(held);
        for (towards, direction) in [self.d1, self.d2].into_iter().enumerate() {
            let across = seen[0] * direction[0] + seen[1] * direction[1] + seen[2] * direction[2];
            let stages = self.state.memory.each_mut().map(|stage| &mut stage[towards]);
            let response = held.filter.respond(stages, across, direction[1]);
            let rate = response + steady[towards] - held.straightening * curvature[towards];
            let change = self.motility * rate;
            self.relaxing[towards] = self.state.rest[towards] + change * 0.5;
            self.state.rest[towards] += change;
        }
    }

    /// Elastic rod: the curvature relaxes to the rest curvature plus moment over flexural rigidity (overdamped). The moment is
    /// that of all distal loads: bud, leaves, stem and wall. Then the segment elongates.
    #[inline(always)]
    fn relax<const TOUCHES: bool>(&mut self, held: &Held<R>, above: &mut Loads<R>) {
        let [x, y, z] = self.middle;
        let moment_x = (above.mass_z - z * above.mass) * GRAVITY;
        let moment_z = (x * above.mass - above.mass_x) * GRAVITY;
        let about = |direction: [R; 3]| moment_x * direction[0] + moment_z * direction[2];
        let mut moments = [about(self.d2), -about(self.d1)];
        above.mass += self.mass;
        above.mass_x += self.mass * x;
        above.mass_z += self.mass * z;
        if TOUCHES {
            let [push, push_x, push_y] = &mut above.push;
            let (wall_x, wall_y) = (*push_y - y * *push, x * *push - *push_x);
            moments[0] += wall_x * self.d2[0] + wall_y * self.d2[1];
            moments[1] -= wall_x * self.d1[0] + wall_y * self.d1[1];
            // The wall does not push rows beyond the apex.
            let zero = R::splat(0.0);
            let dent = (R::splat(WALL + TOUCH_CM) - z).max(zero);
            let own = R::select(self.state.length.gt(zero), dent * WALL_STIFFNESS, zero);
            *push += own;
            *push_x += own * x;
            *push_y += own * y;
        }
        for (towards, moment) in moments.into_iter().enumerate() {
            let target = self.relaxing[towards] + self.compliance * moment;
            let change = held.relaxed_share * (target - self.state.curvature[towards]);
            self.relaxing[towards] = change;
            self.state.curvature[towards] += change;
            self.state.bending[towards] = change * held.per_dt;
        }
        self.state.length += self.elongation;
    }
}

/// Runs a kernel; vector instructions are of use to lanes alone.
fn run<R: Real, K: Kernel>(kernel: K) -> K::Result {
    if R::LANES == 1 { kernel.run() } else { dispatch(kernel) }
}

/// The beginning of a tick: what is held over it for each segment, and the noise of curvature.
struct Begin<'a, R> {
    chains: &'a mut Chains<R>,
}

impl<R: Real> Kernel for Begin<'_, R> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Chains { rows, held, most, streams, below, .. } = self.chains;
        let (zero, held) = (R::splat(0.0), &**held);
        // Elongation is distributed by the logistic growing zone.
        let (mut above, mut weight) = (zero, zero);
        for row in rows[..*most].iter_mut().rev() {
            let from_apex = above + row.state.length * 0.5;
            above += row.state.length;
            let share = math::logistic((held.growth_zone - from_apex) * (1.0 / GROWTH_EDGE_CM));
            row.elongation = row.state.length * share * row.mobility;
            weight += row.elongation;
        }
        let rate = held.elongation / weight;
        let mut above = zero;
        for (number, row) in rows[..*most].iter_mut().enumerate().rev() {
            row.elongation *= rate;
            let length = row.state.length + row.elongation * held.half_tick;
            row.from_apex = above + length * 0.5;
            above += length;
            let own = math::logistic((held.motile_zone - row.from_apex) * held.per_edge);
            let motility = R::select(held.is_internodal.gt(zero), row.motility, own) * row.mobility;
            for (towards, rest) in row.state.rest.iter_mut().enumerate() {
                let numbered = |lane| 2 * (below[lane] + number as u32) + towards as u32;
                let drawn = R::from_fn(|lane| streams[lane].normal(numbered(lane)));
                *rest += motility * held.noise * drawn;
            }
            row.motility = motility * held.growth_step;

            let radius =
                held.radius_apex + held.widening * (row.from_apex * (1.0 / TAPER_CM)).min(R::splat(1.0));
            let area = radius * radius;
            row.mass += area * length * (DENSITY * PI);
            let stiffening = held.modulus * math::exp(row.from_apex * held.per_modulus_length);
            row.compliance = row.mobility / (held.mature * stiffening.min(R::splat(1.0)) * area * area);
        }
    }
}

/// A sub-step as a kernel: the curvatures relax without contacts.
struct Substep<'a, R> {
    chains: &'a mut Chains<R>,
    nutation: [R; 2],
    is_first: bool,
}

impl<R: Real> Kernel for Substep<'_, R> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Self { chains, nutation, is_first } = self;
        let nearest = chains.rise(is_first);
        if nearest.lt(R::splat(WALL + TOUCH_CM)).any() {
            chains.descend::<true>(nutation);
        } else {
            chains.descend::<false>(nutation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Internodal;

    /// The response to a pulse of a minute, minute after minute, per minute of pulse.
    fn kernel(of: &Internodal) -> Vec<f64> {
        const SUBSTEPS: u32 = 20;
        let mut plant = Individual { internodal: Some(of.clone()), ..Individual::default() };
        (plant.tropism.light, plant.tropism.gravity) = (0.0, 1.0);
        let filter = Filter::of(&plant, 1.0 / 60.0 / f64::from(SUBSTEPS));
        let mut memory = [0.0; 3];
        let minute = |minute: u32| {
            let stimulus = if minute == 0 { 1.0 } else { 0.0 };
            let responses = (0..SUBSTEPS).map(|_| filter.respond(memory.each_mut(), 0.0, stimulus));
            responses.sum::<f64>() / f64::from(SUBSTEPS)
        };
        (0..600).map(minute).collect()
    }

    #[test]
    fn the_internodal_kernel_has_a_positive_and_then_a_negative_lobe() {
        let of = Internodal::default();
        let kernel = kernel(&of);
        let turn = kernel.iter().position(|response| *response < 0.0).unwrap();
        assert!((15..60).contains(&turn), "{turn} min");
        let [sum, difference] = [&kernel[..turn], &kernel[turn..]].map(|lobe| lobe.iter().sum::<f64>());
        assert!(kernel[turn..].iter().all(|response| *response <= 0.0));
        assert!(difference < -0.3 * sum, "{sum} and {difference}");
        // What a lasting stimulus is worth.
        assert!((sum + difference - (1.0 - of.subtracted)).abs() < 0.01, "{}", sum + difference);
    }
}
