//! `run.lock` of a folder: a living process, nobody, or an error.
#![no_main]

use std::fs::{self, File};
use std::path::PathBuf;
use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use tropism_fuzz::scratch;
use tropism_lab::{holder, lock};

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| scratch("lock"));

fuzz_target!(|data: &[u8]| {
    let path = FOLDER.join("run.lock");
    fs::write(&path, data).unwrap();
    // What stands in a lock that nobody holds is of nobody.
    assert_eq!(holder(&FOLDER).unwrap(), None);
    if data.first() == Some(&b'!') {
        let held = File::open(&path).unwrap();
        held.lock().unwrap();
        if let Ok(Some(process)) = holder(&FOLDER) {
            assert!(String::from_utf8_lossy(data).contains(&process.to_string()));
        }
    }
    drop(lock(&FOLDER).unwrap());
    assert_eq!(fs::read(&path).unwrap(), b"");
});
