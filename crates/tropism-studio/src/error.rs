//! What can go wrong, to the program and to what a page asked for.

use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};

/// Why the studio cannot be started.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudioError {
    /// The address cannot be listened on.
    #[error("{address}: {source}")]
    Address {
        /// The address.
        address: String,
        /// The cause.
        source: std::io::Error,
    },
    /// A file or folder of the studio.
    #[error(transparent)]
    File(#[from] tropism_lab::files::FileError),
    /// A workflow that prepares the demonstration.
    #[error(transparent)]
    Lab(#[from] tropism_lab::Error),
    /// The file of the hashed tokens.
    #[error("{path}: {problem}")]
    Access {
        /// The file.
        path: std::path::PathBuf,
        /// What was found and what was wanted.
        problem: String,
    },
    /// The file of a certificate or of its key.
    #[error("{path}: {problem}")]
    Tls {
        /// The file.
        path: std::path::PathBuf,
        /// What was found and what was wanted.
        problem: String,
    },
    /// The system.
    #[error("{0}")]
    System(String),
}

/// An answer to a page that something cannot be done: a status and a sentence for people.
#[derive(Debug)]
pub(crate) struct Refusal(pub(crate) StatusCode, pub(crate) String);

impl Refusal {
    pub(crate) fn bad(text: impl Into<String>) -> Self {
        Self(StatusCode::BAD_REQUEST, text.into())
    }

    pub(crate) fn forbidden(text: impl Into<String>) -> Self {
        Self(StatusCode::FORBIDDEN, text.into())
    }

    pub(crate) fn missing(text: impl Into<String>) -> Self {
        Self(StatusCode::NOT_FOUND, text.into())
    }
}

impl From<tropism_lab::Error> for Refusal {
    fn from(error: tropism_lab::Error) -> Self {
        Self(StatusCode::UNPROCESSABLE_ENTITY, error.with_causes())
    }
}

impl From<tropism_page::PageError> for Refusal {
    fn from(error: tropism_page::PageError) -> Self {
        Self::bad(error.to_string())
    }
}

impl From<tropism_lab::files::FileError> for Refusal {
    fn from(error: tropism_lab::files::FileError) -> Self {
        Self(StatusCode::UNPROCESSABLE_ENTITY, error.to_string())
    }
}

/// What a page is sent in place of an answer.
#[derive(serde::Serialize)]
struct Problem {
    /// A sentence for people.
    error: String,
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.0, axum::Json(Problem { error: self.1 })).into_response()
    }
}
