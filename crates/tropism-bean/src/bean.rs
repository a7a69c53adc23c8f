//! A virtual bean: elongation, phototropism, gravitropism, autotropic straightening, circumnutation, sagging and leaves.
//!
//! In: the power of each lamp, and time. Out: the visible shape of the plant ([`Pose`]). The idea: a growing elastic rod in
//! three dimensions. At each point, differential growth changes the curvature by
//!
//! `dk/dt = motility (nu light + beta gravity - gamma k + nutation + bias) + noise`
//!
//! with light and gravity projected on the cross-section of the stem. `gamma k` is autotropic straightening (proprioception).
//! Ornstein-Uhlenbeck processes modulate motility and elongation. The parameters are partly published and partly tuned
//! ([`Species`](super::Species)); results are virtual. A second physiology on the same stem has other equations
//! ([`Internodal`](super::Internodal)). The bean shares nothing with the tip-motion model, which is built from its
//! photographs.
//!
//! Coordinates: x to the right, y up, z towards the camera; cm, h and rad.
//!
//! # References
//! Those of [`Individual`], whose fields name the source of each parameter.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use tropism::lamps::{Layout, MAX_LAMPS};
use tropism::lighting::{Beam, Lighting};
use tropism::math::vector::Vec3;
use tropism::math::{self, Real};
use tropism::obstacle::Solid;
use tropism::random::NoiseStream;

use super::individual::{FILE_RATES_PER_H, Individual};
use super::internodal::Clock;
use super::noise::{Gains, MAX_TICK_MIN, Pause, PlantNoise};
use super::pose::{Leaf, Node, Pose};
use super::rod::{self, Chains, Forcing, LANES, Member, Rod};
use super::solid::ContactPoint;

/// Early elongation of a grown seedling, as a multiple of `growth.rate`. Tuned by hand on the paper's mean growth.
pub const EARLY_GROWTH: f64 = 1.13;
/// Time scale of the logistic lengthening of the motile zone, in h. Tuned by hand: the paper's fast phase from step 300.
const ZONE_GROWTH_H: f64 = 4.0;
/// Leaf length before unfolding as a share of the final length, delay of leaf growth after unfolding, and its time scale,
/// in h. Chosen by hand.
const LEAF: (f64, f64, f64) = (0.18, 14.0, 5.0);
/// Delay of spreading after the leaves begin to unfold, and its time scale, in h. Chosen by hand.
const SPREADING: (f64, f64) = (3.0, 1.0);
/// Age at which cotyledons begin to wither, as a share of the age at which they fall. Chosen by hand.
const WITHERING: f64 = 0.3;
/// Mean angle of a leaf blade to the horizontal, in rad. Chosen by hand.
const LEAF_ANGLE: f64 = -0.35;

/// A virtual bean plant.
///
/// ```
/// use tropism_bean::{Bean, Species};
/// let mut bean = Bean::new(Species::default().draw(1, 1.0), 1);
/// for _ in 0..72 {
///     bean.advance(&[0.0, 1.0], 5.0); // six hours of light from the right
/// }
/// assert!(bean.apex()[0] > 0.0 && bean.length() > 4.0);
/// ```
#[derive(Clone, Debug)]
pub struct Bean {
    pub(crate) plant: Individual,
    pub(crate) rod: Rod,
    /// Places of the lamps, in cm, and their number.
    lamps: [Vec3; MAX_LAMPS],
    lamp_count: usize,
    /// Share of the light of each lamp to which the plant bends.
    shares: [f64; MAX_LAMPS],
    /// Cones of the lamps; a lamp without one shines all around.
    beams: [Option<Beam>; MAX_LAMPS],
    /// Whether solids cast shadows.
    is_shaded: bool,
    pub(crate) age_h: f64,
    /// Phase of circumnutation, in rad.
    phase: f64,
    /// Age at which the leaves begin to unfold, in h; infinite without events.
    unfold_h: f64,
    pub(crate) noise: Option<PlantNoise>,
    /// The drifting speed of nutation; `None` if it is constant.
    clock: Option<Clock>,
    /// Sub-step of the integration that was asked for, in s.
    asked_substep_s: Option<f64>,
}

impl Bean {
    /// Default sub-step of the integration, in s: the coarsest of up to a minute that errs by less than 0.02 cm
    /// (docs/validation/bean-integration.md).
    pub const SUBSTEP_S: f64 = 60.0;
    /// That of a bean among solids, in s. Chosen: so far no stem moves through a contact.
    pub const SUBSTEP_AMONG_SOLIDS_S: f64 = 15.0;

    /// A seedling under the paper's lamps; `seed` selects its events, fluctuation and noise.
    #[must_use]
    pub fn new(individual: Individual, seed: u64) -> Self {
        let mut noise = PlantNoise::new(&individual, seed);
        let phase = noise.phase();
        let unfold_h = individual.leaves.unfold_h;
        let clock = individual.internodal.as_ref().map(|internodal| Clock::new(internodal, seed));
        Self { phase, unfold_h, noise: Some(noise), clock, ..Self::noise_free(individual) }
    }

    /// A seedling without noise and events: gains are constant, it never pauses, and its leaves stay folded.
    #[must_use]
    pub fn noise_free(individual: Individual) -> Self {
        Self {
            rod: Rod::seedling(&individual),
            plant: individual,
            lamps: [[0.0; 3]; MAX_LAMPS],
            lamp_count: 0,
            shares: [0.0; MAX_LAMPS],
            beams: [None; MAX_LAMPS],
            is_shaded: false,
            age_h: 0.0,
            phase: 0.0,
            unfold_h: f64::INFINITY,
            noise: None,
            clock: None,
            asked_substep_s: None,
        }
        .under(&Layout::default())
    }

    /// The same bean under the lamps of `layout`; without this, under the paper's two.
    #[must_use]
    pub fn under(mut self, layout: &Layout) -> Self {
        self.lamp_count = layout.len();
        for (number, lamp) in layout.lamps().iter().enumerate() {
            self.lamps[number] = lamp.at;
            self.shares[number] = self.plant.colours.share(lamp.colour);
        }
        self
    }

    /// The same bean under lamps that shine in cones, in the order of the layout; a lamp without a cone, as all are without
    /// this, shines all around.
    ///
    /// ```
    /// use tropism::lighting::Beam;
    /// use tropism_bean::{Bean, Individual};
    /// let facing = |x| Some(Beam { facing: [x, -0.7, 0.2], half_angle_deg: 20.0 });
    /// let grown = |right| {
    ///     let mut bean = Bean::noise_free(Individual::default()).with_beams(&[None, facing(right)]);
    ///     bean.advance(&[0.0, 1.0], 12.0 * 60.0);
    ///     bean.apex()[0]
    /// };
    /// assert!(grown(-1.0) > 1.0 && grown(1.0) < 0.5); // the right lamp shines at the plant, and away from it
    /// ```
    ///
    /// # Panics
    /// If [`Beam::check`] refuses a cone, or there are more cones than lamps.
    #[must_use]
    pub fn with_beams(mut self, beams: &[Option<Beam>]) -> Self {
        assert!(
            beams.len() <= self.lamp_count,
            "found {} cones, wanted {} at most",
            beams.len(),
            self.lamp_count
        );
        for (place, beam) in self.beams.iter_mut().zip(beams) {
            if let Some(Err(error)) = beam.as_ref().map(Beam::check) {
                panic!("{error}");
            }
            *place = *beam;
        }
        self
    }

    /// The same bean in the shadow of the solids of [`Self::among`]; without this they let light through.
    ///
    /// ```
    /// use tropism::geometry::Point;
    /// use tropism::obstacle::Obstacle;
    /// use tropism_bean::{Bean, Individual};
    /// let wall = Obstacle::Box { corners: [Point::new(9.0, 0.0), Point::new(10.0, 60.0)] };
    /// let bean = || Bean::noise_free(Individual::default()).among(&[wall.into()]);
    /// let reached = |mut bean: Bean| {
    ///     bean.advance(&[0.0, 1.0], 12.0 * 60.0);
    ///     bean.apex()[0]
    /// };
    /// assert!(reached(bean()) > 1.0 && reached(bean().in_shadow()) < 0.5); // the wall stands before the right lamp
    /// ```
    #[must_use]
    pub fn in_shadow(self) -> Self {
        Self { is_shaded: true, ..self }
    }

    /// The same bean among solids, through which its stem does not pass; without this, with the back wall alone.
    ///
    /// The stem slides on them with friction (coefficient 0.4). Leaves do not touch them. Docs: `docs/explanation/contact.md`.
    ///
    /// ```
    /// use tropism::geometry::Point;
    /// use tropism_bean::{Bean, Individual};
    /// use tropism::obstacle::Obstacle;
    /// let disc = Obstacle::Disc { centre: Point::new(4.0, 8.0), radius_cm: 1.0 };
    /// let mut bean = Bean::noise_free(Individual::default()).among(&[disc.into()]);
    /// bean.advance(&[0.0, 1.0], 30.0 * 60.0);
    /// assert!(!bean.contacts().is_empty());
    /// assert!(bean.pose().stem.iter().all(|node| Point::new(node.at[0], node.at[1]).distance(Point::new(4.0, 8.0)) > 1.0));
    /// ```
    ///
    /// # Panics
    /// If [`Solid::check`] refuses a solid.
    #[must_use]
    pub fn among(mut self, solids: &[Solid]) -> Self {
        for (number, solid) in solids.iter().enumerate() {
            if let Err(error) = solid.check() {
                panic!("solid {number}: {error}");
            }
        }
        self.rod.set_solids(solids);
        self
    }

    /// The same bean with another coefficient of friction on the solids of [`Self::among`].
    ///
    /// # Panics
    /// If the coefficient is negative or not finite.
    #[must_use]
    pub fn with_friction(mut self, coefficient: f64) -> Self {
        assert!(
            coefficient >= 0.0 && coefficient.is_finite(),
            "found a coefficient of friction of {coefficient}, wanted 0 or more"
        );
        self.rod.set_friction(coefficient);
        self
    }

    /// Where the stem pressed on solids in the last sub-step.
    #[must_use]
    pub fn contacts(&self) -> Vec<ContactPoint> {
        self.rod.contacts()
    }

    /// The same bean with another sub-step of the integration, in s.
    ///
    /// # Panics
    /// Unless `seconds` is between 0.1 and 60.
    #[must_use]
    pub fn with_substep(self, seconds: f64) -> Self {
        assert!((0.1..=60.0).contains(&seconds), "found a sub-step of {seconds} s, wanted 0.1 to 60 s");
        Self { asked_substep_s: Some(seconds), ..self }
    }

    /// The same bean with another phase of circumnutation, in rad.
    pub(crate) fn with_phase(self, phase: f64) -> Self {
        Self { phase, ..self }
    }

    /// Grows for `minutes` under lamps of the given powers, 0 to 1, in the order of the layout; further lamps are dark.
    ///
    /// Power 1 gives 6 umol/m^2/s at 35 cm. Of the light of each lamp the plant bends to the share of its colour,
    /// [`Colours`](super::Colours).
    ///
    /// # Panics
    /// If a power is not between 0 and 1 or belongs to no lamp, or if the time is negative or not finite.
    pub fn advance(&mut self, lamp_powers: &[f64], minutes: f64) {
        let powers = self.checked_powers(lamp_powers);
        let (ticks, tick_h) = ticks_of(minutes);
        let mut chains: Chains<f64> = Chains::new();
        for _ in 0..ticks {
            tick_together(&mut chains, &mut [&mut *self], &[powers], tick_h);
            self.rod.set_down();
        }
    }

    /// Grows for `minutes` under any lighting: [`Self::advance`] with its powers, of which level 255 is `power`.
    ///
    /// # Panics
    /// As [`Self::advance`].
    pub fn advance_under(&mut self, lighting: Lighting, power: f64, minutes: f64) {
        self.advance(&lighting.powers().map(|share| share * power), minutes);
    }

    /// The sub-step of the integration, in s.
    pub(crate) fn substep_s(&self) -> f64 {
        let usual = if self.rod.is_among_solids() { Self::SUBSTEP_AMONG_SOLIDS_S } else { Self::SUBSTEP_S };
        self.asked_substep_s.unwrap_or(usual)
    }

    /// The powers of all lamps, as the plant answers to them.
    ///
    /// # Panics
    /// If a power is not between 0 and 1 or belongs to no lamp.
    pub(crate) fn checked_powers(&self, lamp_powers: &[f64]) -> [f64; MAX_LAMPS] {
        let has_lamp = |number: usize| number < self.lamp_count;
        assert!(
            lamp_powers.iter().enumerate().all(|(number, power)| {
                (0.0..=1.0).contains(power) && (has_lamp(number) || *power == 0.0)
            }),
            "found lamp powers {lamp_powers:?}, wanted 0 to 1 for each of {} lamps",
            self.lamp_count
        );
        let mut powers = [0.0; MAX_LAMPS];
        for ((power, wanted), share) in powers.iter_mut().zip(lamp_powers).zip(self.shares) {
            *power = wanted * share;
        }
        powers
    }

    /// Draws the random processes of a tick, and computes what is held constant over it.
    fn draw_tick(&mut self, powers: [f64; MAX_LAMPS], tick_h: f64) -> Tick {
        let plant = &self.plant;
        let substeps = (tick_h * 3600.0 / self.substep_s() - 1e-9).ceil().max(1.0);
        let gains = match &mut self.noise {
            Some(noise) => noise.gains(plant, self.age_h, tick_h),
            None => Gains { motility: 1.0, growth: 1.0 },
        };
        let (zone, dt) = (self.zone(), tick_h / substeps);
        let (maturity, straightening) = match &plant.internodal {
            // Internodes mature, not the stem as a whole.
            Some(internodal) => (1.0, internodal.straightening),
            None => (
                self.maturity(),
                (plant.tropism.light + plant.tropism.gravity) * zone / plant.tropism.balance,
            ),
        };
        let forcing = Forcing {
            dt,
            substeps: substeps as u32,
            age_h: self.age_h,
            lamps: self.lamps,
            powers,
            beams: self.beams,
            is_shaded: self.is_shaded && self.rod.is_among_solids(),
            growth: if self.is_unsupported() { 0.0 } else { self.elongation() * gains.growth },
            gain: maturity * gains.motility,
            zone,
            straightening,
            leaf_mass: self.leaf_mass(),
        };
        let noise = self.noise.as_mut().map(|noise| {
            self.phase += noise.phase_step(plant, tick_h);
            noise.curvature(plant, tick_h)
        });
        let speed = match (&mut self.clock, &plant.internodal) {
            (Some(clock), Some(internodal)) => clock.speed(internodal, tick_h),
            _ => 1.0,
        };
        let turning = TAU / plant.nutation.period_h * speed;
        let nutation = RotatingNutation::new(plant, self.phase, turning * dt);
        Tick { nutation, turning, forcing, noise }
    }

    /// Ends a tick: time has passed.
    fn end_tick(&mut self, tick: &Tick, tick_h: f64) {
        self.phase += tick.turning * tick_h;
        self.phase %= TAU;
        self.age_h += tick_h;
    }

    /// Tilts the base by `radians` towards positive x, as tipping the pot does.
    pub fn tip_over(&mut self, radians: f64) {
        self.rod.tilt_base(radians);
    }

    /// Age since the seedling had its initial length, in h.
    #[must_use]
    pub fn age_h(&self) -> f64 {
        self.age_h
    }

    /// Length along the stem, in cm.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.rod.length()
    }

    /// Position of the shoot apex, in cm.
    #[must_use]
    pub fn apex(&self) -> Vec3 {
        self.rod.apex()
    }

    /// Maximum curvature along the stem, in 1/cm.
    #[must_use]
    pub fn peak_curvature(&self) -> f64 {
        self.rod.peak_curvature()
    }

    /// The parameters of this plant.
    #[must_use]
    pub fn individual(&self) -> &Individual {
        &self.plant
    }

    /// Pauses drawn so far: past, present, and the next ones already drawn.
    #[must_use]
    pub fn pauses(&self) -> &[Pause] {
        self.noise.as_ref().map_or(&[], PlantNoise::pauses)
    }

    /// What can be effective of it.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let leaf = self.rod.leaf();
        let mut stem = Vec::with_capacity(self.rod.count() + 1);
        // The segment that bears the leaves ends in sections `leaf` and `leaf + 1`; the last section is the apex.
        let (mut base, mut along, mut heading) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        self.rod.for_each_section(|section| {
            let number = stem.len();
            if number == leaf || number == leaf + 1 {
                base = core::array::from_fn(|axis| base[axis] + 0.5 * section.at[axis]);
                along = section.along();
            }
            if number == self.rod.count() {
                heading = section.along();
            }
            stem.push(Node { at: section.at, radius: rod::radius(&self.plant, section.from_apex) });
        });
        let spread = math::logistic((self.age_h - self.unfold_h - SPREADING.0) / SPREADING.1);
        let azimuth = self.plant.leaves.azimuth;
        Pose {
            age_h: self.age_h,
            stem,
            heading,
            leaves: [azimuth, azimuth + PI].map(|azimuth| self.leaf(base, along, azimuth, spread)),
            spread,
            withered: self.withered(),
        }
    }

    /// How far the cotyledons have withered, 0 to 1.
    fn withered(&self) -> f64 {
        let fallen_h = self.plant.leaves.cotyledons_h;
        if self.age_h >= fallen_h {
            return 1.0;
        }
        ((self.age_h / fallen_h - WITHERING) / (1.0 - WITHERING)).max(0.0)
    }

    /// One leaf of the pair: folded along the stem at `spread` 0, held by its pulvinus at 1.
    fn leaf(&self, base: Vec3, stem: Vec3, azimuth: f64, spread: f64) -> Leaf {
        let leaves = &self.plant.leaves;
        let swing = leaves.swing * math::sin(TAU * self.age_h / leaves.swing_period_h + leaves.swing_phase);
        let angle = (LEAF_ANGLE + swing).clamp(-FRAC_PI_2, FRAC_PI_2);
        let (level, up) = (math::cos(angle), math::sin(angle));
        let (x, z) = (math::cos(azimuth), math::sin(azimuth));
        let open = [level * x, up, level * z];
        let along = unit(core::array::from_fn(|axis| (1.0 - spread) * stem[axis] + spread * open[axis]));
        let sideways = [-z, 0.0, x];
        let part: f64 = (0..3).map(|axis| sideways[axis] * along[axis]).sum();
        let across = unit(core::array::from_fn(|axis| sideways[axis] - part * along[axis]));
        Leaf { base, along, across, length: leaves.length * self.leaf_share() }
    }

    /// Length of the leaves as a share of their final length.
    fn leaf_share(&self) -> f64 {
        let (least, delay_h, time_h) = LEAF;
        least + (1.0 - least) * math::logistic((self.age_h - self.unfold_h - delay_h) / time_h)
    }

    /// Mass of the leaf pair, in g.
    fn leaf_mass(&self) -> f64 {
        let share = self.leaf_share();
        2.0 * self.plant.leaves.mass_g * share * share
    }

    /// Elongation at this age, in cm/h.
    fn elongation(&self) -> f64 {
        let growth = &self.plant.growth;
        let old = math::logistic((growth.slows_h - self.age_h) / growth.slowing_h);
        FILE_RATES_PER_H * growth.rate * (growth.late + (EARLY_GROWTH - growth.late) * old)
    }

    /// Whether so much of the stem stands free that it no longer grows.
    fn is_unsupported(&self) -> bool {
        self.plant.growth.free_cm.is_some_and(|most| self.rod.free_length() >= most)
    }

    /// Motility at this age as a share of that of a young stem.
    fn maturity(&self) -> f64 {
        let motility = &self.plant.motility;
        let left = math::logistic((motility.mature_h - self.age_h) / motility.maturing_h);
        motility.late + (1.0 - motility.late) * left
    }

    /// Length of the motile zone at this age, in cm.
    fn zone(&self) -> f64 {
        let motility = &self.plant.motility;
        let grown = math::logistic((self.age_h - motility.zone_h) / ZONE_GROWTH_H);
        motility.zone_young + (motility.zone - motility.zone_young) * grown
    }
}

/// Number of ticks in which `minutes` pass, and the duration of each, in h.
///
/// # Panics
/// If the time is negative or not finite.
pub(crate) fn ticks_of(minutes: f64) -> (u32, f64) {
    assert!(minutes >= 0.0 && minutes.is_finite(), "found {minutes} min, wanted 0 or more");
    let ticks = (minutes / MAX_TICK_MIN).ceil().max(1.0);
    (ticks as u32, minutes / ticks / 60.0)
}

/// Advances up to [`Real::LANES`] beans with the same sub-step by a tick.
pub(crate) fn tick_together<R: Real>(
    chains: &mut Chains<R>,
    beans: &mut [&mut Bean],
    powers: &[[f64; MAX_LAMPS]],
    tick_h: f64,
) {
    let ticks: Vec<Tick> =
        beans.iter_mut().zip(powers).map(|(bean, powers)| bean.draw_tick(*powers, tick_h)).collect();
    let mut nutation: Vec<RotatingNutation> = ticks.iter().map(|tick| tick.nutation.clone()).collect();
    let mut members = Vec::with_capacity(ticks.len());
    for (bean, Tick { forcing, noise, .. }) in beans.iter_mut().zip(&ticks) {
        members.push(Member { rod: &mut bean.rod, plant: &bean.plant, forcing, noise: *noise });
    }
    chains.advance(&mut members, || {
        let mut rates = [[0.0; LANES]; 2];
        for (lane, nutation) in nutation.iter_mut().enumerate() {
            [rates[0][lane], rates[1][lane]] = nutation.next_rate();
        }
        rates.map(|rates| R::from_fn(|lane| rates[lane]))
    });
    for (bean, tick) in beans.iter_mut().zip(&ticks) {
        bean.end_tick(tick, tick_h);
    }
}

/// What is held constant over a tick, but for circumnutation.
struct Tick {
    forcing: Forcing,
    nutation: RotatingNutation,
    noise: Option<(NoiseStream, f64)>,
    /// Speed of the phase of circumnutation, in rad/h.
    turning: f64,
}

/// The rate of curvature by circumnutation, sub-step after sub-step: the phase turns by the addition theorem.
#[derive(Clone)]
struct RotatingNutation {
    ellipse: [[f64; 2]; 2],
    cos: f64,
    sin: f64,
    /// Cosine and sine of the angle of a sub-step.
    turn: [f64; 2],
}

impl RotatingNutation {
    /// `angle`: by which the phase turns in a sub-step.
    fn new(plant: &Individual, phase: f64, angle: f64) -> Self {
        // The middle of the first sub-step.
        let (sin, cos) = math::sin_cos(phase + 0.5 * angle);
        let (sin_step, cos_step) = math::sin_cos(angle);
        Self { ellipse: nutation_ellipse(plant), cos, sin, turn: [cos_step, sin_step] }
    }

    /// The rate towards d1 and d2, in 1/cm/h; then the phase advances by a sub-step.
    fn next_rate(&mut self) -> [f64; 2] {
        let (cos, sin, [cos_step, sin_step]) = (self.cos, self.sin, self.turn);
        let rate = self.ellipse.map(|[major, minor]| major * cos + minor * sin);
        [self.cos, self.sin] = [cos * cos_step - sin * sin_step, sin * cos_step + cos * sin_step];
        rate
    }
}

/// The ellipse of circumnutation as rates of curvature, in 1/cm/h: rows d1 and d2, columns cosine and sine of the phase.
fn nutation_ellipse(plant: &Individual) -> [[f64; 2]; 2] {
    let nutation = &plant.nutation;
    let major = nutation.curvature * TAU / nutation.period_h;
    let minor = major * nutation.roundness * nutation.hand;
    let [cos, sin] = [math::cos(nutation.azimuth), math::sin(nutation.azimuth)];
    [[cos * major, -sin * minor], [sin * major, cos * minor]]
}

fn unit(vector: Vec3) -> Vec3 {
    let length = math::vector::norm(vector);
    if length > 0.0 { vector.map(|axis| axis / length) } else { [0.0, 1.0, 0.0] }
}

#[cfg(test)]
mod tests {
    use tropism::obstacle::Pole;

    use super::*;

    /// A stem that is set down is left out of all sub-steps; one that is merely rigid is computed on.
    #[test]
    fn setting_rigid_segments_down_changes_no_bit() {
        let mut plant = Individual::default();
        (plant.growth.rate, plant.nutation.curvature, plant.nutation.roundness) = (0.03, 0.1, 1.0);
        plant.stem.rigid_cm = Some(14.0);
        let pole = Pole { at: [1.5, 0.0], radius_cm: 0.4, height_cm: 90.0 };
        let mut bean = Bean::new(plant, 2).among(&[pole.into()]);
        let mut whole = bean.clone();
        let mut chains: Chains<f64> = Chains::new();
        let (ticks, tick_h) = ticks_of(5.0);
        let mut touching = 0;
        for step in 0..1200 {
            let powers = [0.0, if step / 100 % 2 == 0 { 0.1 } else { 0.0 }];
            bean.advance(&powers, 5.0);
            let checked = whole.checked_powers(&powers);
            (0..ticks).for_each(|_| tick_together(&mut chains, &mut [&mut whole], &[checked], tick_h));
            assert_eq!(bean.pose(), whole.pose(), "step {step}");
            assert_eq!(bean.contacts(), whole.contacts(), "step {step}");
            touching += usize::from(!bean.contacts().is_empty());
        }
        println!("{} and {} segments", bean.rod.computed(), whole.rod.computed());
        assert!(bean.rod.computed() + 16 <= whole.rod.computed() && whole.rod.computed() < 120);
        assert!(touching > 300, "{touching} steps with contact");
    }
}
