//! Where runs, evolutions and other work lie below the folder of the studio.

use std::path::{Component, Path, PathBuf};

use serde::Serialize;

use crate::error::Refusal;

/// How deep folders are looked into.
const DEPTH: usize = 6;

/// Pieces of work that are shown at most; against a folder that is the whole disk.
const MOST: usize = 5000;

/// Folders that are looked into at most.
const MOST_FOLDERS: usize = 50_000;

/// A kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Kind {
    Run,
    Evolution,
    Study,
    Sweep,
    Transfer,
    Laboratories,
}

impl Kind {
    /// Each kind with the file that its folder has.
    const FILES: [(Self, &'static str); 6] = [
        (Self::Study, "study.toml"),
        (Self::Sweep, "sweep.toml"),
        (Self::Evolution, "evolution.toml"),
        (Self::Transfer, "transfer.toml"),
        (Self::Laboratories, "laboratories.toml"),
        (Self::Run, "run.toml"),
    ];

    /// The kind of the work in `folder`.
    pub(crate) fn of(folder: &Path) -> Option<Self> {
        Self::FILES.into_iter().find(|(_, name)| folder.join(name).is_file()).map(|(kind, _)| kind)
    }

    /// The file that the folder of such work has; it is as old as the work.
    pub(crate) fn file(self) -> &'static str {
        Self::FILES.into_iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name)
    }
}

/// A piece of work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Found {
    /// Its folder below that of the studio, with `/` between names; empty for the folder itself.
    pub(crate) at: String,
    pub(crate) path: PathBuf,
    pub(crate) kind: Kind,
}

/// All work at and below `root`. Links are not followed.
pub(crate) fn find(root: &Path) -> Vec<Found> {
    let (mut found, mut looked_into) = (Vec::new(), 0);
    look_into(root, "", DEPTH, &mut found, &mut looked_into);
    found
}

fn look_into(folder: &Path, at: &str, depth: usize, found: &mut Vec<Found>, looked_into: &mut usize) {
    *looked_into += 1;
    if found.len() >= MOST || *looked_into > MOST_FOLDERS {
        return;
    }
    let kind = Kind::of(folder);
    if let Some(kind) = kind {
        found.push(Found { at: at.to_owned(), path: folder.to_owned(), kind });
    }
    // Only a study has work of its own kind inside; the many plants of the others are theirs.
    if depth == 0 || kind.is_some_and(|kind| kind != Kind::Study) {
        return;
    }
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let is_folder = |entry: &std::fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_dir());
    let mut names: Vec<String> = entries
        .flatten()
        .filter(is_folder)
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    names.retain(|name| {
        !name.starts_with('.') && !matches!(name.as_str(), "photographs" | "target" | "node_modules")
    });
    names.sort_unstable();
    for name in names {
        let below = if at.is_empty() { name.clone() } else { format!("{at}/{name}") };
        look_into(&folder.join(name), &below, depth - 1, found, looked_into);
    }
}

/// The path of what lies `at` below `root`.
///
/// # Errors
/// [`Refusal`] if it is not there, or leads out of `root`, also by a link.
pub(crate) fn resolve(root: &Path, at: &str) -> Result<PathBuf, Refusal> {
    let missing = || Refusal::missing(format!("found nothing at {at:?}"));
    let is_below = Path::new(at).components().all(|part| matches!(part, Component::Normal(_)));
    let is_hidden = at.split('/').any(|name| name.starts_with('.'));
    if !is_below || is_hidden || at.contains('\\') || at.contains('\0') {
        return Err(missing());
    }
    let [root, path] = [root.to_owned(), root.join(at)].map(|path| path.canonicalize());
    let (root, path) = (root.map_err(|_| missing())?, path.map_err(|_| missing())?);
    path.starts_with(&root).then_some(path).ok_or_else(missing)
}

/// [`resolve`] of work of `kind`.
pub(crate) fn resolve_kind(root: &Path, at: &str, kind: Kind) -> Result<PathBuf, Refusal> {
    let path = resolve(root, at)?;
    if Kind::of(&path) == Some(kind) {
        return Ok(path);
    }
    Err(Refusal::missing(format!("{at}: found no {}", kind.file())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        folder
    }

    #[test]
    fn work_is_found_but_not_its_parts() {
        let folder = folder_with(&[
            "bean/run.toml",
            "bean/photographs/run.toml",
            "deep/er/evolution/evolution.toml",
            "study/study.toml",
            "study/evolution/evolution.toml",
            "transfer/transfer.toml",
            "transfer/plants/1/run.toml",
            ".hidden/run.toml",
        ]);
        let found: Vec<_> = find(folder.path()).into_iter().map(|found| (found.at, found.kind)).collect();
        let wanted = [
            ("bean", Kind::Run),
            ("deep/er/evolution", Kind::Evolution),
            ("study", Kind::Study),
            ("study/evolution", Kind::Evolution),
            ("transfer", Kind::Transfer),
        ];
        assert_eq!(found, wanted.map(|(at, kind)| (at.to_owned(), kind)));
    }

    #[cfg(unix)]
    #[test]
    fn no_path_leads_out_of_the_folder() {
        let folder = folder_with(&["in/bean/run.toml", "in/.own/access.json", "out/run.toml"]);
        let root = folder.path().join("in");
        std::os::unix::fs::symlink(folder.path().join("out"), root.join("link")).unwrap();
        assert!(resolve(&root, "bean").is_ok() && resolve(&root, "").is_ok());
        let absolute = folder.path().join("out").display().to_string();
        for at in [
            "../out",
            "bean/../../out",
            "link",
            "/etc",
            &absolute,
            ".own",
            ".own/access.json",
            "bean/./..",
            "..",
            "a\0b",
            "..\\out",
        ] {
            assert!(resolve(&root, at).is_err(), "{at}");
        }
    }
}
