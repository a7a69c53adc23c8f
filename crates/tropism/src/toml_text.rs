//! TOML in unit tests, read and written through a tree of JSON, which knows no infinity.
//!
//! Each type then is read by code that the library has anyway. TOML's own code for the settings of a bean, a tent and an
//! obstacle was a tenth of all that is compiled for the unit tests.

use serde::Serialize;
use serde::de::{DeserializeOwned, Error};

/// Reads a TOML document.
pub(crate) fn read<T: DeserializeOwned>(text: &str) -> serde_json::Result<T> {
    serde_json::from_value(toml::from_str(text).map_err(serde_json::Error::custom)?)
}

/// Writes a TOML document. Keys stand in the order of the alphabet.
pub(crate) fn write<T: Serialize>(value: &T) -> String {
    toml::to_string(&serde_json::to_value(value).unwrap()).unwrap()
}
