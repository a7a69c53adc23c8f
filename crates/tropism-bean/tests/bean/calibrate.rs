//! A virtual bean calibrated to a track.

use std::cell::Cell;

use tropism::math;
use tropism_bean::calibrate::{CalibrateError, calibrate};
use tropism_bean::{Species, acceptance};

#[test]
fn a_plant_unlike_its_species_is_found_out() {
    let mut other = Species::default();
    other.typical.growth.rate *= 1.3;
    other.typical.tropism.light *= 0.65;
    let track = acceptance::open_loop_experiment(&other, 3);
    let found = calibrate(&track, 5.0, &Species::default(), &|| true).unwrap().unwrap().estimates;
    let own = other.draw(3, 1.0);
    for (estimate, truth, typical) in
        [(found[0], own.growth.rate, 0.034), (found[1], own.tropism.light, 0.16)]
    {
        let (away, before) = (math::ln(estimate.value / truth).abs(), math::ln(typical / truth).abs());
        assert!(away < before, "{estimate:?}, true {truth}, typical {typical}");
        assert!(estimate.interval[0] < estimate.value && estimate.value < estimate.interval[1]);
    }
    assert!(found[0].prior_share < 0.8 && found[1].prior_share < 0.95, "{found:?}");
}

#[test]
fn a_short_track_says_that_it_says_nothing() {
    let species = Species::default();
    let mut track = acceptance::open_loop_experiment(&species, 3);
    track.samples.truncate(94);
    let found = calibrate(&track, 5.0, &species, &|| true).unwrap().unwrap().estimates;
    assert!(found.iter().all(|estimate| (0.0..=1.0).contains(&estimate.prior_share)), "{found:?}");
    // Nothing at all of most, and a little of what light does to the tip.
    let silent = found.iter().filter(|estimate| estimate.prior_share > 0.95).count();
    assert!(silent >= 3 && found[3].prior_share > 0.8, "{found:?}");
    let asked = Cell::new(0);
    let few = || asked.replace(asked.get() + 1) < 3;
    assert_eq!(calibrate(&track, 5.0, &species, &few), Ok(None));
}

#[test]
fn a_track_must_tell_something() {
    let species = Species::default();
    let mut track = acceptance::open_loop_experiment(&species, 1);
    for (steps, wanted) in [(70, CalibrateError::OneLamp), (40, CalibrateError::Short(40))] {
        track.samples.truncate(steps);
        assert_eq!(calibrate(&track, 5.0, &species, &|| true), Err(wanted));
    }
}
