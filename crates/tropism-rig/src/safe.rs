//! The safe state of a tent: flash off, lamps as its file says they are to be left, whoever left them lit.
//!
//! For a program that was killed, and for people who want all light off now. Each device is opened by itself, so that one
//! that is gone keeps no other from being put off.

use tropism::lamps::Light;
use tropism::rig::{Lamps, OnExit, RigError};

use crate::file::{Lamp, RigFile};
use crate::mqtt::Broker;
use crate::switch::Switch;
use crate::tries::{again, two};

/// What became of one device.
#[derive(Debug)]
pub struct PutOff {
    /// `flash`, `left lamp`, `right lamp` or `lamps`.
    pub device: &'static str,
    /// Whether it confirmed to be off, as far as it can.
    pub result: Result<(), RigError>,
}

/// Puts the flash off and both lamps dark, the lamps as [`OnExit`] says unless `is_all`. Each device is tried three times;
/// those that are to stay lit are not touched, and a virtual tent has none.
pub fn safe_state(rig: &RigFile, is_all: bool) -> Vec<PutOff> {
    let broker = rig.mqtt.as_ref();
    let mut done = Vec::new();
    if let Some(flash) = &rig.flash {
        // A flash is put off when it is opened.
        done.push(PutOff { device: "flash", result: again(two(), || flash.open(broker).map(drop)) });
    }
    if let Some(lamps) = rig.lamps.as_ref().filter(|lamps| is_all || lamps.on_exit == OnExit::Dark) {
        match (&lamps.left, &lamps.right) {
            (Lamp::Command(_), Lamp::Command(_)) => {
                let result = again(two(), || lamps.programs().light(None));
                done.push(PutOff { device: "lamps", result });
            }
            (left, right) => {
                done.push(PutOff { device: "left lamp", result: darken(left, Light::LEFT, broker) });
                done.push(PutOff { device: "right lamp", result: darken(right, Light::RIGHT, broker) });
            }
        }
    }
    done
}

fn darken(lamp: &Lamp, side: Light, broker: Option<&Broker>) -> Result<(), RigError> {
    let device = if side == Light::LEFT { "left lamp" } else { "right lamp" };
    match lamp {
        Lamp::Driver(lamp) => again(two(), || lamp.open(device, broker)?.switch(false)),
        Lamp::Command(_) => Err(crate::failed(device, "found a program beside a driver, wanted both alike")),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    fn rig(folder: &Path, lamps: &str) -> RigFile {
        let say = |what: &str| format!("[\"sh\", \"-c\", \"echo {what} >> {}/log\"]", folder.display());
        let text = format!(
            "[camera]\ncommand = [\"camera\"]\n{lamps}\n[flash]\non = {}\noff = {}\n[calibration]\npx_per_cm = \
             35.0\nwidth = 2592\nheight = 1944\nbase = {{ x = 1296.0, y = 1700.0 }}\n",
            say("flash on"),
            say("flash off"),
        );
        let rig: RigFile = toml::from_str(&text).unwrap();
        rig.check().unwrap();
        rig
    }

    #[test]
    fn a_device_that_is_gone_keeps_no_other_lit() {
        let folder = tempfile::tempdir().unwrap();
        let say =
            |what: &str| format!("[\"sh\", \"-c\", \"echo {what} >> {}/log\"]", folder.path().display());
        let lamps = format!(
            "[lamps.left]\ndriver = \"leds\"\ndevice = \"/no/such/leds\"\nstrip = {{ pixels = 9 }}\n\
             [lamps.right]\ndriver = \"command\"\non = {}\noff = {}\n",
            say("right on"),
            say("right off"),
        );
        let done = safe_state(&rig(folder.path(), &lamps), false);
        let found: Vec<_> = done.iter().map(|put| (put.device, put.result.is_ok())).collect();
        assert_eq!(found, [("flash", true), ("left lamp", false), ("right lamp", true)]);
        assert!(done[1].result.as_ref().unwrap_err().to_string().contains("/no/such/leds"));
        assert_eq!(fs::read_to_string(folder.path().join("log")).unwrap(), "flash off\nright off\n");
    }

    #[test]
    fn programs_that_know_both_lamps_darken_both_and_are_tried_again() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let dark = format!("echo dark >> {0}; test $(grep -c dark {0}) -ge 2", log.display());
        let lamps =
            format!("[lamps]\nleft = [\"true\"]\nright = [\"true\"]\ndark = [\"sh\", \"-c\", {dark:?}]\n");
        let done = safe_state(&rig(folder.path(), &lamps), false);
        assert!(done.iter().all(|put| put.result.is_ok()), "{done:?}");
        assert_eq!(fs::read_to_string(log).unwrap(), "flash off\ndark\ndark\n");
    }

    #[test]
    fn lamps_that_are_to_stay_lit_do_so_unless_all_light_is_to_go() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let dark = format!("echo dark >> {}", log.display());
        let lamps = format!(
            "[lamps]\non_exit = \"keep\"\nleft = [\"true\"]\nright = [\"true\"]\ndark = [\"sh\", \"-c\", {dark:?}]\n"
        );
        let rig = rig(folder.path(), &lamps);
        let devices = |is_all| safe_state(&rig, is_all).iter().map(|put| put.device).collect::<Vec<_>>();
        assert_eq!(devices(false), ["flash"]);
        assert_eq!(fs::read_to_string(&log).unwrap(), "flash off\n");
        assert_eq!(devices(true), ["flash", "lamps"]);
        assert_eq!(fs::read_to_string(&log).unwrap(), "flash off\nflash off\ndark\n");
    }
}
