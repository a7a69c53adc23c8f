//! Exports of run folders that were tampered with, and of runs with secrets.

#[path = "common/tent.rs"]
mod small_tent;

use std::fs;
use std::path::Path;

use small_tent::small_tent;
use tempfile::TempDir;
use tropism::task::Task;
use tropism::vision::VisionConfig;
use tropism_lab::export::ExportPlan;
use tropism_lab::timelapse::TimelapsePlan;
use tropism_lab::{ControllerSpec, RunConfig, RunPlan, Silent, Workflow};
use tropism_rig::file::RigFile;

/// A folder with a virtual run of three steps in `run`.
fn run() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let controller = ControllerSpec::default();
    let task = Task { max_steps: 3, ..controller.default_task() };
    let config =
        RunConfig::new(RigFile::greenhouse(small_tent(), VisionConfig::default()), controller, task, 1);
    let plan = RunPlan { out: folder.path().join("run"), config, ..RunPlan::default() };
    plan.execute(&Silent).unwrap();
    folder
}

/// Changes the entries of the journal, each a JSON list, as somebody could who knows how they are chained.
fn change(folder: &Path, change: impl Fn(&mut Vec<String>)) {
    let _ = fs::remove_file(folder.join("run/journal.jsonl"));
    let db = rusqlite::Connection::open(folder.join("run/journal.sqlite")).unwrap();
    let mut read = db.prepare("SELECT text FROM entry ORDER BY id").unwrap();
    let mut texts: Vec<String> = read.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect();
    change(&mut texts);
    db.execute("DELETE FROM entry", []).unwrap();
    let mut digest = String::new();
    for text in texts {
        digest = tropism_lab::files::sha256(format!("{digest}{text}").as_bytes());
        digest.truncate(16);
        db.execute("INSERT INTO entry (text, digest) VALUES (?, ?)", [&text, &digest]).unwrap();
    }
}

/// Exports to a folder and to an archive: both are refused, by an error that holds `wanted`, and nothing is left.
#[track_caller]
fn is_refused(folder: &Path, wanted: &str) {
    for out in ["copy", "copy.tar"] {
        for keep_going in [false, true] {
            let plan = ExportPlan { folder: folder.join("run"), out: folder.join(out), keep_going };
            let error = plan.execute(&Silent).unwrap_err().with_causes();
            assert!(error.contains(wanted), "{error}");
            let left = ["copy", "copy.part", "copy.tar", "copy.tar.part", "stolen.jpg"];
            assert!(left.iter().all(|name| !folder.join(name).exists()), "{out}");
        }
    }
}

#[test]
fn names_of_photographs_that_lead_elsewhere_are_refused() {
    let folder = run();
    let folder = folder.path();
    fs::copy(folder.join("run/photographs/000001.jpg"), folder.join("run/stolen.jpg")).unwrap();
    let mut known = "000001.jpg";
    for name in ["../stolen.jpg", "/etc/passwd", "..", "a/b.jpg", "a\\b.jpg", ""] {
        let [from, to] = [known, name].map(|name| format!("{},", serde_json::to_string(name).unwrap()));
        change(folder, |texts| {
            let saw = texts.iter_mut().find(|text| text.starts_with("[\"saw\",1,")).unwrap();
            *saw = saw.replacen(&from, &to, 1);
        });
        is_refused(folder, &format!("found photo {name:?}"));
        known = name;
    }
    let film = TimelapsePlan {
        folder: folder.join("run"),
        out: folder.join("a.gif"),
        width: 64,
        fps: 20,
        every: None,
        crop: None,
        plain: false,
        replace: false,
    };
    assert!(film.execute(&Silent).unwrap_err().to_string().contains("wanted the plain name of a file"));
}

#[cfg(unix)]
#[test]
fn links_to_foreign_files_are_refused() {
    use std::os::unix::fs::symlink;
    let foreign = tempfile::tempdir().unwrap();
    for name in [
        "photographs/000001.jpg",
        "run.toml",
        "calibration.toml",
        "truth.csv",
        "journal.sqlite",
        "photographs",
    ] {
        let folder = run();
        let (path, moved) =
            (folder.path().join("run").join(name), foreign.path().join(name.replace('/', "-")));
        // A link to the same bytes: their sums do not tell.
        if path.is_dir() {
            fs::rename(&path, &moved).unwrap();
        } else if path.exists() {
            fs::copy(&path, &moved).unwrap();
            fs::remove_file(&path).unwrap();
        } else {
            fs::write(&moved, "root:*:1:").unwrap();
        }
        symlink(&moved, &path).unwrap();
        is_refused(folder.path(), &format!("run/{name}: this is a symbolic link"));
    }
    let folder = run();
    fs::create_dir(folder.path().join("run/side")).unwrap();
    fs::write(foreign.path().join("shadow"), "root:*:1:").unwrap();
    symlink(foreign.path().join("shadow"), folder.path().join("run/side/000001.jpg")).unwrap();
    is_refused(folder.path(), "side/000001.jpg: this is a symbolic link");
}

#[test]
fn secrets_and_controls_stay_at_home() {
    let folder = run();
    let folder = folder.path();
    let text = fs::read_to_string(folder.join("run/run.toml")).unwrap();
    let plan =
        |out: &str| ExportPlan { folder: folder.join("run"), out: folder.join(out), keep_going: false };
    plan("before").execute(&Silent).unwrap();
    assert_eq!(fs::read_to_string(folder.join("before/run.toml")).unwrap(), text);

    let camera =
        "\n[rig.camera]\ndriver = \"http\"\nurl = \"http://admin:s3c\\\"ret@camera/shot?token=abc123\"\n";
    fs::write(folder.join("run/run.toml"), text + camera).unwrap();
    change(folder, |texts| {
        for text in ["\u{1b}[2J http://u:s3cret@c/?t=abc123", "=HYPERLINK(\"http://x\")"] {
            texts.push(serde_json::json!(["event", 3, "camera", text, null, null]).to_string());
        }
    });
    plan("copy").execute(&Silent).unwrap();
    let run_file = fs::read_to_string(folder.join("copy/run.toml")).unwrap();
    assert!(run_file.contains("http://***@camera/shot?token=***"), "{run_file}");
    let events = fs::read_to_string(folder.join("copy/events.csv")).unwrap();
    assert!(events.contains(",\\u{1b}[2J http://***@c/?t=***,"), "{events}");
    assert!(events.contains(",\"'=HYPERLINK("), "{events}");
    for text in [run_file, events] {
        assert!(!text.contains("ret@") && !text.contains("abc123") && !text.contains('\x1b'), "{text}");
    }
}

#[test]
fn what_a_killed_export_left_is_made_anew_and_nothing_else_is_removed() {
    let folder = run();
    let folder = folder.path();
    fs::create_dir_all(folder.join("copy.part/photographs")).unwrap();
    fs::write(folder.join("copy.part/photographs/000000.jpg"), "half").unwrap();
    fs::write(folder.join("copy.tar.part"), "half").unwrap();
    let plan =
        |out: &str| ExportPlan { folder: folder.join("run"), out: folder.join(out), keep_going: false };
    for out in ["copy", "copy.tar"] {
        plan(out).execute(&Silent).unwrap();
        assert!(!folder.join(format!("{out}.part")).exists());
    }
    fs::create_dir(folder.join("mine.part")).unwrap();
    fs::write(folder.join("mine.part/thesis.tex"), "words").unwrap();
    let error = plan("mine").execute(&Silent).unwrap_err().with_causes();
    assert!(error.contains("that no export left"), "{error}");
    assert_eq!(fs::read_to_string(folder.join("mine.part/thesis.tex")).unwrap(), "words");
    // Another export at work.
    let part = fs::File::create(folder.join("other.tar.part")).unwrap();
    part.lock().unwrap();
    let error = plan("other.tar").execute(&Silent).unwrap_err().with_causes();
    assert!(error.contains("another program is exporting to it"), "{error}");
}
