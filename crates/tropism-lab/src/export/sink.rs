//! Where an export goes: a tar archive, or a folder. Both are written under another name, and renamed when they are whole.

use std::fs::{self, File, TryLockError};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use super::manifest::{Written, name_of};
use crate::error::Error;
use crate::files;

/// An export that is being written.
pub(super) enum Sink {
    /// An archive, with all files in a folder of its name.
    Tar { part: PathBuf, name: String, archive: Box<tar::Builder<BufWriter<File>>> },
    /// A folder.
    Folder { part: PathBuf, _lock: Option<File> },
}

/// The name under which `out` is written.
pub(super) fn part_of(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    out.with_file_name(name)
}

impl Sink {
    /// Creates an archive if `out` ends in `.tar`, otherwise a folder.
    pub(super) fn create(out: &Path) -> Result<Self, Error> {
        let part = part_of(out);
        let cannot = || Error::at(format!("{}: cannot make it", part.display()));
        remove_left_over(&part).map_err(cannot())?;
        let is_tar = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tar"));
        if !is_tar {
            fs::create_dir(&part).map_err(cannot())?;
            let lock = lock_part(&part).map_err(cannot())?;
            return Ok(Self::Folder { part, _lock: lock });
        }
        let file = File::create_new(&part).map_err(cannot())?;
        file.try_lock().map_err(|error| cannot()(error.into()))?;
        let name = name_of(&out.with_extension(""));
        Ok(Self::Tar { part, name, archive: Box::new(tar::Builder::new(BufWriter::new(file))) })
    }

    /// Adds a file; `path` is relative to the export.
    pub(super) fn add(&mut self, path: &str, bytes: &[u8]) -> io::Result<()> {
        if !path.split('/').all(files::is_plain_name) {
            return Err(io::Error::new(
                io::ErrorKind::InvalidInput,
                "found a path that may lead out of the export",
            ));
        }
        match self {
            Self::Tar { name, archive, .. } => {
                let mut header = tar::Header::new_gnu();
                header.set_size(bytes.len() as u64);
                header.set_mode(0o644);
                archive.append_data(&mut header, format!("{name}/{path}"), bytes)
            }
            Self::Folder { part, .. } => {
                let path = part.join(path);
                if let Some(folder) = path.parent() {
                    fs::create_dir_all(folder)?;
                }
                let mut file = File::create_new(path)?;
                file.write_all(bytes)?;
                file.sync_all()
            }
        }
    }

    /// Syncs all files to the disk, and reads them back from there.
    pub(super) fn finish(self) -> io::Result<Vec<Written>> {
        match self {
            Self::Tar { part, name, archive } => {
                let file = archive.into_inner()?.into_inner().map_err(io::IntoInnerError::into_error)?;
                file.sync_all()?;
                drop(file);
                read_tar(&part, &name)
            }
            Self::Folder { part, .. } => {
                files::sync_names(&part)?;
                let mut found = Vec::new();
                read_folder(&part, "", &mut found)?;
                Ok(found)
            }
        }
    }
}

/// Removes what an export left under this name that was killed. One that is still at work has it locked.
fn remove_left_over(part: &Path) -> io::Result<()> {
    let about = match fs::symlink_metadata(part) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        about => about?,
    };
    let is_export = |entry: &fs::DirEntry| TOP.iter().any(|name| entry.file_name() == *name);
    let is_ours = if about.is_dir() {
        fs::read_dir(part)?.collect::<Result<Vec<_>, _>>()?.iter().all(is_export)
    } else {
        about.is_file()
    };
    if !is_ours {
        let problem = "something is there that no export left; move it away, or choose another name";
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, problem));
    }
    let _lock = lock_part(part)?;
    if about.is_dir() { fs::remove_dir_all(part) } else { fs::remove_file(part) }
}

/// What stands in an export, apart from what stands in its folders.
const TOP: [&str; 9] = [
    "run.toml",
    "calibration.toml",
    "truth.csv",
    "truth.jsonl",
    "track.csv",
    "events.csv",
    "photographs",
    "side",
    "manifest.json",
];

/// Locks an unfinished export, a file or a folder; `None` where the system opens no folders.
fn lock_part(part: &Path) -> io::Result<Option<File>> {
    if cfg!(not(unix)) && part.is_dir() {
        return Ok(None);
    }
    let file = File::open(part)?;
    file.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => {
            io::Error::new(io::ErrorKind::ResourceBusy, "another program is exporting to it")
        }
        TryLockError::Error(error) => error,
    })?;
    Ok(Some(file))
}

fn read_tar(path: &Path, name: &str) -> io::Result<Vec<Written>> {
    let mut archive = tar::Archive::new(BufReader::new(File::open(path)?));
    let mut found = Vec::new();
    for entry in archive.entries()? {
        let mut entry = entry?;
        let path = entry.path()?.to_string_lossy().into_owned();
        let path = path.strip_prefix(&format!("{name}/")).unwrap_or(&path).to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes)?;
        found.push(Written::new(path, &bytes));
    }
    Ok(found)
}

fn read_folder(folder: &Path, prefix: &str, found: &mut Vec<Written>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let path = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            read_folder(&entry.path(), &format!("{path}/"), found)?;
        } else {
            found.push(Written::new(path, &fs::read(entry.path())?));
        }
    }
    Ok(())
}

/// Renames `part` to `out`, unless something has taken that name since.
pub(super) fn rename(part: &Path, out: &Path) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        match renameat_with(CWD, part, CWD, out, RenameFlags::NOREPLACE) {
            // Some network file systems do not support it.
            Err(rustix::io::Errno::INVAL | rustix::io::Errno::NOSYS) => {}
            done => return Ok(done?),
        }
    }
    if out.exists() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    fs::rename(part, out)
}

/// Removes an export that was not finished.
pub(super) fn remove(part: &Path) {
    // If it cannot be removed, it stays under its own name, which nothing else uses.
    let _ = if part.is_dir() { fs::remove_dir_all(part) } else { fs::remove_file(part) };
}
