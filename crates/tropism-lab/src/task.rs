//! Tasks from files: a task file, a champion or a rule, which carry the task that they were made for, or a run folder.

use std::path::Path;

use tropism::task::{Task, TaskSpec};

use crate::controller::ControllerSpec;
use crate::run::RunConfig;
use crate::units::plural;
use crate::{Error, files};

/// Reads the task of a task file, of a champion or a rule, or of a run folder.
///
/// # Errors
/// [`Error`] names the file and what is wrong with it; a champion that carries no task is one.
pub fn read(path: &Path) -> Result<TaskSpec, Error> {
    if path.is_dir() {
        return Ok(RunConfig::read(path)?.task);
    }
    if files::read_text(path)?.trim_start().starts_with('{') {
        let controller = ControllerSpec::read(path)?;
        return controller.own_task().cloned().ok_or_else(|| {
            Error::Plan(format!("{}: found a network without its task, wanted a task", path.display()))
        });
    }
    let task: TaskSpec = files::read_toml(path)?;
    task.check().map_err(Error::at(path.display()))?;
    Ok(task)
}

/// The task with targets of the run whose track is the file `track`; `None` if it lies in no run folder, or its run had none.
///
/// # Errors
/// Those of [`RunConfig::read`].
pub fn of_track(track: &Path) -> Result<Option<TaskSpec>, Error> {
    let folder = track.parent().filter(|folder| folder.join("run.toml").exists());
    let task = folder.map(RunConfig::read).transpose()?.map(|run| run.task);
    Ok(task.filter(|task| task.has_goal()))
}

/// Checks that a task has something to reach: without, all controllers are worth the same.
pub(crate) fn check_goal(task: &TaskSpec) -> Result<(), Error> {
    if task.has_goal() {
        return Ok(());
    }
    Err(Error::Plan("`task`: found no targets, wanted a task with targets to reach".to_owned()))
}

/// Whether two tasks are the same but for the most steps that they may take.
#[must_use]
pub fn is_same_but_for_steps(one: &TaskSpec, other: &TaskSpec) -> bool {
    one.clone().with_max_steps(other.max_steps()) == *other
}

/// A task in a few words: `the targets (3, 6), (-5, 9), (-1, 13.5)`.
#[must_use]
pub fn in_words(task: &TaskSpec) -> String {
    if let Some(pole) = task.pole() {
        return format!("winding round a pole of {} cm", 2.0 * pole.radius_cm);
    }
    if let TaskSpec::RandomTargets(task) = task {
        return format!("{} up to {} cm", plural(task.count as usize, "random target"), task.highest_cm);
    }
    if task.targets().is_empty() && task.has_goal() {
        return "a form of the stem".to_owned();
    }
    let targets: Vec<String> = match task.way_in_space() {
        Some(way) => way.iter().map(|[x, y, z]| format!("({x}, {y}, {z})")).collect(),
        None => task.targets().iter().map(|target| format!("({}, {})", target.x, target.y)).collect(),
    };
    let targets = match targets.len() {
        0 => "no targets".to_owned(),
        1 => format!("the target {}", targets[0]),
        _ => format!("the targets {}", targets.join(", ")),
    };
    match task.obstacles().len() {
        0 => targets,
        count => format!("{targets} behind {}", plural(count, "obstacle")),
    }
}

/// What the fitness of a task is measured in: `cm`, or `turns` round a pole.
#[must_use]
pub fn unit(task: &TaskSpec) -> &'static str {
    if task.pole().is_some() { "turns" } else { "cm" }
}

/// The fitness of a plant with its unit, and the best there can be where it is known: `9.50 cm of at most 11.14`, or
/// `1.31 turns` round a pole.
#[must_use]
pub fn score_in_words(task: &TaskSpec, fitness: f64) -> String {
    let most = task.best_fitness().map_or_else(String::new, |best| format!(" of at most {best:.2}"));
    format!("{fitness:.2} {}{most}", unit(task))
}
