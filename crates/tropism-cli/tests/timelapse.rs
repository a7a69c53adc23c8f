//! Films of runs and of folders of photographs.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use tempfile::TempDir;

fn tropism(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap()
}

fn json(folder: &Path, words: &[&str]) -> serde_json::Value {
    let output = tropism(folder, &[words, &["--json"]].concat());
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[track_caller]
fn fails(output: &Output, wanted: &str) {
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(1 | 2)), "{message}");
    assert!(message.contains(wanted) && !message.contains("panicked"), "{message:?} lacks {wanted:?}");
}

/// A folder with a rig file of the virtual tent: with small photographs, which are quick.
fn tent() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let small = "[greenhouse.scene]\nwidth = 324\nheight = 243\n";
    fs::write(folder.path().join("tent.toml"), small).unwrap();
    folder
}

/// A run of six steps in the virtual tent.
fn run() -> TempDir {
    let folder = tent();
    let run = ["run", "--rig", "tent.toml", "--controller", "greedy", "--steps", "6", "--out", "run"];
    assert!(tropism(folder.path(), &run).status.success());
    folder
}

fn starts_with(folder: &TempDir, name: &str, magic: &[u8]) {
    let bytes = fs::read(folder.path().join(name)).unwrap();
    assert!(bytes.starts_with(magic) && bytes.len() > 500, "{name}: {} bytes", bytes.len());
}

const JPEG: &[u8] = &[0xff, 0xd8, 0xff];

#[test]
fn a_run_becomes_a_film_and_a_picture() {
    let folder = run();
    let small = ["timelapse", "run", "--width", "160", "--out"];
    let made = json(folder.path(), &[&small[..], &["run.gif"]].concat());
    assert_eq!((&made["film"], &made["composite"]), (&"run.gif".into(), &"run.jpg".into()));
    assert_eq!((&made["photographs"], &made["pictures"]), (&7.into(), &7.into()));
    assert_eq!((&made["width"], &made["height"]), (&160.into(), &120.into()));
    assert_eq!(made["is_virtual"], true);
    starts_with(&folder, "run.gif", b"GIF89a");
    starts_with(&folder, "run.jpg", JPEG);
    // The same again, bit by bit, and with one thread.
    json(folder.path(), &[&small[..], &["again.gif", "--threads", "1"]].concat());
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("run.gif") == bytes("again.gif") && bytes("run.jpg") == bytes("again.jpg"));
    fails(
        &tropism(folder.path(), &[&small[..], &["run.mp4"]].concat()),
        "run.jpg: a file is here already: choose a new name, or replace it by --force",
    );
    json(folder.path(), &[&small[..], &["again.gif", "--force"]].concat());
    // What is drawn shows, and so does that the plant is virtual where nothing else is drawn.
    json(folder.path(), &[&small[..], &["plain.gif", "--plain"]].concat());
    assert_ne!(bytes("run.gif"), bytes("plain.gif"));
    let third = json(folder.path(), &[&small[..], &["third.gif", "--every", "3"]].concat());
    assert_eq!(third["pictures"], 3);
    let plant = json(folder.path(), &[&small[..], &["plant.gif", "--crop", "plant"]].concat());
    assert_eq!(plant["width"], 160);
    assert_ne!(plant["height"], made["height"]);
    // Held back, the same happens.
    let slowly = ["run", "--rig", "tent.toml", "--controller", "greedy", "--steps", "6", "--speed", "30000"];
    assert!(tropism(folder.path(), &[&slowly[..], &["--out", "slow"]].concat()).status.success());
    assert!(bytes("run/track.csv") == bytes("slow/track.csv"));
    assert!(bytes("run/photographs/000006.jpg") == bytes("slow/photographs/000006.jpg"));
}

#[test]
fn a_run_at_work_can_be_looked_at() {
    let folder = tent();
    let run =
        ["run", "--rig", "tent.toml", "--controller", "greedy", "--speed", "1000", "--out", "run", "--quiet"];
    let mut child =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(&folder).args(run).spawn().unwrap();
    let started = Instant::now();
    while !folder.path().join("run/photographs/000002.jpg").exists() {
        assert!(started.elapsed() < Duration::from_secs(60), "no photograph came");
        std::thread::sleep(Duration::from_millis(5));
    }
    let made = json(folder.path(), &["timelapse", "run", "--width", "64", "--out", "so-far.gif"]);
    assert!(child.try_wait().unwrap().is_none(), "it is still at work");
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(made["pictures"].as_u64().unwrap() >= 2, "{made}");
}

#[test]
fn a_folder_of_photographs_does_and_damaged_ones_are_left_out() {
    let folder = run();
    let photographs = folder.path().join("run/photographs");
    let bytes = fs::read(photographs.join("000003.jpg")).unwrap();
    fs::write(photographs.join("000003.jpg"), &bytes[..bytes.len() / 2]).unwrap();
    fs::remove_file(photographs.join("000000.jpg")).unwrap();
    let made = json(folder.path(), &["timelapse", "run/photographs", "--width", "100", "--out", "a.gif"]);
    assert_eq!((&made["photographs"], &made["pictures"]), (&6.into(), &5.into()));
    // They lie in the folder of a run, which says that they are of a virtual plant; elsewhere they say so themselves, unless
    // another program has written them anew.
    assert_eq!((&made["left_out"], &made["is_virtual"]), (&1.into(), &true.into()));
    fs::create_dir(folder.path().join("elsewhere")).unwrap();
    fs::copy(photographs.join("000001.jpg"), folder.path().join("elsewhere/1.jpg")).unwrap();
    let made = json(folder.path(), &["timelapse", "elsewhere", "--width", "100", "--out", "c.gif"]);
    assert_eq!((&made["pictures"], &made["is_virtual"]), (&1.into(), &true.into()));
    let own = fs::read(folder.path().join("elsewhere/1.jpg")).unwrap();
    let place = own.windows(13).position(|text| text == b"virtual plant").unwrap();
    let silent = [&own[..place], b"another plant", &own[place + 13..]].concat();
    fs::write(folder.path().join("elsewhere/1.jpg"), silent).unwrap();
    let made = json(folder.path(), &["timelapse", "elsewhere", "--width", "100", "--out", "d.gif"]);
    assert_eq!((&made["pictures"], &made["is_virtual"]), (&1.into(), &serde_json::Value::Null));
    // In a run, a photograph that was taken away is missed as well; and a picture alone makes no film.
    let made = json(folder.path(), &["timelapse", "run", "--width", "100", "--out", "b.jpg"]);
    assert_eq!(
        (&made["photographs"], &made["pictures"], &made["left_out"]),
        (&7.into(), &5.into(), &2.into())
    );
    assert_eq!(made["film"], serde_json::Value::Null);
    starts_with(&folder, "b.jpg", JPEG);
}

#[test]
fn bad_input_is_a_clear_line_and_leaves_nothing() {
    let folder = run();
    let film = |words: &[&str]| tropism(folder.path(), &[&["timelapse"], words].concat());
    fails(&film(&["absent", "--out", "a.gif"]), "absent: cannot read");
    fails(&film(&["run", "--out", "a.png"]), "a.png: wanted .gif, .mp4 or .jpg");
    fails(&film(&["run", "--out", "no/such/a.gif"]), "no/such/a.gif: cannot write");
    fails(&film(&["run", "--out", "a.gif", "--crop", "9000,0,10,10"]), "9000,0,10,10 of --crop inside");
    fails(&film(&["run/photographs", "--out", "a.gif", "--crop", "plant"]), "has no calibration");
    fails(&film(&["run", "--out", "a.gif", "--fps", "0"]), "--fps");
    fails(&film(&["run", "--out", "a.gif", "--every", "0"]), "--every");
    fs::create_dir(folder.path().join("texts")).unwrap();
    fails(&film(&["texts", "--out", "a.gif"]), "texts: no photographs here: no .jpg");
    fs::write(folder.path().join("texts/a.jpg"), "no photograph").unwrap();
    fails(&film(&["texts", "--out", "a.gif"]), "a.jpg: found a file that starts with");
    fs::write(folder.path().join("texts/run.toml"), "").unwrap();
    fails(&film(&["texts", "--out", "a.gif"]), "run.toml");
    fs::copy(folder.path().join("run/run.toml"), folder.path().join("texts/run.toml")).unwrap();
    fails(&film(&["texts", "--out", "a.gif"]), "texts/photographs: cannot read");
    fs::write(folder.path().join("texts/journal.sqlite"), "no database, but long enough to be taken for one")
        .unwrap();
    fails(&film(&["texts", "--out", "a.gif"]), "texts/journal.sqlite");
    let left = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
    let left: Vec<_> = left.filter(|name| name.to_string_lossy().starts_with("a.")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[cfg(unix)]
#[test]
fn mp4_is_made_by_ffmpeg_where_there_is_one() {
    use std::os::unix::fs::PermissionsExt;
    let folder = run();
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).unwrap();
    let film = |path: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
        command.current_dir(&folder).env("PATH", path).args([
            "timelapse",
            "run",
            "--width",
            "64",
            "--out",
            "a.mp4",
        ]);
        command.output().unwrap()
    };
    fails(&film(bin.to_str().unwrap()), "needs ffmpeg, which is not on the PATH");
    assert!(!folder.path().join("a.part.mp4").exists());
    // One that keeps what it is given, and how it is called.
    let stand_in = |script: &str| {
        let file = bin.join("ffmpeg");
        fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
        format!("{}:/usr/bin:/bin", bin.display())
    };
    let path = stand_in("echo \"$@\" > called; for last; do :; done; cat > \"$last\"");
    let output = film(&path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(fs::read(folder.path().join("a.mp4")).unwrap().len(), 7 * 3 * 64 * 48);
    assert!(fs::read_to_string(folder.path().join("called")).unwrap().contains("-s 64x48 -r 20 -i -"));
    fs::remove_file(folder.path().join("a.mp4")).unwrap();
    fs::remove_file(folder.path().join("a.jpg")).unwrap();
    let output = film(&stand_in("echo 'Unknown encoder libx264' >&2; exit 1"));
    fails(&output, "ffmpeg: ended with exit status: 1: Unknown encoder libx264");
    assert!(!folder.path().join("a.mp4").exists() && !folder.path().join("a.part.mp4").exists());
}
