//! Range checks of bean files.

use tropism::check::{OutOfRange, ensure};

use super::{Individual, Internodal, Species, Spread};

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

/// Ensures that the value of each key of a struct lies in a range.
macro_rules! ensure_in {
    ($of:ident, $range:expr, $wanted:literal: $($table:ident.$key:ident)+) => {
        for (key, value) in [$((concat!(stringify!($table), ".", stringify!($key)), $of.$table.$key)),+] {
            ensure(($range).contains(&value), key, value, $wanted)?;
        }
    };
}

impl Individual {
    fn check(&self) -> Result<(), OutOfRange> {
        ensure_in!(self, 0.05..=60.0, "a length between 0.05 and 60 cm": growth.start growth.zone motility.zone_young
            motility.zone motility.edge stem.modulus_length leaves.length);
        ensure_in!(self, 0.1..=1e4, "between 0.1 and 10000 h": growth.slows_h growth.slowing_h motility.zone_h
            motility.mature_h motility.maturing_h leaves.unfold_h leaves.swing_period_h pauses.unfolding_h
            pauses.trifoliate_h fluctuation.motility_h fluctuation.growth_h);
        ensure_in!(self, 0.005..=6.0, "between 0.005 h (18 s) and 6 h": tropism.light_memory_h tropism.gravity_memory_h
            stem.lag_h);
        // In minutes it would be beyond a day.
        ensure_in!(self, 0.1..=24.0, "between 0.1 and 24 h": nutation.period_h);
        ensure_in!(self, 0.0..=1e4, "between 0 and 10000 h": leaves.cotyledons_h);
        ensure_in!(self, 0.0..=1.0, "a share between 0 and 1": growth.late motility.late tropism.apical
            colours.blue colours.white colours.red colours.far_red
            nutation.roundness pauses.motility);
        ensure_in!(self, 0.01..=1.0, "a radius between 0.01 and 1 cm": stem.radius_apex stem.radius_base);
        ensure_in!(self, 1.0..=1e5, "between 1 and 100000 MPa": stem.modulus_mpa stem.modulus_mature_mpa);
        ensure_in!(self, 0.0..=50.0, "between 0 and 50 g": stem.tip_g leaves.mass_g);
        ensure_in!(self, 0.0..=10.0, "between 0 and 10 rad/cm/h": tropism.light tropism.gravity);
        ensure_in!(self, -1.5..=1.5, "between -1.5 and 1.5": tropism.bias_x tropism.bias_z stem.tilt_x stem.tilt_z
            leaves.swing);
        ensure_in!(self, -10.0..=10.0, "an angle between -10 and 10 rad": nutation.azimuth leaves.azimuth
            leaves.swing_phase);
        ensure_in!(self, 0.0..=2.0, "between 0 and 2": fluctuation.motility fluctuation.growth fluctuation.curvature
            fluctuation.phase nutation.curvature pauses.episodes_per_h);
        ensure_in!(self, 0.0..=0.2, "0 to 0.2 cm per five minutes": growth.rate);
        ensure_in!(self, 0.0..=2.0, "between 0 and 2": tropism.light_exponent);
        ensure_in!(self, 0.01..=100.0, "between 0.01 and 100": tropism.balance);
        ensure_in!(self, [-1.0, 1.0], "1 or -1": nutation.hand);
        for (key, value) in [("growth.free_cm", self.growth.free_cm), ("stem.rigid_cm", self.stem.rigid_cm)] {
            value
                .map_or(Ok(()), |value| ensure((10.0..=60.0).contains(&value), key, value, "10 to 60 cm"))?;
        }
        let internodal = self.internodal.as_ref().map_or(Ok(()), Internodal::check);
        internodal.map_err(|error| error.in_table("internodal"))
    }
}

impl Spread {
    fn check(&self) -> Result<(), OutOfRange> {
        macro_rules! shares {
            ($($key:ident)+) => {
                [$((concat!("spread.", stringify!($key)), self.$key)),+]
            };
        }
        let [least, most] = self.nutation_roundness;
        let roundness = [least, most].map(|share| ("spread.nutation_roundness", share));
        let shares = shares!(growth_rate growth_zone growth_slows_h motility_zone_young motility_zone motility_zone_h
            motility_mature_h motility_maturing_h tropism_light tropism_light_memory_h tropism_gravity
            tropism_gravity_memory_h tropism_balance tropism_bias_x tropism_bias_z nutation_period_h nutation_curvature
            nutation_other_hand stem_tilt stem_modulus stem_radius stem_tip_g leaves_length leaves_mass_g
            leaves_unfold_h leaves_swing_period_h leaves_swing pauses_unfolding_h pauses_trifoliate_h);
        for (key, value) in shares.into_iter().chain(roundness) {
            ensure((0.0..=1.0).contains(&value), key, value, "a share between 0 and 1")?;
        }
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
