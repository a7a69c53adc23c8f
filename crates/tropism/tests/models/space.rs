//! The model of the stem in space.

use super::step_noise;
use tropism::control::{Greedy, Periodic};
use tropism::environment::unwatched;
use tropism::geometry::Point;
use tropism::lamps::{Layout, Light};
use tropism::lighting::Lighting;
use tropism::math::{
    self,
    vector::{add, distance, dot, norm},
};
use tropism::obstacle::{Pole, Solid};
use tropism::plant::stem::SpaceModel;
use tropism::plant::{FittedModel, PlantModel};
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::ModelKind;
use tropism::simulation::simulate;
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism_bean::{Species, Trial};

/// A virtual bean under four lamps that are switched every two hours.
fn grown(seed: u64) -> Track {
    let species = Species::default();
    let trial = Trial { layout: Layout::four_sides(), in_space: true, ..Trial::new(&species) };
    let task = Task::open_loop(250);
    trial.grow(seed, &mut Periodic::new(24, &trial.layout), &task, &mut unwatched)
}

#[test]
fn a_mirrored_plant_moves_in_a_mirror() {
    let model = SpaceModel::fit([&grown(1)]).unwrap();
    // The stem of a virtual bean stands at 0, so that seedlings of one noise are mirror images.
    let seedling = |x: f64, pole: Solid| {
        let mut plant = model.seedling(Point::new(x, 4.0), &mut step_noise(u32::MAX));
        model.among(&mut plant, &[pole]);
        plant
    };
    // On its way, so that it leans on it.
    let pole = Solid::from(Pole { at: [0.4, 1.4], radius_cm: 1.0, height_cm: 40.0 });
    let (mut plant, mut image) = (seedling(0.2, pole), seedling(-0.2, pole.mirrored()));
    for step in 0..150 {
        let light = [Light::LEFT, Light::FRONT, Light::RIGHT, Light::BACK][step as usize / 11 % 4];
        model.step(&mut plant, light, &mut step_noise(step));
        model.step(&mut image, model.layout().mirrored(light).unwrap(), &mut step_noise(step));
        let [x, y, z] = model.observe(&plant).tip_in_space().unwrap();
        let apart = distance(model.observe(&image).tip_in_space().unwrap(), [-x, y, z]);
        assert!(apart < 1e-9, "step {step}: {apart}");
    }
    assert!(model.observe(&plant).tip.y > 6.0);
}

/// The tips of twelve simulated plants after `steps` steps under the same lighting.
fn tips_under(model: &SpaceModel, lighting: Lighting, steps: u32) -> impl Iterator<Item = [f64; 3]> {
    (0..12).map(move |episode| {
        let noise = NoiseStream::new(3, Purpose::Trial, [episode, 0, 0]);
        let mut plant = model.seedling(Point::new(0.0, 4.0), &mut noise.of_seedling());
        (0..steps).for_each(|step| model.shine(&mut plant, lighting, &mut noise.at(step)));
        model.observe(&plant).tip_in_space().unwrap()
    })
}

#[test]
fn simulated_plants_follow_each_lamp_and_stay_near_the_data() {
    let model = SpaceModel::fit([&grown(1), &grown(2)]).unwrap();
    for (light, towards) in
        [(Light::RIGHT, [1.0, 0.0]), (Light::FRONT, [0.0, 1.0]), (Light::BACK, [0.0, -1.0])]
    {
        let mut sum = [0.0; 2];
        for [x, y, z] in tips_under(&model, light.into(), 120) {
            assert!(math::hypot(x, z) < 12.0 && (2.0..14.0).contains(&y), "{x} {y} {z}");
            sum = add(sum, [x / 12.0, z / 12.0]);
        }
        let (ahead, all) = (dot(sum, towards), norm(sum));
        assert!(ahead > 1.0 && ahead > 0.8 * all, "{light}: {sum:?}");
    }
}

#[test]
fn several_lamps_draw_between_them_and_a_dimmed_one_draws_less() {
    let model = SpaceModel::fit([&grown(1), &grown(2)]).unwrap();
    assert!(model.knows_levels());
    let drawn = |lighting: Lighting| {
        tips_under(&model, lighting, 60).fold([0.0; 2], |sum, [x, _, z]| add(sum, [x / 12.0, z / 12.0]))
    };
    let right = Lighting::only(Light::RIGHT);
    let [full, weak, balanced] = [255, 26, 0].map(|level| drawn(Lighting::DARK.with(Light::RIGHT, level)));
    assert!(full[0] > weak[0] + 0.3 && weak[0] > balanced[0] + 0.3, "{full:?} {weak:?} {balanced:?}");
    let corner = drawn(right.with(Light::FRONT, 255));
    assert!(corner[0] > 0.5 && corner[1] > 0.5, "{corner:?}");
    let both = drawn(right.with(Light::LEFT, 255));
    assert!(both[0].abs() < 0.3 * full[0], "{both:?}");
}

#[test]
fn a_stem_winds_round_a_pole_and_never_lies_in_it() {
    let model = SpaceModel::fit([&grown(1), &grown(2)]).unwrap();
    let task = Task { max_steps: 400, ..Task::spiral() };
    let mut turns = 0.0;
    for seed in 0..6 {
        let track = simulate(&model, &mut Greedy::new(&task, model.layout()), &task, seed);
        let stems = track.samples.iter().filter_map(|sample| sample.observation().stem_in_space());
        for stem in stems {
            let gaps = stem.iter().map(|point| task.pole.expect("a pole").distance(*point));
            assert!(gaps.fold(f64::INFINITY, f64::min) > 0.1, "seed {seed}: {stem:?}");
        }
        turns += task.fitness(&track) / 6.0;
    }
    assert!(turns > 0.3, "{turns}");
}

#[test]
fn a_plant_goes_on_from_where_it_was_seen() {
    let track = grown(1);
    let model = SpaceModel::fit([&track]).unwrap();
    let past = &track.samples[..200];
    let plant = model.resumed(past, &mut step_noise(u32::MAX));
    let (seen, now) = (past[199].observation(), model.observe(&plant));
    assert_eq!(now.tip_in_space(), seen.tip_in_space());
    let far = seen.stem_in_space().unwrap().into_iter().zip(now.stem_in_space().unwrap());
    assert!(far.clone().all(|(one, other)| distance(one, other) < 1.0));
    // It remembers the light of before.
    let mut otherwise = past.to_vec();
    otherwise.iter_mut().for_each(|sample| sample.light = Some(Light::BACK));
    let next = |past: &[Sample]| {
        let mut plant = model.resumed(past, &mut step_noise(u32::MAX));
        model.step(&mut plant, Light::LEFT, &mut step_noise(0));
        model.observe(&plant).tip_in_space()
    };
    assert_ne!(next(past), next(&otherwise));
}

#[test]
fn json_comes_back_and_damage_is_named() {
    let mut gap = grown(2);
    gap.samples[50].depth = None;
    gap.samples[80].light = None;
    gap.samples[90].set_lighting(Lighting::only(Light::BACK).with(Light::LEFT, 40));
    gap.samples.remove(120);
    let model = SpaceModel::fit([&grown(1), &gap]).unwrap().of_virtual_plants(true);
    // Two changes touch a lost stem, and twelve steps remember the later one; a missing step also loses its light.
    assert_eq!(model.steps(), 250 + 250 - 14 - 15);
    assert_eq!(
        model.of_each_plant(9).unwrap()[0],
        SpaceModel::fit([&grown(1)]).unwrap().of_virtual_plants(true)
    );
    let text = model.to_json();
    assert_eq!(ModelKind::of_file(&text), Some(ModelKind::SPACE));
    assert_eq!(SpaceModel::from_json(&text).unwrap(), model);
    let error = |text: &str| SpaceModel::from_json(text).unwrap_err().to_string();
    assert!(error(&text.replace("\"axes\":2", "\"axes\":1")).contains("found a model of 1 axes, wanted 2"));
    let light = |first: &str| text.replacen("\"light\":[\"", &format!("\"light\":[\"{first}"), 1);
    assert!(error(&light("left\",\"")).contains("lengths"));
    assert!(error(&light("up")).contains("wanted left, right, front, back or dark"));
    assert!(error(&light("left:256+")).contains("wanted a level from 1 to 255"));
    assert!(text.contains("\"left:40+back\""));
    assert!(
        error(&text.replacen("\"plants\":", "\"plant\":1,\"plants\":", 1)).contains("unknown field `plant`")
    );
    let mut flat = grown(1);
    flat.samples.iter_mut().for_each(|sample| sample.depth = None);
    let error = SpaceModel::fit([&gap, &flat]).unwrap_err().to_string();
    assert!(error.contains("track 2 has no stems in space"), "{error}");
}
