//! The folder of a run.

use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::files::{self, FileError};
use crate::journal::{Journal, JournalError, Row};
use tropism::observation::Quality;
use tropism::photo::Photo;
use tropism::rig::Durability;
use tropism::rig::EventKind;
use tropism::track::{Column, Track};

/// An open run folder. Only one program at a time has it.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    journal: Journal,
    durability: Durability,
    _lock: File,
}

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file in it.
    #[error(transparent)]
    File(#[from] FileError),
    /// Its journal.
    #[error("{path}: {source}")]
    Journal {
        /// The journal.
        path: PathBuf,
        /// What is wrong.
        source: JournalError,
    },
    /// A run that is over is there already.
    #[error(
        "{path}: found a run here already, and it is over; wanted a new folder (or --resume to write its track again)"
    )]
    Taken {
        /// The folder.
        path: PathBuf,
    },
    /// The run there was started otherwise.
    #[error(
        "{path}: found a run that was started with other settings ({found:?}), wanted {wanted:?}; use another folder"
    )]
    OtherRun {
        /// Its configuration.
        path: PathBuf,
        /// The first line that differs, there.
        found: String,
        /// The same line as asked for now.
        wanted: String,
    },
    /// The run there was started by an older version.
    #[error(
        "{path}: found a run of {found}, wanted {wanted}; finish it with the version that began it, or use another folder"
    )]
    OldSchema {
        /// Its configuration.
        path: PathBuf,
        /// Its schema.
        found: &'static str,
        /// The schema of this version.
        wanted: &'static str,
    },
    /// Another program has it.
    #[error("{path}: found the run in use by another program{}, wanted it free", named(*process))]
    InUse {
        /// The folder.
        path: PathBuf,
        /// Number of the program, if it has said so already.
        process: Option<u32>,
    },
}

impl FolderError {
    /// Whether the folder is another run's or another program's: nothing is wrong with it.
    #[must_use]
    pub const fn is_refusal(&self) -> bool {
        matches!(
            self,
            Self::Taken { .. } | Self::OtherRun { .. } | Self::OldSchema { .. } | Self::InUse { .. }
        )
    }
}

impl RunFolder {
    /// Makes the run folder at `path`, or opens the one that is there if its configuration is `run`; one whose run is over
    /// only with `is_resumed`.
    ///
    /// `run` is the text of `run.toml`: all that decides the run's outcome.
    ///
    /// # Errors
    /// [`FolderError`]. Nothing that was there is changed.
    pub fn open(
        path: &Path,
        run: &str,
        durability: Durability,
        is_resumed: bool,
    ) -> Result<Self, FolderError> {
        let config = path.join("run.toml");
        let is_there = config.exists();
        files::make_folder(&path.join("photographs"))?;
        let lock = lock(path)?;
        if is_there {
            let there = files::read_text(&config)?;
            if there != run {
                let (found, wanted) = first_difference(&there, run);
                return Err(FolderError::OtherRun { path: config, found, wanted });
            }
        } else {
            files::write_with(&config, run.as_bytes(), durability == Durability::Full)?;
        }
        let file = path.join("journal.sqlite");
        let named = |source| FolderError::Journal { path: file.clone(), source };
        let journal = Journal::open(&file, durability).map_err(named)?;
        let is_over = journal.state().map_err(named)?.is_some_and(|state| state.kind == EventKind::Finished);
        if is_over && !is_resumed {
            return Err(FolderError::Taken { path: path.to_owned() });
        }
        if durability == Durability::Full {
            // SQLite syncs what is in its files, this their names.
            files::sync_folder(path)?;
        }
        Ok(Self { path: path.to_owned(), journal, durability, _lock: lock })
    }

    /// Where the folder is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The journal.
    #[must_use]
    pub const fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Keeps a photograph: it is whole in its place, or not there at all.
    ///
    /// # Errors
    /// [`FileError::Disk`].
    pub fn keep_photo(&self, name: &str, bytes: &[u8]) -> Result<(), FileError> {
        files::write_with(
            &self.path.join("photographs").join(name),
            bytes,
            self.durability == Durability::Full,
        )
    }

    /// The photograph of a recorded step.
    ///
    /// # Errors
    /// [`FileError`] if it is gone, or not what was kept.
    pub fn photo(&self, row: &Row) -> Result<Photo, FileError> {
        let path = self.path.join("photographs").join(&row.photo);
        let photo = files::read_photo(&path, row.time_s)?;
        let found = files::sha256(&photo.bytes);
        if found != row.photo_sha256 {
            let problem = format!(
                "found {} bytes with SHA-256 {found}, wanted {} with {}",
                photo.bytes.len(),
                row.photo_bytes,
                row.photo_sha256
            );
            return Err(FileError::Content { path, problem });
        }
        Ok(photo)
    }

    fn ballast(&self) -> PathBuf {
        self.path.join("ballast")
    }

    /// Takes so many megabytes of the disk that can be given up when it is full, unless they are taken already.
    ///
    /// # Errors
    /// [`FileError::Disk`]; then nothing is taken.
    pub fn make_ballast(&self, megabytes: u32) -> Result<(), FileError> {
        let (path, size) = (self.ballast(), u64::from(megabytes) << 20);
        if size == 0 || path.metadata().is_ok_and(|there| there.len() == size) {
            return Ok(());
        }
        let fill = || {
            let mut file = File::create(&path)?;
            for _ in 0..megabytes {
                file.write_all(&[0; 1 << 20])?;
            }
            file.sync_all()
        };
        fill().map_err(|source| {
            self.drop_ballast();
            FileError::Disk { action: "keep room for the journal in", path: path.clone(), source }
        })
    }

    /// Gives the ballast up; false if there was none.
    pub fn drop_ballast(&self) -> bool {
        std::fs::remove_file(self.ballast()).is_ok()
    }

    /// How much room its disk has left; `None` where the system does not say.
    #[must_use]
    pub fn free_bytes(&self) -> Option<u64> {
        files::free_bytes(&self.path).ok()
    }

    /// All recorded steps.
    ///
    /// # Errors
    /// [`FolderError::Journal`].
    pub fn rows(&self) -> Result<Vec<Row>, FolderError> {
        self.journal
            .rows()
            .map_err(|source| FolderError::Journal { path: self.path.join("journal.sqlite"), source })
    }

    /// Writes `track.csv`: `track` with the photograph of each step and the place of the tip in it.
    ///
    /// # Errors
    /// [`FolderError`].
    pub fn write_track(&self, track: &Track) -> Result<(), FolderError> {
        // A step at which nothing was decided is a gap in the track.
        let mut samples = track.samples.iter().map(|sample| sample.step).peekable();
        let mut rows = self.rows()?;
        rows.retain(|row| samples.next_if_eq(&row.step).is_some());
        let mut track = track.clone();
        let text = |name: &str, value: &dyn Fn(&Row) -> String| {
            Column::parsed(name, rows.iter().map(value).collect())
        };
        // A held tip is not in this photograph: it has no place there.
        let place = |row: &Row, axis: usize| {
            let is_measured =
                row.seen.observation.as_ref().is_some_and(|seen| seen.quality == Quality::Measured);
            let pixel = row.seen.tip_px.filter(|_| is_measured);
            pixel.map_or_else(String::new, |pixel| format!("{:.2}", [pixel.x, pixel.y][axis]))
        };
        track.columns = vec![
            text("frame", &|row| row.photo.clone()),
            text("tip_x_px", &|row| place(row, 0)),
            text("tip_y_px", &|row| place(row, 1)),
            text("class", &|row| row.seen.status.to_string()),
        ];
        Ok(files::write_track(&self.path.join("track.csv"), &track)?)
    }
}

/// How often a taken lock is asked for again, and how long after: whoever only looks who has it holds it for an instant.
const LOOKS: (u32, Duration) = (10, Duration::from_millis(10));

/// Keeps other programs out of the folder at `path` until it is dropped. The file `run.lock` there then holds the number
/// of this process.
///
/// # Errors
/// [`FolderError::InUse`] if another program keeps it already.
pub fn lock(path: &Path) -> Result<File, FolderError> {
    let name = path.join("run.lock");
    let disk = |source| FileError::Disk { action: "lock", path: name.clone(), source };
    // What is in it stays until it is ours: the number of the program that has it.
    let options = File::options().read(true).write(true).create(true).truncate(false).open(&name);
    let mut file = options.map_err(disk)?;
    for _ in 0..LOOKS.0 {
        match file.try_lock() {
            Ok(()) => {
                file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id())).map_err(disk)?;
                return Ok(file);
            }
            Err(TryLockError::WouldBlock) => std::thread::sleep(LOOKS.1),
            Err(TryLockError::Error(source)) => return Err(disk(source).into()),
        }
    }
    Err(FolderError::InUse { path: path.to_owned(), process: number_in(&name) })
}

/// The number of the process that keeps the folder at `path` to itself; `None` if nobody does.
///
/// # Errors
/// [`FileError`] if its lock cannot be read, or is held without a number.
pub fn holder(path: &Path) -> Result<Option<u32>, FileError> {
    let name = path.join("run.lock");
    let disk = |source| FileError::Disk { action: "read", path: name.clone(), source };
    let file = match File::open(&name) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(disk(error)),
    };
    for _ in 0..LOOKS.0 {
        match file.try_lock_shared() {
            Ok(()) => return Ok(None),
            Err(TryLockError::Error(source)) => return Err(disk(source)),
            Err(TryLockError::WouldBlock) => {}
        }
        if let Some(process) = number_in(&name) {
            return Ok(Some(process));
        }
        // It has just taken the lock.
        std::thread::sleep(LOOKS.1);
    }
    let problem = "found it locked without the number of a process, wanted one".to_owned();
    Err(FileError::Content { path: name, problem })
}

fn number_in(lock: &Path) -> Option<u32> {
    std::fs::read_to_string(lock).ok()?.trim().parse().ok()
}

fn named(process: Option<u32>) -> String {
    process.map_or_else(String::new, |process| format!(" (process {process})"))
}

fn first_difference(there: &str, here: &str) -> (String, String) {
    let end = "the end of the file";
    let (mut there, mut here) = (there.lines(), here.lines());
    loop {
        match (there.next(), here.next()) {
            (Some(a), Some(b)) if a == b => {}
            (a, b) => return (a.unwrap_or(end).to_owned(), b.unwrap_or(end).to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_says_who_has_it() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(holder(folder.path()).unwrap(), None, "no lock at all");
        let held = lock(folder.path()).unwrap();
        assert_eq!(holder(folder.path()).unwrap(), Some(std::process::id()));
        let error = lock(folder.path()).unwrap_err().to_string();
        assert!(error.contains(&format!("(process {})", std::process::id())), "{error}");
        assert_eq!(holder(folder.path()).unwrap(), Some(std::process::id()), "a refusal leaves the number");
        drop(held);
        assert_eq!(holder(folder.path()).unwrap(), None);
        drop(lock(folder.path()).unwrap());
    }

    #[test]
    fn who_looks_keeps_nobody_out() {
        let folder = tempfile::tempdir().unwrap();
        drop(lock(folder.path()).unwrap());
        let looking = File::open(folder.path().join("run.lock")).unwrap();
        looking.lock_shared().unwrap();
        std::thread::scope(|scope| {
            let locked = scope.spawn(|| lock(folder.path()).map(drop));
            std::thread::sleep(Duration::from_millis(20));
            looking.unlock().unwrap();
            locked.join().unwrap().unwrap();
        });
    }
}
