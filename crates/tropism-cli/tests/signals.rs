//! What signals do to a command: a terminal that is closed, `nohup`, and the limit of `ulimit -f`.
#![cfg(unix)]

mod common;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use tropism_lab::Journal;

/// A shell that does `before`, and then becomes the program with `words`.
fn after(folder: &Path, before: &str, words: &str) -> Command {
    let mut shell = common::hearing("sh");
    shell.arg("-c").arg(format!("{before}; exec \"$TROPISM\" {words}")).current_dir(folder);
    shell.env("TROPISM", env!("CARGO_BIN_EXE_tropism")).stdout(Stdio::piped()).stderr(Stdio::piped());
    shell
}

fn steps(folder: &Path) -> usize {
    let journal = Journal::open_to_read(&folder.join("run/journal.sqlite"));
    journal.and_then(|journal| journal.steps()).map_or(0, |steps| steps.len())
}

/// Waits until the run has `wanted` steps.
#[track_caller]
fn until(folder: &Path, child: &mut Child, wanted: usize) {
    let began = Instant::now();
    while steps(folder) < wanted {
        assert!(child.try_wait().unwrap().is_none(), "it ended");
        assert!(began.elapsed().as_secs() < 120, "{} steps", steps(folder));
        sleep(Duration::from_millis(20));
    }
}

fn send(signal: &str, child: &Child) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

/// A run of the virtual tent that does not end by itself soon.
fn long_run(folder: &Path, before: &str) -> Child {
    fs::write(folder.join("tent.toml"), "[greenhouse.scene]\nwidth = 324\nheight = 243\n").unwrap();
    let words = "--quiet run --rig tent.toml --controller greedy --steps 100000 --out run --threads 1";
    after(folder, before, words).spawn().unwrap()
}

#[track_caller]
fn ends_in_order(child: Child) {
    let Output { status, stderr, .. } = child.wait_with_output().unwrap();
    assert_eq!(status.code(), Some(130), "{status}: {}", String::from_utf8_lossy(&stderr));
}

#[test]
fn a_closed_terminal_ends_a_run_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = long_run(folder.path(), "true");
    until(folder.path(), &mut child, 2);
    send("-HUP", &child);
    ends_in_order(child);
}

#[cfg(target_os = "linux")]
#[test]
fn a_run_under_nohup_goes_on_when_its_terminal_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    // As `nohup` does it; and `&` in a script has Ctrl-C ignored.
    let mut child = long_run(folder.path(), "trap '' HUP INT");
    until(folder.path(), &mut child, 2);
    send("-HUP", &child);
    send("-INT", &child);
    sleep(Duration::from_millis(500));
    let then = steps(folder.path());
    until(folder.path(), &mut child, then + 5);
    send("-TERM", &child);
    ends_in_order(child);
}

#[test]
fn a_file_that_would_outgrow_its_limit_is_an_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..200)
        .map(|row| format!("{},{},left\n", 0.01 * f64::from(row), 4.0 + 0.02 * f64::from(row)))
        .collect();
    fs::write(folder.path().join("track.csv"), format!("tip_x_cm,tip_y_cm,light\n{rows}")).unwrap();
    for before in ["true", "ulimit -f 4"] {
        let out = after(folder.path(), before, "report track.csv --out report.html").output().unwrap();
        let error = String::from_utf8_lossy(&out.stderr);
        if before == "true" {
            assert!(out.status.success(), "{error}");
            fs::remove_file(folder.path().join("report.html")).unwrap();
        } else {
            assert_eq!(out.status.code(), Some(1), "{}: {error}", out.status);
            assert!(error.contains("report.html") && error.contains("too large"), "{error}");
        }
    }
    assert!(!folder.path().join("report.html").exists());
}

#[test]
fn a_run_whose_journal_would_outgrow_its_limit_ends_in_order() {
    let folder = tempfile::tempdir().unwrap();
    // Some hundreds of kilobytes: photographs are smaller, the journal gets there.
    let mut child = long_run(folder.path(), "ulimit -f 400");
    let began = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(began.elapsed().as_secs() < 120, "{} steps", steps(folder.path()));
        sleep(Duration::from_millis(50));
    }
    let out = child.wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{}: {error}", out.status);
    assert!(error.contains("journal.sqlite"), "{error}");
}

#[test]
fn a_report_that_takes_long_ends_at_once_when_it_is_asked_to() {
    let folder = tempfile::tempdir().unwrap();
    let row =
        |row: u32| format!("{},{},{}\n", row % 700, row % 300, ["left", "right"][row as usize / 20 % 2]);
    let rows: String = (0..999_000).map(row).collect();
    fs::write(folder.path().join("track.csv"), format!("tip_x_cm,tip_y_cm,light\n{rows}")).unwrap();
    let child = after(folder.path(), "true", "report track.csv --out report.html").spawn().unwrap();
    sleep(Duration::from_millis(500));
    let asked = Instant::now();
    send("-TERM", &child);
    ends_in_order(child);
    assert!(asked.elapsed().as_secs_f64() < 1.0, "{:?}", asked.elapsed());
    assert!(!folder.path().join("report.html").exists());
}
