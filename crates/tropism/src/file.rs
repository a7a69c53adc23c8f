//! What the JSON files of several modules share: they name their schema, and are known by their digest.

use core::fmt;
use core::marker::PhantomData;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Deserializer as _, IgnoredAny, IntoDeserializer, MapAccess, Visitor};
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

/// Reads a `T`, which has no key for it, from a file that names its schema. The types within are read as those of all other files,
/// so that an error has its line, and the module in a browser has one reader of each.
///
/// # Errors
/// If `text` is no `T`.
pub(crate) fn without_schema<'t, T: Deserialize<'t>>(text: &'t str) -> Result<T, serde_json::Error> {
    let mut file = serde_json::Deserializer::from_str(text);
    let read = file.deserialize_map(WithoutSchema(PhantomData))?;
    file.end().map(|()| read)
}

struct WithoutSchema<T>(PhantomData<T>);

impl<'t, T: Deserialize<'t>> Visitor<'t> for WithoutSchema<T> {
    type Value = T;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str("a table")
    }

    fn visit_map<A: MapAccess<'t>>(self, keys: A) -> Result<T, A::Error> {
        T::deserialize(MapAccessDeserializer::new(Keys(keys)))
    }
}

/// Keys without that of the schema.
struct Keys<A>(A);

impl<'t, A: MapAccess<'t>> MapAccess<'t> for Keys<A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'t>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        while let Some(key) = self.0.next_key::<String>()? {
            if key != "schema" {
                return seed.deserialize(key.into_deserializer()).map(Some);
            }
            self.0.next_value::<IgnoredAny>()?;
        }
        Ok(None)
    }

    fn next_value_seed<V: DeserializeSeed<'t>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.0.next_value_seed(seed)
    }
}

/// The SHA-256 of a text, in hexadecimal.
pub(crate) fn sha256(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}
