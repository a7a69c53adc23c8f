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
pub enum FileError {
    /// The disk said no.
    #[error("{path}: cannot {action}: {source}")]
    Disk {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
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
    /// Whether the disk is full, or what its user may have of it.
    #[must_use]
    pub fn is_disk_full(&self) -> bool {
        use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        matches!(self, Self::Disk { source, .. } if [FileTooLarge, QuotaExceeded, StorageFull].contains(&source.kind()))
    }
}

/// How much room the disk of `path` has left for its user, in bytes.
///
/// # Errors
/// What the system says where it does not tell.
#[cfg(unix)]
pub fn free_bytes(path: &Path) -> std::io::Result<u64> {
    let disk = rustix::fs::statvfs(path)?;
    Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
}

/// How much room the disk of `path` has left for its user, in bytes.
///
/// # Errors
/// Here, always.
#[cfg(not(unix))]
pub fn free_bytes(_path: &Path) -> std::io::Result<u64> {
    let wanted = "wanted a system that tells how much is free";
    Err(std::io::Error::new(std::io::ErrorKind::Unsupported, wanted))
}

/// Has the names of the files in a folder on the disk.
///
/// # Errors
/// [`FileError::Disk`].
pub fn sync_folder(path: &Path) -> Result<(), FileError> {
    // Elsewhere folders cannot be opened, and need not be.
    if cfg!(not(unix)) {
        return Ok(());
    }
    fs::File::open(path).and_then(|folder| folder.sync_all()).map_err(disk("sync", path))
}

fn disk(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> FileError {
    move |source| FileError::Disk { action, path: path.to_owned(), source }
}

fn content(path: &Path) -> impl FnOnce(&dyn Error) -> FileError {
    move |error| FileError::Content {
        path: path.to_owned(),
        problem: error.to_string().trim_end().to_owned(),
    }
}

/// The bytes of a file.
///
/// # Errors
/// [`FileError::Disk`].
pub fn read(path: &Path) -> Result<Vec<u8>, FileError> {
    fs::read(path).map_err(disk("read", path))
}

/// The text of a file.
///
/// # Errors
/// [`FileError`]; text that is not UTF-8 is an error.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    String::from_utf8(read(path)?).map_err(|error| content(path)(&error))
}

/// What `parse` makes of the text of a file.
///
/// # Errors
/// [`FileError`] with the message of `parse` and the name of the file.
pub fn read_as<T, E: Error>(path: &Path, parse: impl FnOnce(&str) -> Result<T, E>) -> Result<T, FileError> {
    parse(&read_text(path)?).map_err(|error| content(path)(&error))
}

/// A TOML file.
///
/// # Errors
/// [`FileError`] in one line: the number of the line, what stands there, and what is wrong with it.
pub fn read_toml<T: DeserializeOwned>(path: &Path) -> Result<T, FileError> {
    let text = read_text(path)?;
    toml::from_str(&text)
        .map_err(|error| FileError::Content { path: path.to_owned(), problem: in_one_line(&text, &error) })
}

/// A TOML error as one line; the crate's own shows the place by arrows, over several.
fn in_one_line(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().trim().replace('\n', "; ");
    let Some(before) = error.span().and_then(|span| text.get(..span.start)) else { return message };
    let line = before.matches('\n').count();
    let found = text.lines().nth(line).unwrap_or_default().trim();
    format!("line {}: found {found:?}: {message}", line + 1)
}

/// A track.
///
/// # Errors
/// [`FileError`].
pub fn read_track(path: &Path) -> Result<Track, FileError> {
    Track::read_csv(read(path)?.as_slice()).map_err(|error| content(path)(&error))
}

/// A photograph.
///
/// # Errors
/// [`FileError`] if the file cannot be read; whether it holds a picture shows when it is decoded.
pub fn read_photo(path: &Path, time_s: f64) -> Result<Photo, FileError> {
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    Ok(Photo { name, bytes: read(path)?, time_s })
}

/// What the header of a photograph says; reads no more of the file than that.
///
/// # Errors
/// [`FileError::Disk`].
pub fn read_header(path: &Path) -> Result<ExifHeader, FileError> {
    let file = fs::File::open(path).map_err(disk("read", path))?;
    Ok(ExifHeader::read(&mut BufReader::new(file)))
}

/// The SHA-256 of `bytes`, in hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Makes a folder and those above it.
///
/// # Errors
/// [`FileError::Disk`].
pub fn make_folder(path: &Path) -> Result<(), FileError> {
    fs::create_dir_all(path).map_err(disk("make the folder", path))
}

/// Writes a file whole or not at all: under another name first, then renamed. What was there before stays until then.
///
/// # Errors
/// [`FileError::Disk`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    write_with(path, bytes, false)
}

/// [`write()`], and with `is_synced` the file and its folder are on the disk when it returns, whatever happens to the power.
///
/// # Errors
/// [`FileError::Disk`].
pub fn write_with(path: &Path, bytes: &[u8], is_synced: bool) -> Result<(), FileError> {
    write_after(path, bytes, is_synced, || Ok(()))
}

/// [`write_with()`], with something to be done when the bytes are written but have not yet taken their place.
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
    serde_json::to_string_pretty(value).map_err(|error| content(path)(&error))
}

/// The text of `value` as it stands in the TOML file `path`.
pub(crate) fn toml_of(path: &Path, value: &impl Serialize) -> Result<String, FileError> {
    toml::to_string(value).map_err(|error| content(path)(&error))
}

/// Writes a track as CSV.
///
/// # Errors
/// [`FileError::Disk`].
pub fn write_track(path: &Path, track: &Track) -> Result<(), FileError> {
    let mut bytes = Vec::new();
    track.write_csv(&mut bytes).map_err(|error| content(path)(&error))?;
    write(path, &bytes)
}

/// The photographs that `paths` name: files as they are, and of folders all JPEG and PNG files in them. In the order of
/// the numbers and words in their names: `frame9.jpg` stands before `frame10.jpg`.
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
            let problem = "found no .jpg, .jpeg or .png file, wanted photographs".to_owned();
            return Err(FileError::Content { path: path.clone(), problem });
        }
        found[before..].sort_by_cached_key(|path| {
            photo::natural_order(&path.file_name().unwrap_or_default().to_string_lossy())
        });
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_disk_tells_its_room_and_an_absent_folder_why_not() {
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
