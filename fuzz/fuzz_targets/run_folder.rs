//! The journal of a run folder, or where the bytes are no database the copy from which it is made again: an error, or a
//! run that can be read and written, and is the same when it is made again from its copy.
#![no_main]

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tropism::rig::Durability;
use tropism_lab::{Gap, Journal};
use tropism::lamps::Light;

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
        let _ = (journal.rows(), journal.events());
    }
    let Ok(journal) = Journal::open(&path, Durability::Fast) else { return };
    let (Ok(rows), Ok(_)) = (journal.rows(), journal.state()) else { return };
    let _ = Gap::of(&journal, "boot", 1.0, 1e9, true);
    let step = rows.last().map_or(0, |row| row.step);
    if journal.decided(step, Light::LEFT).is_err() || journal.done(step).is_err() {
        return;
    }
    let (Ok(rows), Ok(events)) = (journal.rows(), journal.events()) else { return };
    drop(journal);
    // What was a table of its own making may bite; what this version made must come again.
    fs::remove_file(&path).unwrap();
    if let Ok(again) = Journal::open(&path, Durability::Fast) {
        if !is_database {
            assert_eq!((again.rows().unwrap(), again.events().unwrap()), (rows, events));
        }
    }
});
