//! What `tropism show` says of champions, wherever they lie.

#[path = "../../tropism-lab/tests/common/mod.rs"]
mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::leaning_plant;

fn tropism(folder: &Path, words: &[&str]) -> String {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap();
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn json(folder: &Path, words: &[&str]) -> serde_json::Value {
    serde_json::from_str(&tropism(folder, &[words, &["--json"]].concat())).unwrap()
}

/// A study of sorts: a model, an evolution on it and a run steered by its champion, in the places of a study.
fn study(folder: &Path) {
    leaning_plant(folder);
    tropism(folder, &["fit", "track.csv", "--out", "model.json"]);
    let evolve = ["evolve", "--model", "model.json", "--task", "task.toml", "--out", "evolution"];
    tropism(folder, &[&evolve[..], &["--runs", "2", "--generations", "10"]].concat());
    let run =
        ["run", "--rig", "greenhouse", "--controller", "evolution/champion.json", "--task", "task.toml"];
    // Small photographs are quick.
    fs::write(folder.join("scene.toml"), "width = 324\nheight = 243\n").unwrap();
    tropism(folder, &[&run[..], &["--steps", "3", "--scene", "scene.toml", "--out", "run"]].concat());
}

#[test]
fn champions_are_found_where_they_lie() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path());
    let champion = json(folder.path(), &["show", "evolution/champion.json"]);
    assert_eq!((&champion["inputs"], &champion["outputs"]), (&2.into(), &1.into()));
    // It was evolved on a model of a plant that is taken for real, and steers one on it.
    assert_eq!(champion["is_virtual"], false);
    assert!(champion["fitness"].as_f64().unwrap().is_finite());
    for place in [".", "evolution"] {
        let found = json(folder.path(), &["show", place]);
        assert_eq!(
            (&found["links"], &found["fitness"]),
            (&champion["links"], &champion["fitness"]),
            "{place}"
        );
    }
    assert!(json(folder.path(), &["show", "evolution/champions/run-01.json"])["fitness"].is_number());
    let steered = json(folder.path(), &["show", "run"]);
    assert_eq!((&steered["links"], &steered["is_virtual"]), (&champion["links"], &true.into()));
    // Without the folders around it, a genome is drawn alone.
    fs::copy(folder.path().join("evolution/champion.json"), folder.path().join("alone.json")).unwrap();
    assert!(json(folder.path(), &["show", "alone.json"])["fitness"].is_null());
    // Settings for another evolution beside it are not its record.
    fs::write(folder.path().join("evolution.toml"), "seed = 1\n").unwrap();
    assert!(json(folder.path(), &["show", "alone.json"])["fitness"].is_null());
    fs::remove_file(folder.path().join("evolution.toml")).unwrap();
    // Of an evolution that is not over, the best so far; from its checkpoints, which stay as they are.
    let champion = folder.path().join("evolution/champion.json");
    fs::remove_file(&champion).unwrap();
    let run = fs::read(folder.path().join("evolution/run-00.json")).unwrap();
    fs::write(folder.path().join("evolution/run-01.json"), "{").unwrap();
    let so_far = json(folder.path(), &["show", "evolution"]);
    let first = json(folder.path(), &["show", "evolution/champions/run-00.json"]);
    assert_eq!((&so_far["links"], &so_far["fitness"]), (&first["links"], &first["fitness"]));
    assert!(fs::read(folder.path().join("evolution/run-00.json")).unwrap() == run);
    assert!(!folder.path().join("evolution/run-01.broken.json").exists());
    fs::write(folder.path().join("evolution/run-00.json"), "{").unwrap();
    let words = ["show", "evolution"];
    let none = Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(&folder).args(words).output().unwrap();
    let message = String::from_utf8_lossy(&none.stderr).into_owned();
    assert!(message.contains("evolution: this evolution has just begun"), "{message}");
    fs::copy(folder.path().join("alone.json"), champion).unwrap();
    // On another model than its own it steers nothing, unless that one is named.
    fs::write(folder.path().join("task.toml"), "").unwrap();
    tropism(folder.path(), &["fit", "track.csv", "--window", "1,1", "--force", "--out", "model.json"]);
    assert!(json(folder.path(), &["show", "evolution"])["fitness"].is_null());
    assert!(json(folder.path(), &["show", "alone.json", "--model", "model.json"])["fitness"].is_number());
}

#[test]
fn every_form_goes_to_stdout_or_to_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 2, 1, 1, 0);
    fs::write(folder.path().join("champion.json"), genome.to_json()).unwrap();
    let text = tropism(folder.path(), &["show", "champion.json"]);
    assert!(text.contains("linear: the output is a weighted sum") && text.contains("right where"), "{text}");
    assert!(text.lines().filter(|line| line.contains("<<<") || line.contains(">>>")).count() >= 13, "{text}");
    for (name, start, holds) in [
        ("a.svg", "<svg xmlns=", "prefers-color-scheme:dark"),
        ("a.html", "<!DOCTYPE html>", "id=\"figure-decision\""),
        ("a.dot", "digraph network {", "n3 -> n4"),
    ] {
        tropism(folder.path(), &["show", "champion.json", "--out", name]);
        let file = fs::read_to_string(folder.path().join(name)).unwrap();
        assert!(file.starts_with(start) && file.contains(holds), "{name}: {file}");
        let format = &name[2..];
        let out = tropism(folder.path(), &["show", "champion.json", "--format", format]);
        assert_eq!(out.trim_end(), file.trim_end(), "{name}");
    }
}

/// A genome with `hidden` neurons in a chain and links from each of them to the next `links`.
fn large_genome(hidden: usize, links: usize) -> String {
    let neuron = |id: usize| {
        let (kind, depth) = match id {
            1 | 2 => ("input", 0.0),
            3 => ("bias", 0.0),
            4 => ("output", 1.0),
            _ => ("hidden", (id - 4) as f64 / (hidden + 1) as f64),
        };
        format!(
            r#"{{"id":{id},"kind":"{kind}","depth":{depth:?},"activation":"unsigned_sigmoid","a":1.0,"b":0.0}}"#
        )
    };
    let neurons: Vec<String> = (1..5 + hidden).map(neuron).collect();
    let pairs =
        (0..hidden).flat_map(|from| (1..=links).map(move |next| (from + 5, (from + next) % hidden + 5)));
    let pairs = [(1, 5), (2, 5), (3, 5), (5, 4)].into_iter().chain(pairs);
    let link = |(index, (from, to)): (usize, (usize, usize))| {
        let innovation = index + 1;
        // Signs alternate, so that the state of the network does not settle.
        let weight = if index % 3 == 0 { -3.1 } else { 2.7 };
        format!(r#"{{"innovation":{innovation},"from":{from},"to":{to},"weight":{weight},"recurrent":true}}"#)
    };
    let links: Vec<String> = pairs.enumerate().map(link).collect();
    format!(
        r#"{{"schema":"tropism.genome/1","inputs":2,"outputs":1,"neurons":[{}],"links":[{}]}}"#,
        neurons.join(","),
        links.join(",")
    )
}

#[test]
fn a_network_too_large_to_draw_is_named_by_its_numbers() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("large.json"), large_genome(3000, 30)).unwrap();
    let began = std::time::Instant::now();
    let sentence = "too large to draw: found 3004 neurons and 90004 links, wanted at most 200 and 400";
    let text = tropism(folder.path(), &["show", "large.json"]);
    assert!(text.contains(sentence) && text.contains("3000 hidden neurons"), "{text}");
    for out in ["large.svg", "large.html"] {
        let output = Command::new(env!("CARGO_BIN_EXE_tropism"))
            .current_dir(folder.path())
            .args(["show", "large.json", "--out", out])
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && error.contains(sentence), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
    }
    tropism(folder.path(), &["show", "large.json", "--out", "large.dot"]);
    assert!(began.elapsed().as_secs() < 30, "{:?}", began.elapsed());
    // The largest that is drawn.
    fs::write(folder.path().join("drawn.json"), large_genome(190, 2)).unwrap();
    let began = std::time::Instant::now();
    tropism(folder.path(), &["show", "drawn.json", "--out", "drawn.svg"]);
    assert!(began.elapsed().as_secs() < 30, "{:?}", began.elapsed());
    assert!(fs::metadata(folder.path().join("drawn.svg")).unwrap().len() < 1_000_000);
}
