//! `tropism check`, against the virtual tent and against a tent of programs with what can be wrong in one.
#![cfg(unix)]

use std::fs;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::LazyLock;
use std::time::Duration;

use serde_json::Value;
use tropism::lamps::Light;
use tropism::rig::{Camera, Clock, Flash, Lamps};
use tropism::vision::VisionConfig;
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;

/// Exit code, and all lines as `verdict group found`.
fn check(folder: &Path, words: &[&str]) -> (i32, Vec<String>) {
    let output = Command::new(env!("CARGO_BIN_EXE_tropism"))
        .current_dir(folder)
        .args(["check", "rig.toml", "--json"])
        .args(words)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!error.contains("panicked"), "{error}");
    let said: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|cause| panic!("{cause}: {error}"));
    let line = |finding: &Value| {
        let text = |key: &str| finding[key].as_str().unwrap().to_owned();
        if finding["verdict"] != "pass" {
            assert!(!text("remedy").is_empty(), "{finding}");
        }
        format!("{} {} {}", text("verdict"), text("group"), text("found"))
    };
    (output.status.code().unwrap(), said["findings"].as_array().unwrap().iter().map(line).collect())
}

#[track_caller]
fn has(lines: &[String], wanted: &str) {
    assert!(lines.iter().any(|line| line.contains(wanted)), "{wanted:?} is not in {lines:#?}");
}

#[track_caller]
fn never_fails(lines: &[String]) {
    let failed: Vec<_> = lines.iter().filter(|line| line.starts_with("fail")).collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

/// The camera of a tent of programs: a picture of what is lit, and of two of each kind never the same twice.
const CAMERA: &str = "s=dark; test -e left && s=left; test -e right && s=right; test -e flash && s=flash\n\
                      n=$(cat n 2>/dev/null || echo 0); echo $((n + 1)) > n; cat $s-$((n % 2)).jpg\n";

/// The virtual tent with small photographs.
static GREENHOUSE: LazyLock<Greenhouse> = LazyLock::new(|| {
    let scene = Scene { width: 432, height: 324, ..Scene::default() };
    Greenhouse { scene, ..Greenhouse::default() }
});

/// Two photographs of it under each light, by the names of their files.
static PHOTOGRAPHS: LazyLock<Vec<(String, Vec<u8>)>> = LazyLock::new(|| {
    let (device, _) = GREENHOUSE.open(3, 5.0, &VisionConfig::default()).unwrap();
    let (mut camera, mut lamps, mut flash, mut clock) =
        (device.clone(), device.clone(), device.clone(), device);
    let mut photographs = Vec::new();
    for number in 0..2 {
        let _ = clock.wait_until(Duration::from_secs(300 * number), &mut || ControlFlow::Continue(()));
        for (name, light, has_flash) in [
            ("dark", None, false),
            ("left", Some(Light::LEFT), false),
            ("right", Some(Light::RIGHT), false),
            ("flash", None, true),
        ] {
            lamps.light(light).unwrap();
            flash.flash(has_flash).unwrap();
            let photo = camera.photograph().unwrap();
            photographs.push((format!("{name}-{number}.jpg"), photo.bytes));
        }
    }
    photographs
});

/// A tent of programs in `folder`, whose pictures are of the virtual tent.
fn tent(folder: &Path) {
    for (name, bytes) in &*PHOTOGRAPHS {
        fs::write(folder.join(name), bytes).unwrap();
    }
    fs::write(folder.join("camera"), CAMERA).unwrap();
    let switch = |name: &str| format!("on = [\"touch\", \"{name}\"]\noff = [\"rm\", \"-f\", \"{name}\"]\n");
    let text = format!(
        "[camera]\ncommand = [\"sh\", \"camera\"]\nretries = 0\n[lamps]\npause_s = 0\n[lamps.left]\n{}[lamps.right]\n{}\
         [flash]\nsettle_s = 0\nmax_on_s = 30\n{}[vision]\ncrop = {{ {} }}\n[calibration]\n{}",
        switch("left"),
        switch("right"),
        switch("flash"),
        toml::to_string(&GREENHOUSE.crop()).unwrap().trim().replace('\n', ", "),
        toml::to_string(&GREENHOUSE.calibration()).unwrap().replace("[base]", "[calibration.base]"),
    );
    fs::write(folder.join("rig.toml"), text).unwrap();
}

/// Changes a file of the tent.
fn change(folder: &Path, file: &str, from: &str, to: &str) {
    let text = fs::read_to_string(folder.join(file)).unwrap();
    assert!(text.contains(from), "{from:?} is not in {text}");
    fs::write(folder.join(file), text.replace(from, to)).unwrap();
}

#[test]
fn the_virtual_tent_passes_and_survives_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    let small = "[greenhouse.scene]\nwidth = 432\nheight = 324\n";
    fs::write(folder.path().join("rig.toml"), small).unwrap();
    let (code, lines) = check(folder.path(), &["--rehearse"]);
    never_fails(&lines);
    assert_eq!(code, 0);
    has(&lines, "pass flash photographs are fresh");
    has(&lines, "pass lamps left is left, and right is right");
    has(&lines, "pass plant its tip is at");
    has(&lines, "of 4 steps and gone on: no step lost, 5 photographs whole");
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["rig.toml"], "nothing stays");
}

#[test]
fn a_tent_that_works_passes_and_is_dark_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tent(folder);
    // What a run leaves lit a rehearsal does not.
    change(folder, "rig.toml", "[lamps]\n", "[lamps]\non_exit = \"keep\"\n");
    let (code, lines) = check(folder, &["--rehearse", "6", "--out", "kept"]);
    never_fails(&lines);
    assert_eq!(code, 0);
    has(&lines, "pass rehearsal killed after");
    assert!(["left", "right", "flash"].iter().all(|name| !folder.join(name).exists()));
    assert_eq!(fs::read_dir(folder.join("kept")).unwrap().count(), 13);
    let (_, dry) = check(folder, &["--dry"]);
    assert!(dry.iter().all(|line| line.contains(" settings ") || line.contains(" system ")), "{dry:#?}");
}

#[test]
fn what_is_wrong_in_a_tent_is_found() {
    let changed = |file: &str, from: &str, to: &str| {
        let folder = tempfile::tempdir().unwrap();
        tent(folder.path());
        change(folder.path(), file, from, to);
        let (code, lines) = check(folder.path(), &["--only", "camera,flash,lamps,plant"]);
        (code, lines)
    };
    for (file, from, to, wanted) in [
        ("camera", "n % 2", "0", "fail camera two photographs are the same"),
        (
            "camera",
            "n=$(",
            "exit 1; n=$(",
            "fail camera photograph 1 (dark): camera (sh camera): it ended with exit status: 1",
        ),
        // The frame before this one, as cameras with a queue give.
        (
            "camera",
            "cat $s",
            "mv next this; cat $s-$((n % 2)).jpg > next; test -e this && cat this || cat $s",
            "fail flash it shows 1 photograph late",
        ),
        ("rig.toml", "[\"touch\", \"flash\"]", "[\"true\"]", "fail flash no photograph is brighter by it"),
        (
            "rig.toml",
            "[\"touch\", \"flash\"]",
            "[\"false\"]",
            "fail flash flash (false): it ended with exit status: 1",
        ),
        (
            "rig.toml",
            "[\"rm\", \"-f\", \"left\"]",
            "[\"true\"]",
            "fail lamps left lamp: the photograph after it shows it still",
        ),
        (
            "rig.toml",
            "[\"touch\", \"left\"]",
            "[\"true\"]",
            "warn lamps left lamp: obeyed, and the photograph does not",
        ),
        (
            "rig.toml",
            "width = 432",
            "width = 430",
            "fail camera photographs of 432 x 324 pixels, calibrated for 430 x 324",
        ),
        ("rig.toml", "[\"sh\", \"camera\"]", "[\"cat\", \"rig.toml\"]", "wanted a JPEG, PNG or TIFF"),
    ] {
        let (code, lines) = changed(file, from, to);
        has(&lines, wanted);
        assert_eq!(code, i32::from(wanted.contains("fail ") || wanted.contains("wanted a JPEG")), "{wanted}");
    }
    // Lamps that are exchanged: the pictures of one are taken by the light of the other.
    let folder = tempfile::tempdir().unwrap();
    tent(folder.path());
    change(
        folder.path(),
        "camera",
        "test -e left && s=left; test -e right && s=right",
        "test -e left && s=right; test -e right && s=left",
    );
    let (code, lines) = check(folder.path(), &[]);
    has(&lines, "fail lamps left and right are the wrong way round");
    assert_eq!(code, 1);
    // And no run is rehearsed in such a tent.
    let (_, lines) = check(folder.path(), &["--rehearse"]);
    has(&lines, "warn rehearsal not held");
}

#[test]
fn settings_are_judged_without_devices() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tent(folder);
    fs::write(folder.join("secret"), "x\n").unwrap();
    let text = fs::read_to_string(folder.join("rig.toml")).unwrap();
    let with = |more: &str| {
        fs::write(folder.join("rig.toml"), format!("{more}{text}")).unwrap();
        check(folder, &["--dry", "--only", "settings"])
    };
    let (code, lines) = with("period_min = 0.1\ndurability = \"fast\"\n");
    has(&lines, "warn settings a step takes");
    has(&lines, "warn settings durability is \"fast\"");
    assert_eq!(code, 0);
    let (code, lines) = with("[mqtt]\nhost = \"localhost\"\npassword_file = \"secret\"\n");
    has(&lines, "warn settings secret: everybody on this computer can read it");
    assert_eq!(code, 0);
    let (code, lines) = with("[mqtt]\nhost = \"localhost\"\npassword_file = \"absent\"\n");
    has(&lines, "fail settings absent: cannot be read");
    assert_eq!(code, 1);
    let (code, lines) = with("[camra]\n");
    has(&lines, "fail settings rig.toml: line 1: found \"[camra]\": unknown field `camra`");
    assert_eq!(code, 1);
}

#[test]
fn the_readings_of_a_meter_become_settings() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tent(folder);
    let measured = |typed: &str| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_tropism"))
            .current_dir(folder)
            .args(["check", "rig.toml", "--light"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(typed.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        assert!(["left", "right"].iter().all(|name| !folder.join(name).exists()), "all is dark afterwards");
        let [out, error] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        (output.status.code().unwrap(), out, error)
    };
    let (code, out, error) = measured("0.5\n12.5\nmuch\n11,0\n");
    assert_eq!((code, out.as_str()), (0, "[lamps]\numol = { left = 12, right = 10.5 }\n"), "{error}");
    assert!(error.contains("left is lit: reading?") && error.contains("\"much\" is no reading"), "{error}");
    assert!(measured("0.5\n0.5\n").2.contains("left: 0.5 µmol/m²/s are no more than the 0.5 in the dark"));
    assert!(measured("0\n12\n").2.contains("right is lit, and the input ended: all light is off"));

    let refused = |settings: &str| {
        let text = fs::read_to_string(folder.join("rig.toml")).unwrap();
        change(folder, "rig.toml", "[lamps]\n", &format!("[lamps]\n{settings}\n"));
        let output = Command::new(env!("CARGO_BIN_EXE_tropism"))
            .current_dir(folder)
            .args(["lamp", "rig.toml", "left", "--seconds", "0.01"])
            .output()
            .unwrap();
        fs::write(folder.join("rig.toml"), text).unwrap();
        String::from_utf8(output.stderr).unwrap()
    };
    let all = "umol = { left = 12, right = 10.5 }\nmax_mol = 0.5\ncolours = { right = \"white\" }";
    assert_eq!(refused(all), "");
    for (settings, wanted) in [
        ("umol = { left = 12.0 }\nmax_mol = 0.5", "right has none: measure it with `tropism check --light`"),
        ("umol = { left = -1.0 }", "umol.left: found -1, wanted above 0 and at most 3000 µmol/m²/s"),
        ("colours = { top = \"red\" }", "lamps.colours: top is no lamp of [lamps]"),
        ("colours = { left = \"green\" }", "unknown variant `green`"),
        ("colours = { left = \"red\", right = \"red\" }", "no lamp is blue or white"),
    ] {
        let error = refused(settings);
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
}

#[test]
fn all_faults_of_a_file_and_of_the_devices_are_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tent(folder);
    let text = fs::read_to_string(folder.join("rig.toml")).unwrap();
    let wrong = text.replace("retries = 0", "retrys = 0").replace("pause_s = 0", "pause_s = \"x\"");
    fs::write(folder.join("rig.toml"), wrong).unwrap();
    let (code, lines) = check(folder, &["--out", "kept"]);
    has(&lines, "retrys");
    has(&lines, "pause_s");
    assert_eq!((code, lines.len()), (1, 2), "{lines:#?}");

    fs::write(folder.join("rig.toml"), format!("period_min = 0\n{text}[fault_policy]\nflash_tries = 0\n"))
        .unwrap();
    let (_, lines) = check(folder, &["--out", "kept"]);
    has(&lines, "period_min = 0");
    has(&lines, "flash_tries");
    assert!(!folder.join("kept").exists(), "an empty folder stays");

    fs::write(folder.join("rig.toml"), text.replace("[\"touch\", \"left\"]", "[\"false\"]")).unwrap();
    change(folder, "camera", "n=$(", "exit 1; n=$(");
    let (_, lines) = check(folder, &["--out", "kept", "--only", "camera,lamps"]);
    has(&lines, "fail camera photograph 1");
    has(&lines, "fail lamps left lamp");
    assert!(!folder.join("kept").exists(), "an empty folder stays");
}

#[test]
fn a_tent_that_is_not_calibrated_yet_is_tried_and_photographed_and_not_run() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tent(folder);
    let text = fs::read_to_string(folder.join("rig.toml")).unwrap();
    fs::write(folder.join("rig.toml"), text.split("[calibration]").next().unwrap()).unwrap();
    let (code, lines) = check(folder, &[]);
    let failed: Vec<_> = lines.iter().filter(|line| line.starts_with("fail")).collect();
    assert!(code == 1 && failed.len() == 1 && failed[0].contains("no [calibration]"), "{failed:#?}");
    has(&lines, "pass lamps left is left, and right is right");

    let tropism = |words: &[&str]| {
        let done =
            Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap();
        (done.status.code(), String::from_utf8(done.stderr).unwrap(), String::from_utf8(done.stdout).unwrap())
    };
    let (code, error, said) = tropism(&["photo", "rig.toml", "--out", "photo.jpg", "--json"]);
    let said: Value = serde_json::from_str(&said).unwrap_or_else(|cause| panic!("{cause}: {error}"));
    assert_eq!((code, &said["seen"]), (Some(0), &Value::Null));
    assert!(folder.join("photo.jpg").exists());
    let (code, error, _) = tropism(&["run", "--rig", "rig.toml", "--controller", "greedy", "--out", "bean"]);
    assert!(code == Some(1) && error.contains("rig.toml: found no [calibration]"), "{error}");
    assert!(!folder.join("bean").exists());
}

#[test]
fn a_camera_that_answers_only_at_the_second_try_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tent(folder);
    change(folder, "rig.toml", "retries = 0", "retries = 2");
    change(folder, "camera", "s=dark", "test -e tried || { touch tried; exit 1; }; rm tried; s=dark");
    let (code, lines) = check(folder, &["--only", "camera"]);
    has(&lines, "warn camera photograph 1 (dark) came only at try 2 of 3");
    assert_eq!(lines.iter().filter(|line| line.contains("came only at")).count(), 1, "{lines:#?}");
    assert_eq!(code, 0);
}

#[test]
fn a_report_holds_what_a_maintainer_needs_and_no_secrets() {
    let folder = tempfile::tempdir().unwrap();
    tent(folder.path());
    change(
        folder.path(),
        "rig.toml",
        "[lamps]\n",
        "[[alert]]\ndriver = \"ntfy\"\nurl = \"https://ntfy.example/my-topic\"\n[lamps]\n",
    );
    let words = ["run", "--rig", "greenhouse", "--controller", "greedy", "--steps", "4", "--out", "bean"];
    let ran =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder.path()).args(words).output().unwrap();
    assert!(ran.status.success());
    let (code, lines) = check(folder.path(), &["--dry", "--report", "problem.md", "--run", "bean"]);
    assert_eq!(code, 0, "{lines:#?}");
    let report = fs::read_to_string(folder.path().join("problem.md")).unwrap();
    for wanted in ["- tropism 0.", std::env::consts::ARCH, "- pass, settings:", "[lamps.left]", "4 steps"] {
        assert!(report.contains(wanted), "{wanted}: {report}");
    }
    assert!(report.contains("https://ntfy.example/***") && !report.contains("my-topic"), "{report}");
}
