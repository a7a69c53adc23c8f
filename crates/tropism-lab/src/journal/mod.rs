//! The journal of a run: an SQLite file with a row for each step, for each event, and for each time a program resumed it.
//!
//! In come steps and events as they happen; out comes what a resumed run, a report or an export needs. With full durability
//! a write that returns is on the disk: write-ahead logging with `synchronous = FULL`, as with less a power cut may lose the
//! latest commits. A mirror, the same entries as text, restores a journal that the disk damaged.
//!
//! # References
//! SQLite, "PRAGMA synchronous": <https://www.sqlite.org/pragma.html#pragma_synchronous>. `scripts/power-cuts` tries it.

mod downtime;
mod mirror;
mod step;

use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::types::Value;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, params_from_iter};
use tropism::lamps::Light;
use tropism::rig::{Boot, Durability, Event, Moment};

use mirror::{Contents, Entry, Mirror};
use step::columns;

pub use downtime::Downtime;
pub use step::StepRecord;

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// SQLite refused.
    #[error(transparent)]
    Sqlite(#[from] rusqlite::Error),
    /// A damaged file.
    #[error("found a damaged journal ({0}), wanted one that SQLite's quick_check passes")]
    Damaged(String),
    /// A copy that is damaged itself.
    #[error(
        "{path}: line {line} is damaged, and the journal itself is damaged or lacks what stands here; nothing was changed"
    )]
    Copy {
        /// The copy.
        path: PathBuf,
        /// Its first damaged line, from 1.
        line: usize,
    },
    /// A journal and a copy each of which has something that the other has otherwise.
    #[error(
        "it contradicts its copy journal.jsonl: found {journal}, and in the copy {copy}; nothing was changed: move aside \
         the one that is wrong"
    )]
    Contradiction {
        /// The first entry that the copy lacks.
        journal: String,
        /// The first entry that the journal lacks.
        copy: String,
    },
    /// A restored journal that cannot take its place.
    #[error("{path}: cannot rename the restored journal: {source}")]
    Restore {
        /// The restored file.
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
    #[error("found journal schema {0}, wanted {SCHEMA}; the version that began the run can resume it")]
    Schema(i64),
}

impl JournalError {
    /// Whether the disk is full.
    #[must_use]
    pub fn is_disk_full(&self) -> bool {
        matches!(self, Self::Sqlite(error) if error.sqlite_error_code() == Some(ErrorCode::DiskFull))
    }

    /// Whether the file is damaged.
    fn is_damage(&self) -> bool {
        match self {
            Self::Damaged(_) => true,
            Self::Sqlite(error) => {
                let code = error.sqlite_error_code();
                [Some(ErrorCode::DatabaseCorrupt), Some(ErrorCode::NotADatabase)].contains(&code)
            }
            _ => false,
        }
    }
}

/// The schema that is written. 5 added the stem of each step, 4 the shift of the camera, 3 events, boots and wall times.
const SCHEMA: i64 = 5;

/// The oldest schema that can be read. Only a journal of [`SCHEMA`] can be resumed.
const OLDEST_READABLE: i64 = 2;

const TABLES: &str = "
    CREATE TABLE steps (
        step INTEGER PRIMARY KEY, time_s REAL NOT NULL,
        photo TEXT NOT NULL, photo_bytes INTEGER NOT NULL, photo_sha256 TEXT NOT NULL,
        tip_x_cm REAL, tip_y_cm REAL, tip_x_px REAL, tip_y_px REAL,
        quality TEXT, class TEXT NOT NULL, confidence REAL NOT NULL,
        decided TEXT, done INTEGER NOT NULL DEFAULT 0,
        begun_s REAL, unix_s REAL, lit TEXT, moved_x_px REAL, moved_y_px REAL, stem TEXT);
    CREATE TABLE event (
        id INTEGER PRIMARY KEY, step INTEGER NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL,
        since_start_s REAL, unix_s REAL);
    CREATE TABLE boot (
        id INTEGER PRIMARY KEY, boot TEXT NOT NULL, start_s REAL NOT NULL, wall_set INTEGER NOT NULL);";

/// A kind of entry.
struct EntryKind {
    /// Its name in the mirror.
    name: &'static str,
    /// The statement that writes it.
    write: &'static str,
    /// The query that reads the values of all such entries, in the order of `write`.
    read: &'static str,
}

/// All kinds of entries, each after those that it changes.
const ENTRY_KINDS: [EntryKind; 5] = [
    EntryKind {
        name: "boot",
        write: "INSERT INTO boot (boot, start_s, wall_set) VALUES (?, ?, ?)",
        read: "SELECT boot, start_s, wall_set FROM boot ORDER BY id",
    },
    EntryKind {
        name: "saw",
        write: concat!(
            "INSERT OR REPLACE INTO steps (",
            columns!(),
            ") VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
        ),
        read: concat!("SELECT ", columns!(), " FROM steps ORDER BY step"),
    },
    EntryKind {
        name: "decided",
        write: "UPDATE steps SET decided = ? WHERE step = ?",
        read: "SELECT decided, step FROM steps WHERE decided IS NOT NULL ORDER BY step",
    },
    EntryKind {
        name: "done",
        write: "UPDATE steps SET done = 1 WHERE step = ?",
        read: "SELECT step FROM steps WHERE done = 1 ORDER BY step",
    },
    EntryKind {
        name: "event",
        write: "INSERT INTO event (step, kind, text, since_start_s, unix_s) VALUES (?, ?, ?, ?, ?)",
        read: "SELECT step, kind, text, since_start_s, unix_s FROM event ORDER BY id",
    },
];

/// An open journal.
#[derive(Debug)]
pub struct Journal {
    db: Connection,
    schema: i64,
    mirror: Mirror,
    restored: Option<String>,
}

impl Journal {
    /// Opens the journal at `path`, or creates it. One that is damaged or missing, or lacks what its mirror has, is restored
    /// from the mirror, a `.jsonl` file beside it; what was there is kept aside.
    ///
    /// # Errors
    /// [`JournalError`] if the file is no journal, is damaged without a whole mirror, contradicts its mirror, or has another
    /// schema. Nothing was changed then.
    pub fn open(path: &Path, durability: Durability) -> Result<Self, JournalError> {
        let copy = mirror::read(path);
        let opened = match mirror::is_orphaned(path) {
            true => Err(JournalError::Damaged("no such file".to_owned())),
            false => Self::connect(path, durability),
        };
        let opened = match (opened, &copy) {
            (Ok(journal), Some(copy)) => journal.compared_with(copy).map(|()| journal),
            (opened, _) => opened,
        };
        let mut journal = match (opened, &copy) {
            (Err(error), Some(copy)) if error.is_damage() => {
                mirror::restore(path, durability, copy)?;
                let entries = copy.entries.len();
                let restored = Some(format!("{error}; made again from its copy, {entries} entries"));
                Self { restored, ..Self::connect(path, durability)? }
            }
            (opened, _) => opened?,
        };
        if copy.is_some_and(|copy| copy.damaged_line.is_some()) {
            mirror::set_aside(path);
        }
        journal.mirror = Mirror::create(path, &journal.entries()?);
        Ok(journal)
    }

    /// Opens the journal at `path` to read it, also while a run writes it.
    ///
    /// # Errors
    /// [`JournalError`] if there is no journal, or its schema cannot be read.
    pub fn open_to_read(path: &Path) -> Result<Self, JournalError> {
        let db = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
        match db.query_row("PRAGMA user_version", [], |row| row.get(0))? {
            schema @ OLDEST_READABLE..=SCHEMA => {
                Ok(Self { db, schema, mirror: Mirror::default(), restored: None })
            }
            other => Err(JournalError::Schema(other)),
        }
    }

    /// What was wrong with the journal and how it was restored; `None` if it was whole.
    #[must_use]
    pub fn restored(&self) -> Option<&str> {
        self.restored.as_deref()
    }

    /// Whether it holds the stem of each step: since schema 5.
    #[must_use]
    pub const fn has_stems(&self) -> bool {
        self.schema >= 5
    }

    fn connect(path: &Path, durability: Durability) -> Result<Self, JournalError> {
        let db = Connection::open(path)?;
        db.pragma_update(None, "journal_mode", "WAL")?;
        // FULL syncs the log at every commit. OFF leaves that to the system, which outlives a killed program.
        db.pragma_update(None, "synchronous", if durability == Durability::Full { "FULL" } else { "OFF" })?;
        let check: String = db.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
        if check != "ok" {
            return Err(JournalError::Damaged(check));
        }
        let schema: i64 = db.query_row("PRAGMA user_version", [], |row| row.get(0))?;
        match schema {
            SCHEMA => {}
            0 => db.execute_batch(&format!("BEGIN; {TABLES} PRAGMA user_version = {SCHEMA}; COMMIT;"))?,
            other => return Err(JournalError::Schema(other)),
        }
        Ok(Self { db, schema: SCHEMA, mirror: Mirror::default(), restored: None })
    }

    /// Compares the journal with its copy. The copy is written after the journal, so it may lack the latest entries.
    ///
    /// # Errors
    /// [`JournalError::Damaged`] if the journal lacks entries that the copy has, and [`JournalError::Contradiction`] if the
    /// copy lacks others.
    fn compared_with(&self, copy: &Contents) -> Result<(), JournalError> {
        // What the copy comes to: later entries of a step take the place of earlier ones.
        let replayed = Self::of(Connection::open_in_memory()?)?;
        replayed.write_all(&copy.entries)?;
        let lines = |journal: &Self| -> Result<Vec<String>, JournalError> {
            let mut lines: Vec<String> =
                journal.entries()?.iter().map(|(name, values)| mirror::to_line(name, values)).collect();
            lines.sort_unstable();
            Ok(lines)
        };
        let (ours, theirs) = (lines(self)?, lines(&replayed)?);
        let lacking = |these: &[String], those: &[String]| -> Vec<String> {
            those.iter().filter(|line| these.binary_search(line).is_err()).cloned().collect()
        };
        let (lost, more) = (lacking(&ours, &theirs), lacking(&theirs, &ours));
        match (lost.first(), more.first()) {
            (None, _) => Ok(()),
            (Some(_), None) => {
                Err(JournalError::Damaged(format!("{} entries of its copy are not in it", lost.len())))
            }
            (Some(copy), Some(journal)) => Err(JournalError::Contradiction {
                journal: journal.trim_end().to_owned(),
                copy: copy.trim_end().to_owned(),
            }),
        }
    }

    /// An empty journal in a database.
    fn of(db: Connection) -> Result<Self, JournalError> {
        db.execute_batch(&format!("BEGIN; {TABLES} PRAGMA user_version = {SCHEMA}; COMMIT;"))?;
        Ok(Self { db, schema: SCHEMA, mirror: Mirror::default(), restored: None })
    }

    /// Creates a journal of `entries` at `path`.
    fn create(path: &Path, durability: Durability, entries: &[Entry]) -> Result<(), JournalError> {
        Self::connect(path, durability)?.write_all(entries)
    }

    fn write_all(&self, entries: &[Entry]) -> Result<(), JournalError> {
        self.db.execute_batch("BEGIN")?;
        for (name, values) in entries {
            self.write(name, values)?;
        }
        Ok(self.db.execute_batch("COMMIT")?)
    }

    /// Reads all entries.
    fn entries(&self) -> Result<Vec<(&'static str, Vec<Value>)>, JournalError> {
        let mut entries = Vec::new();
        for EntryKind { name, read, .. } in ENTRY_KINDS {
            let mut statement = self.db.prepare(read)?;
            let columns = statement.column_count();
            let mut found = statement.query([])?;
            while let Some(row) = found.next()? {
                entries.push((name, (0..columns).map(|column| row.get(column)).collect::<Result<_, _>>()?));
            }
        }
        Ok(entries)
    }

    /// Writes an entry, and its copy into the mirror.
    fn write(&self, name: &str, values: &[Value]) -> Result<(), JournalError> {
        let Some(EntryKind { write, .. }) = ENTRY_KINDS.iter().find(|kind| kind.name == name) else {
            return Err(JournalError::Damaged(format!("an entry {name:?} in its copy")));
        };
        self.db.prepare_cached(write)?.execute(params_from_iter(values))?;
        self.mirror.add(name, values);
        Ok(())
    }
}

/// Writing.
impl Journal {
    /// Records that a program began or resumed the run, and the start of the experiment on its clock.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn record_boot(&self, boot: &Boot) -> Result<(), JournalError> {
        self.write("boot", &[boot.id.clone().into(), boot.start_s.into(), boot.is_wall_set.into()])
    }

    /// Records an event.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn record_event(&self, event: &Event) -> Result<(), JournalError> {
        let values = [
            event.step.into(),
            event.kind.name().to_owned().into(),
            event.text.clone().into(),
            event.at.map(|at| at.since_start.as_secs_f64()).into(),
            event.at.map(|at| at.unix_s).into(),
        ];
        self.write("event", &values)
    }

    /// Records a photograph that is safe on the disk, and its detection. The decision is recorded later.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn record_observation(&self, step: &StepRecord) -> Result<(), JournalError> {
        self.write("saw", &step.values())
    }

    /// Records the decision of a step, before the lamps are told.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn record_decision(&self, step: u32, light: Light) -> Result<(), JournalError> {
        self.write("decided", &[light.standard_name().to_owned().into(), step.into()])
    }

    /// Records that the lamps confirmed the decision of a step.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn record_confirmation(&self, step: u32) -> Result<(), JournalError> {
        self.write("done", &[step.into()])
    }
}

/// Reading.
impl Journal {
    /// Reads all recorded steps in order. Missed steps are not among them.
    ///
    /// # Errors
    /// [`JournalError`] names the step and the column that cannot be read.
    pub fn steps(&self) -> Result<Vec<StepRecord>, JournalError> {
        let columns = StepRecord::columns(self.schema);
        let mut statement = self.db.prepare(&format!("SELECT {columns} FROM steps ORDER BY step"))?;
        let mut found = statement.query([])?;
        let mut steps = Vec::new();
        while let Some(row) = found.next()? {
            steps.push(StepRecord::read(row)?);
        }
        Ok(steps)
    }

    /// How many steps are recorded.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn step_count(&self) -> Result<u32, JournalError> {
        Ok(self.db.query_row("SELECT count(*) FROM steps", [], |row| row.get(0))?)
    }

    /// Reads all events in order; none in a journal before schema 3.
    ///
    /// # Errors
    /// [`JournalError`] names the event that cannot be read.
    pub fn events(&self) -> Result<Vec<Event>, JournalError> {
        if self.schema < 3 {
            return Ok(Vec::new());
        }
        let mut statement =
            self.db.prepare("SELECT step, kind, text, since_start_s, unix_s FROM event ORDER BY id")?;
        let mut found = statement.query([])?;
        let mut events = Vec::new();
        while let Some(row) = found.next()? {
            let (step, word): (u32, String) = (row.get(0)?, row.get(1)?);
            let Ok(kind) = word.parse() else {
                let wanted = "a kind of event";
                return Err(JournalError::Value { step, column: "kind", found: word, wanted });
            };
            events.push(Event { step, kind, text: row.get(2)?, at: moment(row.get(3)?, row.get(4)?) });
        }
        Ok(events)
    }

    /// The latest event that says whether the run goes on, waits or is over; `None` before the run began. After a kill it
    /// still says that the run was started or resumed.
    ///
    /// # Errors
    /// As [`Self::events`].
    pub fn state(&self) -> Result<Option<Event>, JournalError> {
        Ok(self.events()?.into_iter().rfind(|event| event.kind.is_state()))
    }

    /// The boot in which a program began or resumed the run last; `None` in a virtual tent.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn latest_boot(&self) -> Result<Option<Boot>, JournalError> {
        let boot = |row: &rusqlite::Row<'_>| {
            Ok(Boot { id: row.get(0)?, start_s: row.get(1)?, is_wall_set: row.get(2)? })
        };
        Ok(self
            .db
            .query_row("SELECT boot, start_s, wall_set FROM boot ORDER BY id DESC LIMIT 1", [], boot)
            .optional()?)
    }

    /// The latest moment of a step or an event; `None` in a virtual tent.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn latest_moment(&self) -> Result<Option<Moment>, JournalError> {
        let latest = self
            .db
            .query_row(
                "SELECT begun_s, unix_s FROM steps WHERE begun_s IS NOT NULL
                 UNION ALL SELECT since_start_s, unix_s FROM event WHERE since_start_s IS NOT NULL
                 ORDER BY 1 DESC LIMIT 1",
                [],
                |row| Ok(moment(row.get(0)?, row.get(1)?)),
            )
            .optional()?;
        Ok(latest.flatten())
    }
}

/// The moment of two columns; `None` in a virtual tent, where they are empty.
fn moment(since_start_s: Option<f64>, unix_s: Option<f64>) -> Option<Moment> {
    let since_start = Duration::try_from_secs_f64(since_start_s?).ok()?;
    Some(Moment { since_start, unix_s: unix_s? })
}
