//! What is switched off at the end.

use std::fs;
use std::path::Path;
use tropism_rig::file::RigFile;
use tropism_rig::shutdown::shut_down;

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
    let say = |what: &str| format!("[\"sh\", \"-c\", \"echo {what} >> {}/log\"]", folder.path().display());
    let lamps = format!(
        "[lamps.left]\ndriver = \"leds\"\ndevice = \"/no/such/leds\"\nstrip = {{ pixels = 9 }}\n\
         [lamps.right]\ndriver = \"command\"\non = {}\noff = {}\n",
        say("right on"),
        say("right off"),
    );
    let done = shut_down(&rig(folder.path(), &lamps), false);
    let found: Vec<_> =
        done.iter().map(|shutdown| (shutdown.device.as_str(), shutdown.result.is_ok())).collect();
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
    let done = shut_down(&rig(folder.path(), &lamps), false);
    assert!(done.iter().all(|shutdown| shutdown.result.is_ok()), "{done:?}");
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
    let devices =
        |is_all| shut_down(&rig, is_all).iter().map(|shutdown| shutdown.device.clone()).collect::<Vec<_>>();
    assert_eq!(devices(false), ["flash"]);
    assert_eq!(fs::read_to_string(&log).unwrap(), "flash off\n");
    assert_eq!(devices(true), ["flash", "lamps"]);
    assert_eq!(fs::read_to_string(&log).unwrap(), "flash off\nflash off\ndark\n");
}

#[test]
fn all_of_four_lamps_are_darkened() {
    let folder = tempfile::tempdir().unwrap();
    let lamp = |name: &&str| {
        let off = format!("echo {name} off >> {}/log", folder.path().display());
        format!("[lamps.{name}]\ndriver = \"command\"\non = [\"false\"]\noff = [\"sh\", \"-c\", {off:?}]\n")
    };
    let lamps: String = ["left", "right", "front", "back"].iter().map(lamp).collect();
    let done = shut_down(&rig(folder.path(), &lamps), false);
    let found: Vec<_> = done.iter().map(|shutdown| shutdown.device.as_str()).collect();
    assert_eq!(found, ["flash", "left lamp", "right lamp", "front lamp", "back lamp"]);
    let log = fs::read_to_string(folder.path().join("log")).unwrap();
    assert_eq!(log, "flash off\nleft off\nright off\nfront off\nback off\n");
}
