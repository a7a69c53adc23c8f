//! Where an export goes: a tar archive, or a folder. Both are made under another name and take their own when they are
//! whole.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tropism_lab::files;

use super::{Written, name_of};

/// An export that is being written.
pub(crate) enum Sink {
    /// An archive; all of it is in a folder of its name.
    Tar { part: PathBuf, name: String, archive: Box<tar::Builder<BufWriter<File>>> },
    /// A folder.
    Folder { part: PathBuf },
}

/// The name under which `out` is written.
pub(crate) fn part_of(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    out.with_file_name(name)
}

impl Sink {
    /// An archive if `out` ends in `.tar`, else a folder.
    pub(crate) fn new(out: &Path) -> Result<Self> {
        let part = part_of(out);
        let cannot = || format!("{}: cannot make it", part.display());
        let is_tar = out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("tar"));
        if !is_tar {
            fs::create_dir(&part).with_context(cannot)?;
            return Ok(Self::Folder { part });
        }
        let file = File::create_new(&part).with_context(cannot)?;
        let name = name_of(&out.with_extension(""));
        Ok(Self::Tar { part, name, archive: Box::new(tar::Builder::new(BufWriter::new(file))) })
    }

    /// What is being written.
    pub(crate) fn part(&self) -> &Path {
        match self {
            Self::Tar { part, .. } | Self::Folder { part } => part,
        }
    }

    /// Adds a file; `path` is relative.
    pub(crate) fn add(&mut self, path: &str, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Tar { name, archive, .. } => {
                let mut header = tar::Header::new_gnu();
                header.set_size(bytes.len() as u64);
                header.set_mode(0o644);
                archive.append_data(&mut header, format!("{name}/{path}"), bytes)
            }
            Self::Folder { part } => {
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

    /// Brings all of it to the disk, and reads it back from there.
    pub(crate) fn finish(self) -> Result<Vec<Written>> {
        match self {
            Self::Tar { part, name, archive } => {
                let file = archive.into_inner()?.into_inner().map_err(io::IntoInnerError::into_error)?;
                file.sync_all()?;
                drop(file);
                read_tar(&part, &name)
            }
            Self::Folder { part } => {
                File::open(&part)?.sync_all()?;
                let mut found = Vec::new();
                read_folder(&part, "", &mut found)?;
                Ok(found)
            }
        }
    }
}

fn written(path: String, bytes: &[u8]) -> Written {
    Written { path, bytes: bytes.len() as u64, sha256: files::sha256(bytes) }
}

fn read_tar(path: &Path, name: &str) -> Result<Vec<Written>> {
    let mut archive = tar::Archive::new(BufReader::new(File::open(path)?));
    let mut found = Vec::new();
    for entry in archive.entries()? {
        let mut entry = entry?;
        let path = entry.path()?.to_string_lossy().into_owned();
        let path = path.strip_prefix(&format!("{name}/")).unwrap_or(&path).to_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes)?;
        found.push(written(path, &bytes));
    }
    Ok(found)
}

fn read_folder(folder: &Path, prefix: &str, found: &mut Vec<Written>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let path = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            read_folder(&entry.path(), &format!("{path}/"), found)?;
        } else {
            found.push(written(path, &fs::read(entry.path())?));
        }
    }
    Ok(())
}

/// Gives what was written its name, unless something has taken it meanwhile.
pub(crate) fn put(part: &Path, out: &Path) -> io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        match renameat_with(CWD, part, CWD, out, RenameFlags::NOREPLACE) {
            // Not every network disk can.
            Err(rustix::io::Errno::INVAL | rustix::io::Errno::NOSYS) => {}
            done => return Ok(done?),
        }
    }
    if out.exists() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    fs::rename(part, out)
}

/// Removes what was begun.
pub(crate) fn remove(part: &Path) {
    // What cannot be removed stays under its own name and is in nobody's way.
    let _ = if part.is_dir() { fs::remove_dir_all(part) } else { fs::remove_file(part) };
}
