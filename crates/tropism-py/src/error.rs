//! Errors of tropism as Python exceptions.

use pyo3::exceptions::{PyException, PyKeyboardInterrupt};
use pyo3::prelude::*;
use pyo3::{PyErr, create_exception};

create_exception!(
    tropism,
    TropismError,
    PyException,
    "What tropism refuses, or could not do: what was found and what was wanted."
);
create_exception!(
    tropism,
    PlanError,
    TropismError,
    "A plan, setting or file that cannot be used; the text names the key or the place."
);
create_exception!(
    tropism,
    Paused,
    TropismError,
    "A run met something that its user must decide; `resume=True` goes on."
);
create_exception!(
    tropism,
    Interrupted,
    PyKeyboardInterrupt,
    "Ctrl-C, or a monitor that asked for an end. What was done is saved; `resume=True` goes on."
);

/// Anything that a setting, a file or a value has wrong.
pub(crate) fn refused(error: impl std::fmt::Display) -> PyErr {
    PlanError::new_err(error.to_string())
}

/// An error with those that caused it, each once.
pub(crate) fn with_causes(error: &dyn std::error::Error) -> String {
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

/// Reads `json` as a setting; an error names the key.
pub(crate) fn parsed<T: serde::de::DeserializeOwned>(what: &str, json: &str) -> PyResult<T> {
    let mut reader = serde_json::Deserializer::from_str(json);
    serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        let path = error.path().to_string();
        let place = if path == "." { what.to_owned() } else { format!("{what}: {path}") };
        let text = error.into_inner().to_string();
        // The line and column of a text that its user never saw.
        let end = text.rfind(" at line ").unwrap_or(text.len());
        refused(format!("{place}: {}", &text[..end]))
    })
}

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("TropismError", py.get_type::<TropismError>())?;
    module.add("PlanError", py.get_type::<PlanError>())?;
    module.add("Paused", py.get_type::<Paused>())?;
    module.add("Interrupted", py.get_type::<Interrupted>())
}
