//! Controllers as the command line names them.

use std::path::PathBuf;
use std::str::FromStr;

use anyhow::{Result, ensure};
use tropism::lamps::Layout;
use tropism::task::Task;
use tropism::track::PAPER_PERIOD_MIN;
use tropism_lab::ControllerSpec;
use tropism_lab::controller::PAPER_SWITCH_MIN;
use tropism_lab::task::is_same_but_for_steps;
use tropism_lab::transfer::{ControllerSource, NamedController};

use crate::options::{TaskOption, parse_minutes};
use crate::shell::Shell;

/// A controller by name: `periodic`, `periodic:6h`, `greedy`, or the file of an evolved network or a tuned rule.
#[derive(Clone, Debug)]
pub(crate) enum ControllerName {
    /// Each lamp in turn for so many minutes.
    Periodic(f64),
    /// The lamp towards the next target.
    Greedy,
    /// A champion, a genome or a rule as JSON.
    File(PathBuf),
}

impl FromStr for ControllerName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            _ if text == "periodic" => Ok(Self::Periodic(PAPER_SWITCH_MIN)),
            _ if text == "greedy" => Ok(Self::Greedy),
            Some(("periodic", time)) => Ok(Self::Periodic(parse_minutes(time)?)),
            _ if is_word(text) => Err(format!("there is no file of this name: name {KINDS}")),
            _ => Ok(Self::File(text.into())),
        }
    }
}

/// What a controller may be.
const KINDS: &str = "periodic, periodic:6h (or 90m, 2d), greedy, or the file of an evolved network (champion.json) or a \
                     tuned rule (rule.json)";

/// Whether `text` can only be meant as the name of a kind of controller: no file has it, and it does not look like one.
fn is_word(text: &str) -> bool {
    let path = std::path::Path::new(text);
    !path.exists() && path.extension().is_none() && path.components().count() <= 1
}

impl ControllerName {
    /// The file that it is read from, if there is one.
    pub(crate) const fn file(&self) -> Option<&PathBuf> {
        match self {
            Self::File(path) => Some(path),
            Self::Periodic(_) | Self::Greedy => None,
        }
    }

    /// The controller; a file is read.
    pub(crate) fn load(&self) -> Result<ControllerSpec> {
        Ok(match self {
            Self::Periodic(minutes) => ControllerSpec::periodic(*minutes),
            Self::Greedy => ControllerSpec::Greedy,
            Self::File(path) => ControllerSpec::read(path)?,
        })
    }

    /// The controller for a comparison, named as on the command line; a path may be a folder of champions.
    pub(crate) fn source(&self) -> ControllerSource {
        let named = |name: String, controller| ControllerSource::Named(NamedController { name, controller });
        match self {
            Self::Periodic(minutes) => {
                let (time, unit) =
                    if minutes % 60.0 == 0.0 { (minutes / 60.0, 'h') } else { (*minutes, 'm') };
                named(format!("periodic-{time}{unit}"), ControllerSpec::periodic(*minutes))
            }
            Self::Greedy => named("greedy".to_owned(), ControllerSpec::Greedy),
            Self::File(path) => ControllerSource::Path(path.clone()),
        }
    }
}

/// Under which conditions several controllers are compared.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Conditions {
    pub(crate) task: Task,
    pub(crate) layout: Layout,
    pub(crate) period_min: f64,
}

/// The conditions for `controllers`: the task of the file, else the one that they were evolved or tuned for, or the paper's;
/// their lamps and period, or the paper's.
///
/// # Errors
/// If they were made for different tasks and no file is named, or for different lamps or periods.
pub(crate) fn conditions_of<'c>(
    controllers: impl Iterator<Item = &'c ControllerSpec> + Clone,
    file: &TaskOption,
) -> Result<Conditions> {
    let mut tasks = controllers.clone().filter_map(ControllerSpec::own_task);
    let task = match tasks.next().filter(|_| file.task.is_none()) {
        Some(task) => {
            let is_one = tasks.all(|other| other == task);
            ensure!(is_one, "these controllers were made for different tasks: choose one by --task");
            task.clone()
        }
        None => file.load()?,
    };
    let mut made = controllers.filter_map(|one| one.own_layout().zip(one.own_period_min()));
    let (layout, period_min) = made
        .next()
        .map_or((Layout::default(), PAPER_PERIOD_MIN), |(layout, period)| (layout.clone(), period));
    let is_alike = made.all(|(other, period)| *other == layout && period == period_min);
    ensure!(is_alike, "these controllers are for different lamps or periods: compare them apart");
    Ok(Conditions { task, layout, period_min })
}

/// The task for `controller`: that of the file, its own, or the paper's for such a controller; in `steps` at most. Says so
/// where the file names another than its own.
pub(crate) fn task_for(
    controller: &ControllerSpec,
    file: &TaskOption,
    steps: Option<u32>,
    shell: &Shell,
) -> Result<Task> {
    let task = match file.named()? {
        Some(task) => {
            note_other_task(controller, &task, shell);
            task
        }
        None => controller.default_task(),
    };
    Ok(match steps {
        Some(max_steps) => Task { max_steps, ..task },
        None => task,
    })
}

/// The task of the file; else the one that a champion was evolved for or a rule was tuned for, or the paper's three targets.
/// Says so where the file names another than its own.
pub(crate) fn task_of_champion(
    controller: &ControllerSpec,
    file: &TaskOption,
    shell: &Shell,
) -> Result<Task> {
    if let Some(task) = file.named()? {
        note_other_task(controller, &task, shell);
        return Ok(task);
    }
    Ok(controller.own_task().cloned().unwrap_or_default())
}

/// Says that `controller` was made for another task than `task`, if it was.
pub(crate) fn note_other_task(controller: &ControllerSpec, task: &Task, shell: &Shell) {
    if let Some(own) = controller.own_task().filter(|own| !is_same_but_for_steps(own, task)) {
        let (own, task) = (own.title(), task.title());
        shell.note(&format!("the controller was made for {own}; --task gives it {task}"));
    }
}
