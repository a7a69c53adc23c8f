//! Where runs, evolutions and other work lie below the folder of the studio.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;
use tropism::evolve::TunedRule;
use tropism_lab::{RunConfig, files, has_journal};

use crate::error::Refusal;

/// How deep folders are looked into.
const DEPTH: usize = 6;

/// Pieces of work that are shown at most; against a folder that is the whole disk.
const MOST: usize = 5000;

/// Folders that are looked into at most.
const MOST_FOLDERS: usize = 50_000;

/// Folders that are passed over: photographs of runs, and what other programs build.
pub(crate) const PASSED_OVER: [&str; 3] = ["photographs", "target", "node_modules"];

/// A kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum Kind {
    Run,
    Evolution,
    Study,
    Sweep,
    Transfer,
    Replicates,
    Walls,
    /// A tuned rule, or the search for one: a file of its own.
    Rule,
}

impl Kind {
    /// Each kind with the file that its folder has; a rule has no folder.
    const FILES: [(Self, &'static str); 7] = [
        (Self::Study, "study.toml"),
        (Self::Sweep, "sweep.toml"),
        (Self::Evolution, "evolution.toml"),
        (Self::Transfer, "transfer.toml"),
        (Self::Replicates, "replicates.toml"),
        (Self::Walls, "walls.toml"),
        (Self::Run, "run.toml"),
    ];

    /// The kind of the work at `path`.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let kind = Self::FILES.into_iter().find(|(_, name)| path.join(name).is_file()).map(|(kind, _)| kind);
        kind.or_else(|| (search_of(path).is_file() || is_rule(path)).then_some(Self::Rule))
    }

    /// Whether a file of this name is the one by which work is known.
    pub(crate) fn is_named_by(name: &str) -> bool {
        Self::FILES.iter().any(|(_, file)| *file == name)
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

/// Whether the folder of a run is one of a recorded run, also if its journal is lost: not an export, or a plant that `grow`
/// photographed.
fn is_recorded(folder: &Path) -> bool {
    let is_real = || RunConfig::follow(folder).map_or(true, |config| !config.is_virtual());
    has_journal(folder) || (!folder.join("manifest.json").exists() && is_real())
}

/// The ending of the file of a search that is not over, in place of that of its rule.
const SEARCH: &str = "search.jsonl";

/// The largest file that is looked at whether it is a rule; rules have some thousand bytes.
const MAX_RULE: u64 = 1 << 16;

/// The file of the search for the rule `path`.
pub(crate) fn search_of(path: &Path) -> PathBuf {
    path.with_extension(SEARCH)
}

fn is_rule(path: &Path) -> bool {
    let is_json = path.extension().is_some_and(|ending| ending == "json");
    let is_small = path.metadata().is_ok_and(|data| data.is_file() && data.len() <= MAX_RULE);
    is_json && is_small && files::read_text(path).is_ok_and(|text| TunedRule::is_named_in(&text))
}

/// Finds all work below a folder, again and again.
#[derive(Default)]
pub(crate) struct Finder {
    found: Vec<Found>,
    folders: usize,
    /// Files that are rules or are not, as they were when they were looked at.
    rules: BTreeMap<PathBuf, (u64, Option<SystemTime>, bool)>,
}

impl Finder {
    /// All work at and below `root`. Links are not followed.
    pub(crate) fn find(&mut self, root: &Path) -> Vec<Found> {
        self.folders = 0;
        self.look_into(root, "", DEPTH);
        if self.rules.len() > MOST {
            self.rules.clear();
        }
        std::mem::take(&mut self.found)
    }

    fn look_into(&mut self, folder: &Path, at: &str, depth: usize) {
        self.folders += 1;
        if self.found.len() >= MOST || self.folders > MOST_FOLDERS {
            return;
        }
        let kind = Kind::of(folder);
        if let Some(kind) = kind.filter(|kind| *kind != Kind::Run || is_recorded(folder)) {
            self.found.push(Found { at: at.to_owned(), path: folder.to_owned(), kind });
        }
        // Only a study has work of its own kind inside; the many plants of the others are theirs.
        if depth == 0 || kind.is_some_and(|kind| kind != Kind::Study) {
            return;
        }
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        let mut names: Vec<(String, bool)> = entries
            .flatten()
            .filter_map(|entry| {
                let kind = entry.file_type().ok().filter(|kind| kind.is_dir() || kind.is_file())?;
                Some((entry.file_name().into_string().ok()?, kind.is_dir()))
            })
            .collect();
        names.retain(|(name, _)| !name.starts_with('.') && !PASSED_OVER.contains(&name.as_str()));
        names.sort_unstable();
        for (name, is_folder) in names {
            let below = |name: &str| if at.is_empty() { name.to_owned() } else { format!("{at}/{name}") };
            if is_folder {
                self.look_into(&folder.join(&name), &below(&name), depth - 1);
            } else if let Some(rule) = self.rule_named(folder, &name) {
                let (at, path) = (below(&rule), folder.join(&rule));
                self.found.push(Found { at, path, kind: Kind::Rule });
            }
        }
    }

    /// The name of the rule that the file `name` is, or is the search for.
    fn rule_named(&mut self, folder: &Path, name: &str) -> Option<String> {
        let path = folder.join(name);
        if let Some(stem) = name.strip_suffix(SEARCH).and_then(|stem| stem.strip_suffix('.')) {
            return Some(format!("{stem}.json"));
        }
        // While there is a search, that is what is shown.
        if !name.ends_with(".json") || search_of(&path).is_file() {
            return None;
        }
        let data = path.metadata().ok()?;
        let (size, time) = (data.len(), data.modified().ok());
        let known = self.rules.get(&path).filter(|(known, then, _)| (*known, *then) == (size, time));
        let is = known.map_or_else(|| is_rule(&path), |(.., is)| *is);
        self.rules.insert(path, (size, time, is));
        is.then(|| name.to_owned())
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

/// [`resolve`] of any work; the rule that is still searched for has no file yet.
pub(crate) fn resolve_work(root: &Path, at: &str) -> Result<PathBuf, Refusal> {
    resolve(root, at).or_else(|refusal| {
        let (folder, name) = at.rsplit_once('/').unwrap_or(("", at));
        let path = resolve(root, folder)?.join(name);
        let is_searched = name.ends_with(".json") && !name.starts_with('.') && search_of(&path).is_file();
        if is_searched { Ok(path) } else { Err(refusal) }
    })
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
            "export/run.toml",
            "export/manifest.json",
            "study/study.toml",
            "study/evolution/evolution.toml",
            "transfer/transfer.toml",
            "transfer/plants/1/run.toml",
            ".hidden/run.toml",
            "model.json",
            "searched.search.jsonl",
        ]);
        std::fs::write(folder.path().join("deep/rule.json"), "{\"schema\": \"tropism.rule/1\"}").unwrap();
        let mut finder = Finder::default();
        assert_eq!(finder.find(folder.path()), finder.find(folder.path()));
        let found: Vec<_> =
            finder.find(folder.path()).into_iter().map(|found| (found.at, found.kind)).collect();
        let wanted = [
            ("bean", Kind::Run),
            ("deep/er/evolution", Kind::Evolution),
            ("deep/rule.json", Kind::Rule),
            ("searched.json", Kind::Rule),
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
