//! Why a workflow ended without results.

use std::path::{Path, PathBuf};

use tropism::plant::ModelError;

use crate::files::FileError;
use crate::folder::FolderError;
use crate::journal::JournalError;
use crate::lock::LockError;
use crate::recorder::RecordError;

/// Why a workflow ended without results.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A plan that cannot be executed. The text puts the plan's keys in backticks; a shell may show its own name for them,
    /// such as an option.
    #[error("{0}")]
    Plan(String),
    /// The monitor asked for an end. What was done is saved in `folder`, where the same plan resumes.
    #[error("interrupted: {} is saved", folder.display())]
    Interrupted {
        /// The folder that holds what was done.
        folder: PathBuf,
    },
    /// The monitor asked for an end, and there is nothing to resume. The text says what is left.
    #[error("interrupted: {0}")]
    Cancelled(String),
    /// A run met something that its user must decide.
    #[error("paused: {}: {reason}", folder.display())]
    Paused {
        /// The run folder.
        folder: PathBuf,
        /// What was found.
        reason: String,
    },
    /// What was asked for could not be reached. The text says what was found and what was wanted.
    #[error("{0}")]
    Failed(String),
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The lock of a folder.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// A run folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A journal.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A recorded run.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A tip-motion model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Anything else that a part of tropism refused, and where.
    #[error("{place}: {source}")]
    At {
        /// The file, folder or part of the plan.
        place: String,
        /// What it said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl Error {
    /// The error of a part of the work in `folder`: if that was interrupted, the work was, and can be resumed.
    pub(crate) fn of_part(self, folder: &Path) -> Self {
        match self {
            Self::Interrupted { .. } | Self::Cancelled(_) => Self::Interrupted { folder: folder.to_owned() },
            other => other,
        }
    }

    /// Wraps the error of a part of a plan, and names its `key`.
    pub(crate) fn in_plan<E: std::fmt::Display>(key: &str) -> impl FnOnce(E) -> Self {
        move |error| Self::Plan(format!("{key}: {error}"))
    }

    /// Checks that the value of `key` lies between 1 and `most`.
    pub(crate) fn check_range(key: &str, found: impl Into<u64>, most: u64) -> Result<(), Self> {
        let found = found.into();
        if (1..=most).contains(&found) {
            return Ok(());
        }
        Err(Self::Plan(format!("found {key} = {found}, wanted 1 to {most}")))
    }

    /// The monitor asked for an end of work that writes its results last.
    pub(crate) fn cancelled() -> Self {
        Self::Cancelled("nothing was written".to_owned())
    }

    /// Says where another part's error belongs to.
    pub fn at<E: Into<Box<dyn std::error::Error + Send + Sync>>>(
        place: impl ToString,
    ) -> impl FnOnce(E) -> Self {
        let place = place.to_string();
        move |error| Self::At { place, source: error.into() }
    }

    /// The error and its causes in one line, each said once: some errors tell their cause themselves.
    #[must_use]
    pub fn with_causes(&self) -> String {
        let mut line = self.to_string();
        let mut cause = std::error::Error::source(self);
        while let Some(error) = cause {
            let text = error.to_string();
            if !line.contains(text.trim_end()) {
                line = format!("{line}: {}", text.trim_end());
            }
            cause = error.source();
        }
        line
    }
}
