//! Long work goes on from what it wrote alone, and shows how far it is.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

fn command(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command
        .current_dir(folder)
        .args(words)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

#[track_caller]
fn tropism(folder: &Path, words: &[&str]) -> String {
    let Output { status, stdout, stderr } = command(folder, words).output().unwrap();
    assert!(status.success(), "{words:?}: {}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).unwrap().trim_end().to_owned()
}

#[track_caller]
fn refused(folder: &Path, words: &[&str], wanted: &str) {
    let Output { status, stderr, .. } = command(folder, words).output().unwrap();
    let said = String::from_utf8_lossy(&stderr);
    assert!(!status.success() && said.contains(wanted), "{words:?}: {said}");
}

/// Kills a program as soon as `is_at_work`, or lets it end.
fn kill_when(mut child: Child, is_at_work: impl Fn() -> bool) {
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() && !is_at_work() {
        assert!(started.elapsed() < Duration::from_secs(60), "it never came to work");
        std::thread::sleep(Duration::from_millis(2));
    }
    let _ = child.kill();
    child.wait().unwrap();
}

/// A model of the stems of so many beans.
fn grow_and_fit(folder: &Path, plants: &str) {
    tropism(folder, &["grow", "--plants", plants, "--steps", "300", "--out", "beans"]);
    tropism(folder, &["fit", "beans", "--kind", "stem", "--out", "stem.json"]);
}

#[test]
fn a_rule_of_one_plant_carries_no_expectation() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    grow_and_fit(here, "1");
    let search = ["--generations", "2", "--population", "4", "--episodes", "2"];
    let printed =
        tropism(here, &[&["tune", "--model", "stem.json", "--out", "rule.json"], &search[..]].concat());
    assert!(printed.contains("unseen plants of the model"), "{printed}");
    assert!(
        printed.contains("expected on unseen plants: withheld, for the model is of one plant"),
        "{printed}"
    );
    assert!(!fs::read_to_string(here.join("rule.json")).unwrap().contains("expected"));
    let words =
        ["transfer", "--controllers", "rule.json", "greedy", "--plants", "2", "--json", "--out", "transfer"];
    let transfer: serde_json::Value = serde_json::from_str(&tropism(here, &words)).unwrap();
    assert!(transfer["controllers"][0]["expected"].is_null(), "{transfer}");
}

#[test]
fn a_killed_search_for_a_rule_goes_on_alone() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    grow_and_fit(here, "2");
    let search = ["--generations", "30", "--population", "6", "--episodes", "4"];
    let tune = |out| [&["tune", "--model", "stem.json", "--out", out], &search[..]].concat();
    tropism(here, &tune("whole.json"));
    let saved = here.join("rule.search.jsonl");
    let lines = || fs::read_to_string(&saved).map_or(0, |text| text.lines().count());
    kill_when(command(here, &tune("rule.json")).spawn().unwrap(), || lines() > 3);
    assert!(saved.exists() && !here.join("rule.json").exists(), "it was killed at work");
    let printed = tropism(here, &["status", "rule.json"]);
    assert!(
        printed.starts_with("rule.json: not finished\n  search  ")
            && printed.contains(" of 30 generations, best "),
        "{printed}"
    );
    assert!(printed.ends_with("tropism tune --out rule.json --resume"), "{printed}");
    let ignored = ["tune", "--out", "rule.json", "--resume", "--generations", "2", "--seed", "7"];
    refused(here, &ignored, "settings in rule.json: leave out --generations and --seed");
    tropism(here, &["tune", "--out", "rule.json", "--resume"]);
    let [whole, resumed] = ["whole.json", "rule.json"].map(|name| fs::read(here.join(name)).unwrap());
    assert!(whole == resumed && !saved.exists());
    assert_eq!(tropism(here, &["status", "rule.json"]), "rule.json: over");
}

#[test]
fn a_killed_comparison_goes_on_alone() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let transfer = |out| {
        ["transfer", "--controllers", "greedy", "periodic:6h", "--plants", "12", "--seed", "5", "--out", out]
    };
    tropism(here, &transfer("whole"));
    let tracks = here.join("killed/tracks/greedy");
    let count = || fs::read_dir(&tracks).map_or(0, Iterator::count);
    kill_when(command(here, &transfer("killed")).spawn().unwrap(), || count() > 1);
    let printed = tropism(here, &["status", "killed"]);
    assert!(printed.contains("plants  ") && printed.contains(" of 24 ("), "{printed}");
    assert!(printed.ends_with("next: tropism transfer --out killed --resume"), "{printed}");
    tropism(here, &["transfer", "--out", "killed", "--resume"]);
    for file in ["transfer.json", "plants.csv", "plan.json", "tracks/periodic-6h/plant-0012.csv"] {
        let [whole, resumed] = ["whole", "killed"].map(|out| fs::read(here.join(out).join(file)).unwrap());
        assert!(whole == resumed, "{file} differs");
    }
    assert!(
        tropism(here, &["status", "killed"])
            .contains("killed: over, virtual plants or a model of them\nplants         24 of 24 (100 %)")
    );
}

#[test]
fn plants_are_calibrated_by_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    tropism(here, &["grow", "--plants", "2", "--steps", "200", "--out", "beans"]);
    let estimates: serde_json::Value =
        serde_json::from_str(&tropism(here, &["calibrate", "beans", "--json"])).unwrap();
    let tracks: Vec<_> =
        estimates.as_array().unwrap().iter().map(|one| one["track"].as_str().unwrap()).collect();
    assert_eq!(tracks, ["beans/plant-0001.csv", "beans/plant-0002.csv"]);
}

#[test]
fn a_folder_of_other_work_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    tropism(here, &["grow", "--plants", "2", "--steps", "60", "--out", "beans"]);
    tropism(here, &["fit", "beans", "--out", "model.json"]);
    let evolve = ["evolve", "--model", "model.json", "--runs", "1", "--generations", "2"];
    tropism(here, &[&evolve[..], &["--out", "evolution"]].concat());
    tropism(here, &["run", "--rig", "greenhouse", "--controller", "greedy", "--steps", "2", "--out", "run"]);
    let refused = |words: &[&str]| {
        let Output { status, stderr, .. } = command(here, words).output().unwrap();
        assert!(!status.success(), "{words:?}");
        String::from_utf8(stderr).unwrap()
    };
    let said = refused(&["run", "--rig", "greenhouse", "--controller", "greedy", "--out", "evolution"]);
    assert!(said.contains("evolution: other work is here (evolution.toml): choose a new folder"), "{said}");
    assert!(!here.join("evolution/run.toml").exists() && !here.join("evolution/photographs").exists());
    let said = refused(&[&evolve[..], &["--out", "run"]].concat());
    assert!(said.contains("run: other work is here (run.toml)"), "{said}");
    // A study takes nothing for its own that it has not made.
    fs::create_dir(here.join("study")).unwrap();
    fs::copy(here.join("model.json"), here.join("study/model.json")).unwrap();
    let said = refused(&["study", "--quick", "--out", "study"]);
    assert!(said.contains("study: found results of \"model\" here, but no study.toml beside them"), "{said}");
    // No page takes the place of other files, and no model that of what is known of its track.
    let said = refused(&["report", "evolution", "--out", "model.json"]);
    assert!(said.contains("model.json: a file is here already that is no page"), "{said}");
    fs::write(here.join("beans/plant-0001.json"), "{}").unwrap();
    let said = refused(&["fit", "beans/plant-0001.csv", "--out", "beans/plant-0001.json", "--force"]);
    assert!(said.contains("this is the input beans/plant-0001.json"), "{said}");
}
