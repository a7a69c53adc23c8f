//! A model of the tip before a wall, whose lamps may be near and several lit at once.
//!
//! In: paths of apices under known lightings. Out: a model that predicts the next step of a tip. The idea: the tip goes on as
//! it went, is pulled by the light that it has seen of late, and is drawn back to the middle:
//!
//! `dx' = a dx + b u + c x + noise`, with the remembered pull `u` of the light along x, and `dy = growth`.
//!
//! The light adds up by the inverse square of the distance, and pulls with a power of its strength (power law of phototropism,
//! Bastien, Douady and Moulia 2015, doi:10.1371/journal.pcbi.1004037). The coefficients come from least squares; the power
//! and the memory are those of a grid that leave the least residual.

use serde::{Deserialize, Serialize};

use super::proximity::{Patch, STEM_RADIUS_CM};
use super::wall::NodeWall;
use crate::lighting::Lighting;
use crate::math::matrix::least_squares;
use crate::math::statistics::{mean, standard_deviation};
use crate::math::vector::{Vec3, along, norm, scale, sub};
use crate::math::{exp, ln};
use crate::random::{NoiseStream, Purpose};

/// Powers of the irradiance that are tried. Chosen: from nearly no effect of intensity to proportional.
const POWERS: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];
/// Memories of the light that are tried, in h. Chosen: around the bean's, each twice the one before.
const MEMORIES_H: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Distance at which a lamp of the paper has the reference irradiance, in cm (section 2.1).
const LAMP_CM: f64 = 35.0;
/// Least distance from a lamp that counts, in cm. Chosen: a plant that touches it has no infinite light.
const LEAST_CM: f64 = 1.0;
/// Length of stem below the tip that a sensor sees, and of its pieces, in cm. Chosen: beyond it the echo is negligible.
const STEM_CM: [f64; 2] = [10.0, 1.0];

/// The path of an apex before a wall, and how the lamps were lit: one more place than lightings.
#[derive(Clone, Debug, PartialEq)]
pub struct LitPath {
    /// The apex at each step, in cm.
    pub apex: Vec<Vec3>,
    /// How the nodes were lit from this step to the next.
    pub lit: Vec<Lighting>,
}

/// The model of a tip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WallTip {
    /// Factors of the last step, of the pull of the light in cm, and of x.
    pub factors: [f64; 3],
    /// Standard deviation of a step along x beside the prediction, in cm.
    pub noise_cm: f64,
    /// Mean growth a step, its standard deviation between plants, and within a plant, in cm.
    pub growth_cm: [f64; 3],
    /// Height at the start, in cm.
    pub start_cm: f64,
    /// Power of the irradiance.
    pub power: f64,
    /// Time constant of the memory of light, in h.
    pub memory_h: f64,
    /// Time from one step to the next, in h.
    pub period_h: f64,
}

/// A growing tip.
#[derive(Clone, Debug)]
pub struct GrowingTip {
    model: WallTip,
    noise: NoiseStream,
    growth_cm: f64,
    at: [f64; 2],
    last: f64,
    pull: f64,
    step: u32,
}

/// Pull of the light along x at `at`, by lamps of `wall` lit as `lighting`.
fn pull(wall: &NodeWall, lighting: Lighting, at: Vec3, power: f64) -> f64 {
    let mut light = [0.0; 3];
    for (lamp, level) in lighting.lit() {
        let towards = sub(wall.nodes[lamp.index()].at, at);
        let far = norm(towards).max(LEAST_CM);
        let strength = wall.power * f64::from(level) / 255.0 * (LAMP_CM / far).powi(2);
        light = along(light, towards, strength / far);
    }
    let strength = norm(light);
    if strength > 0.0 { light[0] * exp((power - 1.0) * ln(strength)) } else { 0.0 }
}

impl WallTip {
    /// Fits the model to paths before `wall`, with `period_h` from one step to the next; `None` if they are too short, or never
    /// lit.
    #[must_use]
    pub fn fit(paths: &[LitPath], wall: &NodeWall, period_h: f64) -> Option<Self> {
        let grid = POWERS.iter().flat_map(|&power| MEMORIES_H.map(|memory_h| (power, memory_h)));
        let fit = |(power, memory_h)| Self::fit_with(paths, wall, period_h, power, memory_h);
        grid.filter_map(fit).min_by(|one, other| one.noise_cm.total_cmp(&other.noise_cm))
    }

    fn fit_with(
        paths: &[LitPath],
        wall: &NodeWall,
        period_h: f64,
        power: f64,
        memory_h: f64,
    ) -> Option<Self> {
        let share = 1.0 - exp(-period_h / memory_h);
        let (mut rows, mut steps) = (Vec::new(), Vec::new());
        for LitPath { apex, lit } in paths {
            let mut remembered = 0.0;
            for (place, lighting) in lit.iter().enumerate().take(apex.len().saturating_sub(1)) {
                remembered += share * (pull(wall, *lighting, apex[place], power) - remembered);
                if place > 0 {
                    rows.push([apex[place][0] - apex[place - 1][0], remembered, apex[place][0]]);
                    steps.push(apex[place + 1][0] - apex[place][0]);
                }
            }
        }
        let factors = least_squares(&rows, &steps, 1e-12)?;
        let residual = |(row, step): (&[f64; 3], &f64)| {
            step - row.iter().zip(&factors).map(|(value, factor)| value * factor).sum::<f64>()
        };
        let residuals: Vec<f64> = rows.iter().zip(&steps).map(residual).collect();
        let growth = |path: &LitPath| -> Vec<f64> {
            path.apex.windows(2).map(|pair| pair[1][1] - pair[0][1]).collect()
        };
        let grown: Vec<Vec<f64>> = paths.iter().map(growth).filter(|grown| grown.len() > 1).collect();
        let means: Vec<f64> = grown.iter().map(|grown| mean(grown.iter().copied())).collect();
        let within = mean(grown.iter().map(|grown| standard_deviation(grown)));
        Some(Self {
            factors,
            noise_cm: standard_deviation(&residuals),
            growth_cm: [mean(means.iter().copied()), standard_deviation(&means), within],
            start_cm: mean(paths.iter().filter_map(|path| path.apex.first()).map(|apex| apex[1])),
            power,
            memory_h,
            period_h,
        })
    }

    /// A tip at its start. `noise` names the plant.
    #[must_use]
    pub fn seedling(&self, seed: u64, number: u32) -> GrowingTip {
        let noise = NoiseStream::new(seed, Purpose::Growth, [number, u32::MAX, 0]);
        let [growth, between, _] = self.growth_cm;
        let growth_cm = (growth + between * noise.of_seedling().normal()).max(0.2 * growth);
        GrowingTip { model: *self, noise, growth_cm, at: [0.0, self.start_cm], last: 0.0, pull: 0.0, step: 0 }
    }
}

impl GrowingTip {
    /// Where the tip is: x and y, in cm.
    #[must_use]
    pub const fn at(&self) -> [f64; 2] {
        self.at
    }

    /// The tip a step later.
    pub fn step(&mut self, wall: &NodeWall, lighting: Lighting) {
        let WallTip { factors: [a, b, c], noise_cm, growth_cm, power, memory_h, period_h, .. } = self.model;
        let share = 1.0 - exp(-period_h / memory_h);
        self.pull += share * (pull(wall, lighting, [self.at[0], self.at[1], 0.0], power) - self.pull);
        let mut draws = self.noise.at(self.step);
        let dx = a * self.last + b * self.pull + c * self.at[0] + noise_cm * draws.normal();
        let dy = self.growth_cm + growth_cm[2] * draws.normal();
        self.at = [self.at[0] + dx, (self.at[1] + dy).max(0.5)];
        self.last = dx;
        self.step += 1;
    }

    /// The upper stem as sensors see it: a straight line towards the root.
    #[must_use]
    pub fn patches(&self) -> Vec<Patch> {
        let [length, piece] = STEM_CM;
        let tip = [self.at[0], self.at[1], 0.0];
        let far = norm(tip);
        let down = scale(tip, -1.0 / far);
        let count = (length.min(far) / piece).max(1.0) as u32;
        let patch = |number: u32| Patch {
            at: along(tip, down, piece * (f64::from(number) + 0.5)),
            area: 2.0 * STEM_RADIUS_CM * piece,
        };
        (0..count).map(patch).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lamps::Light;

    /// Paths of a known model under lamps that change every six hours.
    fn paths(model: &WallTip, wall: &NodeWall) -> Vec<LitPath> {
        let path = |number: u32| {
            let mut tip = model.seedling(1, number);
            let mut path = LitPath { apex: vec![[0.0, model.start_cm, 0.0]], lit: Vec::new() };
            for step in 0..500_u32 {
                let lamp = Light::new(((step / 72 + number) * 5 % 6) as usize).unwrap();
                tip.step(wall, Lighting::only(lamp));
                path.apex.push([tip.at()[0], tip.at()[1], 0.0]);
                path.lit.push(Lighting::only(lamp));
            }
            path
        };
        (0..12).map(path).collect()
    }

    #[test]
    fn a_fit_finds_the_model_that_made_the_paths() {
        let wall = NodeWall::three_levels();
        let model = WallTip {
            factors: [0.6, 0.05, -0.02],
            noise_cm: 0.05,
            growth_cm: [0.03, 0.003, 0.01],
            start_cm: 4.0,
            power: 0.4,
            memory_h: 1.0,
            period_h: 1.0 / 12.0,
        };
        let found = WallTip::fit(&paths(&model, &wall), &wall, model.period_h).unwrap();
        assert_eq!(found.memory_h, model.memory_h);
        // Neighbouring powers explain 12 plants about as well.
        assert!((found.power - model.power).abs() < 0.3, "{}", found.power);
        for (one, other) in found.factors.iter().zip(model.factors) {
            assert!((one - other).abs() < 0.15 * other.abs(), "{:?}", found.factors);
        }
        assert!((found.noise_cm - 0.05).abs() < 0.003 && (found.growth_cm[0] - 0.03).abs() < 0.003);
        assert!(WallTip::fit(&[], &wall, model.period_h).is_none());
    }

    #[test]
    fn light_pulls_to_its_side_and_a_nearer_lamp_wins() {
        let wall = NodeWall::three_levels();
        let [left, right] = [0, 1].map(|number| Lighting::only(Light::new(number).unwrap()));
        let at = |x: f64| [x, 8.0, 0.0];
        assert!(pull(&wall, left, at(0.0), 0.4) < 0.0 && pull(&wall, right, at(0.0), 0.4) > 0.0);
        let both = left.with(Light::new(1).unwrap(), 255);
        assert!(pull(&wall, both, at(0.0), 0.4).abs() < 1e-12 && pull(&wall, both, at(2.0), 0.4) > 0.0);
        assert_eq!(pull(&wall, Lighting::DARK, at(0.0), 0.4), 0.0);
    }
}
