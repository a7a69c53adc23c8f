//! Errors of tropism as Python exceptions, whose classes are those of `tropism.errors`.

use std::error::Error;
use std::io::ErrorKind;

use pyo3::prelude::*;
use pyo3::{PyErr, import_exception};

import_exception!(tropism.errors, TropismError);
import_exception!(tropism.errors, PlanError);
import_exception!(tropism.errors, WrongTypeError);
import_exception!(tropism.errors, MissingFileError);
import_exception!(tropism.errors, Paused);
import_exception!(tropism.errors, Interrupted);

/// Anything that a setting, a file or a value has wrong.
pub(crate) fn refused(error: impl std::fmt::Display) -> PyErr {
    PlanError::new_err(error.to_string())
}

/// An error with those that caused it, each once.
pub(crate) fn with_causes(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let next = error.to_string();
        if !text.contains(&next) {
            text = format!("{text}: {next}");
        }
        cause = error.source();
    }
    text
}

/// An error of a file: of one that is missing the class says so, too.
pub(crate) fn of_file(error: &(dyn Error + 'static)) -> PyErr {
    let text = with_causes(error);
    if is_missing_file(error) { MissingFileError::new_err(text) } else { PlanError::new_err(text) }
}

/// Whether a file that does not exist is the cause of an error.
pub(crate) fn is_missing_file(error: &(dyn Error + 'static)) -> bool {
    let mut cause = Some(error);
    while let Some(error) = cause {
        let disk = error.downcast_ref::<std::io::Error>();
        if disk.is_some_and(|error| error.kind() == ErrorKind::NotFound) {
            return true;
        }
        cause = error.source();
    }
    false
}

/// Words of serde and of Rust in the messages of a reader of JSON, and Python's for them.
const WORDS: [(&str, &str); 24] = [
    ("floating point", "float"),
    ("integer", "int"),
    ("boolean", "bool"),
    ("string", "str"),
    ("sequence", "list"),
    ("map", "dict"),
    ("null", "None"),
    ("unit value", "None"),
    ("unit variant", "str"),
    ("newtype variant", "dict"),
    ("struct variant", "dict"),
    ("variant identifier", "str"),
    ("field identifier", "key"),
    ("path str", "path"),
    ("variant", "value"),
    ("field", "key"),
    ("u8", "a whole number from 0 to 255"),
    ("u16", "a whole number from 0 to 65535"),
    ("u32", "a whole number from 0"),
    ("u64", "a whole number from 0"),
    ("usize", "a whole number from 0"),
    ("i64", "a whole number"),
    ("f64", "a number"),
    ("f32", "a number"),
];

/// A message of serde in Python's words; others are ours already.
fn in_python_words(text: &str) -> String {
    const OF_SERDE: [&str; 6] = [
        "invalid type",
        "invalid value",
        "invalid length",
        "unknown field",
        "unknown variant",
        "missing field",
    ];
    if !OF_SERDE.iter().any(|start| text.starts_with(start)) {
        return text.to_owned();
    }
    // Names and values stand in quotes: they stay as they are.
    let mut is_quoted = false;
    let mut mended = String::new();
    for (place, part) in text.split_inclusive(['`', '"']).enumerate() {
        let words = if is_quoted { part.to_owned() } else { WORDS.iter().fold(part.to_owned(), with_word) };
        mended.push_str(&words);
        is_quoted = place % 2 == 0;
    }
    // `struct GrowPlan` and `enum Time` are names of ours for what a dict says.
    for kind in ["struct ", "enum "] {
        if let Some((before, name)) = mended.rsplit_once(kind)
            && name.chars().all(|letter| letter.is_alphanumeric() || letter == '_')
        {
            mended = format!("{before}a dict of settings");
        }
    }
    mended
}

/// `text` with another word in each place where `word` stands alone.
fn with_word(text: String, (word, instead): &(&str, &str)) -> String {
    let mut mended = String::new();
    let mut rest = &text[..];
    while let Some(at) = rest.find(word) {
        let (before, after) = (&rest[..at], &rest[at + word.len()..]);
        let touches =
            |letter: Option<char>| letter.is_some_and(|letter| letter.is_alphanumeric() || letter == '_');
        let is_alone = !touches(before.chars().last()) && !touches(after.chars().next());
        mended.push_str(before);
        mended.push_str(if is_alone { instead } else { word });
        rest = after;
    }
    mended + rest
}

/// Reads `json` as a setting; an error names the key.
pub(crate) fn parsed<T: serde::de::DeserializeOwned>(what: &str, json: &str) -> PyResult<T> {
    let mut reader = serde_json::Deserializer::from_str(json);
    serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let path = error.path().to_string();
        let place = if path == "." { what.to_owned() } else { format!("{what}: {path}") };
        let text = error.into_inner().to_string();
        // The line and column of a text that its user never saw.
        let end = text.rfind(" at line ").unwrap_or(text.len());
        let problem = in_python_words(&text[..end]);
        let message = format!("{place}: {problem}");
        if problem.starts_with("invalid type") { WrongTypeError::new_err(message) } else { refused(message) }
    })
}
