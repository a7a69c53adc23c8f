//! Texts of devices, programs and files, and addresses of rig files: shown without controls and secrets, and quoted in CSV
//! so that they come back.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tropism::text::{csv_cell, of_csv_cell, plain, plain_lines};
use tropism_rig::driver::{AlertDriver, CameraDriver, LampDriver};
use tropism_rig::secret::{holds_secret, host_alone, redacted, redacted_text, shows_secret};

fuzz_target!(|text: &str| {
    let shown = plain(text);
    assert!(!shown.contains(char::is_control));
    assert_eq!(plain(&shown), shown, "what is plain stays as it is");
    assert!(plain_lines(text).chars().all(|sign| matches!(sign, '\n' | '\t') || !sign.is_control()));
    assert_eq!(of_csv_cell(&csv_cell(text)), text);

    let _ = (redacted(text), host_alone(text), holds_secret(text), shows_secret(text));
    let hidden = redacted_text(text);
    assert_eq!(redacted_text(&hidden), hidden, "what is hidden stays hidden");

    // As an address of each kind of device.
    let url = toml::Value::String(text.to_owned());
    let lamp = toml::toml! { driver = "wled" strip = { pixels = 4 } };
    let with_url = |mut table: toml::Table| {
        table.insert("url".to_owned(), url.clone());
        table
    };
    if let Ok(lamp) = with_url(lamp).try_into::<LampDriver>() {
        let _ = lamp.check(5.0);
    }
    if let Ok(camera) = with_url(toml::toml! { driver = "http" }).try_into::<CameraDriver>() {
        let _ = camera.check();
    }
    if let Ok(alert) = with_url(toml::toml! { driver = "webhook" }).try_into::<AlertDriver>() {
        let _ = alert.check();
    }
});
