//! Species: the typical individual, and the variation between individuals.
//!
//! In: a seed and a scale. Out: the parameters of one plant. The idea: individual parameters are drawn from distributions around
//! those of the typical plant.

use core::f64::consts::{PI, TAU};

use rand::Rng;
use serde::{Deserialize, Serialize};
use tropism::math;
use tropism::random::{self, Purpose};

use super::Individual;

/// A species or cultivar: the typical individual and the spread around it. The default is a bush bean.
///
/// ```
/// use tropism_bean::Species;
/// let bean = Species::default();
/// assert_eq!(bean.draw(7, 1.0), bean.draw(7, 1.0));
/// assert_eq!(bean.draw(7, 0.0), bean.average());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Species {
    /// Name, for reports.
    pub name: String,
    /// The typical plant.
    pub typical: Individual,
    /// Variation between individuals.
    pub spread: Spread,
}

/// Variation between individuals: coefficients of variation (log-normal, mean preserved) unless stated otherwise.
///
/// A `scale` multiplies all of them: 0 for typical plants, 1 for the species, 2 for twice its variation. Guesses, apart from
/// the period of nutation (known) and what was tuned with the typical plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
        plant.internodal = plant.internodal.map(|internodal| internodal.varied(seed, scale, spread));
        plant
    }

    /// The typical plant, without any spread.
    #[must_use]
    pub fn average(&self) -> Individual {
        self.typical.clone()
    }
}

/// A positive factor of mean 1 with the coefficient of variation `variation`.
pub(super) fn log_normal(rng: &mut impl Rng, variation: f64) -> f64 {
    let sigma = math::ln(1.0 + variation * variation).sqrt();
    math::exp(sigma * random::normal(rng) - 0.5 * sigma * sigma)
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
        assert!((mean / 0.16 - 1.0).abs() < 0.01, "{mean}");
        assert!((sd / mean / 0.19 - 1.0).abs() < 0.05, "{}", sd / mean);
        let left_turners = (0..4000).filter(|&seed| species.draw(seed, 1.0).nutation.hand < 0.0).count();
        assert!((340..460).contains(&left_turners), "{left_turners}");
    }
}
