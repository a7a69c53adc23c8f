//! What beans have in common, and how they differ.
//!
//! In: a seed and a scale. Out: the parameters of one plant. The idea: a species is its typical individual and the spread
//! around it; everything else about a bean follows from its individual parameters.
//!
//! Confidence of each value: A known, B order of magnitude, C guess. "Tuned" values were chosen while watching the
//! statistics of the acceptance table, so that table is a calibration and not a prediction.
//!
//! # References
//! Bastien, Bohr, Moulia, Douady 2013 (doi:10.1073/pnas.1214301109) for the balance of bending and straightening; Bastien,
//! Douady, Moulia 2015 (doi:10.1371/journal.pcbi.1004037) for the light exponent; Millet, Melin, Badot 1984 for the period of
//! nutation; Enright and Cumbie 1973 for internode growth; measurements of twining *Phaseolus vulgaris* 'Helda' published with
//! Ohad, Porat, Meroz for nutation, motile zone and Young's modulus.

use core::f64::consts::{PI, TAU};

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::math;
use crate::random::{self, Purpose};

/// A species or cultivar: the typical individual and the spread around it. The default is a bush bean.
///
/// ```
/// use tropism::greenhouse::bean::Species;
/// let bean = Species::default();
/// assert_eq!(bean.draw(7, 1.0), bean.draw(7, 1.0));
/// assert_eq!(bean.draw(7, 0.0), bean.average());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Species {
    /// Name, for reports.
    pub name: String,
    /// The typical plant.
    pub typical: Individual,
    /// How far individuals differ from it.
    pub spread: Spread,
}

/// The parameters of one plant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Individual {
    /// Elongation.
    pub growth: Growth,
    /// Where and when the stem can bend.
    pub motility: Motility,
    /// What makes it bend.
    pub tropism: Tropism,
    /// Its own circling.
    pub nutation: Nutation,
    /// The stem as a rod.
    pub stem: Stem,
    /// The pair of primary leaves.
    pub leaves: Leaves,
    /// Times in which the plant does not respond.
    pub pauses: Pauses,
    /// What fluctuates.
    pub fluctuation: Fluctuation,
}

/// Elongation: a growing zone below the apex, slow at first, slower late.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Growth {
    /// Length at the start, in cm (A: the paper's 4 cm).
    pub start: f64,
    /// Scale of elongation, in cm per step of five minutes (A: the paper's mean is 0.03).
    pub rate: f64,
    /// Length of the growing zone, in cm from the apex (B).
    pub zone: f64,
    /// Age at which elongation falls, in h (tuned: slow after step 800).
    pub slows_h: f64,
    /// Time over which it falls, in h (tuned).
    pub slowing_h: f64,
    /// Share of elongation that is left (tuned).
    pub late: f64,
}

/// The motile zone: the part below the apex whose curvature can change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Motility {
    /// Length of the zone in a seedling, in cm from the apex (tuned).
    pub zone_young: f64,
    /// Length of the zone later, in cm from the apex (B: 12.3 +- 4.1 cm measured on a climber).
    pub zone: f64,
    /// Age at which the zone has half lengthened, in h (tuned: fast from step 300).
    pub zone_h: f64,
    /// Width of the zone's lower edge, in cm (C).
    pub edge: f64,
    /// Age at which motility falls, in h (tuned: slow after step 800).
    pub mature_h: f64,
    /// Time over which it falls, in h (tuned).
    pub maturing_h: f64,
    /// Share of motility that is left (tuned).
    pub late: f64,
}

/// What bends the stem: light, gravity, its own curvature, and a bias.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tropism {
    /// Phototropic sensitivity nu, in rad/cm/h (tuned).
    pub light: f64,
    /// Exponent of the response to irradiance (A: 0.36 to 0.44).
    pub light_exponent: f64,
    /// Share of the light signal that is perceived at the apex, the rest where it bends (C).
    pub apical: f64,
    /// Memory of light, in h; two such stages in a row (B: 4 to 75 minutes in other species).
    pub light_memory_h: f64,
    /// Gravitropic sensitivity beta, in rad/cm/h (tuned: a third of light's, set point near 45 degrees).
    pub gravity: f64,
    /// Memory of gravity, in h (B: 13 to 15 minutes).
    pub gravity_memory_h: f64,
    /// Balance number: sensitivity times motile length over straightening rate (B: 0.9 to 9.3).
    pub balance: f64,
    /// Constant bending towards positive x, in rad/cm/h (C).
    pub bias_x: f64,
    /// Constant bending towards the camera, in rad/cm/h (C).
    pub bias_z: f64,
}

/// Circumnutation: an elliptic oscillation of the curvature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Nutation {
    /// Period, in h (A: 98.6 +- 12.7 min).
    pub period_h: f64,
    /// Amplitude of the curvature, in 1/cm (C).
    pub curvature: f64,
    /// Minor over major axis of the ellipse, in [0, 1] (C).
    pub roundness: f64,
    /// Angle of the major axis, in rad from x away from the camera (C).
    pub azimuth: f64,
    /// 1: counter-clockwise seen from above, as most beans turn; -1: clockwise (A: Darwin).
    pub hand: f64,
}

/// The stem as an elastic rod under its own weight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Stem {
    /// Lean at the base towards positive x, in rad (C).
    pub tilt_x: f64,
    /// Lean at the base towards the camera, in rad (C).
    pub tilt_z: f64,
    /// Young's modulus at the apex, in MPa (C: ten times that of a twiner).
    pub modulus_mpa: f64,
    /// Distance from the apex over which the modulus grows e-fold, in cm (A).
    pub modulus_length: f64,
    /// Young's modulus of mature stem, in MPa (A).
    pub modulus_mature_mpa: f64,
    /// Radius at the apex, in cm (B).
    pub radius_apex: f64,
    /// Radius from 15 cm below the apex on, in cm (B).
    pub radius_base: f64,
    /// Time in which the stem settles under a load, in h (C).
    pub lag_h: f64,
    /// Mass of the apical bud, in g (C).
    pub tip_g: f64,
}

/// The pair of primary leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Leaves {
    /// Length of a grown leaf with its petiole, in cm (C: small, in dim light).
    pub length: f64,
    /// Mass of a grown leaf, in g (C).
    pub mass_g: f64,
    /// Age at which the leaves begin to unfold, in h (C).
    pub unfold_h: f64,
    /// Direction of the first leaf, in rad from x towards the camera; the second is opposite.
    pub azimuth: f64,
    /// Period of the leaves' daily swing in constant light, in h (A: 26 h).
    pub swing_period_h: f64,
    /// Amplitude of that swing, in rad (B).
    pub swing: f64,
    /// Phase of that swing at age 0, in rad.
    pub swing_phase: f64,
}

/// Times in which the plant hardly responds. The paper saw one, "while and started growing leaves".
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pauses {
    /// How long the unfolding of the primary leaves takes, in h (C).
    pub unfolding_h: f64,
    /// Age at which the first trifoliate leaf unfolds, in h (C); it takes 0.8 of the primary leaves' time.
    pub trifoliate_h: f64,
    /// Motility while leaves unfold, as a share (C).
    pub motility: f64,
    /// Episodes of no response without a cause that could be seen, per h (tuned).
    pub episodes_per_h: f64,
}

/// What fluctuates from hour to hour. Standard deviations of logarithms unless said otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Fluctuation {
    /// Of motility (tuned).
    pub motility: f64,
    /// Correlation time of motility, in h (tuned).
    pub motility_h: f64,
    /// Of elongation (tuned on the paper's standard deviation of growth, 0.01 cm).
    pub growth: f64,
    /// Correlation time of elongation, in h (tuned).
    pub growth_h: f64,
    /// Noise of curvature, per segment, in 1/cm per square root of an hour (C).
    pub curvature: f64,
    /// Wander of nutation's phase, in rad per square root of five minutes (C).
    pub phase: f64,
}

/// How individuals differ: coefficients of variation (log-normal, mean preserved) unless said otherwise.
///
/// A `scale` multiplies all of them: 0 makes every plant typical, 1 is the species, 2 twice as various.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs, reason = "each names the parameter it varies")]
pub struct Spread {
    pub growth_rate: f64,
    pub growth_zone: f64,
    pub growth_slows_h: f64,
    pub motility_zone_young: f64,
    pub motility_zone: f64,
    pub motility_zone_h: f64,
    pub motility_mature_h: f64,
    pub motility_maturing_h: f64,
    pub tropism_light: f64,
    pub tropism_light_memory_h: f64,
    pub tropism_gravity: f64,
    pub tropism_gravity_memory_h: f64,
    pub tropism_balance: f64,
    /// Standard deviation, in rad/cm/h.
    pub tropism_bias_x: f64,
    /// Standard deviation, in rad/cm/h.
    pub tropism_bias_z: f64,
    pub nutation_period_h: f64,
    pub nutation_curvature: f64,
    /// Least and most of a uniform distribution.
    pub nutation_roundness: [f64; 2],
    /// Share of plants that turn the other way.
    pub nutation_other_hand: f64,
    /// Standard deviation of both tilts, in rad.
    pub stem_tilt: f64,
    pub stem_modulus: f64,
    pub stem_radius: f64,
    pub stem_tip_g: f64,
    pub leaves_length: f64,
    pub leaves_mass_g: f64,
    pub leaves_unfold_h: f64,
    pub leaves_swing_period_h: f64,
    pub leaves_swing: f64,
    pub pauses_unfolding_h: f64,
    pub pauses_trifoliate_h: f64,
}

impl Default for Species {
    fn default() -> Self {
        Self {
            name: "Phaseolus vulgaris".to_owned(),
            typical: Individual::default(),
            spread: Spread::default(),
        }
    }
}

impl Default for Growth {
    fn default() -> Self {
        Self { start: 4.0, rate: 0.034, zone: 8.0, slows_h: 48.0, slowing_h: 7.0, late: 0.25 }
    }
}

impl Default for Motility {
    fn default() -> Self {
        Self {
            zone_young: 6.5,
            zone: 14.5,
            zone_h: 28.0,
            edge: 2.5,
            mature_h: 60.0,
            maturing_h: 4.0,
            late: 0.13,
        }
    }
}

impl Default for Tropism {
    fn default() -> Self {
        Self {
            light: 0.135,
            light_exponent: 0.40,
            apical: 0.3,
            light_memory_h: 12.0 / 60.0,
            gravity: 0.045,
            gravity_memory_h: 13.0 / 60.0,
            balance: 4.2,
            bias_x: 0.0,
            bias_z: 0.0,
        }
    }
}

impl Default for Nutation {
    fn default() -> Self {
        Self { period_h: 100.0 / 60.0, curvature: 0.0085, roundness: 0.6, azimuth: 0.0, hand: 1.0 }
    }
}

impl Default for Stem {
    fn default() -> Self {
        Self {
            tilt_x: 0.0,
            tilt_z: 0.0,
            modulus_mpa: 40.0,
            modulus_length: 4.6,
            modulus_mature_mpa: 700.0,
            radius_apex: 0.11,
            radius_base: 0.17,
            lag_h: 0.05,
            tip_g: 0.35,
        }
    }
}

impl Default for Leaves {
    fn default() -> Self {
        Self {
            length: 4.0,
            mass_g: 0.45,
            unfold_h: 14.0,
            azimuth: 0.6,
            swing_period_h: 26.5,
            swing: 0.25,
            swing_phase: 0.0,
        }
    }
}

impl Default for Pauses {
    fn default() -> Self {
        Self { unfolding_h: 5.0, trifoliate_h: 47.0, motility: 0.12, episodes_per_h: 1.0 / 18.0 }
    }
}

impl Default for Fluctuation {
    fn default() -> Self {
        Self { motility: 0.38, motility_h: 2.0, growth: 0.25, growth_h: 1.0, curvature: 0.004, phase: 0.10 }
    }
}

impl Default for Spread {
    fn default() -> Self {
        Self {
            growth_rate: 0.13,
            growth_zone: 0.15,
            growth_slows_h: 0.10,
            motility_zone_young: 0.20,
            motility_zone: 0.13,
            motility_zone_h: 0.12,
            motility_mature_h: 0.08,
            motility_maturing_h: 0.2,
            tropism_light: 0.19,
            tropism_light_memory_h: 0.3,
            tropism_gravity: 0.17,
            tropism_gravity_memory_h: 0.3,
            tropism_balance: 0.18,
            tropism_bias_x: 0.015,
            tropism_bias_z: 0.010,
            nutation_period_h: 0.13,
            nutation_curvature: 0.45,
            nutation_roundness: [0.35, 0.95],
            nutation_other_hand: 0.1,
            stem_tilt: 0.05,
            stem_modulus: 0.3,
            stem_radius: 0.1,
            stem_tip_g: 0.15,
            leaves_length: 0.15,
            leaves_mass_g: 0.2,
            leaves_unfold_h: 0.25,
            leaves_swing_period_h: 0.03,
            leaves_swing: 0.3,
            pauses_unfolding_h: 0.4,
            pauses_trifoliate_h: 0.12,
        }
    }
}

/// A value that no plant can have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("found {key} = {value}, wanted {wanted}")]
pub struct SpeciesError {
    /// The key, with the tables that it stands in.
    pub key: String,
    /// Its value.
    pub value: f64,
    /// The range.
    pub wanted: &'static str,
}

impl Species {
    /// The plant that grows from `seed`: the typical individual, varied by `scale` (0 to 2) times the spread.
    #[must_use]
    pub fn draw(&self, seed: u64, scale: f64) -> Individual {
        let mut rng = random::stream(seed, Purpose::Individual, 0);
        let mut plant = self.typical.clone();
        let spread = &self.spread;
        for (value, variation) in [
            (&mut plant.growth.rate, spread.growth_rate),
            (&mut plant.growth.zone, spread.growth_zone),
            (&mut plant.growth.slows_h, spread.growth_slows_h),
            (&mut plant.motility.zone_young, spread.motility_zone_young),
            (&mut plant.motility.zone, spread.motility_zone),
            (&mut plant.motility.zone_h, spread.motility_zone_h),
            (&mut plant.motility.mature_h, spread.motility_mature_h),
            (&mut plant.motility.maturing_h, spread.motility_maturing_h),
            (&mut plant.tropism.light, spread.tropism_light),
            (&mut plant.tropism.light_memory_h, spread.tropism_light_memory_h),
            (&mut plant.tropism.gravity, spread.tropism_gravity),
            (&mut plant.tropism.gravity_memory_h, spread.tropism_gravity_memory_h),
            (&mut plant.tropism.balance, spread.tropism_balance),
            (&mut plant.nutation.period_h, spread.nutation_period_h),
            (&mut plant.nutation.curvature, spread.nutation_curvature),
            (&mut plant.stem.modulus_mpa, spread.stem_modulus),
            (&mut plant.stem.radius_apex, spread.stem_radius),
            (&mut plant.stem.radius_base, spread.stem_radius),
            (&mut plant.stem.tip_g, spread.stem_tip_g),
            (&mut plant.leaves.length, spread.leaves_length),
            (&mut plant.leaves.mass_g, spread.leaves_mass_g),
            (&mut plant.leaves.unfold_h, spread.leaves_unfold_h),
            (&mut plant.leaves.swing_period_h, spread.leaves_swing_period_h),
            (&mut plant.leaves.swing, spread.leaves_swing),
            (&mut plant.pauses.unfolding_h, spread.pauses_unfolding_h),
            (&mut plant.pauses.trifoliate_h, spread.pauses_trifoliate_h),
        ] {
            *value *= log_normal(&mut rng, scale * variation);
        }
        for (value, deviation) in [
            (&mut plant.tropism.bias_x, spread.tropism_bias_x),
            (&mut plant.tropism.bias_z, spread.tropism_bias_z),
            (&mut plant.stem.tilt_x, spread.stem_tilt),
            (&mut plant.stem.tilt_z, spread.stem_tilt),
        ] {
            *value += scale * deviation * random::normal(&mut rng);
        }
        let [least, most] = spread.nutation_roundness;
        for (value, least, most) in [
            (&mut plant.nutation.roundness, least, most),
            (&mut plant.nutation.azimuth, 0.0, PI),
            (&mut plant.leaves.azimuth, 0.0, PI),
            (&mut plant.leaves.swing_phase, 0.0, TAU),
        ] {
            let drawn = least + (most - least) * random::uniform(&mut rng);
            *value += scale * (drawn - *value);
        }
        plant.nutation.roundness = plant.nutation.roundness.clamp(0.0, 1.0);
        if random::uniform(&mut rng) < scale * spread.nutation_other_hand {
            plant.nutation.hand = -plant.nutation.hand;
        }
        plant
    }

    /// The typical plant, without any spread.
    #[must_use]
    pub fn average(&self) -> Individual {
        self.typical.clone()
    }

    /// Whether every value is one that a plant can have.
    ///
    /// # Errors
    /// [`SpeciesError`] names the first key that is not, its value, and the range.
    pub fn check(&self) -> Result<(), SpeciesError> {
        self.typical
            .check()
            .map_err(|error| SpeciesError { key: format!("typical.{}", error.key), ..error })?;
        self.spread.check()
    }
}

/// A positive factor of mean 1 with the coefficient of variation `variation`.
fn log_normal(rng: &mut impl Rng, variation: f64) -> f64 {
    let sigma = math::ln(1.0 + variation * variation).sqrt();
    math::exp(sigma * random::normal(rng) - 0.5 * sigma * sigma)
}

fn within(key: &'static str, value: f64, is_within: bool, wanted: &'static str) -> Result<(), SpeciesError> {
    if value.is_finite() && is_within {
        Ok(())
    } else {
        Err(SpeciesError { key: key.to_owned(), value, wanted })
    }
}

fn positive(key: &'static str, value: f64, most: f64, wanted: &'static str) -> Result<(), SpeciesError> {
    within(key, value, value > 0.0 && value <= most, wanted)
}

fn share(key: &'static str, value: f64) -> Result<(), SpeciesError> {
    within(key, value, (0.0..=1.0).contains(&value), "a share between 0 and 1")
}

impl Individual {
    /// The same plant in a mirror: what leaned or turned to the right leans or turns to the left.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let mut plant = self.clone();
        plant.tropism.bias_x = -self.tropism.bias_x;
        plant.stem.tilt_x = -self.stem.tilt_x;
        plant.nutation.hand = -self.nutation.hand;
        plant.nutation.azimuth = PI - self.nutation.azimuth;
        plant.leaves.azimuth = PI - self.leaves.azimuth;
        plant
    }

    fn check(&self) -> Result<(), SpeciesError> {
        const CM: &str = "more than 0 and at most 100 cm";
        const HOURS: &str = "more than 0 and at most 10000 h";
        const RATE: &str = "between 0 and 10 rad/cm/h";
        const TILT: &str = "between -1.5 and 1.5";
        let Self { growth, motility, tropism, nutation, stem, leaves, pauses, fluctuation } = self;
        for (key, value) in [
            ("growth.start", growth.start),
            ("growth.zone", growth.zone),
            ("motility.zone_young", motility.zone_young),
            ("motility.zone", motility.zone),
            ("motility.edge", motility.edge),
            ("stem.modulus_length", stem.modulus_length),
            ("leaves.length", leaves.length),
        ] {
            positive(key, value, 100.0, CM)?;
        }
        for (key, value) in [
            ("growth.slows_h", growth.slows_h),
            ("growth.slowing_h", growth.slowing_h),
            ("motility.zone_h", motility.zone_h),
            ("motility.mature_h", motility.mature_h),
            ("motility.maturing_h", motility.maturing_h),
            ("nutation.period_h", nutation.period_h),
            ("leaves.unfold_h", leaves.unfold_h),
            ("leaves.swing_period_h", leaves.swing_period_h),
            ("pauses.unfolding_h", pauses.unfolding_h),
            ("pauses.trifoliate_h", pauses.trifoliate_h),
            ("fluctuation.motility_h", fluctuation.motility_h),
            ("fluctuation.growth_h", fluctuation.growth_h),
        ] {
            positive(key, value, 1e4, HOURS)?;
        }
        for (key, value) in [
            ("tropism.light_memory_h", tropism.light_memory_h),
            ("tropism.gravity_memory_h", tropism.gravity_memory_h),
            ("stem.lag_h", stem.lag_h),
        ] {
            within(key, value, (0.005..=100.0).contains(&value), "between 0.005 h (18 s) and 100 h")?;
        }
        for (key, value) in [
            ("growth.late", growth.late),
            ("motility.late", motility.late),
            ("tropism.apical", tropism.apical),
            ("nutation.roundness", nutation.roundness),
            ("pauses.motility", pauses.motility),
        ] {
            share(key, value)?;
        }
        for (key, value) in [("stem.radius_apex", stem.radius_apex), ("stem.radius_base", stem.radius_base)] {
            within(key, value, (0.01..=2.0).contains(&value), "a radius between 0.01 and 2 cm")?;
        }
        for (key, value) in
            [("stem.modulus_mpa", stem.modulus_mpa), ("stem.modulus_mature_mpa", stem.modulus_mature_mpa)]
        {
            within(key, value, (1.0..=1e5).contains(&value), "between 1 and 100000 MPa")?;
        }
        for (key, value) in [("stem.tip_g", stem.tip_g), ("leaves.mass_g", leaves.mass_g)] {
            within(key, value, (0.0..=50.0).contains(&value), "between 0 and 50 g")?;
        }
        for (key, value) in [("tropism.light", tropism.light), ("tropism.gravity", tropism.gravity)] {
            within(key, value, (0.0..=10.0).contains(&value), RATE)?;
        }
        for (key, value) in [
            ("tropism.bias_x", tropism.bias_x),
            ("tropism.bias_z", tropism.bias_z),
            ("stem.tilt_x", stem.tilt_x),
            ("stem.tilt_z", stem.tilt_z),
            ("leaves.swing", leaves.swing),
        ] {
            within(key, value, value.abs() <= 1.5, TILT)?;
        }
        for (key, value) in [
            ("nutation.azimuth", nutation.azimuth),
            ("leaves.azimuth", leaves.azimuth),
            ("leaves.swing_phase", leaves.swing_phase),
        ] {
            within(key, value, value.abs() <= 10.0, "an angle between -10 and 10 rad")?;
        }
        for (key, value) in [
            ("fluctuation.motility", fluctuation.motility),
            ("fluctuation.growth", fluctuation.growth),
            ("fluctuation.curvature", fluctuation.curvature),
            ("fluctuation.phase", fluctuation.phase),
            ("nutation.curvature", nutation.curvature),
            ("pauses.episodes_per_h", pauses.episodes_per_h),
        ] {
            within(key, value, (0.0..=2.0).contains(&value), "between 0 and 2")?;
        }
        within("growth.rate", growth.rate, (0.0..=1.0).contains(&growth.rate), "0 to 1 cm per step")?;
        let exponent = tropism.light_exponent;
        within("tropism.light_exponent", exponent, (0.0..=2.0).contains(&exponent), "between 0 and 2")?;
        positive("tropism.balance", tropism.balance, 100.0, "more than 0 and at most 100")?;
        within("nutation.hand", nutation.hand, nutation.hand.abs() == 1.0, "1 or -1")
    }
}

impl Spread {
    fn check(&self) -> Result<(), SpeciesError> {
        for (key, value) in [
            ("spread.growth_rate", self.growth_rate),
            ("spread.growth_zone", self.growth_zone),
            ("spread.growth_slows_h", self.growth_slows_h),
            ("spread.motility_zone_young", self.motility_zone_young),
            ("spread.motility_zone", self.motility_zone),
            ("spread.motility_zone_h", self.motility_zone_h),
            ("spread.motility_mature_h", self.motility_mature_h),
            ("spread.motility_maturing_h", self.motility_maturing_h),
            ("spread.tropism_light", self.tropism_light),
            ("spread.tropism_light_memory_h", self.tropism_light_memory_h),
            ("spread.tropism_gravity", self.tropism_gravity),
            ("spread.tropism_gravity_memory_h", self.tropism_gravity_memory_h),
            ("spread.tropism_balance", self.tropism_balance),
            ("spread.tropism_bias_x", self.tropism_bias_x),
            ("spread.tropism_bias_z", self.tropism_bias_z),
            ("spread.nutation_period_h", self.nutation_period_h),
            ("spread.nutation_curvature", self.nutation_curvature),
            ("spread.nutation_roundness", self.nutation_roundness[0]),
            ("spread.nutation_roundness", self.nutation_roundness[1]),
            ("spread.nutation_other_hand", self.nutation_other_hand),
            ("spread.stem_tilt", self.stem_tilt),
            ("spread.stem_modulus", self.stem_modulus),
            ("spread.stem_radius", self.stem_radius),
            ("spread.stem_tip_g", self.stem_tip_g),
            ("spread.leaves_length", self.leaves_length),
            ("spread.leaves_mass_g", self.leaves_mass_g),
            ("spread.leaves_unfold_h", self.leaves_unfold_h),
            ("spread.leaves_swing_period_h", self.leaves_swing_period_h),
            ("spread.leaves_swing", self.leaves_swing),
            ("spread.pauses_unfolding_h", self.pauses_unfolding_h),
            ("spread.pauses_trifoliate_h", self.pauses_trifoliate_h),
        ] {
            share(key, value)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_keep_the_mean_and_the_spread() {
        let species = Species::default();
        let draws: Vec<f64> = (0..4000).map(|seed| species.draw(seed, 1.0).tropism.light).collect();
        let mean = draws.iter().sum::<f64>() / 4000.0;
        let sd = (draws.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
        assert!((mean / 0.135 - 1.0).abs() < 0.01, "{mean}");
        assert!((sd / mean / 0.19 - 1.0).abs() < 0.05, "{}", sd / mean);
        let left_turners = (0..4000).filter(|&seed| species.draw(seed, 1.0).nutation.hand < 0.0).count();
        assert!((340..460).contains(&left_turners), "{left_turners}");
    }

    #[test]
    fn check_names_key_value_and_range() {
        let mut species = Species::default();
        assert_eq!(species.check(), Ok(()));
        species.typical.stem.radius_apex = -1.0;
        let error = species.check().unwrap_err().to_string();
        assert_eq!(error, "found typical.stem.radius_apex = -1, wanted a radius between 0.01 and 2 cm");
        species.typical.stem.radius_apex = f64::NAN;
        assert!(species.check().is_err());
    }

    #[test]
    fn a_species_is_a_file() {
        let text = toml::to_string(&Species::default()).unwrap();
        assert_eq!(toml::from_str::<Species>(&text).unwrap(), Species::default());
        let few = "[typical.growth]\nrate = 0.02\n";
        assert_eq!(toml::from_str::<Species>(few).unwrap().typical.growth.rate, 0.02);
        assert!(toml::from_str::<Species>("[typical.growth]\nspeed = 1\n").is_err());
    }

    #[test]
    fn a_mirror_of_a_mirror_is_the_plant() {
        let plant = Species::default().draw(3, 1.0);
        let twice = plant.mirrored().mirrored();
        assert!((twice.nutation.azimuth - plant.nutation.azimuth).abs() < 1e-12);
        assert_eq!(twice.tropism, plant.tropism);
        assert_eq!(twice.stem, plant.stem);
    }
}
