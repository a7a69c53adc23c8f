//! Work that a page begins: forms whose values become a command of `tropism`.

mod forms;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism_lab::Workflow;
use tropism_lab::make_rig::MakeRigPlan;

use self::forms::{FORMS, Field, Form, Input};
use crate::error::Refusal;
use crate::found::{Finder, Kind, resolve};
use crate::{Studio, draw, jobs};

/// Files and folders that are offered at most.
const MOST_OFFERED: usize = 500;

/// Bytes of an address at most; chosen, longer than any URL of a device.
const LONGEST_ADDRESS: usize = 1000;

/// A form of the page.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct ShownForm {
    /// Also the command.
    name: &'static str,
    title: &'static str,
    says: &'static str,
    fields: Vec<ShownField>,
}

/// A field of a form.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ShownField {
    name: &'static str,
    label: &'static str,
    kind: FieldKind,
    preset: &'static str,
    is_needed: bool,
    /// Values to choose from.
    offered: Vec<String>,
}

/// How a field is filled in.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
enum FieldKind {
    Choice,
    Number,
    Flag,
    Name,
    /// One of the values that are offered, or another.
    Place,
}

/// The forms, with what lies in the folder of the studio to choose from.
pub(crate) fn forms(studio: &Studio) -> Vec<ShownForm> {
    let work = Finder::default().find(&studio.root);
    let places = |kinds: &[Kind]| -> Vec<String> {
        work.iter().filter(|found| kinds.contains(&found.kind)).map(|found| found.at.clone()).collect()
    };
    let all = files_below(&studio.root);
    let with_ending = |endings: &[&str]| -> Vec<String> {
        let has = |at: &&String| at.rsplit_once('.').is_some_and(|(_, ending)| endings.contains(&ending));
        all.iter().filter(has).cloned().collect()
    };
    let offered = |input: &Input| -> Vec<String> {
        match input {
            Input::Work(kinds) => places(kinds),
            Input::File(endings) => with_ending(endings),
            Input::Folder => all.iter().filter_map(|at| Some(at.rsplit_once('/')?.0.to_owned())).collect(),
            Input::Rig => [vec!["greenhouse".to_owned()], with_ending(&["toml"])].concat(),
            Input::Controller => {
                let champions =
                    places(&[Kind::Evolution]).into_iter().map(|at| format!("{at}/champion.json"));
                let champions = champions.filter(|at| studio.root.join(at).is_file());
                let plain = ["greedy", "periodic", "periodic:6h"].map(str::to_owned);
                plain.into_iter().chain(champions).chain(places(&[Kind::Rule])).collect()
            }
            Input::Word(words) => words.iter().map(|word| (*word).to_owned()).collect(),
            Input::Name(_) | Input::Address | Input::Whole(..) | Input::Flag => Vec::new(),
        }
    };
    let field = |field: &Field| {
        let mut offered = offered(&field.input);
        offered.dedup();
        offered.truncate(MOST_OFFERED);
        let kind = match field.input {
            Input::Work(_) | Input::Word(_) => FieldKind::Choice,
            Input::Whole(..) => FieldKind::Number,
            Input::Flag => FieldKind::Flag,
            Input::Name(_) => FieldKind::Name,
            Input::File(_) | Input::Folder | Input::Rig | Input::Controller | Input::Address => {
                FieldKind::Place
            }
        };
        let Field { name, label, preset, is_needed, .. } = *field;
        ShownField { name, label, kind, preset, is_needed, offered }
    };
    let form = |form: &Form| {
        let Form { name, title, says, fields } = *form;
        ShownForm { name, title, says, fields: fields.iter().map(field).collect() }
    };
    FORMS.iter().map(form).collect()
}

/// Files in a folder and in those in it, without what is hidden and photographs of runs.
pub(crate) fn files_below(root: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![String::new()];
    while let Some(at) = folders.pop() {
        let mut names: Vec<_> = std::fs::read_dir(root.join(&at)).into_iter().flatten().flatten().collect();
        names.sort_unstable_by_key(std::fs::DirEntry::file_name);
        for entry in names {
            let (Ok(name), Ok(kind)) = (entry.file_name().into_string(), entry.file_type()) else { continue };
            if name.starts_with('.') || found.len() >= MOST_OFFERED * 4 {
                continue;
            }
            let below = if at.is_empty() { name } else { format!("{at}/{name}") };
            if kind.is_file() {
                found.push(below);
            } else if kind.is_dir() && !at.contains('/') {
                folders.push(below);
            }
        }
    }
    found
}

/// A form that was filled in.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Filled {
    form: String,
    /// Values by the names of fields; what is left out or empty is not given.
    values: BTreeMap<String, String>,
}

/// A command, and the place of what it makes.
pub(crate) struct Begun {
    pub(crate) words: Vec<String>,
    pub(crate) at: String,
    /// Whether it is the run of a plant, which waits in no queue.
    pub(crate) is_run: bool,
}

impl Filled {
    /// The value of the field `name`, if one is given.
    fn value(&self, name: &str) -> Option<&str> {
        self.values.get(name).map(|value| value.trim()).filter(|value| !value.is_empty())
    }

    /// The command of the form.
    ///
    /// # Errors
    /// [`Refusal`] that names the field whose value cannot be used.
    pub(crate) fn command(&self, studio: &Studio) -> Result<Begun, Refusal> {
        let form = FORMS.iter().find(|form| form.name == self.form);
        let form = form.ok_or_else(|| Refusal::missing(format!("found no form {:?}", self.form)))?;
        let kind =
            form.fields.iter().find(|field| field.name == "kind").and_then(|field| self.value(field.name));
        let mut words = vec![form.name.to_owned()];
        let mut made = String::new();
        for field in form.fields {
            let Some(value) = self.value(field.name) else {
                if field.is_needed {
                    return Err(Refusal::bad(format!("{}: fill it in.", field.label)));
                }
                continue;
            };
            let refused =
                |Refusal(status, text): Refusal| Refusal(status, format!("{}: {text}", field.label));
            match field.input {
                Input::Flag => {
                    if value == "true" {
                        words.push(field.option.to_owned());
                    }
                    continue;
                }
                // It is the ending of the film.
                Input::Word(kinds) if field.option.is_empty() => {
                    one_of(value, kinds).map_err(refused)?;
                    continue;
                }
                _ => {}
            }
            let checked = field.input.check(studio, value).map_err(refused)?;
            // The kind of a film stands before its name, and is one of those that there are.
            let checked = match (&field.input, kind) {
                (Input::Name(""), Some(kind)) => format!("{checked}.{kind}"),
                _ => checked,
            };
            if matches!(field.input, Input::Name(_)) {
                if studio.root.join(&checked).exists() || studio.queue.has(&checked) {
                    return Err(Refusal::bad(format!("{}: {checked} is there already.", field.label)));
                }
                made.clone_from(&checked);
            }
            if !field.option.is_empty() {
                words.push(field.option.to_owned());
            }
            words.push(checked);
        }
        Ok(Begun { words, at: made, is_run: form.name == "run" })
    }

    /// The plan of a rig file at `out`, if that is what the form makes: it is written at once, as nothing waits for it.
    pub(crate) fn rig(&self, out: PathBuf) -> Option<MakeRigPlan> {
        let given = |name: &str| self.value(name).map(str::to_owned);
        (self.form == "make-rig").then(|| MakeRigPlan {
            camera: given("camera").unwrap_or_default(),
            camera_at: given("camera_at"),
            lamps: given("lamps").unwrap_or_default(),
            lamps_at: given("lamps_at"),
            flash: given("flash"),
            flash_at: given("flash_at"),
            broker: given("broker"),
            out,
            replace: false,
        })
    }
}

fn one_of(value: &str, words: &[&str]) -> Result<String, Refusal> {
    if words.contains(&value) {
        return Ok(value.to_owned());
    }
    Err(Refusal::bad(format!("found {value:?}, wanted one of {}", words.join(", "))))
}

impl Input {
    /// The value as a word of the command.
    fn check(&self, studio: &Studio, value: &str) -> Result<String, Refusal> {
        // Else it would be an option.
        let place = |value: &str| {
            if value.starts_with('-') {
                return Err(Refusal::bad(format!(
                    "found {value:?}, wanted a place that begins with no dash"
                )));
            }
            resolve(&studio.root, value)
        };
        match self {
            Self::Work(kinds) => {
                let kind = Kind::of(&place(value)?);
                if !kind.is_some_and(|kind| kinds.contains(&kind)) {
                    return Err(Refusal::bad(format!("found no such work at {value:?}")));
                }
            }
            Self::File(endings) => {
                let ending = value.rsplit_once('.').map_or("", |(_, ending)| ending);
                one_of(ending, endings)?;
                if !place(value)?.is_file() {
                    return Err(Refusal::bad(format!("found no file {value:?}")));
                }
            }
            Self::Folder => {
                if !place(value)?.is_dir() {
                    return Err(Refusal::bad(format!("found no folder {value:?}")));
                }
            }
            Self::Rig if value == "greenhouse" => {}
            Self::Rig => return Self::File(&["toml"]).check(studio, value),
            Self::Controller if value == "greedy" || is_periodic(value) => {}
            Self::Controller => return Self::File(&["json", "toml"]).check(studio, value),
            Self::Name(ending) => {
                let name = value.strip_suffix(*ending).unwrap_or(value);
                draw::check_name(name)?;
                return Ok(format!("{name}{ending}"));
            }
            Self::Address => {
                if value.starts_with('-') || value.contains(char::is_control) || value.len() > LONGEST_ADDRESS
                {
                    return Err(Refusal::bad(format!(
                        "wanted an address of at most {LONGEST_ADDRESS} bytes that begins with no dash"
                    )));
                }
            }
            Self::Whole(low, high) => {
                if !value.parse::<u64>().is_ok_and(|number| (*low..=*high).contains(&number)) {
                    return Err(Refusal::bad(format!(
                        "found {value:?}, wanted a whole number from {low} to {high}"
                    )));
                }
            }
            Self::Word(words) => return one_of(value, words),
            Self::Flag => {}
        }
        Ok(value.to_owned())
    }
}

/// Whether a value is `periodic`, also with a time.
fn is_periodic(value: &str) -> bool {
    let time = value.strip_prefix("periodic");
    time.is_some_and(|time| {
        time.is_empty()
            || (time.starts_with(':')
                && time.len() < 12
                && time[1..].bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'.'))
    })
}

/// The command of a form as a person types it, and the place of what it makes.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Preview {
    command: String,
    at: String,
}

/// The command of a form as a person types it.
pub(crate) fn preview(studio: &Studio, filled: &Filled) -> Result<Preview, Refusal> {
    let Begun { words, at, .. } = filled.command(studio)?;
    if let Some(plan) = filled.rig(studio.root.join(&at)) {
        plan.check()?;
    }
    Ok(Preview { command: jobs::line(&words), at })
}
