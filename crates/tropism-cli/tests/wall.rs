//! Virtual plants before a wall of nodes, from the command line.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn wall_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks/wall.toml")
}

fn tropism(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap()
}

#[test]
fn the_wall_of_the_repository_is_the_default_and_its_figure_and_journal_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = wall_file();
    let few = ["--plants", "3", "--rules", "machine,dormant", "--json"];
    let run = |words: &[&str]| {
        let output = tropism(folder.path(), &[words, &few].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let named = run(&["wall", path.to_str().unwrap(), "--out", "out"]);
    let default = run(&["wall", "--threads", "1"]);
    assert_eq!(named["rules"], default["rules"]);
    assert_eq!(named["is_virtual"], true);
    let [machine, dormant] = [0, 1].map(|rule| &named["rules"][rule]);
    assert!(machine["lit_h"].as_f64() > Some(5.0) && dormant["lit_h"].as_f64() == Some(0.0), "{named}");
    let svg = fs::read_to_string(folder.path().join("out/machine-wall.svg")).unwrap();
    assert!(svg.contains("plant 3"));
    let journal = fs::read_to_string(folder.path().join("out/machine-nodes.csv")).unwrap();
    let steps = machine["plants"][0]["steps"].as_u64().unwrap() as usize;
    assert_eq!(journal.lines().count(), 1 + 6 * steps);
    let again = tropism(folder.path(), &["wall", "--plants", "1", "--out", "out"]);
    assert_eq!(again.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&again.stderr).contains("--force"));
}

#[test]
fn wrong_walls_rules_and_faults_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(wall_file()).unwrap();
    for (from, to, wanted) in [
        ("\"random\"              #", "[\"left1\", \"left3\"] #", "no link joins left1 and left3"),
        ("half_angle_deg = 25", "half_angle_deg = 95", "half_angle_deg = 95, wanted 1 to 80"),
        ("range_cm = 5 ", "reach_cm = 5 ", "reach_cm"),
        ("power = 0.05", "power = -1", "power = -1"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        fs::write(folder.path().join("wall.toml"), changed).unwrap();
        let output = tropism(folder.path(), &["wall", "wall.toml", "--plants", "1"]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains(wanted) && message.contains("wall.toml"), "{message:?} lacks {wanted:?}");
    }
    for words in [["--rules", "clever"], ["--faults", "blnd=1"], ["--faults", "lost=2"]] {
        let output = tropism(folder.path(), &[&["wall"][..], &words].concat());
        assert_eq!(output.status.code(), Some(2), "{words:?}");
    }
    let output = tropism(
        folder.path(),
        &["node", "left1", "--wall", wall_file().to_str().unwrap(), "--experiment", "june"],
    );
    assert!(String::from_utf8_lossy(&output.stderr).contains("wall.path: found \"random\""));
}
