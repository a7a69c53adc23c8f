//! A track: an error, or a table that can be written, read again and made a model of.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tropism::plant::FittedModel;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::track::Track;

fuzz_target!(|bytes: &[u8]| {
    let Ok(track) = Track::read_csv(bytes) else { return };
    Track::read_csv(track.to_csv().as_slice()).expect("what was written is read");
    if let Ok(model) = TipModel::fit([&track], TipModelConfig::default()) {
        TipModel::from_json(&model.to_json()).expect("what was written is read");
    }
});
