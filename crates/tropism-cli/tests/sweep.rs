//! A sweep in its folder: the same bits for any threads, order of units and interruption; and its comparison in a report.

#[path = "../../tropism-lab/tests/common/mod.rs"]
mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// Two settings that clearly differ, and two seeds.
const SWEEP: &str = r#"
model = "model.json"
seeds = [3, 8]

[grid]
evolution.neat.population = [50]
evolution.generations = [1, 60]

[evolve]
trial_plants = 10
evolution.runs = 4
task = { targets = [[1.0, 5.0], [3.0, 6.0]], max_steps = 100 }
"#;

/// A folder with a model of one plant that leans after a lamp, and the sweep file.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    common::leaning_plant(folder.path());
    assert_ok(&tropism(&folder, &["fit", "track.csv", "--out", "model.json"]));
    fs::write(folder.path().join("sweep.toml"), SWEEP).unwrap();
    folder
}

fn command(folder: &TempDir, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command
        .current_dir(folder)
        .args(words)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn tropism(folder: &TempDir, words: &[&str]) -> Output {
    command(folder, words).output().unwrap()
}

#[track_caller]
fn assert_ok(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).trim_end().to_owned()
}

/// Every file whose bytes the seeds decide, by name. Times and locks are of chance, and checkpoints before the last. A kill may
/// leave times half written.
fn decided(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn add(folder: &Path, base: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.strip_prefix(base).unwrap().to_string_lossy().into_owned();
            let is_of_chance = ["run.lock", "seconds.json", "summary.json", "sweep.json", "sweep.csv"]
                .iter()
                .any(|end| name.trim_end_matches(".part").ends_with(end));
            if path.is_dir() {
                add(&path, base, found);
            } else if !is_of_chance && !name.contains(".previous.") {
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    let mut found = BTreeMap::new();
    add(folder, folder, &mut found);
    found
}

#[track_caller]
fn assert_same(folder: &TempDir, one: &str, other: &str) {
    let (one, other) = (decided(&folder.path().join(one)), decided(&folder.path().join(other)));
    assert_eq!(one.keys().collect::<Vec<_>>(), other.keys().collect::<Vec<_>>());
    assert!(one.len() > 4 * 10, "{:?}", one.keys());
    for (name, bytes) in one {
        assert!(bytes == other[&name], "{name} differs");
    }
}

/// The table without times.
fn table(text: &str) -> serde_json::Value {
    let mut results: serde_json::Value = serde_json::from_str(text).unwrap();
    for row in results["rows"].as_array_mut().unwrap() {
        row["cpu_seconds"] = serde_json::Value::Null;
    }
    results
}

#[test]
fn threads_units_and_kills_end_in_the_same_bits() {
    let folder = folder();
    let sweep = |out: &str, more: &[&str]| {
        let words = ["sweep", "sweep.toml", "--out", out];
        tropism(&folder, &[&words[..], more].concat())
    };
    let whole = table(&assert_ok(&sweep("whole", &["--threads", "1", "--json"])));
    assert_eq!(whole["seeds"], serde_json::json!([3, 8]));
    let row = &whole["rows"][1];
    assert_eq!(
        (row["setting"].as_str(), row["seeds"].as_u64(), row["runs"].as_u64()),
        (Some("generations=60, population=50"), Some(2), Some(8))
    );
    assert_eq!((row["values"]["evolution.generations"].as_i64(), row["case"].as_str()), (Some(60), None));
    assert!(
        row["saturation_generation"].as_f64().unwrap() > 1.0
            && row["evaluations"].as_f64().unwrap() > 4.0 * 60.0
    );
    assert!(row["mean"].as_f64() > whole["rows"][0]["mean"].as_f64());
    let pair = &whole["pairs"][0];
    assert_eq!(
        (pair["one"].as_str(), pair["sizes"][0].as_u64(), pair["is_exact"].as_bool()),
        (Some("generations=1, population=50"), Some(8), Some(true))
    );
    assert!(pair["p_holm"].as_f64().unwrap() < 0.05 && pair["superiority"].as_f64().unwrap() < 0.2, "{pair}");

    // Unit by unit, the last first, and two of them at the same moment; then the table.
    let list = assert_ok(&sweep("alone", &["--list"]));
    assert!(list.starts_with("    1  1  setting-1-seed-3") && list.lines().count() == 4, "{list}");
    let unit = |unit: &str| {
        command(&folder, &["sweep", "sweep.toml", "--out", "alone", "--unit", unit]).spawn().unwrap()
    };
    for pair in [["4", "2"], ["3", "1"]] {
        for child in pair.map(unit) {
            let text = assert_ok(&child.wait_with_output().unwrap());
            assert!(
                text.contains(" of 4, setting-") && text.contains("--out alone --resume, which collects"),
                "{text}"
            );
        }
    }
    fs::remove_file(folder.path().join("sweep.toml")).unwrap();
    fs::rename(folder.path().join("model.json"), folder.path().join("elsewhere.json")).unwrap();
    let alone = assert_ok(&tropism(&folder, &["sweep", "--out", "alone", "--resume", "--json"]));
    assert_eq!(table(&alone), whole);
    assert_same(&folder, "whole", "alone");

    // Killed without a chance to save, again and again.
    fs::write(folder.path().join("sweep.toml"), SWEEP).unwrap();
    fs::rename(folder.path().join("elsewhere.json"), folder.path().join("model.json")).unwrap();
    for milliseconds in [150, 250, 400] {
        let words = ["sweep", "sweep.toml", "--out", "killed", "--resume", "--threads", "2"];
        let mut child = command(&folder, &words).spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(milliseconds));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let killed =
        assert_ok(&tropism(&folder, &["sweep", "sweep.toml", "--out", "killed", "--resume", "--json"]));
    assert_eq!(table(&killed), whole);
    assert_same(&folder, "whole", "killed");

    is_told_and_compared(&folder);
}

fn is_told_and_compared(folder: &TempDir) {
    let text = assert_ok(&tropism(folder, &["sweep", "--out", "whole", "--resume"]));
    assert!(
        text.contains("pairs that differ: 1 of 1 (champions in the model: Mann")
            && text.contains("generations=1, population=50 under generations=60, population=50: -"),
        "{text}"
    );
    let csv = fs::read_to_string(folder.path().join("whole/sweep.csv")).unwrap();
    assert!(csv.starts_with("setting,case,seeds,runs,mean_cm,") && csv.lines().count() == 3, "{csv}");
    assert!(
        csv.lines().next().unwrap().ends_with(",cpu_seconds,evolution.generations,evolution.neat.population"),
        "{csv}"
    );

    fs::remove_file(folder.path().join("whole/units/setting-2-seed-8/unit.json")).unwrap();
    let refused = tropism(folder, &["report", "whole", "--out", "report.html"]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("this sweep is not finished"));
    fs::remove_file(folder.path().join("whole/sweep.json")).unwrap();
    let status = assert_ok(&tropism(folder, &["status", "whole"]));
    assert!(
        status.contains("whole: not finished")
            && status.contains("\n  generations=60, population=50  480 of 480 generations"),
        "{status}"
    );
    assert!(status.contains("\ngenerations    488 of 488 (100 %)\n"), "{status}");
    assert!(status.ends_with("next: tropism sweep --out whole --resume"), "{status}");
    assert_ok(&tropism(folder, &["sweep", "--out", "whole", "--resume"]));

    let report = ["report", "whole", "--out", "report.html", "--figures", "figures", "--json"];
    let report: serde_json::Value = serde_json::from_str(&assert_ok(&tropism(folder, &report))).unwrap();
    assert_eq!(report["figures"], serde_json::json!(["comparison", "scores"]));
    assert!(report["comparisons"][0]["pairs"][0]["p"].as_f64().unwrap() < 0.05);
    for end in ["svg", "png", "pdf", "csv"] {
        assert!(folder.path().join("figures").join(format!("figure-comparison.{end}")).exists(), "{end}");
    }
    let page = fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("Which differ") && page.contains("generations=60"), "no table of pairs");

    // The evolutions of two units by themselves.
    let units = ["whole/units/setting-1-seed-3", "whole/units/setting-2-seed-3"];
    let text = assert_ok(&tropism(folder, &[&["report"], &units[..], &["--out", "two.html"]].concat()));
    assert!(text.contains("Evolutions compared: pairs that differ after Holm's correction: "), "{text}");
    assert!(text.contains("figures 6a, 6b, 6a, 6b, comparison, scores"), "{text}");
}

#[test]
fn what_is_wrong_with_a_sweep_is_named_before_any_work() {
    let folder = folder();
    let refused = |text: &str, more: &[&str], wanted: &str| {
        fs::write(folder.path().join("wrong.toml"), text).unwrap();
        let output = tropism(&folder, &[&["sweep", "wrong.toml", "--out", "wrong"], more].concat());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(1) && message.contains(wanted), "{message}");
        assert!(!folder.path().join("wrong").exists(), "{text}: a folder was left");
    };
    let of_model = |grid: &str| format!("model = \"model.json\"\n{grid}");
    refused(
        &of_model("[grid]\nevolution.neat.populatoin = [5]"),
        &[],
        "wrong.toml: grid: evolution.neat.populatoin = 5: unknown field `populatoin`",
    );
    refused(&of_model("seed = 3"), &[], "wrong.toml: line 2: found \"seed = 3\": unknown field `seed`");
    refused("seeds = 2", &[], "--model is missing: name that on which controllers evolve");
    refused("seeds = 2", &["--model", "absent.json"], "absent.json: cannot read");
    refused(&of_model("seeds = 2"), &["--unit", "3"], "found unit = 3, wanted 1 to 2");
    refused("[replicates]", &["--model", "model.json"], "replicates, which make models of their own");
    assert_ok(&tropism(&folder, &["sweep", "sweep.toml", "--out", "once"]));
    let twice = tropism(&folder, &["sweep", "sweep.toml", "--out", "once"]);
    assert!(
        String::from_utf8_lossy(&twice.stderr)
            .contains("a sweep is here already: choose a new folder (--out), or go on with it by --resume")
    );
    fs::write(folder.path().join("sweep.toml"), SWEEP.replace("[3, 8]", "[3]")).unwrap();
    for more in [["--resume", "--quiet"], ["--unit", "1"]] {
        let other = tropism(&folder, &[&["sweep", "sweep.toml", "--out", "once"], &more[..]].concat());
        assert!(
            String::from_utf8_lossy(&other.stderr)
                .contains("with other settings is here: `seeds` = [3,8], wanted [3]:")
        );
    }
}

#[test]
fn replicates_are_swept_too() {
    let folder = tempfile::tempdir().unwrap();
    let text = r#"
seeds = 2
[grid]
methods.rule.search.generations = [1, 2]
[replicates]
replicates = 1
plants = 2
steps = 150
test_plants = 4
task = { targets = [[1.0, 5.0]], end_height_cm = 5.3, max_steps = 60 }
methods = [{ name = "rule", kind = "tune", model = "stem", search = { generations = 1, population = 4, episodes = 4 } }]
scenarios = [{ name = "bean" }]
"#;
    fs::write(folder.path().join("replicates.toml"), text).unwrap();
    assert_ok(&tropism(&folder, &["sweep", "replicates.toml", "--out", "whole"]));
    for unit in ["4", "1", "3", "2"] {
        assert_ok(&tropism(&folder, &["sweep", "replicates.toml", "--out", "alone", "--unit", unit]));
    }
    let results = table(&assert_ok(&tropism(&folder, &["sweep", "--out", "alone", "--resume", "--json"])));
    assert_eq!(results["rows"][1]["case"], "bean/rule");
    assert_eq!(results["rows"][1]["runs"], 2);
    assert_eq!(results["pairs"].as_array().unwrap().len(), 1);
    for unit in ["setting-1-seed-1", "setting-2-seed-2"] {
        let of =
            |out: &str| fs::read(folder.path().join(out).join("units").join(unit).join("unit.json")).unwrap();
        assert!(of("whole") == of("alone"), "{unit} differs");
    }
    let report = assert_ok(&tropism(&folder, &["report", "whole", "--out", "report.html"]));
    assert!(
        report.contains("Settings compared: bean/rule: pairs that differ after Holm's correction: 0 of 1"),
        "{report}"
    );
}

#[test]
fn what_needs_python_says_what_to_install_where_there_is_none() {
    let folder = folder();
    for (words, wanted) in [
        (["--engine", "ray"], "wanted Python with tropism, ray: pip install"),
        (["--out", "memory://sweep"], "wanted Python with tropism, fsspec: pip install"),
    ] {
        let output = command(&folder, &[&["sweep", "sweep.toml"], &words[..]].concat())
            .env("PATH", "")
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && error.contains(wanted), "{error}");
    }
    for (words, wanted) in [
        (["--engine", "slurm"], "wanted local, ray, or ray:HOST:PORT"),
        (["--out=memory://sweep", "--unit=1"], "--out memory://sweep must be a folder with --unit or --list"),
    ] {
        let output = tropism(&folder, &[&["sweep", "sweep.toml"], &words[..]].concat());
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && error.contains(wanted), "{error}");
    }
}

/// Stands in for Python: finds all modules, writes down what it reads, and answers with what lies in `results.json`.
#[cfg(unix)]
const PYTHON: &str = r#"#!/bin/sh
case "$1" in
  -c) echo "$2" >> asked.txt ;;
  -m) echo "$2" >> asked.txt; while read -r line || [ -n "$line" ]; do echo "$line"; done > order.json
      while read -r line || [ -n "$line" ]; do echo "$line"; done < results.json ;;
esac
"#;

#[cfg(unix)]
#[test]
fn a_sweep_at_an_address_is_handed_over_to_python() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let whole = assert_ok(&tropism(&folder, &["sweep", "sweep.toml", "--out", "whole", "--json"]));
    // On Ray there are further keys.
    fs::write(at("results.json"), whole.replacen('{', "{\"units\": [], ", 1)).unwrap();
    fs::write(at("python3"), PYTHON).unwrap();
    fs::set_permissions(at("python3"), fs::Permissions::from_mode(0o755)).unwrap();
    let sweep = |words: &[&str]| {
        let words = [&["sweep", "--out", "s3://bucket/a sweep"], words].concat();
        let text = assert_ok(&command(&folder, &words).env("PATH", folder.path()).output().unwrap());
        let order = fs::read_to_string(at("order.json")).unwrap();
        (text, serde_json::from_str::<serde_json::Value>(&order).unwrap())
    };
    let (text, order) = sweep(&["sweep.toml", "--json", "--threads", "2"]);
    assert_eq!(table(&text), table(&whole));
    assert_eq!((&order["out"], &order["engine"]), (&"s3://bucket/a sweep".into(), &"local".into()));
    assert_eq!((&order["threads"], &order["address"]), (&2.into(), &serde_json::Value::Null));
    assert_eq!(order["plan"]["out"], order["out"]);
    assert_eq!(order["plan"]["config"]["seeds"], serde_json::json!([3, 8]));
    // From what is at the address alone, on a cluster; reports read folders, so none is next.
    let words = ["--resume", "--engine", "ray:head:6379", "--threads", "3"];
    let (text, order) = sweep(&words);
    assert!(text.ends_with("wrote s3://bucket/a sweep/sweep.csv, s3://bucket/a sweep/sweep.json"), "{text}");
    assert_eq!((&order["plan"], &order["threads"]), (&serde_json::Value::Null, &3.into()));
    assert_eq!((&order["engine"], &order["workflow"]), (&"ray".into(), &"sweep".into()));
    assert_eq!(order["address"], "head:6379");
    let asked = fs::read_to_string(at("asked.txt")).unwrap();
    let module = "tropism.work_command";
    assert_eq!(asked, format!("import tropism, fsspec\n{module}\nimport tropism, ray, fsspec\n{module}\n"));
}

/// Stands in for Slurm: executes each task of an array at once, the last first.
#[cfg(unix)]
const SBATCH: &str = r#"#!/usr/bin/env bash
for word in "$@"; do case $word in
  --array=*) last=${word#--array=1-} ;;
  --wrap=*) wrap=${word#--wrap=} ;;
esac; done
for ((task = ${last:-1}; task > 0; task--)); do SLURM_ARRAY_TASK_ID=$task bash -c "$wrap" >&2 || exit 1; done
echo 7
"#;

#[cfg(unix)]
#[test]
fn an_array_job_gives_the_same_as_one_program() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let sbatch = folder.path().join("sbatch");
    fs::write(&sbatch, SBATCH).unwrap();
    fs::set_permissions(&sbatch, fs::Permissions::from_mode(0o755)).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scripts/slurm/work");
    let output = Command::new(script)
        .current_dir(&folder)
        .args(["array job", "sweep", "sweep.toml", "--", "--time=10"])
        .env("SBATCH", &sbatch)
        .env("TROPISM", env!("CARGO_BIN_EXE_tropism"))
        .output()
        .unwrap();
    assert!(assert_ok(&output).contains("4 units; the last jobs: 7"));
    assert_ok(&tropism(&folder, &["sweep", "sweep.toml", "--out", "alone"]));
    let units = |out: &str| -> Vec<Vec<u8>> {
        let names = ["setting-1-seed-3", "setting-1-seed-8", "setting-2-seed-3", "setting-2-seed-8"];
        names
            .map(|name| fs::read(folder.path().join(out).join("units").join(name).join("unit.json")).unwrap())
            .to_vec()
    };
    assert!(units("array job") == units("alone"));
    assert!(folder.path().join("array job/sweep.csv").exists());
}
