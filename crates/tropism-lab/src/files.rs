//! Files in and out, with errors that name the file.

mod film;
mod pages;
mod photographs;

use std::collections::HashMap;
use std::error::Error;
use std::ffi::OsStr;
use std::fs;
use std::io::{BufReader, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use tropism::lamps::Layout;
use tropism::photo::{ExifHeader, Photo};
use tropism::text::plain;
use tropism::track::Track;
use tropism_rig::file::RigFile;
use tropism_rig::secret::{holds_secret, redacted_text};

pub use self::photographs::{PhotographList, list_photographs};

/// A file that could not be read or written, or does not hold what it should.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The system refused.
    #[error("{path}: cannot {action}: {source}")]
    Disk {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The content could not be parsed.
    #[error("{path}: {}", source.to_string().trim_end())]
    Parse {
        /// The file.
        path: PathBuf,
        /// What the parser says; a [`TomlError`] for TOML.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The content is not what it should be.
    #[error("{path}: {problem}")]
    Content {
        /// The file.
        path: PathBuf,
        /// What was found, and what was wanted.
        problem: String,
    },
}

impl FileError {
    /// The content of the file at `path` is not what it should be.
    pub fn content(path: &Path, problem: impl Into<String>) -> Self {
        Self::Content { path: path.to_owned(), problem: problem.into() }
    }

    /// Whether the disk is full, or the quota of its user.
    #[must_use]
    pub fn is_disk_full(&self) -> bool {
        use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        matches!(self, Self::Disk { source, .. } if [FileTooLarge, QuotaExceeded, StorageFull].contains(&source.kind()))
    }
}

/// A TOML error in one line: the number of the line, what stands there, and what is wrong with it.
#[derive(Debug, thiserror::Error)]
#[error("{line}")]
pub struct TomlError {
    line: String,
    /// The parser's own error, which shows the place by arrows over several lines.
    pub error: toml::de::Error,
}

impl TomlError {
    fn new(text: &str, error: toml::de::Error) -> Self {
        let mut message = error.message().trim().replace('\n', "; ");
        if let Some((_, place)) = MISPLACED.iter().find(|(key, _)| message.starts_with(key)) {
            message = format!("{place}; {message}");
        }
        let line = match error.span().and_then(|span| text.get(..span.start)) {
            None => message,
            Some(before) => {
                let line = before.matches('\n').count();
                let found = shortened(&redacted_text(text.lines().nth(line).unwrap_or_default().trim()));
                format!("line {}: found {found:?}: {}", line + 1, redacted_text(&message))
            }
        };
        Self { line, error }
    }
}

/// Keys that people write where other programs have them, and where they stand here.
const MISPLACED: [(&str, &str); 1] =
    [("unknown field `neat`", "the parameters of NEAT stand in the table [evolution.neat]")];

/// The most characters of a line that are printed of it: a longer one is hardly a setting, but another kind of file.
const MOST_OF_LINE: usize = 200;

/// A line, or its begin and an ellipsis.
pub(crate) fn shortened(line: &str) -> String {
    match line.char_indices().nth(MOST_OF_LINE) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line.to_owned(),
    }
}

/// Wraps what the system says to an `action` on the file `path`.
pub(crate) fn disk(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> FileError {
    move |source| FileError::Disk { action, path: path.to_owned(), source }
}

fn parse<E: Error + Send + Sync + 'static>(path: &Path) -> impl FnOnce(E) -> FileError {
    move |error| FileError::Parse { path: path.to_owned(), source: Box::new(error) }
}

/// Free bytes on the disk of `path`, as far as its user may have them.
///
/// # Errors
/// What the system says if it does not tell.
#[cfg(unix)]
pub fn free_bytes(path: &Path) -> std::io::Result<u64> {
    let disk = rustix::fs::statvfs(path)?;
    Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
}

/// Free bytes on the disk of `path`.
///
/// # Errors
/// Always, on a system that does not tell.
#[cfg(not(unix))]
pub fn free_bytes(_path: &Path) -> std::io::Result<u64> {
    let wanted = "wanted a system that reports free space";
    Err(std::io::Error::new(std::io::ErrorKind::Unsupported, wanted))
}

/// Seconds since a file was written; 0 if the clock was set back since, `None` if there is no such file.
pub(crate) fn age_s(path: &Path) -> Option<f64> {
    let written = fs::metadata(path).and_then(|about| about.modified()).ok()?;
    Some(SystemTime::now().duration_since(written).unwrap_or_default().as_secs_f64())
}

/// Removes a file; one that is not there is removed already.
pub(crate) fn remove(path: &Path) -> Result<(), FileError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        done => done.map_err(disk("remove", path)),
    }
}

/// Syncs a folder: the names of its files are then on the disk.
///
/// # Errors
/// [`FileError::Disk`].
pub fn sync_folder(path: &Path) -> Result<(), FileError> {
    sync_names(path).map_err(disk("sync", path))
}

/// Syncs the names of the files in a folder.
pub(crate) fn sync_names(path: &Path) -> std::io::Result<()> {
    // Other systems cannot open folders, and need not sync them.
    if cfg!(not(unix)) {
        return Ok(());
    }
    fs::File::open(path)?.sync_all()
}

/// Reads the bytes of a file.
///
/// # Errors
/// [`FileError::Disk`].
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    check_regular(path)?;
    fs::read(path).map_err(disk("read", path))
}

/// The most bytes of a file that is read whole: chosen, far above a track of five million rows.
const MOST_BYTES: u64 = 2 << 30;

/// Checks that `path` is a file of a size that can be read: a pipe would be waited for without end, and a device has none.
fn check_regular(path: &Path) -> Result<(), FileError> {
    let about = fs::metadata(path).map_err(disk("read", path))?;
    if about.is_dir() {
        return Err(FileError::content(path, "this is a folder: name a file"));
    }
    if !about.is_file() {
        return Err(FileError::content(path, "this is a pipe, a socket or a device: name a file"));
    }
    if about.len() > MOST_BYTES {
        let problem = format!("found {} bytes, wanted at most {MOST_BYTES}", about.len());
        return Err(FileError::content(path, problem));
    }
    Ok(())
}

/// Reads the text of a file.
///
/// # Errors
/// [`FileError`]; text that is not UTF-8 is an error.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    String::from_utf8(read(path)?).map_err(|error| {
        let byte = error.utf8_error().valid_up_to() + 1;
        FileError::content(
            path,
            format!("found a byte that is no text (UTF-8) at place {byte}, wanted a text file"),
        )
    })
}

/// Reads the text of a file and parses it.
///
/// # Errors
/// [`FileError`] with the error of `parser` and the name of the file.
pub fn read_as<T, E: Error + Send + Sync + 'static>(
    path: &Path,
    parser: impl FnOnce(&str) -> Result<T, E>,
) -> Result<T, FileError> {
    parser(&read_text(path)?).map_err(parse(path))
}

/// Reads a TOML file.
///
/// # Errors
/// [`FileError`] in one line, as [`TomlError`] has it.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, FileError> {
    parse_toml(path, &read_text(path)?)
}

/// Parses the text of the TOML file at `path`.
///
/// # Errors
/// As [`read_toml`].
pub(crate) fn parse_toml<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T, FileError> {
    check_settings_size(path, text)?;
    toml::from_str(text).map_err(|error| parse(path)(TomlError::new(text, error)))
}

/// The largest file of settings, in bytes. Chosen: far more than anybody writes; reading takes fifty times as much memory.
const MOST_TOML_BYTES: usize = 4 << 20;

fn check_settings_size(path: &Path, text: &str) -> Result<(), FileError> {
    if text.len() <= MOST_TOML_BYTES {
        return Ok(());
    }
    let found = format!("found {} bytes of settings, wanted at most {MOST_TOML_BYTES}", text.len());
    Err(FileError::content(path, found))
}

/// The most faults of one file that are reported at once.
const MOST_FAULTS: usize = 20;

/// Everything that [`read_toml`] finds wrong in the text of the TOML file at `path`: each line or table that is refused is left
/// out in turn, and the rest is read again. What is missing is reported only if nothing else is wrong.
pub(crate) fn toml_faults<T: DeserializeOwned>(path: &Path, text: &str) -> Vec<FileError> {
    if let Err(error) = check_settings_size(path, text) {
        return vec![error];
    }
    let mut rest = text.to_owned();
    let mut faults = Vec::new();
    while let Err(error) = toml::from_str::<T>(&rest) {
        // What is missing may be missing because it was left out.
        let is_missing = error.message().starts_with("missing field");
        let refused = error.span().filter(|_| !is_missing).and_then(|span| refused_part(&rest, span.start));
        if faults.is_empty() || refused.is_some() {
            faults.push(parse(path)(TomlError::new(&rest, error)));
        }
        let Some(refused) = refused.filter(|_| faults.len() < MOST_FAULTS) else { break };
        // The numbers of the lines after it stay.
        let feeds = "\n".repeat(rest[refused.clone()].matches('\n').count());
        rest.replace_range(refused, &feeds);
    }
    faults
}

/// The line of a setting around the byte `at`, or the table whose header stands there; `None` of another line.
fn refused_part(text: &str, at: usize) -> Option<Range<usize>> {
    let begin = text.get(..at)?.rfind('\n').map_or(0, |feed| feed + 1);
    let end = text[at..].find('\n').map_or(text.len(), |feed| at + feed);
    let line = text[begin..end].trim_start();
    if line.starts_with('[') {
        return Some(begin..text[end..].find("\n[").map_or(text.len(), |feed| end + feed));
    }
    line.contains('=').then_some(begin..end)
}

/// The most rows of a track: nine years of a photograph in five minutes.
const MOST_ROWS: usize = 1_000_000;

/// Steps that a track may have beside ten for each row; chosen, a year of a photograph in five minutes. What is computed for
/// each step is so bounded by the size of the file.
const MOST_MISSING_STEPS: usize = 100_000;

/// The rig of the run in `folder`, from its `run.toml`.
pub(crate) fn read_rig_of_run(folder: &Path) -> Result<RigFile, FileError> {
    #[derive(Deserialize)]
    struct Config {
        rig: RigFile,
    }
    Ok(read_toml::<Config>(&folder.join("run.toml"))?.rig)
}

/// The lamps of the run in whose folder a file lies; `None` elsewhere.
fn lamps_of_run(path: &Path) -> Option<Layout> {
    read_rig_of_run(path.parent()?).ok()?.layout().ok()
}

/// Reads a track. In the folder of a run its lamps are those of the rig, else as [`Track::read_csv`] says.
///
/// # Errors
/// [`FileError`]; for more rows than the largest track has, for a last step far above the number of rows, and for times that
/// run back or stand still.
pub fn read_track(path: &Path) -> Result<Track, FileError> {
    let refused = |problem: String| FileError::content(path, problem);
    let bytes = read(path)?;
    // Less the head.
    let rows = bytes.iter().filter(|&&byte| byte == b'\n').count().saturating_sub(1);
    if rows > MOST_ROWS {
        return Err(refused(format!("a track has at most {MOST_ROWS} rows, this one has {rows}")));
    }
    let track = match lamps_of_run(path) {
        Some(lamps) => Track::read_csv_of(bytes.as_slice(), &lamps),
        None => Track::read_csv(bytes.as_slice()),
    };
    let track = track.map_err(parse(path))?;
    let [first, .., last] = &*track.samples else { return Ok(track) };
    if last.step as usize > 10 * track.samples.len() + MOST_MISSING_STEPS {
        return Err(refused(format!(
            "the last step is {}, but there are {} rows: more than nine in ten steps are missing",
            last.step,
            track.samples.len()
        )));
    }
    if let Some(pair) = track.samples.windows(2).find(|pair| pair[1].time_s < pair[0].time_s) {
        let (step, time_s, before_s) = (pair[1].step, pair[1].time_s, pair[0].time_s);
        return Err(refused(format!(
            "at step {step} time_s runs back from {before_s} to {time_s}; sort the rows, or correct the clock"
        )));
    }
    if last.time_s <= first.time_s {
        let problem = "all rows have the same time_s; leave the column out if the times are not known";
        return Err(refused(problem.to_owned()));
    }
    Ok(track)
}

/// The track files that `paths` name: files, and of each folder the track of its run, those of the runs in it, or its CSV
/// files with the columns of a track, in natural order.
///
/// # Errors
/// [`FileError`] names the folder in which there is none, or the file that is named twice: it would count as two plants.
pub fn track_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, FileError> {
    let mut found = Vec::new();
    for path in paths {
        if path.is_dir() { found.extend(tracks_in(path)?) } else { found.push(path.clone()) }
    }
    let mut known = HashMap::new();
    for path in &found {
        let before = identity(path).and_then(|identity| known.insert(identity, path));
        if let Some(before) = before {
            let problem =
                format!("the same file as {}, which is named before: name each track once", before.display());
            return Err(FileError::content(path, problem));
        }
    }
    Ok(found)
}

fn tracks_in(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let own = folder.join("track.csv");
    if own.exists() {
        return Ok(vec![own]);
    }
    let entries = fs::read_dir(folder).map_err(disk("read", folder))?;
    let mut found: Vec<PathBuf> = entries.flatten().map(|entry| entry.path().join("track.csv")).collect();
    found.retain(|track| track.exists());
    if found.is_empty() {
        // An empty file, and one with a column of a track, is a damaged track, and says so when it is read.
        let is_track = |path: &PathBuf| {
            read_text(path).is_ok_and(|text| {
                let first = text.lines().next().unwrap_or_default();
                first.is_empty()
                    || first.split(',').any(|column| ["tip_x_cm", "tip_y_cm"].contains(&column.trim()))
            })
        };
        found = list(folder, "csv")?;
        found.retain(is_track);
    }
    found.sort_by_cached_key(|path| tropism::photo::natural_order(&path.to_string_lossy()));
    if found.is_empty() {
        let problem = "no track in this folder: no track.csv, no folders of runs, no CSV files of tracks";
        return Err(FileError::content(folder, problem));
    }
    Ok(found)
}

/// Reads a photograph, or a page of a file of several, without decoding it.
///
/// # Errors
/// [`FileError`] if the file cannot be read. Whether it holds a picture shows when it is decoded.
pub fn read_photo(path: &Path, time_s: f64) -> Result<Photo, FileError> {
    let name = name_text(path.file_name().unwrap_or_default());
    let bytes = match pages::page_of(path) {
        Some((file, page)) => pages::read(&file, page)?,
        None => read(path)?,
    };
    Ok(Photo { name, bytes, time_s })
}

/// Reads the header of a photograph, and no more of the file.
///
/// # Errors
/// [`FileError::Disk`].
pub fn read_header(path: &Path) -> Result<ExifHeader, FileError> {
    if let Some((file, page)) = pages::page_of(path) {
        return Ok(ExifHeader::read(&mut std::io::Cursor::new(pages::read(&file, page)?)));
    }
    check_regular(path)?;
    let file = fs::File::open(path).map_err(disk("read", path))?;
    Ok(ExifHeader::read(&mut BufReader::new(file)))
}

/// The SHA-256 of `bytes`, in hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Creates a folder and those above it.
///
/// # Errors
/// [`FileError::Disk`].
pub fn make_folder(path: &Path) -> Result<(), FileError> {
    fs::create_dir_all(path).map_err(disk("make the folder", path))
}

/// Creates the folder in which a file is to stand.
pub(crate) fn make_folder_of(file: &Path) -> Result<(), FileError> {
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.exists() => make_folder(folder),
        _ => Ok(()),
    }
}

/// Writes a file whole or not at all: under another name first, then renamed. The old file stays until then. What is no file
/// is never replaced: the bytes go into a device, a pipe or a socket, as `/dev/stdout` is one.
///
/// # Errors
/// [`FileError::Disk`]; [`FileError::Content`] for a symbolic link to a file.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write_with(path, bytes, false)
}

/// [`write()`]; with `is_synced` the file and its name are on the disk when it returns, even if the power fails then.
///
/// # Errors
/// [`FileError::Disk`].
pub fn write_with(path: &Path, bytes: &[u8], is_synced: bool) -> Result<(), FileError> {
    write_after(path, bytes, is_synced, || Ok(()))
}

/// [`write_with()`]; `make_way` is called when the bytes are written, before they take the place of the old file.
pub(super) fn write_after(
    path: &Path,
    bytes: &[u8],
    is_synced: bool,
    make_way: impl FnOnce() -> std::io::Result<()>,
) -> Result<(), FileError> {
    write_as(path, bytes, is_synced, false, make_way)
}

fn write_as(
    path: &Path,
    bytes: &[u8],
    is_synced: bool,
    is_private: bool,
    make_way: impl FnOnce() -> std::io::Result<()>,
) -> Result<(), FileError> {
    if check_replaceable(path)? == Replaceable::Stream {
        return write_stream(path, bytes).map_err(disk("write", path));
    }
    let part = part_of(path);
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let result = (|| {
        let mut file = if is_private { create_private(&part)? } else { fs::File::create(&part)? };
        file.write_all(bytes)?;
        if is_synced {
            file.sync_all()?;
        }
        make_way()?;
        fs::rename(&part, path)?;
        if is_synced {
            sync_names(folder)?;
        }
        Ok(())
    })();
    result.map_err(|source| {
        let _ = fs::remove_file(&part);
        FileError::Disk { action: "write", path: path.to_owned(), source }
    })
}

/// What stands at the path of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Replaceable {
    /// A file, a folder or nothing.
    File,
    /// A device, a pipe or a socket: it is written to, and never replaced.
    Stream,
}

/// Looks at what stands at the path of an output.
///
/// # Errors
/// [`FileError::Content`] for a symbolic link to a file, or to nothing: a new file would take the place of the link.
pub(crate) fn check_replaceable(path: &Path) -> Result<Replaceable, FileError> {
    let is_link = fs::symlink_metadata(path).is_ok_and(|about| about.is_symlink());
    match fs::metadata(path) {
        Ok(about) if !about.is_file() && !about.is_dir() => Ok(Replaceable::Stream),
        _ if is_link => {
            let problem = "this is a symbolic link: name the file itself".to_owned();
            Err(FileError::content(path, problem))
        }
        _ => Ok(Replaceable::File),
    }
}

/// Writes into a device or a pipe. A pipe that nobody reads is an error: it would be waited for without end.
fn write_stream(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut options = fs::File::options();
    options.write(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(
        &mut options,
        rustix::fs::OFlags::NONBLOCK.bits().cast_signed(),
    );
    let mut stream = options.open(path)?;
    #[cfg(unix)]
    rustix::fs::fcntl_setfl(&stream, rustix::fs::OFlags::empty())?;
    stream.write_all(bytes)
}

/// `path`, or with a number where something is there already, `name.2.rest`, `name.3.rest` and so on: nothing that was kept
/// before is overwritten.
pub(crate) fn free_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (stem, rest) = name.split_once('.').unwrap_or((&name, ""));
    let numbered = |number: u32| match number {
        1 => path.to_owned(),
        _ => path.with_file_name(format!("{stem}.{number}.{rest}")),
    };
    (1..).map(numbered).find(|path| !path.exists()).expect("a free name")
}

/// Renames a file to a [free name](free_name) and returns it.
pub(crate) fn move_aside(path: &Path, kept: &Path) -> Result<PathBuf, FileError> {
    let kept = free_name(kept);
    fs::rename(path, &kept).map_err(disk("rename", path))?;
    Ok(kept)
}

#[cfg(unix)]
fn create_private(path: &Path) -> std::io::Result<fs::File> {
    use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
    let file = fs::File::options().write(true).create(true).truncate(true).mode(0o600).open(path)?;
    // One that an interrupted program left keeps its old mode.
    file.set_permissions(fs::Permissions::from_mode(0o600))?;
    Ok(file)
}

#[cfg(not(unix))]
fn create_private(path: &Path) -> std::io::Result<fs::File> {
    fs::File::create(path)
}

/// Lets only its owner read a file; one that is not there is left so.
#[cfg(unix)]
pub(crate) fn make_private(path: &Path) -> Result<(), FileError> {
    use std::os::unix::fs::PermissionsExt;
    match fs::set_permissions(path, fs::Permissions::from_mode(0o600)) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        done => done.map_err(disk("restrict", path)),
    }
}

/// Does nothing: there are no modes.
#[cfg(not(unix))]
pub(crate) fn make_private(_path: &Path) -> Result<(), FileError> {
    Ok(())
}

/// Checks that a file may be written to `path`: none is there, or a plan says to replace it.
pub(crate) fn check_free(path: &Path, is_replaced: bool) -> Result<(), crate::Error> {
    if is_replaced || !path.exists() || check_replaceable(path)? == Replaceable::Stream {
        return Ok(());
    }
    let path = path.display();
    Err(crate::Error::Plan(format!(
        "{path}: a file is here already: choose a new name, or replace it by `replace`"
    )))
}

/// Writes a value as indented JSON with a line feed at its end.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), FileError> {
    write(path, (json_of(path, value)? + "\n").as_bytes())
}

/// Writes a value as indented JSON without a line feed at its end, as it is in the folders of evolutions and studies.
pub(crate) fn write_unterminated_json(path: &Path, value: &impl Serialize) -> Result<(), FileError> {
    write(path, json_of(path, value)?.as_bytes())
}

/// The text of `value` as it stands in the JSON file `path`, indented and without a line feed at its end.
pub(crate) fn json_of(path: &Path, value: &impl Serialize) -> Result<String, FileError> {
    serde_json::to_string_pretty(value).map_err(parse(path))
}

/// The text of `value` as it stands in the TOML file `path`.
///
/// # Errors
/// [`FileError::Parse`] if TOML has no words for it.
pub fn toml_of(path: &Path, value: &impl Serialize) -> Result<String, FileError> {
    toml::to_string(value).map_err(parse(path))
}

/// Writes a track as CSV.
///
/// # Errors
/// [`FileError::Disk`].
pub fn write_track(path: &Path, track: &Track) -> Result<(), FileError> {
    write(path, &track.to_csv())
}

/// Lists the files that hold the photographs of `paths`: as [`list_photographs`] does, but without looking into them.
///
/// # Errors
/// Those of [`list_photographs`].
pub fn photographs(paths: &[PathBuf]) -> Result<Vec<PathBuf>, FileError> {
    Ok(photographs::list_files(paths)?.files)
}

/// Lists the files of `folder` with the extension `extension`, by name.
pub(crate) fn list(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, FileError> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(disk("read", folder))? {
        let path = entry.map_err(disk("read", folder))?.path();
        if path.is_file() && path.extension().is_some_and(|found| found == extension) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// What identifies a file: the same for all spellings of its path, through symbolic and through hard links.
#[cfg(unix)]
fn identity(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).ok().map(|about| (about.dev(), about.ino()))
}

/// What identifies a file: the same for all spellings of its path.
#[cfg(not(unix))]
fn identity(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok()
}

/// The name under which a file is written before it takes its place.
fn part_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    path.with_file_name(name)
}

/// Checks that writing the files `outputs` overwrites none of the files `inputs`, whatever paths and links lead to them.
///
/// # Errors
/// [`crate::Error::Plan`] names both paths.
pub fn check_outputs(outputs: &[PathBuf], inputs: &[PathBuf]) -> Result<(), crate::Error> {
    check_outputs_with(outputs, || inputs.to_vec())
}

/// [`check_outputs()`] with inputs that are listed only if an output is there already.
pub(crate) fn check_outputs_with(
    outputs: &[PathBuf],
    inputs: impl FnOnce() -> Vec<PathBuf>,
) -> Result<(), crate::Error> {
    let written = outputs.iter().flat_map(|output| [output.clone(), part_of(output)]);
    let written: Vec<_> = written.filter_map(|path| Some((identity(&path)?, path))).collect();
    for input in if written.is_empty() { Vec::new() } else { inputs() } {
        let found = identity(&input);
        if let Some((_, output)) = written.iter().find(|(identity, _)| found.as_ref() == Some(identity)) {
            return Err(crate::Error::Plan(format!(
                "{}: this is the input {}: choose another name for the output, which would overwrite what it is made of",
                output.display(),
                input.display()
            )));
        }
    }
    outputs.iter().try_for_each(|output| check_replaceable(output).map(drop))?;
    Ok(())
}

/// The deepest folder that is looked into: a run in a study in a folder, with room to spare.
const MAX_DEPTH: usize = 8;

/// All files in `folder` and in the folders below it. What cannot be read is left out.
pub(crate) fn files_below(folder: &Path) -> Vec<PathBuf> {
    fn add(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if !path.is_dir() {
                found.push(path);
            } else if depth < MAX_DEPTH {
                add(&path, depth + 1, found);
            }
        }
    }
    let mut found = Vec::new();
    add(folder, 0, &mut found);
    found
}

/// Whether `name` names a file in a folder, and leads nowhere else on any system.
#[must_use]
pub fn is_plain_name(name: &str) -> bool {
    !matches!(name, "" | "." | "..") && !name.contains(['/', '\\', ':']) && !name.contains(char::is_control)
}

/// Checks that nothing between `folder` and the file `path` in it is a symbolic link: it would lead to a foreign file.
/// Whether the file is there is not checked.
pub(crate) fn check_unlinked(folder: &Path, path: &Path) -> Result<(), FileError> {
    let parts = path.ancestors().take_while(|part| *part != folder);
    for part in parts {
        if fs::symlink_metadata(part).is_ok_and(|about| about.file_type().is_symlink()) {
            return Err(FileError::content(part, "this is a symbolic link: name the file itself"));
        }
    }
    Ok(())
}

/// The name of a file as text, different for different names: bytes that are not UTF-8 become `\xff`. In such a name, and
/// in one that reads like one, a backslash is doubled.
#[must_use]
pub fn name_text(name: &OsStr) -> String {
    if let Some(text) = name.to_str().filter(|text| !text.contains("\\x")) {
        return text.to_owned();
    }
    let mut text = String::new();
    for chunk in name.as_encoded_bytes().utf8_chunks() {
        text += &chunk.valid().replace('\\', "\\\\");
        for byte in chunk.invalid() {
            text += &format!("\\x{byte:02x}");
        }
    }
    text
}

/// A path as a word of a command for a POSIX shell, in quotation marks where it needs them.
#[must_use]
pub fn shell_word(path: &Path) -> String {
    let is_bare = |byte: u8| byte.is_ascii_alphanumeric() || b"_./,:@%+=-".contains(&byte);
    let name = path.as_os_str();
    let bytes = name.as_encoded_bytes();
    // A word that begins with a dash would be an option.
    let start = if bytes.starts_with(b"-") { "./" } else { "" };
    match name.to_str() {
        Some(text) if !text.is_empty() && text.bytes().all(is_bare) => format!("{start}{text}"),
        Some(text) if !text.contains(char::is_control) && plain(text) == text => {
            format!("{start}'{}'", text.replace('\'', "'\\''"))
        }
        _ => {
            let letter = |&byte: &u8| match byte {
                b'\'' | b'\\' => format!("\\{}", char::from(byte)),
                b' '..=b'~' => char::from(byte).to_string(),
                _ => format!("\\{byte:03o}"),
            };
            format!("{start}$'{}'", bytes.iter().map(letter).collect::<String>())
        }
    }
}

/// [`write_with()`] of a file that holds a secret: on Unix, only its user can read it, from its first byte on.
///
/// # Errors
/// [`FileError::Disk`].
pub fn write_private(path: &Path, bytes: &[u8], is_synced: bool) -> Result<(), FileError> {
    write_as(path, bytes, is_synced, true, || Ok(()))
}

/// Writes the text of a settings file, [privately](write_private) if an address in it holds a secret.
pub(crate) fn write_settings(path: &Path, text: &str, is_synced: bool) -> Result<(), FileError> {
    let write = if holds_secret(text) { write_private } else { write_with };
    write(path, text.as_bytes(), is_synced)
}

#[cfg(test)]
mod tests {
    use std::slice::from_ref;

    use super::*;

    #[cfg(unix)]
    #[test]
    fn the_free_bytes_of_a_disk_are_known_and_those_of_an_absent_folder_are_an_error() {
        assert!(free_bytes(Path::new("/")).unwrap() > 0);
        assert_eq!(free_bytes(Path::new("/absent")).unwrap_err().kind(), std::io::ErrorKind::NotFound);
    }

    #[test]
    fn names_are_ordered_by_their_numbers() {
        let mut names = ["frame10.jpg", "frame9.jpg", "Frame1.jpg", "a.jpg", "frame009.jpg"];
        names.sort_by_cached_key(|name| tropism::photo::natural_order(name));
        assert_eq!(names, ["a.jpg", "Frame1.jpg", "frame009.jpg", "frame9.jpg", "frame10.jpg"]);
    }

    #[test]
    fn an_error_in_toml_is_one_line_that_names_place_and_problem() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        for (text, wanted) in [
            ("\nnumber = \"five\"\n", "line 2: found \"number = \\\"five\\\"\": invalid type: string"),
            ("numbr = 5", "line 1: found \"numbr = 5\": unknown field `numbr`, expected `number`"),
            (
                "[neat]",
                "line 1: found \"[neat]\": the parameters of NEAT stand in the table [evolution.neat]; unknown",
            ),
            ("number = ", "line 1: found \"number =\": "),
            ("number", "line 1"),
        ] {
            #[derive(Debug, serde::Deserialize)]
            #[serde(deny_unknown_fields)]
            struct Settings {
                #[serde(rename = "number")]
                _number: f64,
            }
            write(&path, text.as_bytes()).unwrap();
            let error = read_toml::<Settings>(&path).unwrap_err().to_string();
            assert!(error.contains("a.toml: ") && error.contains(wanted), "{error}");
            assert_eq!(error.lines().count(), 1, "{error}");
        }
    }

    #[test]
    fn a_failed_write_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, b"before").unwrap();
        // The name of the part is taken by a folder: the write cannot begin.
        fs::create_dir(folder.path().join("a.txt.part")).unwrap();
        let error = write(&path, b"after").unwrap_err().to_string();
        assert!(error.contains("a.txt: cannot write"), "{error}");
        assert_eq!(read(&path).unwrap(), b"before");
    }

    #[test]
    fn tracks_whose_numbers_are_nonsense_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("track.csv");
        let read = |rows: &[(u32, f64)]| {
            let rows = rows.iter().map(|(step, time_s)| format!("{step},{time_s},0.1,4,left\n"));
            let text = format!("step,time_s,tip_x_cm,tip_y_cm,light\n{}", rows.collect::<String>());
            write(&path, text.as_bytes()).unwrap();
            read_track(&path).map_err(|error| error.to_string())
        };
        read(&[(0, 0.0), (1, 300.0), (90_000, 2.7e7)]).unwrap();
        read(&[(0, 0.0), (1, 0.0), (2, 600.0)]).unwrap();
        for (rows, wanted) in [
            (vec![(0, 0.0), (100_000_000, 3e10)], "more than nine in ten steps are missing"),
            (vec![(0, 0.0), (1, 300.0), (2, 200.0)], "at step 2 time_s runs back from 300 to 200"),
            (vec![(0, 300.0), (1, 300.0), (2, 300.0)], "all rows have the same time_s"),
        ] {
            let error = read(&rows).unwrap_err();
            assert!(error.contains(wanted), "{error}");
        }
        let rows = "0.1,4,left\n".repeat(MOST_ROWS + 1);
        write(&path, format!("tip_x_cm,tip_y_cm,light\n{rows}").as_bytes()).unwrap();
        let error = read_track(&path).unwrap_err().to_string();
        assert!(error.contains("a track has at most 1000000 rows"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_written_to_or_refused_and_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, dangling, pipe] =
            ["file", "link", "dangling", "pipe"].map(|name| folder.path().join(name));
        write(&file, b"before").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        std::os::unix::fs::symlink(folder.path().join("absent"), &dangling).unwrap();
        for path in [&link, &dangling] {
            let error = write(path, b"after").unwrap_err().to_string();
            assert!(error.contains("this is a symbolic link"), "{error}");
            assert!(check_outputs(from_ref(path), &[]).is_err());
            assert!(fs::symlink_metadata(path).unwrap().is_symlink());
        }
        assert_eq!(read(&file).unwrap(), b"before");
        write(Path::new("/dev/null"), b"gone").unwrap();
        check_free(Path::new("/dev/null"), false).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let error = write(&pipe, b"unread").unwrap_err().to_string();
        assert!(error.contains("pipe: cannot write"), "{error}");
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        // Until the reader has opened it nobody reads.
        while write(&pipe, b"read").is_err() {
            std::thread::yield_now();
        }
        assert_eq!(reader.join().unwrap(), b"read");
        assert!(!fs::metadata(&pipe).unwrap().is_file());
    }

    #[test]
    fn a_track_of_a_run_has_the_lamps_of_its_rig() {
        let folder = tempfile::tempdir().unwrap();
        let track = folder.path().join("track.csv");
        write(&track, b"tip_x_cm,tip_y_cm,light\n0,4,top\n0.1,4.1,low\n").unwrap();
        assert!(read_track(&track).unwrap_err().to_string().contains("top"));
        let lamps = "[[rig.greenhouse.layout]]\nname = \"low\"\nat = [-35, 5, 0]\n\
                     [[rig.greenhouse.layout]]\nname = \"top\"\nat = [0, 60, 0]\n";
        write(&folder.path().join("run.toml"), lamps.as_bytes()).unwrap();
        let read = read_track(&track).unwrap();
        assert_eq!(read.layout.name(read.samples[0].light), "top");
    }

    #[test]
    fn errors_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let error = photographs(&[folder.path().to_owned()]).unwrap_err().to_string();
        assert!(error.contains("no photographs here"), "{error}");
        let absent = folder.path().join("absent.csv");
        assert!(read_track(&absent).unwrap_err().to_string().contains("absent.csv: cannot read"));
        write(&absent, b"x,y\n").unwrap();
        assert!(read_track(&absent).unwrap_err().to_string().contains("wanted \"tip_x_cm\""));
    }

    #[test]
    fn an_output_that_is_an_input_is_refused_by_whatever_path() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("track.csv");
        write(&input, b"track").unwrap();
        let refused = |output: PathBuf| {
            let error = check_outputs(from_ref(&output), from_ref(&input)).unwrap_err().to_string();
            let (output, input) = (output.display().to_string(), input.display().to_string());
            assert!(error.contains(&output) && error.contains(&input), "{error}");
        };
        refused(input.clone());
        refused(folder.path().join("./track.csv"));
        refused(folder.path().join("../").join(folder.path().file_name().unwrap()).join("track.csv"));
        #[cfg(unix)]
        {
            let link = folder.path().join("link");
            std::os::unix::fs::symlink(&input, &link).unwrap();
            refused(link);
            let hard = folder.path().join("hard");
            fs::hard_link(&input, &hard).unwrap();
            refused(hard);
        }
        check_outputs(&[folder.path().join("new.csv")], from_ref(&input)).unwrap();
        // The name under which the output is written first.
        let part = folder.path().join("model.json.part");
        write(&part, b"track").unwrap();
        let error = check_outputs(&[folder.path().join("model.json")], &[part]).unwrap_err().to_string();
        assert!(error.contains("model.json.part"), "{error}");
    }

    #[test]
    fn names_that_lead_elsewhere_are_not_plain() {
        for name in ["", ".", "..", "../a", "/etc/passwd", "a/b", "a\\b", "C:a", "a\0", "a\nb"] {
            assert!(!is_plain_name(name), "{name:?}");
        }
        for name in ["000001.jpg", "..jpg", "a b.png", "é.jpg"] {
            assert!(is_plain_name(name), "{name:?}");
        }
    }

    #[test]
    fn each_track_of_a_folder_counts_once_and_none_vanishes() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        write(&at("1.csv"), b"tip_x_cm,tip_y_cm,light\n0,4,left\n").unwrap();
        write(&at("2.csv"), b"x_cm, tip_y_cm,light\n0,4,left\n").unwrap();
        write(&at("3.csv"), b"").unwrap();
        write(&at("light.csv"), b"frame,light\n1.jpg,left\n").unwrap();
        let whole = [folder.path().to_owned()];
        assert_eq!(track_files(&whole).unwrap(), ["1.csv", "2.csv", "3.csv"].map(at), "damaged tracks, too");
        let twice = [at("1.csv"), folder.path().to_owned()];
        let error = track_files(&twice).unwrap_err().to_string();
        assert!(
            error.contains("1.csv: the same file as") && error.contains("name each track once"),
            "{error}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_not_utf8_stay_different() {
        use std::os::unix::ffi::OsStrExt;
        let names: [&[u8]; 6] =
            [b"a\xff.jpg", b"a\xfe.jpg", b"a\\xff.jpg", b"a\\\\xff.jpg", b"a\\b.jpg", b"a\\\xff.jpg"];
        let mut texts: Vec<String> = names.iter().map(|name| name_text(OsStr::from_bytes(name))).collect();
        assert_eq!(texts[0], "a\\xff.jpg");
        assert_eq!(texts[4], "a\\b.jpg");
        texts.sort();
        texts.dedup();
        assert_eq!(texts.len(), names.len());
    }

    #[test]
    fn paths_are_words_of_a_shell() {
        for (path, word) in [
            ("beans/1.csv", "beans/1.csv"),
            ("my beans", "'my beans'"),
            ("it's $(reboot); *", "'it'\\''s $(reboot); *'"),
            ("-rf", "./-rf"),
            ("- rf", "./'- rf'"),
            ("bohne-é", "'bohne-é'"),
            ("a\n'b\x1b", "$'a\\012\\'b\\033'"),
        ] {
            assert_eq!(shell_word(Path::new(path)), word);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_private_file_is_read_by_its_user_alone() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.toml");
        write(&folder.path().join("run.toml.part"), b"left over").unwrap();
        write_private(&path, b"secret", true).unwrap();
        assert_eq!(read(&path).unwrap(), b"secret");
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
