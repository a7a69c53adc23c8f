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

fn to_line(name: &str, values: &[Value]) -> String {
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

/// Restores the journal at `journal` from its mirror, after the damaged file was moved aside. Returns how many entries it
/// has, or `None` if there is no mirror.
pub(super) fn restore(journal: &Path, durability: Durability) -> Result<Option<usize>, JournalError> {
    let Ok(text) = fs::read_to_string(path_of(journal)) else { return Ok(None) };
    // Only the last line can be cut short.
    let entries: Vec<_> = text.lines().map_while(from_line).collect();
    if entries.is_empty() {
        return Ok(None);
    }
    let restored = journal.with_extension("restored.sqlite");
    let broken = journal.with_extension("broken.sqlite");
    let sibling = |path: &Path, ending: &str| PathBuf::from(format!("{}{ending}", path.display()));
    // SQLite's own files: the database, its log and the index of the log.
    let endings = ["", "-wal", "-shm"];
    for ending in endings {
        let _ = fs::remove_file(sibling(&restored, ending));
    }
    Journal::create(&restored, durability, &entries)?;
    for ending in endings {
        let _ = fs::rename(sibling(journal, ending), sibling(&broken, ending));
    }
    fs::rename(&restored, journal).map_err(|source| JournalError::Restore { path: restored, source })?;
    Ok(Some(entries.len()))
}
