//! Evolution in its folder: the same bits whatever happens to the program or to its checkpoints.

#[path = "../../tropism-lab/tests/common/mod.rs"]
mod common;

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use common::leaning_plant;
use tempfile::TempDir;

const RUNS: usize = 2;
const GENERATIONS: usize = 120;

/// A folder with a model of one plant that leans after a lamp, and a short task.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    leaning_plant(folder.path());
    let fit = ["fit", "track.csv", "--out", "model.json"];
    let fit = Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(&folder).args(fit).output().unwrap();
    assert!(fit.status.success(), "{}", String::from_utf8_lossy(&fit.stderr));
    folder
}

/// An evolution of [`GENERATIONS`] that saves itself after each of them, unless `more` says otherwise.
fn evolve(folder: &Path, out: &str, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command.current_dir(folder).args(["evolve", "--model", "model.json", "--task", "task.toml"]);
    command.args(["--runs", &RUNS.to_string(), "--out", out]).args(more);
    for (option, value) in [("--generations", GENERATIONS.to_string()), ("--checkpoint", "0".to_owned())] {
        if !more.contains(&option) {
            command.args([option, &value]);
        }
    }
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn finished(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// Every file whose bytes the seed decides, by name.
fn decided(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = |folder: &Path| {
        let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        paths.filter(|path| path.is_file()).collect::<Vec<_>>()
    };
    let all = [files(folder), files(&folder.join("champions"))].concat();
    let name = |path: &Path| path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
    // Times and processes; and the checkpoints before the last, which depend on when the last one was written.
    let is_decided = |name: &str| {
        !["summary.json", "run.lock"].contains(&name)
            && !name.contains("previous")
            && !name.contains("broken")
    };
    let named = all.iter().map(|path| (name(path), fs::read(path).unwrap()));
    named.filter(|(name, _)| is_decided(name)).collect()
}

#[track_caller]
fn assert_same(folder: &Path, one: &str, other: &str) {
    let (one, other) = (decided(&folder.join(one)), decided(&folder.join(other)));
    assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    assert!(one.len() == 4 + 2 * RUNS, "{:?}", one.keys());
    for (name, bytes) in one {
        assert!(bytes == other[&name], "{name} differs");
    }
}

/// Waits until the run has come so far that there is something to lose.
fn wait_for(child: &mut Child, file: &Path) {
    let started = Instant::now();
    while !file.exists() && child.try_wait().unwrap().is_none() {
        assert!(started.elapsed() < Duration::from_secs(60), "{} never came", file.display());
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_killed_evolution_goes_on_to_the_same_bits() {
    let folder = folder();
    finished(&mut evolve(folder.path(), "whole", &["--threads", "1"]));
    let mut kills = 0;
    // Without a chance to save, at moments of no meaning, often in the middle of a write.
    for milliseconds in [0, 40, 80, 120, 160] {
        let mut child = evolve(folder.path(), "killed", &["--resume", "--threads", "2"]).spawn().unwrap();
        wait_for(&mut child, &folder.path().join("killed/run-00.previous.json"));
        std::thread::sleep(Duration::from_millis(milliseconds));
        kills += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(kills > 0, "it was never at work");
    finished(&mut evolve(folder.path(), "killed", &["--resume"]));
    assert_same(folder.path(), "whole", "killed");
}

#[cfg(unix)]
#[test]
fn a_terminated_evolution_saves_and_says_how_to_go_on() {
    let folder = folder();
    // So many that their lines do not fit into a pipe: it cannot end before somebody reads them.
    let many = ["--generations", "300", "--checkpoint", "100000"];
    finished(&mut evolve(folder.path(), "whole", &many));
    let mut child = evolve(folder.path(), "ended", &[&many[..], &["--json-lines"]].concat()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.nth(4).is_some(), "five generations");
    // No other program may resume it meanwhile.
    let other = evolve(folder.path(), "ended", &[&many[..], &["--resume"]].concat()).output().unwrap();
    let message = String::from_utf8_lossy(&other.stderr).into_owned();
    assert!(message.contains("ended: another program"), "{message}");
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    assert!(lines.count() < RUNS * 300 - 5, "ended before its end");
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert!(message.contains("ended is saved; the same command with --resume goes on"), "{message}");
    finished(&mut evolve(folder.path(), "ended", &[&many[..], &["--resume"]].concat()));
    assert_same(folder.path(), "whole", "ended");
}

#[test]
fn a_broken_checkpoint_is_named_and_the_one_before_it_used_or_the_run_begun_anew() {
    let folder = folder();
    finished(&mut evolve(folder.path(), "whole", &[]));
    finished(&mut evolve(folder.path(), "broken", &[]));
    let file = folder.path().join("broken/run-01.json");
    let text = fs::read_to_string(&file).unwrap();
    for (broken, complaint) in [
        (text[..text.len() / 2].to_owned(), "not a saved run: EOF"),
        (text.replace("evolution-run/1", "evolution-run/9"), "wanted \"tropism.evolution-run/1\""),
        (text.replacen("\"threshold\":", "\"threshold\":1", 1), "changed or damaged"),
    ] {
        fs::write(&file, broken).unwrap();
        let output = finished(&mut evolve(folder.path(), "broken", &["--resume"]));
        let notes = String::from_utf8_lossy(&output.stderr).into_owned();
        let line = notes.lines().find(|line| line.contains("run-01.json: ")).unwrap_or_default();
        assert!(line.contains(complaint), "{notes}");
        let last = format!("run 1 goes on from broken/run-01.previous.json, generation {}", GENERATIONS - 1);
        assert!(line.contains(&last), "{notes}");
        assert_same(folder.path(), "whole", "broken");
    }
    // With nothing left to go on from, the run begins anew, and what was there is kept.
    fs::write(&file, "{").unwrap();
    fs::write(folder.path().join("broken/run-01.previous.json"), "{").unwrap();
    let output = finished(&mut evolve(folder.path(), "broken", &["--resume"]));
    let notes = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(notes.contains("broken/run-01.json: not a saved run"), "{notes}");
    assert!(notes.contains("run 1 begins anew"), "{notes}");
    assert_same(folder.path(), "whole", "broken");
    assert!(folder.path().join("broken/run-01.broken.json").exists());
}

#[test]
fn json_lines_are_generations_and_then_the_outcome() {
    let folder = folder();
    let output = finished(&mut evolve(folder.path(), "lines", &["--json-lines", "--quiet"]));
    assert!(output.stderr.is_empty());
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), RUNS * GENERATIONS + 1);
    for run in 0..RUNS {
        let own = lines.iter().filter(|line| line["run"] == run);
        let numbers: Vec<_> = own.map(|line| line["generation"].as_u64().unwrap()).collect();
        assert!(numbers.into_iter().eq(0..GENERATIONS as u64), "run {run}");
    }
    let outcome = &lines[RUNS * GENERATIONS];
    assert_eq!(outcome["runs"].as_array().unwrap().len(), RUNS);
    let best = |line: &serde_json::Value| line["best_ever"].as_f64();
    let last = lines.iter().rfind(|line| line["run"] == 0).and_then(best);
    assert_eq!(outcome["runs"][0]["best_fitness"].as_f64(), last);
}

#[test]
fn a_champion_carries_its_task_wherever_it_goes() {
    let folder = folder();
    let four =
        "targets = [[1.0, 5.0], [-1.0, 6.0], [1.0, 7.0], [-1.0, 8.0]]\nend_height_cm = 8.5\nmax_steps = 90\n";
    fs::write(folder.path().join("four.toml"), four).unwrap();
    fs::write(folder.path().join("one.toml"), "targets = [[2.0, 6.0]]\n").unwrap();
    let run = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
        let Output { stdout, stderr, .. } = finished(command.current_dir(&folder).args(words));
        (String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap())
    };
    let named = "the targets (1, 5), (-1, 6), (1, 7), (-1, 8)";
    run(&[
        "evolve",
        "--model",
        "model.json",
        "--task",
        "four.toml",
        "--runs",
        "1",
        "--generations",
        "3",
        "--out",
        "e",
    ]);
    let steer = ["--controller", "e/champion.json", "--out"];
    // Small photographs are quick.
    fs::write(folder.path().join("scene.toml"), "width = 324\nheight = 243\n").unwrap();
    let steps = ["--steps", "12", "--scene", "scene.toml"];
    run(&[&["run", "--rig", "greenhouse"], &steer[..], &["steered"], &steps].concat());
    let config = fs::read_to_string(folder.path().join("steered/run.toml")).unwrap();
    assert!(config.contains("[-1.0, 8.0]"), "{config}");
    let (scored, _) = run(&["score", "steered/track.csv"]);
    assert!(scored.contains(&format!("scored by {named}, the task of the run")), "{scored}");
    run(&["report", "steered", "--out", "report.html"]);

    run(&[&["simulate", "--model", "model.json", "--force"], &steer[..], &["track.csv"]].concat());
    let (scored, _) = run(&["score", "track.csv", "--task", "e/champion.json"]);
    assert!(scored.ends_with(&format!("scored by {named}\n")), "{scored}");
    // Elsewhere nothing says of the task, and that is said.
    let (scored, _) = run(&["score", "track.csv"]);
    assert!(scored.contains("(-1, 13.5), the paper's: no task of this track is known"), "{scored}");

    let other = ["--task", "one.toml"];
    for words in [
        [&["run", "--rig", "greenhouse"], &steer[..], &["other"], &steps, &other].concat(),
        [&["simulate", "--model", "model.json"], &steer[..], &["other.csv"], &other].concat(),
    ] {
        let (_, said) = run(&words);
        let wanted = format!("the controller was made for {named}; --task gives it the target (2, 6)");
        assert!(said.contains(&wanted), "{said}");
    }
}

#[test]
fn settings_come_from_a_file_and_the_folder_goes_on_alone() {
    let folder = folder();
    let tropism = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
        command.current_dir(&folder).args(words).output().unwrap()
    };
    finished(&mut evolve(folder.path(), "one", &["--generations", "20", "--seed", "3"]));
    // The settings of one evolution are those of another, and options count more.
    let text = fs::read_to_string(folder.path().join("one/evolution.toml")).unwrap();
    assert!(text.contains("mutate_add_link_prob"), "{text}");
    let words = ["evolve", "--model", "model.json", "--config", "one/evolution.toml", "--out"];
    assert!(tropism(&[&words[..], &["two"]].concat()).status.success());
    assert_same(folder.path(), "one", "two");
    assert!(tropism(&[&words[..], &["three", "--generations", "5"]].concat()).status.success());
    let history = fs::read_to_string(folder.path().join("three/history.csv")).unwrap();
    assert_eq!(history.lines().count(), 1 + 5 * RUNS);
    fs::write(folder.path().join("wrong.toml"), "[evolution.neat]\npopulatoin = 3\n").unwrap();
    let wrong = tropism(&["evolve", "--model", "model.json", "--config", "wrong.toml", "--out", "four"]);
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("wrong.toml: line 2"));

    fs::remove_file(folder.path().join("model.json")).unwrap();
    fs::remove_file(folder.path().join("task.toml")).unwrap();
    fs::remove_file(folder.path().join("two/summary.json")).unwrap();
    let resumed = tropism(&["evolve", "--out", "two", "--resume"]);
    assert!(resumed.status.success(), "{}", String::from_utf8_lossy(&resumed.stderr));
    assert_same(folder.path(), "one", "two");
}
