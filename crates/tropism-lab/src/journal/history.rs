//! What a journal and its copy hold, found out before anything is written.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};

use rusqlite::OptionalExtension;
use tropism::rig::Durability;
use tropism::text::plural;

use super::chain::{Link, longest_history};
use super::mirror::{self, Contents};
use super::{Journal, JournalError, SCHEMA, open_read_only};
use crate::files::free_name;

/// The longest history that fits, and what was found of it where.
pub(super) struct Survey {
    /// The history.
    pub(super) history: Vec<Link>,
    /// The copy; `None` if there is none.
    pub(super) copy: Option<Contents>,
    /// What is wrong with the journal; `None` if it holds the whole history, or if there is neither journal nor copy.
    pub(super) damage: Option<String>,
}

/// SQLite's own files: the database, what it was before its first log, the log and the index of the log.
const ENDINGS: [&str; 4] = ["", "-journal", "-wal", "-shm"];

impl Survey {
    /// Reads the journal at `path` and its copy, and changes neither.
    ///
    /// # Errors
    /// [`JournalError`] if entries are whole in neither, if they are of two histories, or if the schema is another one.
    pub(super) fn of(path: &Path) -> Result<Self, JournalError> {
        // The copy first: a run that goes on meanwhile writes the journal before it.
        let copy = mirror::read(path)?;
        let (stored, mut damage) = match path.exists() {
            true => read_links(path)?,
            false => (Vec::new(), copy.is_some().then(|| "no such file".to_owned())),
        };
        if copy.is_none()
            && stored.is_empty()
            && let Some(problem) = damage
        {
            return Err(JournalError::Damaged(problem));
        }
        let copied = copy.as_ref().map_or(&[][..], |copy| &copy.links);
        let mut history = longest_history([&stored, copied]).map_err(|links| {
            let number = stored.iter().flatten().position(|link| *link == links[0]).unwrap_or(0) + 1;
            let [journal, copy] = links.map(|link| link.text);
            JournalError::Contradiction { number, journal, copy }
        })?;
        // A link that fits but is no entry was written by no version of this program.
        if let Some(end) = history.iter().position(|link| link.entry().is_none()) {
            history.truncate(end);
        }
        for (links, place) in [(copied, "journal.jsonl"), (&stored, "journal.sqlite")] {
            let lost = beyond(&history, links);
            if lost > 0 {
                return Err(JournalError::Lost { whole: history.len(), lost, place: place.to_owned() });
            }
        }
        let held: HashSet<&Link> = stored.iter().flatten().collect();
        let lacking = history.iter().filter(|link| !held.contains(link)).count();
        if damage.is_none() && lacking > 0 {
            damage = Some(format!("{} of its copy not in it", plural(lacking, "entry")));
        }
        if let Some(damage) = &mut damage
            && copy.as_ref().is_some_and(|copy| copy.is_cut)
        {
            let last = history.len();
            damage.push_str(&format!("; what followed entry {last} is lost, as the copy is cut short there"));
        }
        Ok(Self { history, copy, damage })
    }

    /// Writes the journal at `path` anew from the history, and keeps what was there aside. At no moment is it there in part.
    pub(super) fn write(&self, path: &Path, durability: Durability) -> Result<(), JournalError> {
        let restored = path.with_extension("restored.sqlite");
        for ending in ENDINGS {
            let _ = fs::remove_file(sibling(&restored, ending));
        }
        let journal = Journal::connect(&restored, durability)?;
        journal.write_all(&self.history)?;
        journal.empty_log()?;
        drop(journal);
        let broken = free_name(&path.with_extension("broken.sqlite"));
        for ending in ENDINGS {
            let (from, to) = (sibling(path, ending), sibling(&broken, ending));
            if from.exists() {
                fs::rename(&from, &to).map_err(|source| JournalError::Restore { path: from, source })?;
            }
        }
        fs::rename(&restored, path).map_err(|source| JournalError::Restore { path: restored, source })
    }
}

/// One of SQLite's own files beside the database at `path`.
fn sibling(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// How many entries of a source came after `history`, and cannot be read.
fn beyond(history: &[Link], links: &[Option<Link>]) -> usize {
    let numbers: HashMap<&Link, usize> = history.iter().zip(1..).collect();
    let known = |(at, link): (usize, &Option<Link>)| Some((at + 1, *numbers.get(link.as_ref()?)?));
    let (at, number) = links.iter().enumerate().rev().find_map(known).unwrap_or((0, 0));
    (links.len() - at).saturating_sub(history.len() - number)
}

/// The links that the journal at `path` holds, `None` for a row that is none, and what is wrong with the file.
///
/// # Errors
/// [`JournalError::Schema`] for another schema, and what SQLite says of a file that is not damaged but cannot be read.
fn read_links(path: &Path) -> Result<(Vec<Option<Link>>, Option<String>), JournalError> {
    let mut links = Vec::new();
    match try_read_links(path, &mut links) {
        Ok(()) => Ok((links, None)),
        Err(error) if error.is_damage() => Ok((links, Some(error.to_string()))),
        Err(error) => Err(error),
    }
}

fn try_read_links(path: &Path, links: &mut Vec<Option<Link>>) -> Result<(), JournalError> {
    let db = open_read_only(path)?;
    let schema = db.query_row("PRAGMA user_version", [], |row| row.get(0));
    // A journal has a log from the beginning. Beside what else SQLite writes before, a program was killed that made one.
    let is_torn = sibling(path, "-journal").exists();
    match schema {
        Ok(SCHEMA) => {}
        Ok(0) | Err(_) if is_torn => return Ok(()),
        Err(error) => return Err(error.into()),
        // An empty file: nothing was written to it yet, or it was lost.
        Ok(0) if db.query_row("SELECT 1 FROM sqlite_master", [], |_| Ok(())).optional()?.is_none() => {
            return Ok(());
        }
        Ok(other) => return Err(JournalError::Schema(other)),
    }
    let mut statement = db.prepare("SELECT id, text, digest FROM entry ORDER BY id")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let id: i64 = row.get(0)?;
        // Rows that are missing leave room, so that those after them keep their numbers.
        let missing = usize::try_from(id).unwrap_or(0).saturating_sub(links.len() + 1);
        if missing < MOST_MISSING {
            links.extend(std::iter::repeat_n(None, missing));
        }
        let link = |row: &rusqlite::Row<'_>| {
            Ok::<_, rusqlite::Error>(Link { text: row.get(1)?, digest: row.get(2)? })
        };
        links.push(link(row).ok());
    }
    drop(rows);
    let check: String = db.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
    if check == "ok" { Ok(()) } else { Err(JournalError::Damaged(check)) }
}

/// The most missing rows that are believed: chosen, far above the entries of a year. A damaged number may be any.
const MOST_MISSING: usize = 1_000_000;
