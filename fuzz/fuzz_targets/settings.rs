//! Files that people write by hand: rig, study's parts, calibration. An error, or settings that pass or fail their check.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tropism::evolve::EvolutionConfig;
use tropism::task::Task;
use tropism::vision::Calibration;
use tropism_rig::file::RigFile;

fuzz_target!(|text: &str| {
    if let Ok(rig) = toml::from_str::<RigFile>(text) {
        let _ = rig.check();
    }
    if let Ok(calibration) = toml::from_str::<Calibration>(text) {
        if calibration.check().is_ok() {
            let _ = calibration.pixel(calibration.point(calibration.base));
        }
    }
    if let Ok(task) = toml::from_str::<Task>(text) {
        let _ = task.check();
    }
    if let Ok(evolution) = toml::from_str::<EvolutionConfig>(text) {
        let _ = evolution.neat.check();
    }
});
