//! Names, tags and removal of work: a folder is renamed, or put away where it can be had back.

use std::path::{Path, PathBuf};

use serde::Serialize;
use tropism_lab::{files, holder, tags};

use crate::error::Refusal;
use crate::found::{Kind, resolve_work, search_of};
use crate::{Studio, draw};

/// Where what was deleted lies until somebody empties it, below the studio's own folder.
const DELETED: &str = "deleted";

/// The work at `at`, which nobody may be at work on.
fn idle(studio: &Studio, at: &str) -> Result<PathBuf, Refusal> {
    let path = resolve_work(&studio.root, at)?;
    if at.is_empty() || Kind::of(&path).is_none() {
        return Err(Refusal::missing(format!("found no work at {at:?} that can be moved")));
    }
    let is_held = path.is_dir() && holder(&path)?.is_some();
    if is_held || studio.queue.has(at) || search_of(&path).is_file() {
        return Err(Refusal::bad(format!("{at}: a program is at work on it; stop it first")));
    }
    Ok(path)
}

/// Moves work; the file of the tags of a rule lies beside it, and goes with it.
fn moved(from: &Path, to: &Path) -> Result<(), Refusal> {
    let tags = (!from.is_dir()).then(|| (tags::file(from), tags::file(to)));
    std::fs::rename(from, to).map_err(|error| Refusal::bad(format!("{}: {error}", from.display())))?;
    // It may have none.
    let _ = tags.map(|(from, to)| std::fs::rename(from, to));
    Ok(())
}

/// The tags of a piece of work.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Tags {
    tags: Vec<String>,
}

/// The tags of the work at `at`.
pub(crate) fn tags(studio: &Studio, at: &str) -> Result<Tags, Refusal> {
    Ok(Tags { tags: tags::read(&resolve_work(&studio.root, at)?) })
}

/// Gives the work at `at` these tags in place of those that it has.
pub(crate) fn set_tags(studio: &Studio, at: &str, tags: &[String]) -> Result<Tags, Refusal> {
    let path = resolve_work(&studio.root, at)?;
    if Kind::of(&path).is_none() {
        return Err(Refusal::missing(format!("found no work at {at:?}")));
    }
    tags::write(&path, tags)?;
    Ok(Tags { tags: tags::read(&path) })
}

/// Where renamed work lies.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Renamed {
    at: String,
}

/// Gives the work at `at` the name `name`, beside where it lies: its new place.
pub(crate) fn rename(studio: &Studio, at: &str, name: &str) -> Result<Renamed, Refusal> {
    draw::check_name(name)?;
    let path = idle(studio, at)?;
    let name = if path.is_file() { format!("{name}.json") } else { name.to_owned() };
    let to = match at.rsplit_once('/') {
        Some((folder, _)) => format!("{folder}/{name}"),
        None => name,
    };
    let target = studio.root.join(&to);
    if target.symlink_metadata().is_ok() {
        return Err(Refusal::bad(format!("{to} is there already; choose another name")));
    }
    moved(&path, &target)?;
    Ok(Renamed { at: to })
}

/// Where deleted work is kept.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Deleted {
    kept: String,
}

/// Puts the work at `at` away, if `again` names it, too: where it lies then.
pub(crate) fn delete(studio: &Studio, at: &str, again: &str) -> Result<Deleted, Refusal> {
    let path = idle(studio, at)?;
    if again != at {
        return Err(Refusal::bad(format!("found the name {again:?}, wanted {at:?}")));
    }
    let folder = studio.root.join(crate::OWN).join(DELETED);
    files::make_folder(&folder)?;
    // To the millisecond: the same name may be deleted again and again.
    let name = format!("{}-{}", at.replace('/', "-"), (1000.0 * crate::unix_s()) as u64);
    moved(&path, &folder.join(&name))?;
    Ok(Deleted { kept: format!("{}/{DELETED}/{name}", crate::OWN) })
}
