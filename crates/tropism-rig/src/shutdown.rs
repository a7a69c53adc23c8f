//! Shutdown of a tent into its safe state: flash off, lamps as `on_exit` says.
//!
//! For the time after a program was killed, and for users who want all light off now. Each device is opened separately, so
//! that one missing device does not keep the others lit.

use tropism::rig::{Lamps, OnExit, RigError};

use crate::file::{RigFile, device_name};
use crate::retry::{retry, two};
use crate::switch::Switch;

/// How the shutdown of one device went.
#[derive(Debug)]
pub struct DeviceShutdown {
    /// `flash`, `lamps`, or the lamp's name and `lamp`, as in `left lamp`.
    pub device: String,
    /// Whether it confirmed to be off, as far as it can.
    pub result: Result<(), RigError>,
}

/// Switches off the flash and all lamps; lamps with [`OnExit::Keep`] only if `is_all`.
///
/// Each device is tried three times. A virtual tent has none.
pub fn shut_down(rig: &RigFile, is_all: bool) -> Vec<DeviceShutdown> {
    let broker = rig.mqtt.as_ref();
    let mut done = Vec::new();
    if let Some(flash) = &rig.flash {
        // Opening a flash switches it off.
        let result = retry(two(), || flash.open(broker).map(drop));
        done.push(DeviceShutdown { device: "flash".to_owned(), result });
    }
    let Some(lamps) = rig.lamps.as_ref().filter(|lamps| is_all || lamps.on_exit == OnExit::Dark) else {
        return done;
    };
    if let Some(mut programs) = lamps.programs() {
        let result = retry(two(), || programs.light(None));
        done.push(DeviceShutdown { device: "lamps".to_owned(), result });
    }
    done.extend(lamps.drivers().map(|(name, driver)| {
        let device = device_name(name);
        let result = retry(two(), || driver.open(&device, broker)?.switch(false));
        DeviceShutdown { device, result }
    }));
    done
}
