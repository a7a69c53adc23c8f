//! The linear model of the stem.

use super::{assert_mirror, grown};
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::observation::Quality;
use tropism::plant::stem::PlaneModel;
use tropism::plant::{FittedModel, PlantModel};
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::ModelKind;

fn model() -> PlaneModel {
    PlaneModel::fit(&[grown(1, 300, 5.0), grown(2, 300, 5.0)]).unwrap()
}

#[test]
fn mirrored_plants_make_the_model_of_the_mirror() {
    let tracks = [grown(1, 300, 5.0), grown(2, 300, 5.0)];
    let images = tracks.each_ref().map(|track| track.mirrored().unwrap());
    assert_mirror(&PlaneModel::fit(&tracks).unwrap(), &PlaneModel::fit(&images).unwrap(), 5.0);
}

#[test]
fn simulated_plants_follow_the_light_and_stay_near_the_data() {
    let (model, mut sum) = (model(), 0.0);
    for episode in 0..20 {
        let noise = NoiseStream::new(3, Purpose::Trial, [episode, 0, 0]);
        let mut plant = model.seedling(Point::new(0.0, 4.0), &mut noise.of_seedling());
        for step in 0..150 {
            model.step(&mut plant, Light::RIGHT, &mut noise.at(step));
        }
        let tip = model.observe(&plant).tip;
        assert!(tip.x.abs() < 12.0 && (3.0..14.0).contains(&tip.y), "{tip:?}");
        sum += tip.x;
    }
    assert!(sum > 20.0 * 1.5, "{sum}");
}

#[test]
fn a_period_of_ten_minutes_has_half_as_many_steps() {
    let ten = PlaneModel::fit(&[grown(1, 150, 10.0)]).unwrap();
    assert_eq!((ten.period_min(), ten.steps()), (10.0, 150));
    assert_eq!(PlaneModel::fit(&[grown(1, 300, 5.0)]).unwrap().steps(), 300);
}

#[test]
fn steps_that_remember_a_lost_stem_are_left_out() {
    let mut gap = grown(1, 300, 5.0);
    gap.samples[100].stem = None;
    // Two changes touch the stem; twelve further steps remember the later one.
    assert_eq!(PlaneModel::fit([&gap]).unwrap().steps(), 300 - 14);
    gap.samples[100].quality = Quality::CarriedForward;
    assert_eq!(PlaneModel::fit([&gap]).unwrap().steps(), 300 - 14);
}

#[test]
fn tracks_without_stems_are_named() {
    let mut without = grown(1, 300, 5.0);
    without.samples.iter_mut().for_each(|sample| sample.stem = None);
    let error = PlaneModel::fit([&grown(2, 300, 5.0), &without]).unwrap_err().to_string();
    assert!(error.contains("track 2 has no stems"), "{error}");
}

#[test]
fn a_model_of_each_plant_has_its_steps_alone() {
    let each = model().of_each_plant(usize::MAX).unwrap();
    assert_eq!(each.len(), 2);
    assert_eq!(each[1], PlaneModel::fit([&grown(2, 300, 5.0)]).unwrap());
}

#[test]
fn json_comes_back_and_damage_is_named() {
    let model = model().of_virtual_plants(true);
    let text = model.to_json();
    assert_eq!(ModelKind::of_file(&text), Some(ModelKind::STEM));
    assert_eq!(PlaneModel::from_json(&text).unwrap(), model);
    let error = |text: &str| PlaneModel::from_json(text).unwrap_err().to_string();
    assert!(error(&text.replace("stem-model/3", "stem-model/9")).contains("wanted \"tropism.stem-model/3\""));
    assert!(
        error(&text.replacen("\"light\":[\"left\"", "\"light\":[\"left\",\"left\"", 1)).contains("lengths")
    );
    assert!(error(&text.replacen("\"stem\":[[[0.0", "\"stem\":[[[1e300", 1)).contains("1e300"));
}
