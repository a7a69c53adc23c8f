//! The mirror of a journal: a text file with a copy of each entry, from which a damaged journal is restored.
//!
//! Each line is a JSON list: the name of the entry, then its values. The mirror is written without waiting for the disk: it
//! is a second line of defence against a disk that damages the journal itself.

use std::cell::RefCell;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use rusqlite::types::Value;
use serde_json::Value as Json;
use tropism::rig::Durability;

use super::{Journal, JournalError};

/// An entry of a journal: its name, and its values in the order of the statement that writes it.
pub(super) type Entry = (String, Vec<Value>);

/// An open mirror; closed after the first write that fails, as nothing may follow a line that is cut short.
#[derive(Debug, Default)]
pub(super) struct Mirror(RefCell<Option<File>>);

/// Path of the mirror of the journal at `journal`.
fn path_of(journal: &Path) -> PathBuf {
    journal.with_extension("jsonl")
}

pub(super) fn to_line(name: &str, values: &[Value]) -> String {
    let json = |value: &Value| match value {
        Value::Integer(whole) => Json::from(*whole),
        Value::Real(number) => Json::from(*number),
        Value::Text(text) => Json::from(text.as_str()),
        Value::Null | Value::Blob(_) => Json::Null,
    };
    let words: Vec<Json> = std::iter::once(Json::from(name)).chain(values.iter().map(json)).collect();
    format!("{}\n", Json::from(words))
}

/// The entry of a line; `None` if the line is cut short.
fn from_line(line: &str) -> Option<Entry> {
    let words: Vec<Json> = serde_json::from_str(line).ok()?;
    let (Json::String(name), values) = words.split_first()? else { return None };
    let value = |json: &Json| {
        Some(match json {
            Json::Null => Value::Null,
            Json::String(text) => Value::Text(text.clone()),
            Json::Number(number) => match number.as_i64() {
                Some(whole) => Value::Integer(whole),
                None => Value::Real(number.as_f64()?),
            },
            _ => return None,
        })
    };
    Some((name.clone(), values.iter().map(value).collect::<Option<_>>()?))
}

impl Mirror {
    /// Writes the mirror of the journal at `journal` anew from its `entries` and keeps it open. If the disk refuses, the
    /// journal goes on without a mirror.
    pub(super) fn create(journal: &Path, entries: &[(&'static str, Vec<Value>)]) -> Self {
        let (part, mirror) = (journal.with_extension("jsonl.part"), path_of(journal));
        let write = || {
            let mut file = File::create(&part)?;
            let text: String = entries.iter().map(|(name, values)| to_line(name, values)).collect();
            file.write_all(text.as_bytes())?;
            fs::rename(&part, &mirror)?;
            Ok::<_, std::io::Error>(file)
        };
        Self(RefCell::new(write().ok()))
    }

    /// Adds an entry.
    pub(super) fn add(&self, name: &str, values: &[Value]) {
        let mut file = self.0.borrow_mut();
        if file.as_mut().is_some_and(|file| file.write_all(to_line(name, values).as_bytes()).is_err()) {
            *file = None;
        }
    }
}

/// Whether the journal at `journal` is missing although its mirror is there.
pub(super) fn is_orphaned(journal: &Path) -> bool {
    !journal.exists() && path_of(journal).exists()
}

/// What a mirror holds.
pub(super) struct Contents {
    /// Its entries in the order in which they were written.
    pub(super) entries: Vec<Entry>,
    /// The first line that is no entry although further ones follow, from 1: the disk has damaged it.
    pub(super) damaged_line: Option<usize>,
}

/// Reads the mirror of the journal at `journal`; `None` if there is none, or nothing in it.
pub(super) fn read(journal: &Path) -> Option<Contents> {
    let bytes = fs::read(path_of(journal)).ok()?;
    // What is no UTF-8 is no entry either.
    let text = String::from_utf8_lossy(&bytes);
    let (mut entries, mut damaged_line, mut bad) = (Vec::new(), None, None);
    for (number, line) in text.lines().enumerate() {
        match from_line(line) {
            Some(entry) => {
                damaged_line = damaged_line.or(bad);
                entries.push(entry);
            }
            None => bad = bad.or(Some(number + 1)),
        }
    }
    (!entries.is_empty()).then_some(Contents { entries, damaged_line })
}

/// Restores the journal at `journal` from `copy`, after the files that are there were moved aside.
pub(super) fn restore(journal: &Path, durability: Durability, copy: &Contents) -> Result<(), JournalError> {
    if let Some(line) = copy.damaged_line {
        let path = path_of(journal);
        return Err(JournalError::Copy { path, line });
    }
    let restored = journal.with_extension("restored.sqlite");
    let sibling = |path: &Path, ending: &str| PathBuf::from(format!("{}{ending}", path.display()));
    // SQLite's own files: the database, its log and the index of the log.
    let endings = ["", "-wal", "-shm"];
    for ending in endings {
        let _ = fs::remove_file(sibling(&restored, ending));
    }
    Journal::create(&restored, durability, &copy.entries)?;
    let broken = free_name(journal, "broken.sqlite");
    for ending in endings {
        let _ = fs::rename(sibling(journal, ending), sibling(&broken, ending));
    }
    fs::rename(&restored, journal).map_err(|source| JournalError::Restore { path: restored, source })
}

/// Keeps a damaged mirror beside the one that will take its place.
pub(super) fn set_aside(journal: &Path) {
    let _ = fs::rename(path_of(journal), free_name(journal, "broken.jsonl"));
}

/// `journal.ENDING`, or `journal.2.ENDING` and so on: nothing that was kept before is overwritten.
fn free_name(journal: &Path, ending: &str) -> PathBuf {
    let name = |number: u32| match number {
        1 => journal.with_extension(ending),
        _ => journal.with_extension(format!("{number}.{ending}")),
    };
    (1..).map(name).find(|path| !path.exists()).expect("a free name")
}
