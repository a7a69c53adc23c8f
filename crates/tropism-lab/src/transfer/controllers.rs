//! The controllers that are compared, each with the name that tables and folders give it.
//!
//! In: words, champion files and folders of champions. Out: controllers as data with distinct names.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::lamps::Layout;

use crate::Error;
use crate::controller::ControllerSpec;
use crate::files::{self, FileError};

/// A controller with its name in tables and folders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedController {
    /// Letters, digits, `-`, `_` and `.`.
    pub name: String,
    /// The controller.
    pub controller: ControllerSpec,
}

/// Where a controller comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum ControllerSource {
    /// A controller without a file, such as `greedy`.
    Named(NamedController),
    /// A champion file, a network alone, a rule file, or a folder of them.
    Path(PathBuf),
}

/// Reads the controllers of `sources`, in order.
///
/// A file gives the controller in it, named after the file; parts of its path are added where two files have one name. A
/// folder gives those in its folder `champions` if it has one (the folder of an evolution), else those in itself.
///
/// # Errors
/// [`Error`] names the file or folder that cannot be read or holds no champion, or two names of one controller.
pub fn read_controllers(sources: &[ControllerSource]) -> Result<Vec<NamedController>, Error> {
    let (mut controllers, mut places, mut files) = (Vec::new(), Vec::new(), Vec::new());
    for source in sources {
        match source {
            ControllerSource::Named(controller) => controllers.push(controller.clone()),
            ControllerSource::Path(path) => {
                for file in champion_files(path)? {
                    places.push(controllers.len());
                    let controller = ControllerSpec::read(&file)?;
                    controllers.push(NamedController { name: String::new(), controller });
                    files.push(file);
                }
            }
        }
    }
    for (place, name) in places.into_iter().zip(names_of(&files)) {
        controllers[place].name = name;
    }
    check_distinct(&controllers)?;
    Ok(controllers)
}

/// Checks that no controller is given twice: `champion.json` of an evolution is one of its champions, too.
fn check_distinct(controllers: &[NamedController]) -> Result<(), Error> {
    for (place, NamedController { name, controller }) in controllers.iter().enumerate() {
        if let Some(same) = controllers[..place].iter().find(|other| other.controller == *controller) {
            return Err(Error::Plan(format!(
                "`controllers`: {} and {name} are the same controller: name it once",
                same.name
            )));
        }
    }
    Ok(())
}

/// The champion files that `path` stands for.
fn champion_files(path: &Path) -> Result<Vec<PathBuf>, Error> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let champions = path.join("champions");
    let folder = if champions.is_dir() { champions } else { path.to_owned() };
    let found: Vec<PathBuf> =
        files::list(&folder, "json")?.into_iter().filter(|file| is_champion(file)).collect();
    if found.is_empty() {
        let problem = "no champion, network or rule in this folder: no file such as champion.json";
        return Err(FileError::content(&folder, problem).into());
    }
    Ok(found)
}

/// Whether a file says that it is a champion, a network or a rule. Checkpoints, models and summaries beside them do not.
fn is_champion(file: &Path) -> bool {
    #[derive(Deserialize)]
    struct Head {
        schema: String,
    }
    let head: Result<Head, _> = files::read_as(file, |text| serde_json::from_str(text));
    head.is_ok_and(|head| {
        ["tropism.champion/", "tropism.genome/", "tropism.rule/"]
            .iter()
            .any(|known| head.schema.starts_with(known))
    })
}

/// A name for each file: its own name, with as many folders before it as it takes to tell all of them apart.
fn names_of(files: &[PathBuf]) -> Vec<String> {
    let deepest = files.iter().map(|file| file.components().count()).max().unwrap_or(1);
    let names = |depth: usize| files.iter().map(|file| short_name(file, depth)).collect::<Vec<_>>();
    let is_distinct = |names: &Vec<String>| repeated(names).is_none();
    (1..deepest).map(names).find(is_distinct).unwrap_or_else(|| names(deepest))
}

/// The last `depth` parts of a path without its extension, joined by `-`, other characters replaced.
fn short_name(file: &Path, depth: usize) -> String {
    let stem = file.with_extension("");
    let parts: Vec<_> = stem.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    let name = parts[parts.len().saturating_sub(depth)..].join("-");
    name.chars().map(|letter| if is_of_name(letter) { letter } else { '-' }).collect()
}

/// Whether a name may have this character: names are parts of file names, of tables and of figures.
const fn is_of_name(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || matches!(letter, '-' | '_' | '.')
}

/// Checks a name in the part `key` of a plan.
///
/// # Errors
/// [`Error::Plan`] unless it can be a part of a file name.
fn check_name(key: &str, name: &str) -> Result<(), Error> {
    if !name.is_empty() && !name.starts_with('.') && name.chars().all(is_of_name) {
        return Ok(());
    }
    Err(Error::Plan(format!(
        "`{key}`: found the name {name:?}, wanted letters, digits, -, _ and ., no . first"
    )))
}

/// Checks that names are parts of file names, that each comes once, and none is one of those `reserved`.
pub(crate) fn check_names<'n>(
    key: &str,
    reserved: &[&'n str],
    names: impl Iterator<Item = &'n str>,
) -> Result<(), Error> {
    let mut known = reserved.to_vec();
    for name in names {
        check_name(key, name)?;
        if known.contains(&name) {
            let others = if reserved.is_empty() {
                String::new()
            } else {
                format!(", or is one of {}", reserved.join(", "))
            };
            return Err(Error::Plan(format!(
                "`{key}`: the name {name:?} stands twice{others}: give each its own"
            )));
        }
        known.push(name);
    }
    Ok(())
}

/// The first name that comes up twice.
pub(crate) fn repeated(names: &[String]) -> Option<&String> {
    names.iter().enumerate().find(|(place, name)| names[..*place].contains(name)).map(|(_, name)| name)
}

/// Checks that the controllers can be distinguished, and fit the lamps and the period.
pub(super) fn check(controllers: &[NamedController], layout: &Layout, period_min: f64) -> Result<(), Error> {
    if controllers.is_empty() {
        return Err(Error::Plan("`controllers` is empty: name at least one".to_owned()));
    }
    let names: Vec<String> = controllers.iter().map(|one| one.name.clone()).collect();
    if let Some(name) = repeated(&names) {
        return Err(Error::Plan(format!("`controllers`: {name} stands twice: name it once")));
    }
    for NamedController { name, controller } in controllers {
        check_name("controllers", name)?;
        controller.check(layout, period_min).map_err(Error::at(name))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use tropism::evolve::Champion;

    use super::*;

    fn champion(seed: u64) -> String {
        let config = tropism_neat::Config::wahby2016();
        Champion::of_genome(tropism_neat::random_genome(&config, 2, 1, seed, 0)).to_json()
    }

    fn named(name: &str, controller: ControllerSpec) -> NamedController {
        NamedController { name: name.to_owned(), controller }
    }

    #[test]
    fn the_folder_of_an_evolution_gives_its_champions() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| files::write(&folder.path().join(name), text.as_bytes()).unwrap();
        files::make_folder(&folder.path().join("champions")).unwrap();
        put("champion.json", &champion(1));
        put("champions/run-00.json", &champion(1));
        put("champions/run-01.json", &champion(2));
        put("champions/notes.json", "{\"schema\": \"tropism.model/2\"}");
        let sources = [
            ControllerSource::Named(named("greedy", ControllerSpec::Greedy)),
            ControllerSource::Path(folder.path().to_owned()),
        ];
        let names: Vec<String> =
            read_controllers(&sources).unwrap().into_iter().map(|one| one.name).collect();
        assert_eq!(names, ["greedy", "run-00", "run-01"]);
        let twice = [ControllerSource::Path(folder.path().join("champion.json")), sources[1].clone()];
        let error = read_controllers(&twice).unwrap_err().to_string();
        assert!(error.contains("champion and run-00 are the same controller"), "{error}");
        let empty = tempfile::tempdir().unwrap();
        let error =
            read_controllers(&[ControllerSource::Path(empty.path().to_owned())]).unwrap_err().to_string();
        assert!(error.contains("no champion"), "{error}");
        let absent =
            read_controllers(&[ControllerSource::Path("absent.json".into())]).unwrap_err().to_string();
        assert!(absent.contains("absent.json: cannot read"), "{absent}");
    }

    #[test]
    fn files_of_one_name_get_those_of_their_folders() {
        let names = |files: &[&str]| names_of(&files.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(names(&["a/champion.json", "b/rule.json"]), ["champion", "rule"]);
        assert_eq!(names(&["x/a/champion.json", "x/b/champion.json"]), ["a-champion", "b-champion"]);
        assert_eq!(names(&["my lab/best one.json"]), ["best-one"]);
        assert_eq!(names(&["a.json", "a.json"]), ["a", "a"]);
    }

    #[test]
    fn controllers_are_told_apart() {
        let error = |controllers: &[NamedController]| {
            check(controllers, &Layout::default(), 5.0).unwrap_err().to_string()
        };
        assert!(error(&[]).contains("`controllers` is empty"));
        let greedy = named("greedy", ControllerSpec::Greedy);
        assert!(error(&[greedy.clone(), greedy.clone()]).contains("greedy stands twice"));
        assert!(error(&[named("a/b", ControllerSpec::Greedy)]).contains("found the name \"a/b\""));
        check(&[greedy, named("periodic-6h", ControllerSpec::default())], &Layout::default(), 5.0).unwrap();
    }
}
