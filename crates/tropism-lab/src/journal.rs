//! The journal of a run: SQLite, one row a step, one an event, and one for each time that a program took the run up.

use std::path::Path;
use std::time::Duration;

use rusqlite::types::Value;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, params_from_iter};

use crate::copy::{self, Copy};
use tropism::geometry::{Pixel, Point};
use tropism::lamps::{self, Light};
use tropism::observation::{Observation, Quality};
use tropism::rig::{Boot, Moment};
use tropism::rig::{Durability, Event};
use tropism::vision::{FrameStatus, TrackedFrame};

/// One step as it was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Step, from 0. One that was missed is not there.
    pub step: u32,
    /// Seconds since the start, as it was due.
    pub time_s: f64,
    /// File of the photograph in `photographs/`.
    pub photo: String,
    /// Its size, in bytes.
    pub photo_bytes: u64,
    /// Its SHA-256, in hexadecimal.
    pub photo_sha256: String,
    /// What was seen.
    pub seen: TrackedFrame,
    /// The light decided upon; `None` before the decision, at the last step of a run, and where the plant was not believed
    /// for so long that nothing was decided.
    pub decided: Option<Light>,
    /// Whether the lamp was then lit.
    pub is_done: bool,
    /// When the step was really begun; `None` in the virtual tent.
    pub begun: Option<Moment>,
    /// The lamp that this photograph shows lit, `Some(None)` if none or both; `None` if that was not looked for.
    pub lit: Option<Option<Light>>,
}

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// SQLite's own error.
    #[error(transparent)]
    Sqlite(#[from] rusqlite::Error),
    /// A damaged file.
    #[error("found a damaged journal ({0}), wanted one that SQLite's quick_check passes")]
    Damaged(String),
    /// A value that cannot be one.
    #[error("step {step}: found {column} {found:?}, wanted {wanted}")]
    Value {
        /// Row.
        step: u32,
        /// Column.
        column: &'static str,
        /// What stands there.
        found: String,
        /// What should stand there.
        wanted: &'static str,
    },
    /// A schema that this version does not know.
    #[error("found journal schema {0}, wanted {SCHEMA}")]
    Schema(i64),
}

const SCHEMA: i64 = 4;

/// The oldest schema whose rows can still be read; a run of it cannot be gone on with.
const READABLE: i64 = 2;

/// What is written, by name, and what of a journal it is made of: the same values in the same order.
const WRITES: [(&str, &str, &str); 5] = [
    (
        "boot",
        "INSERT INTO boot (boot, start_s, wall_set) VALUES (?, ?, ?)",
        "SELECT boot, start_s, wall_set FROM boot ORDER BY id",
    ),
    (
        "saw",
        "INSERT OR REPLACE INTO steps (step, time_s, photo, photo_bytes, photo_sha256, tip_x_cm, tip_y_cm, tip_x_px,
             tip_y_px, quality, class, confidence, begun_s, unix_s, lit, moved_x_px, moved_y_px)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        "SELECT step, time_s, photo, photo_bytes, photo_sha256, tip_x_cm, tip_y_cm, tip_x_px,
             tip_y_px, quality, class, confidence, begun_s, unix_s, lit, moved_x_px, moved_y_px FROM steps ORDER BY step",
    ),
    (
        "decided",
        "UPDATE steps SET decided = ? WHERE step = ?",
        "SELECT decided, step FROM steps WHERE decided IS NOT NULL ORDER BY step",
    ),
    (
        "done",
        "UPDATE steps SET done = 1 WHERE step = ?",
        "SELECT step FROM steps WHERE done = 1 ORDER BY step",
    ),
    (
        "event",
        "INSERT INTO event (step, kind, text, since_start_s, unix_s) VALUES (?, ?, ?, ?, ?)",
        "SELECT step, kind, text, since_start_s, unix_s FROM event ORDER BY id",
    ),
];

/// An open journal.
#[derive(Debug)]
pub struct Journal {
    db: Connection,
    schema: i64,
    copy: Copy,
    restored: Option<String>,
}

impl Journal {
    /// Opens the journal at `path`, or makes one. One that is damaged or gone is made again from its copy, a `.jsonl`
    /// file beside it, if there is one.
    ///
    /// # Errors
    /// [`JournalError`] if the file is no journal, or damaged without a copy, or of another schema.
    pub fn open(path: &Path, durability: Durability) -> Result<Self, JournalError> {
        let is_gone = copy::is_left(path);
        let opened = match is_gone {
            true => Err(JournalError::Damaged("no such file".to_owned())),
            false => Self::at(path, durability),
        };
        let mut journal = match opened {
            Err(error) if error.is_damage() => {
                let Some(entries) = copy::restore(path, durability)? else { return Err(error) };
                let restored = Some(format!("{error}; made again from its copy, {entries} entries"));
                Self { restored, ..Self::at(path, durability)? }
            }
            other => other?,
        };
        journal.copy = Copy::of(path, &journal.entries()?);
        Ok(journal)
    }

    /// What was wrong with the journal and what was done about it, if it had to be made again.
    #[must_use]
    pub fn restored(&self) -> Option<&str> {
        self.restored.as_deref()
    }

    fn at(path: &Path, durability: Durability) -> Result<Self, JournalError> {
        let db = Connection::open(path)?;
        db.pragma_update(None, "journal_mode", "WAL")?;
        // FULL syncs the log at every commit; OFF leaves that to the system, which a killed program does not disturb.
        db.pragma_update(None, "synchronous", if durability == Durability::Full { "FULL" } else { "OFF" })?;
        let check: String = db.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
        if check != "ok" {
            return Err(JournalError::Damaged(check));
        }
        let schema: i64 = db.query_row("PRAGMA user_version", [], |row| row.get(0))?;
        match schema {
            SCHEMA => {}
            0 => db.execute_batch(&format!(
                "BEGIN;
                 CREATE TABLE steps (
                     step INTEGER PRIMARY KEY, time_s REAL NOT NULL,
                     photo TEXT NOT NULL, photo_bytes INTEGER NOT NULL, photo_sha256 TEXT NOT NULL,
                     tip_x_cm REAL, tip_y_cm REAL, tip_x_px REAL, tip_y_px REAL,
                     quality TEXT, class TEXT NOT NULL, confidence REAL NOT NULL,
                     decided TEXT, done INTEGER NOT NULL DEFAULT 0,
                     begun_s REAL, unix_s REAL, lit TEXT, moved_x_px REAL, moved_y_px REAL);
                 CREATE TABLE event (
                     id INTEGER PRIMARY KEY, step INTEGER NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL,
                     since_start_s REAL, unix_s REAL);
                 CREATE TABLE boot (
                     id INTEGER PRIMARY KEY, boot TEXT NOT NULL, start_s REAL NOT NULL, wall_set INTEGER NOT NULL);
                 PRAGMA user_version = {SCHEMA};
                 COMMIT;"
            ))?,
            other => return Err(JournalError::Schema(other)),
        }
        Ok(Self { db, schema: SCHEMA, copy: Copy::default(), restored: None })
    }

    /// Makes a new journal at `path` of `entries`.
    pub(super) fn make(
        path: &Path,
        durability: Durability,
        entries: &[(String, Vec<Value>)],
    ) -> Result<(), JournalError> {
        let journal = Self::at(path, durability)?;
        journal.db.execute_batch("BEGIN")?;
        for (name, values) in entries {
            journal.write(name, values)?;
        }
        Ok(journal.db.execute_batch("COMMIT")?)
    }

    /// All that it is made of.
    fn entries(&self) -> Result<Vec<(&'static str, Vec<Value>)>, JournalError> {
        let mut entries = Vec::new();
        for (name, _, select) in WRITES {
            let mut statement = self.db.prepare(select)?;
            let columns = statement.column_count();
            let mut found = statement.query([])?;
            while let Some(row) = found.next()? {
                entries.push((name, (0..columns).map(|column| row.get(column)).collect::<Result<_, _>>()?));
            }
        }
        Ok(entries)
    }

    fn write(&self, name: &str, values: &[Value]) -> Result<(), JournalError> {
        let Some((_, sql, _)) = WRITES.iter().find(|(known, ..)| *known == name) else {
            return Err(JournalError::Damaged(format!("an entry {name:?} in its copy")));
        };
        self.db.prepare_cached(sql)?.execute(params_from_iter(values))?;
        self.copy.add(name, values);
        Ok(())
    }

    /// Opens the journal at `path` to read its rows, also while a run writes them.
    ///
    /// # Errors
    /// [`JournalError`] if there is no journal, or none of this schema.
    pub fn open_to_read(path: &Path) -> Result<Self, JournalError> {
        let db = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
        match db.query_row("PRAGMA user_version", [], |row| row.get(0))? {
            schema @ READABLE..=SCHEMA => Ok(Self { db, schema, copy: Copy::default(), restored: None }),
            other => Err(JournalError::Schema(other)),
        }
    }

    /// Writes down that a program has taken the run up, and what its clock counts from.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn taken_up(&self, boot: &Boot) -> Result<(), JournalError> {
        self.write("boot", &[boot.id.clone().into(), boot.start_s.into(), boot.is_wall_set.into()])
    }

    /// What the clock of the program counted from that took the run up last; `None` of a virtual tent.
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

    /// The last sign of the run: the latest moment that stands in the journal.
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

    /// Writes down something that happened.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn happened(&self, event: &Event) -> Result<(), JournalError> {
        let values = [
            event.step.into(),
            event.kind.name().to_owned().into(),
            event.text.clone().into(),
            event.at.map(|at| at.since_start.as_secs_f64()).into(),
            event.at.map(|at| at.unix_s).into(),
        ];
        self.write("event", &values)
    }

    /// All that happened, in order. Nothing in a journal of a version before 3.
    ///
    /// # Errors
    /// [`JournalError`] names what cannot be read.
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
                return Err(JournalError::Value {
                    step,
                    column: "kind",
                    found: word,
                    wanted: "a kind of event",
                });
            };
            events.push(Event { step, kind, text: row.get(2)?, at: moment(row.get(3)?, row.get(4)?) });
        }
        Ok(events)
    }

    /// What the run is doing: the latest event that says so; `None` if it has not begun. A run that was killed still
    /// says that it has started or resumed.
    ///
    /// # Errors
    /// As [`Self::events`].
    pub fn state(&self) -> Result<Option<Event>, JournalError> {
        Ok(self.events()?.into_iter().rfind(|event| event.kind.is_state()))
    }

    /// Writes down a photograph that is safe on the disk, and what was seen in it.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn saw(&self, row: &Row) -> Result<(), JournalError> {
        let tip = row.seen.observation.as_ref();
        let text = |text: &str| Value::from(text.to_owned());
        let values = [
            row.step.into(),
            row.time_s.into(),
            text(&row.photo),
            (row.photo_bytes as i64).into(),
            text(&row.photo_sha256),
            tip.map(|seen| seen.tip.x).into(),
            tip.map(|seen| seen.tip.y).into(),
            row.seen.tip_px.map(|pixel| pixel.x).into(),
            row.seen.tip_px.map(|pixel| pixel.y).into(),
            tip.map(|seen| seen.quality.name().to_owned()).into(),
            text(row.seen.status.name()),
            row.seen.confidence.into(),
            row.begun.map(|begun| begun.since_start.as_secs_f64()).into(),
            row.begun.map(|begun| begun.unix_s).into(),
            row.lit.map(|lit| lamps::name(lit).to_owned()).into(),
            row.seen.camera_shift.map(|shift| shift.x).into(),
            row.seen.camera_shift.map(|shift| shift.y).into(),
        ];
        self.write("saw", &values)
    }

    /// Writes down the decision of a step, before it is acted upon.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn decided(&self, step: u32, light: Light) -> Result<(), JournalError> {
        self.write("decided", &[light.standard_name().to_owned().into(), step.into()])
    }

    /// Writes down that the decision of a step was acted upon.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn done(&self, step: u32) -> Result<(), JournalError> {
        self.write("done", &[step.into()])
    }

    /// All steps in order; those that were missed are not among them.
    ///
    /// # Errors
    /// [`JournalError`] names the step and the column that cannot be read.
    pub fn rows(&self) -> Result<Vec<Row>, JournalError> {
        let later = match self.schema {
            ..3 => "NULL, NULL, NULL, NULL, NULL",
            3 => "begun_s, unix_s, lit, NULL, NULL",
            _ => "begun_s, unix_s, lit, moved_x_px, moved_y_px",
        };
        let mut statement = self.db.prepare(&format!(
            "SELECT step, time_s, photo, photo_bytes, photo_sha256, tip_x_cm, tip_y_cm, tip_x_px, tip_y_px,
                    quality, class, decided, done, confidence, {later} FROM steps ORDER BY step",
        ))?;
        let mut found = statement.query([])?;
        let mut rows = Vec::new();
        while let Some(row) = found.next()? {
            let step: u32 = row.get(0)?;
            rows.push(Row {
                step,
                time_s: row.get(1)?,
                photo: row.get(2)?,
                photo_bytes: row.get::<_, i64>(3)? as u64,
                photo_sha256: row.get(4)?,
                seen: seen(step, row)?,
                decided: lamp(step, "decided", row.get(11)?)?.flatten(),
                is_done: row.get(12)?,
                begun: moment(row.get(14)?, row.get(15)?),
                lit: lamp(step, "lit", row.get(16)?)?,
            });
        }
        Ok(rows)
    }

    /// How many steps are recorded.
    ///
    /// # Errors
    /// [`JournalError::Sqlite`].
    pub fn count(&self) -> Result<u32, JournalError> {
        Ok(self.db.query_row("SELECT count(*) FROM steps", [], |row| row.get(0))?)
    }
}

impl JournalError {
    /// Whether the disk is full.
    #[must_use]
    pub fn is_disk_full(&self) -> bool {
        matches!(self, Self::Sqlite(error) if error.sqlite_error_code() == Some(ErrorCode::DiskFull))
    }

    /// Whether the file is no journal any more.
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

/// A moment of two columns, neither of which a virtual tent has.
fn moment(since_start_s: Option<f64>, unix_s: Option<f64>) -> Option<Moment> {
    let since_start = Duration::try_from_secs_f64(since_start_s?).ok()?;
    Some(Moment { since_start, unix_s: unix_s? })
}

fn lamp(
    step: u32,
    column: &'static str,
    word: Option<String>,
) -> Result<Option<Option<Light>>, JournalError> {
    let Some(word) = word else { return Ok(None) };
    let error = |_| JournalError::Value { step, column, found: word.clone(), wanted: "left, right or dark" };
    lamps::parse(&word).map(Some).map_err(error)
}

fn seen(step: u32, row: &rusqlite::Row<'_>) -> Result<TrackedFrame, JournalError> {
    let point = |x, y| -> Result<Option<[f64; 2]>, rusqlite::Error> {
        Ok(row.get::<_, Option<f64>>(x)?.zip(row.get::<_, Option<f64>>(y)?).map(|(x, y)| [x, y]))
    };
    let quality: Option<String> = row.get(9)?;
    let quality: Option<Quality> = match quality {
        None => None,
        Some(word) => Some(word.parse().map_err(|_| JournalError::Value {
            step,
            column: "quality",
            found: word,
            wanted: "measured, held or simulated",
        })?),
    };
    let class: String = row.get(10)?;
    let class: FrameStatus = class.parse().map_err(|_| JournalError::Value {
        step,
        column: "class",
        found: class,
        wanted: "a class of photograph",
    })?;
    let observation = point(5, 6)?.zip(quality).map(|(tip, quality)| Observation {
        tip: Point::from(tip),
        stem: None,
        quality,
    });
    let pixel = point(7, 8)?.map(|[x, y]| Pixel::new(x, y));
    let shift = point(17, 18)?.map(|[x, y]| Pixel::new(x, y));
    Ok(TrackedFrame {
        observation,
        tip_px: pixel,
        status: class,
        confidence: row.get(13)?,
        camera_shift: shift,
    })
}
