//! Draw a target: what is within reach, evolution as a job, and trying a champion on a virtual bean.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::control::Controller;
use tropism::lamps::Layout;
use tropism::simulation::ModelKind;
use tropism::task::Task;
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::{Reach, Species};
use tropism_lab::controller::ControllerSpec;
use tropism_lab::files;
use tropism_page::{
    self as page, Drawing, MODELS, MOST_STEPS, Method, TriedBean, commands, model_of, rule_file, schedule_of,
};

use crate::error::Refusal;
use crate::found::{self, Kind};
use crate::{Studio, evolution, jobs};

/// Generations of an evolution that a page asks for, at most.
pub(crate) const MOST_GENERATIONS: u32 = 100_000;

/// What virtual common beans reach, as the page shows it.
#[derive(Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct ToldReach {
    is_virtual: bool,
    #[serde(flatten)]
    reach: &'static Reach,
}

pub(crate) fn reach() -> ToldReach {
    ToldReach { is_virtual: true, reach: Species::common_reach() }
}

/// Who steers a bean that is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum Who {
    Champion,
    Greedy,
    You,
}

/// A bean to try a controller on.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TryPlan {
    pub(crate) who: Who,
    /// JSON of the [`Drawing`].
    pub(crate) drawing: String,
    /// The evolution whose champion steers, or the tuned rule that does.
    #[serde(default)]
    pub(crate) at: String,
    /// The run of the evolution; the champion of all by default.
    pub(crate) run: Option<u32>,
    /// Seed of the bean.
    pub(crate) seed: u64,
    /// With [`Who::You`], a letter `l` or `r` for each step so far.
    #[serde(default)]
    pub(crate) lights: String,
    /// The first step that is sent.
    #[serde(default)]
    pub(crate) from: usize,
}

/// Grows the bean.
pub(crate) fn try_out(studio: &Studio, plan: &TryPlan) -> Result<TriedBean, Refusal> {
    let task = Drawing::read(&plan.drawing)?.task()?;
    let layout = Layout::default();
    let mut controller: Box<dyn Controller> = match plan.who {
        Who::Greedy => ControllerSpec::Greedy.build(&task, &layout, PAPER_PERIOD_MIN),
        Who::Champion => {
            let path = found::resolve_work(&studio.root, &plan.at)?;
            let spec = match found::Kind::of(&path) {
                Some(found::Kind::Rule) if !path.exists() => {
                    return Err(Refusal::missing("the rule is still searched for"));
                }
                Some(found::Kind::Rule) => ControllerSpec::read(&path)?,
                _ => {
                    let folder = found::resolve_kind(&studio.root, &plan.at, found::Kind::Evolution)?;
                    evolution::controller(&folder, plan.run)?
                }
            };
            spec.check(&layout, PAPER_PERIOD_MIN)?;
            spec.build(&task, &layout, PAPER_PERIOD_MIN)
        }
        Who::You => Box::new(schedule_of(&plan.lights)?),
    };
    let most = if plan.who == Who::You { plan.lights.len() as u32 } else { MOST_STEPS };
    Ok(page::try_out(&task, controller.as_mut(), plan.seed, most, plan.from))
}

/// An evolution, or a search for a rule, that a page asks for.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct EvolveRequest {
    pub(crate) name: String,
    pub(crate) drawing: Drawing,
    #[serde(default)]
    pub(crate) method: Method,
    #[serde(default = "four")]
    pub(crate) runs: u32,
    #[serde(default = "three_hundred")]
    pub(crate) generations: u32,
    #[serde(default = "one")]
    pub(crate) seed: u64,
    /// File of the model; that of virtual beans if it is left out.
    pub(crate) model: Option<String>,
}

const fn four() -> u32 {
    4
}

const fn three_hundred() -> u32 {
    300
}

const fn one() -> u64 {
    1
}

/// Checks the name of what is to be made in the folder of the studio.
pub(crate) fn check_name(name: &str) -> Result<(), Refusal> {
    let is_taken = Kind::is_named_by(&format!("{name}.toml")) || found::PASSED_OVER.contains(&name);
    if is_taken {
        return Err(Refusal::bad(format!("the name {name:?} has a meaning of its own: choose another")));
    }
    let is_plain = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
    if (1..=60).contains(&name.len()) && is_plain && !name.starts_with('-') {
        return Ok(());
    }
    Err(Refusal::bad(format!("found the name {name:?}, wanted letters, digits, - and _, 60 at most")))
}

/// An evolution or a search that waits in the queue.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Evolving {
    /// Number of its job.
    job: u64,
    /// Where it will lie.
    at: String,
    /// Text of its task file.
    task: String,
    /// The commands that do the same.
    commands: Vec<String>,
}

/// Puts an evolution or a search for a drawing into the queue: its place, and the commands that do the same.
pub(crate) fn evolve(studio: &Studio, request: &EvolveRequest) -> Result<Evolving, Refusal> {
    let EvolveRequest { name, drawing, method, runs, generations, seed, model } = request;
    let saved = save(studio, name, drawing, false)?;
    if !(1..=1000).contains(runs) || !(1..=MOST_GENERATIONS).contains(generations) {
        return Err(Refusal::bad("wanted 1 to 1000 runs of 1 to 100000 generations"));
    }
    let at = match method {
        Method::Evolve => name.clone(),
        Method::Tune => rule_file(name),
    };
    if studio.root.join(&at).exists() || studio.queue.has(&at) {
        return Err(Refusal::bad(format!("{at}: something of this name is here already: choose a new one")));
    }
    let mut commands = Vec::new();
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<String>>();
    let model = match model {
        Some(model) => {
            found::resolve(&studio.root, model)?;
            model.clone()
        }
        None => {
            let (model, making) = model_of(drawing, *method);
            if !studio.root.join(model).exists() {
                commands.extend(making.map(|line| words(&line)));
            }
            model.to_owned()
        }
    };
    let (command, more) = match method {
        Method::Evolve => {
            ("evolve", format!("--runs {runs} --generations {generations} --seed {seed} --checkpoint 1"))
        }
        Method::Tune => ("tune", format!("--generations {generations} --seed {seed}")),
    };
    let mut last = vec![command.to_owned(), "--model".to_owned(), model];
    last.extend(words(&format!("--task {name}.toml --out {at} {more}")));
    commands.push(last);
    let lines: Vec<String> = commands.iter().map(|words| jobs::line(words)).collect();
    let job = studio.queue.add(&at, commands).map_err(|error| Refusal::bad(error.to_string()))?;
    Ok(Evolving { job, at, task: saved.task, commands: lines })
}

/// A task file that was written.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct SavedTask {
    /// Its text.
    task: String,
    file: String,
    /// Commands that use it.
    commands: Vec<String>,
}

/// Writes the task file of a drawing: its text, and the commands that use it. Another task of this name is an error, or makes
/// room if it is to be replaced.
pub(crate) fn save(
    studio: &Studio,
    name: &str,
    drawing: &Drawing,
    replace: bool,
) -> Result<SavedTask, Refusal> {
    check_name(name)?;
    let text = drawing.to_toml()?;
    let path = studio.root.join(format!("{name}.toml"));
    match files::read_text(&path) {
        Ok(found) if found == text => {}
        Ok(found) if !(replace && toml::from_str::<Task>(&found).is_ok()) => {
            return Err(Refusal::bad(format!("{name}.toml: another task has this name: choose a new one")));
        }
        _ => files::write(&path, text.as_bytes())?,
    }
    Ok(SavedTask { task: text, file: format!("{name}.toml"), commands: commands(name, drawing) })
}

/// Whether the file of a model is of one of the whole stem.
pub(crate) fn knows_stem(path: &Path) -> bool {
    files::read_text(path).is_ok_and(|text| ModelKind::of_file(&text).is_some_and(ModelKind::knows_stem))
}

/// Files of models in the folder of the studio: names of the usual ones that are there.
pub(crate) fn models(root: &Path) -> Vec<String> {
    let mut folders = vec![String::new()];
    let entries = std::fs::read_dir(root).into_iter().flatten().flatten();
    let is_folder = |entry: &std::fs::DirEntry| entry.file_type().is_ok_and(|kind| kind.is_dir());
    folders.extend(entries.filter(is_folder).filter_map(|entry| entry.file_name().into_string().ok()));
    folders.retain(|folder| !folder.starts_with('.'));
    folders.sort_unstable();
    let mut found = Vec::new();
    for folder in folders {
        for name in MODELS.into_iter().chain(["model.json", "stem.json"]) {
            let at = if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") };
            if root.join(&at).is_file() {
                found.push(at);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain() {
        assert!(check_name("my-task_2").is_ok());
        // A file of this name would make the folder a run, and one of these folders is passed over.
        for name in ["run", "sweep", "walls", "target"] {
            assert!(check_name(name).is_err(), "{name}");
        }
        for name in ["", "a/b", "..", "-x", "a b", "<b>", "ä", &"x".repeat(61)] {
            assert!(check_name(name).is_err(), "{name}");
        }
    }
}
