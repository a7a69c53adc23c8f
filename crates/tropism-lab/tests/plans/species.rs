//! Species as files.

use tropism_bean::{Internodal, Species, experiments};

#[test]
fn the_common_bean_written_out_is_the_default() {
    let written: Species = toml::from_str(include_str!("../../../../beans/common-bean.toml")).unwrap();
    assert_eq!(written, Species::default());
    written.check().unwrap();
}

#[test]
fn the_internodal_bean_written_out_has_the_default_physiology() {
    let text = include_str!("../../../../beans/internodal-bean.toml");
    let species: Species = toml::from_str(text).unwrap();
    species.check().unwrap();
    assert_eq!(species.typical.internodal, Some(Internodal::default()));
    let one = species.draw(1, 1.0);
    assert_eq!(one, species.draw(1, 1.0));
    assert_ne!(one.internodal, species.draw(2, 1.0).internodal);
    assert_eq!(species.draw(1, 0.0), species.average());
    let text = text.replace("subtracted = 0.5", "subtracted = 1.5");
    let error = toml::from_str::<Species>(&text).unwrap().check().unwrap_err().to_string();
    assert_eq!(error, "found typical.internodal.subtracted = 1.5, wanted 0 to 1");
}

#[test]
fn a_sunflower_is_another_plant() {
    let sunflower: Species = toml::from_str(include_str!("../../../../beans/sunflower.toml")).unwrap();
    sunflower.check().unwrap();
    let circling = experiments::circumnutation(&sunflower.average(), 6.0, 10.0);
    assert!((100.0..120.0).contains(&circling.period_min), "{} min", circling.period_min);
    // Ellipses of 6 to 8 mm, end to end.
    assert!((0.3..0.4).contains(&circling.amplitude), "{} cm", circling.amplitude);
}

#[test]
fn a_species_is_a_file() {
    let text = toml::to_string(&Species::default()).unwrap();
    assert_eq!(toml::from_str::<Species>(&text).unwrap(), Species::default());
    let few = "[typical.growth]\nrate = 0.02\n";
    assert_eq!(toml::from_str::<Species>(few).unwrap().typical.growth.rate, 0.02);
    assert!(toml::from_str::<Species>("[typical.growth]\nspeed = 1\n").is_err());
}
