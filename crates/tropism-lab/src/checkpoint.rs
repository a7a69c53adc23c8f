//! A file that is written again and again while long work is under way, and the one before it.

use std::error::Error;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::files::{self, FileError};

/// Where long work is saved: `run-00.json`, and what was there before as `run-00.previous.json`.
///
/// At every moment one of the two is whole and on the disk, whatever happens to the program or to the power.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    path: PathBuf,
}

/// What [`Checkpoint::load`] found.
#[derive(Debug)]
pub struct Loaded<T> {
    /// The work as it was saved.
    pub value: T,
    /// Why it is that of the file before: what is wrong with the file itself.
    pub refused: Option<FileError>,
}

impl Checkpoint {
    /// The checkpoint at `path`.
    #[must_use]
    pub const fn new(path: PathBuf) -> Self {
        Self { path }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file before it.
    #[must_use]
    pub fn previous(&self) -> PathBuf {
        self.beside("previous")
    }

    /// Sets the file and the one before it [aside](Self::broken), so that the work can begin anew.
    ///
    /// # Errors
    /// [`FileError::Disk`].
    pub fn set_aside(&self) -> Result<(), FileError> {
        for path in [&self.path, &self.previous()] {
            if path.exists() {
                files::move_aside(path, &self.broken())?;
            }
        }
        Ok(())
    }

    /// Where a file goes that cannot be read, so that it is neither written over nor taken for the one before.
    #[must_use]
    pub fn broken(&self) -> PathBuf {
        self.beside("broken")
    }

    fn beside(&self, word: &str) -> PathBuf {
        let extension = self.path.extension().unwrap_or_default().to_string_lossy();
        self.path.with_extension(format!("{word}.{extension}"))
    }

    /// Writes the file to the disk, and keeps the one that was there.
    ///
    /// # Errors
    /// [`FileError::Disk`]; what was saved before can still be loaded.
    pub fn save(&self, bytes: &[u8]) -> Result<(), FileError> {
        files::write_after(&self.path, bytes, true, || match fs::rename(&self.path, self.previous()) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            other => other,
        })
    }

    /// What `parse` makes of the file, or if that is broken, of the one before; `None` if there is neither. A broken file
    /// is set [aside](Self::broken) when the one before it serves.
    ///
    /// # Errors
    /// [`FileError`] of the file, if neither can be used.
    pub fn load<T, E: Error + Send + Sync + 'static>(
        &self,
        parse: impl Fn(&str) -> Result<T, E>,
    ) -> Result<Option<Loaded<T>>, FileError> {
        let previous = self.previous();
        if !self.path.exists() && !previous.exists() {
            return Ok(None);
        }
        let refused = match files::read_as(&self.path, &parse) {
            Ok(value) => return Ok(Some(Loaded { value, refused: None })),
            Err(refused) => refused,
        };
        let Ok(value) = files::read_as(&previous, &parse) else { return Err(refused) };
        match fs::rename(&self.path, self.broken()) {
            Err(source) if source.kind() != ErrorKind::NotFound => {
                return Err(FileError::Disk { action: "set aside", path: self.path.clone(), source });
            }
            _ => {}
        }
        Ok(Some(Loaded { value, refused: Some(refused) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checkpoint(folder: &tempfile::TempDir) -> Checkpoint {
        Checkpoint::new(folder.path().join("run-00.json"))
    }

    fn load(checkpoint: &Checkpoint) -> (u32, Option<String>) {
        let loaded = checkpoint.load(str::parse::<u32>).unwrap().unwrap();
        (loaded.value, loaded.refused.map(|refused| refused.to_string()))
    }

    #[test]
    fn the_last_file_counts_and_the_one_before_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = checkpoint(&folder);
        assert!(checkpoint.load(str::parse::<u32>).unwrap().is_none());
        for number in ["1", "2", "3"] {
            checkpoint.save(number.as_bytes()).unwrap();
        }
        assert_eq!(load(&checkpoint), (3, None));
        assert_eq!(files::read_text(&checkpoint.previous()).unwrap(), "2");
    }

    #[test]
    fn a_broken_file_is_refused_by_name_and_the_one_before_serves() {
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = checkpoint(&folder);
        checkpoint.save(b"1").unwrap();
        checkpoint.save(b"2").unwrap();
        fs::write(checkpoint.path(), "2x").unwrap();
        let (value, refused) = load(&checkpoint);
        assert_eq!(value, 1);
        assert!(refused.unwrap().contains("run-00.json: invalid digit"));
        // What is saved next does not push the good one out.
        checkpoint.save(b"3").unwrap();
        assert_eq!(files::read_text(&checkpoint.previous()).unwrap(), "1");
        assert_eq!(files::read_text(&checkpoint.broken()).unwrap(), "2x");
        assert_eq!(load(&checkpoint), (3, None));
    }

    #[test]
    fn killed_between_two_renames_the_one_before_serves() {
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = checkpoint(&folder);
        checkpoint.save(b"1").unwrap();
        fs::rename(checkpoint.path(), checkpoint.previous()).unwrap();
        let (value, refused) = load(&checkpoint);
        assert!(value == 1 && refused.unwrap().contains("run-00.json: cannot read"));
    }

    #[test]
    fn nothing_is_made_up_when_both_are_broken() {
        let folder = tempfile::tempdir().unwrap();
        let checkpoint = checkpoint(&folder);
        for text in ["x", "y"] {
            checkpoint.save(text.as_bytes()).unwrap();
        }
        let error = checkpoint.load(str::parse::<u32>).unwrap_err().to_string();
        assert!(error.contains("run-00.json: invalid digit"), "{error}");
        assert_eq!(files::read_text(checkpoint.path()).unwrap(), "y");
        checkpoint.set_aside().unwrap();
        assert!(checkpoint.load(str::parse::<u32>).unwrap().is_none());
        assert_eq!(files::read_text(&checkpoint.broken()).unwrap(), "y");
    }
}
