//! Climbing beans: winding, the rigid part of the stem, and the limit of its free part.

use tropism::lamps::MAX_LAMPS;
use tropism::obstacle::{Bar, Pole, Solid};
use tropism_bean::{Bean, Population, Species};

use super::{bits, distance};

fn species() -> Species {
    let species: Species = toml::from_str(include_str!("../../../../beans/climber.toml")).unwrap();
    species.check().unwrap();
    species
}

/// Climbing beans among solids, in the dark.
fn beans(seeds: std::ops::RangeInclusive<u64>, solids: &[Solid]) -> Vec<Bean> {
    let species = species();
    seeds.map(|seed| Bean::new(species.draw(seed, 1.0), seed).among(solids).with_substep(30.0)).collect()
}

fn stem(bean: &Bean) -> Vec<[f64; 3]> {
    bean.pose().stem.iter().map(|node| node.at).collect()
}

#[test]
fn six_of_six_plants_wind_round_a_pole_within_20_cm() {
    let pole = Pole { at: [0.0, 1.5], radius_cm: 0.4, height_cm: 90.0 };
    for (mut bean, seed) in beans(1..=6, &[pole.into()]).into_iter().zip(1..) {
        bean.advance(&[], 6.0 * 24.0 * 60.0);
        let stem: Vec<_> = stem(&bean).into_iter().filter(|place| place[1] < 20.0).collect();
        let turns = pole.turns_of(&stem);
        assert!(turns > 1.0, "plant {seed}: {turns} turns");
    }
}

#[test]
fn a_bar_that_leans_is_climbed_in_the_dark() {
    let bar = Bar { ends: [[-8.0, 0.0, 1.5], [52.0, 60.0, 1.5]], radius_cm: 0.4 };
    let [mut bean] = <[Bean; 1]>::try_from(beans(4..=4, &[bar.into()])).unwrap();
    bean.advance(&[], 8.0 * 24.0 * 60.0);
    let turns = bar.turns_of(&stem(&bean));
    assert!(turns > 2.0, "{turns} turns");
}

#[test]
fn without_a_support_the_shoot_stops_growing() {
    let [mut bean] = <[Bean; 1]>::try_from(beans(1..=1, &[])).unwrap();
    bean.advance(&[], 12.0 * 24.0 * 60.0);
    let free = species().typical.growth.free_cm.unwrap();
    assert!((bean.length() - free).abs() < 0.1, "{} cm", bean.length());
}

#[test]
fn what_is_rigid_keeps_its_shape() {
    let pole = Pole { at: [0.0, 1.5], radius_cm: 0.4, height_cm: 90.0 };
    let [mut bean] = <[Bean; 1]>::try_from(beans(2..=2, &[pole.into()])).unwrap();
    bean.advance(&[], 8.0 * 24.0 * 60.0);
    let (before, rigid) = (stem(&bean), bean.length() - species().typical.stem.rigid_cm.unwrap() - 1.0);
    bean.advance(&[0.0, 1.0], 4.0 * 24.0 * 60.0);
    let mut length = 0.0;
    for (places, after) in before.windows(2).zip(stem(&bean)) {
        length += distance(places[0], places[1]);
        if length < rigid {
            assert!(distance(places[0], after) < 1e-9);
        }
    }
    // Tipping the pot turns all of it.
    let apex = bean.apex();
    bean.tip_over(0.5);
    assert!((distance(bean.apex(), [0.0; 3]) - distance(apex, [0.0; 3])).abs() < 1e-9);
    assert!(distance(bean.apex(), apex) > 5.0);
}

#[test]
fn climbers_side_by_side_are_climbers_alone_to_the_bit() {
    let pole = Pole { at: [0.0, 1.5], radius_cm: 0.4, height_cm: 90.0 };
    let mut alone = beans(1..=7, &[pole.into()]);
    for (bean, days) in alone.iter_mut().zip([0.0, 4.0, 9.0, 0.0, 6.0, 7.0, 1.0]) {
        bean.advance(&[], days * 24.0 * 60.0);
    }
    let mut together = Population::new(alone.clone());
    for step in 0..100_u32 {
        let mut powers = [0.0; MAX_LAMPS];
        powers[step as usize / 25 % 2] = 0.1;
        together.advance(&[powers; 7], 5.0);
        for (number, bean) in alone.iter_mut().enumerate() {
            bean.advance(&powers, 5.0);
            assert!(bits(bean) == bits(&together.beans[number]), "bean {number} at step {step}");
        }
    }
}
