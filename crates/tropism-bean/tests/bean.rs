//! The virtual bean against its reference run, its symmetries, and the acceptance table.

#[path = "bean/calibrate.rs"]
mod calibrate;
#[path = "bean/climb.rs"]
mod climb;
#[path = "bean/contact.rs"]
mod contact;
#[path = "bean/fault.rs"]
mod fault;
#[path = "bean/reach.rs"]
mod reach;
#[path = "bean/render.rs"]
mod render;
#[path = "bean/rk4.rs"]
mod rk4;
#[path = "bean/tent.rs"]
mod tent;

use std::ops::ControlFlow;
use std::path::PathBuf;

use proptest::prelude::*;
use tropism::control::{Greedy, Periodic};
use tropism::environment::unwatched;
use tropism::geometry::Point;
use tropism::lamps::{Colour, Lamp, Layout, Light, MAX_LAMPS};
use tropism::math::statistics::median;
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism_bean::{Bean, Individual, Population, Species, Trial, acceptance, grow, lamp_powers};

/// The lamps of an open-loop experiment: they change every six hours, right first.
fn alternating(step: u32) -> [f64; 2] {
    if (step / 72).is_multiple_of(2) { [0.0, 1.0] } else { [1.0, 0.0] }
}

fn data(path: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("TROPISM_DATA") else {
        println!("skipped: TROPISM_DATA names no folder with {path}");
        return None;
    };
    Some(PathBuf::from(folder).join(path))
}

/// Root mean square, and greatest.
fn summary(apart: &[f64]) -> (f64, f64) {
    let squares: f64 = apart.iter().map(|apart| apart * apart).sum();
    ((squares / apart.len() as f64).sqrt(), apart.iter().copied().fold(0.0, f64::max))
}

#[test]
fn a_plant_bends_to_the_blue_of_a_lamp() {
    let lamps = |colour| {
        let [left, right] = Layout::wahby2016().lamps().to_vec().try_into().unwrap();
        Layout::new(vec![left, right, Lamp::new("top", [35.0, 30.0, -8.0]).with_colour(colour)]).unwrap()
    };
    let bend = |colour, powers: [f64; 3]| {
        let mut bean = Bean::noise_free(Species::default().average()).under(&lamps(colour));
        bean.advance(&powers, 360.0);
        bean.apex()
    };
    let red = [Colour::Red, Colour::FarRed].map(|colour| bend(colour, [1.0, 0.0, 1.0]));
    assert_eq!(red, [bend(Colour::Blue, [1.0, 0.0, 0.0]); 2]);
    let [blue, white] = [Colour::Blue, Colour::White].map(|colour| bend(colour, [0.0, 0.0, 1.0])[0]);
    assert!(0.3 < white && white < blue, "{white} {blue}");
}

#[test]
fn another_integrator_grows_the_same_plant() {
    const STEPS: u32 = 5;
    let plant = Species::default().average();
    let mut bean = Bean::noise_free(plant.clone());
    let mut fine = bean.clone().with_substep(3.0);
    let mut stem = rk4::Stem::seedling(&plant);
    let (mut reference, of_reference) = rk4::Stem::of_reference(&plant);
    let golden: Vec<Vec<f64>> = data("virtual-bean/golden_quiet.csv").map_or_else(Vec::new, |path| {
        csv::Reader::from_path(path).unwrap().deserialize().map(Result::unwrap).collect()
    });
    let [mut of_bean, mut of_fine, mut of_golden] = [(); 3].map(|()| Vec::new());
    for step in 0..1000 {
        for bean in [&mut bean, &mut fine] {
            bean.advance(&alternating(step), 5.0);
        }
        for _ in 0..STEPS {
            for (stem, plant) in [(&mut stem, &plant), (&mut reference, &of_reference)] {
                stem.step(plant, alternating(step), 1.0 / 12.0 / f64::from(STEPS));
            }
        }
        of_bean.push(distance(bean.apex(), stem.apex()));
        of_fine.push(distance(fine.apex(), stem.apex()));
        if let Some(row) = golden.iter().find(|row| row[0] == f64::from(step + 1)) {
            assert!((row[1] - reference.length()).abs() < 1e-3, "step {step}: {} cm", reference.length());
            of_golden.push(distance([row[2], row[3], row[4]], reference.apex()));
        }
    }
    // The reference run is of first order with a sub-step of 15 s.
    for (apart, rms, most) in [(&of_bean, 0.005, 0.02), (&of_golden, 0.05, 0.15), (&of_fine, 0.001, 0.003)] {
        let found = summary(apart);
        println!("{} places: {:.4} cm (rms), {:.4} cm at most", apart.len(), found.0, found.1);
        assert!(apart.is_empty() || found.0 < rms && found.1 < most, "{found:?} cm");
    }
}

/// Prints the median error of the tip and of the stem for some sub-steps: the table of `docs/validation/bean-integration.md`.
#[test]
#[ignore = "prints a table: cargo test --release -p tropism-bean --test bean substep -- --ignored --nocapture"]
fn errors_of_a_substep() {
    const HOURS: [u32; 3] = [10, 30, 80];
    const PLANTS: u64 = 32;
    let species = Species::default();
    let grown = |seconds: f64| {
        let bean = |seed| Bean::new(species.draw(seed, 1.0), seed).with_substep(seconds);
        let mut population = Population::new((0..PLANTS).map(bean).collect());
        let mut stems = Vec::new();
        for step in 0..12 * HOURS[2] {
            let mut powers = [0.0; MAX_LAMPS];
            powers[..2].copy_from_slice(&alternating(step));
            population.advance(&[powers; PLANTS as usize], 5.0);
            if HOURS.iter().any(|hours| 12 * hours == step + 1) {
                stems.push(population.beans.iter().map(|bean| bean.pose().stem).collect::<Vec<_>>());
            }
        }
        stems
    };
    println!("sub-step | hours | tip, cm | stem, cm");
    for seconds in [10.0, 15.0, 20.0, 30.0, 45.0, 60.0] {
        for ((coarse, fine), hours) in grown(seconds).iter().zip(grown(0.1 * seconds)).zip(HOURS) {
            let apart: Vec<Vec<f64>> = coarse
                .iter()
                .zip(&fine)
                .map(|(stem, other)| stem.iter().zip(other).map(|(a, b)| distance(a.at, b.at)).collect())
                .collect();
            let middle = |of: fn(&Vec<f64>) -> f64| median(&apart.iter().map(of).collect::<Vec<_>>());
            let (tip, stem) = (middle(|apart| apart[apart.len() - 1]), middle(|apart| summary(apart).0));
            println!("{seconds} s | {hours} h | {tip:.4} | {stem:.4}");
            assert!(tip < 0.02 && stem < 0.02);
        }
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

/// Every place of a pose: stem and leaf edges.
fn places(bean: &Bean) -> Vec<[f64; 3]> {
    let pose = bean.pose();
    let leaves = pose.leaves.iter().flat_map(|leaf| leaf.outline(8));
    pose.stem.iter().map(|node| node.at).chain(leaves).collect()
}

/// A lamp's power; often it is off.
fn power() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(1.0), 0.0..=1.0]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mirrored_bean_under_mirrored_lamps_is_the_mirror_image(
        seed in any::<u64>(), powers in prop::collection::vec((0.0..1.0, 0.0..1.0), 1..40),
    ) {
        let species = if seed % 2 == 0 { Species::default() } else { internodal() };
        let individual = species.draw(seed, 1.0);
        let mut bean = Bean::noise_free(individual.clone());
        let mut twin = Bean::noise_free(individual.mirrored());
        for (left, right) in powers {
            bean.advance(&[left, right], 30.0);
            twin.advance(&[right, left], 30.0);
            let ([x, y, z], image) = (bean.apex(), twin.apex());
            prop_assert!(distance([-x, y, z], image) < 1e-7, "{:?} and {image:?}", [x, y, z]);
        }
    }

    #[test]
    fn four_lamps_of_which_two_are_lit_act_as_two(
        seed in any::<u64>(), powers in prop::collection::vec((power(), power()), 1..20),
    ) {
        let mut two = Bean::new(Species::default().draw(seed, 1.0), seed);
        let mut four = two.clone().under(&Layout::four_sides());
        for (left, right) in powers {
            two.advance(&[left, right], 30.0);
            four.advance(&[left, right, 0.0, 0.0], 30.0);
            prop_assert_eq!(two.pose(), four.pose());
        }
    }

    #[test]
    fn any_bean_stays_a_bean(
        seed in any::<u64>(), scale in 0.0..2.0,
        lights in prop::collection::vec((power(), power(), 5.0..600.0), 1..12),
    ) {
        let species = if seed % 2 == 0 { Species::default() } else { internodal() };
        let mut bean = Bean::new(species.draw(seed, scale), seed);
        let mut length = bean.length();
        for (left, right, minutes) in lights {
            bean.advance(&[left, right], minutes);
            prop_assert!(bean.length() > length && bean.length() < 200.0, "{}", bean.length());
            length = bean.length();
            prop_assert!(places(&bean).iter().flatten().all(|axis| axis.abs() < length + 20.0));
        }
        let pose = bean.pose();
        let along: f64 = pose.stem.windows(2).map(|pair| distance(pair[0].at, pair[1].at)).sum();
        prop_assert!((along - length).abs() < 1e-9 * length);
        prop_assert!(pose.stem.iter().all(|node| node.radius > 0.0));
    }
}

#[test]
fn front_and_back_lamps_bend_the_stem_along_z() {
    let mut plant = Species::default().average();
    plant.nutation.curvature = 0.0;
    let lit = |light| {
        let mut bean = Bean::noise_free(plant.clone()).under(&Layout::four_sides());
        bean.advance(&lamp_powers(Some(light)), 12.0 * 60.0);
        bean.apex()
    };
    let ([x, y, z], back) = (lit(Light::FRONT), lit(Light::BACK));
    assert!(z > 2.0 && x.abs() < 1e-9, "{x} {y} {z}");
    assert!(distance([x, y, -z], back) < 1e-7, "{:?} and {back:?}", [x, y, z]);
}

#[test]
fn a_track_under_two_of_four_lamps_is_that_under_two() {
    let species = Species::default();
    let task = Task::open_loop(60);
    let controller = || Periodic::new(20, &Layout::default());
    let two = grow(&species, 3, 1.0, &mut controller(), &task, &mut unwatched);
    let trial = Trial { layout: Layout::four_sides(), ..Trial::new(&species) };
    let four = trial.grow(3, &mut controller(), &task, &mut unwatched);
    assert_eq!(two.samples, four.samples);
}

#[test]
fn a_period_decides_when_a_plant_is_observed_and_nothing_else() {
    let plant = || Bean::noise_free(Species::default().average());
    let (mut often, mut seldom) = (plant(), plant());
    for _ in 0..24 {
        often.advance(&[0.0, 1.0], 5.0);
    }
    for _ in 0..6 {
        seldom.advance(&[0.0, 1.0], 20.0);
    }
    assert!(distance(often.apex(), seldom.apex()) < 1e-9);
    let species = Species::default();
    let trial = Trial { period_min: 20.0, ..Trial::new(&species) };
    let task = Task::open_loop(6);
    let mut controller = Periodic::new(3, &trial.layout);
    let track = trial.grow(1, &mut controller, &task, &mut unwatched);
    assert_eq!((track.period_min, track.samples[6].time_s), (20.0, 7200.0));
}

fn species_files() -> [Species; 3] {
    [
        include_str!("../../../beans/common-bean.toml"),
        include_str!("../../../beans/sunflower.toml"),
        include_str!("../../../beans/internodal-bean.toml"),
    ]
    .map(|text| toml::from_str(text).unwrap())
}

/// The bean of the second physiology.
fn internodal() -> Species {
    let [_, _, internodal] = species_files();
    internodal
}

/// Every number of a pose, and the apex, as bits.
fn bits(bean: &Bean) -> Vec<u64> {
    let pose = bean.pose();
    let stem = pose.stem.iter().flat_map(|node| node.at.into_iter().chain([node.radius]));
    let leaves =
        pose.leaves.iter().flat_map(|leaf| leaf.base.into_iter().chain(leaf.along).chain(leaf.across));
    let rest = [bean.length(), bean.peak_curvature(), bean.age_h()].into_iter().chain(bean.apex());
    stem.chain(leaves).chain(rest).map(f64::to_bits).collect()
}

#[test]
fn beans_side_by_side_are_beans_alone_to_the_bit() {
    // Ages, sub-steps, lamps and their powers differ from plant to plant; the last group has fewer plants than lanes.
    let [common, sunflower, internodal] = species_files();
    let mut alone: Vec<Bean> = (0..29_u32)
        .map(|seed| {
            let species = [&sunflower, &common, &common, &internodal][seed as usize % 4];
            let individual = species.draw(seed.into(), f64::from(seed % 3) * 0.9);
            let bean =
                if seed % 7 == 6 { Bean::noise_free(individual) } else { Bean::new(individual, seed.into()) };
            let mut bean = bean.under(&Layout::four_sides());
            if seed == 5 || seed == 8 {
                bean = bean.with_substep(11.0);
            }
            bean.advance(&[0.0, 1.0, 0.0, 0.2], f64::from(seed % 5) * 700.0);
            bean
        })
        .collect();
    let mut together = Population::new(alone.clone());
    for step in 0..90_u32 {
        let powers = |plant: u32| -> [f64; MAX_LAMPS] {
            let mut powers = [0.0; MAX_LAMPS];
            match (plant + step / 12) % 5 {
                0 => {}
                1 => powers[0] = 1.0,
                2 => powers[1] = 0.7,
                3 => powers[3] = 1.0,
                _ => (powers[0], powers[2], powers[3]) = (0.3, 1.0, 0.1),
            }
            powers
        };
        let powers: Vec<_> = (0..29).map(powers).collect();
        let minutes = [5.0, 10.0, 1.0, 7.0][step as usize % 4];
        together.advance(&powers, minutes);
        for (number, (bean, powers)) in alone.iter_mut().zip(&powers).enumerate() {
            bean.advance(powers, minutes);
            assert!(bits(bean) == bits(&together.beans[number]), "bean {number} at step {step}");
        }
    }
}

/// Whether two tracks are equal to the bit.
fn assert_same(together: &Track, alone: &Track, what: &str) {
    assert_eq!(together, alone, "{what}");
    for (one, other) in together.samples.iter().zip(&alone.samples) {
        let bits = |tip: Point| [tip.x.to_bits(), tip.y.to_bits()];
        assert_eq!(bits(one.tip), bits(other.tip), "{what}, step {}", one.step);
    }
}

#[test]
fn the_apex_of_a_bean_from_the_lanes_follows_its_later_changes() {
    let seedling = |seed| Bean::new(Species::default().draw(seed, 1.0), seed);
    let powers = lamp_powers(Some(Light::LEFT));
    let mut together = Population::new(vec![seedling(1), seedling(2)]);
    let mut alone = seedling(1);
    let bits = |bean: &Bean| bean.apex().map(f64::to_bits);
    together.advance(&[powers; 2], 60.0);
    alone.advance(&powers, 60.0);
    assert_eq!(bits(&together.beans[0]), bits(&alone));
    for bean in [&mut together.beans[0], &mut alone] {
        bean.tip_over(0.2);
    }
    assert_eq!(bits(&together.beans[0]), bits(&alone));
    for bean in [&mut together.beans[0], &mut alone] {
        bean.advance(&powers, 5.0);
    }
    assert_eq!(bits(&together.beans[0]), bits(&alone));
}

#[test]
fn tracks_grown_side_by_side_are_those_of_single_plants_to_the_bit() {
    let seeds: Vec<u64> = (0..34).map(|seed| 1000 * seed).collect();
    let [common, sunflower, internodal] = species_files();
    for (species, scale, layout, period_min) in [
        (&common, 0.0, Layout::default(), 5.0),
        (&common, 1.0, Layout::four_sides(), 10.0),
        (&common, 2.0, Layout::default(), 10.0),
        (&sunflower, 1.0, Layout::default(), 5.0),
        (&sunflower, 2.0, Layout::four_sides(), 10.0),
        (&sunflower, 0.0, Layout::four_sides(), 5.0),
        (&internodal, 1.0, Layout::default(), 5.0),
        (&internodal, 2.0, Layout::four_sides(), 10.0),
    ] {
        let trial = Trial { scale, layout, period_min, ..Trial::new(species) };
        // Plants end at different steps, so that others take their lanes.
        let task = Task { max_steps: 160, end_height_cm: 7.0, ..Task::default() };
        let greedy = || Greedy::new(&task, &trial.layout);
        let go_on = &mut |_: usize, _: &Sample| ControlFlow::Continue(());
        let tracks = trial.grow_all(&seeds, |_| greedy(), &task, go_on);
        for (track, &seed) in tracks.iter().zip(&seeds) {
            let alone = trial.grow(seed, &mut greedy(), &task, &mut unwatched);
            assert_same(track, &alone, &format!("{trial:?}, seed {seed}"));
        }
    }
}

#[test]
fn whole_experiments_side_by_side_are_those_of_single_plants_to_the_bit() {
    let seeds: Vec<u64> = (0..9).collect();
    let task = Task::open_loop(1000);
    for (species, layout, first) in
        species_files().iter().zip([Layout::default(), Layout::four_sides()]).map(|(species, layout)| {
            let first = layout.lights().last().unwrap();
            (species, layout, first)
        })
    {
        let trial = Trial { layout, ..Trial::new(species) };
        let periodic = |place: usize| Periodic::new(72 + place as u32, &trial.layout).starting_with(first);
        let go_on = &mut |_: usize, _: &Sample| ControlFlow::Continue(());
        let tracks = trial.grow_all(&seeds, periodic, &task, go_on);
        for (place, (track, &seed)) in tracks.iter().zip(&seeds).enumerate() {
            let alone = trial.grow(seed, &mut periodic(place), &task, &mut unwatched);
            assert_same(track, &alone, &format!("{first:?}, seed {seed}"));
        }
    }
}

#[test]
fn a_plant_that_is_broken_off_leaves_the_others_alone() {
    let species = Species::default();
    let trial = Trial::new(&species);
    let task = Task::open_loop(30);
    let periodic = |_| Periodic::new(10, &trial.layout);
    let seeds: Vec<u64> = (0..40).collect();
    let watch = &mut |place: usize, sample: &Sample| {
        if place == 3 && sample.step == 12 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let tracks = trial.grow_all(&seeds, periodic, &task, watch);
    for (place, track) in tracks.iter().enumerate() {
        let alone = trial.grow(place as u64, &mut periodic(0), &task, &mut unwatched);
        let wanted = if place == 3 { 13 } else { 31 };
        assert_eq!(track.samples, alone.samples[..wanted], "{place}");
        assert_eq!(track.columns.len(), 25);
    }
}

#[test]
#[should_panic(expected = "for each of 2 lamps")]
fn a_lamp_that_is_not_there_cannot_be_lit() {
    Bean::noise_free(Individual::default()).advance(&lamp_powers(Some(Light::FRONT)), 5.0);
}

#[test]
fn one_seed_is_one_plant() {
    let grow = |seed| {
        let species = if seed < 7 { Species::default() } else { internodal() };
        let mut bean = Bean::new(species.draw(seed, 1.0), seed);
        for step in 0..150 {
            bean.advance(&alternating(step), 5.0);
        }
        bean.pose()
    };
    assert_eq!(grow(5), grow(5));
    assert_ne!(grow(5), grow(6));
    let here = grow(7);
    let there = std::thread::spawn(move || grow(7)).join().unwrap();
    assert_eq!(here, there);
}

#[test]
fn a_typical_bean_is_an_individual() {
    assert_eq!(Species::default().average(), Individual::default());
}

/// Sixty experiments of [`acceptance::open_loop_experiment`], side by side: in lanes they cost a third.
fn sixty(species: &Species) -> Vec<Track> {
    let trial = Trial::new(species);
    let task = Task::open_loop(1000);
    let controller = |_| Periodic::new(acceptance::SWITCH_STEPS, &trial.layout).starting_with(Light::RIGHT);
    let seeds: Vec<u64> = (0..60).collect();
    let tracks = trial.grow_all(&seeds, controller, &task, &mut |_, _| ControlFlow::Continue(()));
    assert_eq!(tracks[3], acceptance::open_loop_experiment(species, 3));
    tracks
}

#[test]
fn sixty_beans_behave_as_the_paper_s_six() {
    check(&acceptance::population(&sixty(&Species::default())));
}

#[test]
fn sixty_internodal_beans_behave_as_the_paper_s_six() {
    check(&acceptance::population(&sixty(&internodal())));
}

#[test]
fn a_typical_internodal_bean_responds_as_published() {
    check(&acceptance::single_plant(&internodal()));
}

#[test]
fn internodal_beans_in_the_dark_lean_to_no_side() {
    let species = internodal();
    let (mut sum, mut squares) = (0.0, 0.0);
    for seed in 0..200 {
        let mut bean = Bean::new(species.draw(seed, 1.0), seed);
        bean.advance(&[], 24.0 * 60.0);
        let [x, ..] = bean.apex();
        sum += x / 200.0;
        squares += x * x / 200.0;
    }
    let standard_error = (squares / 200.0_f64).sqrt();
    assert!(sum.abs() < 3.0 * standard_error, "{sum} cm, standard error {standard_error}");
    // Without nutation the typical plant stays upright to the last bit.
    let mut typical = species.average();
    typical.nutation.curvature = 0.0;
    let mut bean = Bean::noise_free(typical);
    bean.advance(&[], 24.0 * 60.0);
    assert_eq!((bean.apex()[0], bean.apex()[2]), (0.0, 0.0));
}

/// Without gravity and straightening nothing but the memory can take back what light has bent.
#[test]
fn an_internodal_bean_takes_back_what_a_pulse_bent() {
    let after = |mut plant: Individual| {
        plant.nutation.curvature = 0.0;
        plant.tropism.gravity = 0.0;
        if let Some(internodal) = &mut plant.internodal {
            internodal.straightening = 0.0;
        }
        // Straightening goes with 1 over the balance number.
        plant.tropism.balance = 100.0;
        let mut bean = Bean::noise_free(plant);
        bean.advance(&[], 12.0 * 60.0);
        bean.advance(&[0.0, 1.0], 20.0);
        let mut most = f64::NEG_INFINITY;
        for _ in 0..48 {
            bean.advance(&[], 5.0);
            most = most.max(bean.pose().heading[0]);
        }
        (most, bean.pose().heading[0])
    };
    let (most, end) = after(Species::default().average());
    assert!(most > 0.05 && end > 0.95 * most, "{most} {end}");
    let (most, end) = after(internodal().average());
    assert!(most > 0.05 && end < 0.85 * most, "{most} {end}");
}

#[test]
fn a_typical_bean_responds_as_published() {
    check(&acceptance::single_plant(&Species::default()));
}

fn check(rows: &[acceptance::AcceptanceRow]) {
    for row in rows {
        let [least, most] = row.range;
        println!("{:3} {:48} {:8.3}  {least} to {most}", row.number, row.statistic, row.value);
    }
    let misses: Vec<_> = rows.iter().filter(|row| !row.holds()).collect();
    assert!(misses.is_empty(), "{misses:#?}");
}
