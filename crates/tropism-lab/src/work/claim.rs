//! Who may work in a folder, and on what.

use std::path::Path;

use serde_json::Value;

use super::{Place, Record, Units, Work};
use crate::difference::differences;
use crate::folder::check_no_other_work;
use crate::lock::{FolderLock, LockError, lock, lock_shared};
use crate::{Error, files};

/// How often a unit tries to write the record of its work, which takes a moment, while others do; each try waits a tenth of a
/// second. Chosen.
const CLAIM_TRIES: u32 = 100;

/// Makes the folder of a work, or checks that the work in it is this one, and locks it until the lock is dropped.
pub(super) fn claim<W: Work>(work: &W, begun: &W::Begun<'_>) -> Result<FolderLock, Error> {
    let record = begun.record()?;
    let check = || check::<W>(work, begun, &record, work.is_resumed());
    // Before anything is made, and once more when nobody else can.
    check()?;
    files::make_folder(work.out())?;
    let lock = lock(work.out())?;
    check()?;
    write::<W>(work, &record)?;
    Ok(lock)
}

/// [`claim`] for one unit: others may do the same at this moment, and all share the lock.
pub(super) fn claim_beside_others<W: Work>(work: &W, begun: &W::Begun<'_>) -> Result<FolderLock, Error> {
    let (record, path) = (begun.record()?, work.out().join(W::RECORD));
    check::<W>(work, begun, &record, true)?;
    files::make_folder(work.out())?;
    let mut tries = 0;
    while !is_recorded(&path, &record)? {
        tries += 1;
        match lock(work.out()) {
            Ok(_lock) => {
                check::<W>(work, begun, &record, true)?;
                write::<W>(work, &record)?;
            }
            // Another unit writes the record.
            Err(LockError::InUse { .. }) if tries < CLAIM_TRIES => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(lock_shared(work.out())?)
}

fn is_recorded(path: &Path, record: &Record) -> Result<bool, Error> {
    Ok(path.exists() && files::read_text(path)? == record.text)
}

/// Checks that a folder is one, and that without the record of the work it has no other work and nothing that this one would
/// replace or take for its own.
fn check_free<W: Work>(folder: &Path, begun: &W::Begun<'_>) -> Result<(), Error> {
    if folder.exists() && !folder.is_dir() {
        return Err(Error::Plan(format!(
            "{}: found a file, wanted a folder for {}: choose a new one (`out`)",
            folder.display(),
            W::NAME
        )));
    }
    if !folder.exists() || folder.join(W::RECORD).exists() {
        return Ok(());
    }
    if let Some(path) = W::RESULTS.iter().map(|name| folder.join(name)).find(|path| path.exists()) {
        return Err(Error::Plan(format!(
            "{}: a file is here already, but no {} beside it: choose a new folder (`out`)",
            path.display(),
            W::RECORD
        )));
    }
    check_no_other_work(folder, W::RECORD)?;
    for (number, stage) in begun.stages().iter().enumerate() {
        for (place, unit) in stage.units.iter().enumerate() {
            if begun.is_done(Place { stage: number, unit: place })? {
                return Err(Error::Plan(format!(
                    "{}: found results of {:?} here, but no {} beside them: choose a new folder (`out`)",
                    folder.display(),
                    unit.name,
                    W::RECORD
                )));
            }
        }
    }
    Ok(())
}

fn check<W: Work>(work: &W, begun: &W::Begun<'_>, record: &Record, is_resumed: bool) -> Result<(), Error> {
    check_free::<W>(work.out(), begun)?;
    let path = work.out().join(W::RECORD);
    let is_extended =
        is_resumed && path.exists() && files::read_text(&path).is_ok_and(|known| begun.extends(&known));
    if is_extended { Ok(()) } else { check_same(&path, &record.text, is_resumed, W::NAME) }
}

fn write<W: Work>(work: &W, record: &Record) -> Result<(), Error> {
    let (folder, path) = (work.out(), work.out().join(W::RECORD));
    let is_known = is_recorded(&path, record)?;
    if !is_known {
        for name in W::RESULTS {
            files::remove(&folder.join(name))?;
        }
    }
    for (name, content) in &record.beside {
        files::write(&folder.join(name), content)?;
    }
    // Last: a work with its record has all that it needs.
    if !is_known {
        files::write(&path, record.text.as_bytes())?;
    }
    Ok(())
}

/// Checks that the folder of `record` is free for work whose settings are `text`, or that the same work may continue there.
/// `what` names the work, with its article.
///
/// # Errors
/// [`Error::Plan`] if the work is there without `resume`, or is another one.
pub(crate) fn check_same(record: &Path, text: &str, resume: bool, what: &str) -> Result<(), Error> {
    if !record.exists() {
        return Ok(());
    }
    if !resume {
        return Err(Error::Plan(format!(
            "{}: {what} is here already: choose a new folder (`out`), or go on with it by `resume`",
            record.parent().unwrap_or(record).display()
        )));
    }
    let found = files::read_text(record)?;
    if found == text {
        return Ok(());
    }
    let [found, wanted] = [&found, text].map(|text| files::parse_toml(record, text));
    Err(other_settings(record, what, &found?, &wanted?))
}

/// The error that `what` has the settings `found` in the file `record`, and not those that are `wanted`.
fn other_settings(record: &Path, what: &str, found: &Value, wanted: &Value) -> Error {
    Error::Plan(format!(
        "{}: {what} with other settings is here{}: go on with the same, or choose another folder",
        record.display(),
        differences(found, wanted)
    ))
}
