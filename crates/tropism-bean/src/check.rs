//! Range checks of bean files.

use tropism::check::{OutOfRange, ensure};

use super::{Individual, Species, Spread};

impl Species {
    /// Checks that every value lies in its range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first key that is not, its value, and the range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.typical.check().map_err(|error| error.in_table("typical"))?;
        self.spread.check()
    }
}

fn share(key: &str, value: f64) -> Result<(), OutOfRange> {
    ensure((0.0..=1.0).contains(&value), key, value, "a share between 0 and 1")
}

impl Individual {
    fn check(&self) -> Result<(), OutOfRange> {
        const RATE: &str = "between 0 and 10 rad/cm/h";
        const TILT: &str = "between -1.5 and 1.5";
        let Self { growth, motility, tropism, nutation, stem, leaves, pauses, fluctuation, internodal } =
            self;
        for (key, value) in [
            ("growth.start", growth.start),
            ("growth.zone", growth.zone),
            ("motility.zone_young", motility.zone_young),
            ("motility.zone", motility.zone),
            ("motility.edge", motility.edge),
            ("stem.modulus_length", stem.modulus_length),
            ("leaves.length", leaves.length),
        ] {
            ensure((0.05..=60.0).contains(&value), key, value, "a length between 0.05 and 60 cm")?;
        }
        for (key, value) in [
            ("growth.slows_h", growth.slows_h),
            ("growth.slowing_h", growth.slowing_h),
            ("motility.zone_h", motility.zone_h),
            ("motility.mature_h", motility.mature_h),
            ("motility.maturing_h", motility.maturing_h),
            ("leaves.unfold_h", leaves.unfold_h),
            ("leaves.swing_period_h", leaves.swing_period_h),
            ("pauses.unfolding_h", pauses.unfolding_h),
            ("pauses.trifoliate_h", pauses.trifoliate_h),
            ("fluctuation.motility_h", fluctuation.motility_h),
            ("fluctuation.growth_h", fluctuation.growth_h),
        ] {
            ensure((0.1..=1e4).contains(&value), key, value, "between 0.1 and 10000 h")?;
        }
        for (key, value) in [
            ("tropism.light_memory_h", tropism.light_memory_h),
            ("tropism.gravity_memory_h", tropism.gravity_memory_h),
            ("stem.lag_h", stem.lag_h),
        ] {
            ensure((0.005..=6.0).contains(&value), key, value, "between 0.005 h (18 s) and 6 h")?;
        }
        // In minutes it would be beyond a day.
        let period = nutation.period_h;
        ensure((0.1..=24.0).contains(&period), "nutation.period_h", period, "between 0.1 and 24 h")?;
        let fall = leaves.cotyledons_h;
        ensure((0.0..=1e4).contains(&fall), "leaves.cotyledons_h", fall, "between 0 and 10000 h")?;
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
            ensure((0.01..=1.0).contains(&value), key, value, "a radius between 0.01 and 1 cm")?;
        }
        for (key, value) in
            [("stem.modulus_mpa", stem.modulus_mpa), ("stem.modulus_mature_mpa", stem.modulus_mature_mpa)]
        {
            ensure((1.0..=1e5).contains(&value), key, value, "between 1 and 100000 MPa")?;
        }
        for (key, value) in [("stem.tip_g", stem.tip_g), ("leaves.mass_g", leaves.mass_g)] {
            ensure((0.0..=50.0).contains(&value), key, value, "between 0 and 50 g")?;
        }
        for (key, value) in [("tropism.light", tropism.light), ("tropism.gravity", tropism.gravity)] {
            ensure((0.0..=10.0).contains(&value), key, value, RATE)?;
        }
        for (key, value) in [
            ("tropism.bias_x", tropism.bias_x),
            ("tropism.bias_z", tropism.bias_z),
            ("stem.tilt_x", stem.tilt_x),
            ("stem.tilt_z", stem.tilt_z),
            ("leaves.swing", leaves.swing),
        ] {
            ensure(value.abs() <= 1.5, key, value, TILT)?;
        }
        for (key, value) in [
            ("nutation.azimuth", nutation.azimuth),
            ("leaves.azimuth", leaves.azimuth),
            ("leaves.swing_phase", leaves.swing_phase),
        ] {
            ensure(value.abs() <= 10.0, key, value, "an angle between -10 and 10 rad")?;
        }
        for (key, value) in [
            ("fluctuation.motility", fluctuation.motility),
            ("fluctuation.growth", fluctuation.growth),
            ("fluctuation.curvature", fluctuation.curvature),
            ("fluctuation.phase", fluctuation.phase),
            ("nutation.curvature", nutation.curvature),
            ("pauses.episodes_per_h", pauses.episodes_per_h),
        ] {
            ensure((0.0..=2.0).contains(&value), key, value, "between 0 and 2")?;
        }
        ensure(
            (0.0..=0.2).contains(&growth.rate),
            "growth.rate",
            growth.rate,
            "0 to 0.2 cm per five minutes",
        )?;
        let exponent = tropism.light_exponent;
        ensure((0.0..=2.0).contains(&exponent), "tropism.light_exponent", exponent, "between 0 and 2")?;
        let balance = tropism.balance;
        ensure((0.01..=100.0).contains(&balance), "tropism.balance", balance, "between 0.01 and 100")?;
        ensure(nutation.hand.abs() == 1.0, "nutation.hand", nutation.hand, "1 or -1")?;
        internodal
            .as_ref()
            .map_or(Ok(()), |internodal| internodal.check().map_err(|error| error.in_table("internodal")))
    }
}

impl Spread {
    fn check(&self) -> Result<(), OutOfRange> {
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
        let [least, most] = self.nutation_roundness;
        ensure(least <= most, "spread.nutation_roundness", least, "the least before the most")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_names_key_value_and_range() {
        let mut species = Species::default();
        assert_eq!(species.check(), Ok(()));
        species.typical.stem.radius_apex = -1.0;
        let error = species.check().unwrap_err().to_string();
        assert_eq!(error, "found typical.stem.radius_apex = -1, wanted a radius between 0.01 and 1 cm");
        species.typical.stem.radius_apex = f64::NAN;
        assert!(species.check().is_err());
        let mut species = Species::default();
        species.spread.nutation_roundness = [0.9, 0.3];
        let error = species.check().unwrap_err().to_string();
        assert_eq!(error, "found spread.nutation_roundness = 0.9, wanted the least before the most");
    }
}
