//! The tip model with memory.

#[path = "../../src/plant/memory/tests/made_up.rs"]
mod made_up;

use made_up::track;

use super::assert_mirror;
use tropism::geometry::Point;
use tropism::lamps::{Layout, Light};
use tropism::observation::Quality;
use tropism::plant::PlantModel;
use tropism::plant::memory::MemoryModel;
use tropism::random::{self, NoiseStream, Purpose};
use tropism::track::{Sample, Track};

fn model() -> MemoryModel {
    MemoryModel::fit(&[track(1, 0.05, 5.0), track(2, 0.08, 5.0)]).unwrap()
}

/// A plant that grows `rate` cm a step straight up, for 1200 steps.
fn straight(rate: f64) -> Track {
    let mut track = track(1, 0.05, 5.0);
    track.samples = [&track.samples[..]; 3].concat();
    for (step, sample) in (0..).zip(&mut track.samples) {
        (sample.step, sample.tip.y) = (step, 4.0 + rate * f64::from(step));
    }
    track
}

#[test]
fn a_slow_plant_is_used_until_it_is_as_high_as_a_fast_one() {
    let greatest = |rate: f64| {
        let model = MemoryModel::fit(&[straight(rate)]).unwrap();
        (model.tips().count(), model.tips().map(|tip| tip.y).fold(0.0, f64::max))
    };
    assert_eq!(greatest(0.02).0, 501);
    let (count, height) = greatest(0.01);
    assert!(count == 981 && (height - 13.8).abs() < 0.01, "{count} steps up to {height} cm");
    assert_eq!(greatest(0.005).0, 1200, "a plant that is never so high is used whole");
}

#[test]
fn mirrored_plants_make_the_model_of_the_mirror() {
    let tracks = [track(1, 0.05, 5.0), track(2, 0.08, 5.0)];
    let images = tracks.each_ref().map(|track| track.mirrored().unwrap());
    assert_mirror(&MemoryModel::fit(&tracks).unwrap(), &MemoryModel::fit(&images).unwrap(), 7.0);
}

#[test]
fn simulated_plants_follow_the_light_and_grow_as_the_measured_ones() {
    let model = model();
    for episode in 0..20 {
        let noise = NoiseStream::new(3, Purpose::Trial, [episode, 0, 0]);
        let mut plant = model.seedling(Point::new(0.0, 4.0), &mut noise.of_seedling());
        for step in 0..200 {
            model.step(&mut plant, Light::RIGHT, &mut noise.at(step));
        }
        // Equilibrium of gain and pull: 2.5 and 4 cm, times the gain of the plant.
        let tip = model.observe(&plant).tip;
        assert!((1.0..12.0).contains(&tip.x), "{tip:?}");
        assert!((tip.y - 9.0).abs() < 0.4, "{tip:?}");
    }
}

#[test]
fn gaps_and_held_tips_leave_the_steps_out_that_would_remember_them() {
    let whole = track(1, 0.05, 5.0);
    let steps = |track: &Track| MemoryModel::fit([track]).unwrap().steps();
    assert_eq!(steps(&whole), 399);
    let mut held = whole.clone();
    held.samples[100].quality = Quality::Held;
    // Two shifts touch the tip; four further steps remember the later one.
    assert_eq!(steps(&held), 399 - 6);
    let mut gap = whole.clone();
    gap.samples.remove(100);
    // The light of the missing step is remembered for 14 steps, itself included, and one step leads to it.
    assert_eq!(steps(&gap), 399 - 15);
    assert_eq!(steps(&Track { samples: whole.samples[..2].to_vec(), ..whole.clone() }), 1);
}

#[test]
fn lamps_without_sides_and_tracks_without_steps_are_refused() {
    let four = Track { layout: Layout::four_sides(), ..track(1, 0.05, 5.0) };
    let error = MemoryModel::fit([&four]).unwrap_err().to_string();
    assert!(
        error.contains("left, right, front, back") && error.contains("one on each side of the plant"),
        "{error}"
    );
    let error = MemoryModel::fit([&Track::default()]).unwrap_err().to_string();
    assert!(error.contains("no usable step in 1 tracks"), "{error}");
    let error = MemoryModel::fit(&[track(1, 0.05, 5.0), track(1, 0.05, 10.0)]).unwrap_err().to_string();
    assert!(error.contains("track 2: found 10 minutes"), "{error}");
}

#[test]
fn a_model_of_each_plant_has_its_steps_alone() {
    let each = model().of_each_plant(usize::MAX).unwrap();
    assert_eq!(each.len(), 2);
    assert_eq!(each[1], MemoryModel::fit([&track(2, 0.08, 5.0)]).unwrap());
}

#[test]
fn steps_beyond_the_data_are_counted() {
    let model = model();
    assert_eq!(model.share_without_data(&track(1, 0.05, 5.0).samples), 0.0);
    let mut far = track(1, 0.05, 5.0);
    far.samples.iter_mut().take(399).for_each(|sample| sample.tip.x += 50.0);
    assert_eq!(model.share_without_data(&far.samples), 1.0);
}

fn gappy_model() -> MemoryModel {
    let mut gappy = track(2, 0.08, 5.0);
    gappy.samples[50].quality = Quality::Held;
    gappy.samples.remove(90);
    gappy.samples[120].light = None;
    MemoryModel::fit(&[track(1, 0.05, 5.0), gappy]).unwrap()
}

#[test]
fn json_comes_back() {
    let model = gappy_model().of_virtual_plants(true);
    assert!(MemoryModel::is_named_in(&model.to_json()));
    assert_eq!(MemoryModel::from_json(&model.to_json()).unwrap(), model);
}

#[test]
fn bad_models_are_refused() {
    let text = gappy_model().to_json();
    let error = |text: &str| MemoryModel::from_json(text).unwrap_err().to_string();
    assert!(error("{").contains("no model"));
    let other = text.replace("memory-model/1", "memory-model/9");
    assert!(error(&other).contains("wanted \"tropism.memory-model/1\""));
    assert!(MemoryModel::is_named_in(&other) && !MemoryModel::is_named_in(r#"{"schema":"tropism.model/2"}"#));
    assert!(error(&text.replacen("\"light\":\"r", "\"light\":\"x", 1)).contains("light 'x'"));
    assert!(error(&text.replacen("\"light\":\"r", "\"light\":\"rr", 1)).contains("lengths"));
    assert!(error(&text.replacen("\"x\":[0.0", "\"x\":[1e300", 1)).contains("1e300"));
    assert!(error(&text.replacen("\"period_min\":5.0", "\"period_min\":0.0", 1)).contains("period_min"));
    let mut with_stems: serde_json::Value = serde_json::from_str(&text).unwrap();
    let plant = &mut with_stems["plants"][0];
    let steps = plant["x"].as_array().unwrap().len();
    plant["stem"] = vec![[[0.0; 2]; 10]; steps].into();
    assert!(error(&with_stems.to_string()).contains("a key `plants.stem`, wanted none"));
}
