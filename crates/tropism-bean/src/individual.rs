//! The parameters of one plant.
//!
//! The defaults are those of the typical bush bean.
//!
//! Confidence of each value: A known, B order of magnitude, C guess. "Tuned" values were set by hand while watching the
//! acceptance statistics, so these are a calibration and not a prediction.
//!
//! # References
//! Bastien, Bohr, Moulia, Douady 2013 (doi:10.1073/pnas.1214301109) for the balance of bending and straightening; Bastien,
//! Douady, Moulia 2015 (doi:10.1371/journal.pcbi.1004037) for the light exponent; Millet, Melin, Badot 1984 for the period of
//! nutation; Enright and Cumbie 1973 for internode growth; measurements of twining *Phaseolus vulgaris* 'Helda' published with
//! Ohad, Porat, Meroz for nutation, motile zone and Young's modulus.

use core::f64::consts::PI;

use serde::{Deserialize, Serialize};
use tropism::lamps::Colour;

use super::Internodal;

/// Unit of time of the rates in bean files that are given per five minutes (`growth.rate`, `fluctuation.phase`), in min:
/// the paper's period between photographs (section 2.2.1).
const FILE_RATE_MIN: f64 = 5.0;
/// Those units in an hour.
pub(crate) const FILE_RATES_PER_H: f64 = 60.0 / FILE_RATE_MIN;

/// The parameters of one plant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Individual {
    /// Elongation.
    pub growth: Growth,
    /// Motile zone: where and when the stem can bend.
    pub motility: Motility,
    /// Tropisms: phototropism, gravitropism, straightening.
    pub tropism: Tropism,
    /// Light of other colours.
    pub colours: Colours,
    /// Circumnutation.
    pub nutation: Nutation,
    /// The stem as an elastic rod.
    pub stem: Stem,
    /// The pair of primary leaves.
    pub leaves: Leaves,
    /// Pauses of the response.
    pub pauses: Pauses,
    /// Fluctuations of gains and curvature.
    pub fluctuation: Fluctuation,
    /// Another physiology of bending. Default: none; `motility`, `tropism` and `nutation` say how the stem bends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub internodal: Option<Internodal>,
}

/// Elongation of the growing zone below the apex.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// Share of elongation that remains (tuned).
    pub late: f64,
    /// Length of stem above its topmost contact with a solid, or else above the soil, at which elongation stops, in cm (C).
    /// Default: no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free_cm: Option<f64>,
}

/// The motile zone: the part below the apex whose curvature can change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// Share of motility that remains (tuned).
    pub late: f64,
}

/// Phototropism, gravitropism, autotropic straightening (proprioception), and a constant bias.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Tropism {
    /// Phototropic sensitivity nu, in rad/cm/h (tuned).
    pub light: f64,
    /// Exponent of the response to irradiance (A: 0.36 to 0.44).
    pub light_exponent: f64,
    /// Share of the light signal perceived at the apex; the rest is perceived locally (C).
    pub apical: f64,
    /// Time constant of each of two stages of photic memory, in h (B: lags of 4 to 75 minutes in other species).
    pub light_memory_h: f64,
    /// Gravitropic sensitivity beta, in rad/cm/h (tuned: a third of light's, set point near 45 degrees).
    pub gravity: f64,
    /// Time constant of gravity memory, in h (B: 13 to 15 minutes).
    pub gravity_memory_h: f64,
    /// Balance number: sensitivity times motile length over straightening rate (B: 0.9 to 9.3).
    pub balance: f64,
    /// Constant bending towards positive x, in rad/cm/h (C).
    pub bias_x: f64,
    /// Constant bending towards the camera, in rad/cm/h (C).
    pub bias_z: f64,
}

/// How much of the light of a lamp the plant bends to, by its colour: a share of its irradiance, 0 to 1.
///
/// Nothing else of the plant answers to colour: seedlings live on their cotyledons, and grow alike under all lamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Colours {
    /// Blue (A: phototropins absorb it).
    pub blue: f64,
    /// White (C: the share of blue in white LEDs).
    pub white: f64,
    /// Red (C: no bending, though it changes that to blue light in some plants).
    pub red: f64,
    /// Far red (C).
    pub far_red: f64,
}

impl Colours {
    /// The share of a lamp of `colour`.
    #[must_use]
    pub const fn share(&self, colour: Colour) -> f64 {
        match colour {
            Colour::Blue => self.blue,
            Colour::White => self.white,
            Colour::Red => self.red,
            Colour::FarRed => self.far_red,
        }
    }
}

/// Circumnutation: an elliptic oscillation of the curvature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// Distance from the apex beyond which the stem is rigid: it keeps its shape, bears any load, and costs no time to
    /// compute, in cm (C). Default: no part of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rigid_cm: Option<f64>,
}

/// The pair of primary leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// Age at which the cotyledons have fallen, in h (C); 0 if none are seen, as where they are the leaf pair.
    pub cotyledons_h: f64,
}

/// Pauses of the response. The paper reports one, while leaves unfolded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Pauses {
    /// Duration of the unfolding of the primary leaves, in h (C).
    pub unfolding_h: f64,
    /// Age at which the first trifoliate leaf unfolds, in h (C); it takes 0.8 of the primary leaves' time.
    pub trifoliate_h: f64,
    /// Motility while leaves unfold, as a share (C).
    pub motility: f64,
    /// Rate of non-response episodes without a visible cause, per h (tuned).
    pub episodes_per_h: f64,
}

/// Ornstein-Uhlenbeck gains and noise. Standard deviations of logarithms unless stated otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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
    /// Random walk of the phase of circumnutation, in rad per square root of five minutes (C).
    pub phase: f64,
}

impl Individual {
    /// The mirror image of the plant: x changes sign.
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
}

impl Default for Growth {
    fn default() -> Self {
        Self { start: 4.0, rate: 0.034, zone: 8.0, slows_h: 48.0, slowing_h: 7.0, late: 0.25, free_cm: None }
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
            light: 0.16,
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

impl Default for Colours {
    fn default() -> Self {
        Self { blue: 1.0, white: 0.2, red: 0.0, far_red: 0.0 }
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
            rigid_cm: None,
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
            cotyledons_h: 66.0,
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

#[cfg(test)]
mod tests {
    use crate::Species;

    #[test]
    fn a_mirror_of_a_mirror_is_the_plant() {
        let plant = Species::default().draw(3, 1.0);
        let twice = plant.mirrored().mirrored();
        assert!((twice.nutation.azimuth - plant.nutation.azimuth).abs() < 1e-12);
        assert_eq!(twice.tropism, plant.tropism);
        assert_eq!(twice.stem, plant.stem);
    }
}
