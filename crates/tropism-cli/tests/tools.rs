//! The tools around a run: status, stop, safe-state, export.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::Value;

fn tropism(folder: &Path, words: &[&str]) -> (i32, String, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
}

fn json(folder: &Path, words: &[&str]) -> Value {
    let (code, out, error) = tropism(folder, &[words, &["--json"]].concat());
    assert_eq!(code, 0, "{words:?}: {error}");
    serde_json::from_str(&out).unwrap()
}

const RUN: [&str; 9] =
    ["run", "--rig", "tent.toml", "--controller", "periodic:10m", "--out", "bean", "--seed", "3"];

/// A rig file of the virtual tent, with small photographs, which are quick.
fn tent(folder: &Path) {
    fs::write(folder.join("tent.toml"), "[greenhouse.scene]\nwidth = 324\nheight = 243\n").unwrap();
}

/// A virtual run of six steps in `bean`.
fn run(folder: &Path) {
    tent(folder);
    let (code, _, error) = tropism(folder, &[&RUN[..], &["--steps", "6"]].concat());
    assert_eq!(code, 0, "{error}");
}

/// A virtual run in `bean` that takes a second a step.
fn slow_run(folder: &Path, more: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_tropism"))
        .current_dir(folder)
        .args(RUN)
        .args(["--steps", "1000", "--speed", "300"])
        .args(more)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn a_run_is_exported_whole_and_nothing_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run(folder);
    let outcome = json(folder, &["export", "bean", "--out", "bean.tar"]);
    assert_eq!(
        (&outcome["steps"], &outcome["is_over"], &outcome["is_virtual"]),
        (&7.into(), &true.into(), &true.into())
    );
    json(folder, &["export", "bean", "--out", "copy"]);

    // Both hold the same: the manifest names every file of the folder with its sum, and the archive unpacks to it.
    let manifest = fs::read_to_string(folder.join("copy/manifest.json")).unwrap();
    let files: Value = serde_json::from_str(&manifest).unwrap();
    let paths: Vec<_> =
        files["files"].as_array().unwrap().iter().map(|file| file["path"].as_str().unwrap()).collect();
    assert_eq!(paths.iter().filter(|path| path.starts_with("photographs/")).count(), 7);
    let mut archive = tar::Archive::new(fs::File::open(folder.join("bean.tar")).unwrap());
    let mut count = 0;
    for entry in archive.entries().unwrap() {
        let mut entry = entry.unwrap();
        let path = entry.path().unwrap().strip_prefix("bean").unwrap().to_owned();
        let mut bytes = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut bytes).unwrap();
        if path != Path::new("manifest.json") {
            assert!(paths.contains(&path.to_str().unwrap()), "{path:?}");
            assert_eq!(fs::read(folder.join("copy").join(&path)).unwrap(), bytes, "{path:?}");
        }
        count += 1;
    }
    assert_eq!(count, paths.len() + 1);
    let events = fs::read_to_string(folder.join("copy/events.csv")).unwrap();
    let lines: Vec<&str> = events.lines().collect();
    assert_eq!(
        lines,
        ["step,kind,text,since_start_s,unix_s", "0,started,the run begins,,", "6,finished,6 steps,,"]
    );
    assert_eq!((&files["events"], files["event_columns"].as_object().unwrap().len()), (&2.into(), 5));
    // The track is one that other commands take.
    assert_eq!(tropism(folder, &["fit", "copy/track.csv", "--out", "model.json"]).0, 0);

    for out in ["bean.tar", "copy"] {
        let (code, _, error) = tropism(folder, &["export", "bean", "--out", out]);
        assert!(code == 1 && error.contains("something is here already"), "{error}");
    }
    let (_, _, error) = tropism(folder, &["export", "bean", "--out", "bean/inside"]);
    assert!(error.contains("inside the run folder"), "{error}");
    assert_eq!(fs::read_to_string(folder.join("copy/manifest.json")).unwrap(), manifest);
}

#[test]
fn a_photograph_that_is_not_what_it_was_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run(folder);
    let photograph = folder.join("bean/photographs/000002.jpg");
    let mut bytes = fs::read(&photograph).unwrap();
    bytes[1000] ^= 1;
    fs::write(&photograph, bytes).unwrap();
    fs::remove_file(folder.join("bean/photographs/000004.jpg")).unwrap();
    for out in ["bean.tar", "copy"] {
        let (code, _, error) = tropism(folder, &["export", "bean", "--out", out]);
        assert!(
            code == 1 && error.contains("000002.jpg: found") && error.contains("as the journal says"),
            "{error}"
        );
        assert!(!folder.join(out).exists() && !folder.join(format!("{out}.part")).exists());
    }
    let outcome = json(folder, &["export", "bean", "--out", "copy", "--keep-going"]);
    let left_out: Vec<_> =
        outcome["left_out"].as_array().unwrap().iter().map(|file| file["path"].clone()).collect();
    assert_eq!(left_out, ["photographs/000002.jpg", "photographs/000004.jpg"]);
    assert!(folder.join("copy/photographs/000003.jpg").exists());
    assert!(!folder.join("copy/photographs/000002.jpg").exists());
}

#[test]
fn status_tells_what_a_run_does() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run(folder);
    let status = json(folder, &["status", "bean"]);
    assert_eq!(status["state"], "over");
    assert_eq!(
        (&status["step"], &status["carried_forward"], &status["unconfirmed"]),
        (&6.into(), &0.into(), &0.into())
    );
    assert_eq!(status["event_counts"], serde_json::json!({"started": 1, "finished": 1}));
    assert_eq!(status["latest_events"][1]["text"], "6 steps");
    assert!(status["photograph_age_s"].as_f64().unwrap() < 3600.0);
    assert!(status["disk_free_bytes"].as_u64().unwrap() > 0);
    let (_, text, _) = tropism(folder, &["status", "bean"]);
    assert!(text.contains("events       1 finished, 1 started"), "{text}");
    assert!(text.contains("             step 6: finished: 6 steps"), "{text}");
    assert!(text.contains("bean: over, a virtual plant") && text.contains("6 of 6 at most"), "{text}");
    let (code, _, error) = tropism(folder, &["status", "."]);
    assert!(code == 1 && error.contains("this is no folder that `run`, `evolve`"), "{error}");
}

#[cfg(unix)]
#[test]
fn a_run_is_stopped_in_order_and_goes_on_later() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    tent(folder);
    let mut child = slow_run(folder, &[]);
    while !folder.join("bean/photographs/000001.jpg").exists() {
        assert!(child.try_wait().unwrap().is_none(), "the run has ended");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let status = json(folder, &["status", "bean"]);
    assert_eq!((&status["state"], &status["process"]), (&"running".into(), &child.id().into()));
    let (code, _, error) = tropism(folder, &[&RUN[..], &["--steps", "1000", "--resume"]].concat());
    assert!(code == 1 && error.contains(&format!("(process {})", child.id())), "{error}");

    let stopped = json(folder, &["stop", "bean"]);
    assert_eq!((&stopped["was_running"], &stopped["process"]), (&true.into(), &child.id().into()));
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let again = json(folder, &["stop", "bean"]);
    assert_eq!((&again["was_running"], &again["process"]), (&false.into(), &Value::Null));
    assert_eq!(json(folder, &["status", "bean"])["state"], "stopped");
    let before = json(folder, &["export", "bean", "--out", "so-far"]);
    assert_eq!(before["is_over"], false);

    let mut child = slow_run(folder, &["--resume"]);
    let next = format!("bean/photographs/{:06}.jpg", before["steps"].as_u64().unwrap());
    while !folder.join(&next).exists() {
        assert!(child.try_wait().unwrap().is_none(), "the run has ended");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    json(folder, &["stop", "bean"]);
    child.wait().unwrap();

    let (code, _, error) = tropism(folder, &["stop", "."]);
    assert!(code == 1 && error.contains("this is no run folder"), "{error}");
}

#[test]
fn all_light_is_put_off_even_if_one_device_does_not_obey() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let say = |what: &str| format!("[\"sh\", \"-c\", \"echo {what} >> log\"]");
    let rig = |right_off: &str| {
        format!(
            "[camera]\ncommand = [\"camera\"]\n[lamps.left]\non = {}\noff = {}\n[lamps.right]\non = {}\noff = \
             {right_off}\n[flash]\non = {}\noff = {}\n[calibration]\npx_per_cm = 35.0\nwidth = 2592\nheight = \
             1944\nbase = {{ x = 1296.0, y = 1700.0 }}\n",
            say("left on"),
            say("left off"),
            say("right on"),
            say("flash on"),
            say("flash off"),
        )
    };
    fs::write(folder.join("rig.toml"), rig(&say("right off"))).unwrap();
    let off = json(folder, &["safe-state", "rig.toml"]);
    assert!(off["devices"].as_array().unwrap().iter().all(|device| device["is_off"] == true), "{off}");
    assert_eq!(fs::read_to_string(folder.join("log")).unwrap(), "flash off\nleft off\nright off\n");

    let kept = rig(&say("right off")).replace("[lamps.left]", "[lamps]\non_exit = \"keep\"\n[lamps.left]");
    fs::write(folder.join("rig.toml"), kept).unwrap();
    fs::remove_file(folder.join("log")).unwrap();
    let kept = json(folder, &["safe-state", "rig.toml"]);
    assert_eq!((&kept["is_kept"], kept["devices"].as_array().unwrap().len()), (&true.into(), 1));
    assert_eq!(fs::read_to_string(folder.join("log")).unwrap(), "flash off\n");
    json(folder, &["safe-state", "rig.toml", "--dark"]);
    assert_eq!(
        fs::read_to_string(folder.join("log")).unwrap(),
        "flash off\nflash off\nleft off\nright off\n"
    );

    fs::write(folder.join("rig.toml"), rig("[\"false\"]")).unwrap();
    let (code, out, error) = tropism(folder, &["safe-state", "rig.toml"]);
    assert!(code == 1 && error.contains("1 of 3 devices did not confirm"), "{error}");
    assert!(out.contains("left lamp: off") && out.contains("right lamp: NOT KNOWN TO BE OFF"), "{out}");
    let (_, _, error) = tropism(folder, &["safe-state", "absent.toml"]);
    assert!(error.contains("absent.toml: cannot read"), "{error}");
}
