//! The structure that `ARCHITECTURE.md` promises: which crate uses which, modules in the order of the data at every depth, and
//! paths that exist.
//!
//! A module may use the modules that stand above it in the file that declares both, its own children, and its parents.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A crate's modules: the names of the children of each, in the order in which they are declared.
struct Tree {
    children: BTreeMap<Vec<String>, Vec<String>>,
    files: BTreeMap<Vec<String>, PathBuf>,
}

impl Tree {
    fn of(root: &Path) -> Self {
        let mut tree = Self { children: BTreeMap::new(), files: BTreeMap::new() };
        tree.add(Vec::new(), root.to_owned());
        tree
    }

    fn add(&mut self, module: Vec<String>, file: PathBuf) {
        let text = code_of(&file);
        let folder = match file.file_stem().and_then(|stem| stem.to_str()) {
            Some("lib" | "main" | "mod") => file.parent().unwrap().to_owned(),
            _ => file.with_extension(""),
        };
        let declared: Vec<String> = text.lines().filter_map(declaration).collect();
        for name in &declared {
            let child: Vec<String> = module.iter().chain([name]).cloned().collect();
            let paths = [folder.join(format!("{name}.rs")), folder.join(name).join("mod.rs")];
            let path = paths.into_iter().find(|path| path.exists());
            self.add(child, path.unwrap_or_else(|| panic!("{}: no file for mod {name}", file.display())));
        }
        self.children.insert(module.clone(), declared);
        self.files.insert(module, file);
    }

    /// The longest module path that `path` begins with.
    fn resolve(&self, path: &[String]) -> Vec<String> {
        let longest = (0..=path.len()).rev().find(|&length| self.files.contains_key(&path[..length]));
        path[..longest.unwrap_or(0)].to_vec()
    }

    /// What stands in the way of `module` using `used`, if anything does.
    fn violation(&self, module: &[String], used: &[String]) -> Option<String> {
        let shared = module.iter().zip(used).take_while(|(a, b)| a == b).count();
        if shared == module.len() || shared == used.len() {
            return None;
        }
        let siblings = &self.children[&module[..shared]];
        let place = |name: &String| siblings.iter().position(|sibling| sibling == name);
        let (own, other) = (place(&module[shared])?, place(&used[shared])?);
        (other > own).then(|| format!("{} stands below {}", used.join("::"), module.join("::")))
    }
}

/// The name in a line such as `pub(crate) mod name;`.
fn declaration(line: &str) -> Option<String> {
    let name = line.trim_start().strip_suffix(';')?;
    let name = name.strip_prefix("mod ").or_else(|| {
        let after = name.strip_prefix("pub")?;
        let after = after.strip_prefix("(crate)").or(after.strip_prefix("(super)")).unwrap_or(after);
        after.strip_prefix(" mod ")
    })?;
    name.chars().all(|letter| letter.is_alphanumeric() || letter == '_').then(|| name.to_owned())
}

/// The code of a file without comments and without its tests.
fn code_of(file: &Path) -> String {
    let text = fs::read_to_string(file).unwrap();
    let mut code = String::new();
    for line in text.lines() {
        if line.trim() == "#[cfg(test)]" {
            break;
        }
        if !line.trim_start().starts_with("//") {
            code += line;
            code.push('\n');
        }
    }
    code
}

/// The paths in `text` that begin with `prefix`, groups in braces opened: `crate::{a, b::c}` is `a` and `b::c`.
fn paths_after(text: &str, prefix: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices(prefix) {
        let is_word_before =
            text[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':');
        if !is_word_before {
            open(&text[at + prefix.len()..], &[], &mut found);
        }
    }
    found
}

fn open(text: &str, before: &[String], found: &mut Vec<Vec<String>>) {
    let Some(group) = text.strip_prefix('{') else {
        let word: String = text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        let path: Vec<String> = before.iter().cloned().chain([word.clone()]).collect();
        return match text[word.len()..].strip_prefix("::") {
            Some(rest) => open(rest, &path, found),
            None => found.push(path),
        };
    };
    let (mut depth, mut start) = (0, 0);
    for (place, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                let part = group[start..place].trim();
                if !part.is_empty() {
                    open(part, before, found);
                }
                start = place + 1;
                if letter == '}' {
                    return;
                }
            }
            _ => {}
        }
    }
}

/// What the code of `module` uses of its own crate: paths from the root.
fn uses(module: &[String], text: &str) -> Vec<Vec<String>> {
    let mut found = paths_after(text, "crate::");
    for climb in 1..=module.len() {
        let prefix = "super::".repeat(climb);
        for path in paths_after(text, &prefix) {
            if path.first().is_some_and(|word| word != "super") {
                found.push(module[..module.len() - climb].iter().cloned().chain(path).collect());
            }
        }
    }
    found
}

#[test]
fn groups_are_read() {
    let path = |text: &str| text.split("::").map(str::to_owned).collect::<Vec<_>>();
    let found = uses(&[], "use crate::{math, vision::{TipTracker, detect::tip}, rig};");
    assert_eq!(found, ["math", "vision::TipTracker", "vision::detect::tip", "rig"].map(path));
    let found = uses(&path("a::b"), "let x = super::c::Track::of(super::super::d);");
    assert_eq!(found, ["a::c::Track::of", "d"].map(path));
    assert_eq!(declaration("pub(crate) mod tip;").as_deref(), Some("tip"));
}

#[test]
fn every_module_uses_only_those_above_it() {
    let mut checked = 0;
    let mut violations = Vec::new();
    for (name, root) in [
        ("tropism-neat", "lib.rs"),
        ("jpeg-regions", "lib.rs"),
        ("tropism", "lib.rs"),
        ("tropism-bean", "lib.rs"),
        ("tropism-report", "lib.rs"),
        ("tropism-rig", "lib.rs"),
        ("tropism-lab", "lib.rs"),
        ("tropism-cli", "main.rs"),
    ] {
        let tree = Tree::of(&workspace().join("crates").join(name).join("src").join(root));
        for (module, file) in &tree.files {
            checked += 1;
            for used in uses(module, &code_of(file)) {
                let found = tree.violation(module, &tree.resolve(&used));
                violations.extend(found.map(|found| format!("{name}: {found}")));
            }
        }
    }
    violations.sort();
    violations.dedup();
    assert!(checked > 150, "{checked}");
    assert!(violations.is_empty(), "{} violations:\n{}", violations.len(), violations.join("\n"));
}

/// The words in backticks of a text.
fn quoted(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// The rows of the table of crates in `ARCHITECTURE.md`: the name of each crate, and of those that it may use.
fn crates_by_table() -> Vec<(String, BTreeSet<String>)> {
    let text = fs::read_to_string(workspace().join("ARCHITECTURE.md")).unwrap();
    text.lines()
        .filter_map(|line| {
            let (name, row) = line.strip_prefix("| `crates/")?.split_once('`')?;
            let uses = row.trim_end_matches([' ', '|']).rsplit('|').next()?;
            Some((name.to_owned(), quoted(uses).map(str::to_owned).collect()))
        })
        .take_while(|(name, _)| !name.contains('/'))
        .collect()
}

#[test]
fn crates_use_those_of_the_table() {
    let table = crates_by_table();
    let folders = fs::read_dir(workspace().join("crates")).unwrap();
    let found: BTreeSet<String> =
        folders.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    let named: BTreeSet<String> = table.iter().map(|(name, _)| name.clone()).collect();
    assert_eq!(named, found, "crates in the table of ARCHITECTURE.md, and in crates/");
    let mut above = BTreeSet::new();
    for (name, uses) in &table {
        let path = workspace().join("crates").join(name).join("Cargo.toml");
        let manifest: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
        let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table);
        let used: BTreeSet<String> = dependencies
            .into_iter()
            .flat_map(toml::Table::keys)
            .filter(|key| found.contains(*key))
            .cloned()
            .collect();
        assert_eq!(*uses, used, "{name}: crates in ARCHITECTURE.md, and in its Cargo.toml");
        assert!(used.is_subset(&above), "{name} uses a crate below it in the table");
        above.insert(name.clone());
    }
}

/// The reality gap is a gap only if the bean is not made of the model that is fitted to its photographs.
#[test]
fn the_bean_names_no_model() {
    let tree = Tree::of(&workspace().join("crates/tropism-bean/src/lib.rs"));
    for (module, file) in &tree.files {
        for used in paths_after(&code_of(file), "tropism::") {
            let is_model = [
                "plant",
                "simulation",
                "evolve",
                "prelude",
                "PlantModel",
                "simulate",
                "Evolution",
                "Champion",
            ]
            .contains(&used[0].as_str());
            assert!(!is_model, "{} uses tropism::{}", module.join("::"), used.join("::"));
        }
    }
}

#[test]
fn paths_in_the_architecture_exist() {
    let text = fs::read_to_string(workspace().join("ARCHITECTURE.md")).unwrap();
    let mut named = 0;
    for word in quoted(&text) {
        let is_path =
            word.contains('/') && !word.contains(' ') && !word.contains("::") && !word.contains('<');
        if is_path {
            let is_there = ["", "crates"].iter().any(|from| workspace().join(from).join(word).exists());
            assert!(is_there, "ARCHITECTURE.md names {word}, which does not exist");
            named += 1;
        }
    }
    assert!(named > 10, "{named}");
}

/// The files below `folder` that people write, without what is generated or fetched.
fn written_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "node_modules") {
            written_files(&path, found);
        }
        let is_written = path
            .extension()
            .and_then(|ending| ending.to_str())
            .is_some_and(|ending| ["rs", "js", "mjs", "css", "html"].contains(&ending));
        if is_written && path.is_file() {
            found.push(path);
        }
    }
}

/// A file of the page is about one thing, and can be read at a sitting.
#[test]
fn no_file_of_the_page_is_longer_than_400_lines() {
    let mut files = Vec::new();
    for folder in [
        "crates/tropism-studio/assets",
        "crates/tropism-studio/src",
        "crates/tropism-page/src",
        "web",
        "tests/studio",
        "tests/web",
    ] {
        written_files(&workspace().join(folder), &mut files);
    }
    assert!(files.len() > 80, "{}", files.len());
    for file in files {
        let lines = fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= 400, "{}: found {lines} lines, wanted 400 at most", file.display());
    }
}

/// All identifiers of the Rust files below `folder`.
fn identifiers(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
            identifiers(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).unwrap();
            found.extend(text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned));
        }
    }
}

#[test]
fn items_that_the_page_of_the_paper_names_exist() {
    let mut known = BTreeSet::new();
    identifiers(&workspace().join("crates"), &mut known);
    let text = fs::read_to_string(workspace().join("docs/explanation/paper.md")).unwrap();
    let mut named = 0;
    for item in quoted(&text) {
        let is_name =
            |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        // Paths of items and names of tests; other code is files, commands and values.
        let is_item = item.split("::").all(is_name) && (item.contains("::") || item.contains('_'));
        if is_item {
            let missing = item.split("::").find(|word| !known.contains(*word));
            assert!(missing.is_none(), "docs/explanation/paper.md names {item}: no {missing:?}");
            named += 1;
        }
    }
    assert!(named > 30, "{named}");
}

/// The packages of a lock file with their versions.
fn locked(path: &Path) -> BTreeSet<(String, String)> {
    let lock: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
    let text = |package: &toml::Value, key| package[key].as_str().unwrap().to_owned();
    lock["package"]
        .as_array()
        .unwrap()
        .iter()
        .map(|package| (text(package, "name"), text(package, "version")))
        .collect()
}

/// The Python crate is a workspace of its own. Where its versions or its profile drift away, `scripts/wheel --check` compiles
/// nearly everything once more.
#[test]
fn the_python_crate_shares_what_the_tests_compile() {
    let python = workspace().join("crates/tropism-py");
    let (ours, theirs) = (locked(&workspace().join("Cargo.lock")), locked(&python.join("Cargo.lock")));
    let names = |locked: &BTreeSet<(String, String)>| -> BTreeSet<String> {
        locked.iter().map(|(name, _)| name.clone()).collect()
    };
    let (our_names, their_names) = (names(&ours), names(&theirs));
    let drifted: Vec<_> =
        theirs.iter().filter(|one| our_names.contains(&one.0) && !ours.contains(*one)).collect();
    assert!(drifted.is_empty(), "versions that Cargo.lock of the workspace lacks: {drifted:?}");

    let profile = |folder: &Path| -> toml::Table {
        let manifest: toml::Table = fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap();
        let mut profile = manifest["profile"]["dev"].as_table().unwrap().clone();
        let packages = profile["package"].as_table_mut().unwrap();
        // The crate itself is in no other lock file.
        packages.retain(|name, _| name == "*" || their_names.contains(name) && our_names.contains(name));
        profile
    };
    assert_eq!(
        profile(&python),
        profile(&workspace()),
        "[profile.dev] of the Python crate is not the workspace's"
    );
}
