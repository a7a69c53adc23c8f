//! The run folder: `run.toml`, the journal, the photographs, and the track of a run that is over.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use tropism::lamps::Layout;
use tropism::lighting::Lighting;
use tropism::photo::Photo;
use tropism::programme::Acting;
use tropism::rig::{Durability, Event, EventKind};
use tropism::track::{Column, Track};
use tropism_rig::secret::{holds_secret, redacted_text};

use crate::files::{self, FileError};
use crate::journal::{Journal, JournalError, StepRecord, lights_that_acted};
use crate::lock::{FolderLock, LockError, lock};

/// An open run folder, locked against other programs.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    journal: Journal,
    damages: Vec<String>,
    durability: Durability,
    _lock: FolderLock,
}

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
    /// It holds a run that is over.
    #[error(
        "{path}: a run is here already, and it is over: choose a new folder, or write its track again by --resume"
    )]
    Taken {
        /// The folder.
        path: PathBuf,
    },
    /// It holds work of another kind.
    #[error("{}: other work is here ({record}): choose a new folder", path.display())]
    OtherWork {
        /// The folder.
        path: PathBuf,
        /// The record of the work.
        record: &'static str,
    },
    /// It holds a run of another configuration.
    #[error(
        "{path}: found a run that was started with other settings ({found:?}), wanted {wanted:?}; use another folder"
    )]
    OtherRun {
        /// Its configuration.
        path: PathBuf,
        /// The first line that differs, as it stands there.
        found: String,
        /// The same line as it is wanted now.
        wanted: String,
    },
    /// Photographs of steps that the journal does not have.
    #[error(
        "{path}: found this photograph, but the journal ends before step {next}: it has lost steps; wanted a whole journal. \
         Nothing was changed; use another folder, or bring back journal.sqlite or journal.jsonl"
    )]
    LostSteps {
        /// The first of them.
        path: PathBuf,
        /// The step after the last one of the journal.
        next: u32,
    },
    /// Another program works in it.
    #[error(transparent)]
    Lock(#[from] LockError),
}

/// The records of work of all kinds.
pub(crate) const RECORDS: [&str; 11] = [
    "run.toml",
    "study.toml",
    "sweep.toml",
    "evolution.toml",
    "transfer.toml",
    "replicates.toml",
    "walls.toml",
    "forecast.toml",
    "calibrate.toml",
    "baseline.toml",
    "grow.toml",
];

/// Checks that a folder without the record `own` has none of another kind of work: the two would hide each other.
///
/// # Errors
/// [`FolderError::OtherWork`].
pub(crate) fn check_no_other_work(folder: &Path, own: &str) -> Result<(), FolderError> {
    let is_here = |record: &&str| folder.join(record).exists();
    match RECORDS.iter().find(|record| is_here(record)) {
        Some(record) if !is_here(&own) => Err(FolderError::OtherWork { path: folder.to_owned(), record }),
        _ => Ok(()),
    }
}

impl FolderError {
    /// Whether the folder belongs to another run or another program: nothing is wrong with it, and it was left as it is.
    #[must_use]
    pub const fn is_refusal(&self) -> bool {
        matches!(
            self,
            Self::Taken { .. }
                | Self::OtherWork { .. }
                | Self::OtherRun { .. }
                | Self::LostSteps { .. }
                | Self::Lock(LockError::InUse { .. })
        )
    }
}

impl RunFolder {
    /// Creates the run folder at `path`, or opens the one that is there if its `run.toml` has the text `config`; one whose
    /// run is over only with `is_resumed`.
    ///
    /// # Errors
    /// [`FolderError`]. Files that were there are unchanged.
    pub fn open(
        path: &Path,
        config: &str,
        durability: Durability,
        is_resumed: bool,
    ) -> Result<Self, FolderError> {
        let config_path = path.join("run.toml");
        check_no_other_work(path, "run.toml")?;
        files::make_folder(&path.join("photographs"))?;
        let lock = lock(path)?;
        let journal_path = path.join("journal.sqlite");
        let at = |source| FolderError::Journal { path: journal_path.clone(), source };
        let found = config_path.exists().then(|| files::read_text(&config_path));
        let is_same = matches!(&found, Some(Ok(text)) if text == config);
        // The journal has the settings with which it began: they decide, whatever became of the file.
        let (recorded, next) = match Journal::find(&journal_path).map_err(at)? {
            Some(journal) => (journal.settings().map_err(at)?, journal.next_step().map_err(at)?),
            None => (None, 0),
        };
        let is_recorded = recorded.is_some();
        let known = match recorded {
            Some(recorded) => Some(recorded),
            None => found.transpose()?,
        };
        if let Some(found) = known.filter(|known| known != config) {
            let (found, wanted) = first_difference(&found, config);
            let [found, wanted] = [found, wanted].map(|line| redacted_text(&line).into_owned());
            return Err(FolderError::OtherRun { path: config_path, found, wanted });
        }
        if let Some(photograph) = later_photograph(path, next)? {
            return Err(FolderError::LostSteps { path: photograph, next });
        }
        let write_config = || files::write_settings(&config_path, config, durability == Durability::Full);
        let mut damages = Vec::new();
        if !is_same && !is_recorded {
            // First of all: a folder with a journal has its settings.
            write_config()?;
        }
        let journal = Journal::open(&journal_path, durability, config).map_err(at)?;
        if !is_same && is_recorded {
            damages.push(set_aside(&config_path)?);
            write_config()?;
        }
        if holds_secret(config) {
            // They hold the settings, too.
            for name in ["journal.sqlite", "journal.sqlite-wal", "journal.jsonl"] {
                files::make_private(&path.join(name))?;
            }
        }
        damages.extend(journal.restored().map(|damage| format!("journal.sqlite: {damage}")));
        let is_over = journal.state().map_err(at)?.is_some_and(|state| state.kind == EventKind::Finished);
        if is_over && !is_resumed {
            return Err(FolderError::Taken { path: path.to_owned() });
        }
        if durability == Durability::Full {
            // SQLite syncs the content of its files; the folder holds their names.
            files::sync_folder(path)?;
        }
        Ok(Self { path: path.to_owned(), journal, damages, durability, _lock: lock })
    }

    /// Path of the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The journal.
    #[must_use]
    pub const fn journal(&self) -> &Journal {
        &self.journal
    }

    /// What was damaged when the folder was opened, and was made again.
    #[must_use]
    pub fn damages(&self) -> &[String] {
        &self.damages
    }

    /// Reads all recorded steps.
    ///
    /// # Errors
    /// [`FolderError::Journal`].
    pub fn steps(&self) -> Result<Vec<StepRecord>, FolderError> {
        self.journal
            .steps()
            .map_err(|source| FolderError::Journal { path: self.path.join("journal.sqlite"), source })
    }

    /// Writes a photograph: it is whole in its place, or not there at all. Another one of this name, which a program left
    /// that was killed before it recorded the step, is moved to `unrecorded/`.
    ///
    /// # Errors
    /// [`FileError::Disk`].
    pub fn write_photo(&self, view: PhotoFolder, name: &str, bytes: &[u8]) -> Result<(), FileError> {
        let path = photo_path(&self.path, view, name);
        if path.is_file() {
            if files::read(&path).is_ok_and(|found| found == bytes) {
                return Ok(());
            }
            let folder = self.path.join("unrecorded").join(view.unrecorded());
            files::make_folder(&folder)?;
            files::move_aside(&path, &folder.join(name))?;
        } else if view == PhotoFolder::Side {
            files::make_folder(&self.path.join(view.name()))?;
        }
        files::write_with(&path, bytes, self.durability == Durability::Full)
    }

    /// Reads the photograph of a recorded step.
    ///
    /// # Errors
    /// [`FileError`] if it is missing, or its SHA-256 is not the recorded one.
    pub fn read_photo(&self, step: &StepRecord) -> Result<Photo, FileError> {
        read_photo(&self.path, step)
    }

    /// Reads the photograph of the camera at the side of a recorded step; without bytes where there was none.
    ///
    /// # Errors
    /// As [`Self::read_photo`].
    pub fn read_side_photo(&self, step: &StepRecord) -> Result<Photo, FileError> {
        let recorded = step.side.as_deref().map_or((0, ""), |side| (side.photo_bytes, &*side.photo_sha256));
        read_recorded(&self.path, PhotoFolder::Side, step, recorded)
    }

    fn reserve_path(&self) -> PathBuf {
        self.path.join("reserve")
    }

    /// Reserves `megabytes` of the disk in a file that is deleted when the disk is full, unless they are reserved already.
    ///
    /// # Errors
    /// [`FileError::Disk`]; then nothing is reserved.
    pub fn fill_reserve(&self, megabytes: u32) -> Result<(), FileError> {
        let (path, size) = (self.reserve_path(), u64::from(megabytes) << 20);
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
            self.release_reserve();
            FileError::Disk { action: "keep room for the journal in", path: path.clone(), source }
        })
    }

    /// Deletes the reserve; false if there was none.
    pub fn release_reserve(&self) -> bool {
        std::fs::remove_file(self.reserve_path()).is_ok()
    }

    /// Free bytes on the disk of the folder; `None` if the system does not tell.
    #[must_use]
    pub fn free_bytes(&self) -> Option<u64> {
        files::free_bytes(&self.path).ok()
    }

    /// Writes `track.csv`: `track` with the photograph of each step and the pixel of the tip in it. The light of a row is the
    /// one that acted: `dark` where the lamp did not confirm it, or where the next photograph shows another one. Then a
    /// further column says what was decided. Where the rig has a programme, three columns say what of it acted. The stems that
    /// were seen stand in further columns: models of the stem are fitted to them, and a task with obstacles is scored by them.
    ///
    /// Returns the track as it is written, without the further columns.
    ///
    /// # Errors
    /// [`FolderError`].
    pub fn write_track(&self, track: &Track) -> Result<Track, FolderError> {
        // Steps without a decision are recorded, but are gaps in the track.
        let mut in_track = track.samples.iter().map(|sample| sample.step).peekable();
        let steps = self.steps()?;
        let acted = lights_that_acted(&steps);
        let (steps, acted): (Vec<StepRecord>, Vec<Lighting>) = steps
            .into_iter()
            .zip(acted)
            .filter(|(step, _)| in_track.next_if_eq(&step.step).is_some())
            .unzip();
        let column = |name: &str, value: &dyn Fn(&StepRecord) -> String| {
            Column::parsed(name, steps.iter().map(value).collect())
        };
        let mut acting = track.clone();
        for (sample, lighting) in acting.samples.iter_mut().zip(&acted) {
            if sample.lighting() != Lighting::DARK {
                sample.set_lighting(*lighting);
            }
        }
        let mut written = acting.clone();
        written.columns = vec![
            column("frame", &|step| step.photo.clone()),
            column("tip_x_px", &|step| tip_px(step)[0].clone()),
            column("tip_y_px", &|step| tip_px(step)[1].clone()),
            column("class", &|step| step.seen.status.to_string()),
        ];
        if acting.samples != track.samples {
            let names = track.samples.iter().map(|sample| sample.lighting().word(&track.layout));
            written.columns.push(Column::text("decided", names.collect()));
        }
        written.columns.extend(programme_columns(steps.iter(), &track.layout));
        if written.samples.iter().any(|sample| sample.stem.is_some() || sample.depth.is_some()) {
            written.add_stem_columns();
        }
        files::write_track(&self.path.join("track.csv"), &written)?;
        Ok(acting)
    }
}

/// What of a programme acted at each of `steps`: the number of its part, whether the controller steered, and the base light. No
/// columns for a run without a programme.
pub(crate) fn programme_columns<'s>(
    steps: impl Iterator<Item = &'s StepRecord> + Clone,
    layout: &Layout,
) -> Vec<Column> {
    if steps.clone().all(|step| step.programme.is_none()) {
        return Vec::new();
    }
    let column = |name: &str, value: &dyn Fn(Acting) -> String| {
        let cell = |step: &StepRecord| step.programme.map_or_else(String::new, |found| value(found.acting));
        Column::parsed(name, steps.clone().map(cell).collect())
    };
    vec![
        column("part", &|acting| acting.part.to_string()),
        column("steered", &|acting| u8::from(acting.is_steered).to_string()),
        column("base", &|acting| acting.base.word(layout)),
    ]
}

/// The first of several photographs of `next` or later steps in the run folder at `path`: the journal has lost their steps.
/// A single one is what a program leaves that was killed between the photograph and its entry.
fn later_photograph(path: &Path, next: u32) -> Result<Option<PathBuf>, FileError> {
    let folder = path.join("photographs");
    let mut later = Vec::new();
    for ending in ["jpg", "png"] {
        later.extend(files::list(&folder, ending)?.into_iter().filter(|file| {
            let number = file.file_stem().and_then(|stem| stem.to_str()?.parse::<u32>().ok());
            number.is_some_and(|step| step >= next)
        }));
    }
    later.sort_unstable();
    Ok(if later.len() > 1 { later.into_iter().next() } else { None })
}

/// Keeps a damaged `run.toml` aside, and says so.
fn set_aside(config_path: &Path) -> Result<String, FileError> {
    if !config_path.exists() {
        return Ok("run.toml: no such file; made again from the journal".to_owned());
    }
    let kept = files::move_aside(config_path, &config_path.with_extension("broken.toml"))?;
    let name = kept.file_name().unwrap_or_default().to_string_lossy();
    Ok(format!("run.toml: it is not what the journal holds; made again, and kept as {name}"))
}

/// The folder of a camera's photographs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotoFolder {
    /// `photographs`, of the camera in front.
    Front,
    /// `side`, of the camera at the side.
    Side,
}

impl PhotoFolder {
    const fn name(self) -> &'static str {
        match self {
            Self::Front => "photographs",
            Self::Side => "side",
        }
    }

    /// Where in `unrecorded` its photographs go.
    const fn unrecorded(self) -> &'static str {
        match self {
            Self::Front => "",
            Self::Side => "side",
        }
    }
}

fn photo_path(folder: &Path, view: PhotoFolder, name: &str) -> PathBuf {
    folder.join(view.name()).join(name)
}

/// Reads the photograph of a recorded step of the run in `folder`: [`RunFolder::read_photo`] without opening the folder.
pub(crate) fn read_photo(folder: &Path, step: &StepRecord) -> Result<Photo, FileError> {
    read_recorded(folder, PhotoFolder::Front, step, (step.photo_bytes, &step.photo_sha256))
}

/// The photograph of a step by the camera of `view`, of which the journal says the number of bytes and the SHA-256.
fn read_recorded(
    folder: &Path,
    view: PhotoFolder,
    step: &StepRecord,
    (bytes, sha256): (u64, &str),
) -> Result<Photo, FileError> {
    if bytes == 0 {
        return Ok(Photo { name: step.photo.clone(), bytes: Vec::new(), time_s: step.time_s });
    }
    let path = photo_path(folder, view, &step.photo);
    let photo = files::read_photo(&path, step.time_s)?;
    let found = files::sha256(&photo.bytes);
    if found == sha256 {
        return Ok(photo);
    }
    let problem = format!(
        "found {} bytes with SHA-256 {found}, wanted {bytes} with {sha256}, as the journal says",
        photo.bytes.len()
    );
    Err(FileError::content(&path, problem))
}

/// Reads the steps and events of the run in `folder`, also while a program works in it.
///
/// # Errors
/// [`FolderError::Journal`] if the journal cannot be read.
pub fn read_journal(folder: &Path) -> Result<(Vec<StepRecord>, Vec<Event>), FolderError> {
    let path = folder.join("journal.sqlite");
    Journal::open_to_read(&path)
        .and_then(|journal| Ok((journal.steps()?, journal.events()?)))
        .map_err(|source| FolderError::Journal { path, source })
}

/// Whether the folder of a run has its journal, or the journal's mirror. An export has neither, nor has a plant that `grow`
/// photographed.
#[must_use]
pub fn has_journal(folder: &Path) -> bool {
    ["journal.sqlite", "journal.jsonl"].iter().any(|name| folder.join(name).exists())
}

/// Pixel of the tip as text; empty if it was not measured in this photograph, as a tip carried forward is not in it.
pub(crate) fn tip_px(step: &StepRecord) -> [String; 2] {
    match step.seen.tip_px.filter(|_| step.seen.is_measured()) {
        Some(pixel) => [pixel.x, pixel.y].map(|value| format!("{value:.2}")),
        None => Default::default(),
    }
}

/// The first line in which two texts differ.
fn first_difference(found: &str, wanted: &str) -> (String, String) {
    let end = "the end of the file";
    let (mut found, mut wanted) = (found.lines(), wanted.lines());
    loop {
        match (found.next(), wanted.next()) {
            (Some(a), Some(b)) if a == b => {}
            (a, b) => return (a.unwrap_or(end).to_owned(), b.unwrap_or(end).to_owned()),
        }
    }
}
