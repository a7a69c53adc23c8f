//! What the JSON files of several modules share: they name their schema, and are known by their digest.

use serde::Deserialize;
use sha2::{Digest, Sha256};

/// The schema that a JSON file names. It is read first: a file of another one should be called that, not full of unknown
/// fields.
///
/// # Errors
/// If `text` is no JSON, or names no schema.
pub(crate) fn schema_of(text: &str) -> Result<String, serde_json::Error> {
    #[derive(Deserialize)]
    struct Head {
        schema: String,
    }
    serde_json::from_str(text).map(|Head { schema }| schema)
}

/// The SHA-256 of a text, in hexadecimal.
pub(crate) fn sha256(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}
