//! The light of the latest 24 hours: hours with a lamp lit, and photons at the plant; and what a rig allows of both.

use std::collections::VecDeque;
use std::fmt;

use serde::Serialize;
use tropism::lighting::Lighting;
use tropism_rig::file::RigFile;

use crate::journal::StepRecord;

/// Minutes of a day.
const DAY_MIN: f64 = 24.0 * 60.0;

/// What the lamps of a rig give, and how much of it a plant may have in any 24 hours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightLimits {
    /// Hours with a lamp lit; `None` for no limit.
    pub most_h: Option<f64>,
    /// Photons at the plant, in mol/m²; `None` for no limit.
    pub most_mol: Option<f64>,
    /// Photon flux density under each lamp at full power, in the order of the layout, in µmol/m²/s; empty if it is not known.
    pub flux: Vec<f64>,
}

impl LightLimits {
    /// Those of a rig file; a virtual tent has none.
    #[must_use]
    pub fn of(rig: &RigFile) -> Self {
        let lamps = rig.lamps.as_ref();
        Self {
            most_h: lamps.and_then(|lamps| lamps.max_light_h),
            most_mol: lamps.and_then(|lamps| lamps.max_mol),
            flux: lamps.and_then(|lamps| lamps.flux()).unwrap_or_default(),
        }
    }

    /// Whether there is any limit.
    pub(crate) const fn is_any(&self) -> bool {
        self.most_h.is_some() || self.most_mol.is_some()
    }

    /// Photons under `lighting` for some minutes, in mol/m².
    fn mol(&self, lighting: Lighting, minutes: f64) -> f64 {
        let flux: f64 = lighting.powers().iter().zip(&self.flux).map(|(power, flux)| power * flux).sum();
        flux * minutes * 60.0 * 1e-6
    }

    /// The first limit that `light` exceeds, in words.
    pub(crate) fn exceeded_by(&self, light: LightOfDay) -> Option<String> {
        let over_h = self
            .most_h
            .filter(|most| light.hours > *most)
            .map(|most| format!("{most} hours of light in a day"));
        let has_more = |most: &f64| light.mol.is_some_and(|mol| mol > *most);
        over_h
            .or_else(|| self.most_mol.filter(has_more).map(|most| format!("{most} mol/m² of light in a day")))
    }
}

/// The light of 24 hours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LightOfDay {
    /// Hours with a lamp lit.
    pub hours: f64,
    /// Photons at the plant, in mol/m²; `None` where the rig does not say what its lamps give.
    pub mol: Option<f64>,
}

impl LightOfDay {
    /// That of a real run up to the latest of its steps.
    pub(crate) fn of_run(rig: &RigFile, steps: &[StepRecord]) -> Option<Self> {
        let last = steps.last().filter(|_| !rig.is_virtual())?;
        let lighting = last.commanded().unwrap_or(Lighting::DARK);
        Some(LightDay::of(steps).with(last.step, lighting, &LightLimits::of(rig), rig.period_min))
    }
}

impl fmt::Display for LightOfDay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} h", self.hours)?;
        self.mol.map_or(Ok(()), |mol| write!(f, ", {mol:.2} mol/m²"))
    }
}

/// The steps of the latest day after which a lamp was lit, and their light.
#[derive(Debug, Default)]
pub(crate) struct LightDay {
    lit: VecDeque<(u32, Lighting)>,
}

impl LightDay {
    /// Those of a run: where the journal has a command, its lamps may have been lit.
    pub(crate) fn of(steps: &[StepRecord]) -> Self {
        let lit = steps.iter().filter_map(|step| Some((step.step, step.commanded()?)));
        Self { lit: lit.filter(|(_, lighting)| *lighting != Lighting::DARK).collect() }
    }

    /// Adds the light from `step` to the next one. A step whose decision is repeated after an interruption counts once.
    pub(crate) fn add(&mut self, step: u32, lighting: Lighting) {
        self.lit.pop_back_if(|(latest, _)| *latest == step);
        self.lit.push_back((step, lighting));
    }

    /// The light of the 24 hours that end with `lighting` from `step` to the next one.
    pub(crate) fn with(
        &mut self,
        step: u32,
        lighting: Lighting,
        limits: &LightLimits,
        period_min: f64,
    ) -> LightOfDay {
        let is_past = |&mut (lit, _): &mut (u32, Lighting)| f64::from(step + 1 - lit) * period_min > DAY_MIN;
        while self.lit.pop_front_if(is_past).is_some() {}
        let before = self.lit.iter().filter(|(lit, _)| *lit != step).map(|(_, lighting)| *lighting);
        let now = (lighting != Lighting::DARK).then_some(lighting);
        let (steps, mol) = before
            .chain(now)
            .fold((0_u32, 0.0), |(steps, mol), lighting| (steps + 1, mol + limits.mol(lighting, period_min)));
        LightOfDay {
            hours: f64::from(steps) * period_min / 60.0,
            mol: (!limits.flux.is_empty()).then_some(mol),
        }
    }
}

#[cfg(test)]
mod tests {
    use tropism::lamps::Light;

    use super::*;

    #[test]
    fn photons_are_counted_by_level_and_leave_after_a_day() {
        let limits = LightLimits { most_mol: Some(1.0), flux: vec![10.0, 100.0], ..LightLimits::default() };
        let (left, right) = (Lighting::only(Light::LEFT), Lighting::DARK.with(Light::RIGHT, 51));
        let mut day = LightDay::default();
        // An hour a step: 10 µmol/m²/s are 0.036 mol/m², a fifth of 100 twice as many.
        day.add(0, left);
        day.add(1, right);
        day.add(1, right);
        let light = day.with(2, left, &limits, 60.0);
        assert_eq!(light.hours, 3.0);
        assert!((light.mol.unwrap() - 0.144).abs() < 1e-12, "{light:?}");
        assert_eq!(limits.exceeded_by(light), None);
        // The day that ends with step 24 began with step 1.
        let later = day.with(24, Lighting::DARK, &limits, 60.0);
        assert!((later.mol.unwrap() - 0.072).abs() < 1e-12, "{later:?}");
        let over = LightOfDay { hours: 1.0, mol: Some(1.1) };
        assert_eq!(limits.exceeded_by(over).unwrap(), "1 mol/m² of light in a day");
        assert_eq!(day.with(24, Lighting::DARK, &LightLimits::default(), 60.0).mol, None);
    }
}
