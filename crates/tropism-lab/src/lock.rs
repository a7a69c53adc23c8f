//! The lock of a folder: one program at a time works in it.

use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::files::{self, FileError};

/// Why a folder cannot be locked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LockError {
    /// Another program works in it.
    #[error("{path}: another program{} uses this run: wait for it, or stop it", in_brackets(*process))]
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

/// A locked folder: free again when it is dropped, or when the process dies.
#[derive(Debug)]
pub struct FolderLock(File);

impl Drop for FolderLock {
    fn drop(&mut self) {
        // An old number is of nobody, or of somebody else by now. A process that dies leaves it: it is not believed without
        // the lock.
        let _ = self.0.set_len(0);
    }
}

/// Keeps other programs out of the folder at `path`. The file `run.lock` there then holds the number of this process and,
/// on Linux, when it began.
///
/// # Errors
/// [`LockError::InUse`] if another program holds the lock.
pub fn lock(path: &Path) -> Result<FolderLock, LockError> {
    let (name, mut file) = open(path)?;
    let disk = |source| FileError::Disk { action: "lock", path: name.clone(), source };
    for _ in 0..TRIES {
        match file.try_lock() {
            Ok(()) => {
                let process = std::process::id();
                let began = began(process).map_or_else(|| "-".to_owned(), |began| began.to_string());
                let line = format!("{process} {began}\n");
                file.set_len(0).and_then(|()| file.write_all(line.as_bytes())).map_err(disk)?;
                return Ok(FolderLock(file));
            }
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
            Err(TryLockError::Error(source)) => return Err(disk(source).into()),
        }
    }
    Err(LockError::InUse { path: path.to_owned(), process: read_process(&name) })
}

/// Keeps programs out of the folder at `path` that want it alone, and lets others share it.
///
/// # Errors
/// [`LockError::InUse`] if another program holds it alone.
pub(crate) fn lock_shared(path: &Path) -> Result<FolderLock, LockError> {
    let (name, file) = open(path)?;
    for _ in 0..TRIES {
        match file.try_lock_shared() {
            Ok(()) => return Ok(FolderLock(file)),
            Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
            Err(TryLockError::Error(source)) => {
                return Err(FileError::Disk { action: "lock", path: name, source }.into());
            }
        }
    }
    Err(LockError::InUse { path: path.to_owned(), process: read_process(&name) })
}

/// Whether programs share the folder at `path`.
pub(crate) fn is_shared(path: &Path) -> bool {
    let Ok(file) = File::open(path.join("run.lock")) else { return false };
    let is_alone = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)) || file.unlock().is_err();
    !is_alone && matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

/// Opens the lock file of a folder, and makes it if it is not there.
fn open(path: &Path) -> Result<(PathBuf, File), FileError> {
    let name = path.join("run.lock");
    let disk = |source| FileError::Disk { action: "lock", path: name.clone(), source };
    let mut options = File::options();
    // Not truncated: until the lock is ours it holds the number of the program that has it.
    options.read(true).write(true).create(true).truncate(false);
    // A link that was planted would lead to a foreign file.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(
        &mut options,
        rustix::fs::OFlags::NOFOLLOW.bits().cast_signed(),
    );
    let file = options.open(&name).map_err(disk)?;
    // Who can read a lock can hold it and keep its owner out.
    files::make_private(&name)?;
    Ok((name, file))
}

/// When a process began, in ticks since the boot: field 22 of `/proc/PID/stat` (`man 5 proc_pid_stat`). `None` if there is no
/// such process or no such file.
fn began(process: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name, field 2, stands in brackets and may hold any character.
    stat.rsplit_once(')')?.1.split_whitespace().nth(19)?.parse().ok()
}

/// The number of the process that holds the lock of the folder at `path`; `None` if none does.
///
/// # Errors
/// [`FileError`] if the lock cannot be read, or is held without the number of a living process.
pub fn holder(path: &Path) -> Result<Option<u32>, FileError> {
    let name = path.join("run.lock");
    let disk = |source| FileError::Disk { action: "read", path: name.clone(), source };
    let file = match File::open(&name) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        // The run of another user, over.
        Err(error) if error.kind() == ErrorKind::PermissionDenied && path.join("track.csv").exists() => {
            return Ok(None);
        }
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
    let problem = "it is locked, and the lock names no living process".to_owned();
    Err(FileError::content(&name, problem))
}

/// The process in a lock file; `None` if another process has its number by now.
fn read_process(lock: &Path) -> Option<u32> {
    let text = std::fs::read_to_string(lock).ok()?;
    let mut words = text.split_whitespace();
    let process: u32 = words.next()?.parse().ok()?;
    match words.next() {
        // A system that does not tell.
        None | Some("-") => Some(process),
        Some(then) => (began(process) == then.parse().ok()).then_some(process),
    }
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
    fn a_shared_folder_is_nobodys_alone() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_shared(folder.path()));
        let shares = [lock_shared(folder.path()).unwrap(), lock_shared(folder.path()).unwrap()];
        assert!(is_shared(folder.path()) && lock(folder.path()).is_err());
        drop(shares);
        let alone = lock(folder.path()).unwrap();
        assert!(!is_shared(folder.path()) && lock_shared(folder.path()).is_err());
        drop(alone);
        assert!(!is_shared(folder.path()));
    }

    #[test]
    fn a_number_that_another_process_has_by_now_is_not_believed() {
        let folder = tempfile::tempdir().unwrap();
        let held = lock(folder.path()).unwrap();
        let name = folder.path().join("run.lock");
        // The first process of the system began before this one.
        std::fs::write(&name, format!("1 {}\n", u64::MAX)).unwrap();
        let error = holder(folder.path()).unwrap_err().to_string();
        assert!(error.contains("names no living process"), "{error}");
        drop(held);
        assert_eq!(std::fs::read_to_string(&name).unwrap(), "", "a lock that is free names nobody");
    }

    #[cfg(unix)]
    #[test]
    fn only_the_owner_can_read_a_lock() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let _held = lock(folder.path()).unwrap();
        let mode = folder.path().join("run.lock").metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
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
