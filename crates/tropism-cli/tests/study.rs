//! The main job, end to end at small scale: photographs to report, the same bits whatever the threads and interruptions.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SMALL: &str = r"
experiments = 2
steps = 60
switch_steps = 15
random_controllers = 100
trial_plants = 6
test_plants = 12
reality_plants = 1

[task]
targets = [[0.7, 4.7], [-0.7, 5.4]]
end_height_cm = 5.6
max_steps = 45

[evolution]
runs = 2
generations = 40

[rule]
generations = 3
population = 6
episodes = 6

[greenhouse.scene]
width = 324
height = 243
";

fn study(folder: &Path, more: &[&str]) -> Command {
    let file = folder.join("small.toml");
    fs::write(&file, SMALL).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command.arg("study").arg(file).arg("--out").arg(folder.join("study")).arg("--quiet").args(more);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, more: &[&str]) -> serde_json::Value {
    let output = study(folder, &[&["--json"], more].concat()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Every file of a study whose bytes the seed decides.
fn decided(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    collect(&folder.join("study"), &mut found);
    let of_chance = |path: &Path| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        // Times, paths, what happened to a run, databases' own headers and checkpoints before the last differ from run to run.
        !["seconds.json", "summary.json", "numbers.json", "report.html", "run.lock"].contains(&name.as_str())
            && !name.contains(".previous.")
            && !name.starts_with("journal.")
    };
    found.retain(|path| of_chance(path));
    found.sort();
    let base = folder.join("study");
    found
        .into_iter()
        .map(|path| (path.strip_prefix(&base).unwrap().to_owned(), fs::read(&path).unwrap()))
        .collect()
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { collect(&path, found) } else { found.push(path) }
    }
}

fn assert_same(one: &Path, other: &Path) {
    let (one, other) = (decided(one), decided(other));
    let names = |files: &[(PathBuf, Vec<u8>)]| files.iter().map(|(path, _)| path.clone()).collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    assert!(one.len() > 150, "{} files", one.len());
    for ((path, bytes), (_, others)) in one.iter().zip(&other) {
        assert!(bytes == others, "{} differs", path.display());
    }
}

#[test]
fn one_thread_two_threads_and_a_killed_study_end_in_the_same_bits() {
    let [one, killed] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let mut numbers = run(one.path(), &["--threads", "1"]);

    // On two threads, and killed again and again, without a chance to save, at moments of no meaning.
    let mut kills = 0;
    let mut delay = Duration::from_millis(300);
    loop {
        let more: &[&str] = if kills == 0 { &[] } else { &["--resume"] };
        let mut child = study(killed.path(), &[&["--threads", "2"], more].concat()).spawn().unwrap();
        let started = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            if started.elapsed() > delay {
                break None;
            }
            std::thread::sleep(Duration::from_millis(3));
        };
        if let Some(status) = status {
            let mut complaint = String::new();
            std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut complaint).unwrap();
            assert!(status.success(), "{complaint}");
            break;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        kills += 1;
        report_grows(killed.path());
        // Longer each time, so that a slow machine gets through.
        delay = delay.mul_f64(1.35);
    }
    assert!(kills > 1, "killed {kills} times");
    assert_same(one.path(), killed.path());
    let mut others = run(killed.path(), &["--resume"]);
    for numbers in [&mut numbers, &mut others] {
        numbers["report"] = serde_json::Value::Null;
    }
    assert_eq!(numbers, others);

    studies_are_compared(one.path(), killed.path());
    report_is_whole(one.path(), &numbers);
    is_small_and_goes_on_alone(one.path(), &numbers);
}

/// From its first second on a study at work has a report, which a browser reads again and again.
fn report_grows(folder: &Path) {
    let Ok(html) = fs::read_to_string(folder.join("study/report.html")) else { return };
    let is_at_work = html.contains("A study at work");
    assert_eq!(html.contains("http-equiv=\"refresh\""), is_at_work);
    if is_at_work && fs::exists(folder.join("study/model.json")).unwrap() {
        assert!(html.contains("<figure"), "a study with a model has tracks, which are drawn");
    }
}

/// Two studies of one seed have the same evolutions and champions: no difference is found.
fn studies_are_compared(one: &Path, two: &Path) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command.arg("report").args([one, two].map(|folder| folder.join("study")));
    let output = command.arg("--out").arg(one.join("both.html")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    for what in ["Evolutions", "Champions"] {
        let line = format!("{what} compared: pairs that differ after Holm's correction: 0 of 1");
        assert!(text.contains(&line), "{text}");
    }
}

/// A finished study keeps the photographs that figures show, and needs its folder alone.
fn is_small_and_goes_on_alone(folder: &Path, numbers: &serde_json::Value) {
    let study = folder.join("study");
    let photographs = |run: &str| fs::read_dir(study.join(run).join("photographs")).unwrap().count();
    assert_eq!(photographs("open-loop/1"), 31);
    assert!((20..=60).contains(&photographs("reality/champion/1")));
    assert_eq!(photographs("reality/greedy/1"), 0);
    assert!(!study.join("open-loop/1/truth.jsonl").exists() && study.join("open-loop/1/truth.csv").exists());

    fs::remove_file(folder.join("small.toml")).unwrap();
    fs::remove_file(study.join("numbers.json")).unwrap();
    let tropism = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
        let output = command.current_dir(folder).args(words).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let status = tropism(&["status", "study"]);
    assert!(status.contains("  evolution ") && status.contains("80 of 80 generations"), "{status}");
    assert!(status.contains("next: tropism study --out study --resume"), "{status}");
    let again: serde_json::Value =
        serde_json::from_str(&tropism(&["study", "--out", "study", "--resume", "--json"])).unwrap();
    assert_eq!(again["reality_champion"], numbers["reality_champion"]);
    assert_eq!(photographs("open-loop/1"), 31);
    assert!(tropism(&["status", "study"]).contains("study: over"));
    assert!(tropism(&["status", "study/evolution"]).contains("80 of 80 (100 %), best"));
    assert!(tropism(&["score", "study/reality/champion"]).contains("mean of 1"));
}

fn report_is_whole(folder: &Path, numbers: &serde_json::Value) {
    let report = fs::read_to_string(folder.join("study/report.html")).unwrap();
    for figure in ["2", "3", "4a", "4b", "5a", "5b", "5c", "5d", "6a", "6b", "7a", "7b", "7c", "7d", "8", "9"]
    {
        assert!(report.contains(&format!("id=\"figure-{figure}\"")), "figure {figure}");
    }
    assert!(report.contains("Virtual plants"));
    assert!(report.contains(&format!("{:.2}", numbers["best_evolved"].as_f64().unwrap())));
    // Evolution is worth its name: the champion beats a controller that sees nothing, in the model and on fresh beans.
    let number = |name: &str| numbers[name].as_f64().unwrap();
    assert!(number("champion_mean_in_model") > number("periodic_mean_in_model"));
    assert!(number("champion_mean_in_model") >= number("random_mean_in_model"));
    let mean = |name: &str| numbers[name]["mean"].as_f64().unwrap();
    assert!(mean("many_champion") > mean("many_periodic"));

    // The report can be made again from the folder, with the figures as files.
    let again = Command::new(env!("CARGO_BIN_EXE_tropism"))
        .arg("report")
        .arg(folder.join("study"))
        .arg("--out")
        .arg(folder.join("again.html"))
        .arg("--figures")
        .arg(folder.join("figures"))
        .output()
        .unwrap();
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    assert!(fs::read_to_string(folder.join("figures/figure-4a.svg")).unwrap().starts_with("<svg"));
}

#[test]
fn a_study_without_methods_judges_the_rules_by_hand() {
    let folder = tempfile::tempdir().unwrap();
    let study = r#"
test_plants = 2
methods = []

[task]
kind = "spiral"
max_steps = 30

[[scenarios]]
name = "round"
"#;
    fs::write(folder.path().join("spiral.toml"), study).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command.current_dir(&folder).args(["study", "spiral.toml", "--out", "spiral"]);
    let output = command.output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{output:?}");
    assert!(
        printed.contains("rules by hand alone, without open-loop experiments, models or search"),
        "{printed}"
    );
    assert!(
        printed.contains("round: winding round a pole of 2 cm") && printed.contains("2 unseen plants"),
        "{printed}"
    );
    assert!(!folder.path().join("spiral/round/replicate-1").exists(), "a replicate was at work");
}
