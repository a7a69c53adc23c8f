//! The journal's second copy: all that is written into it, one line a time, from which it can be made again.
//!
//! Lines are JSON lists: the name of what is written, then its values. The copy is not waited for: it is a second line of
//! defence, against a disk that damages the journal itself.

use std::cell::RefCell;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use rusqlite::types::Value;
use serde_json::Value as Json;

use super::{Journal, JournalError};
use tropism::rig::Durability;

/// Where entries are written, until that fails once: a line that is cut short must not be followed by another.
#[derive(Debug, Default)]
pub(super) struct Mirror(RefCell<Option<File>>);

/// The copy of the journal at `path`.
fn beside(path: &Path) -> PathBuf {
    path.with_extension("jsonl")
}

fn line(name: &str, values: &[Value]) -> String {
    let json = |value: &Value| match value {
        Value::Integer(whole) => Json::from(*whole),
        Value::Real(number) => Json::from(*number),
        Value::Text(text) => Json::from(text.as_str()),
        Value::Null | Value::Blob(_) => Json::Null,
    };
    let words: Vec<Json> = std::iter::once(Json::from(name)).chain(values.iter().map(json)).collect();
    format!("{}\n", Json::from(words))
}

/// What [`line`] was made of; `None` for a line that is cut short.
fn parse(line: &str) -> Option<(String, Vec<Value>)> {
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
    /// Writes the copy of the journal at `path` anew from its `entries`, to be gone on with. Where it cannot be written
    /// there is none: the journal does not depend on it.
    pub(super) fn of(path: &Path, entries: &[(&'static str, Vec<Value>)]) -> Self {
        let (part, copy) = (path.with_extension("jsonl.part"), beside(path));
        let write = || {
            let mut file = File::create(&part)?;
            let text: String = entries.iter().map(|(name, values)| line(name, values)).collect();
            file.write_all(text.as_bytes())?;
            fs::rename(&part, &copy)?;
            Ok::<_, std::io::Error>(file)
        };
        Self(RefCell::new(write().ok()))
    }

    /// Adds an entry.
    pub(super) fn add(&self, name: &str, values: &[Value]) {
        let mut file = self.0.borrow_mut();
        if file.as_mut().is_some_and(|file| file.write_all(line(name, values).as_bytes()).is_err()) {
            *file = None;
        }
    }
}

/// Whether the journal at `path` is gone although there is a copy of it.
pub(super) fn is_left(path: &Path) -> bool {
    !path.exists() && beside(path).exists()
}

/// Makes the journal at `path` again from its copy, after moving what is there aside; how many entries it has, or `None`
/// if there is no copy to make it from.
pub(super) fn restore(path: &Path, durability: Durability) -> Result<Option<usize>, JournalError> {
    let Ok(text) = fs::read_to_string(beside(path)) else { return Ok(None) };
    // A line that is cut short is the last one.
    let entries: Vec<_> = text.lines().map_while(parse).collect();
    if entries.is_empty() {
        return Ok(None);
    }
    let made = path.with_extension("restored.sqlite");
    let aside = |from: &Path, ending: &str| {
        let named = |path: &Path| PathBuf::from(format!("{}{ending}", path.display()));
        let _ = fs::rename(named(from), named(&path.with_extension("broken.sqlite")));
    };
    for ending in ["", "-wal", "-shm"] {
        let _ = fs::remove_file(format!("{}{ending}", made.display()));
    }
    Journal::make(&made, durability, &entries)?;
    for ending in ["", "-wal", "-shm"] {
        aside(path, ending);
    }
    let moved = fs::rename(&made, path);
    moved.map_err(|error| JournalError::Damaged(format!("{}: {error}", made.display())))?;
    Ok(Some(entries.len()))
}
