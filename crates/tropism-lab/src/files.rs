//! Files in and out, with errors that name the file.

use std::error::Error;
use std::fs;
use std::io::{BufReader, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use tropism::photo::{self, ExifHeader, Photo};
use tropism::track::Track;

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
        let message = error.message().trim().replace('\n', "; ");
        let line = match error.span().and_then(|span| text.get(..span.start)) {
            None => message,
            Some(before) => {
                let line = before.matches('\n').count();
                let found = text.lines().nth(line).unwrap_or_default().trim();
                format!("line {}: found {found:?}: {message}", line + 1)
            }
        };
        Self { line, error }
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
    let wanted = "wanted a system that tells how much is free";
    Err(std::io::Error::new(std::io::ErrorKind::Unsupported, wanted))
}

/// Syncs a folder: the names of its files are then on the disk.
///
/// # Errors
/// [`FileError::Disk`].
pub fn sync_folder(path: &Path) -> Result<(), FileError> {
    // Other systems cannot open folders, and need not sync them.
    if cfg!(not(unix)) {
        return Ok(());
    }
    fs::File::open(path).and_then(|folder| folder.sync_all()).map_err(disk("sync", path))
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
        return Err(FileError::content(path, "found a folder, wanted a file"));
    }
    if !about.is_file() {
        return Err(FileError::content(path, "found a pipe, a socket or a device, wanted a file"));
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
    String::from_utf8(read(path)?).map_err(parse(path))
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
    toml::from_str(text).map_err(|error| parse(path)(TomlError::new(text, error)))
}

/// Reads a track.
///
/// # Errors
/// [`FileError`].
pub fn read_track(path: &Path) -> Result<Track, FileError> {
    Track::read_csv(read(path)?.as_slice()).map_err(parse(path))
}

/// Reads a photograph, without decoding it.
///
/// # Errors
/// [`FileError`] if the file cannot be read. Whether it holds a picture shows when it is decoded.
pub fn read_photo(path: &Path, time_s: f64) -> Result<Photo, FileError> {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    Ok(Photo { name, bytes: read(path)?, time_s })
}

/// Reads the header of a photograph, and no more of the file.
///
/// # Errors
/// [`FileError::Disk`].
pub fn read_header(path: &Path) -> Result<ExifHeader, FileError> {
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

/// Writes a file whole or not at all: under another name first, then renamed. The old file stays until then.
///
/// # Errors
/// [`FileError::Disk`].
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
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let result = (|| {
        let mut file = fs::File::create(&part)?;
        file.write_all(bytes)?;
        if is_synced {
            file.sync_all()?;
        }
        make_way()?;
        fs::rename(&part, path)?;
        if is_synced {
            fs::File::open(folder)?.sync_all()?;
        }
        Ok(())
    })();
    result.map_err(|source| {
        let _ = fs::remove_file(&part);
        FileError::Disk { action: "write", path: path.to_owned(), source }
    })
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

/// Checks that a file may be written to `path`: none is there, or a plan says to replace it.
pub(crate) fn check_free(path: &Path, is_replaced: bool) -> Result<(), crate::Error> {
    if is_replaced || !path.exists() {
        return Ok(());
    }
    let path = path.display();
    Err(crate::Error::Plan(format!(
        "{path}: found a file here already, wanted a new name, or `replace` to replace it"
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

fn json_of(path: &Path, value: &impl Serialize) -> Result<String, FileError> {
    serde_json::to_string_pretty(value).map_err(parse(path))
}

/// The text of `value` as it stands in the TOML file `path`.
pub(crate) fn toml_of(path: &Path, value: &impl Serialize) -> Result<String, FileError> {
    toml::to_string(value).map_err(parse(path))
}

/// Writes a track as CSV.
///
/// # Errors
/// [`FileError::Disk`].
pub fn write_track(path: &Path, track: &Track) -> Result<(), FileError> {
    let mut bytes = Vec::new();
    track.write_csv(&mut bytes).map_err(parse(path))?;
    write(path, &bytes)
}

/// Lists the photographs that `paths` name: files as they are, and of a folder all JPEG and PNG files in it, in natural
/// order: `frame9.jpg` stands before `frame10.jpg`.
///
/// # Errors
/// [`FileError`] if a path does not exist or a folder holds no photograph.
pub fn photographs(paths: &[PathBuf]) -> Result<Vec<PathBuf>, FileError> {
    let mut found = Vec::new();
    for path in paths {
        if !path.is_dir() {
            fs::metadata(path).map_err(disk("read", path))?;
            found.push(path.clone());
            continue;
        }
        let before = found.len();
        for entry in fs::read_dir(path).map_err(disk("read", path))? {
            let entry = entry.map_err(disk("read", path))?.path();
            let extension = entry.extension().map(|extension| extension.to_string_lossy().to_lowercase());
            if matches!(extension.as_deref(), Some("jpg" | "jpeg" | "png")) {
                found.push(entry);
            }
        }
        if found.len() == before {
            return Err(FileError::content(path, "found no .jpg, .jpeg or .png file, wanted photographs"));
        }
        found[before..].sort_by_cached_key(|path| {
            photo::natural_order(&path.file_name().unwrap_or_default().to_string_lossy())
        });
    }
    Ok(found)
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

#[cfg(test)]
mod tests {
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
        names.sort_by_cached_key(|name| photo::natural_order(name));
        assert_eq!(names, ["a.jpg", "Frame1.jpg", "frame009.jpg", "frame9.jpg", "frame10.jpg"]);
    }

    #[test]
    fn an_error_in_toml_is_one_line_that_names_place_and_problem() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        for (text, wanted) in [
            ("\nnumber = \"five\"\n", "line 2: found \"number = \\\"five\\\"\": invalid type: string"),
            ("numbr = 5", "line 1: found \"numbr = 5\": unknown field `numbr`, expected `number`"),
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
    fn errors_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let error = photographs(&[folder.path().to_owned()]).unwrap_err().to_string();
        assert!(error.contains("wanted photographs"), "{error}");
        let absent = folder.path().join("absent.csv");
        assert!(read_track(&absent).unwrap_err().to_string().contains("absent.csv: cannot read"));
        write(&absent, b"x,y\n").unwrap();
        assert!(read_track(&absent).unwrap_err().to_string().contains("wanted \"tip_x_cm\""));
    }
}
