//! What a run reports to people and systemd.
#![cfg(unix)]

use std::fs;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

fn run(folder: &Path, controller: &str) -> Output {
    let alert =
        "[[alert]]\ndriver = \"command\"\ncommand = [\"sh\", \"-c\", \"echo \\\"$2\\\" >> told\", \"sh\"]\n";
    fs::write(folder.join("rig.toml"), format!("{alert}[greenhouse.scene]\nwidth = 324\nheight = 243\n"))
        .unwrap();
    let _ = fs::remove_file(folder.join("socket"));
    let socket = UnixDatagram::bind(folder.join("socket")).unwrap();
    socket.set_read_timeout(Some(std::time::Duration::from_millis(200))).unwrap();
    let is_over = Arc::new(AtomicBool::new(false));
    let ended = Arc::clone(&is_over);
    // While it runs, as systemd does: a socket holds ten unread messages, and then the writer waits.
    let listener = std::thread::spawn(move || {
        let (mut said, mut bytes) = (String::new(), [0; 4096]);
        loop {
            match socket.recv(&mut bytes) {
                Ok(count) => said += std::str::from_utf8(&bytes[..count]).unwrap(),
                Err(_) if ended.load(Ordering::SeqCst) => return said,
                Err(_) => {}
            }
        }
    });
    let output = Command::new(env!("CARGO_BIN_EXE_tropism"))
        .current_dir(folder)
        .env("NOTIFY_SOCKET", folder.join("socket"))
        .args(["run", "--rig", "rig.toml", "--controller", controller, "--out", "bean", "--steps", "5"])
        .output()
        .unwrap();
    is_over.store(true, Ordering::SeqCst);
    let said = listener.join().unwrap();
    fs::write(folder.join("said"), said).unwrap();
    output
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_default()
}

#[test]
fn people_hear_how_a_run_begins_and_ends_and_systemd_that_it_lives() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), "periodic:10m");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = read(folder.path(), "told");
    let lines: Vec<&str> = printed.lines().collect();
    assert!(lines[0].starts_with("started, step 0: "), "{printed}");
    assert!(lines[lines.len() - 1].contains(": 5 steps"), "{printed}");
    let said = read(folder.path(), "said");
    for word in ["READY=1", "WATCHDOG=1", "STATUS=step 5: tip at ", "STOPPING=1"] {
        assert!(said.lines().any(|line| line.starts_with(word)), "{word} is not in {said}");
    }
    assert_eq!(said.matches("READY=1").count(), 1);
    assert!(!read(folder.path(), "bean/run.toml").contains("alert"), "channels stay out of run folders");
}

#[test]
fn a_run_that_goes_on_from_its_folder_has_the_alerts_of_its_rig_file() {
    for is_moved in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let blocked = folder.path().join("bean/photographs/000002.jpg");
        fs::create_dir_all(&blocked).unwrap();
        assert!(!run(folder.path(), "periodic:10m").status.success());
        fs::remove_dir(&blocked).unwrap();
        if is_moved {
            fs::rename(folder.path().join("rig.toml"), folder.path().join("moved.toml")).unwrap();
        }
        let mut goes_on = Command::new(env!("CARGO_BIN_EXE_tropism"));
        let output =
            goes_on.current_dir(&folder).args(["run", "--out", "bean", "--resume"]).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        assert_eq!(said.contains("WITHOUT ALERTS: "), is_moved, "{said}");
        assert_eq!(read(folder.path(), "told").contains(": 5 steps"), !is_moved);
    }
}

#[test]
fn a_run_of_another_program_is_not_announced() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("bean")).unwrap();
    let held = tropism_lab::lock(&folder.path().join("bean")).unwrap();
    let output = run(folder.path(), "periodic:10m");
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(error.contains("another program (process "), "{error}");
    assert_eq!((read(folder.path(), "told"), read(folder.path(), "said")), (String::new(), String::new()));
    drop(held);
    assert!(run(folder.path(), "periodic:10m").status.success());
    assert!(read(folder.path(), "told").starts_with("started"));
}

#[test]
fn people_hear_of_an_error_that_ends_a_run() {
    let folder = tempfile::tempdir().unwrap();
    // A photograph that cannot be kept.
    fs::create_dir_all(folder.path().join("bean/photographs/000002.jpg")).unwrap();
    let output = run(folder.path(), "periodic:10m");
    assert_eq!(output.status.code(), Some(1));
    let printed = read(folder.path(), "told");
    assert_eq!(printed.matches("fault: ").count(), 1, "{printed}");
    assert!(printed.contains("000002.jpg") && !printed.contains("finished"), "{printed}");
    // Who comes later finds it in the journal.
    let mut status = Command::new(env!("CARGO_BIN_EXE_tropism"));
    let output = status.current_dir(&folder).args(["status", "bean"]).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let first = said.lines().next().unwrap();
    assert!(first.starts_with("bean: an error ended it, ") && first.contains("000002.jpg"), "{said}");
}
