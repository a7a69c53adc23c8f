//! A bean that grows, circles, bends to light and against gravity, sags, pauses, and unfolds leaves.
//!
//! In: the lamps' power and the time. Out: what can be seen of the plant ([`Pose`]). The idea: a growing, bending rod in
//! three dimensions, whose curvature changes at every point by
//!
//! `dk/dt = motility (nu light + beta gravity - gamma k + nutation + bias) + noise`
//!
//! where light and gravity are projected on the stem's own cross-section. It is a stand-in for a plant: its parameters are
//! partly published and partly tuned ([`Species`]), and results from it are virtual. It shares nothing with the tip-motion
//! model, which is built from its photographs.
//!
//! Sign conventions: x to the right, y up, z towards the camera.

pub mod experiments;
mod grow;
pub mod acceptance;
pub mod calibrate;
mod chance;
mod check;
mod individual;
mod rod;
mod species;

use core::f64::consts::{FRAC_PI_2, PI, TAU};

pub use chance::Pause;
pub(super) use grow::Observer;
pub use grow::{Trial, grow, grow_quiet, lamp_powers};
pub use individual::{Fluctuation, Growth, Individual, Leaves, Motility, Nutation, Pauses, Stem, Tropism};
pub use species::{Species, Spread};

use super::pose::{Leaf, Node, Pose};
use super::view::Place;
use crate::lamps::{Layout, MAX_LAMPS};
use crate::math;
use chance::{Chance, Factors};
use rod::{Drive, Rod};

/// Unit of time of the rates in bean files that are given per five minutes (`growth.rate`, `fluctuation.phase`), in min:
/// the paper's period between photographs (section 2.2.1).
const FILE_RATE_MIN: f64 = 5.0;
/// Those units in an hour.
const FILE_RATES_PER_H: f64 = 60.0 / FILE_RATE_MIN;
/// Longest time over which everything but the rod itself is held constant, in min. Chosen by hand: far below the hours in
/// which it changes.
const MAX_TICK_MIN: f64 = 5.0;
/// Elongation of a seedling before it slows, over the rate at which it levels off.
const EARLY_GROWTH: f64 = 1.13;
/// Share of elongation that a seedling still lacks, and the time in which it comes, in h.
const SEEDLING: (f64, f64) = (0.4, 8.0);
/// Time in which the motile zone lengthens, in h.
const ZONE_GROWTH_H: f64 = 4.0;
/// Leaf length at the start as a share, the delay of its growth after unfolding, and that growth's time, in h.
const LEAF: (f64, f64, f64) = (0.18, 14.0, 5.0);
/// Delay of the leaves' spreading after they begin to unfold, and the time it takes, in h.
const SPREADING: (f64, f64) = (3.0, 1.0);
/// Share of the cotyledons' time after which they begin to wither.
const WITHERING: f64 = 0.3;
/// The blade's angle to the horizontal about which it swings, in rad.
const LEAF_ANGLE: f64 = -0.35;

/// A living bean.
///
/// ```
/// use tropism::greenhouse::bean::{Bean, Species};
/// let mut bean = Bean::new(Species::default().draw(1, 1.0), 1);
/// for _ in 0..72 {
///     bean.advance(&[0.0, 1.0], 5.0); // six hours of light from the right
/// }
/// assert!(bean.apex()[0] > 0.0 && bean.length() > 4.0);
/// ```
#[derive(Clone, Debug)]
pub struct Bean {
    plant: Individual,
    rod: Rod,
    /// Places of the lamps, in cm, and their number.
    lamps: [Place; MAX_LAMPS],
    lamp_count: usize,
    age_h: f64,
    /// Phase of nutation, in rad.
    phase: f64,
    /// Age at which the leaves begin to unfold, in h; never without events.
    unfold_h: f64,
    chance: Option<Chance>,
    substep_s: f64,
}

impl Bean {
    /// The sub-step unless [`Self::with_substep`] says otherwise, in s.
    pub const SUBSTEP_S: f64 = 15.0;

    /// A seedling; `seed` is that of its events, fluctuation and noise.
    #[must_use]
    pub fn new(individual: Individual, seed: u64) -> Self {
        let mut chance = Chance::new(&individual, seed);
        let phase = chance.phase();
        let unfold_h = individual.leaves.unfold_h;
        Self { phase, unfold_h, chance: Some(chance), ..Self::quiet(individual) }
    }

    /// A seedling without noise and without events: nothing fluctuates, it never pauses, and its leaves stay folded.
    #[must_use]
    pub fn quiet(individual: Individual) -> Self {
        Self {
            rod: Rod::seedling(&individual),
            plant: individual,
            lamps: [[0.0; 3]; MAX_LAMPS],
            lamp_count: 0,
            age_h: 0.0,
            phase: 0.0,
            unfold_h: f64::INFINITY,
            chance: None,
            substep_s: Self::SUBSTEP_S,
        }
        .under(&Layout::default())
    }

    /// The same bean under the lamps of `layout`; without this, under the paper's two.
    #[must_use]
    pub fn under(mut self, layout: &Layout) -> Self {
        self.lamp_count = layout.len();
        for (place, lamp) in self.lamps.iter_mut().zip(layout.lamps()) {
            *place = lamp.at;
        }
        self
    }

    /// The same bean, computed with another sub-step, in s.
    ///
    /// # Panics
    /// Unless `seconds` is between 0.1 and 60: longer ones are not accurate.
    #[must_use]
    pub fn with_substep(self, seconds: f64) -> Self {
        assert!((0.1..=60.0).contains(&seconds), "found a sub-step of {seconds} s, wanted 0.1 to 60 s");
        Self { substep_s: seconds, ..self }
    }

    /// Grows for `minutes` under lamps of the given powers, 0 to 1, in the order of the layout; further lamps are dark.
    ///
    /// Power 1 gives 6 umol/m^2/s of blue light at 35 cm; a dimmer lamp or another colour gives less.
    ///
    /// # Panics
    /// If a power is not between 0 and 1 or belongs to no lamp, or if the time is negative or not finite.
    pub fn advance(&mut self, lamp_powers: &[f64], minutes: f64) {
        let has_lamp = |number: usize| number < self.lamp_count;
        assert!(
            lamp_powers.iter().enumerate().all(|(number, power)| {
                (0.0..=1.0).contains(power) && (has_lamp(number) || *power == 0.0)
            }),
            "found lamp powers {lamp_powers:?}, wanted 0 to 1 for each of {} lamps",
            self.lamp_count
        );
        let mut powers = [0.0; MAX_LAMPS];
        for (power, wanted) in powers.iter_mut().zip(lamp_powers) {
            *power = *wanted;
        }
        assert!(minutes >= 0.0 && minutes.is_finite(), "found {minutes} min, wanted 0 or more");
        let ticks = (minutes / MAX_TICK_MIN).ceil().max(1.0);
        for _ in 0..ticks as u32 {
            self.tick(powers, minutes / ticks / 60.0);
        }
    }

    fn tick(&mut self, powers: [f64; MAX_LAMPS], tick_h: f64) {
        let plant = &self.plant;
        let substeps = (tick_h * 3600.0 / self.substep_s - 1e-9).ceil().max(1.0);
        let factors = match &mut self.chance {
            Some(chance) => chance.factors(plant, self.age_h, tick_h),
            None => Factors { motility: 1.0, growth: 1.0 },
        };
        let zone = self.zone();
        let drive = Drive {
            dt: tick_h / substeps,
            lamps: self.lamps,
            powers,
            growth: self.elongation() * factors.growth,
            gain: self.maturity() * factors.motility,
            zone,
            straightening: (plant.tropism.light + plant.tropism.gravity) * zone / plant.tropism.balance,
            leaf_mass: self.leaf_mass(),
        };
        self.rod.begin(plant, &drive);
        if let Some(chance) = &mut self.chance {
            self.rod.disturb(|| chance.curvature(plant, tick_h));
            self.phase += chance.wander(plant, tick_h);
        }
        let (speed, circle) = (TAU / plant.nutation.period_h, circle(plant));
        let [mut cos, mut sin] = [math::cos(self.phase), math::sin(self.phase)];
        let [cos_step, sin_step] = [math::cos(speed * drive.dt), math::sin(speed * drive.dt)];
        for _ in 0..substeps as u32 {
            let turning = circle.map(|[major, minor]| major * cos + minor * sin);
            self.rod.step(plant, &drive, turning);
            [cos, sin] = [cos * cos_step - sin * sin_step, sin * cos_step + cos * sin_step];
        }
        self.phase += speed * tick_h;
        self.phase %= TAU;
        self.age_h += tick_h;
    }

    /// Leans the base by `radians` further towards positive x, as when the pot is tipped.
    pub fn tip_over(&mut self, radians: f64) {
        self.rod.lean(radians);
    }

    /// Age, in h since the seedling had its first length.
    #[must_use]
    pub fn age_h(&self) -> f64 {
        self.age_h
    }

    /// Length along the stem, in cm.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.rod.length()
    }

    /// The shoot apex, in cm.
    #[must_use]
    pub fn apex(&self) -> Place {
        let mut apex = [0.0; 3];
        self.rod.walk(|section| apex = section.at);
        apex
    }

    /// The largest curvature along the stem, in 1/cm.
    #[must_use]
    pub fn peak_curvature(&self) -> f64 {
        self.rod.peak_curvature()
    }

    /// The individual that this bean is.
    #[must_use]
    pub fn individual(&self) -> &Individual {
        &self.plant
    }

    /// Its pauses, past and under way; those to come as far as they are fixed.
    #[must_use]
    pub fn pauses(&self) -> &[Pause] {
        self.chance.as_ref().map_or(&[], Chance::pauses)
    }

    /// What can be seen of it.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let mut sections = Vec::with_capacity(64);
        self.rod.walk(|section| sections.push(section));
        let [lower, upper] = [&sections[self.rod.leaf()], &sections[self.rod.leaf() + 1]];
        let base = core::array::from_fn(|axis| 0.5 * (lower.at[axis] + upper.at[axis]));
        let heading = sections.last().expect("a rod has sections").along;
        let spread = math::logistic((self.age_h - self.unfold_h - SPREADING.0) / SPREADING.1);
        let azimuth = self.plant.leaves.azimuth;
        let stem = sections
            .iter()
            .map(|section| Node { at: section.at, radius: rod::radius(&self.plant, section.below) })
            .collect();
        Pose {
            age_h: self.age_h,
            stem,
            heading,
            leaves: [azimuth, azimuth + PI].map(|azimuth| self.leaf(base, upper.along, azimuth, spread)),
            spread,
            withered: self.withered(),
        }
    }

    /// How far the cotyledons have withered.
    fn withered(&self) -> f64 {
        let fallen_h = self.plant.leaves.cotyledons_h;
        if self.age_h >= fallen_h {
            return 1.0;
        }
        ((self.age_h / fallen_h - WITHERING) / (1.0 - WITHERING)).max(0.0)
    }

    fn leaf(&self, base: Place, stem: Place, azimuth: f64, spread: f64) -> Leaf {
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

    /// Length of the leaves over their full length.
    fn leaf_share(&self) -> f64 {
        let (least, delay_h, time_h) = LEAF;
        least + (1.0 - least) * math::logistic((self.age_h - self.unfold_h - delay_h) / time_h)
    }

    /// Mass of the leaf pair, in g.
    fn leaf_mass(&self) -> f64 {
        2.0 * self.plant.leaves.mass_g * self.leaf_share() * self.leaf_share()
    }

    /// Elongation at this age, in cm/h.
    fn elongation(&self) -> f64 {
        let growth = &self.plant.growth;
        let (lack, time_h) = SEEDLING;
        let young = 1.0 - lack * math::exp(-self.age_h / time_h);
        let old = math::logistic((growth.slows_h - self.age_h) / growth.slowing_h);
        FILE_RATES_PER_H * growth.rate * (growth.late + (EARLY_GROWTH - growth.late) * young * old)
    }

    /// Motility left at this age, as a share.
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

/// Nutation's part in the change of curvature, in 1/cm/h: towards d1 and towards d2, with the cosine and with the sine of
/// its phase.
fn circle(plant: &Individual) -> [[f64; 2]; 2] {
    let nutation = &plant.nutation;
    let major = nutation.curvature * TAU / nutation.period_h;
    let minor = major * nutation.roundness * nutation.hand;
    let [cos, sin] = [math::cos(nutation.azimuth), math::sin(nutation.azimuth)];
    [[cos * major, -sin * minor], [sin * major, cos * minor]]
}

fn unit(vector: Place) -> Place {
    let length = math::vector::norm(vector);
    if length > 0.0 { vector.map(|axis| axis / length) } else { [0.0, 1.0, 0.0] }
}
