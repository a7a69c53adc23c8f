//! The structure that `ARCHITECTURE.md` promises: modules in the order of the data, and paths that exist.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// Modules in the order in which `lib.rs` lists them.
fn modules() -> Vec<String> {
    let lib = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    lib.lines()
        .filter_map(|line| Some(line.strip_prefix("pub mod ")?.strip_suffix(';')?.to_owned()))
        .collect()
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The words that follow `crate::` in `text`, braces opened.
fn uses(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let after = &text[at + "crate::".len()..];
        let word = |text: &str| -> String {
            text.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect()
        };
        match after.strip_prefix('{') {
            None => found.push(word(after)),
            Some(group) => {
                let mut depth = 0;
                let mut start = 0;
                for (place, letter) in group.char_indices() {
                    match letter {
                        '{' => depth += 1,
                        '}' if depth == 0 => {
                            found.push(word(group[start..place].trim()));
                            break;
                        }
                        '}' => depth -= 1,
                        ',' if depth == 0 => {
                            found.push(word(group[start..place].trim()));
                            start = place + 1;
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    found
}

#[test]
fn groups_are_read() {
    assert_eq!(uses("use crate::{math, vision::{Eye, lit}, rig};"), ["math", "vision", "rig"]);
    assert_eq!(uses("let x = crate::track::Track::default();"), ["track"]);
}

#[test]
fn every_module_uses_only_those_above_it() {
    let modules = modules();
    assert!(modules.len() > 10, "{modules:?}");
    for (place, module) in modules.iter().enumerate() {
        let mut sources = Vec::new();
        let folder = root().join("src").join(module);
        if folder.is_dir() {
            files(&folder, &mut sources);
        }
        sources.extend(Some(folder.with_extension("rs")).filter(|file| file.exists()));
        for source in sources {
            let text = fs::read_to_string(&source).unwrap();
            // A comment may point anywhere.
            let is_code = |line: &&str| !line.trim_start().starts_with("//");
            let text = text.lines().filter(is_code).collect::<Vec<_>>().join("\n");
            let shown = source.display();
            for used in uses(&text) {
                let Some(other) = modules.iter().position(|candidate| *candidate == used) else { continue };
                assert!(other <= place, "{shown} uses {used}, which stands below {module} in lib.rs");
            }
            // A module of depth 1 climbs to the root by one `super::`; in a test module that is the module itself.
            let place = source.strip_prefix(root().join("src")).unwrap();
            let depth = place.components().count() - usize::from(place.ends_with("mod.rs"));
            let outside_tests = text.split("#[cfg(test)]").next().unwrap_or_default();
            let is_climbing = outside_tests.contains(&"super::".repeat(depth));
            assert!(!is_climbing, "{shown} climbs to the root by super::");
        }
    }
}

#[test]
fn paths_in_the_architecture_exist() {
    let workspace = root().join("../..");
    let text = fs::read_to_string(workspace.join("ARCHITECTURE.md")).unwrap();
    let mut named = 0;
    for word in text.split('`').skip(1).step_by(2) {
        let is_path =
            word.contains('/') && !word.contains(' ') && !word.contains("::") && !word.contains('<');
        if is_path {
            assert!(workspace.join(word).exists(), "ARCHITECTURE.md names {word}, which does not exist");
            named += 1;
        }
    }
    assert!(named > 10, "{named}");
}
