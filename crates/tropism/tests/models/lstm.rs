//! The LSTM of the stem.

use super::{assert_mirror, grown};
use std::ops::ControlFlow;

use tropism::geometry::Point;
use tropism::plant::PlantModel;
use tropism::plant::lstm::{LstmModel, Training, TrainingProgress};
use tropism::random::{NoiseStream, Purpose};
use tropism::track::Track;

const FEW: Training = Training { max_epochs: 4, seed: 1 };

fn trained(tracks: &[Track]) -> LstmModel {
    LstmModel::fit(tracks, FEW, &mut |_| ControlFlow::Continue(())).unwrap().unwrap()
}

fn model() -> LstmModel {
    trained(&[grown(1, 200, 5.0), grown(2, 200, 5.0)])
}

#[test]
fn training_makes_the_error_less() {
    let mut errors = Vec::new();
    let tracks = [grown(1, 200, 5.0), grown(2, 200, 5.0)];
    let watch = &mut |progress: &TrainingProgress| {
        errors.push(progress.error);
        if errors.len() < 12 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let training = Training { max_epochs: 50, seed: 1 };
    assert!(LstmModel::fit(&tracks, training, watch).unwrap().is_none(), "broken off");
    assert!(errors[11] < 0.9 * errors[0], "{errors:?}");
}

#[test]
fn mirrored_plants_make_the_model_of_the_mirror() {
    let tracks = [grown(1, 200, 5.0), grown(2, 200, 5.0)];
    let images = tracks.each_ref().map(|track| track.mirrored().unwrap());
    assert_mirror(&trained(&tracks), &trained(&images), 5.0);
}

#[test]
fn a_resumed_plant_begins_where_it_was_seen() {
    let (model, track) = (model(), grown(3, 120, 5.0));
    let past = &track.samples[..=100];
    let mean = |of: &dyn Fn(u32) -> f64| (0..40).map(of).sum::<f64>() / 40.0;
    let resumed = |number: u32| {
        let noise = NoiseStream::new(number.into(), Purpose::Trial, [0; 3]);
        model.observe(&model.resumed(past, &mut noise.of_seedling()))
    };
    assert_eq!(resumed(1).tip, past[100].tip);
    for point in [3, 6, 9] {
        let seen = past[100].stem.as_ref().unwrap().0[point];
        let (x, y) = (
            mean(&|number| resumed(number).stem.unwrap().0[point].x),
            mean(&|number| resumed(number).stem.unwrap().0[point].y),
        );
        assert!(seen.distance(Point::new(x, y)) < 0.25, "{seen:?} {x} {y}");
    }
}

#[test]
fn json_comes_back_and_damage_is_named() {
    let model = model().of_virtual_plants(true);
    let text = model.to_json();
    assert!(LstmModel::is_named_in(&text));
    assert_eq!(LstmModel::from_json(&text).unwrap(), model);
    let error = |text: &str| LstmModel::from_json(text).unwrap_err().to_string();
    assert!(error(&text.replace("lstm-model/1", "lstm-model/9")).contains("wanted \"tropism.lstm-model/1\""));
    let fewer = error(&text.replacen("\"weights\":[", "\"weights\":[0.5,", 1));
    assert!(fewer.contains("wanted ["), "{fewer}");
    let without = text.replacen("\"network\":", "\"net\":", 1);
    assert!(error(&without).contains("net"), "{}", error(&without));
}

#[test]
fn tracks_that_are_too_short_are_named() {
    let short = LstmModel::fit(&[grown(1, 90, 5.0)], FEW, &mut |_| ControlFlow::Continue(()));
    let error = short.unwrap_err().to_string();
    assert!(error.contains("no stretch of eight hours in 1 tracks"), "{error}");
}
