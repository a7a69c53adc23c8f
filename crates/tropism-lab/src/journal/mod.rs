//! The journal of a run: an SQLite file with a row for each step, for each event, and for each time a program resumed it.
//!
//! All that is written is an entry, and each entry is a link of a [hash chain](chain). The tables of steps, events and
//! boots are what the entries come to, for readers with SQL; this program reads the entries.
//!
//! In come steps and events as they happen; out comes what a resumed run, a report or an export needs. With full durability
//! a write that returns is on the disk: write-ahead logging with `synchronous = FULL`, as with less a power cut may lose the
//! latest commits. A mirror, the same entries as text, restores a journal that the disk damaged.
//!
//! # References
//! SQLite, "PRAGMA synchronous": <https://www.sqlite.org/pragma.html#pragma_synchronous>. `scripts/power-cuts` tries it.

mod error;
mod chain;
mod mirror;
mod history;
mod step;
mod downtime;

use std::cell::RefCell;
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use rusqlite::types::Value;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, params_from_iter};
use tropism::lighting::Lighting;
use tropism::programme::Acting;
use tropism::rig::{Boot, Durability, Event, Moment};
use tropism::text::plural;

use chain::{Link, last_digest};
use history::Survey;
use mirror::Mirror;
use step::columns;

pub use downtime::Downtime;
pub use error::JournalError;
pub(crate) use step::lights_that_acted;
pub use step::{ProgrammeRecord, SideRecord, StepRecord};

/// Number of the schema, kept as SQLite's `user_version`. Journals of other schemas are refused.
const SCHEMA: i64 = 8;

const TABLES: &str = "
    CREATE TABLE steps (
        step INTEGER PRIMARY KEY, time_s REAL NOT NULL,
        photo TEXT NOT NULL, photo_bytes INTEGER NOT NULL, photo_sha256 TEXT NOT NULL,
        tip_x_cm REAL, tip_y_cm REAL, tip_x_px REAL, tip_y_px REAL,
        quality TEXT, class TEXT NOT NULL, confidence REAL NOT NULL,
        decided TEXT, done INTEGER NOT NULL DEFAULT 0,
        begun_s REAL, unix_s REAL, lit TEXT, moved_x_px REAL, moved_y_px REAL, stem TEXT, side TEXT,
        part INTEGER, steered INTEGER, base TEXT, commanded TEXT);
    CREATE TABLE event (
        id INTEGER PRIMARY KEY, step INTEGER NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL,
        since_start_s REAL, unix_s REAL);
    CREATE TABLE boot (
        id INTEGER PRIMARY KEY, boot TEXT NOT NULL, start_s REAL NOT NULL, wall_set INTEGER NOT NULL);
    CREATE TABLE settings (text TEXT NOT NULL);
    CREATE TABLE entry (id INTEGER PRIMARY KEY, text TEXT NOT NULL, digest TEXT NOT NULL);";

/// What the entries come to, in an order that does not depend on the file.
const CONTENTS: [&str; 4] = [
    "SELECT * FROM steps ORDER BY step",
    "SELECT * FROM event ORDER BY id",
    "SELECT * FROM boot ORDER BY id",
    "SELECT * FROM settings ORDER BY rowid",
];

/// Size of a page of a new journal: that of a few rows.
const PAGE_BYTES: u32 = 1024;

/// The statement that writes an entry of each kind into its table.
const STATEMENTS: [(&str, &str); 7] = [
    ("settings", "INSERT INTO settings (text) VALUES (?)"),
    ("boot", "INSERT INTO boot (boot, start_s, wall_set) VALUES (?, ?, ?)"),
    (
        "saw",
        concat!(
            "INSERT OR REPLACE INTO steps (",
            columns!(),
            ") VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
        ),
    ),
    ("decided", "UPDATE steps SET decided = ? WHERE step = ?"),
    ("programme", "UPDATE steps SET part = ?, steered = ?, base = ?, commanded = ? WHERE step = ?"),
    ("done", "UPDATE steps SET done = 1 WHERE step = ?"),
    ("event", "INSERT INTO event (step, kind, text, since_start_s, unix_s) VALUES (?, ?, ?, ?, ?)"),
];

/// An open journal.
#[derive(Debug)]
pub struct Journal {
    db: Connection,
    /// Digest of the last entry.
    digest: RefCell<String>,
    mirror: Mirror,
    restored: Option<String>,
}

impl Journal {
    /// Opens the journal at `path`, or creates it with `settings`, the text of the `run.toml` of the run. It is there whole or
    /// not at all, whenever the program is killed. One that is damaged or missing, or lacks what its mirror has, is restored;
    /// what was there is kept aside.
    ///
    /// # Errors
    /// [`JournalError`] if the file is no journal, if entries are whole neither in it nor in its mirror, if the two contradict
    /// each other, or if it is of another schema. Nothing was changed then.
    pub fn open(path: &Path, durability: Durability, settings: &str) -> Result<Self, JournalError> {
        let mut survey = Survey::of(path)?;
        if survey.history.is_empty() {
            survey.history.push(Link::after("", "settings", &[settings.to_owned().into()]));
            survey.damage = None;
            survey.write(path, durability)?;
        }
        let replayed = Self::replayed(&survey.history)?;
        let mut damage = survey.damage.clone();
        if damage.is_none() {
            damage = Self::connect(path, durability)?.difference(&replayed)?;
        }
        // Before the journal is moved: at no moment is the history in neither.
        let mirror = Mirror::open(path, survey.copy.as_ref(), &survey.history);
        if damage.is_some() {
            survey.write(path, durability)?;
        }
        let entries = plural(survey.history.len(), "entry");
        Ok(Self {
            digest: RefCell::new(last_digest(&survey.history).to_owned()),
            mirror,
            restored: damage.map(|damage| format!("{damage}; made again, {entries}")),
            ..Self::connect(path, durability)?
        })
    }

    /// Opens the journal at `path` to read it, also while a run writes it. Where it is damaged its mirror stands in.
    ///
    /// # Errors
    /// [`JournalError`] if there is no journal, if entries are whole neither in it nor in its mirror, or if it is of another
    /// schema.
    pub fn open_to_read(path: &Path) -> Result<Self, JournalError> {
        match Survey::of(path) {
            Ok(survey) if survey.history.is_empty() && !path.exists() => {
                Err(JournalError::Damaged("no such file".to_owned()))
            }
            survey => Self::replayed(&survey?.history),
        }
    }

    /// Opens the journal at `path` to follow it while a run writes it: what it holds is taken as it is, and its chain and its
    /// mirror are not looked at. [`Self::open_to_read`] checks them, which takes time for each entry.
    ///
    /// # Errors
    /// [`JournalError`] if there is no journal, or it is of another schema.
    pub fn follow(path: &Path) -> Result<Self, JournalError> {
        let db = open_read_only(path)?;
        match db.query_row("PRAGMA user_version", [], |row| row.get(0))? {
            SCHEMA => Ok(Self::new(db)),
            other => Err(JournalError::Schema(other)),
        }
    }

    /// [`Self::open_to_read`], or `None` if there is neither a journal at `path` nor anything in its mirror.
    ///
    /// # Errors
    /// As [`Self::open_to_read`].
    pub fn find(path: &Path) -> Result<Option<Self>, JournalError> {
        let is_there = path.exists() || mirror::path_of(path).metadata().is_ok_and(|about| about.len() > 0);
        is_there.then(|| Self::open_to_read(path)).transpose()
    }

    /// What was wrong with the journal that was restored; `None` if it was whole.
    #[must_use]
    pub fn restored(&self) -> Option<&str> {
        self.restored.as_deref()
    }

    fn new(db: Connection) -> Self {
        Self { db, digest: RefCell::default(), mirror: Mirror::default(), restored: None }
    }

    fn connect(path: &Path, durability: Durability) -> Result<Self, JournalError> {
        let db = Connection::open(path)?;
        // A commit writes whole pages: of a new journal, small ones. Measured by `scripts/cost`.
        db.pragma_update(None, "page_size", PAGE_BYTES)?;
        db.pragma_update(None, "journal_mode", "WAL")?;
        // FULL syncs the log at every commit. OFF leaves that to the system, which outlives a killed program.
        db.pragma_update(None, "synchronous", if durability == Durability::Full { "FULL" } else { "OFF" })?;
        match db.query_row("PRAGMA user_version", [], |row| row.get(0))? {
            SCHEMA => Ok(Self::new(db)),
            0 => Self::of(db),
            other => Err(JournalError::Schema(other)),
        }
    }

    /// An empty journal in a database.
    fn of(db: Connection) -> Result<Self, JournalError> {
        db.execute_batch(&format!("BEGIN; {TABLES} PRAGMA user_version = {SCHEMA}; COMMIT;"))?;
        Ok(Self::new(db))
    }

    /// A journal of `history` in memory.
    fn replayed(history: &[Link]) -> Result<Self, JournalError> {
        let journal = Self::of(Connection::open_in_memory()?)?;
        journal.write_all(history)?;
        Ok(journal)
    }

    /// The first difference between the tables of this journal and of the one that its entries come to.
    fn difference(&self, replayed: &Self) -> Result<Option<String>, JournalError> {
        for query in CONTENTS {
            let (ours, theirs) = (self.rows(query), replayed.rows(query)?);
            let ours = match ours {
                Err(error) if error.is_damage() => return Ok(Some(error.to_string())),
                ours => ours?,
            };
            if ours != theirs {
                let row = ours.iter().zip(&theirs).position(|(one, other)| one != other);
                let row = row.unwrap_or(ours.len().min(theirs.len())) + 1;
                return Ok(Some(format!("row {row} of \"{query}\" is not what was written")));
            }
        }
        Ok(None)
    }

    fn rows(&self, query: &str) -> Result<Vec<Vec<Value>>, JournalError> {
        let mut statement = self.db.prepare(query)?;
        let columns = statement.column_count();
        let mut found = statement.query([])?;
        let mut rows = Vec::new();
        while let Some(row) = found.next()? {
            rows.push((0..columns).map(|column| row.get(column)).collect::<Result<_, _>>()?);
        }
        Ok(rows)
    }

    fn write_all(&self, history: &[Link]) -> Result<(), JournalError> {
        self.db.execute_batch("BEGIN")?;
        for link in history {
            let Some((name, values)) = link.entry() else {
                return Err(JournalError::Damaged(format!("entry {}", link.text)));
            };
            self.execute(link, &name, &values)?;
        }
        Ok(self.db.execute_batch("COMMIT")?)
    }

    /// Empties SQLite's log into the database, which then holds everything alone. The end of a connection does so, too, but says
    /// nothing if it fails.
    fn empty_log(&self) -> Result<(), JournalError> {
        Ok(self.db.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(()))?)
    }

    /// Writes an entry, and its copy into the mirror.
    fn write(&self, name: &str, values: &[Value]) -> Result<(), JournalError> {
        let link = Link::after(&self.digest.borrow(), name, values);
        let transaction = self.db.unchecked_transaction()?;
        self.execute(&link, name, values)?;
        transaction.commit()?;
        self.mirror.add(&link);
        self.digest.replace(link.digest);
        Ok(())
    }

    /// Writes an entry into its table and among the entries.
    fn execute(&self, link: &Link, name: &str, values: &[Value]) -> Result<(), JournalError> {
        let Some((_, statement)) = STATEMENTS.iter().find(|(kind, _)| *kind == name) else {
            return Err(JournalError::Damaged(format!("entry {}", link.text)));
        };
        self.db.prepare_cached(statement)?.execute(params_from_iter(values))?;
        self.db
            .prepare_cached("INSERT INTO entry (text, digest) VALUES (?, ?)")?
            .execute([&link.text, &link.digest])?;
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

    /// Records the decision of a step, before the lamps are switched.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn record_decision(&self, step: u32, lighting: impl Into<Lighting>) -> Result<(), JournalError> {
        let lighting: Lighting = lighting.into();
        self.write("decided", &[lighting.to_string().into(), step.into()])
    }

    /// Records what the programme of the rig made of a step, before the lamps are switched. Of a missed step there is no row:
    /// then it stands among the entries alone.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn record_programme(&self, step: u32, record: &ProgrammeRecord) -> Result<(), JournalError> {
        let Acting { part, is_steered, base } = record.acting;
        let lightings = [base, record.commanded].map(|lighting| Value::from(lighting.to_string()));
        let [base, commanded] = lightings;
        self.write("programme", &[part.into(), is_steered.into(), base, commanded, step.into()])
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
        self.steps_in(0..u32::MAX)
    }

    /// Reads the recorded steps whose numbers are in `numbers`, in order.
    ///
    /// # Errors
    /// As [`Self::steps`].
    pub fn steps_in(&self, numbers: Range<u32>) -> Result<Vec<StepRecord>, JournalError> {
        let query = concat!(
            "SELECT ",
            columns!(),
            ", decided, done, part, steered, base, commanded FROM steps WHERE step >= ? AND step < ? ORDER BY step"
        );
        let mut statement = self.db.prepare(query)?;
        let mut found = statement.query([numbers.start, numbers.end])?;
        let mut steps = Vec::new();
        while let Some(row) = found.next()? {
            steps.push(StepRecord::read(row)?);
        }
        Ok(steps)
    }

    /// The text of the `run.toml` of the run; `None` in a new journal.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn settings(&self) -> Result<Option<String>, JournalError> {
        Ok(self.db.query_row("SELECT text FROM settings", [], |row| row.get(0)).optional()?)
    }

    /// How many steps are recorded.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn step_count(&self) -> Result<u32, JournalError> {
        Ok(self.db.query_row("SELECT count(*) FROM steps", [], |row| row.get(0))?)
    }

    /// The step after the last recorded one.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn next_step(&self) -> Result<u32, JournalError> {
        Ok(self.db.query_row("SELECT coalesce(max(step) + 1, 0) FROM steps", [], |row| row.get(0))?)
    }

    /// Reads all events in order.
    ///
    /// # Errors
    /// [`JournalError`] names the event that cannot be read.
    pub fn events(&self) -> Result<Vec<Event>, JournalError> {
        self.events_after(0)
    }

    /// Reads all events but the first `count`, in order.
    ///
    /// # Errors
    /// As [`Self::events`].
    pub fn events_after(&self, count: usize) -> Result<Vec<Event>, JournalError> {
        let query = "SELECT step, kind, text, since_start_s, unix_s FROM event ORDER BY id LIMIT -1 OFFSET ?";
        let mut statement = self.db.prepare(query)?;
        let mut found = statement.query([count as i64])?;
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

    /// The latest moment of a step or an event of the run; `None` in a virtual tent. Notes are left also where nothing runs.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn latest_moment(&self) -> Result<Option<Moment>, JournalError> {
        let latest = self
            .db
            .query_row(
                "SELECT begun_s, unix_s FROM steps WHERE begun_s IS NOT NULL
                 UNION ALL SELECT since_start_s, unix_s FROM event WHERE since_start_s IS NOT NULL AND kind <> 'note'
                 ORDER BY 1 DESC LIMIT 1",
                [],
                |row| Ok(moment(row.get(0)?, row.get(1)?)),
            )
            .optional()?;
        Ok(latest.flatten())
    }
}

/// Opens a database to read it. In a folder that cannot be written SQLite has no place for the index of its log: then the
/// database is taken as it is, without the log, whose entries the mirror has.
fn open_read_only(path: &Path) -> Result<Connection, JournalError> {
    let db = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    let read = db.query_row("PRAGMA user_version", [], |row| row.get::<_, i64>(0));
    let is_refused = read.is_err_and(|error| {
        matches!(error.sqlite_error_code(), Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly))
    });
    if !is_refused {
        return Ok(db);
    }
    // The letters that have a meaning in an address.
    let name = path.to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
    Ok(Connection::open_with_flags(format!("file:{name}?immutable=1"), flags)?)
}

/// The moment of two columns; `None` in a virtual tent, where they are empty.
fn moment(since_start_s: Option<f64>, unix_s: Option<f64>) -> Option<Moment> {
    let since_start = Duration::try_from_secs_f64(since_start_s?).ok()?;
    Some(Moment { since_start, unix_s: unix_s? })
}
