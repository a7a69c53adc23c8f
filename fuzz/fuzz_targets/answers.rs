//! What devices of a tent answer: a WLED controller, plugs behind a broker, rpicam-still's metadata. Understood or refused.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::{fuzz_mutator, fuzz_target};
use tropism_fuzz::mutate_json;
use tropism_rig::mqtt::{is_on, is_online};
use tropism_rig::rpicam::RpicamCamera;
use tropism_rig::wled::{WledInfo, WledLamp, WledState};

static LAMP: LazyLock<WledLamp> = LazyLock::new(|| {
    toml::from_str("url = \"http://w\"\nsegment = 1\nstrip = { first = 144, pixels = 144 }").expect("a lamp")
});

static CAMERA: LazyLock<RpicamCamera> = LazyLock::new(|| {
    let settings = "width = 64\nheight = 64\nshutter_us = 20000\ngain = 1.0\nawb_gains = [2.1, 1.7]";
    toml::from_str(settings).expect("a camera")
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutate_json(data, size, max_size, seed)
});

fuzz_target!(|answer: &[u8]| {
    if let Ok(state) = WledState::parse(answer) {
        let (lit, dark) = (LAMP.confirm(&state, 255), LAMP.confirm(&state, 0));
        assert!(lit.is_err() || dark.is_err(), "a lamp is lit or dark");
    }
    let _ = WledInfo::parse(answer);
    let _ = (is_on(answer), is_online(answer));
    if CAMERA.prove(answer, 5_000_000_000, 6_000_000_000).is_ok() {
        assert!(
            CAMERA.prove(answer, 7_000_000_000, 8_000_000_000).is_err(),
            "one frame proven fresh at two times"
        );
    }
});
