//! Why a journal cannot be used.

use std::path::PathBuf;

use rusqlite::ErrorCode;

use super::SCHEMA;

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// SQLite refused.
    #[error(transparent)]
    Sqlite(#[from] rusqlite::Error),
    /// A damaged file without a copy.
    #[error("the journal is damaged ({0})")]
    Damaged(String),
    /// Entries that are whole neither in the journal nor in its copy.
    #[error(
        "found {whole} whole entries, but {lost} more in {place} of which the first is damaged; nothing was changed: bring \
         back journal.sqlite or journal.jsonl, or delete what is lost from {place}"
    )]
    Lost {
        /// Entries that can be read.
        whole: usize,
        /// Entries that cannot.
        lost: usize,
        /// Where they stand.
        place: String,
    },
    /// A journal and a copy that do not belong to one history.
    #[error(
        "it contradicts its copy journal.jsonl: found entry {number} {journal}, and in the copy {copy}; nothing was \
         changed: move aside the one that is wrong"
    )]
    Contradiction {
        /// The first entry that differs, from 1.
        number: usize,
        /// This entry in the journal.
        journal: String,
        /// This entry in the copy.
        copy: String,
    },
    /// The copy cannot be read.
    #[error("{path}: cannot read the copy of the journal: {source}")]
    Copy {
        /// The copy.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file that cannot be moved to its place.
    #[error("{path}: cannot move it while the journal is restored: {source}")]
    Restore {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A value that its column cannot hold.
    #[error("step {step}: found {column} {found:?}, wanted {wanted}")]
    Value {
        /// Step of the row.
        step: u32,
        /// Column.
        column: &'static str,
        /// The value.
        found: String,
        /// The values that the column can hold.
        wanted: &'static str,
    },
    /// A schema that this version cannot use.
    #[error("found journal schema {0}, wanted {SCHEMA}: the run was begun by another version")]
    Schema(i64),
}

impl JournalError {
    /// Whether the disk is full.
    #[must_use]
    pub fn is_disk_full(&self) -> bool {
        matches!(self, Self::Sqlite(error) if error.sqlite_error_code() == Some(ErrorCode::DiskFull))
    }

    /// Whether the file itself is damaged.
    pub(super) fn is_damage(&self) -> bool {
        match self {
            Self::Damaged(_) => true,
            // A table that a flipped bit has renamed is an unknown error of the statement that wants it.
            Self::Sqlite(error) => matches!(
                error.sqlite_error_code(),
                Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase | ErrorCode::Unknown)
            ),
            _ => false,
        }
    }
}
