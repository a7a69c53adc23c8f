//! The journal of a run folder, or the entries of its mirror if the bytes are no database: an error, or a journal that can be
//! read and written, and is the same after it was restored from its mirror.
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tropism::lamps::Light;
use tropism::rig::Durability;
use tropism_fuzz::scratch;
use tropism_lab::{Downtime, Journal, files};

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| scratch("run_folder"));

/// Each line with the digest that it would have in a mirror: else none but the seeds would be read at all.
fn chained(data: &[u8]) -> Vec<u8> {
    let (mut digest, mut lines) = (String::new(), Vec::new());
    for line in data.split_inclusive(|&byte| byte == b'\n') {
        let text = line.strip_suffix(b"\n").unwrap_or(line);
        if let Some(rest) = text.strip_prefix(b"[") {
            digest = files::sha256(&[digest.as_bytes(), text].concat());
            digest.truncate(16);
            lines.extend_from_slice(format!("[\"{digest}\",").as_bytes());
            lines.extend_from_slice(rest);
        } else {
            lines.extend_from_slice(text);
        }
        lines.extend_from_slice(&line[text.len()..]);
    }
    lines
}

fuzz_target!(|data: &[u8]| {
    for entry in fs::read_dir(&*FOLDER).unwrap() {
        fs::remove_file(entry.unwrap().path()).unwrap();
    }
    let path = FOLDER.join("journal.sqlite");
    let is_database = data.starts_with(b"SQLite format 3");
    match is_database {
        true => fs::write(&path, data).unwrap(),
        false => fs::write(FOLDER.join("journal.jsonl"), chained(data)).unwrap(),
    }
    if let Ok(journal) = Journal::open_to_read(&path) {
        let _ = (journal.steps(), journal.events());
    }
    let Ok(journal) = Journal::open(&path, Durability::Fast, "seed = 1\n") else { return };
    let (Ok(steps), Ok(_)) = (journal.steps(), journal.state()) else { return };
    let _ = Downtime::of(&journal, "boot", 1.0, 1e9, true);
    let step = steps.last().map_or(0, |step| step.step);
    if journal.record_decision(step, Light::LEFT).is_err() || journal.record_confirmation(step).is_err() {
        return;
    }
    let (Ok(steps), Ok(events)) = (journal.steps(), journal.events()) else { return };
    drop(journal);
    // A database of the fuzzer may hold any table; one that was restored from a mirror must come back the same.
    fs::remove_file(&path).unwrap();
    if let Ok(again) = Journal::open(&path, Durability::Fast, "seed = 1\n") {
        if !is_database {
            assert_eq!((again.steps().unwrap(), again.events().unwrap()), (steps, events));
        }
    }
});
