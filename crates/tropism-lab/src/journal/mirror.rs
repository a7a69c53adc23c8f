//! The mirror of a journal: a text file with a copy of each entry, from which a damaged journal is restored.
//!
//! Each line is a JSON list: the [digest](super::chain) of the entry, its name, then its values. The mirror is written
//! without waiting for the disk: it is a second line of defence against a disk that damages the journal itself.

use std::cell::RefCell;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::JournalError;
use super::chain::Link;
use crate::files::free_name;

/// An open mirror; closed after the first write that fails, as nothing may follow a line that is cut short.
#[derive(Debug, Default)]
pub(super) struct Mirror(RefCell<Option<File>>);

/// Path of the mirror of the journal at `journal`.
pub(super) fn path_of(journal: &Path) -> PathBuf {
    journal.with_extension("jsonl")
}

/// What a mirror holds.
#[derive(Default)]
pub(super) struct Contents {
    /// Its links in the order in which they were written, `None` for a line that is none.
    pub(super) links: Vec<Option<Link>>,
    /// Whether the last line has no end and is none: a program was killed, or lost its power, while it wrote.
    pub(super) is_cut: bool,
}

/// Reads the mirror of the journal at `journal`; `None` if there is none.
pub(super) fn read(journal: &Path) -> Result<Option<Contents>, JournalError> {
    let path = path_of(journal);
    let bytes = match fs::read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(JournalError::Copy { path, source }),
    };
    let mut lines: Vec<&[u8]> = bytes.split(|&byte| byte == b'\n').collect();
    let is_cut = lines.pop().is_some_and(|rest| !rest.is_empty());
    let link = |line: &[u8]| Link::from_line(std::str::from_utf8(line).ok()?);
    Ok(Some(Contents { links: lines.into_iter().map(link).collect(), is_cut }))
}

impl Mirror {
    /// Opens the mirror of the journal at `journal` to go on after `history`. One that holds the beginning of it gets what it
    /// lacks; another one is kept aside, and a new one written. If the disk refuses, the journal goes on without a mirror.
    pub(super) fn open(journal: &Path, found: Option<&Contents>, history: &[Link]) -> Self {
        let path = path_of(journal);
        let lines = |links: &[Link]| links.iter().map(Link::to_line).collect::<String>();
        let is_beginning = |found: &&Contents| {
            !found.is_cut
                && found.links.len() <= history.len()
                && found.links.iter().flatten().eq(&history[..found.links.len()])
        };
        let write = || {
            if let Some(found) = found.filter(is_beginning) {
                let mut file = OpenOptions::new().append(true).open(&path)?;
                file.write_all(lines(&history[found.links.len()..]).as_bytes())?;
                return Ok(file);
            }
            if found.is_some() {
                fs::rename(&path, free_name(&journal.with_extension("broken.jsonl")))?;
            }
            let part = journal.with_extension("jsonl.part");
            let mut file = File::create(&part)?;
            file.write_all(lines(history).as_bytes())?;
            fs::rename(&part, &path)?;
            Ok::<_, std::io::Error>(file)
        };
        Self(RefCell::new(write().ok()))
    }

    /// Adds a link.
    pub(super) fn add(&self, link: &Link) {
        let mut file = self.0.borrow_mut();
        if file.as_mut().is_some_and(|file| file.write_all(link.to_line().as_bytes()).is_err()) {
            *file = None;
        }
    }
}
