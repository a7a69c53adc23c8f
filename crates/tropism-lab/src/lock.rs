//! The lock of a folder: one program at a time works in it.

use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::files::FileError;

/// Why a folder cannot be locked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LockError {
    /// Another program works in it.
    #[error("{path}: found the run in use by another program{}, wanted it free", in_brackets(*process))]
    InUse {
        /// The folder.
        path: PathBuf,
        /// Number of the process, if it has written it already.
        process: Option<u32>,
    },
    /// The system refused.
    #[error(transparent)]
    File(#[from] FileError),
}

fn in_brackets(process: Option<u32>) -> String {
    process.map_or_else(String::new, |process| format!(" (process {process})"))
}

/// How often a taken lock is tried: a program that only [reads the holder](holder) takes it for an instant.
const TRIES: u32 = 10;

/// Pause between two tries; chosen, far longer than reading the holder takes.
const PAUSE: Duration = Duration::from_millis(10);

/// Keeps other programs out of the folder at `path` until it is dropped, or until the process dies. The file `run.lock`
/// there then holds the number of this process.
///
/// # Errors
/// [`LockError::InUse`] if another program holds the lock.
pub fn lock(path: &Path) -> Result<File, LockError> {
    let name = path.join("run.lock");
    let disk = |source| FileError::Disk { action: "lock", path: name.clone(), source };
    // Not truncated: until the lock is ours it holds the number of the program that has it.
    let options = File::options().read(true).write(true).create(true).truncate(false).open(&name);
    let mut file = options.map_err(disk)?;
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => {
                file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id())).map_err(disk)?;
                return Ok(file);
            }
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
            Err(TryLockError::Error(source)) => return Err(disk(source).into()),
        }
    }
    Err(LockError::InUse { path: path.to_owned(), process: read_process(&name) })
}

/// The number of the process that holds the lock of the folder at `path`; `None` if none does.
///
/// # Errors
/// [`FileError`] if the lock cannot be read, or is held without a number.
pub fn holder(path: &Path) -> Result<Option<u32>, FileError> {
    let name = path.join("run.lock");
    let disk = |source| FileError::Disk { action: "read", path: name.clone(), source };
    let file = match File::open(&name) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(disk(error)),
    };
    for _ in 0..TRIES {
        match file.try_lock_shared() {
            Ok(()) => return Ok(None),
            Err(TryLockError::Error(source)) => return Err(disk(source)),
            Err(TryLockError::WouldBlock) => {}
        }
        if let Some(process) = read_process(&name) {
            return Ok(Some(process));
        }
        // The holder has the lock but has not yet written its number.
        std::thread::sleep(PAUSE);
    }
    let problem = "found it locked without the number of a process, wanted one".to_owned();
    Err(FileError::content(&name, problem))
}

fn read_process(lock: &Path) -> Option<u32> {
    std::fs::read_to_string(lock).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_tells_its_holder() {
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
    fn reading_the_holder_keeps_no_program_out() {
        let folder = tempfile::tempdir().unwrap();
        drop(lock(folder.path()).unwrap());
        let reader = File::open(folder.path().join("run.lock")).unwrap();
        reader.lock_shared().unwrap();
        std::thread::scope(|scope| {
            let locked = scope.spawn(|| lock(folder.path()).map(drop));
            std::thread::sleep(Duration::from_millis(20));
            reader.unlock().unwrap();
            locked.join().unwrap().unwrap();
        });
    }
}
