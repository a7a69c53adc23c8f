//! The journal of a run folder, or its mirror if the bytes are no database: an error, or a journal that can be read and
//! written, and is the same after it was restored from its mirror.
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tropism::lamps::Light;
use tropism::rig::Durability;
use tropism_lab::{Downtime, Journal};

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let shared = PathBuf::from("/dev/shm");
    let root = if shared.is_dir() { shared } else { std::env::temp_dir() };
    let folder = root.join(format!("tropism-fuzz-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    folder
});

fuzz_target!(|data: &[u8]| {
    for entry in fs::read_dir(&*FOLDER).unwrap() {
        fs::remove_file(entry.unwrap().path()).unwrap();
    }
    let path = FOLDER.join("journal.sqlite");
    let is_database = data.starts_with(b"SQLite format 3");
    fs::write(if is_database { path.clone() } else { FOLDER.join("journal.jsonl") }, data).unwrap();
    if let Ok(journal) = Journal::open_to_read(&path) {
        let _ = (journal.steps(), journal.events());
    }
    let Ok(journal) = Journal::open(&path, Durability::Fast) else { return };
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
    if let Ok(again) = Journal::open(&path, Durability::Fast) {
        if !is_database {
            assert_eq!((again.steps().unwrap(), again.events().unwrap()), (steps, events));
        }
    }
});
