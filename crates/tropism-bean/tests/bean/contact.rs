//! Contact of the virtual bean with solids.

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::math::hypot;
use tropism::obstacle::{Obstacle, Pole, Solid};
use tropism_bean::view::project;
use tropism_bean::{Bean, Population, Species, lamp_powers};

use super::{bits, distance, internodal};

/// How deep a stem may dent a solid or be dented by it, in cm, as `docs/explanation/contact.md` states.
const DEPTH_CM: f64 = 0.05;

fn point() -> impl Strategy<Value = Point> {
    (-8.0..8.0, 5.5..16.0).prop_map(|(x, y)| Point::new(x, y))
}

/// A solid that leaves room for the seedling.
fn solid() -> impl Strategy<Value = Solid> {
    let pole = ([-5.0..5.0, -5.0..5.0], 0.2..1.0, 5.0..40.0_f64)
        .prop_map(|(at, radius_cm, height_cm)| Pole { at, radius_cm, height_cm })
        .prop_filter("the seedling needs room", |pole| hypot(pole.at[0], pole.at[1]) > pole.radius_cm + 1.0);
    prop_oneof![
        (point(), 0.2..1.2_f64).prop_map(|(centre, radius_cm)| Obstacle::Disc { centre, radius_cm }.into()),
        [point(), point()].prop_map(|corners| Obstacle::Box { corners }.into()),
        [point(), point()].prop_map(|ends| Obstacle::Line { ends }.into()),
        pole.prop_map(Solid::from),
    ]
}

/// How deep the stem is in a solid, in cm: from points half a millimetre apart, and radii between those of the nodes.
fn depth(bean: &Bean, solids: &[Solid]) -> f64 {
    let stem = bean.pose().stem;
    let mut deepest = f64::NEG_INFINITY;
    for pair in stem.windows(2) {
        for step in 0..=10 {
            let share = f64::from(step) / 10.0;
            let [x, y, z] =
                core::array::from_fn(|axis| pair[0].at[axis] + share * (pair[1].at[axis] - pair[0].at[axis]));
            let radius = pair[0].radius + share * (pair[1].radius - pair[0].radius);
            for solid in solids {
                let clear = match solid {
                    Solid::Bar(bar) => bar.distance_and_normal([x, y, z]).0,
                    Solid::Pole(pole) => hypot(x - pole.at[0], z - pole.at[1]).max(0.0) - pole.radius_cm,
                    // In the plane of the picture what is nearer is larger.
                    Solid::Plane(obstacle) => obstacle.distance(project([x, y, z])) * (74.0 - z) / 74.0,
                };
                if matches!(solid, Solid::Pole(pole) if y > pole.height_cm) {
                    continue;
                }
                deepest = deepest.max(radius - clear);
            }
        }
    }
    deepest
}

fn species(seed: u64) -> Species {
    if seed.is_multiple_of(2) { Species::default() } else { internodal() }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_solid_that_is_not_touched_hardly_moves_the_apex(
        seed in any::<u64>(), lights in prop::collection::vec((0.0..1.0, 0.0..1.0, 1..60_u32), 1..6),
    ) {
        let mut bean = Bean::new(species(seed).draw(seed, 1.0), seed);
        let far = [Pole { at: [0.0, 60.0], radius_cm: 5.0, height_cm: 90.0 }.into(),
            Obstacle::Disc { centre: Point::new(-45.0, 3.0), radius_cm: 4.0 }.into()];
        let mut among = bean.clone().among(&far);
        for (left, right, steps) in lights {
            for bean in [&mut bean, &mut among] {
                bean.advance(&[left, right], 5.0 * f64::from(steps));
            }
            // Among solids the integration is of first order.
            prop_assert!(distance(bean.apex(), among.apex()) < 0.2, "{:?} {:?}", bean.apex(), among.apex());
        }
    }

    #[test]
    fn mirrored_solids_bend_the_mirror_image(
        seed in any::<u64>(), solids in prop::collection::vec(solid(), 1..3),
        lights in prop::collection::vec((0.0..1.0, 0.0..1.0), 10..40),
    ) {
        let individual = species(seed).draw(seed, 1.0);
        let mirrored: Vec<Solid> = solids.iter().map(|solid| solid.mirrored()).collect();
        let mut bean = Bean::noise_free(individual.clone()).among(&solids);
        let mut twin = Bean::noise_free(individual.mirrored()).among(&mirrored);
        let mut apart = 0.0_f64;
        for (left, right) in lights {
            bean.advance(&[left, right], 30.0);
            twin.advance(&[right, left], 30.0);
            let [x, y, z] = bean.apex();
            apart = apart.max(distance([-x, y, z], twin.apex()));
        }
        prop_assert!(apart < 1e-6, "{apart} cm");
    }
}

/// How deep in cm the stem of a random bean goes into random solids under random light, in each of some scenes.
fn depths(scenes: usize) -> impl Iterator<Item = f64> {
    let lights = prop::collection::vec((0.0..1.0, 0.0..1.0, 1..80_u32), 4..16);
    let scene = (any::<u64>(), prop::collection::vec(solid(), 1..4), lights);
    let mut runner = TestRunner::deterministic();
    (0..scenes).map(move |_| {
        let (seed, solids, lights) = scene.new_tree(&mut runner).unwrap().current();
        let mut bean = Bean::new(species(seed).draw(seed, 1.0), seed).among(&solids);
        let mut deepest = f64::NEG_INFINITY;
        for (left, right, steps) in lights {
            for _ in 0..steps {
                bean.advance(&[left, right], 5.0);
                deepest = deepest.max(depth(&bean, &solids));
            }
        }
        deepest
    })
}

#[test]
fn no_stem_goes_into_a_solid() {
    for (deepest, scene) in depths(48).zip(1..) {
        assert!(deepest < DEPTH_CM, "{deepest} cm deep in scene {scene}");
    }
}

#[test]
#[ignore = "two minutes: prints how rarely a stem that is jammed goes into a solid"]
fn hardly_any_stem_goes_into_solids_that_jam_it() {
    const SCENES: usize = 4000;
    let deep = depths(SCENES).filter(|deepest| *deepest >= DEPTH_CM).count();
    println!("{deep} of {SCENES} stems went deeper than {DEPTH_CM} cm into a solid");
    assert!(deep <= SCENES / 200, "{deep}");
}

/// Sixteen beans of both physiologies, of which some have solids; each may touch others.
fn garden() -> Vec<Bean> {
    let disc = Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: 1.0 }.into();
    let bar = Obstacle::Line { ends: [Point::new(0.0, 6.5), Point::new(8.0, 6.5)] }.into();
    let shelf = Obstacle::Box { corners: [Point::new(-6.0, 9.0), Point::new(-0.5, 11.0)] }.into();
    let pole = |x, z| Pole { at: [x, z], radius_cm: 0.4, height_cm: 25.0 }.into();
    let scenes: [&[Solid]; 6] =
        [&[disc], &[], &[bar, shelf], &[pole(1.5, 0.3)], &[disc, pole(-2.0, -1.0)], &[]];
    let grown = |seed: u64| {
        let species = if seed % 8 == 3 { internodal() } else { Species::default() };
        let bean = Bean::new(species.draw(seed, 1.0), seed);
        let mut bean = bean.among(scenes[seed as usize % scenes.len()]);
        bean.advance(&[0.0, 1.0], seed as f64 * 40.0);
        bean
    };
    (0..16).map(grown).collect()
}

#[test]
fn beans_side_by_side_among_solids_are_beans_alone_to_the_bit() {
    let mut alone = garden();
    let mut together = Population::new(alone.clone());
    let mut touching = 0;
    for step in 0..250_u32 {
        let powers: Vec<_> = (0..16_u32)
            .map(|plant| {
                lamp_powers([None, Some(Light::LEFT), Some(Light::RIGHT)][(plant + step / 40) as usize % 3])
            })
            .collect();
        let minutes = [5.0, 7.0][step as usize % 2];
        together.advance(&powers, minutes);
        for (number, (bean, powers)) in alone.iter_mut().zip(&powers).enumerate() {
            bean.advance(powers, minutes);
            assert!(bits(bean) == bits(&together.beans[number]), "bean {number} at step {step}");
            assert_eq!(bean.contacts(), together.beans[number].contacts());
            touching += usize::from(!bean.contacts().is_empty());
        }
    }
    assert!(touching > 625, "{touching} of 4000 steps with contact");
}

#[test]
fn a_shorter_substep_hardly_moves_a_leaning_stem() {
    for solid in [
        Obstacle::Disc { centre: Point::new(4.0, 8.0), radius_cm: 1.0 }.into(),
        Pole { at: [2.0, -0.5], radius_cm: 0.3, height_cm: 30.0 }.into(),
    ] {
        let mut bean = Bean::noise_free(Species::default().average()).among(&[solid]);
        let mut twins = [7.5, 3.75].map(|seconds| bean.clone().with_substep(seconds));
        let (mut squares, mut touching) = ([0.0; 2], 0);
        for _ in 0..500 {
            bean.advance(&[0.0, 1.0], 5.0);
            touching += usize::from(!bean.contacts().is_empty());
            for (twin, sum) in twins.iter_mut().zip(&mut squares) {
                twin.advance(&[0.0, 1.0], 5.0);
                *sum += distance(bean.apex(), twin.apex()).powi(2);
            }
        }
        let rms = squares.map(|sum: f64| (sum / 500.0).sqrt());
        println!("{solid:?}: {rms:?} cm, {touching} steps with contact");
        assert!(rms[0] < 0.1 && touching > 100, "{rms:?} {touching}");
    }
}
