//! From tracks to a tuned rule that steers: a model of the stem, the search, and the commands that take both.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

fn tropism(folder: &Path, words: &[&str]) -> Result<String, String> {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
}

const TUNE: [&str; 9] =
    ["tune", "--model", "stem.json", "--generations", "8", "--population", "8", "--episodes", "8"];

/// A folder with a model of the stems of three virtual beans.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    tropism(folder.path(), &["grow", "--plants", "3", "--steps", "400", "--out", "beans"]).unwrap();
    let tracks = ["beans/plant-0001.csv", "beans/plant-0002.csv", "beans/plant-0003.csv"];
    let fit = [&["fit"], &tracks[..], &["--kind", "stem", "--out", "stem.json"]].concat();
    let printed = tropism(folder.path(), &fit).unwrap();
    assert!(printed.contains("next: tropism tune --out rule.json --model stem.json"), "{printed}");
    folder
}

#[test]
fn a_rule_is_tuned_to_the_same_bytes_on_any_number_of_threads() {
    let folder = folder();
    let here = folder.path();
    for (threads, out) in [("1", "one.json"), ("2", "two.json")] {
        tropism(here, &[&TUNE[..], &["--threads", threads, "--out", out]].concat()).unwrap();
    }
    let rule = fs::read_to_string(here.join("one.json")).unwrap();
    assert_eq!(rule, fs::read_to_string(here.join("two.json")).unwrap());
    let rule: Value = serde_json::from_str(&rule).unwrap();
    assert_eq!((&rule["schema"], &rule["is_virtual"]), (&"tropism.rule/1".into(), &true.into()));
    let printed = tropism(here, &[&TUNE[..], &["--json", "--out", "three.json"]].concat()).unwrap();
    let printed: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!((&printed["rule"], &printed["expected"]), (&rule["rule"], &rule["expected"]));
    assert!(printed["expected"]["mean"].as_f64() >= printed["greedy"]["mean"].as_f64(), "{printed}");
}

#[test]
fn a_rule_steers_wherever_a_controller_does() {
    let folder = folder();
    let here = folder.path();
    fs::write(here.join("task.toml"), "max_steps = 30\n").unwrap();
    tropism(here, &[&TUNE[..], &["--task", "task.toml", "--out", "rule.json"]].concat()).unwrap();
    let rule = ["--controller", "rule.json"];
    let simulated = ["simulate", "--model", "stem.json", "--plants", "5", "--out", "simulated.csv"];
    let printed = tropism(here, &[&simulated[..], &rule].concat()).unwrap();
    assert!(printed.contains("5 simulated plants"), "{printed}");
    tropism(here, &[&["grow", "--plants", "1", "--out", "grown"], &rule[..]].concat()).unwrap();
    // Small photographs are quick.
    fs::write(here.join("scene.toml"), "width = 324\nheight = 243\n").unwrap();
    let run = ["run", "--rig", "greenhouse", "--scene", "scene.toml", "--out", "steered"];
    tropism(here, &[&run[..], &rule].concat()).unwrap();
    // The task of the rule: 30 steps and the last observation, below the header.
    for track in ["simulated.csv", "grown/plant-0001.csv", "steered/track.csv"] {
        assert_eq!(fs::read_to_string(here.join(track)).unwrap().lines().count(), 32, "{track}");
    }
    // The folder of a run reruns from itself alone.
    fs::remove_file(here.join("rule.json")).unwrap();
    tropism(here, &["run", "--out", "steered", "--resume"]).unwrap();
    let run = fs::read_to_string(here.join("steered/run.toml")).unwrap();
    assert!(run.contains("kind = \"rule\"") && run.contains("overshoot"), "{run}");
}

#[test]
fn networks_evolve_on_a_model_of_the_stem() {
    let folder = folder();
    let here = folder.path();
    let evolve = ["evolve", "--model", "stem.json", "--out", "evolution", "--runs", "1"];
    tropism(here, &[&evolve[..], &["--generations", "2"]].concat()).unwrap();
    let champion = fs::read_to_string(here.join("evolution/champion.json")).unwrap();
    assert!(champion.contains("tropism.champion/1"), "{champion}");
    // The best fitness for targets that are still to be drawn is not known, and none is printed.
    fs::write(here.join("random.toml"), "kind = \"random_targets\"\n").unwrap();
    let random =
        ["evolve", "--model", "stem.json", "--task", "random.toml", "--runs", "1", "--generations", "1"];
    let printed = tropism(here, &[&random[..], &["--out", "random"]].concat()).unwrap();
    assert!(printed.contains("best fitness of a run") && !printed.contains("best possible"), "{printed}");
}

#[test]
fn a_model_of_the_stem_refuses_settings_and_lamps_that_it_cannot_have() {
    let folder = folder();
    let here = folder.path();
    let fit = ["fit", "--kind", "stem", "--out", "bad.json"];
    let error =
        tropism(here, &[&fit[..], &["--window", "1,1", "beans/plant-0001.csv"]].concat()).unwrap_err();
    assert!(error.contains("--kind stem has none"), "{error}");
    tropism(here, &["grow", "--plants", "1", "--steps", "400", "--lamps", "4", "--out", "four"]).unwrap();
    let error = tropism(here, &[&fit[..], &["four/plant-0001.csv"]].concat()).unwrap_err();
    assert!(error.contains("left, right, front, back"), "{error}");
    assert!(!here.join("bad.json").exists());
    let error = tropism(here, &["tune", "--model", "task.toml", "--out", "rule.json"]).unwrap_err();
    assert!(error.contains("task.toml"), "{error}");
}
